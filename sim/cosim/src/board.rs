//! A board's top module under Verilator.

use std::path::Path;

use dermis_golden::fixed::plan::resources::count_bits;
use dermis_golden::fixed::Model;
use dermis_hdl::link::{BoardDevice, BoardOutputs};
use dermis_hdl::scan::ScanPins;
use dermis_hdl::Generated;

use super::verilator::{Design, VerilatedBench, VerilatorError};

/// Length of the bench's vector `out` in 32-bit words, the shim's minimum.
const OUT_WORDS: usize = 4;

/// A board's top module under Verilator.
pub struct VerilatedBoard(VerilatedBench);

impl VerilatedBoard {
    /// Builds the board of [`dermis_hdl::link::generate_board`] for `model`, or takes it from `cache`, and starts it.
    ///
    /// # Errors
    /// [`VerilatorError`]: no Verilator, a design that it refuses, or files that cannot be written.
    pub fn new(generated: &Generated, model: &Model, cache: &Path) -> Result<Self, VerilatorError> {
        let top = &generated.top;
        let link = model.scene.hardware.link;
        let inputs = link.inputs().iter().enumerate();
        let inputs: String = inputs.map(|(at, pin)| format!(".{pin}(in[{}]), ", at + 1)).collect();
        let output = link.output();
        let scan = model.scene.hardware.adc_scan.map(|scan| {
            let first = link.inputs().len() + 1;
            let (miso, row) = (first + scan.converters - 1, 6 + count_bits(model.scene.sensor.rows));
            format!(
                ",\n    .adc_miso(in[{miso}:{first}]), .adc_sclk(out[4]), .adc_cs_n(out[5]), .adc_mosi(out[6]), .row(out[{row}:7])"
            )
        });
        let pins = if scan.is_some() { 7 + count_bits(model.scene.sensor.rows) } else { 4 };
        let bench = format!(
            "// Test bench of {top}: pins packed into two vectors, clk among them, as an SPI has a second clock. \
             Generated, do not edit.\n\
             module bench(input wire clk, input wire [63:0] in, output wire [127:0] out);\n  \
             assign out[127:{pins}] = 0;\n  \
             {top} dut(.clk(in[0]), .button(1'b0), {inputs}.{output}(out[0]),\n    \
             .alive(out[1]), .busy(out[2]), .error(out[3]){scan});\nendmodule\n",
            scan = scan.unwrap_or_default(),
        );
        VerilatedBench::new(&Design::of_pins(generated), &bench, OUT_WORDS, cache).map(VerilatedBoard)
    }
}

impl BoardDevice for VerilatedBoard {
    fn settle(&mut self, inputs: u64, clock: bool) -> BoardOutputs {
        let pins = self.0.cycle(inputs << 1 | u64::from(clock))[0];
        let pin = |index: u32| pins >> index & 1 == 1;
        let scan = ScanPins { row: u64::from(pins >> 7), sclk: pin(4), cs_n: pin(5), mosi: pin(6) };
        BoardOutputs { to_host: pin(0), alive: pin(1), busy: pin(2), error: pin(3), scan }
    }
}
