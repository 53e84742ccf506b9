//! The regions of a fit: the contacts under the envelopes of its last pressure.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: pressure and contact of each cell | cells | N, – |
//! | out: cells of each contact, F, S | – | –, N, MPa |

use super::Fit;
use crate::estimate::evidence::model::Design;
use crate::estimate::evidence::prior::remainder;
use crate::estimate::evidence::regions::Regions;
use crate::estimate::evidence::slip::spread;
use crate::physics::smooth::{terms, TERMS};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};

/// Largest variance of a pressure, in units of its own, that may be left out because there are more coefficients than
/// readings: with more the shear counts as not known. On drawn contacts of up to 0.7 of a 6 × 6 or 8 × 8 array, which leave up to
/// 0.09, the errors are those of smaller ones.
const WIDE: f64 = 0.1;
/// Coefficients of a contact beside which larger ones take none.
const LEAST_RANK: usize = 8;

impl Fit<'_> {
    /// The contacts under envelopes of the last pressure, of which at least the variance `least` may be left out.
    pub(super) fn regions(&self, least: f64) -> Regions {
        let mut of_contact = Vec::new();
        for contact in 0..self.now.mu.len() {
            let pressure = |(p, label): (&f64, &usize)| if *label == contact { *p } else { 0.0 };
            let e = self.scene.envelopes.of(self.now.p.iter().zip(&self.now.labels).map(pressure), self.now.sigma);
            let cells: Vec<usize> =
                (0..e.len()).filter(|&cell| e[cell] > 0.0 && self.now.labels[cell] == contact).collect();
            let envelope: Vec<f64> = cells.iter().map(|&cell| e[cell]).collect();
            of_contact.push((cells, envelope));
        }
        let remainder = remainder(self.now.sigma).max(least);
        let loaded: usize = of_contact.iter().map(|(cells, _)| cells.len()).sum();
        let of = |(cells, envelope): &(Vec<usize>, Vec<f64>)| {
            let most = (self.taxels.len() * cells.len() / loaded.max(1)).max(LEAST_RANK);
            let (factor, rest) = self.scene.shape.factor(cells, envelope, remainder, most);
            (rest > WIDE, factor)
        };
        let (cut, factors): (Vec<bool>, Vec<Mat<f64>>) = of_contact.iter().map(of).unzip();
        let of_contact: Vec<Vec<usize>> = of_contact.into_iter().map(|(cells, _)| cells).collect();
        let design = self.design(&of_contact, &factors);
        Regions { cells: of_contact, factors, design, wide: cut.contains(&true) }
    }

    /// S: the stress of every column of every factor, for normal force and shear along x and y, and of the baseline.
    fn design(&self, cells: &[Vec<usize>], factors: &[Mat<f64>]) -> Design {
        let n = self.taxels.len();
        let rank = TERMS + factors.iter().map(Mat::ncols).sum::<usize>();
        let (mut s, mut of_spread) = (Mat::zeros(3 * n, rank), Mat::zeros(2 * n, rank));
        let mut contact = Vec::with_capacity(rank);
        for (k, (own, factor)) in cells.iter().zip(factors).enumerate() {
            let mut influence = Mat::zeros(3 * n, own.len());
            for (column, &cell) in own.iter().enumerate() {
                self.scene.cells.influence(&self.offsets, cell, influence.col_as_slice_mut(column));
            }
            let columns = s.subcols_mut(contact.len(), factor.ncols());
            matmul(columns, Accum::Replace, &influence, factor, 1.0, Par::Seq);
            let uneven = spread(&self.scene.cells, own, self.centre_mm(own), factor);
            let columns = of_spread.subcols_mut(contact.len(), factor.ncols());
            matmul(columns, Accum::Replace, influence.subrows(n, 2 * n), &uneven, 1.0, Par::Seq);
            contact.extend(vec![k; factor.ncols()]);
        }
        contact.extend([0; TERMS]);
        let mut design = Design { s, contact, baseline: TERMS, spread: of_spread };
        self.baseline(&mut design);
        self.now.spread.iter().enumerate().for_each(|(k, spread)| design.add_spread(k, *spread));
        design
    }

    /// The columns B S of the baseline.
    pub(super) fn baseline(&self, design: &mut Design) {
        for (column, term) in design.of_baseline().zip(0..) {
            let of = |taxel: usize| self.now.sizes.of(term) * terms(&self.scene.cells.sensor, taxel)[term];
            self.taxels.iter().enumerate().for_each(|(k, &taxel)| design.s[(k, column)] = of(taxel));
        }
    }
}
