//! A board's top module under Verilator.

use std::path::Path;

use dermis_golden::link::LinkKind;
use dermis_hdl::link::{BoardDevice, BoardOutputs};
use dermis_hdl::Generated;

use super::verilator::{Design, Optimisation, VerilatedBench, VerilatorError};

/// Length of the bench's vector `out` in 32-bit words, the shim's minimum.
const OUT_WORDS: usize = 4;

/// A board's top module under Verilator.
pub struct VerilatedBoard(VerilatedBench);

impl VerilatedBoard {
    /// Builds the board of [`dermis_hdl::link::generate_board`] for a scene with this `link`, or takes it from `cache`,
    /// and starts it.
    ///
    /// # Errors
    /// [`VerilatorError`]: no Verilator, a design that it refuses, or files that cannot be written.
    pub fn new(generated: &Generated, link: LinkKind, cache: &Path) -> Result<Self, VerilatorError> {
        let top = &generated.top;
        let inputs = link.inputs().iter().enumerate();
        let inputs: String = inputs.map(|(at, pin)| format!(".{pin}(in[{}]), ", at + 1)).collect();
        let output = link.output();
        let bench = format!(
            "// Test bench of {top}: pins packed into two vectors, clk among them, as an SPI has a second clock. \
             Generated, do not edit.\n\
             module bench(input wire clk, input wire [63:0] in, output wire [127:0] out);\n  \
             assign out[127:4] = 124'd0;\n  \
             {top} dut(.clk(in[0]), .button(1'b0), {inputs}.{output}(out[0]),\n    \
             .alive(out[1]), .busy(out[2]), .error(out[3]));\nendmodule\n"
        );
        let files = generated.files.iter().map(|f| (f.name.as_str(), f.text.as_str())).collect();
        let design = Design { top, files, taps: &[], input_bits: 1, open_state: false, optimisation: Optimisation::On };
        VerilatedBench::new(&design, &bench, OUT_WORDS, cache).map(VerilatedBoard)
    }
}

impl BoardDevice for VerilatedBoard {
    fn settle(&mut self, inputs: u64, clock: bool) -> BoardOutputs {
        let pins = self.0.cycle(inputs << 1 | u64::from(clock))[0];
        let pin = |index: u32| pins >> index & 1 == 1;
        BoardOutputs { to_host: pin(0), alive: pin(1), busy: pin(2), error: pin(3) }
    }
}
