//! A clocked device with the engine's ports, whatever simulates it.
//!
//! rust-hdl's simulation, the Verilated RTL and the post-synthesis netlist all implement
//! [`Device`], so one test bench drives them all.
//!
//! ```text
//!            +-----------+
//!  s_axis -->|  engine   |--> m_axis     one call of `cycle` = one clock period
//!            +-----------+--> taps       (observation only, no pins in the bitstream)
//! ```

/// The engine's input pins in one clock cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Inputs {
    /// Synchronous reset, active high.
    pub rst: bool,
    /// `s_axis_tvalid`: a taxel's code is offered.
    pub s_valid: bool,
    /// `s_axis_tdata`: the taxel's code, two's complement, `input_bits` wide.
    pub s_data: i32,
    /// `s_axis_tlast`: the frame's last taxel.
    pub s_last: bool,
    /// `m_axis_tready`: the receiver takes a beat.
    pub m_ready: bool,
}

/// The engine's output pins in one clock cycle, sampled just before the rising edge.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Outputs {
    /// `s_axis_tready`: an offered code is taken at this cycle's edge.
    pub s_ready: bool,
    /// `m_axis_tvalid`: a beat is offered.
    pub m_valid: bool,
    /// `m_axis_tdata` as `[fx, fy, fz]`, each a 32-bit signed word.
    pub m_data: [i32; 3],
    /// `m_axis_tlast`: the last status beat of a frame.
    pub m_last: bool,
    /// One entry per [`Tap`]: the word that stage passed on in this cycle, if any.
    pub taps: Vec<Option<Vec<i64>>>,
}

/// A stage's stream that the test bench observes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tap {
    /// Stage name, equal to the bit-true model's.
    pub name: &'static str,
    /// Verilog expression for "a word passes in this cycle", relative to the top instance: `{}` stands
    /// for the instance's path and dot (`bench.dut.`).
    pub valid: String,
    /// Verilog expression of the word, same convention; field 0 in the least significant bits.
    pub data: String,
    /// Signed fields in a word.
    pub fields: usize,
    /// Width of each field, 1..=64 bits.
    pub field_bits: u32,
}

/// Something that computes one clock cycle of the engine.
pub trait Device {
    /// Applies `inputs`, samples the outputs as they stand before the rising edge, then clocks.
    /// A beat is transferred in this cycle exactly when valid and ready are both set.
    fn cycle(&mut self, inputs: &Inputs) -> Outputs;
}
