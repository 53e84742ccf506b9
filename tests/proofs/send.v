// From its start to its tlast a frame has all its forces and status beats, each reserved in the queue with room, and no
// beat leaves outside a frame. The products of the force unit are unconstrained.
module @TOP@__forces__leaving(
  input clk, input rst, input reserve, output room, input write, input last, input [95:0] word,
  output reg m_axis_tvalid, input m_axis_tready, output reg m_axis_tlast, output [95:0] m_axis_tdata
);
  // Replaces the queue: room is a free input of the prover, and a beat leaves at once.
  assign room = m_axis_tready;
  assign m_axis_tdata = word;
  always @(posedge clk) {m_axis_tvalid, m_axis_tlast} <= rst ? 2'd0 : {write, write && last};
endmodule

module proof(
  input clk, input again, input start_it, input room,
  input [@VALUES@-1:0] values, input values_valid, input settled, input [15:0] saturations
);
  reg started = 1'b0;
  always @(posedge clk) started <= 1'b1;
  wire rst = again || !started;
  wire may, offer, part, done, m_valid, m_last;
  wire [1:0] beat, lane;
  wire [@ADDRESS@-1:0] address;
  wire [95:0] m_data;
  reg within, ended;
  // Assumed of the engine: a frame starts when the previous one has been sent.
  wire begins = start_it && !within;
  @TOP@__send send(
    .clk(clk), .rst(rst), .start(begins), .begins(begins), .room(may), .m_axis_tvalid(m_valid), .m_axis_tready(1'b1),
    .m_axis_tlast(m_last), .offer(offer), .beat(beat), .part(part), .address(address), .lane(lane), .done(done)
  );
  @TOP@__forces forces(
    .clk(clk), .rst(rst), .values(values), .values_valid(values_valid), .begin_frame(begins), .start(settled),
    .part(1'b0), .room(may), .offer(offer), .beat(beat), .beat_part(part), .address(address), .lane(lane),
    .saturations(saturations), .m_axis_tvalid(m_valid), .m_axis_tready(room), .m_axis_tlast(m_last), .m_axis_tdata(m_data)
  );
  // Number of beats requested; whether one was requested in each of the previous cycles, and which.
  reg [7:0] asked;
  reg [@STEPS@:0] asks;
  reg [7:0] which [0:@STEPS@];
  integer i;
  always @(posedge clk) begin
    which[0] <= asked;
    for (i = 1; i <= @STEPS@; i = i + 1) which[i] <= which[i - 1];
    ended <= m_valid && m_last && !rst;
    if (rst) {within, asks, asked} <= @WIDTH@'d0;
    else begin
      asks <= {asks[@STEPS@-1:0], offer};
      if (offer) assert (room && within && asked <= 8'd@LAST@);
      assert (m_valid == asks[@STEPS@]);
      if (m_valid) assert (within && m_last == (which[@STEPS@] == 8'd@LAST@));
      assert (done == ended);
      if (begins) within <= 1'b1;
      if (offer) asked <= asked + 8'd1;
      if (done) {within, asked} <= 9'd0;
    end
  end
endmodule
