//! A device in which a bit flips.

use dermis_hdl::device::{Device, Inputs, Outputs};

use super::places::Place;
use crate::verilator::Verilated;

/// Flips its bit once, in the cycle `at` after the first one without reset.
pub(super) struct Struck<'a> {
    device: &'a mut Verilated,
    place: (&'a Place, usize, usize),
    at: u64,
    cycle: u64,
}

impl<'a> Struck<'a> {
    /// A bit of a word of a place.
    pub(super) fn new(device: &'a mut Verilated, place: (&'a Place, usize, usize), at: u64) -> Self {
        Struck { device, place, at, cycle: 0 }
    }

    /// Flips the bit now.
    pub(super) fn strike(&mut self) {
        let (place, word, bit) = self.place;
        self.device.flip(&place.scope, &place.signal, word, bit);
    }
}

impl Device for Struck<'_> {
    fn cycle(&mut self, inputs: &Inputs) -> Outputs {
        if !inputs.rst {
            if self.cycle == self.at {
                self.strike();
            }
            self.cycle += 1;
        }
        self.device.cycle(inputs)
    }
}
