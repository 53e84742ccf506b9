//! Verilog of a stage that the scene omits: its stream passes through on wires.

use rust_hdl::prelude::Verilog;

/// Verilog that connects `m_axis` to `s_axis`; `why` is a comment that says what is omitted, on one line.
pub fn pass_through(why: &str) -> Verilog {
    Verilog::Custom(format!(
        "\
// {why}
wire unused = &{{1'b0, clk, rst}};
always @(*) begin
  m_axis_tdata = s_axis_tdata;
  m_axis_tvalid = s_axis_tvalid;
  m_axis_tlast = s_axis_tlast;
  s_axis_tready = m_axis_tready;
end"
    ))
}
