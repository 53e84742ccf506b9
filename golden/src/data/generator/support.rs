//! Support: a contact as point loads on its support, and the stress they cause.
//!
//! The nodes are those of a fixed quadrature on each piece: Gauss along the radius and equal steps along the angle, or
//! Gauss along both sides of a square. A piece that is subtracted (the hole of a ring) has negative shares.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: contact | – | mm, N |
//! | out: place, share of the load and of the shear of each node | m | mm, – |
//! | out: stress per unit force at a place | taxels | MPa/N |

use super::traction::{pieces, total_N, Piece, PressureShape};
use super::GeneratorError;
use crate::data::frame::Contact;
use crate::physics::body::Body;
use crate::physics::gauss::rule;
use crate::spec::scene::Medium;
use crate::spec::sensor::Sensor;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Nodes along the radius, and along each side of a square.
const ALONG: usize = 8;
/// Steps along the angle.
const AROUND: usize = 16;

/// A contact as point loads.
pub struct Support {
    /// Place of each node in mm from the array's centre.
    pub at_mm: Vec<[f64; 2]>,
    /// Share of the load on each node; their sum is 1.
    pub share: Vec<f64>,
    /// Share of the shear on each node; their sum is 1.
    pub shear_share: Vec<f64>,
    /// Force of the contact in N, [x, y, normal].
    pub force_N: [f64; 3],
}

impl Support {
    /// The nodes of a contact.
    ///
    /// # Errors
    /// As [`super::generate`], for contact 0.
    pub fn new(contact: &Contact) -> Result<Support, GeneratorError> {
        let pieces = pieces(0, contact)?;
        let force_N = total_N(&pieces);
        let [tx, ty, normal] = force_N;
        let square = tx * tx + ty * ty;
        let (mut at_mm, mut share, mut shear_share) = (Vec::new(), Vec::new(), Vec::new());
        for piece in &pieces {
            let [x, y, z] = piece.force_N;
            let of_load = z / normal;
            // The shear of all pieces has one direction. In full slip the shares are equal to the bit.
            let uneven = matches!(contact.kind_of_slip.as_deref(), Some("partial-slip" | "even-shear")) && square > 0.0;
            let of_shear = if uneven { (x * tx + y * ty) / square } else { of_load };
            for (place, weight) in nodes(piece) {
                at_mm.push(place);
                share.push(weight * of_load);
                shear_share.push(weight * of_shear);
            }
        }
        Ok(Support { at_mm, share, shear_share, force_N })
    }
}

/// Places and weights of a piece's nodes; the weights sum to 1 up to rounding.
fn nodes(piece: &Piece) -> Vec<([f64; 2], f64)> {
    let gauss = rule(ALONG);
    let angles: Vec<(f64, f64)> = (0..AROUND).map(|k| (TAU * k as f64 / AROUND as f64, TAU / AROUND as f64)).collect();
    // From −1 … 1 to 0 … end.
    let upwards =
        |end: f64| -> Vec<(f64, f64)> { gauss.iter().map(|(z, w)| ((z + 1.0) * end / 2.0, w * end / 2.0)).collect() };
    let (u, v) = match piece.form {
        PressureShape::Hertz => (upwards(FRAC_PI_2), angles),
        PressureShape::Disc => (upwards(1.0), angles),
        PressureShape::Square => (gauss.to_vec(), gauss.to_vec()),
    };
    let node = |(u, wu): (f64, f64), (v, wv): (f64, f64)| {
        let (place, density) = piece.map(u, v);
        (place, density * wu * wv)
    };
    v.iter().flat_map(|&v| u.iter().map(move |&u| (u, v))).map(|(u, v)| node(u, v)).collect()
}

/// The elastic body under an array.
pub struct Kernels {
    body: Body,
    taxels_mm: Vec<[f64; 2]>,
}

impl Kernels {
    /// The kernels of an array on a medium.
    pub fn new(sensor: &Sensor, medium: Medium) -> Kernels {
        let at = |index: usize| sensor.position_mm(index / sensor.cols, index % sensor.cols);
        Kernels { body: Body::new(medium, sensor.thickness_mm), taxels_mm: (0..sensor.taxels()).map(at).collect() }
    }

    /// Stress in MPa on taxel `taxel` of a point force in N at a place in mm.
    pub fn stress_MPa(&self, taxel: usize, [x, y]: [f64; 2], force_N: [f64; 3]) -> f64 {
        let [tx, ty] = self.taxels_mm[taxel];
        self.body.point_MPa([tx - x, ty - y], force_N)
    }

    /// Number of taxels.
    pub fn taxels(&self) -> usize {
        self.taxels_mm.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::generator::draws::{ContactShape, DrawOptions, Draws};
    use crate::data::generator::slip::Slip;
    use crate::spec::scene::Scene;

    #[test]
    fn nodes_carry_the_load_and_cause_the_stress() {
        let scene = Scene::builtin("sensor-1").unwrap();
        let shapes = ContactShape::NAMES.map(|(_, shape)| shape).to_vec();
        let kernels = Kernels::new(&scene.sensor, scene.medium);
        for slip in [Slip::Full, Slip::Partial(0.4), Slip::Even] {
            let draws = Draws::new(&scene, DrawOptions { shapes: shapes.clone(), slip, ..Default::default() }).unwrap();
            for number in 0..6 {
                let drawn = draws.frame(number).unwrap();
                let support = Support::new(&drawn.frame.contacts[0]).unwrap();
                let Support { at_mm, share, shear_share, force_N: [tx, ty, normal] } = support;
                assert!([&share, &shear_share].iter().all(|all| (all.iter().sum::<f64>() - 1.0).abs() < 1e-12));
                // An even shear is that of full slip where the pressure is even.
                assert!(slip == Slip::Even || (share == shear_share) == (slip == Slip::Full), "{number} {slip}");
                for (taxel, wanted) in drawn.exact_MPa.iter().enumerate() {
                    let force = |k: usize| [shear_share[k] * tx, shear_share[k] * ty, share[k] * normal];
                    let sum: f64 = (0..share.len()).map(|k| kernels.stress_MPa(taxel, at_mm[k], force(k))).sum();
                    // A bound to a few percent needs no more than a thousandth.
                    assert!((sum - wanted).abs() < 1e-3 * drawn.peak_MPa(), "{number} {slip} {taxel}: {sum} {wanted}");
                }
            }
        }
    }
}
