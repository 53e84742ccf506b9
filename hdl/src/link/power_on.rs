//! Reset after configuration and from a button.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Kernel, Type};

/// `rst` is high for seventeen cycles after configuration, and while the button is held. Relies on the register values
/// after configuration.
#[derive(dermis_hdl_derive::Block)]
pub struct PowerOn {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// The button, high when held; asynchronous to the clock.
    pub button: Signal<In, Bit>,
    /// Reset, active high, registered.
    pub rst: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(PowerOn, clock clk, inputs [button], outputs [rst]);

/// Last value of the count; reset ends three cycles later.
const LAST: u64 = 15;

impl Default for PowerOn {
    fn default() -> Self {
        let block = PowerOn {
            clk: Default::default(),
            button: Default::default(),
            rst: Default::default(),
            kernel: Body::default(),
        };
        block.bind(kernel())
    }
}

fn kernel() -> Kernel {
    let k = Builder::new("power_on");
    let button = k.input("button", 1);
    let register = |name, bits, value| k.register(name, Type::unsigned(bits)).initially(value);
    let (held, count, rst) = (register("held", 2, 0), register("count", 4, 0), register("rst", 1, 1));
    let counting = register("counting", 1, 1)
        .comment("Registered once more: `rst` has long routes, the count is placed near the button.");
    let counts = !count.is(LAST);
    counting.set(counts);
    rst.set(*counting);
    held.set(held.low(1).concat(button));
    k.when(counts, || count.set(count.plus(1)));
    k.when(held.at(1), || count.set(k.constant(4, 0)));
    k.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
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
        check(PowerOn::default().kernel.kernel(), &all, &mut Since::default());
    }
}
