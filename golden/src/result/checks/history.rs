//! History: what the readings of a stream show of the sensor that one frame does not.
//!
//! ```text
//! constant share  the least change of the taxels beside one that has not changed, since it last did
//! torn share      frames t and t − 1 are equal to the bit before or after one taxel, and differ on its other side:
//!                 the smaller of the equal part's range and the other's largest change
//! ```
//!
//! Both are relative to the largest range of a frame so far; zeros and offsets do not count, nor frames of few steps. The changes of the taxels beside,
//! two to four, must have one sign: a taxel on the line between compression and tension may stand still. A missing reading neither
//! changes nor stands still.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: frames in their order | taxels | unit of the readings |
//! | out: constant share, torn share | scalars | fraction |

use super::readings::{is_fine, range};
use super::Checks;
use crate::data::frame::Frame;
use crate::spec::scene::Scene;

/// Fewest frames for which a taxel must not have changed.
const FEWEST: usize = 8;
/// Fewest taxels beside it that must have changed.
const FEWEST_BESIDE: usize = 2;

/// Readings since a taxel last changed.
#[derive(Clone, Debug, Default)]
struct Run {
    frames: usize,
    /// Readings of the taxels beside it when it changed; empty before it stands still, as taxels with noise never do.
    beside: Vec<f64>,
}

/// The readings of a stream so far.
#[derive(Clone, Debug)]
pub struct History {
    /// Live taxels beside each live taxel; none for dead ones.
    beside: Vec<Vec<usize>>,
    alive: Vec<bool>,
    runs: Vec<Run>,
    /// The last reading of each taxel.
    last: Vec<f64>,
    /// The last frame, NaN where a reading is missing.
    frame: Vec<f64>,
    /// Largest range of a frame.
    range: f64,
}

impl History {
    /// No frames of a scene's sensor.
    pub fn new(scene: &Scene) -> History {
        let (sensor, alive) = (&scene.sensor, scene.input.alive(&scene.sensor));
        let (rows, cols) = (sensor.rows, sensor.cols);
        let beside = |taxel: usize| -> Vec<usize> {
            let (row, col) = (taxel / cols, taxel % cols);
            let all = [
                (row > 0).then(|| taxel - cols),
                (row + 1 < rows).then(|| taxel + cols),
                (col > 0).then(|| taxel - 1),
                (col + 1 < cols).then(|| taxel + 1),
            ];
            let live = all.into_iter().flatten().filter(|k| alive[*k]);
            if alive[taxel] {
                live.collect()
            } else {
                Vec::new()
            }
        };
        let beside = (0..sensor.taxels()).map(beside).collect();
        History { beside, alive, runs: Vec::new(), last: Vec::new(), frame: Vec::new(), range: 0.0 }
    }

    /// Adds the frames of one reconstruction: `checks` with their figures, the largest of each. Frames of another sensor are
    /// left out.
    ///
    /// ```
    /// use dermis_golden::{result::checks::{history::History, Checks, CONSTANT, TORN}, data::frame::Frame, spec::scene::Scene};
    ///
    /// let scene = Scene::builtin("sensor-1")?;
    /// let press = Frame::shipped(&scene).remove(1);
    /// let mut history = History::new(&scene);
    /// let mut checks = Checks::default();
    /// for load in 1..12 {
    ///     let mut frame = press.clone();
    ///     frame.stress_MPa.iter_mut().for_each(|b| *b *= f64::from(load));
    ///     // One that is stuck at a third of the peak.
    ///     frame.stress_MPa[45] = 4.0 * press.stress_MPa[45];
    ///     checks = history.add(&[frame], checks);
    /// }
    /// assert!(checks.constant_share > Some(CONSTANT) && checks.torn_share < Some(TORN));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn add(&mut self, frames: &[Frame], checks: Checks) -> Checks {
        let (mut constant_share, mut torn_share) = (None, None);
        let taxels = self.alive.len();
        for frame in frames.iter().filter(|frame| frame.stress_MPa.len() == taxels) {
            let (constant, torn) = self.add_one(frame.readings());
            constant_share = [constant_share, constant].into_iter().flatten().reduce(f64::max);
            torn_share = [torn_share, torn].into_iter().flatten().reduce(f64::max);
        }
        Checks { constant_share, torn_share, ..checks }
    }

    /// The constant share and the torn share; `None` before there is a frame to compare with, and for one of few steps.
    fn add_one(&mut self, now: Vec<f64>) -> (Option<f64>, Option<f64>) {
        let live = || (0..now.len()).filter(|k| self.alive[*k] && !now[*k].is_nan());
        let of = |taxels: &mut dyn Iterator<Item = usize>| range(taxels.map(|k| now[k]));
        let (whole, fine) = (self.range.max(of(&mut live())), is_fine(live().map(|k| now[k])));
        let torn = (!self.last.is_empty() && fine).then(|| {
            let live = || live().filter(|k| !self.last[*k].is_nan());
            let change = |k: usize| (now[k] - self.last[k]).abs();
            let changed = || live().filter(|k| change(*k) > 0.0);
            let (Some(first), Some(last)) = (changed().next(), changed().next_back()) else { return 0.0 };
            let largest = changed().map(change).fold(0.0, f64::max);
            let equal = of(&mut live().take_while(|k| *k < first)).max(of(&mut live().skip_while(|k| *k <= last)));
            equal.min(largest) / whole
        });
        let beside = |taxel: usize| self.beside[taxel].iter().map(|k| now[*k]);
        let begun = !self.runs.is_empty();
        self.runs.resize(now.len(), Run::default());
        for (taxel, run) in self.runs.iter_mut().enumerate() {
            let missing = now[taxel].is_nan();
            if begun && (missing || self.last[taxel] == now[taxel]) {
                if run.frames == 1 && run.beside.is_empty() {
                    run.beside.extend(self.beside[taxel].iter().map(|k| self.frame[*k]));
                }
                run.frames += usize::from(!missing);
            } else {
                run.frames = 1;
                run.beside.clear();
            }
        }
        let still = |taxel: &usize| {
            let Run { frames, beside } = &self.runs[*taxel];
            *frames >= FEWEST && beside.len() >= FEWEST_BESIDE
        };
        let least = |taxel: usize| {
            let changes = std::iter::zip(beside(taxel), &self.runs[taxel].beside).map(|(now, then)| now - then);
            let changes: Vec<f64> = changes.filter(|change| !change.is_nan()).collect();
            if changes.len() < FEWEST_BESIDE {
                return 0.0;
            }
            let ends = changes
                .into_iter()
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], change| [change.min(low), change.max(high)]);
            ends[0].max(-ends[1]).max(0.0)
        };
        let constant = fine.then(|| live().filter(still).map(least).fold(0.0, f64::max) / whole);
        // The last reading of each taxel, which may be older than the last frame.
        self.last.resize(now.len(), f64::NAN);
        std::iter::zip(&mut self.last, &now).filter(|(_, now)| !now.is_nan()).for_each(|(last, now)| *last = *now);
        (self.frame, self.range) = (now, whole);
        (constant, torn)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::result::checks::tests::press;
    use crate::result::flags::Flag;
    use crate::spec::scene::Scene;

    /// The last flags of a stream of 12 moments in which a press grows; `change` has the readings of a moment and of the one
    /// before.
    fn flags(change: impl Fn(usize, &mut Vec<f64>, &[f64])) -> Vec<Flag> {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let exact = press(&scene.sensor, 5.0, 8.0, [1.5, 0.7]);
        let (mut history, mut checks, mut before) = (History::new(&scene), Checks::default(), Vec::new());
        for moment in 0..12 {
            let mut frame = exact.clone();
            // The first moments have no load.
            let load = moment.max(2) as f64 - 2.0;
            frame.stress_MPa.iter_mut().for_each(|b| *b *= load);
            let whole = frame.stress_MPa.clone();
            change(moment, &mut frame.stress_MPa, &before);
            before = whole;
            checks = history.add(&[frame], checks);
        }
        checks.flags(&scene).collect()
    }

    #[test]
    fn a_taxel_that_stands_still_beside_others_is_found_wherever_it_is_loaded() {
        assert_eq!(flags(|_, _, _| ()), []);
        for reading in [0.0, 0.3, -0.2] {
            for taxel in [27, 28, 35, 36] {
                assert_eq!(flags(|_, b, _| b[taxel] = reading), [Flag::TaxelConstant], "{taxel} at {reading}");
            }
            // Where nothing presses there is nothing to tell it from others.
            assert_eq!(flags(|_, b, _| b[0] = reading), [], "{reading}");
        }
        // Too short.
        assert_eq!(
            flags(|moment, b, _| if moment > 6 {
                b[27] = 0.3
            }),
            []
        );
    }

    #[test]
    fn a_frame_of_two_moments_is_found_before_and_after_the_tear() {
        let last = |moment: usize| moment == 11;
        assert_eq!(
            flags(|m, b, before| if last(m) {
                b[30..].copy_from_slice(&before[30..])
            }),
            [Flag::TornFrame]
        );
        assert_eq!(
            flags(|m, b, before| if last(m) {
                b[..35].copy_from_slice(&before[..35])
            }),
            [Flag::TornFrame]
        );
        // A whole frame twice, and a part without load.
        assert_eq!(
            flags(|m, b, before| if last(m) {
                b.copy_from_slice(before)
            }),
            []
        );
        assert_eq!(
            flags(|m, b, before| if last(m) {
                b[..2].copy_from_slice(&before[..2])
            }),
            []
        );
    }

    /// A taxel that is missing for many frames does not stand still, and beside missing ones a stuck taxel is found; so is a torn
    /// frame.
    #[test]
    fn missing_readings_neither_change_nor_stand_still() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let exact = press(&scene.sensor, 5.0, 8.0, [1.5, 0.7]);
        const LAST: usize = 10;
        let flags = |missing: &dyn Fn(usize) -> Vec<usize>, stuck: Option<usize>, torn: bool| -> Vec<Flag> {
            let (mut history, mut checks) = (History::new(&scene), Checks::default());
            for moment in 1..=LAST {
                let times = |load: usize| exact.stress_MPa.iter().map(|b| load as f64 * b).collect::<Vec<f64>>();
                let mut stress = times(moment);
                if torn && moment == LAST {
                    stress[32..].copy_from_slice(&times(LAST - 1)[32..]);
                }
                stuck.into_iter().for_each(|taxel| stress[taxel] = 0.3);
                missing(moment).into_iter().for_each(|taxel| stress[taxel] = f64::NAN);
                checks = history.add(&[Frame::from_stress("moment", &scene.sensor, stress).unwrap()], checks);
            }
            checks.flags(&scene).collect()
        };
        assert_eq!(flags(&|_| vec![27, 28], None, false), []);
        assert_eq!(flags(&|moment| vec![20 + moment % 3, 27 + moment % 2], None, false), []);
        assert_eq!(
            flags(&|moment| if moment % 4 == 0 { vec![28] } else { vec![35] }, Some(27), false),
            [Flag::TaxelConstant]
        );
        assert_eq!(flags(&|moment| vec![17 + moment % 2, 44], None, true), [Flag::TornFrame]);
    }

    #[test]
    fn frames_of_another_sensor_are_left_out() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let other = press(&Scene::builtin("sensor-1").unwrap().sensor, 4.0, 5.0, [0.0; 2]);
        let checks = History::new(&scene).add(&[other], Checks::default());
        assert_eq!((checks.constant_share, checks.torn_share), (None, None));
    }
}
