//! Symmetric: the pressure of a contact is assumed equal on opposite sides of its centre.
//!
//! There are two stages. The first is the shared search over μ. With q the Gaussian-smoothed p(μ) (width s) and x₀ its
//! peak, the score is made of the odd derivatives of third order, in units of s:
//!
//! ```text
//! Π = −‖[q_xxx, 1.7 q_xxy, 1.7 q_xyy, q_yyy]/q‖²  at x₀
//! ```
//!
//! p is given on cells; where the pitch exceeds the depth, their coarseness looks like shear (aliasing), so the best μ
//! is only a start. The second stage fits the stress itself: the pressure is an even polynomial e(u) times (1 − |u|²)^½
//! on an ellipse x = x₀ + L u,
//!
//! ```text
//! min over x₀, μ, L, e of ‖b − (μ1 Kx + μ2 Ky + Kz) e(u)(1 − |u|²)^½‖²
//! ```
//!
//! with x₀, μ and the symmetric L by Levenberg–Marquardt and the coefficients of e by linear least squares (variable
//! projection). A wide contact that neither of the two initial radii explains is fitted once more with more nodes, from
//! the radius that p₀ shows.
//!
//! | | shape | unit | range |
//! |---|---|---|---|
//! | in: b, p(μ) | n | MPa, N | finite |
//! | out: μ | 2 | – | |μ| ≤ mu_max |
//! | out: load | scalar | N | above 0 |

use super::disc::Disc;
use super::ellipse::WIDE_NODES;
use super::estimate::{MuEstimate, Objective, SearchInput};
use super::fit::{fit, misfit_limit, Fit, THOROUGH};
use super::symmetric_pressure::SymmetricPressure;
use super::taxels::Taxels;
use crate::estimate::float::search::search;
use crate::spec::scene::Medium;
use crate::spec::sensor::Sensor;
use nalgebra::DVector;

/// Width of the smoothing in units of the depth.
const WIDTH: f64 = 2.0;
/// Weight of the mixed derivatives: √3, that of a rotation-invariant norm of third order.
const MIXED: f64 = 1.732;
/// Newton steps to the peak of q.
const PEAK_STEPS: usize = 4;
/// Initial radii of the ellipse in units of the depth.
const SUPPORTS: [f64; 2] = [1.2, 2.4];
/// Rings and angles of the quadrature.
const NODES: [usize; 2] = [5, 14];

/// The objective `symmetric`.
#[derive(Clone, Debug)]
pub struct Symmetric {
    taxels: Taxels,
    disc: Disc,
    wide: Disc,
}

impl Symmetric {
    /// The objective for subarrays of the shape of `sensor` under `medium`.
    pub fn new(sensor: &Sensor, medium: Medium) -> Symmetric {
        let [disc, wide] = [NODES, WIDE_NODES].map(|[rings, angles]| Disc::new(rings, angles));
        Symmetric { taxels: Taxels::new(sensor, medium), disc, wide }
    }

    /// Derivatives of q at a position, in units of the width: order 0, two of order 1, three of order 2, four of order
    /// 3.
    fn derivatives(&self, p: &[f64], place: [f64; 2]) -> [f64; 10] {
        let width = WIDTH * self.taxels.depth;
        let mut out = [0.0; 10];
        for ((x, y), p) in self.taxels.x.iter().zip(&self.taxels.y).zip(p) {
            let (u, v) = ((place[0] - x) / width, (place[1] - y) / width);
            let q = p * (-0.5 * (u * u + v * v)).exp();
            // (−1)^n He_n, the derivatives of a Gaussian over it.
            let along = |u: f64| [1.0, -u, u * u - 1.0, 3.0 * u - u * u * u];
            let (a, b) = (along(u), along(v));
            let orders = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3)];
            for (out, (i, j)) in out.iter_mut().zip(orders) {
                *out += q * a[i] * b[j];
            }
        }
        out
    }

    /// The peak of q near the centroid of the compressive p, in mm.
    fn peak(&self, p: &[f64]) -> [f64; 2] {
        let width = WIDTH * self.taxels.depth;
        let largest = p.iter().copied().fold(0.0, f64::max);
        let strong = |p: f64| (p - 0.3 * largest).max(0.0);
        let weight: f64 = p.iter().map(|p| strong(*p)).sum();
        let mean = |at: &[f64]| at.iter().zip(p).map(|(at, p)| at * strong(*p)).sum::<f64>() / weight;
        let mut place = [mean(&self.taxels.x), mean(&self.taxels.y)];
        for _ in 0..PEAK_STEPS {
            let [_, x, y, xx, xy, yy, ..] = self.derivatives(p, place);
            let determinant = xx * yy - xy * xy;
            if !(xx < 0.0 && determinant > 0.0) {
                break;
            }
            // At most one width at a time.
            let step = [(xy * y - yy * x) / determinant, (xy * x - xx * y) / determinant];
            place = [place[0] + width * step[0].clamp(-1.0, 1.0), place[1] + width * step[1].clamp(-1.0, 1.0)];
        }
        place
    }

    /// The second stage, started from x₀ and μ; the best of the initial radii.
    fn refine(&self, input: &SearchInput, start: [f64; 4]) -> Option<Fit> {
        let b = DVector::from_column_slice(input.b);
        let limit = misfit_limit(input.b, input.noise_MPa);
        let (mut best, mut evaluations): (Option<Fit>, usize) = (None, 0);
        let narrow = SUPPORTS.map(|support| (support * self.taxels.depth, &self.disc));
        let wide = input.wide_radius_mm().map(|radius| (radius, &self.wide));
        for (index, (radius, disc)) in narrow.into_iter().chain(wide).enumerate() {
            if index >= narrow.len() && best.as_ref().is_some_and(|best| best.misfit <= limit) {
                break;
            }
            let mut model = SymmetricPressure::new(&self.taxels, disc, input.mu_max);
            let [x, y, mu_x, mu_y] = start;
            let theta = [x, y, radius, radius, 0.0, mu_x, mu_y];
            let Some(fit) = fit(&mut model, &b, &theta, THOROUGH) else { continue };
            evaluations += fit.evaluations;
            if best.as_ref().is_none_or(|best| fit.misfit < best.misfit) && model.load(&fit.loads) > 0.0 {
                best = Some(Fit { loads: DVector::from_element(1, model.load(&fit.loads)), ..fit });
            }
        }
        best.map(|best| Fit { evaluations, ..best })
    }
}

impl Objective for Symmetric {
    fn score(&self, p: &[f64]) -> Option<f64> {
        let sum: f64 = p.iter().sum();
        if !(sum > 0.0 && sum.is_finite()) {
            return None;
        }
        let [q, .., xxx, xxy, xyy, yyy] = self.derivatives(p, self.peak(p));
        let squares = [xxx, MIXED * xxy, MIXED * xyy, yyy].map(|odd| (odd / q).powi(2));
        Some(-squares.iter().sum::<f64>()).filter(|score| score.is_finite())
    }

    fn find(&self, input: &SearchInput) -> Option<MuEstimate> {
        let found = search(input.family, input.mu_max, &|p| self.score(p))?;
        let [x, y] = self.peak(&input.family.eval(found.mu));
        let Some(fit) = self.refine(input, [x, y, found.mu[0], found.mu[1]]) else {
            return Some(MuEstimate { found, load_N: None, sigma: None });
        };
        let load = fit.loads[0];
        let evaluations = found.evaluations + fit.evaluations;
        MuEstimate::of_force([fit.theta[5] * load, fit.theta[6] * load, load], input.mu_max, -fit.misfit, evaluations)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::frame::Frame;
    use crate::estimate::float::pass::Polynomial;
    use crate::physics::matrices::Matrices;
    use crate::spec::scene::Scene;

    fn sensor() -> Sensor {
        Scene::builtin("sensor-1").unwrap().sensor
    }

    /// The pressure on every cell as a function of its position in mm.
    fn pressure(value: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let sensor = sensor();
        let place = |k: usize| sensor.position_mm(k / sensor.cols, k % sensor.cols);
        (0..sensor.taxels()).map(|k| value(place(k)[0], place(k)[1])).collect()
    }

    #[test]
    fn derivatives_by_hand() {
        let sensor = Sensor { rows: 1, cols: 1, pitch_x_mm: 1.0, pitch_y_mm: 1.0, thickness_mm: 2.0 };
        // One force of 3 N at the origin, seen one width to the right: u = 1, v = 0.
        let width = WIDTH * sensor.thickness_mm;
        let seen = Symmetric::new(&sensor, Medium::HalfSpace).derivatives(&[3.0], [width, 0.0]);
        let q = 3.0 * (-0.5f64).exp();
        // q, q_x = −u q, q_y, q_xx = (u² − 1) q, q_xy, q_yy = (v² − 1) q,
        // q_xxx = (3u − u³) q, q_xxy, q_xyy = u q, q_yyy.
        let wanted = [1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 2.0, 0.0, 1.0, 0.0];
        for (seen, wanted) in seen.iter().zip(wanted) {
            assert!((seen - wanted * q).abs() < 1e-14, "{seen} {wanted}");
        }
    }

    #[test]
    fn symmetric_pressure_beats_uneven_pressure_at_any_scale() {
        let objective = Symmetric::new(&sensor(), Medium::HalfSpace);
        let bell = |x: f64, y: f64| (-(x * x + 2.0 * y * y) / 18.0).exp();
        let even = objective.score(&pressure(bell)).unwrap();
        assert!((-1e-20..=0.0).contains(&even), "{even}");
        let uneven = pressure(|x, y| bell(x, y) * (1.0 + (0.2 * x).tanh() + 0.5 * (0.3 * y).tanh()));
        let score = objective.score(&uneven).unwrap();
        assert!(score < -1e-4, "{score}");
        let tenfold: Vec<f64> = uneven.iter().map(|p| 10.0 * p).collect();
        assert!((objective.score(&tenfold).unwrap() / score - 1.0).abs() < 1e-9);
    }

    #[test]
    fn pulling_and_broken_pressure_has_no_score() {
        let objective = Symmetric::new(&sensor(), Medium::HalfSpace);
        for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(objective.score(&vec![value; sensor().taxels()]), None, "{value}");
        }
    }

    #[test]
    fn finds_the_shear_of_a_symmetric_contact_and_stays_within_mu_max() {
        let scene = Scene::builtin("sensor-1").unwrap();
        let frame = Frame::shipped(&scene).into_iter().find(|frame| frame.id == "S1-hs-hertz").unwrap();
        let [tx, ty, load] = frame.resultant_N.unwrap();
        let find = |mu_max: f64| {
            let matrices = Matrices::new(&scene.sensor, mu_max).unwrap();
            let family = Polynomial::new(&matrices, &frame.stress_MPa);
            let (sensor, b) = (&scene.sensor, frame.stress_MPa.as_slice());
            Symmetric::new(sensor, Medium::HalfSpace)
                .find(&SearchInput { sensor, b, family: &family, mu_max, noise_MPa: 0.0 })
                .unwrap()
        };
        let free = find(0.6);
        let (x, y) = (free.found.mu[0] - tx / load, free.found.mu[1] - ty / load);
        assert!(x.hypot(y) <= 0.02 * (tx / load).hypot(ty / load), "{free:?}");
        assert!((free.load_N.unwrap() / load - 1.0).abs() < 0.01, "{free:?}");
        // The evaluations of the fit are added to those of the search.
        assert!(free.found.evaluations > 85 && free.found.objective <= 0.0, "{free:?}");
        let held = find(0.05);
        assert!(held.found.mu[0].hypot(held.found.mu[1]) <= 0.05 * (1.0 + 1e-12), "{held:?}");
    }
}
