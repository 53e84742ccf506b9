//! The array before its converters: a voltage per taxel, and faults of its wires.

use anyhow::{ensure, Result};
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::Model;
use dermis_golden::spec::adc::AdcScan;

/// Largest noise of a sample in the co-simulation, in LSBs of the converter.
pub(super) const NOISE_LSB: f64 = 3.0;

/// A fault of the wires between array, converters and hardware, for the whole run but for `Flip`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The output of a converter is always at this level.
    Stuck {
        /// The converter.
        converter: usize,
        /// The level.
        level: bool,
    },
    /// A bit of one answer is inverted on the wire.
    Flip {
        /// The converter.
        converter: usize,
        /// Number of the frame on the bus, from 0.
        frame: usize,
        /// Bit of the answer, 0 is the last.
        bit: usize,
    },
    /// A converter takes each command for that of the channel after it.
    NextChannel {
        /// The converter.
        converter: usize,
    },
    /// The row lines do not switch: this row is always driven.
    Row {
        /// The row.
        row: usize,
    },
}

impl Fault {
    /// Checks that `array` has what the fault names, in a run of so many scans.
    ///
    /// # Errors
    /// The part, its number, and how many there are.
    pub fn check(self, array: &Array, scans: usize) -> Result<()> {
        let converters = array.scan.converters;
        let parts = match self {
            Fault::Stuck { converter, .. } | Fault::NextChannel { converter } => {
                vec![("converter", converter, converters)]
            }
            Fault::Flip { converter, frame, bit } => vec![
                ("converter", converter, converters),
                ("frame on the bus", frame, scans * array.rows * array.frames_of_row()),
                ("bit of an answer", bit, array.scan.converter.answer_bits() as usize),
            ],
            Fault::Row { row } => vec![("row", row, array.rows)],
        };
        for (part, number, count) in parts {
            ensure!(number < count, "--wire: {part} {number} is not possible; it must be 0 to {}", count - 1);
        }
        Ok(())
    }
}

/// Voltages of an array, as shares of the converters' full range.
#[derive(Clone, Debug)]
pub struct Array {
    scan: AdcScan,
    rows: usize,
    /// Voltages of each scan, row-major: 1 is the upper end of the range.
    volts: Vec<Vec<f64>>,
    /// Largest noise of a sample, in LSBs of the converter.
    noise_lsb: f64,
    fault: Option<Fault>,
}

impl Array {
    /// An array of so many rows that shows one list of voltages per scan, again and again.
    pub fn new(scan: AdcScan, rows: usize, volts: Vec<Vec<f64>>, noise_lsb: f64, fault: Option<Fault>) -> Self {
        Array { scan, rows, volts, noise_lsb, fault }
    }

    /// Frames on the bus for each row: one that chooses the first channel, and one per sample.
    pub fn frames_of_row(&self) -> usize {
        1 + self.scan.channels * self.scan.samples()
    }

    /// The scan of a frame on the bus.
    pub fn scan_of(&self, frame: usize) -> usize {
        frame / (self.rows * self.frames_of_row())
    }

    /// What converter `converter` answers in the frame of this number about a channel of a row: tag above result, as it
    /// arrives.
    pub fn answer(&self, row: usize, channel: usize, converter: usize, frame: usize) -> u32 {
        let adc = &self.scan.converter;
        let row = match self.fault {
            Some(Fault::Row { row }) => row,
            _ => row,
        };
        let channel = match self.fault {
            Some(Fault::NextChannel { converter: of }) if of == converter => (channel + 1) % adc.channels,
            _ => channel,
        };
        let volts = self.volts.get(self.scan_of(frame) % self.volts.len().max(1));
        let at = row * self.scan.cols() + channel * self.scan.converters + converter;
        // Channels that are not used are open.
        let level = volts.filter(|_| channel < self.scan.channels).and_then(|volts| volts.get(at)).map_or(0.0, |v| *v);
        let steps = (1u64 << adc.bits) as f64;
        let middle = if adc.bipolar { steps / 2.0 } else { 0.0 };
        let lsb = (level * adc.full_steps() + middle + self.noise(frame, converter)).floor();
        let result = lsb.clamp(0.0, steps - 1.0) as u32;
        let tag = if adc.tag_bits > 0 { channel as u32 } else { 0 };
        let answer = tag << adc.bits | result;
        match self.fault {
            Some(Fault::Stuck { converter: of, level }) if of == converter => {
                if level {
                    (1u64 << adc.answer_bits()).wrapping_sub(1) as u32
                } else {
                    0
                }
            }
            Some(Fault::Flip { converter: of, frame: at, bit }) if of == converter && at == frame => answer ^ 1 << bit,
            _ => answer,
        }
    }

    /// The answers of a scan by plan, in the order of the wire: by row, channel, sample, converter.
    pub fn answers(&self, number: usize) -> Vec<u32> {
        let (samples, of_row) = (self.scan.samples(), self.frames_of_row());
        let mut answers = Vec::new();
        for row in 0..self.rows {
            for index in 0..self.scan.channels * samples {
                let frame = (number * self.rows + row) * of_row + 1 + index;
                let own = |converter| self.answer(row, index / samples, converter, frame);
                answers.extend((0..self.scan.converters).map(own));
            }
        }
        answers
    }

    /// Noise of a sample in LSBs, from −`noise_lsb` to it: of the frame's and the converter's number alone, so that the plan
    /// and the simulation have the same.
    fn noise(&self, frame: usize, converter: usize) -> f64 {
        let seed = (frame * 64 + converter) as u64;
        let share = fastrand::Rng::with_seed(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15)).f64();
        self.noise_lsb * (2.0 * share - 1.0)
    }
}

/// The voltages of an array that has the readings of `frame`, as shares of the converters' full range.
///
/// # Errors
/// A frame of another sensor.
pub(super) fn volts(model: &Model, frame: &Frame) -> Result<Vec<f64>> {
    let full = f64::from(1u32 << (model.formats().code_bits - 1));
    let codes = model.readings(std::slice::from_ref(frame))?;
    Ok(codes.into_iter().map(|code| f64::from(code) / full).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use dermis_golden::spec::adc::CONVERTERS;

    #[test]
    fn a_fault_of_what_is_not_there_is_refused() {
        let scan = AdcScan {
            converter: CONVERTERS[0],
            converters: 2,
            channels: 3,
            sclk_MHz: 10.0,
            row_settling_us: 0.0,
            channel_settling_us: 0.0,
            average: 1,
            period_us: 1000.0,
        };
        let array = Array::new(scan, 4, Vec::new(), 0.0, None);
        let checked = |fault: Fault| fault.check(&array, 2).map_err(|error| error.to_string());
        assert_eq!(checked(Fault::Flip { converter: 1, frame: 55, bit: 15 }), Ok(()));
        let cases = [
            (Fault::Stuck { converter: 2, level: true }, "--wire: converter 2 is not possible; it must be 0 to 1"),
            (Fault::Row { row: 4 }, "--wire: row 4 is not possible; it must be 0 to 3"),
            (
                Fault::Flip { converter: 0, frame: 56, bit: 0 },
                "--wire: frame on the bus 56 is not possible; it must be 0 to 55",
            ),
            (
                Fault::Flip { converter: 0, frame: 0, bit: 40 },
                "--wire: bit of an answer 40 is not possible; it must be 0 to 15",
            ),
        ];
        for (fault, message) in cases {
            assert_eq!(checked(fault), Err(message.to_owned()));
        }
    }
}
