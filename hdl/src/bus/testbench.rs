//! Testbench of a core, for an integrator to read and to run in any simulator of SystemVerilog.
//!
//! ```text
//! <top>_tb_codes.hex ──> <top> ──> compared with <top>_tb_words.hex, from the bit-true model
//! ```
//! Register `id` is read over the bus, then one reconstruction is sent at full speed.

use dermis_golden::fixed::Model;
use dermis_golden::wire::registers::{ID, REGISTER_BITS};

use super::bundles::id_bits;
use super::{Bus, CoreShape};
use crate::generate::Generated;
use crate::manifest::GeneratedFile;
use crate::primitives::Arrays;
use crate::testbench::{reconstruction, Opening, Reconstruction, SUFFIX};

/// Identifier of the frame, whose low bits are the number of the array.
const TID: usize = 9;

/// The testbench of `core` and its two memory files; `command` generates them.
pub(super) fn testbench(model: &Model, core: &Generated, shape: CoreShape, command: String) -> Vec<GeneratedFile> {
    let top = &core.top;
    let Reconstruction { codes, beats, patience } = reconstruction(model, TID % Arrays::of_model(model).count());
    let lines = |words: &[i32]| words.iter().map(|word| format!("{word:08x}\n")).collect::<String>();
    let words: Vec<i32> = beats.into_iter().flatten().collect();
    let file = |ending: &str, text: String| GeneratedFile { name: format!("{top}{SUFFIX}{ending}"), text };
    // A beat of the engine has three words.
    let patience = patience + 3 * words.len() as u64;
    let opening = Opening {
        command,
        does: "Reads register `id`, sends the codes of one reconstruction and compares every word with the bit-true model.",
        unit: "words",
        widths: [REGISTER_BITS; 2],
        counts: [codes.len(), words.len()],
        patience,
    };
    let text = opening.text(model, top, &core.files)
        + &text(top, shape, 3 * model.force_triples(), id_bits(Arrays::of_model(model)));
    vec![file(".sv", text), file("_codes.hex", lines(&codes)), file("_words.hex", lines(&words))]
}

/// The module after its opening; the first `force_words` words of a frame are forces.
fn text(top: &str, shape: CoreShape, force_words: usize, id_bits: usize) -> String {
    let (pins, access) = bus(shape.bus);
    format!(
        "
  localparam LANES = {lanes};
  localparam FORCE_WORDS = {force_words};
  localparam [{top_bit}:0] TID = {id_bits}'d{TID};

  integer lane;
  reg identified = 1'b0;

  wire aresetn = cycle >= 2;
  wire s_valid = identified && sent < CODES;
  wire s_ready;
  wire m_valid, m_last;
  wire [32*LANES-1:0] m_data;
  wire [4*LANES-1:0] m_keep;
  wire [LANES:0] m_user;
  wire [{top_bit}:0] m_id;

{declarations}
  {top} core (
    .aclk(clk),
    .aresetn(aresetn),
    .s_axis_tdata(codes[s_valid ? sent : 0]),
    .s_axis_tkeep(4'hf),
    .s_axis_tid(TID),
    .s_axis_tvalid(s_valid),
    .s_axis_tready(s_ready),
    .s_axis_tlast(s_valid && sent % TAXELS == TAXELS - 1),
    .m_axis_tdata(m_data),
    .m_axis_tkeep(m_keep),
    .m_axis_tuser(m_user),
    .m_axis_tid(m_id),
    .m_axis_tvalid(m_valid),
    .m_axis_tready(1'b1),
    .m_axis_tlast(m_last),
{pins}
  );

  always @(posedge clk) begin
    cycle <= cycle + 1;
    if (s_valid && s_ready) sent <= sent + 1;
{access}
    if (aresetn && m_valid) begin
      if (m_id !== TID || m_user[LANES] !== 1'b0) $fatal(1, \"word %0d: tid %0d, tuser %b\", received, m_id, m_user);
      for (lane = 0; lane < LANES; lane = lane + 1)
        if (m_keep[4*lane]) begin
          if (m_data[32*lane +: 32] !== expected[received])
            $fatal(1, \"word %0d is %h, expected %h\", received, m_data[32*lane +: 32], expected[received]);
          if (m_user[lane] !== (received >= FORCE_WORDS)) $fatal(1, \"word %0d: tuser %b\", received, m_user);
          received = received + 1;
        end
      if (m_last !== (received == WORDS)) $fatal(1, \"word %0d: m_axis_tlast is %b\", received, m_last);
      if (received == WORDS) begin
        $display(\"PASS: %0d codes, %0d words, %0d cycles\", CODES, WORDS, cycle);
        $finish;
      end
    end
    if (cycle > PATIENCE) $fatal(1, \"%0d of %0d words after %0d cycles\", received, WORDS, cycle);
  end
endmodule
",
        lanes = shape.words,
        top_bit = id_bits - 1,
        declarations = declarations(shape.bus),
    )
}

/// The wires of the bus.
fn declarations(bus: Bus) -> &'static str {
    match bus {
        Bus::AxiLite => "  reg asked = 1'b0;\n  wire arready, rvalid;\n  wire [1:0] rresp;\n  wire [31:0] rdata;\n",
        Bus::Wishbone => "  wire ack, err;\n  wire [31:0] rdata;\n",
    }
}

/// The connections of the bus, and what reads register `id` in every cycle.
fn bus(bus: Bus) -> (&'static str, String) {
    let right = format!("rdata !== {REGISTER_BITS}'h{ID:08x}");
    match bus {
        Bus::AxiLite => (
            "    .s_axil_awvalid(1'b0),
    .s_axil_awready(),
    .s_axil_awaddr(8'd0),
    .s_axil_wvalid(1'b0),
    .s_axil_wready(),
    .s_axil_wdata(32'd0),
    .s_axil_wstrb(4'd0),
    .s_axil_bvalid(),
    .s_axil_bready(1'b1),
    .s_axil_bresp(),
    .s_axil_arvalid(aresetn && !asked),
    .s_axil_arready(arready),
    .s_axil_araddr(8'd0),
    .s_axil_rvalid(rvalid),
    .s_axil_rready(1'b1),
    .s_axil_rdata(rdata),
    .s_axil_rresp(rresp)",
            format!(
                "    if (aresetn && !asked && arready) asked <= 1'b1;
    if (aresetn && rvalid) begin
      if ({right} || rresp !== 2'b00) $fatal(1, \"register id is %h, response %b\", rdata, rresp);
      identified <= 1'b1;
    end"
            ),
        ),
        Bus::Wishbone => (
            "    .wb_cyc(aresetn && !identified),
    .wb_stb(aresetn && !identified),
    .wb_we(1'b0),
    .wb_adr(6'd0),
    .wb_dat_w(32'd0),
    .wb_sel(4'hf),
    .wb_dat_r(rdata),
    .wb_ack(ack),
    .wb_err(err)",
            format!(
                "    if (aresetn && !identified && (ack || err)) begin
      if ({right} || err) $fatal(1, \"register id is %h, wb_err %b\", rdata, err);
      identified <= 1'b1;
    end"
            ),
        ),
    }
}
