//! The engine's pins as a clocked device, independent of the simulator.
//!
//! The kernel simulation, the Verilated RTL and the post-synthesis netlist all implement [`Device`], so that one test
//! bench drives them all.
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
    /// `s_axis_tvalid`: `s_data` holds a code.
    pub s_valid: bool,
    /// `s_axis_tdata`: a taxel's code, two's complement, `code_bits` wide.
    pub s_data: i32,
    /// `s_axis_tid`, of an engine of several arrays: the one that the frame is of.
    pub s_array: usize,
    /// `s_axis_tlast`: the code is the frame's last.
    pub s_last: bool,
    /// `m_axis_tready`: the receiver accepts a beat in this cycle.
    pub m_ready: bool,
}

/// The engine's output pins in one clock cycle, sampled just before the rising edge.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Outputs {
    /// `s_axis_tready`: a code offered in this cycle is accepted at its rising edge.
    pub s_ready: bool,
    /// `m_axis_tvalid`: `m_data` holds a beat.
    pub m_valid: bool,
    /// `m_axis_tdata` as `[fx, fy, fz]`, each a 32-bit signed word.
    pub m_data: [i32; 3],
    /// `m_axis_tid`, of an engine of several arrays: the one that the frame is of; else 0.
    pub m_array: usize,
    /// `m_axis_tlast`: the beat is the last status beat of its frame.
    pub m_last: bool,
    /// One entry per [`Tap`]: the fields of the word that passes in this cycle, `None` if there is none.
    pub taps: Vec<Option<Vec<i64>>>,
}

/// The stream between two stages, as the test bench observes it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tap {
    /// Stage name, as in the bit-true model.
    pub name: &'static str,
    /// Signals of the top module, one bit each; a word passes in a cycle in which all are 1.
    pub valid: Vec<String>,
    /// Signals whose fields form the word, the first fields first; each holds the same number of fields.
    pub word: Vec<TapSignal>,
    /// Names of the fields in a word.
    pub fields: Vec<&'static str>,
    /// Width of each field in bits, two's complement, 1..=64.
    pub field_bits: u32,
}

impl Tap {
    /// Width of a word in bits.
    pub fn bits(&self) -> usize {
        self.fields.len() * self.field_bits as usize
    }
}

/// A signal in the word of a [`Tap`]. One that is narrower than its fields holds one field, and is extended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TapSignal {
    /// Name in the top module.
    pub name: String,
    /// Width in bits.
    pub bits: u32,
    /// Extended by its sign if set, else by zeros.
    pub signed: bool,
}

/// A simulated engine, advanced one clock cycle at a time.
pub trait Device {
    /// Applies `inputs`, samples the outputs before the rising edge, then clocks. A beat is transferred in this cycle
    /// exactly when valid and ready are both set.
    fn cycle(&mut self, inputs: &Inputs) -> Outputs;
}
