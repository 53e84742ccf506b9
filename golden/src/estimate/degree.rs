//! Degree: how many terms the series in μ needs.
//!
//! The remainder of degree d is of the order r^(d+1), which tells the convergence, not what it costs: force that the
//! remainder leaves beside the contact moves the maximum of the objective. The degree is therefore the smallest
//!
//! 1. with r^(d+1) ≤ 0.035, at least 3 where r > 0.2, and
//! 2. below 3, whose shear on drawn contacts is as good as that of degree 3:
//!
//! ```text
//! median e_t(d) ≤ max(1.5 · median e_t(3), median e_t(3) + 0.005)
//! ```
//!
//! Half as much again is less than degree 2 costs the sensors with r > 0.2, where the error doubles.
//!
//! Twelve contacts from fixed seeds, of all shapes of the generator, lie on 10 × 10 taxels with the pitch, thickness,
//! medium and inverse of the scene, their shear scaled to `mu_max`; the objective is `sparse`. The result depends on
//! nothing else, so that all subarrays of a sensor have the same degree, and is computed once per process: 20 ms, a second
//! on a bonded layer.
//!
//! | pitch, thickness in mm | r | rule 1 | e_t of degree 1, 2, 3 | degree |
//! |---|---:|---:|---|---:|
//! | 5 × 4, 2 | 0.17 | 1 | 16 %, 2.2 %, 1.2 % | 3 |
//! | 8 × 8, 0.91 (`sensor-4`) | 0.018 | 1 | 9.4 %, 8.8 %, 8.8 % | 1 |

use crate::data::frame::{Contact, Frame};
use crate::data::generator::slip::Slip;
use crate::data::generator::{generate, random_contacts, Draw, Shapes};
use crate::estimate::float::objective::{Objective, Sparse};
use crate::estimate::float::pass::Polynomial;
use crate::estimate::float::search::search;
use crate::physics::matrices::{Matrices, MatricesError, MAX_RADIUS};
use crate::spec::scene::MAX_DEGREE;
use crate::spec::scene::{Inversion, Medium, Scene};
use crate::spec::sensor::Sensor;
use std::collections::BTreeMap;
use std::sync::Mutex;

/// Largest remainder of the series, r^(d+1), by the first rule.
pub const SERIES_TOLERANCE: f64 = 0.035;
/// r above which the degree is at least 3.
pub const CUBIC_FROM: f64 = 0.2;
/// Largest share, and largest difference, by which the median error may exceed that of degree 3.
const EXCESS: [f64; 2] = [0.5, 0.005];
/// Taxels along each side of the array on which the contacts are drawn.
const SIDE: usize = 10;
/// Drawn contacts of each kind of shapes.
const DRAWS: u64 = 6;
/// μ_max for which the generator draws its ratios of shear to load.
const DRAWN_FOR: f64 = 0.6;

impl Matrices {
    /// Computes the matrices of a (sub)array on a half-space with the exact inverse, for shear ratios up to `mu_max` (0
    /// to 2); the degree is at most [`MAX_DEGREE`].
    ///
    /// ```
    /// use dermis_golden::{data::frame::Frame, physics::matrices::Matrices, spec::scene::Scene};
    ///
    /// let scene = Scene::builtin("eight-by-eight")?;
    /// let (matrices, b) = (Matrices::new(&scene.sensor, 0.6)?, Frame::shipped(&scene).remove(0).stress_MPa);
    /// let product = |m: &faer::Mat<f64>, v: &[f64]| -> Vec<f64> {
    ///     (0..64).map(|i| (0..64).map(|j| m[(i, j)] * v[j]).sum()).collect()
    /// };
    /// // The normal forces p = Cz⁺ b cause exactly the stress b.
    /// let p = product(&matrices.cz_pinv, &b);
    /// let stress = product(&matrices.cz, &p);
    /// let peak = b.iter().fold(0.0f64, |peak, b| b.abs().max(peak));
    /// assert!(stress.iter().zip(&b).all(|(s, b)| (s - b).abs() < 1e-13 * peak));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`MatricesError`]; the size is checked before anything is allocated.
    pub fn new(sensor: &Sensor, mu_max: f64) -> Result<Matrices, MatricesError> {
        Matrices::solved(sensor, Medium::HalfSpace, mu_max, Inversion::EXACT)?.with_degree(
            Medium::HalfSpace,
            mu_max,
            None,
            MAX_DEGREE,
        )
    }

    /// Computes the matrices of a subarray with the scene's medium, mu_max, inverse and degree; without `search.degree`
    /// the degree is at most `most`.
    ///
    /// # Errors
    /// As [`Matrices::new`].
    pub fn of(scene: &Scene, subarray: &Sensor, most: usize) -> Result<Matrices, MatricesError> {
        let search = &scene.search;
        Matrices::solved(subarray, scene.medium, search.mu_max, scene.inversion())?.with_degree(
            scene.medium,
            search.mu_max,
            search.degree,
            most,
        )
    }

    /// The matrices with the degree `set`, or the one that the series needs.
    fn with_degree(
        self,
        medium: Medium,
        mu_max: f64,
        set: Option<usize>,
        most: usize,
    ) -> Result<Matrices, MatricesError> {
        let radius = self.spectral_radius;
        let degree = match set {
            Some(degree) if radius < MAX_RADIUS => Some(if mu_max > 0.0 { degree } else { 0 }),
            _ => by_radius(radius, mu_max, most).map(|least| match least {
                1..MAX_DEGREE if least < most => by_effect(&self.sensor, medium, mu_max, self.inversion, least),
                _ => least,
            }),
        };
        match degree {
            Some(degree) => Ok(Matrices { degree, ..self }),
            None => Err(MatricesError::SlowSeries {
                sensor: Box::new(self.sensor),
                radius,
                mu_max,
                most,
                suggested: largest_mu_max(radius / mu_max, most),
            }),
        }
    }
}

/// The largest mu_max with three decimals for which degree `most` is enough; `per_mu` is r / mu_max.
fn largest_mu_max(per_mu: f64, most: usize) -> f64 {
    let radius = SERIES_TOLERANCE.powf(1.0 / (most as f64 + 1.0)).min(MAX_RADIUS);
    let mu_max = (1e3 * radius / per_mu).floor() / 1e3;
    // NaN or infinite rates allow no mu_max.
    if mu_max.is_finite() {
        mu_max
    } else {
        0.0
    }
}

/// The smallest degree with r^(d+1) ≤ 0.035, at least 3 where r > 0.2; `None` if it exceeds `most`.
fn by_radius(r: f64, mu_max: f64, most: usize) -> Option<usize> {
    if mu_max == 0.0 {
        return Some(0);
    }
    let least = if r > CUBIC_FROM { 3 } else { 1 };
    let enough = |d: &usize| r.powi(*d as i32 + 1) <= SERIES_TOLERANCE;
    (least..=most).find(enough).filter(|_| r < MAX_RADIUS)
}

/// The smallest degree from `least` on that finds the shear of the drawn contacts as well as degree 3 does; `least`
/// where the contacts cannot be drawn.
fn by_effect(sensor: &Sensor, medium: Medium, mu_max: f64, inversion: Inversion, least: usize) -> usize {
    static KNOWN: Mutex<BTreeMap<String, usize>> = Mutex::new(BTreeMap::new());
    let sensor = Sensor { rows: SIDE, cols: SIDE, ..sensor.clone() };
    // Debug prints the shortest text that reads back as the same number.
    let key = format!("{sensor:?} {medium:?} {mu_max:?} {inversion:?} {least}");
    let known = || KNOWN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some(&degree) = known().get(&key) {
        return degree;
    }
    let degree = Matrices::solved(&sensor, medium, mu_max, inversion).map_or(least, |matrices| {
        let frames = drawn(&sensor, medium, mu_max);
        let best = median_error(&matrices, &frames, mu_max, MAX_DEGREE);
        let limit = (best * (1.0 + EXCESS[0])).max(best + EXCESS[1]);
        let enough = |&d: &usize| median_error(&matrices, &frames, mu_max, d) <= limit;
        (least..MAX_DEGREE).find(enough).unwrap_or(MAX_DEGREE)
    });
    known().insert(key, degree);
    degree
}

/// Frames with one contact each.
fn drawn(sensor: &Sensor, medium: Medium, mu_max: f64) -> Vec<Frame> {
    let draws =
        [Shapes::Elliptic, Shapes::Other].into_iter().flat_map(|shapes| (0..DRAWS).map(move |seed| (shapes, seed)));
    let frame = |(shapes, seed)| {
        let contacts: Vec<Contact> =
            random_contacts(sensor, Draw { count: 1, shapes, slip: Slip::Full, touching: false, seed })
                .into_iter()
                .map(|contact| Contact {
                    tangential_N: contact.tangential_N.map(|shear| shear.map(|t| t * mu_max / DRAWN_FOR)),
                    friction: contact.friction.map(|friction| friction * mu_max / DRAWN_FOR),
                    ..contact
                })
                .collect();
        generate("degree", sensor, medium, &contacts).ok()
    };
    draws.filter_map(frame).collect()
}

/// Median error of the shear, as a share of it, with a series of degree `d`; a frame without a result counts as 1.
fn median_error(matrices: &Matrices, frames: &[Frame], mu_max: f64, d: usize) -> f64 {
    let error = |frame: &Frame| {
        let family = Polynomial::of_degree(matrices, &frame.stress_MPa, d);
        let found = search(&family, mu_max, &|p| Sparse::default().score(p))?;
        let normal: f64 = family.eval(found.mu).iter().sum();
        let [x, y, _] = frame.resultant_N?;
        Some((found.mu[0] * normal - x).hypot(found.mu[1] * normal - y) / x.hypot(y))
    };
    let mut errors: Vec<f64> = frames.iter().map(|frame| error(frame).unwrap_or(1.0)).collect();
    errors.sort_by(f64::total_cmp);
    errors.get(errors.len() / 2).copied().unwrap_or(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_radius_alone_at_its_edges() {
        let most = crate::spec::scene::MAX_FLOAT_DEGREE;
        assert_eq!(by_radius(0.5, 0.0, MAX_DEGREE), Some(0));
        assert_eq!(by_radius(0.0, 0.6, MAX_DEGREE), Some(1));
        assert_eq!(by_radius(0.187, 0.6, MAX_DEGREE), Some(1));
        assert_eq!(by_radius(0.19, 0.6, MAX_DEGREE), Some(2));
        assert_eq!(by_radius(0.201, 0.6, MAX_DEGREE), Some(3));
        assert_eq!(by_radius(0.43, 0.6, MAX_DEGREE), Some(3));
        assert_eq!(by_radius(0.44, 0.6, MAX_DEGREE), None);
        assert_eq!(by_radius(0.44, 0.6, most), Some(4));
        assert_eq!(by_radius(0.7, 0.6, most), None);
        assert_eq!(by_radius(f64::NAN, 0.6, MAX_DEGREE), None);
    }

    fn errors(scene: &Scene) -> Vec<f64> {
        let sensor = Sensor { rows: SIDE, cols: SIDE, ..scene.sensor.clone() };
        let (medium, mu_max) = (scene.medium, scene.search.mu_max);
        let matrices = Matrices::solved(&sensor, medium, mu_max, scene.inversion()).unwrap();
        let frames = drawn(&sensor, medium, mu_max);
        assert_eq!(frames.len(), 2 * DRAWS as usize);
        (1..=MAX_DEGREE).map(|d| median_error(&matrices, &frames, mu_max, d)).collect()
    }

    /// The radius alone took degree 1 here.
    #[test]
    fn a_pitch_of_two_thicknesses_needs_degree_three() {
        let sensor = Sensor { rows: 10, cols: 8, pitch_x_mm: 5.0, pitch_y_mm: 4.0, thickness_mm: 2.0 };
        let scene = Scene::of_sensor(&sensor, "thin");
        let errors = errors(&scene);
        assert!(errors[0] > 0.1 && errors[1] > 1.5 * errors[2] && errors[2] < 0.015, "{errors:?}");
        let matrices = Matrices::of(&scene, &sensor, MAX_DEGREE).unwrap();
        assert_eq!(by_radius(matrices.spectral_radius, 0.6, MAX_DEGREE), Some(1));
        assert_eq!(matrices.degree, 3);
    }

    #[test]
    fn the_scene_has_the_last_word() {
        let mut scene = Scene::builtin("eight-by-eight").unwrap();
        let degree = |scene: &Scene| Matrices::of(scene, &scene.sensor, MAX_DEGREE).unwrap().degree;
        assert_eq!(degree(&scene), 3);
        scene.search.degree = Some(2);
        assert_eq!(degree(&scene), 2);
        scene.search.mu_max = 0.0;
        assert_eq!(degree(&scene), 0);
    }

    #[test]
    fn sensor_4_keeps_degree_one() {
        let scene = Scene::builtin("sensor-4").unwrap();
        let errors = errors(&scene);
        assert!((1.0..1.2).contains(&(errors[0] / errors[2])), "{errors:?}");
        assert_eq!(by_effect(&scene.sensor, scene.medium, scene.search.mu_max, scene.inversion(), 1), 1);
    }
}
