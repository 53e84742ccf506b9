//! Blind calibration: the gain of every taxel from ordinary presses of unknown load.
//!
//! A press may have any smooth pressure and shear; a taxel whose gain is off shows beside its neighbours what none of them would,
//! in one press after the other. The gains are those at which all presses together are most probable:
//!
//! ```text
//! y_k = G (S_k w_k) + rest        w_k ~ N(0, 1)        G = diag(exp θ), the same in every press
//! θ̂ = argmax Σ_k log p(y_k | θ) − |θ|²/2τ²           on the rough θ
//! ```
//!
//! The pressures are integrated out, not searched. Each press's S comes from its readings; with the gains found it is found anew.
//! The common scale and smooth patterns over the array stay as they are.
//!
//! | file | step |
//! |---|---|
//! | `presses` | one frame of each press of a recording |
//! | `fields` | the stress that a press may have |
//! | `likelihood` | probability of a press under gains, slope, information |
//! | `smooth` | patterns that no press shows |
//! | `ascent` | the gains at which all presses are most probable |
//!
//! The gains are validated on presses that had no part in them: those of one half of the presses must make the other
//! half more probable, and the other way round.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: recording of at least 200 presses | frames × taxels | the scene's readings |
//! | out: table | offset, gain per taxel | unit of the readings, MPa per unit |
//! | out: spread of the gains before and after | 1 each | fraction |

mod ascent;
mod fields;
mod likelihood;
mod presses;
mod smooth;
#[cfg(test)]
mod tests;

use crate::data::frame::{Frame, FrameError};
use crate::data::input::calibration::Calibration;
use crate::data::input::{Input, InputError};
use crate::physics::matrices::{check_size, MatricesError};
use crate::spec::scene::{EstimatorKind, Scene, SceneError};
use crate::spec::sensor::Sensor;
use ascent::{Ascent, Top};
use fields::Fields;
use likelihood::Modelled;
use presses::{presses, Press, Presses};
use rayon::prelude::*;
use serde::Serialize;
use smooth::{Smooth, ORDER};
use std::sync::atomic::{AtomicUsize, Ordering};
use thiserror::Error;

/// Fewest presses.
pub const FEWEST: usize = 200;
/// Most taxels of an array.
const MOST_TAXELS: usize = 48 * 48;
/// Share of a press's peak from which on a taxel is loaded.
const LOADED: f64 = 0.02;
/// Fewest presses that load a taxel whose gain is looked for.
const FEWEST_LOADED: usize = 10;
/// Times that the fields are found anew with the gains.
const REFRESHES: usize = 4;
/// Steps of an ascent under the same fields.
const STEPS: usize = 4;
/// Standard deviation of the gains that the first fields allow for, and the others.
const UNKNOWN: [f64; 2] = [0.05, 0.02];
/// σ, noise of a reading over the peak of its press, before a press is looked at, and its range. The readings tell it, with what no
/// smooth field describes of a press.
const NOISE: (f64, [f64; 2]) = (0.01, [0.002, 0.05]);
/// τ, spread of the gains before a press is looked at, and its range.
const PRIOR: (f64, [f64; 2]) = (0.05, [0.01, 0.2]);
/// Rise of the log likelihood of presses that had no part, over its standard error, from which on it is none of chance.
const SIGNIFICANT: f64 = 4.0;

/// Gains and what is known of them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BlindGains {
    /// Offset and gain of each taxel.
    #[serde(skip)]
    pub table: Calibration,
    /// Log of each gain that was found, over that of the scene; 0 where none was looked for. Row-major.
    pub log_gain: Vec<f64>,
    /// Number of presses.
    pub presses: usize,
    /// Frames of presses that are saturated, clipped or have a faulty line; left out.
    pub flagged: usize,
    /// Presses of which no frame is left; left out.
    pub spoiled: usize,
    /// Live taxels that fewer than ten presses load; they keep their gain. [row, col].
    pub unseen: Vec<[usize; 2]>,
    /// Number of smooth patterns that stay as they are.
    pub smooth: usize,
    /// Standard deviation of the rough part of the gains before, as a fraction.
    pub spread_before: f64,
    /// The least that is left of it, as a fraction: what noise leaves open. Pressures that smooth fields do not describe add to it; on
    /// drawn presses about twice as much is left.
    pub spread_after: f64,
    /// What pressure and shear leave of a reading, over the peak of its press.
    pub noise: f64,
    /// Rise of the log likelihood of a press by the gains of other presses, and its standard error.
    pub rise: [f64; 2],
    /// Largest gain times largest reading in MPa: the least `input.full_scale_MPa`.
    pub full_scale_MPa: f64,
}

/// A recording gives no gains.
#[derive(Debug, Error)]
pub enum BlindError {
    /// A frame is not of the scene's sensor.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The scene's table or tare frames cannot be used.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The scene has what the estimator `evidence`, of whose prior the fields are, does not take.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The array has no influence, or too many taxels.
    #[error(transparent)]
    Array(#[from] MatricesError),
    /// The scene has a characteristic that is no straight line.
    #[error(
        "scene {scene}: input.curve is stated, and gains behind a curve are not found; calibrate under known loads"
    )]
    Curve {
        /// The scene's name.
        scene: String,
    },
    /// Too few presses.
    #[error("{presses} presses in {frames} frames, wanted at least {FEWEST}, each between frames without load ({flagged} frames are saturated, clipped or have a faulty line; {spoiled} presses have no other)")]
    Few {
        /// Their number.
        presses: usize,
        /// Number of frames.
        frames: usize,
        /// Frames that a flag leaves out.
        flagged: usize,
        /// Presses without a frame.
        spoiled: usize,
    },
    /// The presses do not cover the array.
    #[error("{loaded} of {live} taxels are loaded in {FEWEST_LOADED} presses or more, wanted more than {needed}: press all over the array")]
    NotCovered {
        /// Taxels that enough presses load.
        loaded: usize,
        /// Live taxels.
        live: usize,
        /// Twice the number of smooth patterns.
        needed: usize,
    },
    /// The gains do not make other presses more probable.
    #[error("gains of one half of the presses change the log likelihood of a press of the other by {rise:+.2} with a standard error of {error:.2}, wanted at least {SIGNIFICANT} of them: the readings show no gains; check thickness and medium, and that the sensor was the same")]
    NoRise {
        /// The rise per press.
        rise: f64,
        /// Its standard error.
        error: f64,
    },
}

impl BlindGains {
    /// Finds the gains of the scene's sensor from a recording of presses; `progress` is called with the work done and all of it.
    ///
    /// # Errors
    /// [`BlindError`]
    pub fn new(
        scene: &Scene,
        frames: &[Frame],
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<BlindGains, BlindError> {
        frames.iter().try_for_each(|frame| frame.check(scene))?;
        let input = prepared(scene)?;
        let found = presses(scene, &input, frames);
        let Presses { flagged, spoiled, .. } = found;
        if found.presses.len() < FEWEST {
            return Err(BlindError::Few { presses: found.presses.len(), frames: frames.len(), flagged, spoiled });
        }
        let (seen, unseen) = covered(scene, &found.presses)?;
        let smooth = Smooth::new(&scene.sensor, &seen, ORDER);
        let search = Search::new(scene, &found.presses, (&seen, &smooth), progress)?;
        let gains = search.run().ok_or_else(|| not_finite(scene))?;
        let rise = search.rise(&gains)?;
        let [spread_before, spread_after] = search.spread(&gains.top);
        let theta = gains.top.theta;
        let table = table(&input, &found, &theta);
        let largest = frames.iter().map(Frame::peak_MPa).fold(0.0, f64::max);
        Ok(BlindGains {
            full_scale_MPa: largest * table.gain.iter().map(|gain| gain.abs()).fold(0.0, f64::max),
            table,
            presses: found.presses.len(),
            flagged,
            spoiled,
            unseen: unseen.iter().map(|&taxel| [taxel / scene.sensor.cols, taxel % scene.sensor.cols]).collect(),
            smooth: smooth.count(),
            spread_before,
            spread_after,
            noise: gains.noise,
            rise,
            log_gain: theta,
        })
    }
}

/// Root mean square of the part of log gains, one per taxel, that presses show, and of the smooth part, which they do not.
pub fn rough_and_smooth(sensor: &Sensor, log_gain: &[f64]) -> [f64; 2] {
    let all: Vec<usize> = (0..log_gain.len()).collect();
    let mut rough = log_gain.to_vec();
    Smooth::new(sensor, &all, ORDER).take_off(&mut rough);
    let square = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64;
    [square(&rough).sqrt(), (square(log_gain) - square(&rough)).max(0.0).sqrt()]
}

/// The scene's input, where its gains can be found.
fn prepared(scene: &Scene) -> Result<Input, BlindError> {
    if !scene.input.curve.is_empty() {
        return Err(BlindError::Curve { scene: scene.name.clone() });
    }
    check_size(&scene.sensor, MOST_TAXELS)?;
    scene.estimated_by(EstimatorKind::Evidence).require_golden()?;
    Ok(Input::new(scene)?)
}

fn not_finite(scene: &Scene) -> BlindError {
    MatricesError::NotFinite { sensor: Box::new(scene.sensor.clone()) }.into()
}

/// The live taxels that enough presses load, and the others.
fn covered(scene: &Scene, presses: &[Press]) -> Result<(Vec<usize>, Vec<usize>), BlindError> {
    let alive = scene.input.alive(&scene.sensor);
    let mut loaded = vec![0; alive.len()];
    for press in presses {
        press.taxels.iter().zip(&press.y).filter(|(_, y)| **y >= LOADED).for_each(|(&taxel, _)| loaded[taxel] += 1);
    }
    let live = (0..alive.len()).filter(|&taxel| alive[taxel]);
    let (seen, unseen): (Vec<usize>, Vec<usize>) = live.partition(|&taxel| loaded[taxel] >= FEWEST_LOADED);
    let needed = 2 * Smooth::new(&scene.sensor, &seen, ORDER).count();
    if seen.len() <= needed.max(1) {
        return Err(BlindError::NotCovered { loaded: seen.len(), live: seen.len() + unseen.len(), needed });
    }
    Ok((seen, unseen))
}

/// The table with the gains: readings of a taxel that reads too much count for less. Zeros are the scene's, else those found.
fn table(input: &Input, found: &Presses, theta: &[f64]) -> Calibration {
    let Calibration { offset, gain } =
        input.table().unwrap_or_else(|| Calibration { offset: found.zero.clone(), gain: vec![1.0; theta.len()] });
    Calibration { offset, gain: gain.iter().zip(theta).map(|(gain, theta)| gain / theta.exp()).collect() }
}

/// The search for the gains of some presses.
struct Search<'a> {
    fields: Fields,
    presses: &'a [Press],
    seen: &'a [usize],
    smooth: &'a Smooth,
    taxels: usize,
    progress: &'a (dyn Fn(usize, usize) + Sync),
    done: AtomicUsize,
    total: usize,
}

/// Where a search ended.
struct Found {
    top: Top,
    /// The presses under the last fields.
    modelled: Vec<Modelled>,
    /// σ of these fields.
    noise: f64,
    /// τ.
    prior: f64,
}

impl<'a> Search<'a> {
    fn new(
        scene: &Scene,
        presses: &'a [Press],
        (seen, smooth): (&'a [usize], &'a Smooth),
        progress: &'a (dyn Fn(usize, usize) + Sync),
    ) -> Result<Search<'a>, BlindError> {
        let fields = Fields::new(scene);
        if !fields.is_representable() {
            return Err(not_finite(scene));
        }
        // Fields and sums of each round, then the sums of the halves.
        let total = presses.len() * ((REFRESHES + 1) * (STEPS + 2) + STEPS + 1);
        let (taxels, done) = (scene.sensor.taxels(), AtomicUsize::new(0));
        Ok(Search { fields, presses, seen, smooth, taxels, progress, done, total })
    }

    fn step(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        (self.progress)(done.min(self.total), self.total);
    }

    fn climb(&self, modelled: &[&Modelled], theta: Vec<f64>, prior: f64) -> Option<Top> {
        Ascent { taxels: self.seen, smooth: self.smooth, prior }.climb(modelled, theta, STEPS, &|| self.step())
    }

    /// The gains, with noise and spread that go with them; `None` where the model is not representable.
    fn run(&self) -> Option<Found> {
        let ((mut noise, noises), (mut prior, priors)) = (NOISE, PRIOR);
        let mut theta = vec![0.0; self.taxels];
        let mut last = None;
        for round in 0..=REFRESHES {
            let model = |press: &Press| {
                let modelled = self.fields.model(press, &theta, UNKNOWN[round.min(1)], noise);
                self.step();
                modelled
            };
            let modelled: Vec<Modelled> = self.presses.par_iter().map(model).collect();
            let top = self.climb(&modelled.iter().collect::<Vec<_>>(), theta.clone(), prior)?;
            theta.clone_from(&top.theta);
            let [spread, _] = self.spread(&top);
            let ratio = top.noise_ratio;
            last = Some(Found { top, modelled, noise, prior });
            noise = (noise * ratio).clamp(noises[0], noises[1]);
            prior = spread.clamp(priors[0], priors[1]);
        }
        last
    }

    /// Root mean square of the rough part of the log gains, and of what is open of it. The smooth part is no part of either.
    fn spread(&self, top: &Top) -> [f64; 2] {
        let rough = self.seen.len().saturating_sub(self.smooth.count()).max(1) as f64;
        let open = top.sigma.iter().map(|sigma| sigma * sigma).sum::<f64>() / rough;
        let found = self.seen.iter().map(|&taxel| top.theta[taxel].powi(2)).sum::<f64>() / rough;
        [(found + open).sqrt(), open.sqrt()]
    }

    /// Rise of the log likelihood of a press by the gains of the other half, and its standard error.
    ///
    /// # Errors
    /// [`BlindError::NoRise`]
    fn rise(&self, found: &Found) -> Result<[f64; 2], BlindError> {
        let none = vec![0.0; self.taxels];
        let mut rises = Vec::with_capacity(found.modelled.len());
        for half in 0..2 {
            let own = |k: &usize| k % 2 == half;
            let (ours, others): (Vec<usize>, Vec<usize>) = (0..found.modelled.len()).partition(own);
            let of = |which: Vec<usize>| which.into_iter().map(|k| &found.modelled[k]).collect::<Vec<_>>();
            let theta = self.climb(&of(ours), none.clone(), found.prior).map_or(none.clone(), |top| top.theta);
            rises.par_extend(of(others).par_iter().map(|press| press.value(&theta) - press.value(&none)));
        }
        let count = rises.len() as f64;
        let rise = rises.iter().sum::<f64>() / count;
        let variance = rises.iter().map(|own| (own - rise).powi(2)).sum::<f64>() / (count - 1.0);
        let error = (variance / count).sqrt();
        match rise >= SIGNIFICANT * error && rise > 0.0 {
            true => Ok([rise, error]),
            false => Err(BlindError::NoRise { rise, error }),
        }
    }
}
