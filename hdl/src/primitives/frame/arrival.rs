//! When the passes of a frame may begin, and when the frame is complete.
//!
//! A frame taken in several rows of subarrays may begin once the first row is in the buffer. Until its last taxel has come,
//! an early `tlast` can still drop it; so its first subarray waits for the rest before it is handed over, and of a dropped
//! frame nothing is.

use crate::block;
use crate::language::{Block, Builder, Inside, Type};

block! {
    /// Where a frame may begin with its first row of subarrays.
    #[derive(Default)]
    pub struct Arrival {}
    ports ArrivalPorts {
        clock;
        reset;
        /// The taxel that is accepted is the last of a row of subarrays.
        in row_end;
        /// An early `tlast` drops the frame that is received.
        in dropped;
        /// The frame buffer has been read.
        in free;
        /// The frame buffer holds a whole frame.
        in full;
        /// The passes of a frame begin.
        in begins;
        /// The passes of a subarray are complete, until it is handed over.
        in complete;
        /// A row of subarrays has arrived, enough to begin the passes; from two cycles after its last taxel.
        out ready;
        /// The frame in the passes is not complete: its first subarray must not be handed over.
        out waits;
        /// The frame in the passes is complete; high for one cycle.
        out arrives;
        /// The passes of a dropped frame have ended: nothing of it is handed over; high for one cycle.
        out discards;
    }
}

impl Block for Arrival {
    fn build<'k>(&self, k: &'k Builder, io: ArrivalPorts<Inside<'k>>) {
        let state = |name: &str| k.state(name, Type::unsigned(1), io.rst, 0);
        k.comment("The last codes of the row are in the buffer one cycle after they are accepted.");
        let (row, ready) = (state("row"), io.ready.state(io.rst, 0));
        row.set((io.row_end | *row) & !io.free & !io.dropped);
        ready.set(*row & !io.free & !io.dropped);
        k.comment("A frame begins one cycle after `ready` is read; a drop in that cycle is of this frame too.");
        let (waits, lost, dropped_before) = (io.waits.state(io.rst, 0), state("lost"), state("dropped_before"));
        dropped_before.set(io.dropped);
        let arrives = io.arrives.set(*waits & io.full & !*lost);
        let discards = io.discards.set(io.complete & *lost);
        let waiting = k.wire("waiting", (io.begins | *waits) & !arrives & !discards);
        waits.set(waiting);
        lost.set(waiting & (*lost | *dropped_before));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    /// The frame that is received and the one in the passes, as a sequence of events; undefined before the first reset.
    #[derive(Default)]
    struct Frames {
        /// Whether there was a reset.
        begun: bool,
        /// Cycles since the first row of the received frame came.
        row: Option<u32>,
        /// Whether a frame was dropped in the cycle before.
        dropped: bool,
        /// The frame in the passes that is not complete: whether it was dropped.
        passing: Option<bool>,
    }

    impl Reference for Frames {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let [full, complete] = [4, 6].map(|k| inputs[k].number() == 1);
            let outputs = [
                self.row.is_some_and(|cycles| cycles >= 2),
                self.passing.is_some(),
                self.passing == Some(false) && full,
                self.passing == Some(true) && complete,
            ];
            outputs.map(|bit| self.begun.then(|| bit.into())).into()
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, row_end, dropped, free, full, begins, complete] =
                [0, 1, 2, 3, 4, 5, 6].map(|k| inputs[k].number() == 1);
            self.row = self.row.map(|cycles| cycles + 1).or(row_end.then_some(1)).filter(|_| !free && !dropped);
            let ends = self.passing.is_some_and(|lost| if lost { complete } else { full });
            // The one in the passes, or the one that begins now.
            let passing = self.passing.or(begins.then_some(false)).filter(|_| !ends);
            self.passing = passing.map(|lost| lost || self.dropped);
            self.dropped = dropped;
            if rst {
                *self = Frames { begun: true, ..Frames::default() };
            }
        }
    }

    #[test]
    fn a_frame_begins_with_its_first_row_and_a_dropped_one_is_discarded() {
        let mut random = fastrand::Rng::with_seed(3);
        let cycle = |cycle: usize| {
            let mut inputs = [200, 8, 12, 12, 5, 6, 3].map(|one_in| random.u8(..one_in) == 0);
            inputs[0] |= cycle == 0;
            inputs.map(Word::from).to_vec()
        };
        let stimulus: Vec<Vec<Word>> = (0..5000).map(cycle).collect();
        check(&kernel_of(&Arrival {}), &stimulus, &mut Frames::default());
    }
}
