//! Sums and sliding mean against sums and means in plain integers, with stalls, resets and framing errors.

use super::*;
use crate::language::kernel_of;
use crate::language::testbench::{check, random_word, Reference};
use crate::wire::Word;

const TAXELS: usize = 5;
const BITS: usize = 9;
/// Of the sums.
const POWER: u32 = 2;

/// Sums, the taxel and frame of the next word, the beats in the block.
#[derive(Default)]
pub(crate) struct Sums {
    bits: usize,
    power: u32,
    sums: Vec<i64>,
    /// The taxel of the next word.
    pub(crate) taxel: usize,
    frame: usize,
    missed: bool,
    held: Option<(i64, bool, bool)>,
    offered: Option<(i64, bool)>,
    reset: bool,
}

impl Sums {
    /// Of 2^`power` frames of `taxels` words of `bits` bits.
    pub(crate) fn new(taxels: usize, bits: usize, power: u32) -> Self {
        Sums { bits, power, sums: vec![0; taxels], ..Sums::default() }
    }

    /// Adds a word: its sum, whether it leaves, and whether it is the last.
    fn add(&mut self, word: i64, tlast: bool) -> (i64, bool, bool) {
        let (at_end, final_frame) = (self.taxel + 1 == self.sums.len(), self.frame + 1 == 1 << self.power);
        let early = tlast && !at_end;
        let sum = word + if self.frame == 0 { 0 } else { self.sums[self.taxel] };
        self.sums[self.taxel] = sum;
        let beat = (sum, final_frame || early, tlast && (early || !self.missed));
        self.taxel = if early || at_end { 0 } else { self.taxel + 1 };
        if early {
            (self.frame, self.missed) = (0, false);
        } else if at_end {
            self.missed = !final_frame && (self.missed || !tlast);
            self.frame = (self.frame + 1) % (1 << self.power);
        }
        beat
    }
}

impl Reference for Sums {
    fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
        let [rst, ready] = [0, 4].map(|k| inputs[k].number() == 1);
        let moves = self.offered.is_none() || ready;
        vec![
            self.reset.then(|| Word::from(self.offered.is_some())),
            self.offered.map(|(sum, _)| Word::of_fields(&[sum], self.bits + self.power as usize)),
            self.offered.map(|(_, last)| Word::from(last)),
            self.reset.then(|| Word::from(moves && !rst)),
            Some(Word::from(0)),
        ]
    }

    fn clock(&mut self, inputs: &[Word]) {
        let [rst, valid, tlast, ready] = [0, 2, 3, 4].map(|k| inputs[k].number() == 1);
        if self.offered.is_none() || ready {
            self.offered = self.held.take().and_then(|(sum, leaves, last)| leaves.then_some((sum, last)));
            if valid && !rst {
                self.held = Some(self.add(inputs[1].signed(0, self.bits), tlast));
            }
        }
        if rst {
            let sums = std::mem::take(&mut self.sums);
            *self = Sums { bits: self.bits, power: self.power, sums, reset: true, ..Sums::default() };
        }
    }
}

/// A stage that averages so.
fn prepare(average: u32, mean: MeanKind) -> Prepare {
    let mut prepare = Prepare::default();
    (prepare.average, prepare.mean) = (average, mean);
    prepare
}

#[test]
fn frames_are_added_up_and_framing_errors_restart_the_sum() {
    let mut random = fastrand::Rng::with_seed(5);
    let mut sums = Sums::new(TAXELS, BITS, POWER);
    let stimulus: Vec<Vec<Word>> = (0..6000)
        .map(|cycle| {
            let rst = cycle < 3 || random.u16(..400) == 0;
            // Mostly frames of the right length.
            let tlast = if random.u8(..40) == 0 { random.bool() } else { sums.taxel + 1 == TAXELS };
            let word = random_word(&mut random, BITS);
            let [offered, ready] = [(); 2].map(|()| Word::from(random.u8(..8) > 0));
            let inputs = vec![rst.into(), word, offered, tlast.into(), ready];
            sums.clock(&inputs);
            inputs
        })
        .collect();
    let prepare = prepare(POWER, MeanKind::Block);
    let average = Average::new([TAXELS, BITS], &prepare, FrameMarks::default(), false, Arrays::default()).unwrap();
    check(&kernel_of(&average), &stimulus, &mut Sums::new(TAXELS, BITS, POWER));
}

/// A word on its way through the block: mean, `tlast`, number of frames.
type Beat = (i64, bool, u64);

/// Means, the taxel and number of the next word's frame, the beats in the block, the first to leave last.
struct Means {
    power: u32,
    means: [i64; TAXELS],
    taxel: usize,
    frames: u64,
    inside: [Option<Beat>; 3],
    reset: bool,
}

impl Means {
    fn new(power: u32) -> Self {
        Means { power, means: [0; TAXELS], taxel: 0, frames: 0, inside: [None; 3], reset: false }
    }

    fn add(&mut self, word: i64, tlast: bool) -> Beat {
        let number = self.frames + 1;
        // The power of two nearest to the number, of two the larger.
        let far = |shift: &u32| (1i64 << shift).abs_diff(number as i64);
        let shift = (0..=self.power).rev().min_by_key(far).unwrap();
        let mean = self.means[self.taxel];
        let twice = 2 * ((word << self.power) - mean - (number as i64 - 1) % 2);
        let mean = if number == 1 { word << self.power } else { mean + ((twice >> shift) + 1).div_euclid(2) };
        self.means[self.taxel] = mean;
        let whole = self.taxel + 1 == TAXELS;
        self.taxel = if whole || tlast { 0 } else { self.taxel + 1 };
        let most = (2 << self.power) - 1;
        if whole {
            self.frames += 1;
        } else if tlast {
            self.frames = 0;
        }
        (mean, tlast, number.min(most))
    }

    fn moves(&self, ready: bool) -> bool {
        self.inside[2].is_none() || ready
    }
}

impl Reference for Means {
    fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
        let [rst, ready] = [0, 4].map(|k| inputs[k].number() == 1);
        let beat = self.inside[2];
        vec![
            self.reset.then(|| Word::from(beat.is_some())),
            beat.map(|(_, last, _)| Word::from(last)),
            beat.map(|(.., frames)| Word::from(frames)),
            beat.map(|(mean, ..)| Word::of_fields(&[mean], BITS + self.power as usize)),
            self.reset.then(|| Word::from(self.moves(ready) && !rst)),
        ]
    }

    fn clock(&mut self, inputs: &[Word]) {
        let [rst, valid, tlast, ready] = [0, 2, 3, 4].map(|k| inputs[k].number() == 1);
        if self.moves(ready) {
            let taken = (valid && !rst).then(|| self.add(inputs[1].signed(0, BITS), tlast));
            self.inside = [taken, self.inside[0], self.inside[1]];
        }
        if rst {
            *self = Means { means: self.means, reset: true, ..Means::new(self.power) };
        }
    }
}

/// Stalls on both sides, resets, early and missing `tlast`; most runs of frames are long enough for the last gain.
#[test]
fn every_frame_gives_the_mean_so_far() {
    for power in [1, 2, 4] {
        let mut random = fastrand::Rng::with_seed(power.into());
        let mut means = Means::new(power);
        let mut most = 0;
        let stimulus: Vec<Vec<Word>> = (0..6000)
            .map(|cycle| {
                let rst = cycle < 3 || random.u16(..900) == 0;
                let tlast = if random.u8(..200) == 0 { random.bool() } else { means.taxel + 1 == TAXELS };
                let word = random_word(&mut random, BITS);
                let [offered, ready] = [(); 2].map(|()| Word::from(random.u8(..8) > 0));
                let inputs = vec![rst.into(), word, offered, tlast.into(), ready];
                means.clock(&inputs);
                most = most.max(means.frames);
                inputs
            })
            .collect();
        assert!(most > 2 << power, "{most} frames");
        let marks = FrameMarks { frames_bits: frames_bits(power), limited: false };
        let prepare = prepare(power, MeanKind::Sliding);
        let average = Average::new([TAXELS, BITS], &prepare, marks, false, Arrays::default()).unwrap();
        check(&kernel_of(&average), &stimulus, &mut Means::new(power));
    }
}
