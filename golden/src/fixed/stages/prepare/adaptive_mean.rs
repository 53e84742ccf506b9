//! Adaptive mean: sliding means of several lengths of the same samples, of which the [window](crate::spec::mean_window) with the least
//! noise that agrees with the newest frames is the frame.
//!
//! ```text
//! s ── mean_k ← mean_k + ⌊(2^L s − mean_k − c) / 2^g_k + 1/2⌋        each k; L the longest, c as in `prepare`
//!   ├─ χ²_w = Σ (window − shortest mean)²                            each window but the shortest mean
//!   └─ S = Σ (s_t − 2 s_{t−1} + s_{t−2})² ── level S̃ ([`change_noise`](crate::data::input::change_noise))
//! window: the first with  χ²_w 2^e ≤ c_w S̃                           else the shortest mean
//! ```
//! Two means of k and k + 1 are extrapolated by shifts, a + (a − b) − ⌊(a − b) / 2^k⌋. c_w is the limit of χ² over n σ², over 6,
//! since S̃ is 6 n σ², in the units of both; e is that with which the largest c_w has [`FACTOR_BITS`] bits. Dead taxels are in no sum. Before the third
//! frame there is no S, and the shortest mean counts.
//!
//! | word | bits | LSB |
//! |---|---|---|
//! | mean_k | `code_bits` + L | 2^−L code |
//! | differences before they are squared, rounded down, saturated | up to 18 | 2^−17 of full scale or finer; of S four times as much |
//! | c_w | 12 | 2^−e |

use crate::data::input::change_noise::{Side, LEVEL_SHIFT, SECOND_DIFFERENCE};
use crate::fixed::words::arith::{round_shift, saturate};
use crate::fixed::words::formats::MULTIPLIER_BITS;
use crate::spec::mean_window::MeanWindow;
use crate::spec::scene::{MeanKind, Scene};
use crate::spec::sliding::gain_shift;

/// Width of a factor c_w.
pub const FACTOR_BITS: u32 = 12;
/// Cycles from a sample to the level that its S has moved.
pub const SUM_LATENCY: u32 = 7;
/// Cycles from the choice of a window to its first word, less one.
pub const SEND_LATENCY: u64 = 2;
/// Frames before the first with a second difference.
pub const FRAMES_BEFORE: usize = 2;

/// The adaptive mean of one scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdaptiveMean {
    /// k of each mean, ascending; the last is L.
    pub averages: Vec<u32>,
    /// The windows in the order in which they count; the last is the shortest mean.
    pub windows: Vec<MeanWindow>,
    /// c_w of each window but the last.
    pub factors: Vec<u32>,
    /// e.
    pub factor_shift: i32,
    /// Low bits of a difference from the shortest mean, and of a second difference, that are left out, so that neither exceeds the
    /// factor of a multiplier.
    pub shifts: [u32; 2],
    /// Whether each taxel lives, row-major.
    pub live: Vec<bool>,
}

/// What it has of the frames so far.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AdaptiveState {
    /// A mean each, row-major.
    means: Vec<Vec<i64>>,
    /// The samples of the frame before, and of that before it.
    last: [Vec<i64>; 2],
    /// S̃; 0 before the third frame.
    level: i64,
    side: Side,
    /// Index of the window of the last frame.
    pub window: usize,
}

impl AdaptiveMean {
    /// That of the hardware of `scene`; `None` where the mean is another.
    pub fn of_scene(scene: &Scene) -> Option<AdaptiveMean> {
        let input = &scene.input;
        if input.mean != MeanKind::Adaptive {
            return None;
        }
        let averages = input.averages();
        let windows = MeanWindow::all(&averages);
        let live = input.alive(&scene.sensor);
        let count = live.iter().filter(|live| **live).count();
        let (code_bits, longest) = (scene.fixed.input_bits, input.longest_average());
        let shifts = [code_bits + longest + 1, code_bits + 2].map(|bits| bits.saturating_sub(MULTIPLIER_BITS));
        // LSBs of S over those of χ².
        let unit = 2f64.powi((longest + shifts[1]) as i32 - shifts[0] as i32).powi(2) / SECOND_DIFFERENCE;
        let (_, tested) = windows.split_last()?;
        let limits: Vec<f64> = tested.iter().map(|window| unit * window.limit(&averages, count)).collect();
        let largest = limits.iter().copied().fold(0.0, f64::max);
        let factor_shift = FACTOR_BITS as i32 - 1 - largest.log2().floor() as i32;
        let most = f64::from((1u32 << FACTOR_BITS) - 1);
        let word = |limit: f64| (limit * 2f64.powi(factor_shift)).round().min(most) as u32;
        let factors = limits.into_iter().map(word).collect();
        Some(AdaptiveMean { averages, windows, factors, factor_shift, shifts, live })
    }

    /// Cycles from the last sample of a frame to the last word of its window: the samples pass through the sums, a window after the other is
    /// judged, then the words leave, one in a cycle.
    pub fn latency(&self) -> u64 {
        u64::from(self.judging_cycles()) + self.live.len() as u64 + SEND_LATENCY
    }

    /// Cycles from the last sample to the choice of a window.
    pub fn judging_cycles(&self) -> u32 {
        SUM_LATENCY + self.factors.len() as u32 * (FACTOR_BITS + 1)
    }

    /// Width of what is kept of a taxel, whose samples have `code_bits`: the means, above them the two samples before.
    pub fn word_bits(&self, code_bits: u32) -> u32 {
        self.averages.len() as u32 * (code_bits + self.longest()) + 2 * code_bits
    }

    /// Width of a difference of a window and the shortest mean before it is squared.
    pub fn apart_bits(&self, window: MeanWindow, code_bits: u32) -> u32 {
        let more = match window {
            MeanWindow::Mean(_) => 1,
            MeanWindow::Extrapolated(_) => 3,
        };
        (code_bits + self.longest() + more - self.shifts[0]).min(MULTIPLIER_BITS)
    }

    /// Width of a second difference before it is squared.
    pub fn second_bits(&self, code_bits: u32) -> u32 {
        code_bits + 2 - self.shifts[1]
    }

    /// The windows that are judged, with c_w.
    pub fn judged(&self) -> impl Iterator<Item = (MeanWindow, u32)> + '_ {
        self.windows.iter().copied().zip(self.factors.iter().copied())
    }

    /// L.
    pub fn longest(&self) -> u32 {
        self.averages[self.averages.len() - 1]
    }

    /// The mean of index `mean` that stands for k.
    fn index(&self, k: u32) -> usize {
        (k - self.averages[0]) as usize
    }

    /// The indices of the means of a window: one, or the two that are extrapolated with their k.
    pub fn means(&self, window: MeanWindow) -> (usize, Option<(usize, u32)>) {
        match window {
            MeanWindow::Mean(k) => (self.index(k), None),
            MeanWindow::Extrapolated(k) => (self.index(k), Some((self.index(k + 1), k))),
        }
    }

    /// Adds the samples of frame number `frame` since a reset, from 1; the words of its window, `input_bits` wide.
    pub(super) fn add(&self, state: &mut AdaptiveState, samples: &[i64], frame: usize, input_bits: u32) -> Vec<i32> {
        let zeros = || vec![0; samples.len()];
        if frame == 1 {
            *state = AdaptiveState { means: vec![zeros(); self.averages.len()], ..AdaptiveState::default() };
        }
        let half_down = ((frame - 1) % 2) as i64;
        for (mean, &k) in state.means.iter_mut().zip(&self.averages) {
            let shift = gain_shift(frame, k);
            for (mean, sample) in mean.iter_mut().zip(samples) {
                *mean += round_shift((sample << self.longest()) - *mean - half_down, shift);
            }
        }
        if frame > FRAMES_BEFORE {
            let [before, earlier] = &state.last;
            let second = |taxel: usize| samples[taxel] - 2 * before[taxel] + earlier[taxel];
            let sum = self.square(second, self.shifts[1]);
            state.follow(sum, frame == FRAMES_BEFORE + 1);
        }
        state.last = [samples.to_vec(), std::mem::take(&mut state.last[0])];
        let means = &state.means;
        let agrees = |(window, factor): (&MeanWindow, &u32)| {
            let square = self.square(|taxel| self.word(means, *window, taxel) - means[0][taxel], self.shifts[0]);
            let (left, right) = (i128::from(square), i128::from(state.level) * i128::from(*factor));
            let (up, down) = (self.factor_shift.max(0), (-self.factor_shift).max(0));
            window.counts_from() <= frame && frame > FRAMES_BEFORE && left << up <= right << down
        };
        let first = self.windows.iter().zip(&self.factors).position(agrees);
        state.window = first.unwrap_or(self.factors.len());
        let window = self.windows[state.window];
        (0..samples.len()).map(|taxel| saturate(self.word(means, window, taxel), input_bits).0 as i32).collect()
    }

    /// The word of a window at a taxel.
    fn word(&self, means: &[Vec<i64>], window: MeanWindow, taxel: usize) -> i64 {
        let (short, next) = self.means(window);
        let short = means[short][taxel];
        next.map_or(short, |(long, k)| {
            let apart = short - means[long][taxel];
            short + apart - (apart >> k)
        })
    }

    /// Sum of the squares over the live taxels, without the low bits of a difference.
    fn square(&self, difference: impl Fn(usize) -> i64, shift: u32) -> i64 {
        let live = (0..self.live.len()).filter(|&taxel| self.live[taxel]);
        live.map(|taxel| saturate(difference(taxel) >> shift, MULTIPLIER_BITS).0.pow(2)).sum()
    }
}

impl AdaptiveState {
    /// Moves the level with S of one more frame, the `first` with one.
    fn follow(&mut self, sum: i64, first: bool) {
        let (above, step) = (sum > self.level, self.level >> LEVEL_SHIFT);
        self.level = match first || self.side.ends(above) {
            true => sum,
            false => self.level + if above { step } else { -step },
        };
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Prepare, Scale};
    use super::*;
    use crate::data::generator::presses::{Motion, Press};
    use crate::data::input::means::Window;
    use crate::data::input::memory::Memory;
    use crate::data::input::Input;
    use crate::data::quantise::quantise;
    use crate::spec::mean_window::MeanNoise;

    fn scene(more: &str) -> Scene {
        let text = "name = \"a\"\n[sensor]\nrows = 8\ncols = 8\npitch_x_mm = 4.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n[input]\n\
                    mean = \"adaptive\"\ntemplate = false\nfull_scale_MPa = 0.2\n";
        Scene::parse(&format!("{text}{more}"), "a.toml").unwrap()
    }

    fn prepare(scene: &Scene) -> Prepare {
        Prepare::new(scene, Scale::new(scene).unwrap(), 0.2)
    }

    #[test]
    fn factors_use_their_bits() {
        for (average, windows) in [(3, 2), (4, 4), (6, 8)] {
            let own = AdaptiveMean::of_scene(&scene(&format!("average = {average}"))).unwrap();
            assert_eq!((own.windows.len(), own.factors.len()), (windows, windows - 1), "{average}");
            assert!(own.factors.iter().all(|factor| *factor < 1 << FACTOR_BITS));
            assert!(own.factors.iter().any(|factor| *factor >= 1 << (FACTOR_BITS - 1)), "{own:?}");
        }
        assert_eq!(AdaptiveMean::of_scene(&Scene::builtin("eight-by-eight").unwrap()), None);
    }

    /// In presses of every kind the model takes the window of floating point in nearly all frames, and its words are then that mean to
    /// half a code.
    #[test]
    fn windows_are_those_of_floating_point() {
        for bits in [12, 20] {
            windows_are_alike(bits);
        }
    }

    fn windows_are_alike(bits: u32) {
        let scene = scene(&format!("dead = [[2, 3]]\n[fixed]\ninput_bits = {bits}\n"));
        let (prepare, input) = (prepare(&scene), Input::new(&scene).unwrap());
        let adaptive = prepare.adaptive.clone().unwrap();
        let most = (1 << (bits - 1)) - 1;
        let lsb = 0.2 / f64::from(most);
        let (mut same, mut all, mut taken) = (0, 0, std::collections::BTreeSet::new());
        for (noise, (name, motion)) in [0.002, 0.02].into_iter().flat_map(|noise| Motion::NAMES.map(|own| (noise, own)))
        {
            let press = Press { rate_Hz: 500.0, ..Press::new(motion) }.of_frames(200, noise);
            let (mut prepared, mut memory) = (prepare.empty(), Memory::default());
            for frame in press.frames(&scene, 5).unwrap() {
                let codes = quantise(&frame.stress_MPa, bits, 0.2);
                assert!(codes.codes.iter().all(|code| code.abs() < most), "{name}");
                let read = crate::data::frame::Frame {
                    stress_MPa: codes.codes.iter().map(|code| f64::from(*code) * lsb).collect(),
                    ..frame
                };
                prepare.add(&mut prepared, &codes.codes, false);
                let averaged = input.average_after(&mut memory, &scene, &[read]).unwrap();
                let window = adaptive.windows[prepared.adaptive.window];
                let means = memory.means().unwrap();
                let own = Window::of(&adaptive.averages, window, &MeanNoise::after(&adaptive.averages, means.frames()));
                let alike = averaged.frames_held == Some(own.frames_held()) && averaged.lag_frames == Some(own.age);
                (same, all) = (same + usize::from(alike), all + 1);
                taken.insert(prepared.adaptive.window);
                for (word, mean) in prepared.words.iter().zip(means.mean(&own)) {
                    // Where codes rest, up to half a code of a change remains in a mean; the sum of two extrapolated has three times as much.
                    let off = f64::from(*word) / 64.0 - mean / lsb;
                    let most = if let MeanWindow::Mean(_) = window { 0.52 } else { 1.6 };
                    assert!(off.abs() < most, "{name} {noise} {window:?}: {off}");
                }
            }
        }
        // Where χ² is within rounding of its limit.
        assert!(same * 100 > all * 99, "{bits}: {same} of {all}");
        assert_eq!(taken.len(), adaptive.windows.len(), "{taken:?}");
    }

    /// Constant codes are their own mean from the first frame on, of the longest window that counts.
    #[test]
    fn constant_codes_take_the_longest_window() {
        let scene = scene("average = 4\n[fixed]\ninput_bits = 12\n");
        let prepare = prepare(&scene);
        let codes: Vec<i32> = (0..64).map(|taxel| 31 * taxel - 1000).collect();
        let mut prepared = prepare.empty();
        let windows: Vec<usize> = (0..40)
            .map(|_| {
                prepare.add(&mut prepared, &codes, false);
                assert!(prepared.words.iter().zip(&codes).all(|(word, code)| *word == code << 4));
                prepared.adaptive.window
            })
            .collect();
        assert_eq!(windows[..12], [3, 3, 3, 3, 3, 1, 1, 1, 1, 1, 1, 0]);
        assert!(windows[12..].iter().all(|window| *window == 0));
    }

    /// The largest steps neither overflow nor leave the words' range.
    #[test]
    fn rails_stay_in_range() {
        let scene = scene("[fixed]\ninput_bits = 12\n");
        let prepare = prepare(&scene);
        let mut prepared = prepare.empty();
        for frame in 0..300 {
            let code = if frame / 7 % 2 == 0 { 2047 } else { -2048 };
            prepare.add(&mut prepared, &[code; 64], false);
            assert!(prepared.words.iter().all(|word| (-(1 << 17)..1 << 17).contains(word)), "{frame}");
        }
    }
}
