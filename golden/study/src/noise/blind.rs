//! Blind: what gains found from presses of unknown load are worth, on drawn arrays whose gains are known.
//!
//! An array with gains 1 + γ n is pressed all over by the shapes of the tables, each press a frame after one without load, with
//! noise. [`BlindGains`] finds the gains; then an estimator reads other frames through the exact gains, without a table, and through
//! the table found. Rough and smooth are the parts that presses show and do not show.
//!
//! | | unit | |
//! |---|---|---|
//! | in: scene, spreads γ, presses, noise | – | noise of max \|b\| |
//! | out: what is left of the log gains, rough and smooth | fraction | root mean square |
//! | out: e_t with exact gains, without and with the table | fraction | median, 90 % quantile |

use super::outcome::{Outcome, Summary};
use super::shapes::{outcomes, readings, stated, ShapeStudy, PEAK};
use super::{Candidate, StudyError};
use dermis_golden::data::frame::Frame;
use dermis_golden::data::generator::converter::Converter;
use dermis_golden::data::generator::draws::{DrawOptions, DrawnFrame};
use dermis_golden::estimate::blind_gains::{rough_and_smooth, BlindError, BlindGains};
use dermis_golden::random::Random;
use dermis_golden::spec::scene::Scene;
use serde::Serialize;

/// Multiplier of the seed: presses, gains and judged frames have no random numbers in common.
const SPREAD: u64 = 0x9e37_79b9_7f4a_7c15;
/// Largest spread of the gains: with more a gain may be below 0.
const LARGEST_SPREAD: f64 = 0.2;

/// Parameters of a study.
#[derive(Clone, Debug, PartialEq)]
pub struct BlindStudy {
    /// Standard deviations of the gains, a row each, 0 to 0.2.
    pub spreads: Vec<f64>,
    /// Number of presses, 1 to 100 000.
    pub presses: usize,
    /// Noise over max |b| of a press, 0 to 1.
    pub noise: f64,
    /// Number of frames that are judged, 1 to 100 000.
    pub draws: usize,
    /// Noise over max |b| of a frame that is judged, 0 to 1.
    pub judged_noise: f64,
    /// Seed of presses, gains, noise and frames.
    pub seed: u64,
    /// What reads the frames.
    pub candidate: Candidate,
}

impl Default for BlindStudy {
    fn default() -> Self {
        BlindStudy {
            spreads: vec![0.05],
            presses: 300,
            noise: 0.005,
            draws: 250,
            judged_noise: 0.002,
            seed: 1,
            candidate: Candidate::Hardware,
        }
    }
}

/// One line of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BlindRow {
    /// Standard deviation of the gains that were drawn.
    pub spread: f64,
    /// Number of presses.
    pub presses: usize,
    /// Rough and smooth part of the log gains before.
    pub before: [f64; 2],
    /// What is left of them with the table; `None` where the presses give none.
    pub after: Option<[f64; 2]>,
    /// Rough spread before and the least that is left, estimated from the recording alone.
    pub estimated: Option<[f64; 2]>,
    /// Why the presses give no table.
    pub refused: Option<String>,
    /// Errors with the exact gains.
    pub exact: Summary,
    /// Errors without a table.
    pub without: Summary,
    /// Errors with the table found.
    pub with: Option<Summary>,
}

/// Runs a study; `progress` is called with the work done and all of it, row by row.
///
/// # Errors
/// [`StudyError`]: a scene that cannot be reconstructed, a parameter out of range.
pub fn blind_study(
    scene: &Scene,
    study: &BlindStudy,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<BlindRow>, StudyError> {
    let levels = [study.noise, study.judged_noise];
    super::study::check_parameters(study.presses, 1, &levels)?;
    super::study::check_parameters(study.draws, 1, &levels)?;
    if let Some(spread) = study.spreads.iter().find(|spread| !(0.0..=LARGEST_SPREAD).contains(*spread)) {
        let (value, allowed) = (spread.to_string(), "a number from 0 to 0.2");
        return Err(StudyError::Parameter { field: "spread", value, allowed });
    }
    let (presses, judged) = (drawn(scene, study, study.presses, 1)?, drawn(scene, study, study.draws, 2)?);
    study.spreads.iter().map(|spread| row(scene, study, *spread, &presses, &judged, progress)).collect()
}

/// Frames of one contact without noise; `part` tells presses from frames that are judged.
fn drawn(scene: &Scene, study: &BlindStudy, draws: usize, part: u64) -> Result<Vec<DrawnFrame>, StudyError> {
    let options = DrawOptions { seed: study.seed.wrapping_mul(SPREAD) ^ part, ..DrawOptions::default() };
    ShapeStudy { draws, options, ..ShapeStudy::default() }.frames(scene)
}

fn row(
    scene: &Scene,
    study: &BlindStudy,
    spread: f64,
    presses: &[DrawnFrame],
    judged: &[DrawnFrame],
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<BlindRow, StudyError> {
    let mut random = Random::new(study.seed.wrapping_mul(SPREAD) ^ 3);
    let gains: Vec<f64> = (0..scene.sensor.taxels()).map(|_| 1.0 + spread * random.normal()).collect();
    let log: Vec<f64> = gains.iter().map(|gain| gain.ln()).collect();
    let mut read = |exact: &[f64]| -> Result<Frame, StudyError> {
        let noisy = |(b, gain): (&f64, &f64)| b * gain + study.noise * PEAK * random.normal();
        Ok(Frame::from_stress("press", &scene.sensor, exact.iter().zip(&gains).map(noisy).collect())?)
    };
    let mut recording = Vec::with_capacity(2 * presses.len());
    for press in presses {
        recording.push(read(&vec![0.0; gains.len()])?);
        recording.push(read(&press.exact_MPa)?);
    }
    let found = BlindGains::new(scene, &recording, progress);
    let summary = |left: &[f64]| summary(scene, study, judged, left);
    let (found, refused) = match found {
        Ok(found) => (Some(found), None),
        Err(error @ (BlindError::Few { .. } | BlindError::NotCovered { .. } | BlindError::NoRise { .. })) => {
            (None, Some(error.to_string()))
        }
        Err(error) => return Err(error.into()),
    };
    let left = found.as_ref().map(|found| log.iter().zip(&found.log_gain).map(|(own, theta)| own - theta).collect());
    Ok(BlindRow {
        spread,
        presses: presses.len(),
        before: rough_and_smooth(&scene.sensor, &log),
        after: left.as_ref().map(|left: &Vec<f64>| rough_and_smooth(&scene.sensor, left)),
        estimated: found.as_ref().map(|found| [found.spread_before, found.spread_after]),
        refused,
        exact: summary(&vec![0.0; gains.len()])?,
        without: summary(&log)?,
        with: left.as_ref().map(|left| summary(left)).transpose()?,
    })
}

/// The errors on the frames that are judged, whose readings have these log gains.
fn summary(scene: &Scene, study: &BlindStudy, judged: &[DrawnFrame], log: &[f64]) -> Result<Summary, StudyError> {
    let gained = |drawn: &DrawnFrame| {
        let exact_MPa = drawn.exact_MPa.iter().zip(log).map(|(b, log)| b * log.exp()).collect();
        DrawnFrame { exact_MPa, ..drawn.clone() }
    };
    let gained: Vec<DrawnFrame> = judged.iter().map(gained).collect();
    let converter = Converter { noise: study.judged_noise, seed: study.seed, ..Converter::default() };
    let named = study.candidate.stated(&stated(scene, &converter, false));
    let read = readings(&gained, &converter, &named)?;
    let outcomes: Vec<Outcome> = outcomes(study.candidate, &named, judged, &read, &|| ())?;
    Ok(Summary::of(&outcomes.iter().collect::<Vec<_>>()))
}
