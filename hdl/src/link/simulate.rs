//! Kernel simulation of a board as a [`BoardDevice`].

use dermis_golden::fixed::Model;

use super::board::{BoardDevice, BoardOutputs};
use super::board_top::board_top;
use crate::error::HdlError;
use crate::language::{Run, Slot};
use crate::scan::ScanPins;

struct Simulator {
    run: Run,
    clock: bool,
    /// Input pins of the link.
    inputs: Vec<Slot>,
    miso: Slot,
    to_host: Slot,
    lamps: [Slot; 3],
    /// Row, serial clock, chip select and commands of a scan.
    scan: [Slot; 4],
}

/// The board of `model` in kernel simulation.
///
/// # Errors
/// As [`super::generate_board`].
pub fn board_simulator(model: &Model) -> Result<Box<dyn BoardDevice>, HdlError> {
    let run = Run::new(&board_top(model)?, &[]);
    let pin = |name: &str| run.slot("", name);
    let link = model.scene.hardware.link;
    Ok(Box::new(Simulator {
        clock: false,
        inputs: link.inputs().iter().map(|name| pin(name)).collect(),
        miso: pin("adc_miso"),
        to_host: pin(link.output()),
        lamps: ["alive", "busy", "error"].map(pin),
        scan: ["row", "adc_sclk", "adc_cs_n", "adc_mosi"].map(pin),
        run,
    }))
}

impl BoardDevice for Simulator {
    fn settle(&mut self, inputs: u64, clock: bool) -> BoardOutputs {
        let Simulator { run, inputs: pins, .. } = self;
        for (bit, &pin) in pins.iter().enumerate() {
            run.set(pin, (inputs >> bit & 1).into());
        }
        run.set(self.miso, (inputs >> pins.len()).into());
        if clock && !std::mem::replace(&mut self.clock, clock) {
            run.clock();
        }
        self.clock = clock;
        run.settle();
        let high = |slot: Slot| run.is_high(slot);
        let [alive, busy, error] = self.lamps.map(high);
        let [row, sclk, cs_n, mosi] = self.scan;
        BoardOutputs {
            to_host: high(self.to_host),
            alive,
            busy,
            error,
            scan: ScanPins { row: run.get(row).number(), sclk: high(sclk), cs_n: high(cs_n), mosi: high(mosi) },
        }
    }
}
