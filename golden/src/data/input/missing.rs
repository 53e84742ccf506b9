//! Missing: what is taken for a reading that a frame lacks.
//!
//! | consumer | takes |
//! |---|---|
//! | estimators with evidence | nothing: the taxel is left out of the fit of that frame |
//! | other estimators, and the codes of the bit-true model, of simulated hardware and of a board | b̂ |
//! | mean of several frames | the mean of the frames that have the reading, where there is one; of a mean that slides, those before |
//! | checks of readings and of a stream | nothing |
//!
//! A cover smooths the stress. With readings of that covariance k, b̂ is the mean under those of the `NEAREST` nearest taxels that
//! have one, R, and σ its standard deviation (kriging, Matheron 1963):
//!
//! ```text
//! k(d) = s² / (1 + d²/L²)²        L = max(4 h, 3 pitches)        K = k(|r − r'|) + 10⁻³ s² 1
//! b̂ = kᵀ K⁻¹ b        σ² = s² − kᵀ K⁻¹ k        s² = bᵀ K⁻¹ b / n   with K for s = 1
//! ```
//!
//! On drawn presses with missing taxels at the peak, beside it and anywhere, the root sum square of b̂ − b is less than 0.6 of that
//! of the harmonic prediction (the tests draw them again).
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: calibrated stress, missing taxels, live taxels | taxels | MPa |
//! | out: b̂, σ | missing taxels | MPa |
//! | out: Σ σ over Σ \|b\| | scalar | fraction |

#[cfg(test)]
mod tests;

use crate::data::frame::Frame;
use crate::spec::scene::InputSpec;
use crate::spec::sensor::Sensor;
use faer::linalg::solvers::Solve;
use faer::{Col, Mat, Side};

/// Number of readings from which one is predicted.
const NEAREST: usize = 24;
/// L in units of the cover's thickness and of the larger pitch, the larger of both.
const LENGTH: [f64; 2] = [4.0, 3.0];
/// Variance of a reading that its neighbours do not share, over s².
const OWN: f64 = 1e-3;

/// The stress of a taxel, from other taxels.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Predicted {
    stress_MPa: f64,
    sigma_MPa: f64,
}

/// The calibrated frame with predicted stress on its missing taxels; an array that reads no tension reads 0 in its place.
pub(crate) fn complete(input: &InputSpec, mut frame: Frame) -> Frame {
    let predicted = predict(input, &frame);
    for (taxel, own) in predicted {
        frame.stress_MPa[taxel] = if input.unipolar { own.stress_MPa.max(0.0) } else { own.stress_MPa };
    }
    frame
}

/// Sum of the standard deviations of predicted stress over the sum of the sizes of all stress: the share of the load that is
/// not known; `None` where no reading of the completed `frame` is missing.
pub(crate) fn open_share(input: &InputSpec, frame: &Frame) -> Option<f64> {
    let sizes: f64 = frame.stress_MPa.iter().map(|b| b.abs()).sum();
    let sigmas: f64 = predict(input, frame).iter().map(|(_, own)| own.sigma_MPa).sum();
    (!frame.missing.is_empty() && sizes > 0.0).then(|| sigmas / sizes)
}

/// Root mean square over the array of the standard deviations of predicted stress, in MPa.
pub(crate) fn noise_MPa(input: &InputSpec, frame: &Frame) -> f64 {
    let squares: f64 = predict(input, frame).iter().map(|(_, own)| own.sigma_MPa.powi(2)).sum();
    (squares / frame.stress_MPa.len().max(1) as f64).sqrt()
}

/// The readings of a taxel in the frames that have one.
pub(super) fn readings(frames: &[Frame], taxel: usize) -> impl Iterator<Item = f64> + Clone + '_ {
    frames.iter().filter(move |frame| !frame.lacks(taxel)).map(move |frame| frame.stress_MPa[taxel])
}

/// Their mean; `None` where no frame has one.
pub(super) fn mean_reading(frames: &[Frame], taxel: usize) -> Option<f64> {
    let count = readings(frames, taxel).count();
    // Divided before adding, so that the sum does not overflow.
    (count > 0).then(|| readings(frames, taxel).map(|reading| reading / count as f64).sum())
}

/// The missing taxels of a calibrated frame with their predicted stress.
fn predict(input: &InputSpec, frame: &Frame) -> Vec<(usize, Predicted)> {
    if frame.missing.is_empty() {
        return Vec::new();
    }
    let mut known = input.alive(&frame.sensor);
    frame.missing.iter().for_each(|&taxel| known[taxel] = false);
    let of = |&taxel: &usize| (taxel, predict_one(&frame.sensor, &frame.stress_MPa, &known, taxel));
    frame.missing.iter().map(of).collect()
}

fn predict_one(sensor: &Sensor, b: &[f64], known: &[bool], taxel: usize) -> Predicted {
    let pitch_mm = sensor.pitch_x_mm.max(sensor.pitch_y_mm);
    let length_mm = (LENGTH[0] * sensor.thickness_mm).max(LENGTH[1] * pitch_mm);
    let covariance = |s: usize, t: usize| (1.0 + (distance_mm(sensor, s, t) / length_mm).powi(2)).powi(-2);
    let near = nearest(sensor, known, taxel);
    let n = near.len();
    let between = Mat::from_fn(n, n, |i, j| covariance(near[i], near[j]) + if i == j { OWN } else { 0.0 });
    let Ok(factor) = between.llt(Side::Lower) else { return Predicted { stress_MPa: 0.0, sigma_MPa: 0.0 } };
    let (to, readings) = (Col::from_fn(n, |i| covariance(near[i], taxel)), Col::from_fn(n, |i| b[near[i]]));
    let (weights, weighted) = (factor.solve(&to), factor.solve(&readings));
    let open = 1.0 - to.transpose() * &weights;
    let variance = readings.transpose() * &weighted / n.max(1) as f64;
    Predicted { stress_MPa: weights.transpose() * &readings, sigma_MPa: (open * variance).max(0.0).sqrt() }
}

/// The nearest taxels that are `known`, at most [`NEAREST`], from rings that widen until they hold as many.
fn nearest(sensor: &Sensor, known: &[bool], taxel: usize) -> Vec<usize> {
    let (row, col) = (taxel / sensor.cols, taxel % sensor.cols);
    let pitch_mm = sensor.pitch_x_mm.max(sensor.pitch_y_mm);
    let mut ring = 2;
    loop {
        let lines = |pitch: f64| (ring as f64 * pitch_mm / pitch) as usize;
        let (along_x, along_y) = (lines(sensor.pitch_x_mm), lines(sensor.pitch_y_mm));
        let rows = row.saturating_sub(along_y)..row.saturating_add(along_y).saturating_add(1).min(sensor.rows);
        let cols = col.saturating_sub(along_x)..col.saturating_add(along_x).saturating_add(1).min(sensor.cols);
        let all = rows.len() * cols.len() == known.len();
        let inside = rows.flat_map(|r| cols.clone().map(move |c| r * sensor.cols + c));
        let mut near: Vec<usize> = inside.filter(|&t| known[t]).collect();
        if near.len() >= NEAREST || all {
            near.sort_by(|&s, &t| distance_mm(sensor, s, taxel).total_cmp(&distance_mm(sensor, t, taxel)));
            near.truncate(NEAREST);
            return near;
        }
        ring *= 2;
    }
}

fn distance_mm(sensor: &Sensor, s: usize, t: usize) -> f64 {
    let along = |a: usize, b: usize, pitch_mm: f64| a.abs_diff(b) as f64 * pitch_mm;
    let x = along(s % sensor.cols, t % sensor.cols, sensor.pitch_x_mm);
    x.hypot(along(s / sensor.cols, t / sensor.cols, sensor.pitch_y_mm))
}
