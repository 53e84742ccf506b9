// The words of all beats leave in order and without gaps; only the last beat of a frame has fewer words; an offered beat
// stays unchanged. A frame that is abandoned ends with zeros, spoiled, and no other does.
module proof(
  input clk, input again, input [2:0] bits, input given, input last, input [4:0] label, input abandon, input ready,
  input mark
);
  localparam WORDS = @WORDS@;
  reg started = 1'b0;
  always @(posedge clk) started <= 1'b1;
  wire rst = again || !started;
  wire s_ready, valid, m_last, whole, sent;
  wire [32*WORDS-1:0] data;
  wire [4*WORDS-1:0] keep;
  wire [WORDS:0] user;
  wire [3:0] id;
  // One bit represents those of a word, which take the same path.
  @BLOCK@ block(
    .clk(clk), .rst(rst), .s_axis_tdata({{32{bits[2]}}, {32{bits[1]}}, {32{bits[0]}}}), .s_axis_tvalid(given),
    .s_axis_tready(s_ready), .s_axis_tlast(last), .label(label), .abandon(abandon), .m_axis_tdata(data), .m_axis_tkeep(keep),
    .m_axis_tuser(user), .m_axis_tid(id), .m_axis_tvalid(valid), .m_axis_tready(ready), .m_axis_tlast(m_last), .whole(whole),
    .sent(sent)
  );
  // Words that wait, whether the last of a frame is among them.
  reg [3:0] pending;
  reg ended;
  wire [3:0] there = pending < WORDS ? pending : WORDS;
  wire [3:0] left = pending - (valid && ready ? there : 4'd0);
  // The frame whose beats come: it has begun, it is to be ended; the one whose words wait: its label, it was abandoned.
  reg open, closing, abandoned;
  reg [4:0] own_label;
  wire room = !ended && left < WORDS;
  wire closes = open && (abandon || closing);
  wire taken = given && s_ready, closed = closes && room;
  // A marked beat: the words before it that wait, and its bits.
  reg marked;
  reg [3:0] before;
  reg [2:0] own;
  reg followed = 1'b0, waits, last_before;
  reg [32*WORDS-1:0] data_before;
  reg [4*WORDS-1:0] keep_before;
  reg [WORDS:0] user_before;
  integer word;
  always @(posedge clk) begin
    followed <= !rst;
    waits <= valid && !ready;
    {data_before, keep_before, user_before, last_before} <= {data, keep, user, m_last};
    if (rst) {pending, ended, marked, open, closing, abandoned} <= 9'd0;
    else begin
      assert (valid == (pending >= WORDS || ended));
      assert (m_last == (ended && pending <= WORDS) && sent == (valid && ready && m_last && !abandoned));
      assert (s_ready == (room && !closes && !abandon) && whole == (taken && last));
      if (valid) begin
        assert (id == own_label[3:0] && user[WORDS] == (own_label[4] || abandoned));
        for (word = 0; word < WORDS; word = word + 1) begin
          assert (keep[4*word+:4] == (word < there ? 4'd15 : 4'd0));
          if (marked && word >= before && word < before + 3)
            assert (data[32*word+:32] == {32{own[word - before]}});
        end
      end
      if (followed && waits) assert (valid && {data, keep, user, m_last} == {data_before, keep_before, user_before, last_before});
      pending <= left + (taken || closed ? 4'd3 : 4'd0);
      closing <= closes && !room;
      if (valid && ready && m_last) {ended, abandoned} <= 2'd0;
      if (taken || closed) begin
        assert (!ended);
        open <= !(last || closed);
        {ended, abandoned} <= {last || closed, closed};
        if (!open) own_label <= label;
        if (mark && !marked) {marked, before, own} <= {1'b1, left, closed ? 3'd0 : bits};
      end
      if (valid && ready && marked) begin
        if (before >= there) before <= before - there;
        else marked <= 1'b0;
      end
    end
  end
endmodule
