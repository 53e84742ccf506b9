//! The kernel of an adaptive mean against the bit-true model, with stalls, resets and framing errors, cycle for cycle.

use std::collections::VecDeque;

use dermis_golden::fixed::stages::prepare::{Prepare, Prepared};
use dermis_golden::fixed::stages::send::FRAMES;
use dermis_golden::spec::sliding::most_frames;

use super::*;
use crate::language::testbench::{check_with_defects, subject_of, Reference, Subject};
use crate::language::Change;
use crate::scenes::model;
use crate::wire::Word;

/// The bit-true model, and where the words are.
struct Adaptive {
    prepare: Prepare,
    bits: usize,
    prepared: Prepared,
    codes: Vec<i32>,
    full: bool,
    last: bool,
    /// Cycles until the words of the window are sent.
    wait: u32,
    /// Words to send, those in the block, the one that is offered: each with whether it is the last one.
    words: VecDeque<(i64, bool)>,
    inside: [Option<(i64, bool)>; 2],
    offered: Option<(i64, bool)>,
    marks: u64,
    reset: bool,
}

impl Adaptive {
    fn new(prepare: &Prepare, bits: usize) -> Self {
        Adaptive {
            prepare: prepare.clone(),
            bits,
            prepared: prepare.empty(),
            codes: Vec::new(),
            full: false,
            last: false,
            wait: 0,
            words: VecDeque::new(),
            inside: [None; 2],
            offered: None,
            marks: 0,
            reset: false,
        }
    }

    fn mean(&self) -> &AdaptiveMean {
        self.prepare.adaptive.as_ref().unwrap()
    }

    fn take(&mut self, code: i32, tlast: bool) {
        self.codes.push(code);
        self.last = tlast;
        let taxels = self.mean().live.len();
        if self.codes.len() == taxels {
            self.prepare.add(&mut self.prepared, &std::mem::take(&mut self.codes), false);
            self.words = self.prepared.words.iter().map(|word| (i64::from(*word), false)).collect();
            self.words.back_mut().unwrap().1 = true;
            (self.full, self.wait) = (true, self.mean().judging_cycles());
            let frames = self.prepared.frames.min(most_frames(self.mean().longest()));
            self.marks = (self.prepared.adaptive.window << FRAMES.bits | frames) as u64;
        } else if tlast {
            self.prepare.cut(&mut self.prepared, &std::mem::take(&mut self.codes));
            // The word of a spoiled beat means nothing.
            self.words = [(i64::MAX, true)].into();
            (self.full, self.wait) = (true, 1);
        }
    }
}

impl Reference for Adaptive {
    fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
        let rst = inputs[0].number() == 1;
        let wide = self.bits + self.prepare.average as usize;
        let beat = self.offered.filter(|(word, _)| *word != i64::MAX);
        vec![
            self.reset.then(|| Word::from(!self.full && !rst)),
            self.reset.then(|| Word::from(self.offered.is_some())),
            self.offered.map(|(_, end)| Word::from(end && self.last)),
            beat.map(|(word, _)| Word::of_fields(&[word], wide)),
            beat.map(|_| Word::from(self.marks)),
        ]
    }

    fn clock(&mut self, inputs: &[Word]) {
        let [rst, valid, tlast, ready] = [0, 2, 3, 4].map(|k| inputs[k].number() == 1);
        self.wait = self.wait.saturating_sub(1);
        let takes = valid && !self.full && !rst;
        if self.offered.is_none() || ready {
            self.full &= !self.offered.is_some_and(|(_, end)| end);
            self.offered = self.inside[1];
            let next = if self.wait == 0 { self.words.pop_front() } else { None };
            self.inside = [next, self.inside[0]];
        }
        if takes {
            self.take(inputs[1].signed(0, self.bits) as i32, tlast);
        }
        if rst {
            *self = Adaptive { reset: true, ..Adaptive::new(&self.prepare, self.bits) };
        }
    }
}

fn subject(prepare: &Prepare, bits: usize, changes: &[Change]) -> Subject<'static> {
    let taxels = prepare.adaptive.as_ref().unwrap().live.len();
    let marks = FrameMarks { frames_bits: MARK_BITS, limited: false };
    subject_of!(
        Average::new([taxels, bits], prepare, marks, false, Arrays::default()).unwrap(),
        changes,
        inputs [rst, s_axis_tdata, s_axis_tvalid, s_axis_tlast, m_axis_tready],
        outputs [s_axis_tready, m_axis_tvalid, m_axis_tlast, m_axis_tdata, frames],
    )
}

/// Readings that rest, jump, rise evenly and reach the rails, so that most windows are taken.
#[test]
fn every_frame_gives_the_window_of_the_bit_true_model() {
    for (average, dead, windows) in [(3, "", 2), (4, "dead = [[1, 2]]\n", 3), (6, "", 6)] {
        let text = format!(
            "[input]\nmean = \"adaptive\"\ntemplate = false\naverage = {average}\n{dead}full_scale_MPa = 1.0\n"
        );
        let model = model(2, 3, &text);
        let (prepare, bits) = (&model.prepare, model.formats().code_bits as usize);
        let mut random = fastrand::Rng::with_seed(31);
        let mut reference = Adaptive::new(prepare, bits);
        let (mut levels, mut slopes) = ([0i32; 6], [0i32; 6]);
        let (mut noise, mut taken) = (3, std::collections::BTreeSet::new());
        let most = (1 << (bits - 1)) - 1;
        let stimulus: Vec<Vec<Word>> = (0..100_000 * average / 2)
            .map(|cycle| {
                let rst = cycle < 3 || random.u32(..80_000) == 0;
                let taxel = reference.codes.len();
                let tlast = if random.u16(..6000) == 0 { random.bool() } else { taxel + 1 == 6 };
                let code = (levels[taxel] + random.i32(-noise..=noise)).clamp(-most - 1, most);
                let [offered, ready] = [(); 2].map(|()| Word::from(random.u8(..8) > 0));
                let inputs = vec![rst.into(), Word::of_fields(&[code.into()], bits), offered, tlast.into(), ready];
                let before = reference.prepared.frames;
                reference.clock(&inputs);
                if reference.prepared.frames > before {
                    taken.insert(reference.prepared.adaptive.window);
                    for (level, slope) in levels.iter_mut().zip(slopes) {
                        *level = (*level + slope).clamp(-most, most);
                    }
                    if random.u8(..150) == 0 {
                        levels = [(); 6].map(|()| random.i32(-most / 2..most / 2));
                        let steepest = [0, 2, 16][random.usize(..3)];
                        slopes = [(); 6].map(|()| random.i32(-steepest..=steepest));
                        noise = [0, 3, 40, 200, 2 * most][random.usize(..5)];
                    }
                }
                inputs
            })
            .collect();
        assert!(taken.len() >= windows, "{average}: {taken:?}");
        let defects = [
            // The level is that of the third frame; it only rises; every window agrees.
            Change::value("", "restarts", |k| k.named("whole").is(3)),
            Change::value("", "above", |k| k.constant(1, 1)),
            Change::value("", "agrees", |k| k.constant(1, 1)),
        ];
        let defects = if average == 6 { &defects[..] } else { &[] };
        check_with_defects(
            |changes| subject(prepare, bits, changes),
            &stimulus,
            || Adaptive::new(prepare, bits),
            defects,
        );
    }
}
