// The rows of v_00 wait until the last of them has been measured, then each leaves once, in order, with the measured
// shift: the sum of its limbs where there are two. Later rows leave with the constant shift. No row is lost or delayed
// further.
module proof(input clk, input again, input begin_it, input offered, input sample);
  localparam ROWS = 8'd@ROWS@;
  // Rows of the low limbs, and of all limbs.
  localparam LOW = (@LIMBS@ - 1) * ROWS, RAW = @LIMBS@ * ROWS;
  reg started = 1'b0;
  always @(posedge clk) started <= 1'b1;
  wire rst = again || !started;
  // Any row of a frame.
  (* anyconst *) reg [7:0] row;
  reg within, began, next, quad_valid;
  // Rows announced and come, of both limbs; words of v_00 and later ones gone.
  reg [7:0] announced, came, went, since;
  // The same a cycle before.
  reg [7:0] came_before;
  // Assumed of the engine: no frame starts before the previous one's rows have left, no row is announced in the cycle
  // after the start, none of the high limbs before its low limbs have been written, no later row before all of v_00 has left.
  wire start = begin_it && (!within || (announced == came && came - LOW == went && came != 8'd0));
  wire quad_soon = offered && within && !start && !began
                 && (LOW == 0 || announced < LOW || announced >= RAW || came_before > announced - LOW)
                 && (announced < RAW || (went >= ROWS && announced < RAW + 8'd3));
  // The lowest bit represents all bits of a limb, which take the same path; so nothing is carried where limbs are added.
  wire [4*@LANE@-1:0] quad = {4{{(@LANE@-1){1'b0}}, sample}};
  wire [4*@WORD@-1:0] words;
  wire words_valid, operands_valid;
  wire [4*@DATA@-1:0] operands;
  wire [@SHIFTS@-1:0] shift;
  wire [15:0] saturations;
  @TOP@__rescale block(
    .clk(clk), .rst(rst), .case_index(1'b0), .start(start && !rst), .quad(quad), .quad_valid(quad_valid && !rst),
    .quad_soon(quad_soon && !rst), .words(words), .words_valid(words_valid), .operands(operands),
    .operands_valid(operands_valid), .shift(shift), .saturations(saturations)
  );
  reg low, kept;
  wire [@WORD@-1:0] sum = LOW == 0 ? kept : ({{(@WORD@-1){1'b0}}, kept} << @ALIGN@) + low;
  wire [@WORD@-1:0] word = row < ROWS ? sum : {{(@WORD@-1){1'b0}}, kept};
  reg words_before;
  // Rows that will leave as words, as far as they have come.
  wire [7:0] due = came < LOW ? 8'd0 : came - LOW;
  always @(posedge clk) begin
    words_before <= words_valid && !rst;
    began <= start && !rst;
    came_before <= rst || start ? 8'd0 : came;
    {quad_valid, next} <= rst ? 2'd0 : {next, quad_soon};
    if (rst) {within, announced, came, went, since} <= 33'd0;
    else begin
      assert (went <= due && (due != went || !words_valid));
      assert (operands_valid == words_before);
      // Rows of v_00 wait for the last of them and no longer.
      assert (due == went || (due < ROWS && went == 8'd0) || since <= ROWS + 8'd6);
      if (words_valid && went == row) assert (words == {4{word}});
      if (quad_valid && came == row) low <= sample;
      if (quad_valid && came == row + LOW) kept <= sample;
      since <= quad_valid ? 8'd0 : since == 8'd255 ? since : since + 8'd1;
      if (start) {within, announced, came, went} <= {1'b1, 24'd0};
      else begin
        announced <= announced + quad_soon;
        came <= came + quad_valid;
        went <= went + words_valid;
      end
    end
  end
endmodule

// Replaces the arithmetic, which has its own proof: passes the accumulators on with the latency of the words.
module @TOP@__rescale__rescaler(
  input clk, input clear, input valid, input measured, input [@SHIFTS@-1:0] shift, input [4*@ACC@-1:0] raw,
  input [4*@LANE@-1:0] quad,
  output reg [4*@WORD@-1:0] words, output [4*@DATA@-1:0] operands, output [15:0] saturations
);
  reg [4*@WORD@-1:0] taken, moved;
  wire [4*@WORD@-1:0] row;
  genvar l;
  generate
    for (l = 0; l < 4; l = l + 1) begin : lane
      assign row[l * @WORD@ +: @WORD@] = measured ? raw[l * @ACC@ +: @WORD@] : quad[l * @LANE@ +: @WORD@];
    end
  endgenerate
  always @(posedge clk) {words, moved, taken} <= {moved, taken, row};
endmodule
