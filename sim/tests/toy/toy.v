// Toy engine with the ports of the real one, for the tests of the bench: answers each code c of a 6-taxel frame with the
// beat {c, c, gain*c}, then sends one status beat {0, 0, 6}. Buffers one whole frame.
module toy(
    input wire clk, input wire rst,
    input wire signed [11:0] s_axis_tdata, input wire s_axis_tvalid, output wire s_axis_tready,
    input wire s_axis_tlast,
    output wire [95:0] m_axis_tdata, output wire m_axis_tvalid, input wire m_axis_tready,
    output wire m_axis_tlast);
  reg signed [11:0] memory [0:7];
  reg signed [7:0] gain [0:0];
  reg [2:0] head;
  reg sending;
  initial $readmemh("gain.hex", gain);
  wire signed [31:0] code = {{20{memory[head][11]}}, memory[head]};
  wire signed [31:0] factor = {{24{gain[0][7]}}, gain[0]};
  wire status = head == 3'd6;
  wire take = s_axis_tvalid & s_axis_tready;
  wire scale_valid = m_axis_tvalid & m_axis_tready & ~status;
  wire signed [31:0] scaled = factor * code;
  assign s_axis_tready = ~sending;
  assign m_axis_tvalid = sending;
  assign m_axis_tlast = status;
  assign m_axis_tdata = status ? {64'd0, 32'd6} : {code, code, scaled};
  always @(posedge clk) begin
    if (take) memory[head] <= s_axis_tdata;
    if (rst) begin
      head <= 3'd0;
      sending <= 1'b0;
    end else if (take) begin
      head <= s_axis_tlast ? 3'd0 : head + 3'd1;
      sending <= s_axis_tlast;
    end else if (sending & m_axis_tready) begin
      head <= status ? 3'd0 : head + 3'd1;
      sending <= ~status;
    end
  end
endmodule
