// Every code leaves once as a mean, the last of a frame with tlast, each with the number of frames so far, up to three.
module proof(
  input clk, input again, input [@BITS@-1:0] s_data, input s_valid, input m_ready
);
  reg started = 1'b0;
  always @(posedge clk) started <= 1'b1;
  wire rst = again || !started;
  wire s_ready, m_valid, m_last;
  wire [@BITS@:0] m_data;
  wire [1:0] m_frames;
  reg [2:0] taxel, given;
  reg [1:0] inside, frames;
  wire takes = s_valid && s_ready;
  wire gives = m_valid && m_ready;
  wire s_last = taxel == 3'd@LAST@;
  wire g_last = given == 3'd@LAST@;
  @TOP@__prepare__average block(
    .clk(clk), .rst(rst),
    .s_axis_tdata(s_data), .s_axis_tvalid(s_valid), .s_axis_tready(s_ready), .s_axis_tlast(s_last),
    .m_axis_tdata(m_data), .m_axis_tvalid(m_valid), .m_axis_tready(m_ready), .m_axis_tlast(m_last),
    .frames(m_frames)
  );
  always @(posedge clk) begin
    if (rst) {taxel, given, inside, frames} <= {8'd0, 2'd1};
    else begin
      if (takes) taxel <= s_last ? 3'd0 : taxel + 3'd1;
      if (m_valid) assert (m_last == g_last && m_frames == frames);
      assert ((inside != 2'd0 || !m_valid) && (inside != 2'd3 || m_valid));
      inside <= inside + takes - gives;
      if (gives) given <= g_last ? 3'd0 : given + 3'd1;
      if (gives && g_last && frames != 2'd3) frames <= frames + 2'd1;
    end
  end
endmodule
