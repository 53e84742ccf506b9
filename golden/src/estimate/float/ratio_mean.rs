//! Mean of the ratio of shear to normal force of each contact over the frames so far.
//!
//! A contact that slides or rolls changes its place and pressure, and may keep its ratio μ. Place and pressure are therefore those of a
//! short window of frames, and μ is the linear estimate of least variance from the μ_w of the window and a running mean μ_m over f
//! frames, as far as the ratio has not changed meanwhile. With σ_w² of a window that has the noise of n equal frames:
//!
//! ```text
//! σ_m² = σ_w² (s + (1 − s) n / (n + f))                             s of the variance does not average out
//! g = σ_w² − σ_m²                                                   what the mean has less of noise, of each axis
//! δ_c² = max(0, (|μ_m − μ_w|² − c Σ g) / 2) + (μ_max (N_m / N_w − 1))²    what μ may have changed, of an axis
//! μ = μ_w + g / (g + δ_1²) (μ_m − μ_w)        σ² = σ_w² − g² / (g + δ_1²)
//! f ← min(f g / (g + δ_c²) + 1, F) with c = 5       μ_m ← μ_m + (μ_w − μ_m) / f       N_m ← likewise
//! ```
//! δ_1² is what is expected of a difference of independent errors. The mean forgets only a difference beyond what noise makes of one
//! frame in 150, since it would never grow long by the other. The second part of δ²: where the load changes by a share, the shear may
//! by as much.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: result of a window, with σ of μ; n | – | – |
//! | in, out: means, a contact each | – | – |
//! | out: change of the force of each contact | 3 each | N |

use crate::result::reconstruct::{ForceChange, FoundContact, Reconstruction};
use crate::spec::scene::Scene;

/// s: of the error of a contact that moves, the part that stays while it moves by less than a taxel.
const SYSTEMATIC: f64 = 0.25;
/// c: χ² of two numbers over its mean that noise exceeds in one frame of 150.
const FORGETS: f64 = 5.0;
/// F.
const MOST_FRAMES: f64 = 64.0;

/// The mean of a contact.
#[derive(Clone, Debug)]
pub(super) struct RatioMean {
    centre_mm: Option<[f64; 2]>,
    /// μ_m.
    mu: [f64; 2],
    /// N_m in N.
    normal_N: f64,
    /// f.
    frames: f64,
}

/// A contact of a window, with what is known of its ratio.
struct Windowed<'a> {
    contact: &'a FoundContact,
    /// σ_w².
    variance: [f64; 2],
    normal_N: f64,
    /// n.
    frames: f64,
    mu_max: f64,
}

/// Adds the contacts of a `result` whose window has the noise of `frames` equal frames to `means`, which are then those of its contacts
/// that press, where standard deviations are known. The changes of the forces of the contacts, in their order and with the `shares` of
/// each, with the ratios of the means before: 0 of a contact without one.
pub(super) fn follow(
    means: &mut Vec<RatioMean>,
    scene: &Scene,
    result: &Reconstruction,
    frames: f64,
    shares: &[Vec<f64>],
) -> Vec<ForceChange> {
    let before = std::mem::take(means);
    let contacts = result.all_contacts();
    let mut changes = Vec::new();
    for (contact, shares) in contacts.iter().zip(shares) {
        let window = Windowed::of(contact, frames, scene.search.mu_max);
        let away = |mean: &&RatioMean| away_mm(contact.centre_mm, mean.centre_mm);
        let nearest = before.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
        let (force_N, variance_N2) = match (nearest, &window) {
            (Some(mean), Some(window)) => mean.change(window),
            _ => Default::default(),
        };
        changes.push(ForceChange { force_N, variance_N2, shares: shares.clone() });
        means.extend(window.map(|own| nearest.map_or_else(|| RatioMean::first(&own), |mean| mean.after(&own))));
    }
    changes
}

/// Distance of two contacts in mm; 0 where no place is known.
fn away_mm(a: Option<[f64; 2]>, b: Option<[f64; 2]>) -> f64 {
    match (a, b) {
        (Some([x, y]), Some([u, v])) => (x - u).hypot(y - v),
        _ => 0.0,
    }
}

impl Windowed<'_> {
    /// `None` of a contact that does not press, or without a standard deviation.
    fn of(contact: &FoundContact, frames: f64, mu_max: f64) -> Option<Windowed<'_>> {
        let variance = contact.mu_sigma?.map(|sigma| sigma * sigma);
        let normal_N = contact.force_N[2];
        (normal_N > 0.0).then_some(Windowed { contact, variance, normal_N, frames, mu_max })
    }
}

impl RatioMean {
    /// The mean of one window.
    fn first(window: &Windowed) -> RatioMean {
        let FoundContact { centre_mm, mu, .. } = *window.contact;
        RatioMean { centre_mm, mu, normal_N: window.normal_N, frames: 1.0 }
    }

    /// μ_m − μ_w.
    fn apart(&self, window: &Windowed) -> [f64; 2] {
        [0, 1].map(|axis| self.mu[axis] - window.contact.mu[axis])
    }

    /// g of each axis.
    fn gained(&self, window: &Windowed) -> [f64; 2] {
        let share = (1.0 - SYSTEMATIC) * self.frames / (window.frames + self.frames);
        window.variance.map(|variance| share * variance)
    }

    /// δ_c².
    fn drift(&self, window: &Windowed, c: f64) -> f64 {
        let square = |values: [f64; 2]| values.iter().map(|value| value * value).sum::<f64>();
        let loaded = window.mu_max * (self.normal_N / window.normal_N - 1.0);
        let noise: f64 = self.gained(window).iter().sum();
        (0.5 * (square(self.apart(window)) - c * noise)).max(0.0) + loaded * loaded
    }

    /// The change of the force of a contact in N, and of its variance in N², with the ratio of the mean.
    fn change(&self, window: &Windowed) -> ([f64; 3], [f64; 3]) {
        let (apart, gained, drift) = (self.apart(window), self.gained(window), self.drift(window, 1.0));
        let (mut force_N, mut variance_N2) = ([0.0; 3], [0.0; 3]);
        for axis in (0..2).filter(|axis| gained[*axis] > 0.0) {
            let share = gained[axis] / (gained[axis] + drift);
            force_N[axis] = share * apart[axis] * window.normal_N;
            variance_N2[axis] = -share * gained[axis] * window.normal_N.powi(2);
        }
        (force_N, variance_N2)
    }

    /// The mean with one more window.
    fn after(&self, window: &Windowed) -> RatioMean {
        let gained = 0.5 * self.gained(window).iter().sum::<f64>();
        let drift = self.drift(window, FORGETS);
        let kept = if gained > 0.0 { gained / (gained + drift) } else { 0.0 };
        let frames = (self.frames * kept + 1.0).min(MOST_FRAMES);
        let apart = self.apart(window);
        RatioMean {
            centre_mm: window.contact.centre_mm,
            mu: [0, 1].map(|axis| self.mu[axis] - apart[axis] / frames),
            normal_N: self.normal_N + (window.normal_N - self.normal_N) / frames,
            frames,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contact(mu: [f64; 2], sigma: f64, normal_N: f64) -> FoundContact {
        let force_N = [mu[0] * normal_N, mu[1] * normal_N, normal_N];
        FoundContact { mu, mu_sigma: Some([sigma; 2]), force_N, ..FoundContact::default() }
    }

    fn mean(mu: [f64; 2], normal_N: f64, frames: f64) -> RatioMean {
        RatioMean { centre_mm: None, mu, normal_N, frames }
    }

    /// By hand, of 2 N and a window of 10 frames: g = 0.0016 · 0.75 · 30/40 = 0.0009.
    #[test]
    fn a_mean_counts_as_far_as_it_agrees() {
        let own = contact([0.3, 0.0], 0.04, 2.0);
        let window = Windowed::of(&own, 10.0, 0.6).unwrap();
        // Within the noise: μ and σ are those of the mean, which becomes longer.
        let agrees = mean([0.32, -0.01], 2.0, 30.0);
        let (force_N, variance_N2) = agrees.change(&window);
        assert!((force_N[0] - 0.04).abs() < 1e-12 && (force_N[1] + 0.02).abs() < 1e-12 && force_N[2] == 0.0);
        assert!((variance_N2[0] + 4.0 * 0.0009).abs() < 1e-12, "{variance_N2:?}");
        let after = agrees.after(&window);
        assert!((after.frames - 31.0).abs() < 1e-12 && (after.mu[0] - (0.32 - 0.02 / 31.0)).abs() < 1e-12);
        // δ_1² = 0.08 − 0.0009 of a μ that has turned, δ_5² = 0.08 − 0.0045.
        let turned = mean([-0.1, 0.0], 2.0, 30.0);
        let share = 0.0009 / 0.08;
        let (force_N, variance_N2) = turned.change(&window);
        assert!((force_N[0] + 0.8 * share).abs() < 1e-12 && (variance_N2[0] + 4.0 * share * 0.0009).abs() < 1e-12);
        let after = turned.after(&window);
        assert!((after.frames - (30.0 * 0.0009 / (0.0009 + 0.0755) + 1.0)).abs() < 1e-12, "{after:?}");
        // δ = 0.06 of a load that has grown from 1.8 N.
        let (force_N, _) = mean([0.32, 0.0], 1.8, 30.0).change(&window);
        assert!((force_N[0] - 0.04 * 0.0009 / (0.0009 + 0.0036)).abs() < 1e-12, "{force_N:?}");
    }

    /// A mean is no longer than [`MOST_FRAMES`]; a contact without a standard deviation, and one that does not press, have none.
    #[test]
    fn means_are_of_contacts_that_press() {
        let own = contact([0.3, 0.0], 0.04, 2.0);
        let window = Windowed::of(&own, 10.0, 0.6).unwrap();
        assert_eq!(mean([0.3, 0.0], 2.0, MOST_FRAMES).after(&window).frames, MOST_FRAMES);
        assert!(Windowed::of(&contact([0.3, 0.0], 0.04, 0.0), 10.0, 0.6).is_none());
        assert!(Windowed::of(&FoundContact { mu_sigma: None, ..own }, 10.0, 0.6).is_none());
        // Where σ is 0 the window is right.
        let exact = contact([0.3, 0.0], 0.0, 2.0);
        let exact = Windowed::of(&exact, 10.0, 0.6).unwrap();
        let other = mean([0.1, 0.0], 2.0, 30.0);
        assert_eq!(other.change(&exact), ([0.0; 3], [0.0; 3]));
        assert_eq!((other.after(&exact).mu, other.after(&exact).frames), ([0.3, 0.0], 1.0));
    }
}
