//! Contact: an elliptic Hertz contact in full sliding, and the stress it causes.
//!
//! p ∝ (1 − r²)^½ on an ellipse, shear = μ p; b by quadrature with 24 × 64 nodes, several times finer than any
//! estimator's.
//!
//! | drawn | range |
//! |---|---|
//! | radii | h to 2 h, independently |
//! | angle | 0 … π |
//! | centre | at least the longer radius inside the outermost taxels |
//! | shear over load | 0.1 … 0.5, any direction |

use dermis_golden::estimate::float::objective::disc::Disc;
use dermis_golden::estimate::float::objective::ellipse::Ellipse;
use dermis_golden::estimate::float::objective::taxels::Taxels;
use dermis_golden::random::Random;
use dermis_golden::spec::scene::Medium;
use dermis_golden::spec::sensor::Sensor;
use std::f64::consts::{PI, TAU};

/// Rings and angles of the quadrature.
const NODES: [usize; 2] = [24, 64];
/// Exponent of a Hertz pressure.
const HERTZ: f64 = 0.5;

/// One contact with a normal load of 1 N.
#[derive(Clone, Debug, PartialEq)]
pub struct HertzContact {
    /// Centre in mm from the array's centre.
    pub centre_mm: [f64; 2],
    /// Semi-axes in mm.
    pub radii_mm: [f64; 2],
    /// Angle of the first axis from x towards y in radians.
    pub angle: f64,
    /// Ratio of shear to normal load, [x, y].
    pub mu: [f64; 2],
}

impl HertzContact {
    /// A random contact that lies inside the array.
    pub(super) fn draw(sensor: &Sensor, random: &mut Random) -> HertzContact {
        let h = sensor.thickness_mm;
        let radii_mm = [random.between(h, 2.0 * h), random.between(h, 2.0 * h)];
        let angle = random.between(0.0, PI);
        let longer = radii_mm[0].max(radii_mm[1]);
        let mut within = |lines: usize, pitch: f64| {
            let room = (0.5 * (lines - 1) as f64 * pitch - longer).max(0.0);
            random.between(-room, room)
        };
        let centre_mm = [within(sensor.cols, sensor.pitch_x_mm), within(sensor.rows, sensor.pitch_y_mm)];
        let (ratio, direction) = (random.between(0.1, 0.5), random.between(0.0, TAU));
        HertzContact { centre_mm, radii_mm, angle, mu: [ratio * direction.cos(), ratio * direction.sin()] }
    }

    /// The parameters of `patch`: x₀, y₀, L₁₁, L₂₂, L₁₂ in mm, g.
    pub fn parameters(&self) -> [f64; 6] {
        let (sin, cos) = self.angle.sin_cos();
        let [a, b] = self.radii_mm;
        let [x, y] = self.centre_mm;
        [x, y, a * cos * cos + b * sin * sin, a * sin * sin + b * cos * cos, (a - b) * sin * cos, HERTZ]
    }

    /// The force in N, [x, y, normal].
    pub fn force_N(&self) -> [f64; 3] {
        [self.mu[0], self.mu[1], 1.0]
    }
}

/// Computes the stress of contacts on one array.
pub struct ContactStress {
    taxels: Taxels,
    disc: Disc,
}

impl ContactStress {
    /// For the taxels of one array under `medium`.
    pub fn new(sensor: &Sensor, medium: Medium) -> ContactStress {
        ContactStress { taxels: Taxels::new(sensor, medium), disc: Disc::new(NODES[0], NODES[1]) }
    }

    /// Stress under each taxel in MPa.
    pub fn stress_MPa(&self, contact: &HertzContact) -> Vec<f64> {
        let [x, y, z] = self.ellipse().unit_loads(&contact.parameters());
        let [fx, fy, fz] = contact.force_N();
        x.iter().zip(&y).zip(&z).map(|((x, y), z)| fx * x + fy * y + fz * z).collect()
    }

    pub(super) fn ellipse(&self) -> Ellipse<'_> {
        Ellipse { taxels: &self.taxels, disc: &self.disc }
    }
}
