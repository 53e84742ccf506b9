// The quads of the operand vectors are written to addresses 0, 1, 2 … of their memory, none beyond its end, and
// finished counts the vectors with all their quads, or, where they are read as they are written, with one.
module proof(input clk, input again, input valid);
  reg started = 1'b0;
  always @(posedge clk) started <= 1'b1;
  wire [@ADDRESS@-1:0] address;
  wire [@FINISHED@-1:0] finished;
  wire keep;
  @TOP@__pass__operand_writer block(
    .clk(clk), .section(1'b0), .clear(again || !started), .valid(valid), .address(address), .keep(keep),
    .finished(finished)
  );
  reg [7:0] kept;
  always @(posedge clk) begin
    if (again || !started) kept <= 8'd0;
    else begin
      assert (keep == (valid && kept < @VECTORS@ * @QUADS@));
      assert (!keep || address == kept);
      assert (finished == (kept + @BEGUN@) / @QUADS@);
      kept <= kept + keep;
    end
  end
endmodule
