//! Misfit: how far a frame is from those on which a network was trained.
//!
//! A network answers any frame. Contacts press, and μ is theirs: what no compressive forces with the network's μ cause, no
//! frame of the training had, but for noise, gains, and cells as large as the taxels.
//!
//! ```text
//! r = b − (Cz + μ1 Cx + μ2 Cy) p,   p ≥ 0 with the smallest |r|
//! misfit = |r| / √(n σ² + (0.1 |b|)²) / limit                               above 1: unlike the training
//! ```
//!
//! σ is the noise as the scene states it, at most, and where none is stated, the largest of the training, 2 % of max |b|. A
//! reading of 0 on a unipolar array counts if p presses there. With the true σ the misfit of drawn frames hardly depends on
//! the noise. The limit is measured after the training ([`crate::study::noise::misfit_limit`]) and stands in the network's file;
//! without one there is no check.
//!
//! What contacts can cause is not found: an offset of all taxels looks like a contact larger than the array, a thicker
//! cover like a larger contact.
//!
//! p is that of [`STEPS`] steps of the accelerated projected gradient (Beck and Teboulle 2009, FISTA), in units of max |b|
//! and in single precision: the same for the golden model and for what hardware sent, whose μ differ by its LSB.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: calibrated stress, noise | taxels, scalar | MPa |
//! | in: μ of each taxel, from a result | taxels × 2 | – |
//! | out: misfit over its limit | scalar | – |

#[cfg(test)]
mod tests;

use crate::data::frame::Frame;
use crate::estimate::learned::{Learned, LearnedError, NOISE};
use crate::physics::influence::{at_distance, table};
use crate::result::reconstruct::Reconstruction;
use crate::spec::scene::{EstimatorKind, Scene};
use crate::spec::sensor::Sensor;
use faer::linalg::matmul::matmul;
use faer::{Accum, Col, Mat, Par};

/// Steps of the projected gradient; with three times as many, the limit of sensor-1's network changes by 1 %.
pub const STEPS: usize = 20;
/// Share of |b| that forces on cells as large as the taxels leave, and gains that differ.
const CELLS: f64 = 0.1;

/// The check for one scene.
#[derive(Clone, Debug)]
pub struct Misfit {
    sensor: Sensor,
    /// Stress per force on a cell, along x, y and z: for each distance in rows, as [`table`] has it, and each distance in columns of
    /// either sign, so that the taxels of a row lie beside each other.
    influence: [Vec<f32>; 3],
    alive: Vec<bool>,
    unipolar: bool,
    limit: f64,
}

impl Misfit {
    /// The check of the network that alone gives μ to this estimator of a scene; `None` without one, or where its file has no
    /// limit.
    ///
    /// # Errors
    /// As [`Learned::misfit_limit`].
    pub fn of_scene(scene: &Scene, estimator: EstimatorKind) -> Result<Option<Misfit>, LearnedError> {
        if !estimator.mu_of_network() {
            return Ok(None);
        }
        Ok(Learned::misfit_limit(scene)?.map(|limit| Misfit::new(scene, limit)))
    }

    /// The check with this limit.
    pub(crate) fn new(scene: &Scene, limit: f64) -> Misfit {
        let sensor = scene.sensor.clone();
        let (influence, reach) = (table(&sensor, scene.medium), sensor.cols as isize - 1);
        let distances = || (0..sensor.rows as isize).flat_map(|down| (-reach..=reach).map(move |right| [down, right]));
        let along = |axis: usize| distances().map(|at| at_distance(&influence, sensor.cols, at)[axis] as f32).collect();
        let influence = [0, 1, 2].map(along);
        Misfit { alive: scene.input.alive(&sensor), sensor, influence, unipolar: scene.input.unipolar, limit }
    }

    /// The misfit of the calibrated `frame` of a result, over its limit; `noise_MPa` is the stated standard deviation of a
    /// taxel, 0 if none is. `None` where the condition of the scene is not met, so that the network was not asked.
    pub fn of(&self, result: &Reconstruction, frame: &Frame, noise_MPa: f64) -> Option<f64> {
        self.of_stress(&frame.stress_MPa, &self.mu_of_taxels(result)?, noise_MPa)
    }

    /// The μ of each taxel, that of its contact, of the nearest one, or of the array; `None` if the network was not asked.
    fn mu_of_taxels(&self, result: &Reconstruction) -> Option<Vec<[f64; 2]>> {
        let n = self.sensor.taxels();
        let whole = result.subarrays.iter().find(|own| own.centroid_condition)?;
        // Of records of contacts, whose taxels are only counted, and of contacts that share their taxels.
        let nearest = |all: Vec<([f64; 2], [f64; 2])>| -> Option<Vec<[f64; 2]>> {
            let of_taxel = |taxel: usize| {
                let [x, y] = self.sensor.position_mm(taxel / self.sensor.cols, taxel % self.sensor.cols);
                let off = |[u, v]: [f64; 2]| (x - u).hypot(y - v);
                all.iter().min_by(|a, b| off(a.0).total_cmp(&off(b.0))).map(|own| own.1)
            };
            (0..n).map(of_taxel).collect()
        };
        if let Some(regions) = &result.extra.regions {
            if regions.iter().any(|region| region.taxel_count > region.taxels.len()) {
                return nearest(regions.iter().filter_map(|region| Some((region.centre_mm?, region.mu))).collect());
            }
            let mut mu = vec![[0.0; 2]; n];
            let own = regions.iter().flat_map(|region| region.taxels.iter().map(|&taxel| (taxel, region.mu)));
            own.for_each(|(taxel, own)| mu[taxel] = own);
            return Some(mu);
        }
        if let Some(contacts) = result.extra.contacts.as_ref().filter(|contacts| !contacts.is_empty()) {
            return nearest(contacts.iter().map(|contact| (contact.centre_mm, contact.mu)).collect());
        }
        // 0 where no forces press.
        Some(vec![whole.mu; n])
    }

    /// The misfit of stress `b` in MPa for the μ of each taxel.
    fn of_stress(&self, b: &[f64], mu: &[[f64; 2]], noise_MPa: f64) -> Option<f64> {
        let read = |t: usize| match self.alive[t] {
            true if self.unipolar => b[t].max(0.0),
            true => b[t],
            false => 0.0,
        };
        let n = b.len();
        let peak = (0..n).map(|t| read(t).abs()).fold(0.0, f64::max);
        if !(peak > 0.0 && peak.is_finite()) {
            return None;
        }
        let scaled = Col::from_fn(n, |t| (read(t) / peak) as f32);
        let left = f64::from(self.left(&scaled, &self.of_cells(mu)));
        let largest = NOISE[1];
        let sigma = if noise_MPa > 0.0 { (noise_MPa / peak).min(largest) } else { largest };
        let live = self.alive.iter().filter(|alive| **alive).count() as f64;
        Some(left / (live.sqrt() * sigma).hypot(CELLS * f64::from(scaled.norm_l2())) / self.limit)
    }

    /// Cz + μ1 Cx + μ2 Cy, with the μ of each cell.
    fn of_cells(&self, mu: &[[f64; 2]]) -> Mat<f32> {
        let Sensor { rows, cols, .. } = self.sensor;
        let mut all = Mat::zeros(mu.len(), mu.len());
        for (cell, mu) in mu.iter().enumerate() {
            let ([s, d], [u, v]) = ([cell / cols, cell % cols], mu.map(|mu| mu as f32));
            for (r, row) in (0..rows).zip(all.col_as_slice_mut(cell).chunks_mut(cols)) {
                // Odd along its own axis.
                let v = if r < s { -v } else { v };
                let begin = r.abs_diff(s) * (2 * cols - 1) + cols - 1 - d;
                let [x, y, z] = self.influence.each_ref().map(|own| &own[begin..begin + cols]);
                for (c, taxel) in row.iter_mut().enumerate() {
                    *taxel = z[c] + u * x[c] + v * y[c];
                }
            }
        }
        all
    }

    /// |r| of stress `b` for forces p ≥ 0 on cells that cause `of_cells`.
    fn left(&self, b: &Col<f32>, of_cells: &Mat<f32>) -> f32 {
        let n = b.nrows();
        let rest = |p: &Col<f32>, into: &mut Col<f32>| {
            matmul(into.as_mut(), Accum::Replace, of_cells, p, 1.0, Par::Seq);
            for t in 0..n {
                into[t] = match self.alive[t] {
                    false => 0.0,
                    // Tension reads as 0.
                    true if self.unipolar && b[t] <= 0.0 => (-into[t]).min(0.0),
                    true => b[t] - into[t],
                };
            }
        };
        // The norm of a matrix is at most the root of its largest sums along rows and along columns.
        let (mut rows, mut largest) = (vec![0.0f32; n], 0.0f32);
        for column in of_cells.col_iter() {
            let mut sum = 0.0;
            column.iter().zip(&mut rows).for_each(|(c, row)| {
                *row += c.abs();
                sum += c.abs();
            });
            largest = largest.max(sum);
        }
        let step = 1.0 / (largest * rows.into_iter().fold(0.0, f32::max));
        let (mut p, mut ahead) = (Col::<f32>::zeros(n), Col::<f32>::zeros(n));
        let (mut left, mut slope, mut inertia) = (Col::<f32>::zeros(n), Col::<f32>::zeros(n), 1.0f32);
        for _ in 0..STEPS {
            rest(&ahead, &mut left);
            matmul(slope.as_mut(), Accum::Replace, of_cells.transpose(), &left, 1.0, Par::Seq);
            let next = (1.0 + (1.0 + 4.0 * inertia * inertia).sqrt()) / 2.0;
            let share = (inertia - 1.0) / next;
            inertia = next;
            for cell in 0..n {
                let moved = (ahead[cell] + step * slope[cell]).max(0.0);
                ahead[cell] = moved + share * (moved - p[cell]);
                p[cell] = moved;
            }
        }
        rest(&p, &mut left);
        left.norm_l2()
    }
}
