// A block between two streams: an offered beat stays, unchanged, until it is accepted.
module proof(
  input clk, input again, input [@IN@-1:0] s_data, input s_valid, input s_last, input m_ready
);
  reg started = 1'b0;
  always @(posedge clk) started <= 1'b1;
  wire rst = again || !started;
  wire s_ready, m_valid, m_last;
  wire [@OUT@-1:0] m_data;
  @BLOCK@ block(
    .clk(clk), .rst(rst),
    .s_axis_tdata(s_data), .s_axis_tvalid(s_valid), .s_axis_tready(s_ready), .s_axis_tlast(s_last),
    .m_axis_tdata(m_data), .m_axis_tvalid(m_valid), .m_axis_tready(m_ready), .m_axis_tlast(m_last)
  );
  // Values of the previous cycle.
  reg followed = 1'b0, s_waits, m_waits, s_last_before, m_last_before;
  reg [@IN@-1:0] s_before;
  reg [@OUT@-1:0] m_before;
  always @(posedge clk) begin
    followed <= !rst;
    s_waits <= s_valid && !s_ready;
    m_waits <= m_valid && !m_ready;
    {s_before, s_last_before} <= {s_data, s_last};
    {m_before, m_last_before} <= {m_data, m_last};
    if (followed && !rst) begin
      if (s_waits) assume (s_valid && s_data == s_before && s_last == s_last_before);
      if (m_waits) assert (m_valid && m_data == m_before && m_last == m_last_before);
    end
  end
endmodule
