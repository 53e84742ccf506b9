//! A stage that its scene leaves out: the stream goes through on wires.

use rust_hdl::prelude::Verilog;

/// Verilog of a block whose `m_axis` is its `s_axis`; `why` says in a comment what is left out.
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
