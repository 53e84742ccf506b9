// A counter stays below its limit, and last is high exactly at its last value.
module proof(input clk, input clear, input enable);
  reg started = 1'b0;
  always @(posedge clk) started <= 1'b1;
  wire [@BITS@-1:0] value;
  wire last;
  @BLOCK@ block(.clk(clk), .clear(clear || !started), .enable(enable), .value(value), .last(last));
  always @(posedge clk) if (started) begin
    assert ({1'b0, value} < @LIMIT@);
    assert (last == (value == @LIMIT@ - 1));
  end
endmodule
