//! Presses: one frame of each press of a recording, the mean of those around its largest load.
//!
//! The load of a frame is the mean stress of its taxels. The range of the loads goes from the 5 % to the 95 % quantile of a
//! recording; a frame without load is within 5 % of the range above its lower end, and a press is what lies between such frames and
//! reaches 10 %. The zero of a press is the mean of the frames without load next to it, so that drift from press to press does no
//! harm. Frames that a flag says are spoiled are left out and counted.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: recording | frames × taxels | the scene's readings |
//! | out: presses | presses × taxels | of the press's peak, with the taxels that count |

use crate::data::frame::Frame;
use crate::data::input::Input;
use crate::result::checks::Checks;
use crate::result::flags::Flag;
use crate::spec::scene::Scene;

/// Quantiles of the loads between which their range lies.
const ENDS: [f64; 2] = [0.05, 0.95];
/// Share of the range below which a frame is without load.
const UNLOADED: f64 = 0.05;
/// Share of the range from which on what lies between frames without load is a press.
const PRESSED: f64 = 0.1;
/// Share of a press's largest load from which on a frame beside the largest is averaged with it.
const NEAR_PEAK: f64 = 0.95;
/// Most frames that are averaged on each side of the largest.
const MOST_BESIDE: usize = 4;
/// Most frames without load whose mean is a zero.
const MOST_ZERO: usize = 32;

/// A press: what its taxels read, in units of the largest of them.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Press {
    /// Taxels that count, ascending.
    pub taxels: Vec<usize>,
    /// Their readings.
    pub y: Vec<f64>,
}

/// The presses of a recording, and what was left out.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Presses {
    /// The presses in their order.
    pub presses: Vec<Press>,
    /// Frames that a flag says are spoiled.
    pub flagged: usize,
    /// Presses of which no frame is left.
    pub spoiled: usize,
    /// Mean reading of each taxel without load, in the unit of the readings; 0 of a taxel that has none.
    pub zero: Vec<f64>,
}

/// Finds the presses of `frames`, each of the scene's sensor.
pub(super) fn presses(scene: &Scene, input: &Input, frames: &[Frame]) -> Presses {
    let alive = scene.input.alive(&scene.sensor);
    let stress: Vec<Frame> = frames.iter().map(|frame| input.calibrate(frame)).collect();
    let loads: Vec<f64> = stress.iter().map(|frame| load(frame, &alive)).collect();
    let mut sorted = loads.clone();
    sorted.sort_by(f64::total_cmp);
    let mut found = Presses { zero: vec![0.0; alive.len()], ..Presses::default() };
    let Some(last) = sorted.len().checked_sub(1) else { return found };
    let [low, high] = ENDS.map(|share| sorted[(share * last as f64).round() as usize]);
    let above = |k: usize| (loads[k] - low) / (high - low);
    let loaded: Vec<bool> = (0..loads.len()).map(|k| above(k) > UNLOADED).collect();
    let unloaded: Vec<usize> = (0..loads.len()).filter(|&k| !loaded[k]).collect();
    if unloaded.is_empty() || high <= low {
        return found;
    }
    // Without load a coarse converter's readings are equal, which says nothing.
    let good: Vec<bool> = (0..frames.len()).map(|k| !loaded[k] || !is_spoiled(scene, input, &frames[k])).collect();
    found.flagged = good.iter().filter(|good| !**good).count();
    found.zero = (0..alive.len()).map(|taxel| mean(frames, &unloaded, taxel).unwrap_or(0.0)).collect();
    let runs = loaded.chunk_by(|a, b| a == b).scan(0, |first, run| {
        let begin = *first;
        *first += run.len();
        Some((run[0], begin..*first))
    });
    for (_, run) in runs.filter(|(loaded, _)| *loaded) {
        let (begin, end) = (run.start, run.end);
        if run.clone().all(|k| above(k) < PRESSED) {
            continue;
        }
        let Some(peak) = run.filter(|&k| good[k]).max_by(|a, b| loads[*a].total_cmp(&loads[*b])) else {
            found.spoiled += 1;
            continue;
        };
        let near = |k: &usize| loads[*k] - low >= NEAR_PEAK * (loads[peak] - low);
        let before = (begin..peak).rev().take_while(near).take(MOST_BESIDE);
        let after = (peak + 1..end).take_while(near).take(MOST_BESIDE);
        let pressed: Vec<usize> = before.chain(after).filter(|&k| good[k]).chain([peak]).collect();
        let split = unloaded.partition_point(|&k| k < begin);
        let zero = match split {
            0 => &unloaded[..MOST_ZERO.min(unloaded.len())],
            _ => &unloaded[split.saturating_sub(MOST_ZERO)..split],
        };
        match Press::of(scene, &stress, &alive, &pressed, zero) {
            Some(press) => found.presses.push(press),
            None => found.spoiled += 1,
        }
    }
    found
}

impl Press {
    /// The press of the frames `pressed`, above those of `zero`; `None` where nothing is pressed.
    fn of(scene: &Scene, stress: &[Frame], alive: &[bool], pressed: &[usize], zero: &[usize]) -> Option<Press> {
        let clips = scene.input.unipolar;
        let reading = |taxel: usize| {
            let clipped = clips && pressed.iter().any(|&k| stress[k].stress_MPa[taxel] <= 0.0);
            if !alive[taxel] || clipped {
                return None;
            }
            Some((taxel, mean(stress, pressed, taxel)? - mean(stress, zero, taxel)?))
        };
        let (taxels, y): (Vec<usize>, Vec<f64>) = (0..alive.len()).filter_map(reading).unzip();
        let peak = y.iter().copied().fold(0.0, f64::max);
        (peak > 0.0).then(|| Press { y: y.iter().map(|b| b / peak).collect(), taxels })
    }
}

/// Whether a flag says that the readings of a frame are spoiled, by the electronics or by the end of the range.
fn is_spoiled(scene: &Scene, input: &Input, frame: &Frame) -> bool {
    let checks = Checks::default().with_readings(input, std::slice::from_ref(frame));
    checks.flags(scene).any(|flag| matches!(flag, Flag::Saturated | Flag::Clipped | Flag::LineFault))
}

/// Mean stress of the live taxels that a frame has.
fn load(frame: &Frame, alive: &[bool]) -> f64 {
    let own = (0..alive.len()).filter(|&k| alive[k] && !frame.lacks(k));
    let (sum, count) = own.fold((0.0, 0), |(sum, count), k| (sum + frame.stress_MPa[k], count + 1));
    sum / f64::from(count.max(1))
}

/// Mean value of a taxel in those of the frames `which` that have one; `None` where none has.
fn mean(frames: &[Frame], which: &[usize], taxel: usize) -> Option<f64> {
    let own = || which.iter().map(|&k| &frames[k]).filter(|frame| !frame.lacks(taxel));
    let count = own().count() as f64;
    (count > 0.0).then(|| own().map(|frame| frame.stress_MPa[taxel] / count).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::frame::Frame;

    /// Loads of frames of a 3 × 3 array whose zeros are k/100 and drift by 0.01 from press to press.
    fn recording(loads: &[f64]) -> (Scene, Vec<Frame>) {
        let sensor =
            crate::spec::sensor::Sensor { rows: 3, cols: 3, pitch_x_mm: 4.0, pitch_y_mm: 4.0, thickness_mm: 3.0 };
        let scene = Scene::of_sensor(&sensor, "small");
        let mut pressed = 0.0;
        let mut last = 0.0;
        let mut frame = |load: &f64| {
            if last > 0.0 && *load == 0.0 {
                pressed += 1.0;
            }
            last = *load;
            let reading = |k: usize| 0.01 * k as f64 + 0.01 * pressed + load * (1.0 + 0.1 * k as f64);
            Frame::from_stress("frame", &sensor, (0..9).map(reading).collect()).unwrap()
        };
        let frames = loads.iter().map(&mut frame).collect();
        (scene, frames)
    }

    fn found(scene: &Scene, frames: &[Frame]) -> Presses {
        presses(scene, &Input::new(scene).unwrap(), frames)
    }

    #[test]
    fn a_press_is_what_lies_between_frames_without_load() {
        // A touch of 7 % is none; the frames at 0.97 and 1 are averaged; the last press has no end.
        let (scene, frames) = recording(&[0.0, 0.5, 1.0, 0.97, 0.3, 0.0, 0.07, 0.0, 0.4, 0.9, 0.2, 0.0, 0.0, 0.8]);
        let found = found(&scene, &frames);
        assert_eq!((found.presses.len(), found.flagged, found.spoiled), (3, 0, 0));
        for press in &found.presses {
            assert_eq!(press.taxels, (0..9).collect::<Vec<_>>());
            let wanted = |k: usize| (1.0 + 0.1 * k as f64) / 1.8;
            assert!((0..9).all(|k| (press.y[k] - wanted(k)).abs() < 0.02), "{press:?}");
        }
    }

    #[test]
    fn without_frames_without_load_there_is_no_press() {
        let (scene, frames) = recording(&[1.0, 1.0, 1.0]);
        assert_eq!(found(&scene, &frames).presses, []);
        assert_eq!(found(&scene, &[]).presses, []);
    }

    /// Clipped frames are left out and counted; a press that has no other is none. A missing reading is no taxel of its press.
    #[test]
    fn what_is_spoiled_is_left_out() {
        let (mut scene, mut frames) = recording(&[0.0, 0.5, 1.0, 0.0, 0.6, 0.0, 1.1, 0.0]);
        scene.input.full_scale_MPa = Some(1.9);
        frames[4].missing = vec![7];
        let found = found(&scene, &frames);
        assert_eq!((found.presses.len(), found.flagged, found.spoiled), (2, 1, 1));
        assert_eq!(found.presses[1].taxels, [0, 1, 2, 3, 4, 5, 6, 8]);
        // A clipped taxel of an array that reads no tension is none either.
        scene.input.unipolar = true;
        frames[1..3].iter_mut().for_each(|frame| frame.stress_MPa[0] = 0.0);
        assert!(!self::found(&scene, &frames).presses[0].taxels.contains(&0));
    }
}
