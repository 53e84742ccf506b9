// A packet is a border, the header's four bytes, twelve bytes of each word taken, four more, a border;
// what is offered stays; a word is taken only where one is wanted.
module proof(
  input clk, input again, input offer, input [3:0] header_bits, input [1:0] from, input [11:0] word_bits,
  input word_valid, input word_last, input ready
);
  reg started = 1'b0;
  always @(posedge clk) started <= 1'b1;
  wire rst = again || !started;
  // One bit stands for the eight of its byte, which go the same way.
  wire [31:0] header;
  wire [95:0] word;
  genvar k;
  generate
    for (k = 0; k < 4; k = k + 1) assign header[8 * k +: 8] = {8{header_bits[k]}};
    for (k = 0; k < 12; k = k + 1) assign word[8 * k +: 8] = {8{word_bits[k]}};
  endgenerate
  wire begun, wanted, border, valid;
  wire [1:0] source;
  wire [7:0] content;
  @BLOCK@ block(
    .clk(clk), .rst(rst), .offer(offer), .header(header), .offered_source(from), .begun(begun), .source(source),
    .wanted(wanted), .word(word), .word_valid(word_valid), .word_last(word_last), .content(content), .border(border),
    .valid(valid), .ready(ready)
  );
  // What a receiver expects: bytes left of this part, and the parts in their order.
  localparam NONE = 3'd0, OPEN = 3'd1, BYTES = 3'd2, WORD = 3'd3, CHECK = 3'd4, CLOSE = 3'd5;
  reg [2:0] part;
  reg [3:0] left;
  reg [11:0] rest;
  reg [1:0] own;
  reg last, waits, border_before;
  reg [7:0] before;
  always @(posedge clk) begin
    waits <= valid && !ready && !rst;
    {before, border_before} <= {content, border};
    if (rst) {part, waits} <= 4'd0;
    else begin
      if (waits) assert (valid && border == border_before && (border || content == before));
      assert (begun == (part == NONE && offer));
      assert (wanted == (part == WORD));
      if (part != NONE) assert (source == own);
      if (valid) begin
        assert (border == (part == OPEN || part == CLOSE));
        if (part == BYTES) assert (content == {8{rest[0]}});
        assert (part != NONE && part != WORD);
      end
      case (part)
        NONE: if (offer) {part, rest, last, own} <= {OPEN, 8'd0, header_bits, 1'b0, from};
        OPEN: if (valid && ready) {part, left} <= {BYTES, 4'd4};
        BYTES: if (valid && ready) begin
          rest <= rest >> 1;
          left <= left - 4'd1;
          if (left == 4'd1) part <= last ? CHECK : WORD;
          if (left == 4'd1 && last) left <= 4'd4;
        end
        WORD: if (word_valid) {part, left, rest, last} <= {BYTES, 4'd12, word_bits, word_last};
        CHECK: if (valid && ready) begin
          left <= left - 4'd1;
          if (left == 4'd1) part <= CLOSE;
        end
        default: if (valid && ready) part <= NONE;
      endcase
    end
  end
endmodule
