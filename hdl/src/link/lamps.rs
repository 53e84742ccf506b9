//! Status LEDs.

use crate::block;
use crate::language::{Block, Builder, Inside, Type};

block! {
    /// `alive` blinks about once a second; `busy` and `error` stay lit for a sixteenth to an eighth of that period
    /// after their event.
    pub struct Lamps {
        /// `alive` has a period of 2^`bits` cycles.
        bits: usize,
    }
    ports LampsPorts {
        clock;
        reset;
        /// A packet is received or being answered.
        in activity;
        /// A packet was dropped in this cycle.
        in dropped;
        /// LED: blinks while the clock runs.
        out alive;
        /// LED: lit by `activity`.
        out busy;
        /// LED: lit by `dropped`.
        out error;
    }
}

/// The tick of the LED time is shorter than the period of `alive` by this power of two.
const SHORTER: usize = 4;

impl Lamps {
    /// For a clock of `clock_hz` Hz.
    pub fn new(clock_hz: u32) -> Self {
        Lamps { bits: (clock_hz.ilog2() as usize).max(SHORTER + 2) }
    }
}

impl Block for Lamps {
    fn build<'k>(&self, k: &'k Builder, io: LampsPorts<Inside<'k>>) {
        let count = k.state("count", Type::unsigned(self.bits), io.rst, 0);
        count.set(count.plus(1));
        io.alive.set(count.top());
        let tick = k.wire("tick", count.low(self.bits - SHORTER).all());
        for (name, led, event) in [("busy", io.busy, io.activity), ("error", io.error, io.dropped)] {
            let left = k.state(&format!("{name}_left"), Type::unsigned(2), io.rst, 0);
            k.when(tick, || left.set(left.slice(1, 1)));
            k.when(event, || left.set(k.constant(2, 2)));
            led.set(left.any());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
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
        check(&kernel_of(&Lamps { bits: BITS }), &all, &mut Lit::default());
    }
}
