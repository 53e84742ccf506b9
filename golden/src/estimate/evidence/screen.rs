//! Screen: which reading its neighbours predict least, whatever the contact.
//!
//! Before any contact is known, forces of one size on all cells, one per taxel, a baseline and noise make the stress normal
//! with a covariance K that depends on the scene alone. Without reading t, its mean is b_t − e_t:
//!
//! ```text
//! K = a² Cz Czᵀ + S² B Bᵀ + σ² 1        e_t = (K⁻¹ b)_t / (K⁻¹)_tt        z_t = (K⁻¹ b)_t / √(K⁻¹)_tt
//! ```
//!
//! a is the force on a cell under the peak's pressure, S the largest baseline, σ 1e-3 of the peak. z only ranks the readings:
//! `suspect` tries those with the largest.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: b | taxels | of the peak |
//! | out: taxels | as many as there are | indices |

use super::baseline::LARGEST;
use crate::physics::influence::table;
use crate::physics::smooth::terms;
use crate::spec::scene::Medium;
use crate::spec::sensor::Sensor;
use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, Side};

/// Number of taxels above which nothing is screened.
const LARGEST_ARRAY: usize = 400;
/// σ in units of the peak.
const NOISE: f64 = 1e-3;
/// The screen of one scene.
pub(super) struct Screen {
    /// Taxels that are not dead.
    taxels: Vec<usize>,
    /// K⁻¹.
    inverse: Mat<f64>,
}

impl Screen {
    /// The screen of an array with the taxels `alive`; `None` of a large one.
    pub fn new(sensor: &Sensor, medium: Medium, alive: &[bool]) -> Option<Screen> {
        let taxels: Vec<usize> = (0..alive.len()).filter(|&t| alive[t]).collect();
        if alive.len() > LARGEST_ARRAY {
            return None;
        }
        let (influence, cols, area) = (table(sensor, medium), sensor.cols, sensor.pitch_x_mm * sensor.pitch_y_mm);
        let of = |t: usize, cell: usize| {
            let away = (t / cols).abs_diff(cell / cols) * cols + (t % cols).abs_diff(cell % cols);
            area * influence[away][2]
        };
        let stress = Mat::from_fn(taxels.len(), alive.len(), |k, cell| of(taxels[k], cell));
        let baseline: Vec<_> = taxels.iter().map(|&t| terms(sensor, t).map(|term| LARGEST * term)).collect();
        let mut covariance = &stress * stress.transpose();
        for i in 0..taxels.len() {
            for j in 0..taxels.len() {
                covariance[(i, j)] += baseline[i].iter().zip(&baseline[j]).map(|(a, b)| a * b).sum::<f64>();
            }
            covariance[(i, i)] += NOISE * NOISE;
        }
        let inverse = covariance.llt(Side::Lower).ok()?.inverse();
        Some(Screen { taxels, inverse })
    }

    /// The taxels in order, those first that their neighbours predict least.
    pub fn least_predicted(&self, b: &[f64]) -> Vec<usize> {
        let n = self.taxels.len();
        let mut weighted = vec![0.0; n];
        for (j, &taxel) in self.taxels.iter().enumerate() {
            let column = self.inverse.col_as_slice(j);
            weighted.iter_mut().zip(column).for_each(|(sum, entry)| *sum += entry * b[taxel]);
        }
        let size = |k: usize| weighted[k].abs() / self.inverse[(k, k)].sqrt();
        let mut all: Vec<(f64, usize)> = (0..n).map(|k| (size(k), self.taxels[k])).collect();
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        all.into_iter().map(|(_, taxel)| taxel).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::generator::draws::{DrawOptions, Draws};
    use crate::spec::scene::Scene;

    /// A taxel that is stuck anywhere, at any value far from its own, is the least predicted.
    #[test]
    fn finds_a_stuck_taxel() {
        let scene = Scene::builtin("sensor-1").unwrap();
        let screen = Screen::new(&scene.sensor, scene.medium, &[true; 100]).unwrap();
        let drawn = Draws::new(&scene, DrawOptions::default()).unwrap().frame(4).unwrap();
        let peak = drawn.peak_MPa();
        for taxel in [0, 7, 44, 55, 90] {
            let mut b: Vec<f64> = drawn.exact_MPa.iter().map(|b| b / peak).collect();
            b[taxel] += if b[taxel] > 0.5 { -0.6 } else { 0.6 };
            assert_eq!(screen.least_predicted(&b)[0], taxel);
        }
    }
}
