//! Known loads: offset and gain of every taxel from recordings under known uniform stresses.
//!
//! The readings r of a taxel under the stresses s_1 … s_n, each the mean of its frames, are fitted by
//!
//! ```text
//! r = offset + s / gain          least squares, every load with the same weight
//! ```
//!
//! with the error in r, since the stress is known. What the table is worth is told by loads that had no part in it: each
//! load in turn is left out, the table of the others is applied to its readings, and the difference from its stress is its
//! residual. The smallest and the largest load are extrapolated then.
//!
//! Where a line leaves more than the taxels' scatter, the characteristic is curved: b = c(gain · (reading − offset)) with one monotone
//! curve c for all taxels, `fit`.
//!
//! A taxel counts in the frames that have its reading, and a load for the taxels that have one under it; a taxel with a reading
//! under fewer than two different loads is dead. So is one that under a load is far from the line of its other loads though most taxels
//! are near theirs, as one whose own amplifier ends early.
//!
//! A load is saturated, and left out, where a tenth of the taxels read one value at an end of all readings in each of its frames,
//! though readings under another load have noise. The load of the smallest stress may stand at an end.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: loads | stress, frames of readings | MPa, unit of the readings |
//! | out: table | offset, gain per taxel | unit of the readings, MPa per unit |
//! | out: curve | knots, if it is curved | MPa by the table, MPa |
//! | out: residuals | mean, root mean square, largest per load | MPa |
//! | out: noise | root mean square over the taxels, of one frame | MPa |
//! | out: dead taxels | list | row, column |

mod fit;

pub use fit::Curvature;

use super::calibration::Calibration;
use super::missing::{mean_reading, readings};
use crate::data::frame::{Frame, FrameError};
use crate::spec::scene::Scene;
use fit::{different, Characteristic, Mean};
use serde::Serialize;
use thiserror::Error;

/// Fewest loads for residuals: two for the table, one left out.
const FEWEST_FOR_RESIDUALS: usize = 3;

/// Share of taxels at an end of the readings from which on a load is saturated.
const SATURATED_SHARE: f64 = 0.1;
/// Residual of a taxel from which on it does not follow the load: over the largest stress, and over the median of all taxels.
const OUTLIER_SHARE: f64 = 0.025;
const OUTLIER: f64 = 5.0;
/// Largest residual, root mean square over the largest stress, of a straight characteristic.
const STRAIGHT: f64 = 0.05;

/// Readings under a known uniform stress.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownLoad {
    /// The stress on every taxel in MPa.
    pub stress_MPa: f64,
    /// Frames of readings, at least one.
    pub frames: Vec<Frame>,
}

/// What a load shows of the table of the other loads.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Residual {
    /// The load's stress in MPa.
    pub stress_MPa: f64,
    /// Number of its frames.
    pub frames: usize,
    /// Mean over the live taxels, in MPa.
    pub mean_MPa: f64,
    /// Root mean square over the live taxels, in MPa.
    pub rms_MPa: f64,
    /// The largest, with its sign, in MPa.
    pub largest_MPa: f64,
    /// Its taxel, [row, col].
    pub taxel: [usize; 2],
}

/// A calibration and what is known of it.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadFit {
    /// Offset and gain of each taxel; a dead one has the median gain.
    pub table: Calibration,
    /// The characteristic behind it, where it is curved.
    pub curvature: Option<Curvature>,
    /// Taxels whose reading does not follow the load, [row, col].
    pub dead: Vec<[usize; 2]>,
    /// Standard deviation of a live taxel in one frame in MPa; `None` if no load has two frames.
    pub noise_MPa: Option<f64>,
    /// Largest gain times largest reading in MPa: the least `input.full_scale_MPa`.
    pub full_scale_MPa: f64,
    /// Stresses in MPa of loads that are saturated and left out.
    pub saturated_MPa: Vec<f64>,
    /// Residuals of the loads, each left out of the table that it is compared with, where the characteristic is curved all but the
    /// smallest and the largest one; empty with two different loads.
    pub residuals: Vec<Residual>,
}

/// Recordings give no calibration.
#[derive(Debug, Error)]
pub enum LoadError {
    /// A frame is not of the scene's sensor.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The loads are too few or all the same.
    #[error("{different} different loads: a calibration takes at least two")]
    TooFew {
        /// Number of different stresses.
        different: usize,
    },
    /// Without the saturated loads there are too few.
    #[error("the readings under {stress_MPa} MPa stand at one value, at the end of the converter's range: {different} different loads are left, a calibration takes at least two")]
    Saturated {
        /// Stress of a saturated load in MPa.
        stress_MPa: f64,
        /// Number of different stresses of the others.
        different: usize,
    },
    /// The readings are the same under all loads.
    #[error("the readings of most taxels do not change from {low} to {high} MPa")]
    NoChange {
        /// Smallest stress in MPa.
        low: f64,
        /// Largest stress in MPa.
        high: f64,
    },
    /// A value is not finite.
    #[error("the readings are too large: gain or offset of taxel {row},{col} is not finite")]
    NotFinite {
        /// Row of the taxel.
        row: usize,
        /// Its column.
        col: usize,
    },
}

impl LoadFit {
    /// Fits the table of the scene's sensor.
    ///
    /// ```
    /// use dermis_golden::data::frame::Frame;
    /// use dermis_golden::data::input::known_loads::{KnownLoad, LoadFit};
    /// use dermis_golden::spec::scene::Scene;
    ///
    /// let scene = Scene::builtin("eight-by-eight")?;
    /// let load = |stress_MPa: f64| -> Result<KnownLoad, Box<dyn std::error::Error>> {
    ///     let frame = Frame::from_stress("counts", &scene.sensor, vec![120.0 + stress_MPa / 0.0005; 64])?;
    ///     Ok(KnownLoad { stress_MPa, frames: vec![frame] })
    /// };
    /// let fit = LoadFit::new(&scene, &[load(0.0)?, load(0.1)?, load(0.2)?])?;
    /// assert!((fit.table.gain[63] - 0.0005).abs() < 1e-12 && (fit.table.offset[0] - 120.0).abs() < 1e-9);
    /// assert!(fit.dead.is_empty() && fit.residuals.iter().all(|residual| residual.rms_MPa < 1e-12));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`LoadError`]
    pub fn new(scene: &Scene, loads: &[KnownLoad]) -> Result<LoadFit, LoadError> {
        loads.iter().flat_map(|load| &load.frames).try_for_each(|frame| frame.check(scene))?;
        let taxels = scene.sensor.taxels();
        let (saturated, loads): (Vec<&KnownLoad>, Vec<&KnownLoad>) =
            loads.iter().partition(|load| is_saturated(load, loads));
        let place = |k: usize| [k / scene.sensor.cols, k % scene.sensor.cols];
        let mean = |load: &&KnownLoad| -> Mean {
            (load.stress_MPa, (0..taxels).map(|k| mean_reading(&load.frames, k)).collect())
        };
        let means: Vec<Mean> = loads.iter().map(mean).collect();
        let all: Vec<&Mean> = means.iter().collect();
        if let Some(load) = saturated.first().filter(|_| different(&all) < 2) {
            return Err(LoadError::Saturated { stress_MPa: load.stress_MPa, different: different(&all) });
        }
        if different(&all) < 2 {
            return Err(LoadError::TooFew { different: different(&all) });
        }
        let mut whole = Characteristic::of(&all, taxels);
        if whole.live.iter().filter(|live| **live).count() * 2 < taxels {
            let stresses = || loads.iter().map(|load| load.stress_MPa);
            let (low, high) = (stresses().fold(f64::INFINITY, f64::min), stresses().fold(f64::NEG_INFINITY, f64::max));
            return Err(LoadError::NoChange { low, high });
        }
        let table = &whole.table;
        let finite = |k: &usize| table.gain[*k].is_finite() && table.offset[*k].is_finite() && table.gain[*k] != 0.0;
        if let Some(k) = (0..taxels).find(|k| !finite(k)) {
            let [row, col] = place(k);
            return Err(LoadError::NotFinite { row, col });
        }
        let enough = different(&all) >= FEWEST_FOR_RESIDUALS;
        let left_out: Vec<LeftOut> =
            (0..loads.len()).filter(|_| enough).filter_map(|load| LeftOut::new(&means, load, &whole, taxels)).collect();
        for k in outliers(&left_out, &means, taxels) {
            whole.declare_dead(k, &all);
        }
        let Characteristic { table, live, .. } = &whole;
        let residual = |left_out: &LeftOut| -> Option<Residual> {
            let off: Vec<(usize, f64)> = left_out.off_MPa.iter().copied().filter(|(k, _)| live[*k]).collect();
            let sum = |of: fn(f64) -> f64| off.iter().map(|(_, off)| of(*off)).sum::<f64>() / off.len() as f64;
            let (taxel, largest_MPa) = off.iter().copied().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
            Some(Residual {
                stress_MPa: means[left_out.load].0,
                frames: loads[left_out.load].frames.len(),
                mean_MPa: sum(|off| off),
                rms_MPa: sum(|off| off * off).sqrt(),
                largest_MPa,
                taxel: place(taxel),
            })
        };
        let residuals = left_out.iter().filter_map(residual).collect();
        let largest = |values: &mut dyn Iterator<Item = f64>| values.map(f64::abs).fold(0.0, f64::max);
        let live_taxels = (0..taxels).filter(|&k| live[k]);
        let readings = &mut live_taxels.flat_map(|k| loads.iter().flat_map(move |load| readings(&load.frames, k)));
        Ok(LoadFit {
            saturated_MPa: saturated.iter().map(|load| load.stress_MPa).collect(),
            noise_MPa: noise(&loads, &means, &whole),
            full_scale_MPa: largest(&mut table.gain.iter().copied()) * largest(readings),
            dead: (0..taxels).filter(|&k| !live[k]).map(place).collect(),
            table: whole.table,
            curvature: whole.curvature,
            residuals,
        })
    }
}

impl LoadFit {
    /// The largest residual, root mean square, over the largest stress where the characteristic is curved, or a load is not what
    /// is stated; else `None`.
    pub fn curved_share(&self) -> Option<f64> {
        let largest = |figure: fn(&Residual) -> f64| self.residuals.iter().map(figure).fold(0.0, f64::max);
        let share = largest(|own| own.rms_MPa) / largest(|own| own.stress_MPa.abs());
        (share > STRAIGHT).then_some(share)
    }
}

/// A load that has no part in the table that it is compared with.
struct LeftOut {
    /// Its place among the loads.
    load: usize,
    /// Each taxel that has a reading, live by `whole`, and how far its stress by the table is from the load's, in MPa.
    off_MPa: Vec<(usize, f64)>,
}

impl LeftOut {
    /// `None` where the others give no table, or no curve that reaches the load where `whole` is curved.
    fn new(means: &[Mean], load: usize, whole: &Characteristic, taxels: usize) -> Option<LeftOut> {
        let others: Vec<&Mean> = means.iter().enumerate().filter(|(k, _)| *k != load).map(|(_, mean)| mean).collect();
        let (stress_MPa, readings) = &means[load];
        let within = others.iter().any(|mean| mean.0 < *stress_MPa) && others.iter().any(|mean| mean.0 > *stress_MPa);
        let of_others = match whole.curvature.is_some() {
            true => within.then(|| Characteristic::curved(&others, taxels))??,
            false => (different(&others) >= 2).then(|| Characteristic::straight(&others, taxels))?,
        };
        let with_reading = |k: usize| others.iter().filter(|(_, readings)| readings[k].is_some()).count();
        let off = |k: usize| {
            let reading = readings[k].filter(|_| whole.live[k] && with_reading(k) >= 2)?;
            Some((k, of_others.stress_MPa(k, reading) - stress_MPa))
        };
        Some(LeftOut { load, off_MPa: (0..taxels).filter_map(off).collect() })
    }
}

/// Taxels whose reading under a load is far from the line of the others, where most taxels are near theirs: one that ends early.
fn outliers(left_out: &[LeftOut], means: &[Mean], taxels: usize) -> Vec<usize> {
    let range = means.iter().map(|(stress, _)| stress.abs()).fold(0.0, f64::max);
    let far = |own: &LeftOut| -> Vec<usize> {
        let mut sizes: Vec<f64> = own.off_MPa.iter().map(|(_, off)| off.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let middle = sizes.get(sizes.len() / 2).copied().unwrap_or(0.0);
        let limit = (OUTLIER_SHARE * range).max(OUTLIER * middle);
        own.off_MPa.iter().filter(|(_, off)| off.abs() > limit).map(|(k, _)| *k).collect()
    };
    let mut all: Vec<usize> = left_out.iter().flat_map(far).collect();
    all.sort_unstable();
    all.dedup();
    // More of them are the characteristic of the sensor.
    if (all.len() as f64) < SATURATED_SHARE * taxels as f64 {
        all
    } else {
        Vec::new()
    }
}

/// Whether a load's readings stand at an end of those of all `loads`.
fn is_saturated(load: &KnownLoad, loads: &[KnownLoad]) -> bool {
    let taxels = load.frames.first().map_or(0, |first| first.stress_MPa.len());
    let still = |load: &KnownLoad, k: usize| readings(&load.frames, k).is_sorted_by(|a, b| a == b);
    let has_noise = |load: &KnownLoad| (0..taxels).filter(|k| !still(load, *k)).count() * 2 > taxels;
    let all = || loads.iter().flat_map(|load| (0..taxels).flat_map(|k| readings(&load.frames, k)));
    let ends = [all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max)];
    let stands = |k: usize, end: f64| readings(&load.frames, k).next() == Some(end) && still(load, k);
    let at = |end: f64| (0..taxels).filter(|&k| stands(k, end)).count() as f64;
    let least = loads.iter().map(|load| load.stress_MPa.abs()).fold(f64::INFINITY, f64::min);
    load.frames.len() > 1
        && load.stress_MPa.abs() > least
        && ends.iter().any(|end| at(*end) >= SATURATED_SHARE * taxels as f64)
        && loads.iter().any(has_noise)
}

/// Standard deviation of a live taxel around the mean of its load.
fn noise(loads: &[&KnownLoad], means: &[Mean], whole: &Characteristic) -> Option<f64> {
    let (mut squares, mut degrees) = (0.0, 0usize);
    for (load, (_, mean)) in loads.iter().zip(means) {
        for (k, mean) in mean.iter().enumerate().filter(|(k, _)| whole.live[*k]) {
            let Some(mean) = mean else { continue };
            let off = |own: f64| whole.stress_MPa(k, own) - whole.stress_MPa(k, *mean);
            squares += readings(&load.frames, k).map(|own| off(own).powi(2)).sum::<f64>();
            degrees += readings(&load.frames, k).count() - 1;
        }
    }
    (degrees > 0).then(|| (squares / degrees as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    const STRESSES: [f64; 4] = [0.0, 0.05, 0.1, 0.2];

    /// Offset and gain of a taxel, all different.
    fn truth(k: usize) -> (f64, f64) {
        (100.0 + k as f64, 5e-4 * (1.0 + 0.01 * k as f64))
    }

    /// Counts under `STRESSES` by `reading` of taxel and stress, with noise in MPa.
    fn loads(scene: &Scene, noise_MPa: f64, reading: impl Fn(usize, f64) -> f64) -> Vec<KnownLoad> {
        let mut random = Random::new(4);
        let mut frame = |stress: f64| {
            let counts = (0..64).map(|k| reading(k, stress) + random.normal() * noise_MPa / truth(k).1).collect();
            Frame::from_stress("counts", &scene.sensor, counts).unwrap()
        };
        let load = |stress_MPa| KnownLoad { stress_MPa, frames: (0..20).map(|_| frame(stress_MPa)).collect() };
        STRESSES.map(load).into()
    }

    fn linear(k: usize, stress: f64) -> f64 {
        truth(k).0 + stress / truth(k).1
    }

    #[test]
    fn offset_gain_and_noise_come_back() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let fit = LoadFit::new(&scene, &loads(&scene, 2e-4, linear)).unwrap();
        for k in 0..64 {
            let (offset, gain) = truth(k);
            assert!((fit.table.gain[k] / gain - 1.0).abs() < 2e-3 && (fit.table.offset[k] - offset).abs() < 0.5);
        }
        let noise = fit.noise_MPa.unwrap();
        assert!((noise / 2e-4 - 1.0).abs() < 0.05 && fit.dead.is_empty(), "{noise}");
        // A mean of 20 frames, and the table of as many.
        assert!(fit.residuals.len() == 4 && fit.residuals.iter().all(|r| r.rms_MPa < 2e-4 && r.rms_MPa > 2e-5));
        let text = fit.table.to_csv(&scene.sensor);
        assert_eq!(Calibration::parse(&text, "table.csv", &scene.sensor).unwrap(), fit.table);
    }

    #[test]
    fn a_curved_characteristic_shows_in_the_residuals() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let curved = |k: usize, stress: f64| linear(k, stress - 0.5 * stress * stress);
        let fit = LoadFit::new(&scene, &loads(&scene, 0.0, curved)[..3]).unwrap();
        let residuals = fit.residuals;
        // The line through s − s²/2 at 0 and 0.1 is 0.95 s; at 0.05 the readings are 0.04875. Three loads give no curve.
        let off = 0.04875 / 0.95 - 0.05;
        assert!((residuals[1].mean_MPa - off).abs() < 1e-9 && fit.curvature.is_none(), "{residuals:?}");
        assert!(residuals.iter().all(|r| r.rms_MPa > 5e-4), "{residuals:?}");
    }

    /// Counts of a converter that ends at 400: under the largest load nearly all, with noise in the others.
    #[test]
    fn a_saturated_load_is_left_out_and_named() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let whole = LoadFit::new(&scene, &loads(&scene, 2e-4, linear)).unwrap();
        assert!(whole.saturated_MPa.is_empty() && whole.curved_share().is_none());
        for sign in [1.0, -1.0] {
            let mut clipped = loads(&scene, 2e-4, |k, stress| sign * linear(k, stress));
            let readings = clipped.iter_mut().flat_map(|load| &mut load.frames).flat_map(|frame| &mut frame.stress_MPa);
            readings.for_each(|reading| *reading = reading.round().clamp(-330.0, 330.0));
            let fit = LoadFit::new(&scene, &clipped).unwrap();
            assert_eq!(fit.saturated_MPa, [0.2]);
            assert!((sign * fit.table.gain[9] / truth(9).1 - 1.0).abs() < 0.02 && fit.residuals.len() == 3);
            // With that load the table would be wrong, and two loads are too few for one.
            let text = LoadFit::new(&scene, &[clipped[0].clone(), clipped[3].clone()]).unwrap_err().to_string();
            assert!(text.starts_with("the readings under 0.2 MPa stand at one value"), "{text}");
        }
        // Readings that hardly rise beyond 190 counts: no straight line.
        let curved = loads(&scene, 2e-4, |k, stress| linear(k, stress).min(190.0 + 0.1 * stress));
        assert!(LoadFit::new(&scene, &curved).unwrap().curved_share() > Some(STRAIGHT));
    }

    /// A converter that ends anywhere, at either end, for all taxels or up to a seventh of them: where a gain is off, the fit says so.
    #[test]
    fn an_end_of_the_readings_is_never_silent() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let (mut said, mut silent) = (0, Vec::new());
        for end in (120..=560).step_by(20) {
            for every in [1, 7, 32] {
                for sign in [1.0, -1.0] {
                    let ends = |k: usize| if k.is_multiple_of(every) { f64::from(end) } else { f64::INFINITY };
                    let read = |k: usize, stress: f64| linear(k, stress);
                    let mut clipped = loads(&scene, 2e-4, read);
                    for frame in clipped.iter_mut().flat_map(|load| &mut load.frames) {
                        let readings = frame.stress_MPa.iter_mut().enumerate();
                        readings.for_each(|(k, reading)| *reading = sign * reading.round().min(ends(k)));
                    }
                    let Ok(fit) = LoadFit::new(&scene, &clipped) else {
                        said += 1;
                        continue;
                    };
                    let wrong = |k: &usize| {
                        let dead = fit.dead.contains(&[k / 8, k % 8]);
                        !dead && (sign * fit.table.gain[*k] / truth(*k).1 - 1.0).abs() > 0.03
                    };
                    let reported = !fit.saturated_MPa.is_empty()
                        || fit.curved_share().is_some()
                        || fit.curvature.is_some()
                        || !fit.dead.is_empty();
                    match (0..64).find(wrong) {
                        Some(k) if !reported => silent.push((end, every, sign, k)),
                        Some(_) => said += 1,
                        None => {}
                    }
                }
            }
        }
        assert!(silent.is_empty(), "{silent:?}");
        assert!(said > 20, "{said}");
    }

    #[test]
    fn dead_taxels_are_listed_and_leave_the_others_alone() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let reading = |k: usize, stress: f64| match k {
            9 => 77.0,
            18 => 100.0 - stress / 5e-4,
            _ => linear(k, stress),
        };
        let fit = LoadFit::new(&scene, &loads(&scene, 0.0, reading)).unwrap();
        assert_eq!(fit.dead, [[1, 1], [2, 2]]);
        assert!(fit.residuals.iter().all(|residual| residual.rms_MPa < 1e-12));
        assert!((fit.full_scale_MPa - truth(63).1 * (163.0 + 0.2 / truth(0).1)).abs() < 0.1);
        let text = fit.table.to_csv(&scene.sensor);
        assert!(Calibration::parse(&text, "table.csv", &scene.sensor).is_ok());
    }

    /// Missing readings, in some frames or under a whole load, leave gain and offset as they are.
    #[test]
    fn missing_readings_do_not_count() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let mut all = loads(&scene, 2e-4, linear);
        let mut lack = |load: usize, frames: std::ops::Range<usize>, taxel: usize| {
            for frame in &mut all[load].frames[frames] {
                frame.stress_MPa[taxel] = 0.0;
                frame.missing.push(taxel);
            }
        };
        lack(1, 0..19, 9);
        lack(2, 0..20, 18);
        (1..4).for_each(|load| lack(load, 0..20, 27));
        let fit = LoadFit::new(&scene, &all).unwrap();
        for k in [8, 9, 18] {
            let (offset, gain) = truth(k);
            assert!((fit.table.gain[k] / gain - 1.0).abs() < 4e-3 && (fit.table.offset[k] - offset).abs() < 0.5, "{k}");
        }
        // Under one load alone there is no gain.
        assert_eq!(fit.dead, [[3, 3]]);
        assert!((fit.noise_MPa.unwrap() / 2e-4 - 1.0).abs() < 0.05);
        assert!(fit.residuals.len() == 4 && fit.residuals.iter().all(|residual| residual.rms_MPa < 3e-4));
    }

    #[test]
    fn too_few_loads_and_readings_without_change_are_refused() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let all = loads(&scene, 0.0, linear);
        assert!(LoadFit::new(&scene, &all[..2]).unwrap().residuals.is_empty());
        for (few, different) in [(&all[..1], 1), (&[all[1].clone(), all[1].clone()][..], 1), (&[][..], 0)] {
            assert!(matches!(LoadFit::new(&scene, few), Err(LoadError::TooFew { different: d }) if d == different));
        }
        let still = loads(&scene, 0.0, |_, _| 5.0);
        let text = LoadFit::new(&scene, &still).unwrap_err().to_string();
        assert_eq!(text, "the readings of most taxels do not change from 0 to 0.2 MPa");
    }
}
