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
use crate::estimate::segment::gaussian;
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
/// Weight of a cell in the smoothing below which it is left out.
const NONE: f64 = 1e-12;

/// Weights of neighbouring cells, from the first one on.
struct Band {
    first: usize,
    weights: Vec<f64>,
}

/// What makes envelopes on the cells of an array.
pub(in crate::estimate) struct Envelopes {
    grid: Sensor,
    /// Weights of the smoothing for each column and each row of cells.
    smoothing: [Vec<Band>; 2],
    /// Weights of the 2 [`REACH`] + 1 nearest taxels for each column and each row of cells within a taxel.
    spreads: [Vec<Vec<f64>>; 2],
}

impl Envelopes {
    /// Envelopes of pressures that are smooth over `length_mm`.
    pub fn new(cells: &Cells, length_mm: f64) -> Envelopes {
        let grid = cells.grid.clone();
        let smoothing = [(grid.cols, grid.pitch_x_mm), (grid.rows, grid.pitch_y_mm)].map(|(count, pitch)| {
            gaussian(count, pitch, SMOOTHING * length_mm).iter().map(|all| Band::new(all)).collect()
        });
        let spreads = [grid.cols / cells.sensor.cols, grid.rows / cells.sensor.rows].map(|per_taxel| {
            let weight = |within: usize, other: usize| {
                let cell = (within as f64 + 0.5) / per_taxel as f64 - 0.5;
                (-0.5 * ((cell - other as f64 + REACH as f64) / SPREAD).powi(2)).exp()
            };
            (0..per_taxel).map(|within| (0..=2 * REACH).map(|other| weight(within, other)).collect()).collect()
        });
        Envelopes { grid, smoothing, spreads }
    }

    /// The first estimate of the pressure: the readings `b` of the taxels `used`, less 2 `sigma`, in N per cell.
    pub fn first_pressure(&self, sensor: &Sensor, b: &[f64], used: &[bool], sigma: f64) -> Vec<f64> {
        let (grid, [along_x, along_y]) = (&self.grid, &self.spreads);
        let area = grid.pitch_x_mm * grid.pitch_y_mm;
        let near = |line: usize, lines: usize| line.saturating_sub(REACH)..(line + REACH + 1).min(lines);
        let reading = |cell: usize| {
            let (row, col) = (cell / grid.cols, cell % grid.cols);
            let (x, y) = (&along_x[col % along_x.len()], &along_y[row % along_y.len()]);
            let (own_row, own_col) = (row / along_y.len(), col / along_x.len());
            let (mut sum, mut weight) = (0.0, 0.0);
            for row in near(own_row, sensor.rows) {
                for col in near(own_col, sensor.cols) {
                    let taxel = row * sensor.cols + col;
                    if used[taxel] {
                        let w = y[row + REACH - own_row] * x[col + REACH - own_col];
                        sum += w * (b[taxel] - CUT * sigma).max(0.0);
                        weight += w;
                    }
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

    /// The compressive part of a pressure, smoothed.
    fn smoothed(&self, p: impl Iterator<Item = f64>) -> Vec<f64> {
        let (cols, [along_x, along_y]) = (self.grid.cols, &self.smoothing);
        let pressing: Vec<f64> = p.map(|p| p.max(0.0)).collect();
        let in_row = |k: usize| {
            let Band { first, weights } = &along_x[k % cols];
            let own = &pressing[k - k % cols + first..];
            weights.iter().zip(own).map(|(weight, p)| weight * p).sum()
        };
        let rows: Vec<f64> = (0..pressing.len()).map(in_row).collect();
        let mut smoothed = vec![0.0; pressing.len()];
        for (Band { first, weights }, into) in along_y.iter().zip(smoothed.chunks_exact_mut(cols)) {
            for (weight, row) in weights.iter().zip(rows.chunks_exact(cols).skip(*first)) {
                into.iter_mut().zip(row).for_each(|(sum, p)| *sum += weight * p);
            }
        }
        smoothed
    }

    /// The envelope of the pressure `p` in N per cell; `sigma` is the noise in units of the stress' peak.
    pub fn of(&self, p: impl Iterator<Item = f64>, sigma: f64) -> Vec<f64> {
        let least = (LEAST * sigma.cbrt()).clamp(LEAST_RANGE[0], LEAST_RANGE[1]);
        let mut q = self.smoothed(p);
        let peak = q.iter().copied().fold(0.0, f64::max);
        let shape = |q: f64| {
            let share = q / peak;
            let e = if share > KNEE { share.sqrt() } else { share / KNEE.sqrt() };
            if e > least {
                peak * e
            } else {
                0.0
            }
        };
        q.iter_mut().for_each(|q| *q = if peak > 0.0 { shape(*q) } else { 0.0 });
        q
    }
}

impl Band {
    /// The weights that count.
    fn new(all: &[f64]) -> Band {
        let counts = |weight: &f64| *weight > NONE;
        let first = all.iter().position(counts).unwrap_or(0);
        let weights = all[first..].iter().copied().take_while(|weight| counts(weight)).collect();
        Band { first, weights }
    }
}
