//! A device that flips one of its bits at a given cycle.

use dermis_hdl::device::{Device, Inputs, Outputs};

use super::super::verilator::{Found, Verilated};

/// One bit of one word of a register or memory.
#[derive(Clone, Copy)]
pub(super) struct StateBit {
    pub(super) element: Found,
    pub(super) word: usize,
    pub(super) bit: usize,
}

/// Wraps a device and flips `bit` once, in cycle `flip_cycle` counted from the first cycle without reset.
pub(super) struct FaultInjector<'a> {
    device: &'a mut Verilated,
    bit: StateBit,
    flip_cycle: u64,
    cycle: u64,
}

impl<'a> FaultInjector<'a> {
    /// A device whose `bit` flips in cycle `flip_cycle`.
    pub(super) fn new(device: &'a mut Verilated, bit: StateBit, flip_cycle: u64) -> Self {
        FaultInjector { device, bit, flip_cycle, cycle: 0 }
    }

    /// Flips the bit now.
    pub(super) fn flip(&mut self) {
        let StateBit { element, word, bit } = self.bit;
        self.device.flip(element, word, bit);
    }
}

impl Device for FaultInjector<'_> {
    fn cycle(&mut self, inputs: &Inputs) -> Outputs {
        if !inputs.rst {
            if self.cycle == self.flip_cycle {
                self.flip();
            }
            self.cycle += 1;
        }
        self.device.cycle(inputs)
    }
}
