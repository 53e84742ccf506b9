//! Status LEDs.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Kernel, Type};

/// `alive` blinks about once a second; `busy` and `error` stay lit for a sixteenth to an eighth of that period after
/// their event.
#[derive(dermis_hdl_derive::Block)]
pub struct Lamps {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A packet is received or being answered.
    pub activity: Signal<In, Bit>,
    /// A packet was dropped in this cycle.
    pub dropped: Signal<In, Bit>,
    /// LED: blinks while the clock runs.
    pub alive: Signal<Out, Bit>,
    /// LED: lit by `activity`.
    pub busy: Signal<Out, Bit>,
    /// LED: lit by `dropped`.
    pub error: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(Lamps, clock clk, inputs [rst, activity, dropped], outputs [alive, busy, error]);

/// The tick of the LED time is shorter than the period of `alive` by this power of two.
const SHORTER: usize = 4;

impl Lamps {
    /// For a clock of `clock_hz` Hz.
    pub fn new(clock_hz: u32) -> Self {
        let block = Lamps {
            clk: Default::default(),
            rst: Default::default(),
            activity: Default::default(),
            dropped: Default::default(),
            alive: Default::default(),
            busy: Default::default(),
            error: Default::default(),
            kernel: Body::default(),
        };
        block.bind(kernel((clock_hz.ilog2() as usize).max(SHORTER + 2)))
    }
}

/// With a period of 2^`bits` cycles.
fn kernel(bits: usize) -> Kernel {
    let k = Builder::new("lamps");
    let (rst, activity, dropped) = (k.input("rst", 1), k.input("activity", 1), k.input("dropped", 1));
    let count = k.state("count", Type::unsigned(bits), rst, 0);
    count.set(count.plus(1));
    k.wire("alive", count.top());
    let tick = k.wire("tick", count.low(bits - SHORTER).all());
    for (name, event) in [("busy", activity), ("error", dropped)] {
        let left = k.state(&format!("{name}_left"), Type::unsigned(2), rst, 0);
        k.when(tick, || left.set(left.slice(1, 1)));
        k.when(event, || left.set(k.constant(2, 2)));
        k.wire(name, left.any());
    }
    k.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const BITS: usize = 7;

    /// Cycles since the reset; ticks for which each LED is still lit.
    #[derive(Default)]
    struct Lit {
        cycles: Option<u64>,
        lit: [u64; 2],
    }

    impl Reference for Lit {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let Some(cycles) = self.cycles else { return vec![None; 3] };
            let alive = cycles % (1 << BITS) >= 1 << (BITS - 1);
            [alive, self.lit[0] > 0, self.lit[1] > 0].map(|lit| Some(Word::from(lit))).to_vec()
        }

        fn clock(&mut self, inputs: &[Word]) {
            let tick = self.cycles.map_or(0, |cycles| u64::from((cycles + 1) % (1 << (BITS - SHORTER)) == 0));
            for (lit, event) in self.lit.iter_mut().zip(&inputs[1..]) {
                *lit = if event.number() == 1 { 2 } else { lit.saturating_sub(tick) };
            }
            self.cycles = self.cycles.map(|cycles| cycles + 1);
            if inputs[0].number() == 1 {
                *self = Lit { cycles: Some(0), ..Lit::default() };
            }
        }
    }

    #[test]
    fn each_led_is_lit_by_its_event() {
        let mut random = fastrand::Rng::with_seed(12);
        let cycle = |cycle: usize| {
            let bits = [cycle < 2 || random.u16(..500) == 0, random.u8(..30) == 0, random.u8(..60) == 0];
            bits.map(Word::from).to_vec()
        };
        let all: Vec<Vec<Word>> = (0..4000).map(cycle).collect();
        check(
            &Body::new(kernel(BITS), &[], &[("alive", 1), ("busy", 1), ("error", 1)]).kernel().clone(),
            &all,
            &mut Lit::default(),
        );
    }
}
