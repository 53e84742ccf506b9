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

/// The contacts of a result; `None` without any, and where no standard deviation of μ is known.
pub(super) fn contacts(result: &Reconstruction) -> Option<Vec<FoundContact>> {
    let contacts = result.all_contacts();
    (!contacts.is_empty() && contacts.iter().all(|contact| contact.mu_sigma.is_some())).then_some(contacts)
}

/// The changes of the contacts of `window` with the ratios of the contacts of `longer` that are nearest; `None` where either has none of
/// which the standard deviations are known, or nothing presses.
pub(super) fn changes(scene: &Scene, window: &Reconstruction, longer: &Reconstruction) -> Option<Vec<ForceChange>> {
    let (of_window, of_longer) = (contacts(window)?, contacts(longer)?);
    let change = |(contact, shares): (&FoundContact, Vec<f64>)| {
        let away = |other: &FoundContact| away_mm(contact, other);
        let nearest = of_longer.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
        let (force_N, variance_N2) = nearest.map_or_else(Default::default, |l| change(contact, l, scene.search.mu_max));
        ForceChange { force_N, variance_N2, shares }
    };
    Some(of_window.iter().zip(shares(&scene.sensor, window)?).map(change).collect())
}

/// Distance of two contacts in mm; 0 where no place is known.
fn away_mm(a: &FoundContact, b: &FoundContact) -> f64 {
    match (a.centre_mm, b.centre_mm) {
        (Some([x, y]), Some([u, v])) => (x - u).hypot(y - v),
        _ => 0.0,
    }
}

/// The change of the force of a contact in N, and of its variance in N², with the ratio of a longer mean; none of one that does not press.
fn change(window: &FoundContact, longer: &FoundContact, mu_max: f64) -> ([f64; 3], [f64; 3]) {
    let (normal_N, mut force_N, mut variance_N2) = (window.force_N[2], [0.0; 3], [0.0; 3]);
    let (Some(sigma), Some(longer_sigma), true) = (window.mu_sigma, longer.mu_sigma, normal_N > 0.0) else {
        return (force_N, variance_N2);
    };
    let apart = [0, 1].map(|axis| longer.mu[axis] - window.mu[axis]);
    let gained = [0, 1].map(|axis| (sigma[axis].powi(2) - longer_sigma[axis].powi(2)).max(0.0));
    let loaded = mu_max * (longer.force_N[2] / normal_N - 1.0);
    let drift = (0.5 * (apart[0].powi(2) + apart[1].powi(2) - gained[0] - gained[1])).max(0.0) + loaded * loaded;
    for axis in (0..2).filter(|axis| gained[*axis] > 0.0) {
        let share = gained[axis] / (gained[axis] + drift);
        force_N[axis] = share * apart[axis] * normal_N;
        variance_N2[axis] = -share * gained[axis] * normal_N.powi(2);
    }
    (force_N, variance_N2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ratio(mu: [f64; 2], sigma: f64, normal_N: f64) -> FoundContact {
        let force_N = [mu[0] * normal_N, mu[1] * normal_N, normal_N];
        FoundContact { mu, mu_sigma: Some([sigma; 2]), force_N, ..FoundContact::default() }
    }

    /// By hand, of 2 N.
    #[test]
    fn a_longer_mean_counts_as_far_as_it_agrees() {
        let window = ratio([0.3, 0.0], 0.05, 2.0);
        let change = |longer: &FoundContact| super::change(&window, longer, 0.6);
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
        assert_eq!(super::change(&lifted, &ratio([0.3, 0.0], 0.02, 0.0), 0.6), ([0.0; 3], [0.0; 3]));
    }
}
