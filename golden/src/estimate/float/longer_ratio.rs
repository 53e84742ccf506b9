//! Ratio of shear to normal force of contacts that move, from a longer mean.
//!
//! Stress is linear in the forces, so that the mean over a contact that slides or rolls is the stress of a longer contact with the same
//! ratio μ. Where a contact moves, its place and pressure are therefore those of a short window w, and its μ that of a longer mean l,
//! as far as it has not changed meanwhile:
//!
//! ```text
//! g = σ_w² − σ_l²                                                  what the longer mean has less of noise, of each axis
//! δ² = max(0, (|μ_l − μ_w|² − Σ g) / 2) + (μ_max (N_l / N_w − 1))²   what μ may have changed, of an axis
//! μ = μ_w + g / (g + δ²) (μ_l − μ_w)        σ² = σ_w² − g² / (g + δ²)
//! ```
//! μ is the linear estimate of least variance, since the error of a short mean is that of the longer one and an independent rest. The
//! second part of δ²: where the load changes by a share, the shear may by as much.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: results of window and longer mean, with σ of μ | – | – |
//! | out: change of the force of each contact of the window | 3 each | N |

use super::template::shares;
use crate::result::reconstruct::{ForceChange, FoundContact, Reconstruction};
use crate::spec::scene::Scene;

/// Ratio of shear to normal force of a contact.
struct Ratio {
    mu: [f64; 2],
    /// Variance of each component.
    variance: [f64; 2],
    normal_N: f64,
    centre_mm: Option<[f64; 2]>,
}

/// The changes of the contacts of `window` with the ratios of the contacts of `longer` that are nearest; `None` where no standard
/// deviations are known or nothing presses.
pub(super) fn changes(scene: &Scene, window: &Reconstruction, longer: &Reconstruction) -> Option<Vec<ForceChange>> {
    let (contacts, others) = (ratios(window)?, ratios(longer)?);
    let change = |(contact, shares): (&Ratio, Vec<f64>)| {
        let nearest = others.iter().min_by(|a, b| contact.away_mm(a).total_cmp(&contact.away_mm(b)));
        let (force_N, variance_N2) = nearest.map_or_else(Default::default, |l| contact.change(l, scene.search.mu_max));
        ForceChange { force_N, variance_N2, shares }
    };
    Some(contacts.iter().zip(shares(&scene.sensor, window)?).map(change).collect())
}

/// The ratios of the contacts of a result, or of the array as one subarray.
fn ratios(result: &Reconstruction) -> Option<Vec<Ratio>> {
    match (result.contacts(), result.subarrays.as_slice()) {
        (Some(contacts), _) => contacts.iter().map(Ratio::of).collect(),
        (None, [whole]) => {
            let variance = whole.mu_sigma?.map(|sigma| sigma * sigma);
            Some(vec![Ratio { mu: whole.mu, variance, normal_N: result.resultant_N[2], centre_mm: None }])
        }
        _ => None,
    }
}

impl Ratio {
    fn of(contact: &FoundContact) -> Option<Ratio> {
        let variance = contact.mu_sigma?.map(|sigma| sigma * sigma);
        Some(Ratio { mu: contact.mu, variance, normal_N: contact.force_N[2], centre_mm: contact.centre_mm })
    }

    /// Distance from another contact in mm; 0 where no place is known.
    fn away_mm(&self, other: &Ratio) -> f64 {
        match (self.centre_mm, other.centre_mm) {
            (Some([x, y]), Some([u, v])) => (x - u).hypot(y - v),
            _ => 0.0,
        }
    }

    /// The change of the force in N, and of its variance in N², with the ratio of a longer mean; none of a contact that does not press.
    fn change(&self, longer: &Ratio, mu_max: f64) -> ([f64; 3], [f64; 3]) {
        if self.normal_N <= 0.0 {
            return Default::default();
        }
        let apart = [0, 1].map(|axis| longer.mu[axis] - self.mu[axis]);
        let gained = [0, 1].map(|axis| (self.variance[axis] - longer.variance[axis]).max(0.0));
        let loaded = mu_max * (longer.normal_N / self.normal_N - 1.0);
        let drift = (0.5 * (apart[0].powi(2) + apart[1].powi(2) - gained[0] - gained[1])).max(0.0) + loaded * loaded;
        let (mut force_N, mut variance_N2) = ([0.0; 3], [0.0; 3]);
        for axis in (0..2).filter(|axis| gained[*axis] > 0.0) {
            let share = gained[axis] / (gained[axis] + drift);
            force_N[axis] = share * apart[axis] * self.normal_N;
            variance_N2[axis] = -share * gained[axis] * self.normal_N.powi(2);
        }
        (force_N, variance_N2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ratio(mu: [f64; 2], sigma: f64, normal_N: f64) -> Ratio {
        Ratio { mu, variance: [sigma * sigma; 2], normal_N, centre_mm: None }
    }

    /// By hand, of 2 N.
    #[test]
    fn a_longer_mean_counts_as_far_as_it_agrees() {
        let window = ratio([0.3, 0.0], 0.05, 2.0);
        let change = |longer: &Ratio| window.change(longer, 0.6);
        // Within the noise: μ and σ are those of the longer mean.
        let (force_N, variance_N2) = change(&ratio([0.32, -0.01], 0.02, 2.0));
        assert!((force_N[0] - 0.04).abs() < 1e-12 && (force_N[1] + 0.02).abs() < 1e-12 && force_N[2] == 0.0);
        assert!((variance_N2[0] - 4.0 * (0.0004 - 0.0025)).abs() < 1e-12, "{variance_N2:?}");
        // g = 0.0021, δ² = 0.08 − 0.0021 of a μ that has turned.
        let (force_N, variance_N2) = change(&ratio([-0.1, 0.0], 0.02, 2.0));
        let share = 0.0021 / 0.08;
        assert!((force_N[0] + 0.8 * share).abs() < 1e-12 && (variance_N2[0] + 4.0 * share * 0.0021).abs() < 1e-12);
        // δ = 0.06 of a load that has grown from 1.8 N.
        let (force_N, _) = change(&ratio([0.32, 0.0], 0.02, 1.8));
        assert!((force_N[0] - 0.04 * 0.0021 / (0.0021 + 0.0036)).abs() < 1e-12, "{force_N:?}");
        // No less noise, no change.
        assert_eq!(change(&ratio([0.32, 0.0], 0.05, 2.0)), ([0.0; 3], [0.0; 3]));
        let lifted = ratio([0.0; 2], 0.05, 0.0);
        assert_eq!(lifted.change(&ratio([0.3, 0.0], 0.02, 0.0), 0.6), ([0.0; 3], [0.0; 3]));
    }
}
