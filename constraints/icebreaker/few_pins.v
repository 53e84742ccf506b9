// The engine behind shift registers: its ports are more than the package has pins. For measuring only.
module few_pins(
  input clk, input rst, input code, input code_valid, input code_last, input beat_ready,
  output reg code_ready, output reg beat, output reg beat_valid, output reg beat_last
);
  reg [`CODE_BITS-1:0] codes;
  reg [95:0] beats;
  reg rst_then, valid_then, last_then, ready_then;
  wire [95:0] data;
  wire ready, valid, last;
  always @(posedge clk) begin
    codes <= {codes[`CODE_BITS-2:0], code};
    {rst_then, valid_then, last_then, ready_then} <= {rst, code_valid, code_last, beat_ready};
    beats <= valid ? data : {beats[94:0], 1'b0};
    {code_ready, beat, beat_valid, beat_last} <= {ready, beats[95], valid, last};
  end
  `ENGINE engine(
    .clk(clk), .rst(rst_then),
    .s_axis_tdata(codes), .s_axis_tvalid(valid_then), .s_axis_tready(ready), .s_axis_tlast(last_then),
    .m_axis_tdata(data), .m_axis_tvalid(valid), .m_axis_tready(ready_then), .m_axis_tlast(last)
  );
endmodule
