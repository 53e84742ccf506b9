// Each byte of a packet is sent once, as itself or as two bytes that are neither END nor IDLE, and an offered byte
// stays until it is accepted.
module proof(input clk, input again, input [7:0] content, input border, input offered, input ready);
  reg started = 1'b0;
  always @(posedge clk) started <= 1'b1;
  wire rst = again || !started;
  wire [7:0] data;
  wire valid, content_ready;
  @BLOCK@ block(
    .clk(clk), .rst(rst), .content(content), .border(border), .content_valid(offered), .content_ready(content_ready),
    .data(data), .valid(valid), .ready(ready)
  );
  reg followed = 1'b0, content_waits, waits, border_before, escaped, whole_before;
  reg [7:0] content_before, before;
  wire whole = valid && ready && (border || escaped || data != 8'hDB);
  always @(posedge clk) begin
    followed <= !rst;
    whole_before <= whole;
    content_waits <= offered && !content_ready;
    waits <= valid && !ready;
    {content_before, border_before, before} <= {content, border, data};
    if (followed && !rst) begin
      if (content_waits) assume (offered && content == content_before && border == border_before);
      if (waits) assert (valid && data == before);
    end
    // Decoding, as a receiver does it.
    if (rst) escaped <= 1'b0;
    else begin
      if (valid && border) assert (data == 8'hC0 && !escaped);
      if (valid && !border) assert (data != 8'hC0);
      if (valid) assert (data != 8'hDE);
      if (valid && ready) escaped <= !border && data == 8'hDB;
      if (whole && !border)
        assert (content == (!escaped ? data : data == 8'hDC ? 8'hC0 : data == 8'hDD ? 8'hDB : data == 8'hDF ? 8'hDE : 8'h00));
      // content_ready comes one cycle after the last byte, and no byte is offered in that cycle.
      if (followed) assert (content_ready == whole_before);
      if (followed && whole_before) assert (!valid);
    end
  end
endmodule
