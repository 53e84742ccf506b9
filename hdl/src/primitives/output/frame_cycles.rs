//! Cycle counts of the frame whose passes run and of the frame that is searched and sent.

use crate::block;
use crate::language::{Block, Builder, Inside, Type};

block! {
    /// Counts from `begin_frame`; at `hand_over`, when the frame's first subarray leaves the passes, the count moves to
    /// `cycles` and goes on there, so that the next frame can begin. Cycles in which a frame waits for the one before
    /// it are not counted.
    ///
    /// All inputs take effect `COUNT_DELAY` cycles later: the first beat of the frame before has been sent by then. The
    /// counts are modulo 2^[`CYCLE_BITS`].
    #[derive(Default)]
    pub struct FrameCycles {}
    ports FrameCyclesPorts {
        clock;
        /// Synchronous reset, active high; clears what is on its way.
        in rst;
        /// A frame begins.
        in begin_frame;
        /// The frame in the passes waits for the one before.
        in waits;
        /// The first subarray of the frame goes to the search.
        in hand_over;
        /// The frame that is searched waits for the one before.
        in stalled;
        /// Cycles of the frame that is searched and sent, without the constant number that the force unit adds,
        /// unsigned; from `COUNT_DELAY` cycles after `hand_over` until that of the next frame.
        out cycles: CYCLE_BITS;
    }
}

/// Width of the cycle counts, in bits.
pub const CYCLE_BITS: usize = 24;
/// Cycles from an event to its effect on the counts.
pub const COUNT_DELAY: usize = 12;

impl Block for FrameCycles {
    fn build<'k>(&self, k: &'k Builder, io: FrameCyclesPorts<Inside<'k>>) {
        let later = |name: &str, event| {
            (1..COUNT_DELAY).fold(event, |value, number| {
                let register = k.state(&format!("{name}_{number}"), Type::unsigned(1), io.rst, 0);
                register.set(value);
                *register
            })
        };
        let (begin_frame, waits) = (later("begin_frame", io.begin_frame), later("waits", io.waits));
        let (hand_over, stalled) = (later("hand_over", io.hand_over), later("stalled", io.stalled));
        let passing = k.state("passing", Type::unsigned(CYCLE_BITS), begin_frame, 0);
        let next = k.wire("next", waits.mux(*passing, passing.plus(1)));
        passing.set(next);
        let cycles = io.cycles.register();
        k.when(!stalled, || cycles.set(cycles.plus(1)));
        k.when(hand_over, || cycles.set(next));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    /// Counts with the inputs on their way; undefined before the first frame.
    struct Counts {
        pipe: Vec<[bool; 4]>,
        passing: Option<u64>,
        cycles: Option<u64>,
    }

    impl Reference for Counts {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            vec![self.cycles.map(Word::from)]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, now @ ..] = [0, 1, 2, 3, 4].map(|k| inputs[k].number() == 1);
            self.pipe.push(now);
            let [begin_frame, waits, hand_over, stalled] = self.pipe.remove(0);
            let next = self.passing.map(|count| count + u64::from(!waits));
            self.cycles = if hand_over { next } else { self.cycles.map(|count| count + u64::from(!stalled)) };
            self.passing = if begin_frame { Some(0) } else { next };
            if rst {
                self.pipe.iter_mut().for_each(|events| *events = [false; 4]);
            }
        }
    }

    #[test]
    fn a_frame_is_counted_while_the_next_begins() {
        let mut random = fastrand::Rng::with_seed(5);
        let mut bit = |of: u8| Word::from(random.u8(..of) == 0);
        let inputs = |cycle: usize| vec![Word::from(cycle < 3), bit(40), bit(4), bit(40), bit(4)];
        let mut stimulus: Vec<Vec<Word>> = (0..3000).map(inputs).collect();
        stimulus[1500][0] = true.into();
        let pipe = vec![[false; 4]; COUNT_DELAY - 1];
        check(&kernel_of(&FrameCycles {}), &stimulus, &mut Counts { pipe, passing: None, cycles: None });
    }
}
