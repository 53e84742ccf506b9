//! A hierarchy of blocks in simulation.

use super::compile::limbs;
use super::hierarchy::Hierarchy;
use super::simulate::Simulation;
use crate::wire::Word;

/// A signal of a [`Run`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Slot {
    first: usize,
    bits: usize,
}

/// A hierarchy of blocks in simulation, as one kernel: ports of the top by name, signals inside by path and name.
#[derive(Debug)]
pub struct Run {
    simulation: Simulation,
    slots: Vec<((String, String), Slot)>,
}

impl Run {
    /// Starts `hierarchy`. `observed` are signals besides the ports of the top that can be read, each by the path of its block
    /// and its name.
    pub fn new(hierarchy: &Hierarchy, observed: &[(&str, &str)]) -> Self {
        let flat = hierarchy.flat(observed);
        let simulation = Simulation::new(&flat);
        let ports = hierarchy.top().into_iter().flat_map(|top| top.ports.iter().map(|port| ("", port.name.as_str())));
        let slot = |(path, name): (&str, &str)| {
            let called = hierarchy.flat_name(path, name);
            let signal = flat.signal_of(&called)?;
            let slot = Slot { first: simulation.slot_of(&flat, &called)?, bits: flat.signals[signal].ty.bits };
            Some(((path.to_owned(), name.to_owned()), slot))
        };
        let slots = ports.chain(observed.iter().copied()).filter_map(slot).collect();
        Run { simulation, slots }
    }

    /// The signal `name` of the block at `path`; that of a signal that the hierarchy does not have is 0 bits wide, reads as 0
    /// and takes no value.
    pub fn slot(&self, path: &str, name: &str) -> Slot {
        let found = self.slots.iter().find(|((at, own), _)| at == path && own == name);
        found.map(|(_, slot)| *slot).unwrap_or_default()
    }

    /// Sets an input; bits beyond its width are dropped.
    pub fn set(&mut self, slot: Slot, value: Word) {
        let mut word = Word::default();
        for low in (0..slot.bits).step_by(64) {
            let bits = (slot.bits - low).min(64);
            word.set(low, bits, value.field(low, bits));
        }
        self.simulation.set(slot.first, limbs(slot.bits) as usize, word.limbs());
    }

    /// The value of a signal, settled by [`Run::settle`].
    pub fn get(&self, slot: Slot) -> Word {
        let mut word = Word::default();
        let values = self.simulation.get(slot.first, limbs(slot.bits) as usize);
        for (limb, &value) in values.iter().enumerate() {
            word.set(64 * limb, (slot.bits - 64 * limb).min(64), value);
        }
        word
    }

    /// Whether a signal is 1.
    pub fn is_high(&self, slot: Slot) -> bool {
        self.get(slot).number() == 1
    }

    /// Computes all outputs from the inputs, and follows the clocks besides that of the top.
    pub fn settle(&mut self) {
        self.simulation.show();
    }

    /// A rising edge of the top's clock.
    pub fn clock(&mut self) {
        self.simulation.clock();
    }
}

impl Slot {
    /// Width in bits.
    pub fn bits(self) -> usize {
        self.bits
    }
}
