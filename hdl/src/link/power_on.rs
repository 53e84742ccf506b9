//! Reset after configuration and from a button.

use crate::block;
use crate::language::{Block, Builder, Inside, Type};

block! {
    /// `rst` is high for seventeen cycles after configuration, and while the button is held. Relies on the register
    /// values after configuration.
    #[derive(Default)]
    pub struct PowerOn {}
    ports PowerOnPorts {
        clock;
        /// The button, high when held; asynchronous to the clock.
        in button;
        /// Reset, active high, registered.
        out rst;
    }
}

/// Last value of the count; reset ends three cycles later.
const LAST: u64 = 15;

impl Block for PowerOn {
    fn build<'k>(&self, k: &'k Builder, io: PowerOnPorts<Inside<'k>>) {
        let register = |name, bits, value| k.register(name, Type::unsigned(bits)).initially(value);
        let (held, count) = (register("held", 2, 0), register("count", 4, 0));
        let rst = io.rst.register().initially(1);
        let counting = register("counting", 1, 1)
            .comment("Registered once more: `rst` has long routes, the count is placed near the button.");
        let counts = !count.is(LAST);
        counting.set(counts);
        rst.set(*counting);
        held.set(held.low(1).concat(io.button));
        k.when(counts, || count.set(count.plus(1)));
        k.when(held.at(1), || count.set(k.constant(4, 0)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    /// Cycles since configuration, and since the button was last held.
    #[derive(Default)]
    struct Since {
        cycles: u64,
        released: Option<u64>,
    }

    impl Reference for Since {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            // The button takes two cycles more, and acts from the fifth on: it does not act on a reset that has ended.
            let held = self.released.is_some_and(|cycles| (5..LAST + 5).contains(&cycles));
            vec![Some(Word::from(self.cycles < LAST + 2 || held))]
        }

        fn clock(&mut self, inputs: &[Word]) {
            self.cycles += 1;
            self.released = match inputs[0].number() {
                1 => Some(1),
                _ => self.released.map(|cycles| cycles + 1),
            };
        }
    }

    #[test]
    fn reset_lasts_after_configuration_and_after_the_button() {
        // A pulse of the button every 40 cycles at least.
        let mut random = fastrand::Rng::with_seed(11);
        let pulse = |_| {
            let pause = random.usize(40..80);
            (0..pause).map(|cycle| vec![Word::from(cycle == 39)]).collect::<Vec<_>>()
        };
        let all: Vec<Vec<Word>> = (0..40).flat_map(pulse).collect();
        check(&kernel_of(&PowerOn::default()), &all, &mut Since::default());
    }
}
