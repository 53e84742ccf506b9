//! Regions: the contacts under their envelopes, as the prior and the model take them.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: coefficients w | rank | N |
//! | out: pressure p = F w; load of each coefficient | cells; contacts, rank | N |

use faer::Mat;

use super::model::Design;

/// The contacts under their envelopes.
pub(super) struct Regions {
    /// Cells of each contact.
    pub cells: Vec<Vec<usize>>,
    /// F of each contact.
    pub factors: Vec<Mat<f64>>,
    pub design: Design,
    /// Whether a pressure has many more coefficients than the readings can tell, and was cut to as many.
    pub wide: bool,
}

impl Regions {
    /// p = F w on all `count` cells.
    pub fn pressure(&self, w: &[f64], count: usize) -> Vec<f64> {
        let (mut p, mut first) = (vec![0.0; count], 0);
        for (cells, factor) in self.cells.iter().zip(&self.factors) {
            for i in 0..factor.ncols() {
                let weight = w[first + i];
                cells.iter().zip(factor.col_as_slice(i)).for_each(|(&cell, share)| p[cell] += share * weight);
            }
            first += factor.ncols();
        }
        p
    }

    /// For each contact, the load of every coefficient.
    pub fn loads(&self) -> Vec<Vec<f64>> {
        let mut first = 0;
        let load = |factor: &Mat<f64>| {
            let mut own = vec![0.0; self.design.rank()];
            for i in 0..factor.ncols() {
                own[first + i] = factor.col(i).iter().sum();
            }
            first += factor.ncols();
            own
        };
        self.factors.iter().map(load).collect()
    }
}
