// A word is its accumulator / 2^shift, rounded half up and saturated; an operand likewise of its word; saturated words
// are counted, up to the counter's end.
module proof(input clk, input clear, input valid, input measured, input [@SHIFTS@-1:0] shift, input [4*@ACC@-1:0] raw,
             input [4*@LANE@-1:0] quad);
  wire [4*@WORD@-1:0] words;
  wire [4*@DATA@-1:0] operands;
  wire [15:0] saturations;
  @TOP@__rescale__rescaler block(
    .clk(clk), .clear(clear), .valid(valid), .measured(measured), .shift(shift), .raw(raw), .quad(quad),
    .words(words), .operands(operands), .saturations(saturations)
  );
  localparam signed [@ACC@+1:0] MOST = (1 << (@WORD@ - 1)) - 1;
  localparam signed [@WORD@+1:0] MOST_OPERAND = (1 << (@DATA@ - 1)) - 1;
  // Inputs of the previous cycle.
  reg [@SHIFTS@-1:0] amount;
  reg [4*@ACC@-1:0] came;
  reg comes;
  wire [4*@ACC@-1:0] extended;
  always @(posedge clk) {amount, came, comes} <= {measured ? shift : @SHIFTS@'d@A_SHIFT@, measured ? raw : extended, valid};
  reg [2:0] age = 3'd0;
  always @(posedge clk) if (age != 3'd4) age <= age + 3'd1;
  reg counts, known = 1'b0;
  reg [3:0] held_before;
  reg [2:0] held_then;
  reg [15:0] count;
  wire [3:0] held;
  genvar l;
  generate
    for (l = 0; l < 4; l = l + 1) begin : lane
      assign extended[l * @ACC@ +: @ACC@] = $signed(quad[l * @LANE@ +: @LANE@]);
      wire signed [@ACC@:0] acc = {came[l * @ACC@ + @ACC@ - 1], came[l * @ACC@ +: @ACC@]};
      // The quotient rounded down, and the bit that is set if the remainder is a half or more.
      wire signed [@ACC@:0] floor = acc >>> amount;
      wire [@ACC@:0] below = acc >>> (amount - 1);
      reg signed [@ACC@+1:0] rounded;
      wire above = rounded > MOST;
      wire under = rounded < -MOST - 1;
      assign held[l] = above || under;
      reg signed [@WORD@+1:0] word;
      wire signed [@WORD@+1:0] nearest = (word >>> @LESS@) + $signed({1'b0, word[@LESS@-1]});
      reg signed [@WORD@+1:0] operand;
      wire signed [@WORD@-1:0] got_word = words[l * @WORD@ +: @WORD@];
      wire signed [@DATA@-1:0] got_operand = operands[l * @DATA@ +: @DATA@];
      always @(posedge clk) begin
        rounded <= floor + $signed({1'b0, amount != 0 && below[0]});
        word <= above ? MOST : under ? -MOST - 1 : rounded;
        operand <= nearest > MOST_OPERAND ? MOST_OPERAND : nearest;
        if (age >= 3'd3) assert (got_word == word);
        if (age >= 3'd4) assert (got_operand == operand);
      end
    end
  endgenerate
  wire [16:0] sum = {1'b0, count} + held_then;
  always @(posedge clk) begin
    counts <= comes;
    held_before <= counts ? held : 4'd0;
    held_then <= {2'd0, held_before[0]} + held_before[1] + held_before[2] + held_before[3];
    if (clear) {known, count} <= {age >= 3'd4, 16'd0};
    else count <= sum[16] ? 16'hFFFF : sum[15:0];
    if (known) assert (saturations == count);
  end
endmodule
