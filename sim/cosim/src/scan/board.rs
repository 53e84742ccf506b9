//! A board that scans its array, with the array and its converters.

use anyhow::{bail, Result};
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::Model;
use dermis_hdl::link::{BoardDevice, BoardOutputs};
use dermis_hdl::scan::ScanPins;

use super::array::{volts, Array, NOISE_LSB};
use super::converters::Converters;

/// A board whose converters are simulated with it: only the pins of its link are left.
pub struct ScannedBoard {
    board: Box<dyn BoardDevice>,
    converters: Converters,
    /// Input pins of the link.
    link_pins: usize,
    /// Pins before the rising edge of the clock, and the clock.
    before: ScanPins,
    clock: bool,
}

impl ScannedBoard {
    /// The board of `model` with an array that shows `frames`, one per scan, again and again.
    ///
    /// # Errors
    /// A scene without a scan, no frames, a frame of another sensor.
    pub fn new(board: Box<dyn BoardDevice>, model: &Model, frames: &[Frame]) -> Result<Self> {
        let Some(scan) = model.scene.hardware.adc_scan else { bail!("hardware.source = stream: there is no scan") };
        if frames.is_empty() {
            bail!(
                "scene {}: no frame is shipped for {}, which the array could show",
                model.scene.name,
                model.scene.sensor
            );
        }
        let volts = frames.iter().map(|frame| volts(model, frame)).collect::<Result<Vec<_>>>()?;
        let array = Array::new(scan, model.scene.sensor.rows, volts, NOISE_LSB, None);
        let converters = Converters::new(scan, array, model.board.clock_MHz);
        let link_pins = model.scene.hardware.link.inputs().len();
        Ok(ScannedBoard { board, converters, link_pins, before: ScanPins::default(), clock: false })
    }
}

impl BoardDevice for ScannedBoard {
    fn settle(&mut self, inputs: u64, clock: bool) -> BoardOutputs {
        let outputs = self.board.settle(inputs | self.converters.outputs() << self.link_pins, clock);
        if clock && !self.clock {
            self.converters.cycle(&self.before);
        } else if !clock {
            self.before = outputs.scan;
        }
        self.clock = clock;
        outputs
    }
}
