//! Fields: the stress that a press may have, from what it reads.
//!
//! Pressure and shear are random fields under an envelope, with the smooth shapes of the prior of [`crate::estimate::evidence`]:
//! p = F w. The shear along each axis is such a field too, independent of the pressure and a share of it in size; so the covariance
//! of the readings needs no search of μ:
//!
//! ```text
//! S = [Gz F | s Gx F | s Gy F]        s = 0.3 mu_max
//! Σ = σ² 1 + B (0.002)² Bᵀ            B offset, slopes and bends over the array
//! ```
//!
//! The envelope follows from the readings: the mean pressure under the last one, in turn. It has the gains in it, as ripples. So the
//! prior's free load is left out, which is a pressure in the very shape of the envelope: with it a pressure explains most of what
//! the gains do, and 300 presses find a third of them.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: press, log gains | taxels | of the peak, – |
//! | out: S, Σ | taxels × coefficients, taxels² | of the peak |

use super::likelihood::{product, Modelled, Rest};
use super::presses::Press;
use crate::estimate::evidence::prior::remainder;
use crate::estimate::evidence::Evidence;
use crate::physics::smooth::{terms, TERMS};
use crate::spec::scene::Scene;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par, Scale};

/// Standard deviation of a reading for the envelope, of the peak.
const ENVELOPE_SIGMA: f64 = 0.01;
/// Size of a shear field over that of the pressure, in units of mu_max.
const SHEAR: f64 = 0.3;
/// Size of each term of the baseline, of the peak.
const BASELINE: f64 = 0.002;
/// Size of the shapes over that of the prior: on drawn presses the gains come out best.
const SHAPES: f64 = 0.75;
/// Times that a pressure gives the envelope of the next one.
const ROUNDS: usize = 4;

/// What makes models of presses of one scene.
pub(super) struct Fields {
    evidence: Evidence,
    shear: f64,
}

/// A pressure's fields on some taxels.
struct Under {
    /// Cells under the envelope.
    cells: Vec<usize>,
    /// F.
    factor: Mat<f64>,
    /// S.
    s: Mat<f64>,
}

impl Fields {
    /// Tables of the scene's cells.
    pub fn new(scene: &Scene) -> Fields {
        Fields { evidence: Evidence::new(scene), shear: SHEAR * scene.search.mu_max }
    }

    /// Whether the influence of every cell is a finite number.
    pub fn is_representable(&self) -> bool {
        self.evidence.is_representable()
    }

    /// The model of a press, whose envelope is that of the readings over the gains exp `theta`, which are uncertain by `spread`;
    /// `sigma` is what pressure and shear leave of a reading, of the peak.
    pub fn model(&self, press: &Press, theta: &[f64], spread: f64, sigma: f64) -> Modelled {
        let Evidence { cells, envelopes, .. } = &self.evidence;
        let mut corrected = vec![0.0; theta.len()];
        let mut counts = vec![false; theta.len()];
        for (&taxel, y) in press.taxels.iter().zip(&press.y) {
            corrected[taxel] = y / theta[taxel].exp();
            counts[taxel] = true;
        }
        let mut p = envelopes.first_pressure(&cells.sensor, &corrected, &counts, ENVELOPE_SIGMA);
        let window = self.evidence.window(&p, ENVELOPE_SIGMA);
        let taxels: Vec<usize> = window.into_iter().filter(|&taxel| counts[taxel]).collect();
        let y: Vec<f64> = taxels.iter().map(|&taxel| corrected[taxel]).collect();
        let offsets = cells.offsets(&taxels);
        for _ in 0..ROUNDS {
            let under = self.under(&p, &offsets);
            let sigma = y.iter().map(|y| ENVELOPE_SIGMA.hypot(spread * y)).collect();
            let covariance = product(under.s.as_ref(), under.s.transpose());
            let Some(factor) = self.rest(&taxels, sigma).and(&covariance) else { break };
            let mut alpha = y.clone();
            factor.solve(&mut alpha);
            // The mean of w is Sᵀ C⁻¹ y, of which the first columns are those of the pressure.
            let rank = under.factor.ncols();
            let w: Vec<f64> =
                (0..rank).map(|k| under.s.col(k).iter().zip(&alpha).map(|(s, alpha)| s * alpha).sum()).collect();
            p.fill(0.0);
            for (row, &cell) in under.cells.iter().enumerate() {
                p[cell] = (0..rank).map(|k| under.factor[(row, k)] * w[k]).sum();
            }
        }
        let s = self.under(&p, &offsets).s;
        let read = |taxel: &usize| press.y[press.taxels.partition_point(|own| own < taxel)];
        Modelled {
            y: taxels.iter().map(read).collect(),
            s,
            rest: self.rest(&taxels, vec![sigma; taxels.len()]),
            taxels,
        }
    }

    /// The fields under the envelope of the pressure `p`.
    fn under(&self, p: &[f64], offsets: &[usize]) -> Under {
        let envelope = self.evidence.envelopes.of(p.iter().copied(), ENVELOPE_SIGMA);
        let cells: Vec<usize> = (0..envelope.len()).filter(|&cell| envelope[cell] > 0.0).collect();
        let own: Vec<f64> = cells.iter().map(|&cell| envelope[cell]).collect();
        let n = offsets.len();
        let (all, _) = self.evidence.shape.factor(&cells, &own, remainder(ENVELOPE_SIGMA), n);
        // The first column is the load.
        let factor = Scale(SHAPES) * all.subcols(1, all.ncols() - 1);
        let mut influence = Mat::zeros(3 * n, cells.len());
        for (column, &cell) in cells.iter().enumerate() {
            self.evidence.cells.influence(offsets, cell, influence.col_as_slice_mut(column));
        }
        let rank = factor.ncols();
        let mut s = Mat::zeros(n, 3 * rank);
        for (axis, size) in [1.0, self.shear, self.shear].into_iter().enumerate() {
            let columns = s.subcols_mut(axis * rank, rank);
            matmul(columns, Accum::Replace, influence.subrows(axis * n, n), &factor, size, Par::Seq);
        }
        Under { cells, factor, s }
    }

    /// Σ, with the standard deviation of each reading.
    fn rest(&self, taxels: &[usize], sigma: Vec<f64>) -> Rest {
        let of: Vec<[f64; TERMS]> = taxels.iter().map(|&taxel| terms(&self.evidence.cells.sensor, taxel)).collect();
        Rest { sigma, baseline: Mat::from_fn(taxels.len(), TERMS, |i, k| BASELINE * of[i][k]) }
    }
}
