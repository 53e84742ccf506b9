//! Ellipse: the stress of one elliptic contact, and its derivatives.
//!
//! θ = x₀, y₀, L₁₁, L₂₂, L₁₂, g: the centre, the symmetric matrix that takes the unit disc to the ellipse, and the
//! exponent of the pressure (1 − ρ²)^g. The stress is linear in the force.

use super::disc::Disc;
use super::fit::Model;
use super::taxels::Taxels;
use nalgebra::{DMatrix, DVector};

/// Rings and angles of the first fit: 60 nodes.
pub(super) const COARSE_NODES: [usize; 2] = [5, 12];
/// Rings and angles of the second.
pub(super) const FINE_NODES: [usize; 2] = [8, 24];
/// Rings and angles for wide contacts: at five depths neighbouring nodes are 0.7 depths apart, which leaves an error of
/// e^(−2π/0.7) = 10⁻⁴.
pub(super) const WIDE_NODES: [usize; 2] = [12, 44];
/// Smallest and largest g.
const EXPONENT_RANGE: [f64; 2] = [0.0, 2.0];
/// Smallest radius in units of the depth; a smaller contact cannot be told from a point.
const MIN_RADIUS: f64 = 0.1;

/// Length of θ = x₀, y₀, L₁₁, L₂₂, L₁₂, g: five in mm, g without unit.
pub const PARAMETERS: usize = 6;

/// Stress model of one elliptic contact.
pub struct Ellipse<'a> {
    /// The taxels that read it.
    pub taxels: &'a Taxels,
    /// Nodes of the unit disc.
    pub disc: &'a Disc,
}

/// Position of a node of the unit disc on the ellipse, in mm.
pub(super) fn node_position(theta: &[f64], [u, v]: [f64; 2]) -> [f64; 2] {
    [theta[0] + theta[2] * u + theta[4] * v, theta[1] + theta[4] * u + theta[3] * v]
}

/// Clamps the centre to the array and the radii to sizes that the taxels can resolve.
pub(super) fn confine_ellipse(taxels: &Taxels, theta: &mut [f64]) {
    let reach = |positions: &[f64]| positions.iter().fold(0.0f64, |reach, x| x.abs().max(reach));
    let (x, y) = (reach(&taxels.x), reach(&taxels.y));
    let radii = [MIN_RADIUS * taxels.depth, 2.0 * x.max(y)];
    theta[0] = theta[0].clamp(-x, x);
    theta[1] = theta[1].clamp(-y, y);
    theta[2] = theta[2].clamp(radii[0], radii[1].max(radii[0]));
    theta[3] = theta[3].clamp(radii[0], radii[1].max(radii[0]));
    // Positive definite, with the shorter radius at least a tenth of the longer.
    let most = 0.9 * (theta[2] * theta[3]).sqrt();
    // Not `clamp`, which panics on NaN bounds: such a fit is rejected by its misfit.
    theta[4] = theta[4].max(-most).min(most);
}

impl Ellipse<'_> {
    /// Stress of 1 N along x, y and z.
    pub fn unit_loads(&self, theta: &[f64]) -> [Vec<f64>; 3] {
        let mut columns = [(); 3].map(|()| vec![0.0; self.taxels.count()]);
        let (weights, _) = self.disc.weights(theta[5]);
        for (&node, weight) in self.disc.nodes.iter().zip(weights) {
            self.taxels.add_unit_forces(node_position(theta, node), weight, &mut columns);
        }
        columns
    }

    /// Derivatives of the stress under a force by θ.
    pub fn derivatives(&self, theta: &[f64], force: [f64; 3]) -> [Vec<f64>; PARAMETERS] {
        let n = self.taxels.count();
        let mut out = [(); PARAMETERS].map(|()| vec![0.0; n]);
        let mut field = [(); 3].map(|()| vec![0.0; n]);
        let (weights, slopes) = self.disc.weights(theta[5]);
        for ((&[u, v], weight), slope) in self.disc.nodes.iter().zip(weights).zip(slopes) {
            self.taxels.field(node_position(theta, [u, v]), force, &mut field);
            let [o0, o1, o2, o3, o4, o5] = &mut out;
            let outs = o0.iter_mut().zip(o1).zip(o2).zip(o3).zip(o4).zip(o5);
            let fields = field[0].iter().zip(&field[1]).zip(&field[2]);
            for ((((((o0, o1), o2), o3), o4), o5), ((value, along_x), along_y)) in outs.zip(fields) {
                let (x, y) = (weight * along_x, weight * along_y);
                *o0 += x;
                *o1 += y;
                *o2 += x * u;
                *o3 += y * v;
                *o4 += x * v + y * u;
                *o5 += slope * value;
            }
        }
        out
    }
}

impl Model for Ellipse<'_> {
    fn columns(&mut self, theta: &[f64]) -> DMatrix<f64> {
        matrix(self.unit_loads(theta))
    }

    fn slopes(&mut self, theta: &[f64], loads: &DVector<f64>) -> DMatrix<f64> {
        matrix(self.derivatives(theta, [loads[0], loads[1], loads[2]]))
    }

    fn confine(&self, theta: &mut [f64]) {
        confine_ellipse(self.taxels, theta);
        theta[5] = theta[5].clamp(EXPONENT_RANGE[0], EXPONENT_RANGE[1]);
    }
}

/// Columns side by side.
pub(super) fn matrix<const K: usize>(columns: [Vec<f64>; K]) -> DMatrix<f64> {
    let n = columns[0].len();
    DMatrix::from_iterator(n, K, columns.into_iter().flatten())
}
