//! Counts the register bits that change in a simulated design.

use anyhow::{anyhow, Result};
use dermis_hdl::device::{Device, Inputs, Outputs};
use dermis_hdl::state::StateElement;

use super::verilator::{Found, Verilated};

/// A device whose registers are compared from cycle to cycle; changes in cycles with reset do not count.
pub struct ToggleCounter<'a> {
    device: &'a mut Verilated,
    registers: Vec<Register>,
}

/// A register, its bytes after the last cycle, and its changes.
struct Register {
    found: Found,
    last: Vec<u8>,
    toggles: u64,
}

impl<'a> ToggleCounter<'a> {
    /// Watches `registers` of `device`.
    ///
    /// # Errors
    /// A register that the design does not have, or a design without `open_state`.
    pub fn new<'b>(device: &'a mut Verilated, registers: impl Iterator<Item = &'b StateElement>) -> Result<Self> {
        let mut watched = Vec::new();
        for StateElement { scope, signal, .. } in registers {
            let found = device.find(scope, signal).ok_or_else(|| anyhow!("{scope}.{signal} cannot be read"))?;
            watched.push(Register { found, last: device.bytes(found).to_vec(), toggles: 0 });
        }
        Ok(ToggleCounter { device, registers: watched })
    }

    /// The changes of each register so far: the sum over its bits.
    pub fn toggles(&self) -> impl Iterator<Item = u64> + '_ {
        self.registers.iter().map(|register| register.toggles)
    }
}

impl Device for ToggleCounter<'_> {
    fn cycle(&mut self, inputs: &Inputs) -> Outputs {
        let outputs = self.device.cycle(inputs);
        for Register { found, last, toggles } in &mut self.registers {
            let bytes = self.device.bytes(*found);
            if !inputs.rst {
                *toggles +=
                    last.iter().zip(bytes).map(|(last, byte)| u64::from((last ^ byte).count_ones())).sum::<u64>();
            }
            last.copy_from_slice(bytes);
        }
        outputs
    }
}
