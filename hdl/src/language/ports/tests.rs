//! Declared ports from both sides, and what is wrong with a block that does not keep to them.

use super::*;
use crate::block;
use crate::language::{Hierarchy, KernelError, Run};
use crate::wire::Word;

/// What a counter does with its ports.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    Right,
    /// Its output is not driven.
    Forgotten,
    /// Its output is driven twice.
    Twice,
    /// Its output is wider than declared.
    Wide,
}

block! {
    /// Counts from 0 on.
    struct Count {
        bits: usize,
        /// Whether it counts by a number that comes from outside.
        stepped: bool,
        way: Way,
    }
    ports CountPorts {
        clock;
        reset;
        /// The number by which it counts.
        in step: if *stepped { *bits } else { 0 };
        /// The count, unsigned; valid from the first reset on.
        out count: bits;
        /// What was counted, of a counter by a number; valid as `count`.
        out counted: if *stepped { *bits } else { 0 };
    }
}

impl Block for Count {
    fn build<'k>(&self, k: &'k Builder, io: CountPorts<Inside<'k>>) {
        let step = if self.stepped { io.step } else { k.constant(1, 1) };
        io.counted.set(step);
        match self.way {
            Way::Forgotten => {}
            Way::Wide => {
                k.register("count", Type::unsigned(self.bits + 1)).set(k.constant(1, 0));
            }
            Way::Right | Way::Twice => {
                let count = io.count.state(io.rst, 0);
                count.set((*count + step).low(self.bits));
                if self.way == Way::Twice {
                    io.count.set(step.extend(self.bits));
                }
            }
        }
    }
}

block! {
    /// Two counters, one by the count of the other.
    struct Both {
        /// The count of the first is said to be read.
        reads: bool,
    }
    ports BothPorts {
        clock;
        reset;
        /// Resets the second counter.
        in again;
        /// The count of the second.
        out count: 6;
    }
}

impl Block for Both {
    fn build<'k>(&self, k: &'k Builder, io: BothPorts<Inside<'k>>) {
        let first = k.instance("first", Count { bits: 6, stepped: false, way: Way::Right });
        let second = k.instance("second", Count { bits: 6, stepped: true, way: Way::Right });
        second.step.set(first.count);
        second.rst.set(io.again | io.rst);
        io.count.set(second.count);
        if self.reads {
            k.unused([second.counted]);
        }
    }
}

fn error(kernel: &Kernel) -> String {
    kernel.errors().first().map(ToString::to_string).unwrap_or_default()
}

#[test]
fn a_port_of_width_0_is_left_out() {
    let ports = |stepped| {
        let kernel = kernel_of(&Count { bits: 3, stepped, way: Way::Right });
        assert!(kernel.errors().is_empty(), "{:?}", kernel.errors());
        kernel.port_list().map(|(name, _, bits, _)| (name.to_owned(), bits)).collect::<Vec<_>>()
    };
    let of = |ports: &[(&str, usize)]| ports.iter().map(|&(name, bits)| (name.to_owned(), bits)).collect::<Vec<_>>();
    assert_eq!(ports(false), of(&[("clk", 1), ("rst", 1), ("count", 3)]));
    assert_eq!(ports(true), of(&[("clk", 1), ("rst", 1), ("step", 3), ("count", 3), ("counted", 3)]));
    assert_eq!(Count { bits: 3, stepped: true, way: Way::Right }.widths().counted, 3);
}

#[test]
fn an_output_is_driven_once_with_its_width() {
    let of = |way| error(&kernel_of(&Count { bits: 3, stepped: false, way }));
    assert_eq!(of(Way::Right), "");
    assert_eq!(of(Way::Forgotten), "block Count, port count of 3 bits: the kernel has no such signal");
    assert_eq!(of(Way::Twice), "block Count, signal count: the name is used twice");
    assert_eq!(of(Way::Wide), "block Count, port count of 3 bits: the kernel's signal has 4 bits");
}

#[test]
fn an_output_that_nothing_reads_is_said_to_be_unused_or_an_error() {
    assert_eq!(error(&kernel_of(&Both { reads: true })), "");
    let kernel = kernel_of(&Both { reads: false });
    assert!(matches!(kernel.errors(), [KernelError::Unread { .. }]), "{:?}", kernel.errors());
    assert_eq!(error(&kernel), "block Both: nothing reads second__counted; say `unused` if that is on purpose");
}

#[test]
fn instances_have_clock_and_reset_of_the_block_around_them_unless_another_is_assigned() {
    let hierarchy = Hierarchy::of_kernel(kernel_of(&Both { reads: true }));
    hierarchy.check().unwrap();
    let mut run = Run::new(&hierarchy, &[("first", "count"), ("", "second__step")]);
    let [rst, again, count] = ["rst", "again", "count"].map(|name| run.slot("", name));
    let first = run.slot("first", "count");
    let mut cycle = |reset: bool, repeat: bool| {
        run.set(rst, reset.into());
        run.set(again, repeat.into());
        run.settle();
        let counts = [first, run.slot("", "second__step"), count].map(|slot| run.get(slot).number());
        run.clock();
        counts
    };
    cycle(true, false);
    assert_eq!([cycle(false, false), cycle(false, false), cycle(false, false)], [[0, 0, 0], [1, 1, 0], [2, 2, 1]]);
    assert_eq!([cycle(false, true), cycle(false, false), cycle(false, false)], [[3, 3, 3], [4, 4, 0], [5, 5, 4]]);
    assert_eq!(run.slot("third", "count").bits(), 0);
    run.set(run.slot("", "nothing"), Word::from(7));
    assert_eq!(run.get(run.slot("", "nothing")), Word::default());
}
