// The rows of v_00 wait until the last of them has been measured, then each leaves once, in order, with the measured
// shift; later rows leave with the constant one. No row is lost or delayed further.
module proof(input clk, input again, input begin_it, input offered, input sample);
  // One bit represents all bits, which take the same path.
  wire [4*@ACC@-1:0] quad = {4*@ACC@{sample}};
  localparam ROWS = 8'd@ROWS@;
  reg started = 1'b0;
  always @(posedge clk) started <= 1'b1;
  wire rst = again || !started;
  // Any row of a frame.
  (* anyconst *) reg [7:0] row;
  reg within, began;
  reg [7:0] came, went, since;
  // Assumed of the engine: no frame starts before the previous one's rows have left, no row arrives in the cycle after
  // the start, no later row before all of v_00 has left.
  wire start = begin_it && came == went;
  wire quad_valid = offered && within && !start && !began && (came < ROWS || (went >= ROWS && came < ROWS + 8'd3));
  wire [4*@WORD@-1:0] words;
  wire words_valid, operands_valid;
  wire [4*@DATA@-1:0] operands;
  wire [@SHIFTS@-1:0] shift;
  wire [15:0] saturations;
  @TOP@__rescale block(
    .clk(clk), .rst(rst), .which(1'b0), .start(start && !rst), .quad(quad), .quad_valid(quad_valid && !rst),
    .words(words), .words_valid(words_valid), .operands(operands), .operands_valid(operands_valid), .shift(shift),
    .saturations(saturations)
  );
  reg kept;
  reg words_before;
  always @(posedge clk) begin
    words_before <= words_valid && !rst;
    began <= start && !rst;
    if (rst) {within, came, went, since} <= 25'd0;
    else begin
      assert (went <= came && (came != went || !words_valid));
      assert (operands_valid == words_before);
      // Rows of v_00 wait for the last of them and no longer.
      assert (came == went || (came < ROWS && went == 8'd0) || since <= ROWS + 8'd6);
      if (words_valid && went == row) assert (words == {4*@WORD@{kept}});
      if (quad_valid && came == row) kept <= sample;
      since <= quad_valid ? 8'd0 : since == 8'd255 ? since : since + 8'd1;
      if (start) {within, came, went} <= {1'b1, 16'd0};
      else begin
        came <= came + quad_valid;
        went <= went + words_valid;
      end
    end
  end
endmodule

// Replaces the arithmetic, which has its own proof: passes the accumulators on with the latency of the words.
module @TOP@__rescale__rescaler(
  input clk, input clear, input valid, input measured, input [@SHIFTS@-1:0] shift, input [4*@ACC@-1:0] quad,
  output reg [4*@WORD@-1:0] words, output [4*@DATA@-1:0] operands, output [15:0] saturations
);
  reg [4*@WORD@-1:0] taken, moved;
  always @(posedge clk) {words, moved, taken} <= {moved, taken, quad[4*@WORD@-1:0]};
endmodule
