//! Outcome: what the last round of a fit says of its frame.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: posterior of the last round | – | – |
//! | out: [`EvidenceEstimate`], and what it leaves of the readings | – | N per MPa of the peak |

use super::{Fit, Fitted, Found, Predicted, FLOOR};
use crate::data::frame::Forces;
use crate::estimate::evidence::ascent::Top;
use crate::estimate::evidence::contact::forces;
use crate::estimate::evidence::estimate::EvidenceEstimate;
use crate::estimate::evidence::regions::Regions;
use crate::estimate::evidence::residual::Residual;
use crate::result::reconstruct::ContactEstimate;
use std::f64::consts::FRAC_1_SQRT_2;

impl Fit<'_> {
    /// Centre of pressure of the cells of a contact in mm from the array's centre.
    pub(super) fn centre_mm(&self, own: &[usize]) -> [f64; 2] {
        let pressed: f64 = own.iter().map(|&cell| self.now.p[cell].max(0.0)).sum();
        let mut moment = [0.0; 2];
        for &cell in own {
            let place = self.scene.cells.position_mm(cell);
            (0..2).for_each(|axis| moment[axis] += self.now.p[cell].max(0.0) / pressed * place[axis]);
        }
        moment
    }

    /// The result of the last round.
    pub(super) fn estimate(self, found: &Found) -> Option<Fitted> {
        let Found { regions, top, covariance } = found;
        let cells = &self.scene.cells;
        let forces = forces((&regions.design, &self.readings), top, covariance, &regions.loads());
        let mut on_taxels = Forces::zeros(self.b.len());
        let mut contacts = Vec::with_capacity(forces.len());
        for (k, (own, force)) in regions.cells.iter().zip(forces).enumerate() {
            let pressed: f64 = own.iter().map(|&cell| self.now.p[cell].max(0.0)).sum();
            if pressed == 0.0 {
                return None;
            }
            for &cell in own {
                // Contacts do not pull: the pressures below zero go to the others.
                let share = self.now.p[cell].max(0.0) / pressed;
                let taxel = cells.taxel_of(cell);
                let [fx, fy, fz] = force.force_N.map(|force| share * force);
                on_taxels.fx[taxel] += fx;
                on_taxels.fy[taxel] += fy;
                on_taxels.fz[taxel] += fz;
            }
            let contact = ContactEstimate {
                centre_mm: self.centre_mm(own),
                mu: top.mu[k],
                force_N: force.force_N,
                sigma_N: force.sigma_N,
                mu_covariance: force.mu_covariance,
            };
            contacts.push(contact);
        }
        let known = self.taxels.len() - self.clipped.len() - self.missing.len();
        let misfit_probability = self.stated.then(|| chi_square_tail(top.posterior.square, known as f64));
        let (noise_MPa, rank) = (self.now.sigma, regions.design.rank());
        let estimate = EvidenceEstimate {
            contacts,
            forces_N: on_taxels,
            noise_MPa,
            misfit_probability,
            rounds: self.round,
            rank,
            work: self.work,
            ..EvidenceEstimate::default()
        };
        Some(self.fitted(estimate, regions, top))
    }

    /// The estimate with what it leaves of the readings.
    fn fitted(mut self, estimate: EvidenceEstimate, regions: &Regions, top: &Top) -> Fitted {
        let design = &regions.design;
        let stress = top.posterior.stress(&self.readings);
        let sensor = &self.scene.cells.sensor;
        let residual = Residual::new(&self.readings, |k| self.counts(k), &stress);
        let least = if self.stated { 1.0 } else { FLOOR / self.now.sigma };
        let baseline = top.posterior.stress_of(|i| design.of_baseline().contains(&i));
        let counted: Vec<usize> = (0..self.taxels.len()).filter(|&k| self.counts(k)).collect();
        let load = counted.iter().map(|&k| self.b[self.taxels[k]] - baseline[k]).sum::<f64>();
        let square = counted.iter().map(|&k| baseline[k].powi(2)).sum::<f64>() / (counted.len().max(1) as f64);
        let worst = residual.worst(least).map(|(k, size)| (self.taxels[k], size));
        let predicted = |&k: &usize| {
            let (taxel, [mean, variance]) = (self.taxels[k], stress[k]);
            let (noise, gain) = (self.noise(taxel), self.scene.gain_spread * mean);
            Predicted { taxel, mean, variance: variance + noise * noise + gain * gain }
        };
        let predicted = self.missing.iter().map(predicted).collect();
        let correlation = residual.correlation(sensor, &self.taxels);
        let found = self.now.clone();
        self.segment();
        Fitted {
            worst,
            found,
            parts: self.now.mu.len(),
            predicted,
            evidence: top.posterior.value,
            wide: regions.wide,
            load: load * sensor.pitch_x_mm * sensor.pitch_y_mm,
            estimate: EvidenceEstimate {
                baseline_MPa: square.sqrt(),
                outlier: worst.map(|(_, size)| size),
                residual_correlation: Some(correlation),
                ..estimate
            },
        }
    }
}

/// Probability that χ² with `freedom` degrees of freedom exceeds `value` (Wilson and Hilferty 1931).
fn chi_square_tail(value: f64, freedom: f64) -> f64 {
    let spread = 2.0 / (9.0 * freedom);
    let z = ((value / freedom).cbrt() - (1.0 - spread)) / spread.sqrt();
    0.5 * libm::erfc(z * FRAC_1_SQRT_2)
}

#[cfg(test)]
mod tests {
    use super::chi_square_tail;

    /// Tabulated quantiles of χ².
    #[test]
    fn tails_by_table() {
        for (freedom, value, tail) in [(10.0, 18.307, 0.05), (100.0, 135.807, 0.01), (100.0, 99.334, 0.5)] {
            assert!((chi_square_tail(value, freedom) / tail - 1.0).abs() < 0.02, "{freedom} {value}");
        }
    }
}
