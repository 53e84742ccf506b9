//! Bundles from both ends: names, comments and widths of their ports, and what a connection carries.

use crate::block;
use crate::language::{kernel_of, Block, Builder, Hierarchy, Inside, Interface, KernelError, Run, Type};
use crate::wire::Word;

bundle! {
    /// Numbers, each of which is taken.
    struct Numbers { bits: usize }
    signals NumbersSignals: *bits > 0 => {
        out number "number": bits;
        /// There is one on `{}_number`.
        out given "given";
        /// It is taken in this cycle.
        in taken "taken";
    }
}

impl From<&usize> for Numbers {
    fn from(bits: &usize) -> Self {
        Numbers { bits: *bits }
    }
}

block! {
    /// Takes a number in every second cycle and passes it on, one larger.
    struct Pass { bits: usize }
    ports PassPorts {
        clock;
        reset;
        /// Any number.
        sink<Numbers> from: bits;
        /// The next one.
        source<Numbers> to: bits;
    }
}

impl Block for Pass {
    fn build<'k>(&self, k: &'k Builder, io: PassPorts<Inside<'k>>) {
        let turn = k.state("turn", Type::unsigned(1), io.rst, 0);
        turn.set(!*turn);
        let passes = k.wire("passes", *turn & io.from.given & io.to.taken);
        io.to.number.set(io.from.number.plus(1));
        io.to.given.set(*turn & io.from.given);
        io.from.taken.set(passes);
    }
}

block! {
    /// Two of them, one behind the other; the second may be left out, or not be connected.
    struct Chain {
        bits: usize,
        second: bool,
        connected: bool,
    }
    ports ChainPorts {
        clock;
        reset;
        /// Any number.
        sink<Numbers> from: bits;
        /// The number after the next.
        source<Numbers> to: bits;
    }
}

impl Block for Chain {
    fn build<'k>(&self, k: &'k Builder, io: ChainPorts<Inside<'k>>) {
        let first = k.instance("first", Pass { bits: self.bits });
        let second = k.instance("second", self.second.then_some(Pass { bits: self.bits }));
        io.from.inward().connect(&first.from);
        match second {
            Some(second) => {
                if self.connected {
                    first.to.connect(&second.from);
                }
                second.to.connect(&io.to);
            }
            None => first.to.connect(&io.to),
        }
    }
}

fn chain(bits: usize, second: bool) -> Chain {
    Chain { bits, second, connected: true }
}

#[test]
fn ports_have_the_names_directions_and_comments_of_their_bundle() {
    let verilog = Hierarchy::of_kernel(kernel_of(&Pass { bits: 8 })).verilog("pass", None);
    for line in [
        "    // Any number.\n    input wire [7:0] from_number,\n",
        "    // There is one on `from_number`.\n    input wire from_given,\n",
        "    // It is taken in this cycle.\n    output wire from_taken,\n",
        "    // The next one.\n    output wire [7:0] to_number,\n",
        "    output wire to_given,\n",
        "    input wire to_taken\n",
    ] {
        assert!(verilog.contains(line), "{line}: {verilog}");
    }
    let widths = Pass { bits: 8 }.widths();
    assert_eq!([widths.from.number, widths.from.taken, widths.to.number, widths.to.given], [8, 1, 8, 1]);
}

#[test]
fn a_bundle_that_is_not_there_has_no_ports() {
    let verilog = Hierarchy::of_kernel(kernel_of(&Pass { bits: 0 })).verilog("pass", None);
    assert!(!verilog.contains("from_") && !verilog.contains("to_"), "{verilog}");
}

#[test]
fn a_connection_carries_numbers_forth_and_ready_back() {
    for (second, added) in [(false, 1), (true, 2)] {
        let mut run = Run::new(&Hierarchy::of_kernel(kernel_of(&chain(8, second))), &[]);
        let slot = |run: &Run, name: &str| run.slot("", name);
        let mut taken = Vec::new();
        for cycle in 0..8u64 {
            let inputs =
                [("rst", u64::from(cycle == 0)), ("from_number", cycle), ("from_given", 1), ("to_taken", cycle / 5)];
            for (name, value) in inputs {
                let own = slot(&run, name);
                run.set(own, Word::from(value));
            }
            run.settle();
            let of = |name: &str| run.get(slot(&run, name)).number();
            assert_eq!(of("to_number"), cycle + added);
            if of("from_taken") == 1 {
                assert_eq!(of("to_given"), 1);
                taken.push(cycle);
            }
            run.clock();
        }
        // Not before the receiver takes them, from cycle 5 on, and in every second cycle.
        assert_eq!(taken, [6]);
    }
}

#[test]
fn who_is_not_connected_is_named() {
    let kernel = kernel_of(&Chain { connected: false, ..chain(8, true) });
    let names: Vec<String> = kernel.errors.iter().map(KernelError::to_string).collect();
    for name in ["second__from_number", "second__from_given", "first__to_taken"] {
        assert!(names.iter().any(|own| own.contains(name)), "{name}: {names:?}");
    }
}
