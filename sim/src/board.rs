//! A board without a board: its top module under Verilator, its UART's bytes, and a pseudo-terminal that a host opens.
//!
//! ```text
//! host --- pseudo-terminal --- Wire --- UartLine --- BoardDevice (board top: UART, packets, engine)
//!                              drops, flips, delays
//! ```

mod line;
mod terminal;
mod wire;

pub use line::{Sent, UartLine};
pub use terminal::Terminal;
pub use wire::{Faults, Wire};

use std::path::Path;

use dermis_hdl::link::{BoardDevice, BoardOutputs};
use dermis_hdl::Generated;

use crate::verilator::{Bench, Design, VerilatorError};

/// Words of the bench's output; the shim takes no fewer.
const OUT_WORDS: usize = 4;

/// A board's top module under Verilator.
pub struct VerilatedBoard(Bench);

impl VerilatedBoard {
    /// Builds what [`dermis_hdl::link::generate_board`] gives, or takes it from `cache`, and starts it.
    ///
    /// # Errors
    /// As for the engine.
    pub fn new(generated: &Generated, cache: &Path) -> Result<Self, VerilatorError> {
        let top = &generated.top;
        let bench = format!(
            "// Test bench of {top}: pins packed into two vectors. Generated, do not edit.\n\
             module bench(input wire clk, input wire [63:0] in, output wire [127:0] out);\n  \
             assign out[127:4] = 124'd0;\n  \
             {top} dut(.clk(clk), .button(1'b0), .uart_rx(in[0]), .uart_tx(out[0]), .alive(out[1]), .busy(out[2]),\n    \
             .error(out[3]));\nendmodule\n"
        );
        let files = generated.files.iter().map(|f| (f.name.as_str(), f.text.as_str())).collect();
        let design = Design { top, files, taps: &[], input_bits: 1, writable: false };
        Bench::new(&design, &bench, OUT_WORDS, cache).map(VerilatedBoard)
    }
}

impl BoardDevice for VerilatedBoard {
    fn cycle(&mut self, uart_rx: bool) -> BoardOutputs {
        let pins = self.0.cycle(u64::from(uart_rx))[0];
        let pin = |index: u32| pins >> index & 1 == 1;
        BoardOutputs { uart_tx: pin(0), alive: pin(1), busy: pin(2), error: pin(3) }
    }
}
