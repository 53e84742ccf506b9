//! A scan under Verilator.

use std::path::Path;

use dermis_golden::fixed::plan::resources::count_bits;
use dermis_golden::fixed::Model;
use dermis_hdl::scan::{Beat, ScanDevice, ScanInputs, ScanOutputs, ScanPins};
use dermis_hdl::Generated;

use crate::verilator::{Design, VerilatedBench, VerilatorError};

/// Length of the bench's vector `out` in 32-bit words: beat, pins, row, what the engine takes.
const OUT_WORDS: usize = 6;
/// Positions in `out`, after the beat of 96 bits.
const PINS: usize = 3;
const ROW: usize = 4;
const TAKEN: usize = 5;
/// Position of the converters' outputs in `in`, of which there are at most 8, and of a byte of an image.
const MISO: usize = 3;
const BYTE: usize = 16;

/// A scan's top module under Verilator.
pub struct VerilatedScan {
    bench: VerilatedBench,
    /// Width of a beat to the engine.
    stream_bits: u32,
}

impl VerilatedScan {
    /// Builds the hardware of [`dermis_hdl::scan::generate_scan`] for `model`, or takes it from `cache`, and starts it.
    ///
    /// # Errors
    /// [`VerilatorError`]: no Verilator, a design that it refuses, or files that cannot be written.
    pub fn new(generated: &Generated, model: &Model, cache: &Path) -> Result<Self, VerilatorError> {
        let top = &generated.top;
        let converters = model.scene.hardware.adc_scan.map_or(1, |scan| scan.converters);
        let (rows, stream_bits) = (count_bits(model.scene.sensor.rows), model.stream_bits());
        let writable = model.has_writable_tables();
        let images = format!(
            ".s_axis_tdata(in[{last}:{BYTE}]), .s_axis_tvalid(in[14]), .s_axis_tlast(in[15]), .s_axis_tready(out[104]),\n    ",
            last = BYTE as u32 + stream_bits - 1,
        );
        let bench = format!(
            "// Test bench of {top}: pins packed into two vectors. Generated, do not edit.\n\
             module bench(input wire clk, input wire [63:0] in, output wire [{end}:0] out);\n  \
             assign out[{end}:{taken_end}] = 0;\n  \
             assign out[159:{row_end}] = 0;\n  \
             assign out[127:{pins_end}] = 0;\n  \
             assign out[{taken_last}:160] = dut.engine__s_axis_tdata;\n  \
             assign out[102:101] = {{dut.engine__s_axis_tlast, dut.engine__s_axis_tvalid & dut.engine__s_axis_tready}};\n  \
             assign out[103] = 0;\n  \
             {top} dut(.clk(clk), .rst(in[0]), .m_axis_tready(in[1]), .enable(in[2]), .adc_miso(in[{miso_last}:{MISO}]),\n    \
             {images}.m_axis_tdata(out[95:0]), .m_axis_tvalid(out[96]), .m_axis_tlast(out[97]),\n    \
             .adc_sclk(out[98]), .adc_cs_n(out[99]), .adc_mosi(out[100]), .row(out[{row_last}:128]));\nendmodule\n",
            end = 32 * OUT_WORDS - 1,
            taken_end = 160 + stream_bits,
            taken_last = 159 + stream_bits,
            row_end = 128 + rows,
            row_last = 127 + rows,
            pins_end = if writable { 105 } else { 104 },
            miso_last = MISO + converters - 1,
            images = if writable { &images } else { "" },
        );
        Ok(VerilatedScan {
            bench: VerilatedBench::new(&Design::of_pins(generated), &bench, OUT_WORDS, cache)?,
            stream_bits,
        })
    }
}

impl ScanDevice for VerilatedScan {
    fn cycle(&mut self, inputs: &ScanInputs) -> ScanOutputs {
        let bits = [inputs.rst, inputs.m_ready, inputs.enable].into_iter().enumerate();
        let bits = bits.fold(0, |all, (at, bit)| all | u64::from(bit) << at);
        let byte = (inputs.s_data as u64 & ((1 << self.stream_bits) - 1)) << BYTE;
        let image = u64::from(inputs.s_valid) << 14 | u64::from(inputs.s_last) << 15 | byte;
        let packed = bits | inputs.miso << MISO | image;
        let out = self.bench.cycle(packed);
        let pin = |index: u32| out[PINS] >> index & 1 == 1;
        let unused = 32 - self.stream_bits;
        ScanOutputs {
            pins: ScanPins { row: out[ROW].into(), sclk: pin(2), cs_n: pin(3), mosi: pin(4) },
            m_valid: pin(0),
            m_last: pin(1),
            m_data: [0, 1, 2].map(|word| out[word] as i32),
            s_ready: pin(8),
            taken: pin(5).then_some(Beat { data: (out[TAKEN] << unused) as i32 >> unused, last: pin(6) }),
        }
    }
}
