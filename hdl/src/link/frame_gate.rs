//! Frame gate: of the frames of a scan, those that are asked for.

use crate::block;
use crate::language::{Block, Builder, Inside, Type};
use crate::primitives::Stream;

block! {
    /// A scan gives a frame every period, and a host asks when it likes, over a link that is slower. A frame whose
    /// first beat comes while a request waits passes; the others are dropped, so that the engine never waits for the
    /// link.
    ///
    /// While a frame passes, `busy` is high and no scan should begin: its codes would wait for the link, with the
    /// array's rows driven meanwhile, and be old when they are sent.
    #[derive(Default)]
    pub struct FrameGate {}
    ports FrameGatePorts {
        clock;
        reset;
        /// A request waits.
        in requested;
        /// A beat of the engine, three words; valid with `s_axis_tvalid`.
        sink<Stream> s_axis: BEAT;
        /// A beat that passes; valid with `m_axis_tvalid`.
        source<Stream> m_axis: BEAT;
        /// A frame passes.
        out busy;
    }
}

/// Width of a beat.
const BEAT: usize = 96;

impl Block for FrameGate {
    fn build<'k>(&self, k: &'k Builder, io: FrameGatePorts<Inside<'k>>) {
        let passing = k.state("passing", Type::unsigned(1), io.rst, 0);
        let passing = passing.comment("Also where the request is answered before the first beat is taken.");
        let dropping = k.state("dropping", Type::unsigned(1), io.rst, 0);
        let passes = k.wire("passes", *passing | (io.requested & !*dropping));
        let accepted = io.s_axis.ready.set(io.m_axis.ready | !passes);
        let ends = k.wire("ends", accepted & io.s_axis.last);
        io.m_axis.valid.set(io.s_axis.valid & passes);
        io.m_axis.data.set(io.s_axis.data);
        io.m_axis.last.set(io.s_axis.last);
        io.busy.set(*passing);
        k.when(io.s_axis.valid, || {
            passing.set(passes & !ends);
            dropping.set(!passes & !ends);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check_with_defects, subject_of, Reference};
    use crate::language::Change;
    use crate::wire::Word;

    /// What becomes of the frame under way.
    #[derive(Default)]
    struct Gate {
        passes: Option<bool>,
        reset: bool,
    }

    impl Gate {
        fn passes(&self, inputs: &[Word]) -> bool {
            self.passes.unwrap_or(inputs[1].number() == 1)
        }
    }

    impl Reference for Gate {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            if !self.reset {
                return vec![None; 5];
            }
            let is = |k: usize| inputs[k].number() == 1;
            let offered = is(3) && self.passes(inputs);
            let bit = |bit: bool| Some(Word::from(bit));
            vec![
                bit(is(5) || !self.passes(inputs)),
                offered.then_some(inputs[2]),
                bit(offered),
                offered.then(|| Word::from(is(4))),
                bit(self.passes == Some(true)),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let is = |k: usize| inputs[k].number() == 1;
            let passes = self.passes(inputs);
            if is(3) {
                let ends = is(4) && (is(5) || !passes);
                self.passes = (!ends).then_some(passes);
            }
            if is(0) {
                *self = Gate { reset: true, passes: None };
            }
        }
    }

    /// Frames of random length; requests that go while their frame's first beat waits.
    fn stimulus(cycles: usize) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(9);
        let mut gate = Gate::default();
        let mut beat: Option<[Word; 2]> = None;
        let mut requested = false;
        let of = |cycle: usize| {
            requested = if requested { random.u8(..6) > 0 } else { random.u8(..12) == 0 };
            if beat.is_none() && random.u8(..3) > 0 {
                let mut data = Word::default();
                data.set(0, 64, random.u64(..));
                data.set(64, 32, random.u32(..).into());
                beat = Some([data, Word::from(random.u8(..6) == 0)]);
            }
            let [data, last] = beat.unwrap_or_default();
            let ready = random.u8(..3) > 0;
            let [rst, requested, given] = [cycle < 2, requested, beat.is_some()].map(Word::from);
            let inputs = vec![rst, requested, data, given, last, Word::from(ready)];
            if ready || !gate.passes(&inputs) {
                beat = None;
            }
            gate.clock(&inputs);
            inputs
        };
        (0..cycles).map(of).collect()
    }

    #[test]
    fn frames_pass_whole_or_not_at_all() {
        let subject = |changes: &[Change]| {
            subject_of!(
                FrameGate::default(),
                changes,
                inputs [rst, requested, s_axis_tdata, s_axis_tvalid, s_axis_tlast, m_axis_tready],
                outputs [s_axis_tready, m_axis_tdata, m_axis_tvalid, m_axis_tlast, busy],
            )
        };
        let defects = [
            // The rest of a frame of which the beginning is lost.
            Change::value("", "dropping", |k| k.constant(1, 0)),
            // Cut off when its request is answered.
            Change::value("", "passing", |k| k.constant(1, 0)),
        ];
        check_with_defects(subject, &stimulus(4000), Gate::default, &defects);
    }
}
