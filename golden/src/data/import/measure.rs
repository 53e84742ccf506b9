//! Measure: codes and temporal noise of a recording.
//!
//! Noise, per frame t, over the taxels that carry at least [`LOADED_SHARE`] of the frame's peak in t − 1, t and t + 1:
//!
//! ```text
//! σ² = mean of (b[t−1] − 2 b[t] + b[t+1])² / 6
//! ```
//!
//! The second difference removes a steady change; 6 = 1 + 4 + 1 is its variance for σ = 1. Only frames in which the load
//! is held count: the normal force of the neighbours differs from the frame's by at most [`HELD_SHARE`]. A moving contact
//! still adds to it, so it is an upper bound where the load moves under a constant force. Over runs of at least
//! [`LEAST_RUN`] such frames the standard deviation of each loaded taxel is the spread: noise, drift of the device,
//! tremor and motion of the load together.
//!
//! Frames without contact, of at most [`EMPTY_SHARE`] of the recording's peak, give the noise of unloaded taxels: their
//! standard deviation in time, which devices with a threshold hide.
//!
//! The frame whose readings differ least is taken for one without load. Readings fall with the load where they are farther below
//! its median than above it by a factor of [`FALLS`]; their level without load is that median then, else the reading of that frame
//! that is nearest to 0.
//!
//! | | unit | range |
//! |---|---|---|
//! | in: stress of all frames, dead taxels | MPa | finite |
//! | out: [`Noise`], [`Codes`], [`Idle`] | MPa, shares of a frame's peak | ≥ 0 |

use crate::quantile::median;
use serde::{Deserialize, Serialize};

/// Share of a frame's peak from which a taxel counts as loaded.
const LOADED_SHARE: f64 = 0.1;
/// Smallest number of loaded taxels of a frame.
const LEAST_LOADED: usize = 4;
/// Largest change of the normal force to a neighbour of a frame in which the load is held.
const HELD_SHARE: f64 = 0.02;
/// Share of the recording's peak below which a frame has no contact.
const EMPTY_SHARE: f64 = 0.05;
/// Smallest number of successive frames of a held load.
const LEAST_RUN: usize = 6;
/// Smallest number of frames without contact.
const LEAST_EMPTY: usize = 8;

/// Smallest ratio of how far readings that fall with the load are below the level without load to how far above it.
const FALLS: f64 = 3.0;

/// Largest range of the readings of a frame without load over that of the frame whose readings differ least.
const UNLOADED: f64 = 2.0;

/// Readings without load.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Idle {
    /// Their level in MPa.
    pub level_MPa: f64,
    /// Whether readings fall with the load.
    pub falls: bool,
    /// Frames without load before the first with one.
    #[serde(default)]
    pub frames: usize,
}

/// Temporal noise.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Noise {
    /// Frames in which the load is held.
    pub held_frames: usize,
    /// Standard deviation of a loaded taxel in MPa, median over the held frames.
    pub loaded_MPa: Option<f64>,
    /// The same over each frame's peak.
    pub loaded_share: Option<f64>,
    /// Standard deviation of a loaded taxel within a run of held frames over the run's peak, median over the runs.
    pub spread_share: Option<f64>,
    /// Frames without contact.
    pub empty_frames: usize,
    /// Standard deviation of a taxel without contact in MPa, root mean square over the taxels.
    pub empty_MPa: Option<f64>,
}

/// The values that a device reads.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Codes {
    /// Number of different readings.
    pub levels: usize,
    /// Smallest difference of two readings in MPa; none with a single one.
    pub step_MPa: Option<f64>,
    /// Bits for which the step is the last one at full scale.
    pub bits: Option<u32>,
    /// Readings at the stated full scale or beyond; 0 where none is stated.
    pub at_full_scale: usize,
}

/// The noise of the frames' stress; `alive` tells the taxels that exist.
pub fn noise(frames: &[&[f64]], alive: &[bool]) -> Noise {
    let peak = frames.iter().map(|frame| size(frame)).fold(0.0, f64::max);
    let held: Vec<Option<[f64; 2]>> = frames.windows(3).map(|three| held(three, alive)).collect();
    let middle = |k: usize| median(held.iter().flatten().map(|pair| pair[k]).collect());
    let (held_frames, spread_share) = (held.iter().flatten().count(), median(spreads(frames, &held, alive)));
    let empty: Vec<&[f64]> = frames.iter().copied().filter(|frame| size(frame) <= EMPTY_SHARE * peak).collect();
    let empty_MPa = (empty.len() >= LEAST_EMPTY).then(|| deviation(&empty, alive));
    Noise {
        held_frames,
        loaded_MPa: middle(0),
        loaded_share: middle(1),
        spread_share,
        empty_frames: empty.len(),
        empty_MPa,
    }
}

/// The level without load, and the sign of the load; `None` where no taxel exists.
pub fn idle(frames: &[&[f64]], alive: &[bool]) -> Option<Idle> {
    if !alive.contains(&true) {
        return None;
    }
    let own = |frame: &[f64]| std::iter::zip(frame, alive).filter(|(_, alive)| **alive).map(|(b, _)| *b).collect();
    // The smallest and the largest reading of a frame.
    let ends = |frame: &&[f64]| {
        let readings: Vec<f64> = own(frame);
        readings.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], b| [b.min(least), b.max(most)])
    };
    let all: Vec<[f64; 2]> = frames.iter().map(ends).collect();
    let range = |[least, most]: &[f64; 2]| most - least;
    let (evenest, least) = std::iter::zip(frames, &all).min_by(|(_, a), (_, b)| range(a).total_cmp(&range(b)))?;
    let mut sorted: Vec<f64> = own(evenest);
    sorted.sort_unstable_by(f64::total_cmp);
    let middle = sorted[sorted.len() / 2];
    let below = all.iter().map(|[least, _]| middle - least).fold(0.0, f64::max);
    let above = all.iter().map(|[_, most]| most - middle).fold(0.0, f64::max);
    let falls = below > FALLS * above;
    let nearest = sorted.iter().copied().min_by(|a, b| a.abs().total_cmp(&b.abs()))?;
    let frames = all.iter().take_while(|ends| range(ends) <= UNLOADED * range(least)).count();
    Some(Idle { level_MPa: if falls { middle } else { nearest }, falls, frames })
}

/// σ of the middle one of three frames, and σ over its peak, if the load is held.
fn held(three: &[&[f64]], alive: &[bool]) -> Option<[f64; 2]> {
    let [before, frame, after] = three else { return None };
    let sum = |frame: &[f64]| frame.iter().sum::<f64>();
    let force = sum(frame);
    if [before, after].iter().any(|other| (sum(other) - force).abs() > HELD_SHARE * force.abs()) {
        return None;
    }
    let (loaded, peak) = loaded(three, alive)?;
    let squares: f64 = loaded.iter().map(|k| (before[*k] - 2.0 * frame[*k] + after[*k]).powi(2) / 6.0).sum();
    let sigma = (squares / loaded.len() as f64).sqrt();
    Some([sigma, sigma / peak])
}

/// The taxels that are loaded in all frames, at least [`LEAST_LOADED`], and the middle frame's peak.
fn loaded(frames: &[&[f64]], alive: &[bool]) -> Option<(Vec<usize>, f64)> {
    let peak = size(frames[frames.len() / 2]);
    let is_loaded = |k: &usize| alive[*k] && frames.iter().all(|frame| frame[*k].abs() >= LOADED_SHARE * peak);
    let loaded: Vec<usize> = (0..alive.len()).filter(is_loaded).collect();
    (peak > 0.0 && loaded.len() >= LEAST_LOADED).then_some((loaded, peak))
}

/// The spread of each run of held frames; `held` has an entry for each frame but the first and the last.
fn spreads(frames: &[&[f64]], held: &[Option<[f64; 2]>], alive: &[bool]) -> Vec<f64> {
    let mut start = 0;
    let runs = held.chunk_by(|a, b| a.is_some() == b.is_some()).filter_map(|run| {
        start += run.len();
        // The neighbours of a held frame have nearly its force.
        (run[0].is_some() && run.len() + 2 >= LEAST_RUN).then(|| &frames[start - run.len()..start + 2])
    });
    let spread = |run: &[&[f64]]| {
        let (loaded, peak) = loaded(run, alive)?;
        let is_loaded: Vec<bool> = (0..alive.len()).map(|k| loaded.binary_search(&k).is_ok()).collect();
        Some(deviation(run, &is_loaded) / peak)
    };
    runs.filter_map(spread).collect()
}

/// Largest |b|.
fn size(frame: &[f64]) -> f64 {
    frame.iter().fold(0.0f64, |peak, b| peak.max(b.abs()))
}

/// Standard deviation in time, root mean square over the selected taxels.
fn deviation(frames: &[&[f64]], selected: &[bool]) -> f64 {
    let count = frames.len() as f64;
    let variance = |k: usize| {
        let mean = frames.iter().map(|frame| frame[k] / count).sum::<f64>();
        frames.iter().map(|frame| (frame[k] - mean).powi(2)).sum::<f64>() / (count - 1.0)
    };
    let taxels: Vec<f64> = (0..selected.len()).filter(|k| selected[*k]).map(variance).collect();
    (taxels.iter().sum::<f64>() / taxels.len().max(1) as f64).sqrt()
}

/// The codes of readings, with the units per MPa; `stated_MPa` is the device's or the user's full scale, `largest_MPa`
/// the full scale of the scene.
pub(super) fn codes(mut readings: Vec<f64>, per_MPa: f64, stated_MPa: Option<f64>, largest_MPa: f64) -> Codes {
    let at_full_scale = stated_MPa.map_or(0, |MPa| readings.iter().filter(|b| b.abs() / per_MPa >= MPa).count());
    readings.sort_unstable_by(f64::total_cmp);
    // −0 and 0 are the same reading.
    readings.dedup_by(|a, b| a == b);
    let step = readings.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    let step_MPa = step.is_finite().then_some(step / per_MPa);
    // The cast saturates.
    let bits = step_MPa.map(|step| (largest_MPa / step + 1.0).log2().ceil() as u32);
    Codes { levels: readings.len(), step_MPa, bits, at_full_scale }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise_of(frames: &[Vec<f64>]) -> Noise {
        let slices: Vec<&[f64]> = frames.iter().map(Vec::as_slice).collect();
        noise(&slices, &vec![true; frames[0].len()])
    }

    #[test]
    fn known_noise_is_measured() {
        let mut random = crate::random::Random::new(3);
        let (sigma, taxels) = (0.01, 100);
        // A load that rises by a hundredth of a percent per frame, then frames without contact.
        let rising = |t: usize| 1.0 + 1e-4 * t as f64;
        let mut frame = |load: f64| (0..taxels).map(|_| load + sigma * random.normal()).collect::<Vec<f64>>();
        let mut frames: Vec<Vec<f64>> = (0..60).map(|t| frame(rising(t))).collect();
        frames.extend((0..40).map(|_| frame(0.0)));
        let measured = noise_of(&frames);
        // 60 frames of 100 taxels: the median of σ is within 3 %, the 40 empty ones within 5 %.
        assert!((measured.loaded_MPa.unwrap() / sigma - 1.0).abs() < 0.03, "{measured:?}");
        assert!((measured.empty_MPa.unwrap() / sigma - 1.0).abs() < 0.05, "{measured:?}");
        assert_eq!((measured.held_frames, measured.empty_frames), (58, 40));
        // Share of the frame's peak, which noise raises above 1.
        let share = measured.loaded_share.unwrap();
        assert!((0.9 * sigma..sigma).contains(&share), "{share}");
        // The rise by 0.6 % in 60 frames adds 0.17 % to 1 % in the square.
        let spread = measured.spread_share.unwrap() / share;
        assert!((1.0..1.05).contains(&spread), "{spread}");
    }

    /// Presses on 25 taxels by way of a level and a sign, the first frame without load.
    fn presses(level: f64, sign: f64) -> Vec<Vec<f64>> {
        let load = |t: usize, k: usize| if (6..9).contains(&k) || k == 12 { (t * k) as f64 / 100.0 } else { 0.0 };
        let noise = |t: usize, k: usize| 1e-3 * ((7 * t + 3 * k) % 5) as f64;
        (0..6).map(|t| (0..25).map(|k| level + noise(t, k) + sign * load(t, k)).collect()).collect()
    }

    #[test]
    fn falling_readings_and_a_level_without_load_are_told() {
        let alive = [true; 25];
        for (level, sign) in [(0.0, 1.0), (0.0, -1.0), (3.0, 1.0), (3.0, -1.0)] {
            let frames = presses(level, sign);
            // All frames; the last one alone.
            for frames in [&frames[..], &frames[5..]] {
                let slices: Vec<&[f64]> = frames.iter().map(Vec::as_slice).collect();
                let idle = idle(&slices, &alive).unwrap();
                assert!(
                    (idle.level_MPa - level).abs() < 0.01 && idle.falls == (sign < 0.0) && idle.frames == 1,
                    "{level} {sign}: {idle:?}"
                );
            }
        }
        assert_eq!((idle(&[], &alive), idle(&[&[1.0]], &[false])), (None, None));
    }

    #[test]
    fn moving_loads_and_single_taxels_are_not_held() {
        let moving: Vec<Vec<f64>> = (0..9).map(|t| vec![f64::from(t); 9]).collect();
        let single: Vec<Vec<f64>> = (0..9).map(|_| vec![1.0, 0.0, 0.0, 0.0]).collect();
        for frames in [moving, single] {
            let measured = noise_of(&frames);
            assert_eq!((measured.held_frames, measured.loaded_MPa, measured.loaded_share), (0, None, None));
        }
        assert_eq!(noise(&[], &[]), Noise::default());
    }

    #[test]
    fn codes_by_hand() {
        // Steps of 6 and 5 kPa up to 59 of 255 kPa: 51 steps, 6 bits.
        let codes = codes(vec![0.0, 18.0, 24.0, 53.0, 59.0, -0.0, 24.0, 48.0], 1e3, Some(0.255), 0.255);
        assert_eq!((codes.levels, codes.bits, codes.at_full_scale), (6, Some(6), 0));
        assert!((codes.step_MPa.unwrap() - 0.005).abs() < 1e-15);
        assert_eq!(
            super::codes(vec![2.0; 3], 10.0, Some(0.2), 0.2),
            Codes { levels: 1, step_MPa: None, bits: None, at_full_scale: 3 }
        );
    }
}
