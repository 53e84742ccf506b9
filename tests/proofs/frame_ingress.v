// A beat offered by the frame ingress stays, unchanged, until it is accepted, even if its packet turns out bad; the engine
// gets a whole frame for each packet with taken, and for no other.
module proof(
  input clk, input again, input begins, input pays, input [7:0] content, input ends, input sound, input ready
);
  reg started = 1'b0;
  always @(posedge clk) started <= 1'b1;
  wire rst = again || !started;
  // Assumed of the parser: at most a frame's bytes per packet, and good only after all of them.
  reg within;
  reg [4:0] bytes;
  wire frame_begin = begins && !within;
  wire at_end = within && ends;
  wire payload = within && pays && !ends && bytes != 5'd@BYTES@;
  wire good = at_end && sound && bytes == 5'd@BYTES@;
  wire bad = at_end && !good;
  wire taken, overrun, valid, last;
  wire [@BITS@-1:0] code;
  @BLOCK@ block(
    .clk(clk), .rst(rst), .frame_begin(frame_begin), .payload(payload), .content(content), .good(good), .bad(bad),
    .taken(taken), .overrun(overrun), .code(code), .valid(valid), .last(last), .ready(ready)
  );
  reg followed = 1'b0, waits, last_before;
  reg [@BITS@-1:0] before;
  // The engine's position in its frame, and whether it has still to get the whole frame of a packet with taken.
  reg [4:0] taxel;
  reg owed;
  wire ends_whole = taxel == 5'd@LAST@;
  always @(posedge clk) begin
    followed <= !rst;
    waits <= valid && !ready;
    {before, last_before} <= {code, last};
    if (rst) {within, bytes, taxel, owed} <= 12'd0;
    else begin
      if (followed && waits) assert (valid && code == before && last == last_before);
      if (valid && ends_whole) assert (last && owed);
      if (taken) assert (!owed && !overrun);
      assert (taxel <= 5'd@LAST@);
      within <= frame_begin || (within && !at_end);
      if (frame_begin) bytes <= 5'd0;
      else if (payload) bytes <= bytes + 5'd1;
      if (valid && ready) taxel <= last ? 5'd0 : taxel + 5'd1;
      if (taken) owed <= 1'b1;
      else if (valid && ready && ends_whole) owed <= 1'b0;
    end
  end
endmodule
