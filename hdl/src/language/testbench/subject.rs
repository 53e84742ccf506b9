//! What a test drives: a kernel alone, or a block with the blocks inside it.

use crate::language::change::Change;
use crate::language::hierarchy::{Hierarchy, RamStyles};
use crate::language::kernel::{Kernel, Role, Signal as KernelSignal};
use crate::language::simulate::Simulation;
use crate::wire::Word;

/// A port: name, width in bits.
pub(crate) type Pin = (String, usize);

/// One clock cycle with these inputs: the outputs before its rising edge.
type Cycle<'a> = dyn FnMut(&[Word]) -> Vec<Word> + 'a;

/// Ports, a simulation inside Rust and the Verilog of the same design.
pub(crate) struct Subject<'a> {
    pub(super) clock: Option<String>,
    pub(crate) inputs: Vec<Pin>,
    pub(super) outputs: Vec<Pin>,
    /// With the top module `dut`.
    pub(super) verilog: String,
    /// Name and text of the files that the Verilog reads.
    pub(super) files: Vec<(String, String)>,
    run: Box<Cycle<'a>>,
}

impl Subject<'_> {
    /// One clock cycle of the simulation inside Rust with these inputs: the outputs before its rising edge.
    pub(crate) fn cycle(&mut self, inputs: &[Word]) -> Vec<Word> {
        (self.run)(inputs)
    }

    /// The outputs of every cycle in the simulation inside Rust.
    pub(crate) fn simulated(&mut self, stimulus: &[Vec<Word>]) -> Vec<Vec<Word>> {
        stimulus.iter().map(|inputs| self.cycle(inputs)).collect()
    }
}

/// A kernel in its own simulation; inputs and outputs in the order of its signals.
impl<'a> From<&'a Kernel> for Subject<'a> {
    fn from(kernel: &'a Kernel) -> Self {
        let names = |is_own: fn(&KernelSignal) -> bool| -> Vec<&str> {
            kernel.signals.iter().filter(|signal| is_own(signal)).map(|signal| signal.name.as_str()).collect()
        };
        let (inputs, outputs) = (names(|signal| signal.role == Role::Input), names(|signal| signal.output));
        Subject::of(kernel.clone(), &[], &inputs, &outputs)
    }
}

impl Subject<'_> {
    /// A kernel with the blocks inside it and with these `changes`; the ports in the order of their names.
    pub(crate) fn of(kernel: Kernel, changes: &[Change], inputs: &[&str], outputs: &[&str]) -> Self {
        let clock = kernel.clock.clone();
        let hierarchy = Hierarchy::of_kernel(kernel);
        hierarchy.check().unwrap();
        let hierarchy = hierarchy.changed(changes).unwrap();
        let flat = hierarchy.flat(&[]);
        let mut simulation = Simulation::new(&flat);
        let pin = |name: &&str| {
            let signal = flat.signal_of(name).unwrap_or_else(|| panic!("no port {name}"));
            ((*name).to_owned(), flat.signals[signal].ty.bits)
        };
        let [inputs, outputs] = [inputs, outputs].map(|names| names.iter().map(pin).collect::<Vec<Pin>>());
        let slots = |pins: &[Pin]| -> Vec<(usize, usize)> {
            pins.iter().map(|(name, bits)| (simulation.slot_of(&flat, name).unwrap(), *bits)).collect()
        };
        let (read, driven) = (slots(&inputs), slots(&outputs));
        let cycle = move |words: &[Word]| {
            for (word, &(slot, bits)) in words.iter().zip(&read) {
                simulation.set(slot, bits.div_ceil(64), word.limbs());
            }
            simulation.show();
            let outputs =
                driven.iter().map(|&(slot, bits)| word(simulation.get(slot, bits.div_ceil(64)), bits)).collect();
            simulation.clock();
            outputs
        };
        Subject {
            verilog: hierarchy.verilog("dut", Some(&RamStyles::new())),
            files: hierarchy.memory_files("dut"),
            run: Box::new(cycle),
            clock,
            inputs,
            outputs,
        }
    }
}

/// The low `bits` bits of a number: a signed one has its sign above its width.
fn word(limbs: &[u64], bits: usize) -> Word {
    let mut word = Word::default();
    for (limb, &value) in limbs.iter().enumerate() {
        word.set(64 * limb, (bits - 64 * limb).min(64), value);
    }
    word
}
