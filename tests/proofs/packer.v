// A packet is an END, four bytes of header, twelve bytes of each word, four of CRC, an END. Each is offered as early as
// possible and stays until it is accepted; the bytes of a word leave in order, and taken comes with the last.
module proof(
  input clk, input again, input offer, input [7:0] number, input [1:0] from, input [11:0] word_bits,
  input word_valid, input word_last, input [7:0] crc_low, input crc_busy, input ready
);
  reg started = 1'b0;
  always @(posedge clk) started <= 1'b1;
  wire rst = again || !started;
  wire begun, wanted, taken, halfway, crc_restart, crc_load, border, valid;
  wire [1:0] source;
  wire [3:0] index;
  wire [7:0] crc_octet, content;
  // The word, stable until taken; one bit represents the eight of its byte, which take the same path.
  reg [11:0] word;
  reg last;
  always @(posedge clk) if (rst || begun || taken) {word, last} <= {word_bits, word_last};
  @BLOCK@ block(
    .clk(clk), .rst(rst), .offer(offer), .number(number), .offered_source(from), .begun(begun), .source(source),
    .wanted(wanted), .index(index), .octet({8{word[index]}}), .word_valid(word_valid), .word_last(last), .taken(taken),
    .halfway(halfway), .crc_restart(crc_restart), .crc_octet(crc_octet), .crc_load(crc_load), .crc_low(crc_low),
    .crc_busy(crc_busy), .content(content), .border(border), .valid(valid), .ready(ready)
  );
  // Expected by a receiver: the parts in order, and the byte of the current part.
  localparam NONE = 3'd0, OPEN = 3'd1, HEADER = 3'd2, WORD = 3'd3, CHECK = 3'd4, CLOSE = 3'd5;
  reg [2:0] part;
  reg [3:0] at;
  reg [31:0] header;
  reg [1:0] own;
  reg offered, waits, border_before;
  reg [7:0] before, low_before;
  wire [15:0] length = from == 2'd0 ? 16'd@IDENTITY@ : from == 2'd1 ? 16'd@COUNTERS@
    : from == 2'd2 ? 16'd@RESULTANTS@ : 16'd@FORCES@;
  wire between = part == OPEN || part == CLOSE;
  wire goes = valid && ready;
  wire ends = at == (part == WORD ? 4'd11 : 4'd3);
  always @(posedge clk) begin
    offered <= !rst && (valid ? !ready : between || (part != NONE && !crc_busy && (part != WORD || word_valid)));
    waits <= valid && !ready && !rst;
    {before, border_before} <= {content, border};
    if (!valid) low_before <= crc_low;
    if (rst) {part, at} <= 7'd0;
    else begin
      assert (valid == offered && border == between);
      if (waits) assert (border == border_before && (border || content == before));
      assert (begun == (part == NONE && offer) && (part == NONE || source == own));
      assert (wanted == (part == WORD) && index == at && halfway == (!valid && at[0]));
      assert (taken == (goes && part == WORD && at == 4'd11));
      assert (crc_restart == (part == OPEN) && crc_load == (goes && !between));
      if (valid && part == HEADER) assert (content == header[7:0] && crc_octet == content);
      if (valid && part == WORD) assert (content == {8{word[at]}} && crc_octet == content);
      if (valid && part == CHECK) assert (content == low_before && crc_octet == ~content);
      if (begun) {part, own, header} <= {OPEN, from, length, number, 8'd@FIRST@ + {6'd0, from}};
      else if (goes) begin
        at <= between || ends ? 4'd0 : at + 4'd1;
        if (part == HEADER) header <= header >> 8;
        if (part == CLOSE) part <= NONE;
        else if (between || (ends && (part != WORD || last))) part <= part + 3'd1;
      end
    end
  end
endmodule
