// Each beat that calibrate accepts leaves once, in order, as code - zero, saturated.
module proof(
  input clk, input again, input [@BITS@-1:0] s_data, input s_valid, input s_last, input m_ready,
  input pick
);
  reg started = 1'b0;
  always @(posedge clk) started <= 1'b1;
  wire rst = again || !started;
  wire s_ready, m_valid, m_last;
  wire [@BITS@-1:0] m_data;
  @TOP@__prepare__calibrate block(
    .clk(clk), .rst(rst),
    .s_axis_tdata(s_data), .s_axis_tvalid(s_valid), .s_axis_tready(s_ready), .s_axis_tlast(s_last),
    .m_axis_tdata(m_data), .m_axis_tvalid(m_valid), .m_axis_tready(m_ready), .m_axis_tlast(m_last)
  );
  // Any one beat, selected by the free input pick, is tracked: ahead others leave before it.
  reg [1:0] inside, ahead;
  reg followed;
  reg [2:0] taxel;
  reg signed [15:0] zero;
  always @(*) begin
    case (taxel)
@ZEROS@      default: zero = 16'sd0;
    endcase
  end
  wire signed [15:0] code = $signed(s_data);
  wire signed [15:0] difference = code - zero;
  wire signed [15:0] wanted = difference > 16'sd@MOST@ ? 16'sd@MOST@ : difference < -16'sd@MOST@ - 16'sd1 ? -16'sd@MOST@ - 16'sd1 : difference;
  reg signed [15:0] kept;
  reg kept_last;
  wire takes = s_valid && s_ready;
  wire gives = m_valid && m_ready;
  always @(posedge clk) begin
    if (rst) {taxel, inside, ahead, followed} <= 8'd0;
    else begin
      // As many beats leave as were accepted.
      assert (inside <= 2'd2 && (inside != 2'd0 || !m_valid));
      assert (inside != 2'd2 || m_valid);
      inside <= inside + takes - gives;
      if (takes) taxel <= s_last || taxel == 3'd@LAST@ ? 3'd0 : taxel + 3'd1;
      if (takes && !followed && pick) begin
        followed <= 1'b1;
        ahead <= inside - gives;
        {kept, kept_last} <= {wanted, s_last};
      end
      if (gives && followed) begin
        if (ahead == 2'd0) followed <= 1'b0;
        else ahead <= ahead - 2'd1;
      end
      if (m_valid && followed && ahead == 2'd0) assert ($signed(m_data) == kept && m_last == kept_last);
    end
  end
endmodule
