//! Kernel simulation of a scan.

use dermis_golden::fixed::Model;

use super::core::scanner;
use super::pins::{Beat, ScanDevice, ScanInputs, ScanOutputs, ScanPins};
use crate::error::HdlError;
use crate::language::{Run, Slot};
use crate::wire::Word;

struct Simulator {
    run: Run,
    /// Reset, enable, receiver ready.
    control: [Slot; 3],
    miso: Slot,
    /// Data, valid, last and ready of the stream of images.
    images: [Slot; 4],
    /// Data, valid and last of the output.
    output: [Slot; 3],
    /// Row, serial clock, chip select and commands.
    pins: [Slot; 4],
    /// Data, valid, last and ready of the engine's input.
    engine: [Slot; 4],
}

/// Data, valid, last, ready of the engine's input.
const ENGINE_INPUT: [(&str, &str); 4] = [
    ("", "engine__s_axis_tdata"),
    ("", "engine__s_axis_tvalid"),
    ("", "engine__s_axis_tlast"),
    ("", "engine__s_axis_tready"),
];

/// The scan of `model` in kernel simulation.
///
/// # Errors
/// As [`super::generate_scan`].
pub fn scan_simulator(model: &Model) -> Result<Box<dyn ScanDevice>, HdlError> {
    let run = Run::new(&scanner(model)?, &ENGINE_INPUT);
    let pin = |name: &str| run.slot("", name);
    Ok(Box::new(Simulator {
        control: ["rst", "enable", "m_axis_tready"].map(pin),
        miso: pin("adc_miso"),
        images: ["s_axis_tdata", "s_axis_tvalid", "s_axis_tlast", "s_axis_tready"].map(pin),
        output: ["m_axis_tdata", "m_axis_tvalid", "m_axis_tlast"].map(pin),
        pins: ["row", "adc_sclk", "adc_cs_n", "adc_mosi"].map(pin),
        engine: ENGINE_INPUT.map(|(path, name)| run.slot(path, name)),
        run,
    }))
}

impl ScanDevice for Simulator {
    fn cycle(&mut self, inputs: &ScanInputs) -> ScanOutputs {
        let run = &mut self.run;
        let ([rst, enable, m_ready], [s_data, s_valid, s_last, s_ready]) = (self.control, self.images);
        run.set(rst, inputs.rst.into());
        run.set(enable, inputs.enable.into());
        run.set(m_ready, inputs.m_ready.into());
        run.set(self.miso, inputs.miso.into());
        run.set(s_data, Word::of_fields(&[inputs.s_data.into()], 64));
        run.set(s_valid, inputs.s_valid.into());
        run.set(s_last, inputs.s_last.into());
        run.settle();
        let high = |slot: Slot| run.is_high(slot);
        let ([m_data, m_valid, m_last], [data, valid, last, ready]) = (self.output, self.engine);
        let [row, sclk, cs_n, mosi] = self.pins;
        let beats = run.get(m_data);
        let beat = Beat { data: run.get(data).signed(0, data.bits()) as i32, last: high(last) };
        let outputs = ScanOutputs {
            pins: ScanPins { row: run.get(row).number(), sclk: high(sclk), cs_n: high(cs_n), mosi: high(mosi) },
            m_valid: high(m_valid),
            m_last: high(m_last),
            m_data: [0, 1, 2].map(|word| beats.signed(word, 32) as i32),
            s_ready: high(s_ready),
            taken: (high(valid) && high(ready)).then_some(beat),
        };
        run.clock();
        outputs
    }
}
