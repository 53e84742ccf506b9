//! Features: what a network sees of the stress in its window, in parities.
//!
//! | channels | content |
//! |---|---|
//! | Q | b/s, s the power of two above max \|b\| |
//! | 2Q | p_λ = c_λ V σ/(σ² + λ²σ_max²) Uᵀ b/s, Cz = U σ Vᵀ, for λ = 0.15 and 0.04 |
//! | Q | 1 on taxels that are dead or beyond the array, else 0 |
//!
//! A channel is a quad: a number for each of the four mirror images, here transformed to the four parities. Dividing by a
//! power of two is a shift, and b/s has its largest entry between a half and one. c_λ makes the deconvolved stress of a
//! force on the middle cell as large as the stress.
//!
//! The noise is no input: the network reads it off the stress.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: b, mask of each frame | n × frames | MPa |
//! | out: inputs of each parity | 4Q × frames | – |

use super::error::LearnedError;
use super::network::{exchanged, Parities};
use crate::physics::influence::Influence;
use crate::physics::symmetry::parity::{has_entry, sign};
use crate::spec::quads::Quads;
use crate::spec::scene::Medium;
use crate::spec::sensor::Sensor;
use crate::spec::window::Window;
use faer::linalg::matmul::matmul;
use faer::{Accum, Col, Mat, Par};

/// λ of the deconvolutions.
const LEVELS: [f64; 2] = [0.15, 0.04];
/// Factor of b/s and its deconvolutions, whose entries are then about 1.
pub(super) const AMPLITUDE: f32 = 4.0;

/// The deconvolutions of a window.
pub(super) struct Features {
    quads: Quads,
    /// The taxel of each quad, of each image.
    taxels: [Vec<usize>; 4],
    /// c_λ p_λ of each parity for all λ, stacked: (Q · levels) × Q.
    pub(super) inverse: Parities,
}

/// Frames of one window.
pub(super) struct Readings {
    /// Stress, n × frames; 0 on masked taxels.
    pub b: Mat<f32>,
    /// 1 on taxels that are dead or beyond the array, n × frames.
    pub masked: Mat<f32>,
}

impl Features {
    /// Number of channels for a window.
    pub fn channels(window: &Window) -> usize {
        (2 + LEVELS.len()) * window.quads().len()
    }

    /// The deconvolutions for a window of the array `sensor`.
    ///
    /// # Errors
    /// [`LearnedError::NotConverged`] if Cz has no singular value decomposition.
    pub fn new(window: &Window, sensor: &Sensor, medium: Medium) -> Result<Features, LearnedError> {
        let (sensor, quads) = (&window.sensor(sensor), window.quads());
        let cz = Influence::through(sensor, medium).cz;
        let svd = cz.thin_svd().map_err(|_| LearnedError::NotConverged { sensor: sensor.to_string() })?;
        let n = sensor.taxels();
        let values: Vec<f64> = svd.S().column_vector().iter().copied().collect();
        let largest = values.iter().copied().fold(0.0, f64::max);
        let middle = cz.col(quads.taxel(quads.len() - 1, 0));
        let own = LEVELS.map(|level| {
            let gain = |s: f64| s / (s * s + (level * largest).powi(2));
            let inverse =
                Mat::from_fn(n, n, |row, value| svd.V()[(row, value)] * gain(values[value])) * svd.U().transpose();
            let deconvolved: Col<f64> = &inverse * middle;
            inverse * faer::Scale(middle.norm_l2() / deconvolved.norm_l2())
        });
        // The images of a quad's taxel that are distinct, each with its sign.
        let entry = |parity: usize, level: usize, row: usize, col: usize| -> f64 {
            let images = (0..Quads::LANES).filter(|lane| quads.lane_mask(col) >> lane & 1 == 1);
            let one = |lane| sign(parity, lane) * own[level][(quads.taxel(row, 0), quads.taxel(col, lane))];
            if has_entry(quads, row, parity) {
                images.map(one).sum()
            } else {
                0.0
            }
        };
        let q = quads.len();
        let inverse = std::array::from_fn(|parity| {
            Mat::from_fn(LEVELS.len() * q, q, |row, col| entry(parity, row / q, row % q, col) as f32)
        });
        let taxels = std::array::from_fn(|lane| (0..q).map(|quad| quads.taxel(quad, lane)).collect());
        Ok(Features { quads, taxels, inverse })
    }

    /// The inputs of each frame.
    pub fn of(&self, readings: &Readings) -> Parities {
        let (q, frames, deconvolved) = (self.quads.len(), readings.b.ncols(), LEVELS.len() * self.quads.len());
        let scales: Vec<f32> = readings.b.col_iter().map(|b| AMPLITUDE / power_above(b.norm_max())).collect();
        let stress = self.in_parities(&readings.b, &|frame| scales[frame]);
        let mask = self.in_parities(&readings.masked, &|_| 1.0);
        std::array::from_fn(|parity| {
            let mut inputs = Mat::<f32>::zeros(2 * q + deconvolved, frames);
            inputs.subrows_mut(0, q).copy_from(&stress[parity]);
            let (wide, inverse) = (inputs.subrows_mut(q, deconvolved), &self.inverse[parity]);
            matmul(wide, Accum::Replace, inverse, &stress[parity], 1.0, Par::Seq);
            inputs.subrows_mut(q + deconvolved, q).copy_from(&mask[parity]);
            inputs
        })
    }

    /// The parities of values of taxels, n × frames, times the factor of each frame.
    pub(super) fn in_parities(&self, values: &Mat<f32>, factor: &dyn Fn(usize) -> f32) -> Parities {
        let (q, frames) = (self.quads.len(), values.ncols());
        let mut images: Parities = std::array::from_fn(|_| Mat::zeros(q, frames));
        for frame in 0..frames {
            let (values, factor) = (values.col_as_slice(frame), factor(frame));
            for (image, taxels) in images.iter_mut().zip(&self.taxels) {
                let image = image.col_as_slice_mut(frame);
                image.iter_mut().zip(taxels).for_each(|(image, &taxel)| *image = factor * values[taxel]);
            }
        }
        exchanged(images)
    }
}

/// The power of two s with `peak`/s from a half up to, not including, one; 1 for no peak.
pub(super) fn power_above(peak: f32) -> f32 {
    if peak > 0.0 && peak.is_finite() {
        // Exact; a rounded logarithm takes a peak just below a power of two for the power.
        libm::ldexpf(1.0, libm::frexpf(peak).1)
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::scene::Scene;

    /// From a half up to, not including, one, also just below and at a power of two, as small or large as readings may be.
    #[test]
    fn a_peak_over_its_power_is_at_least_a_half_and_below_one() {
        for exponent in -100..100 {
            let power = 2f32.powi(exponent);
            for (peak, above) in [(power.next_down(), power), (power, 2.0 * power), (1.4 * power, 2.0 * power)] {
                assert_eq!(power_above(peak), above, "{peak}");
            }
        }
        assert_eq!([0.0, f32::INFINITY, f32::NAN].map(power_above), [1.0; 3]);
    }

    /// The inputs do not depend on the load but for a factor below two, and the sharper deconvolution finds a force on one
    /// cell again.
    #[test]
    fn a_force_on_one_cell_is_found_at_any_load() {
        let scene = Scene::builtin("sensor-1").unwrap();
        let window = Window::of(&scene.sensor);
        let features = Features::new(&window, &scene.sensor, scene.medium).unwrap();
        let cz = Influence::through(&scene.sensor, scene.medium).cz;
        let readings = |load: f64| Readings {
            b: Mat::from_fn(100, 1, |t, _| (load * cz[(t, 44)]) as f32),
            masked: Mat::from_fn(100, 1, |t, _| if t == 3 { 1.0 } else { 0.0 }),
        };
        let images = |load: f64| exchanged(features.of(&readings(load)));
        let (light, heavy, other) = (images(0.125), images(16.0), images(12.0));
        assert_eq!(light[0].nrows(), 100);
        for lane in 0..4 {
            assert!((0..100).all(|k| (light[lane][(k, 0)] - heavy[lane][(k, 0)]).abs() < 1e-4));
            let ratio = light[lane][(0, 0)] / other[lane][(0, 0)];
            assert!((0..75).all(|k| (light[lane][(k, 0)] - ratio * other[lane][(k, 0)]).abs() < 1e-4));
            assert!((0.5..=2.0).contains(&ratio));
        }
        let quads = window.quads();
        let sharp = |taxel: usize| {
            let at = quads.locate(taxel / 10, taxel % 10);
            light[at.lane][(50 + at.address, 0)]
        };
        assert!((0..100).all(|k| sharp(k) <= sharp(44)));
        let masked = (0..4).flat_map(|lane| (75..100).map(move |k| (lane, k)));
        let at = quads.locate(0, 3);
        let wanted = vec![(at.lane, 75 + at.address)];
        assert_eq!(masked.filter(|&(lane, k)| light[lane][(k, 0)].abs() > 1e-6).collect::<Vec<_>>(), wanted);
    }

    /// The deconvolution in parities is that of the taxels, also where a middle line is its own image.
    #[test]
    fn deconvolutions_in_parities_and_in_taxels_agree() {
        let sensor = Sensor { rows: 5, cols: 4, pitch_x_mm: 2.0, pitch_y_mm: 2.0, thickness_mm: 3.0 };
        let window = Window::of(&sensor);
        let features = Features::new(&window, &sensor, Medium::HalfSpace).unwrap();
        let of = |taxel: usize| {
            let b = Mat::from_fn(20, 1, |t, _| if t == taxel { 0.75f32 } else { 0.0 });
            exchanged(features.of(&Readings { b, masked: Mat::zeros(20, 1) }))
        };
        // Cz is symmetric, and so is every function of it: the answer at one taxel to stress at another.
        let quads = window.quads();
        let answer = |from: usize, to: usize, level: usize| {
            let at = quads.locate(to / 4, to % 4);
            of(from)[at.lane][((1 + level) * quads.len() + at.address, 0)]
        };
        for (from, to) in [(0, 19), (8, 3), (9, 10), (11, 8)] {
            for level in 0..LEVELS.len() {
                let (there, back) = (answer(from, to, level), answer(to, from, level));
                assert!(there.abs() > 1e-4 && (there - back).abs() < 1e-4 * there.abs().max(1.0), "{there} {back}");
            }
        }
    }
}
