// From its start to its tlast a frame has all its forces and status beats, no beat leaves outside a frame, and what is
// offered stays. What the force unit multiplies is left open.
module proof(
  input clk, input again, input start_it, input m_ready,
  input [@VALUES@-1:0] values, input values_valid, input settled, input [15:0] saturations
);
  reg started = 1'b0;
  always @(posedge clk) started <= 1'b1;
  wire rst = again || !started;
  wire advance, offer, part, done, m_valid, m_last;
  wire [1:0] beat, lane;
  wire [@ADDRESS@-1:0] address;
  wire [95:0] m_data;
  reg within;
  // The engine starts a frame when the last one is out.
  wire begins = start_it && !within;
  @TOP@$send send(
    .clk(clk), .rst(rst), .start(begins), .m_axis_tvalid(m_valid), .m_axis_tready(m_ready), .m_axis_tlast(m_last),
    .advance(advance), .offer(offer), .beat(beat), .part(part), .address(address), .lane(lane), .done(done)
  );
  @TOP@$forces forces(
    .clk(clk), .rst(rst), .values(values), .values_valid(values_valid), .begin_frame(begins), .start(settled),
    .part(1'b0), .advance(advance), .offer(offer), .beat(beat), .beat_part(part), .address(address), .lane(lane),
    .saturations(saturations), .m_axis_tvalid(m_valid), .m_axis_tlast(m_last), .m_axis_tdata(m_data)
  );
  reg followed = 1'b0, waits, last_before;
  reg [95:0] before;
  reg [7:0] given;
  wire takes = m_valid && m_ready;
  always @(posedge clk) begin
    followed <= !rst;
    waits <= m_valid && !m_ready;
    {before, last_before} <= {m_data, m_last};
    if (rst) {within, given} <= 9'd0;
    else begin
      if (followed && waits) assert (m_valid && m_data == before && m_last == last_before);
      if (m_valid) assert (within && m_last == (given == 8'd@LAST@));
      assert (done == (takes && m_last));
      if (begins) within <= 1'b1;
      if (takes) given <= given + 8'd1;
      if (done) {within, given} <= 9'd0;
    end
  end
endmodule
