//! A scan under Verilator.

use std::path::Path;

use dermis_golden::fixed::plan::resources::count_bits;
use dermis_golden::fixed::Model;
use dermis_hdl::scan::{ScanDevice, ScanInputs, ScanOutputs};
use dermis_hdl::Generated;

use crate::cosim::verilator::{Design, Optimisation, VerilatedBench, VerilatorError};

/// Length of the bench's vector `out` in 32-bit words: beat, pins, row, code.
const OUT_WORDS: usize = 6;
/// Positions in `out`, after the beat of 96 bits.
const PINS: usize = 3;
const ROW: usize = 4;
const CODE: usize = 5;

/// A scan's top module under Verilator.
pub struct VerilatedScan {
    bench: VerilatedBench,
    code_bits: u32,
}

impl VerilatedScan {
    /// Builds the hardware of [`dermis_hdl::scan::generate_scan`] for `model`, or takes it from `cache`, and starts it.
    ///
    /// # Errors
    /// [`VerilatorError`]: no Verilator, a design that it refuses, or files that cannot be written.
    pub fn new(generated: &Generated, model: &Model, cache: &Path) -> Result<Self, VerilatorError> {
        let top = &generated.top;
        let converters = model.scene.hardware.adc_scan.map_or(1, |scan| scan.converters);
        let (rows, code_bits) = (count_bits(model.scene.sensor.rows), model.formats().code_bits);
        let bench = format!(
            "// Test bench of {top}: pins packed into two vectors. Generated, do not edit.\n\
             module bench(input wire clk, input wire [63:0] in, output wire [{end}:0] out);\n  \
             assign out[{end}:{code_end}] = 0;\n  \
             assign out[159:{row_end}] = 0;\n  \
             assign out[127:102] = 0;\n  \
             assign out[{code_last}:160] = dut.capture__m_axis_tdata;\n  \
             assign out[101] = dut.capture__m_axis_tvalid & dut.capture__m_axis_tready;\n  \
             {top} dut(.clk(clk), .rst(in[0]), .m_axis_tready(in[1]), .adc_miso(in[{miso_last}:2]),\n    \
             .m_axis_tdata(out[95:0]), .m_axis_tvalid(out[96]), .m_axis_tlast(out[97]),\n    \
             .adc_sclk(out[98]), .adc_cs_n(out[99]), .adc_mosi(out[100]), .row(out[{row_last}:128]));\nendmodule\n",
            end = 32 * OUT_WORDS - 1,
            code_end = 160 + code_bits,
            code_last = 159 + code_bits,
            row_end = 128 + rows,
            row_last = 127 + rows,
            miso_last = 1 + converters,
        );
        let files = generated.files.iter().map(|f| (f.name.as_str(), f.text.as_str())).collect();
        let design = Design { top, files, taps: &[], input_bits: 1, open_state: false, optimisation: Optimisation::On };
        Ok(VerilatedScan { bench: VerilatedBench::new(&design, &bench, OUT_WORDS, cache)?, code_bits })
    }
}

impl ScanDevice for VerilatedScan {
    fn cycle(&mut self, inputs: &ScanInputs) -> ScanOutputs {
        let packed = u64::from(inputs.rst) | u64::from(inputs.m_ready) << 1 | inputs.miso << 2;
        let out = self.bench.cycle(packed);
        let pin = |index: u32| out[PINS] >> index & 1 == 1;
        let unused = 32 - self.code_bits;
        ScanOutputs {
            row: out[ROW].into(),
            sclk: pin(2),
            cs_n: pin(3),
            mosi: pin(4),
            m_valid: pin(0),
            m_last: pin(1),
            m_data: [0, 1, 2].map(|word| out[word] as i32),
            code: pin(5).then_some((out[CODE] << unused) as i32 >> unused),
        }
    }
}
