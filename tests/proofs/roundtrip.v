// The decoder returns every byte and every END that the encoder was given, one for one and without spoiled, with any
// IDLE bytes in between.
module proof(input clk, input again, input [7:0] content, input border, input offered, input taken, input idle);
  reg started = 1'b0;
  always @(posedge clk) started <= 1'b1;
  wire rst = again || !started;
  wire ready = taken && !idle;
  wire [7:0] data, read;
  wire valid, content_ready, read_valid, packet_end, spoiled;
  @ENCODER@ encoder(
    .clk(clk), .rst(rst), .content(content), .border(border), .content_valid(offered), .content_ready(content_ready),
    .data(data), .valid(valid), .ready(ready)
  );
  @DECODER@ decoder(
    .clk(clk), .rst(rst), .data(idle ? 8'hDE : data), .valid(idle || (valid && ready)), .broken(1'b0), .content(read),
    .content_valid(read_valid), .packet_end(packet_end), .spoiled(spoiled)
  );
  reg waits = 1'b0, border_before;
  reg [7:0] before;
  always @(posedge clk) begin
    waits <= offered && !content_ready && !rst;
    {before, border_before} <= {content, border};
    if (waits) assume (offered && content == before && border == border_before);
    if (started) begin
      // content_ready of the encoder coincides with the output of the decoder.
      assert (read_valid == (content_ready && !border));
      assert (packet_end == (content_ready && border));
      assert (!read_valid || read == content);
      assert (!spoiled);
    end
  end
endmodule
