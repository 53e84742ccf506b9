// Beats that are reserved where there is room leave once each, two cycles after they are written or when those before them
// have left, in their order and as they are, and stay until they are taken. What has left makes room.
module proof(input clk, input again, input wants, input comes, input sample, input takes, input pick);
  reg started = 1'b0;
  always @(posedge clk) started <= 1'b1;
  wire rst = again || !started;
  wire room, m_valid, m_last;
  wire [95:0] m_data;
  // Reserved and not yet written; written and not yet taken.
  reg [5:0] promised, inside;
  wire reserve = wants && room;
  wire write = comes && promised != 6'd0;
  wire taken = m_valid && takes;
  @TOP@$forces$leaving queue(
    .clk(clk), .rst(rst), .reserve(reserve), .room(room), .write(write), .last(!sample), .word({96{sample}}),
    .m_axis_tvalid(m_valid), .m_axis_tready(takes), .m_axis_tlast(m_last), .m_axis_tdata(m_data)
  );
  // A beat that is followed on its way, its level, and how many are before it.
  reg follows, over, level;
  reg [5:0] before;
  reg waits, comes_next, last_before;
  reg [95:0] data_before;
  always @(posedge clk) begin
    waits <= m_valid && !takes && !rst;
    comes_next <= inside != 6'd0 && !m_valid && !rst;
    {data_before, last_before} <= {m_data, m_last};
    if (rst) {promised, inside, follows, over, before} <= 20'd0;
    else begin
      promised <= promised + {5'd0, reserve} - {5'd0, write};
      inside <= inside + {5'd0, write} - {5'd0, taken};
      assert (room == (promised + inside < 6'd@PLACES@));
      if (m_valid) assert (inside != 6'd0 && m_data == {96{!m_last}});
      if (waits) assert (m_valid && m_data == data_before && m_last == last_before);
      if (comes_next) assert (m_valid);
      if (write && pick && !follows && !over) begin
        {follows, level} <= {1'b1, sample};
        before <= inside - {5'd0, taken};
      end
      if (follows && taken) begin
        before <= before - 6'd1;
        if (before == 6'd0) {follows, over} <= 2'b01;
        if (before == 6'd0) assert (m_last == !level);
      end
    end
  end
endmodule
