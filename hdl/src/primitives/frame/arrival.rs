//! When the passes of a frame may begin, and when the frame is complete.
//!
//! A frame taken in several rows of subarrays may begin once the first row is in the buffer. Until its last taxel has come,
//! an early `tlast` can still drop it; so its first subarray waits for the rest before it is handed over, and of a dropped
//! frame nothing is.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Kernel, Type};

/// Where frames begin whole, all outputs follow from `full` and `begins`, and there is no register.
#[derive(dermis_hdl_derive::Block)]
pub struct Arrival {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// The taxel that is accepted is the last of a row of subarrays.
    pub row_end: Signal<In, Bit>,
    /// An early `tlast` drops the frame that is received.
    pub dropped: Signal<In, Bit>,
    /// The frame buffer has been read.
    pub free: Signal<In, Bit>,
    /// The frame buffer holds a whole frame.
    pub full: Signal<In, Bit>,
    /// The passes of a frame begin.
    pub begins: Signal<In, Bit>,
    /// The passes of a subarray are complete, until it is handed over.
    pub complete: Signal<In, Bit>,
    /// What has arrived is enough to begin the passes; where a row of subarrays is, from two cycles after its last taxel.
    pub ready: Signal<Out, Bit>,
    /// The frame in the passes is not complete: its first subarray must not be handed over.
    pub waits: Signal<Out, Bit>,
    /// The frame in the passes is complete; high for one cycle.
    pub arrives: Signal<Out, Bit>,
    /// The passes of a dropped frame have ended: nothing of it is handed over; high for one cycle.
    pub discards: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(
    Arrival,
    clock clk,
    inputs [rst, row_end, dropped, free, full, begins, complete],
    outputs [ready, waits, arrives, discards]
);

impl Arrival {
    /// `early`: a frame may begin with its first row of subarrays.
    pub fn new(early: bool) -> Self {
        let block = Arrival {
            clk: Default::default(),
            rst: Default::default(),
            row_end: Default::default(),
            dropped: Default::default(),
            free: Default::default(),
            full: Default::default(),
            begins: Default::default(),
            complete: Default::default(),
            ready: Default::default(),
            waits: Default::default(),
            arrives: Default::default(),
            discards: Default::default(),
            kernel: Body::default(),
        };
        block.bind(kernel(early))
    }
}

fn kernel(early: bool) -> Kernel {
    let k = Builder::new("arrival");
    let [rst, row_end, dropped, free, full, begins, complete] =
        ["rst", "row_end", "dropped", "free", "full", "begins", "complete"].map(|name| k.input(name, 1));
    if !early {
        let none = k.constant(1, 0);
        for (name, value) in [("ready", full), ("waits", none), ("arrives", begins), ("discards", none)] {
            k.wire(name, value);
        }
        return k.finish();
    }
    let state = |name: &str| k.state(name, Type::unsigned(1), rst, 0);
    k.comment("The last codes of the row are in the buffer one cycle after they are accepted.");
    let (row, ready) = (state("row"), state("ready"));
    row.set((row_end | *row) & !free & !dropped);
    ready.set(*row & !free & !dropped);
    k.comment("A frame begins one cycle after `ready` is read; a drop in that cycle is of this frame too.");
    let (waits, lost, dropped_before) = (state("waits"), state("lost"), state("dropped_before"));
    dropped_before.set(dropped);
    let arrives = k.wire("arrives", *waits & full & !*lost);
    let discards = k.wire("discards", complete & *lost);
    let waiting = k.wire("waiting", (begins | *waits) & !arrives & !discards);
    waits.set(waiting);
    lost.set(waiting & (*lost | *dropped_before));
    k.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, random_words, Pipeline, Reference};
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
        check(Arrival::new(true).kernel.kernel(), &stimulus, &mut Frames::default());
        // Whole frames: no state.
        let whole = |inputs: &[Word]| vec![Some(inputs[4]), Some(0.into()), Some(inputs[5]), Some(0.into())];
        let stimulus = random_words(200, &[1; 7]);
        check(Arrival::new(false).kernel.kernel(), &stimulus, &mut Pipeline::new(0, 4, whole));
    }
}
