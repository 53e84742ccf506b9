//! Envelope: the expected size of the pressure on each cell, from the pressure found so far.
//!
//! q is the compressive part of p, smoothed by a Gaussian of 0.3 ℓ. Above a tenth of its peak the envelope is its square
//! root, so that a cell may carry several times what was found so far; below it is proportional, so that a tail fades
//! with the rounds. Cells below 1.4 σ^⅓ of the largest envelope are left out, σ the noise in units of the stress' peak: the
//! more noise, the less a weak cell is known to be loaded.
//!
//! The first q is the stress itself: readings above 2 σ, spread over the cells by a Gaussian of half a pitch. It is wider
//! than the contact, and later rounds narrow it.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: p, or b | cells, or taxels | N, or MPa |
//! | out: envelope | cells | N, 0 on cells left out |

use super::cells::Cells;
use crate::estimate::segment::{along_both_axes, gaussian};
use crate::spec::sensor::Sensor;

/// Smoothing of the pressure in units of ℓ.
const SMOOTHING: f64 = 0.3;
/// Fraction of the peak below which the envelope is proportional to the pressure.
const KNEE: f64 = 0.1;
/// Fraction of the largest envelope below which a cell is left out, over σ^⅓.
const LEAST: f64 = 1.4;
/// Range of that fraction.
const LEAST_RANGE: [f64; 2] = [0.03, 0.3];
/// Noise that is taken off every reading before the first round, in standard deviations.
const CUT: f64 = 2.0;
/// Spread of a reading over the cells in units of the pitch.
const SPREAD: f64 = 0.5;
/// Distance in taxels from which a reading does not reach a cell: five of its spreads.
const REACH: usize = 3;

/// The first estimate of the pressure: the readings `b` of the taxels `used`, less 2 `sigma`, in N per cell.
pub(super) fn from_stress(cells: &Cells, b: &[f64], used: &[bool], sigma: f64) -> Vec<f64> {
    let (sensor, grid) = (&cells.sensor, &cells.grid);
    let area = grid.pitch_x_mm * grid.pitch_y_mm;
    let near = |line: usize, lines: usize| line.saturating_sub(REACH)..(line + REACH + 1).min(lines);
    let reading = |cell: usize| {
        let ([x, y], own) = (cells.position_mm(cell), cells.taxel_of(cell));
        let (mut sum, mut weight) = (0.0, 0.0);
        for row in near(own / sensor.cols, sensor.rows) {
            for taxel in near(own % sensor.cols, sensor.cols).map(|col| row * sensor.cols + col) {
                let [u, v] = cells.taxel_mm(taxel);
                let away = [(x - u) / (SPREAD * sensor.pitch_x_mm), (y - v) / (SPREAD * sensor.pitch_y_mm)];
                let w = if used[taxel] { (-0.5 * (away[0] * away[0] + away[1] * away[1])).exp() } else { 0.0 };
                sum += w * (b[taxel] - CUT * sigma).max(0.0);
                weight += w;
            }
        }
        if weight > 0.0 {
            area * sum / weight
        } else {
            0.0
        }
    };
    (0..grid.taxels()).map(reading).collect()
}

/// The pressure under a Gaussian window of `sigma_mm`.
fn smoothed(grid: &Sensor, p: &[f64], sigma_mm: f64) -> Vec<f64> {
    let weights = [(grid.cols, grid.pitch_x_mm), (grid.rows, grid.pitch_y_mm)]
        .map(|(count, pitch)| gaussian(count, pitch, sigma_mm));
    let pressing: Vec<f64> = p.iter().map(|p| p.max(0.0)).collect();
    along_both_axes(grid, &pressing, |axis, at, value| {
        weights[axis][at].iter().enumerate().map(|(other, weight)| weight * value(other)).sum()
    })
}

/// The envelope of the pressure `p` in N per cell; `sigma` is the noise in units of the stress' peak.
pub(super) fn envelope(cells: &Cells, p: &[f64], length_mm: f64, sigma: f64) -> Vec<f64> {
    let least = (LEAST * sigma.cbrt()).clamp(LEAST_RANGE[0], LEAST_RANGE[1]);
    let q = smoothed(&cells.grid, p, SMOOTHING * length_mm);
    let peak = q.iter().copied().fold(0.0, f64::max);
    let shape = |q: &f64| {
        let share = q / peak;
        let e = if share > KNEE { share.sqrt() } else { share / KNEE.sqrt() };
        if e > least {
            peak * e
        } else {
            0.0
        }
    };
    if peak > 0.0 {
        q.iter().map(shape).collect()
    } else {
        vec![0.0; q.len()]
    }
}
