//! Disc: nodes and weights on the unit disc, and the stress of point forces placed at mapped nodes.
//!
//! A pressure ∝ (1 − r²)^g on the disc has, with t = √(1 − r²), the integral
//! ∫∫ f (1 − r²)^g dA = ∫ dφ ∫₀¹ f t^(2g + 1) dt. Gauss–Legendre in t, equal angles in φ, each ring turned by half an
//! angle against the last. The nodes do not move with g, and t^(2g + 1) is smooth for g ≥ 0: that is what makes few
//! nodes enough.
//!
//! | | shape | unit | range |
//! |---|---|---|---|
//! | in: rings, angles | scalars | – | at least 1 |
//! | out: nodes | rings·angles | – | inside the unit disc |
//! | out: weights | rings·angles | – | positive, their sum is 1 |
//!
//! Feeds `patch` and `symmetric`. The kernel is that of a point force on a half-space.

use crate::sensor::Sensor;
use std::f64::consts::{PI, TAU};

/// Quadrature on the unit disc.
#[derive(Clone, Debug)]
pub struct Disc {
    /// Nodes, ring by ring.
    pub nodes: Vec<[f64; 2]>,
    /// √(1 − r²) of each node.
    heights: Vec<f64>,
    /// Gauss weight of each node's ring.
    gauss: Vec<f64>,
}

/// Nodes and weights of Gauss–Legendre on 0 … 1.
pub(crate) fn gauss_legendre(count: usize) -> Vec<[f64; 2]> {
    let node = |k: usize| {
        let mut x = (PI * (k as f64 + 0.75) / (count as f64 + 0.5)).cos();
        let mut slope = 1.0;
        // Newton's method converges quadratically from this start; ten steps are more than rounding needs.
        for _ in 0..10 {
            let (mut last, mut value) = (1.0, x);
            for n in 2..=count {
                let n = n as f64;
                (last, value) = (value, ((2.0 * n - 1.0) * x * value - (n - 1.0) * last) / n);
            }
            slope = count as f64 * (x * value - last) / (x * x - 1.0);
            x -= value / slope;
        }
        [0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope)]
    };
    (0..count).map(node).collect()
}

impl Disc {
    /// `rings` Gauss points in t, `angles` equal angles on each.
    pub fn new(rings: usize, angles: usize) -> Disc {
        let mut disc = Disc { nodes: Vec::new(), heights: Vec::new(), gauss: Vec::new() };
        for (ring, [t, weight]) in gauss_legendre(rings).into_iter().enumerate() {
            let r = (1.0 - t * t).sqrt();
            for step in 0..angles {
                let phi = TAU * (step as f64 + 0.5 * (ring % 2) as f64) / angles as f64;
                disc.nodes.push([r * phi.cos(), r * phi.sin()]);
                disc.heights.push(t);
                disc.gauss.push(weight);
            }
        }
        disc
    }

    /// Weights of a pressure ∝ (1 − r²)^g, sum 1, and their derivatives in g.
    pub fn weights(&self, g: f64) -> (Vec<f64>, Vec<f64>) {
        let mut weights: Vec<f64> =
            self.heights.iter().zip(&self.gauss).map(|(t, w)| w * t.powf(2.0 * g + 1.0)).collect();
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= sum);
        let logs = || self.heights.iter().map(|t| 2.0 * t.ln());
        let mean: f64 = weights.iter().zip(logs()).map(|(w, log)| w * log).sum();
        let slopes = weights.iter().zip(logs()).map(|(w, log)| w * (log - mean)).collect();
        (weights, slopes)
    }
}

/// Positions of the taxels in mm from the array's centre.
#[derive(Clone, Debug)]
pub struct Taxels {
    /// Along the columns.
    pub x: Vec<f64>,
    /// Along the rows.
    pub y: Vec<f64>,
    /// Depth under the surface.
    pub depth: f64,
}

impl Taxels {
    /// The taxels of an array.
    pub fn new(sensor: &Sensor) -> Taxels {
        let place = |index: usize| sensor.position_mm(index / sensor.cols, index % sensor.cols);
        let (x, y) = (0..sensor.taxels()).map(place).map(|[x, y]| (x, y)).unzip();
        Taxels { x, y, depth: sensor.thickness_mm }
    }

    /// Number of taxels.
    pub fn count(&self) -> usize {
        self.x.len()
    }

    /// Adds the stress of unit forces along x, y and z at `place`, times `weight`, to three columns.
    pub fn add_unit_forces(&self, place: [f64; 2], weight: f64, columns: &mut [Vec<f64>; 3]) {
        let h = self.depth;
        let scale = weight * 3.0 * h * h / TAU;
        let [cx, cy, cz] = columns;
        let taxels = self.x.iter().zip(&self.y);
        for ((((x, y), cx), cy), cz) in taxels.zip(cx).zip(cy).zip(cz) {
            let (dx, dy) = (x - place[0], y - place[1]);
            let inverse = 1.0 / (dx * dx + dy * dy + h * h);
            let s = scale * inverse * inverse * inverse.sqrt();
            *cx += s * dx;
            *cy += s * dy;
            *cz += s * h;
        }
    }

    /// Stress of `force` (x, y, z) at `place`, and its derivatives with respect to that place, into three vectors.
    pub fn field(&self, place: [f64; 2], force: [f64; 3], out: &mut [Vec<f64>; 3]) {
        let h = self.depth;
        let scale = 3.0 * h * h / TAU;
        let [fx, fy, fz] = force.map(|f| f * scale);
        let [value, along_x, along_y] = out;
        let taxels = self.x.iter().zip(&self.y);
        for ((((x, y), value), along_x), along_y) in taxels.zip(value).zip(along_x).zip(along_y) {
            let (dx, dy) = (x - place[0], y - place[1]);
            let inverse = 1.0 / (dx * dx + dy * dy + h * h);
            let s = inverse * inverse * inverse.sqrt();
            let load = s * (fx * dx + fy * dy + fz * h);
            let steep = 5.0 * load * inverse;
            *value = load;
            *along_x = steep * dx - s * fx;
            *along_y = steep * dy - s * fy;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrates_moments_of_a_hertz_pressure() {
        let disc = Disc::new(5, 12);
        let (weights, _) = disc.weights(0.5);
        let mean = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
            disc.nodes.iter().zip(&weights).map(|([x, y], w)| w * f(*x, *y)).sum()
        };
        // ⟨x²⟩ = 1/5 and ⟨x⁴⟩ = 3/35 of a Hertz pressure; polynomials up to t⁹ are exact.
        assert!((mean(&|x, _| x * x) - 0.2).abs() < 1e-14);
        assert!((mean(&|x, _| x.powi(4)) - 3.0 / 35.0).abs() < 1e-14);
        assert!(mean(&|x, y| x * y).abs() < 1e-14 && mean(&|x, _| x).abs() < 1e-14);
    }

    #[test]
    fn slopes_are_those_of_the_weights() {
        let disc = Disc::new(4, 3);
        let (d, g) = (1e-6, 0.3);
        let (_, slopes) = disc.weights(g);
        let (above, below) = (disc.weights(g + d).0, disc.weights(g - d).0);
        for ((slope, a), b) in slopes.iter().zip(above).zip(below) {
            assert!((slope - (a - b) / (2.0 * d)).abs() < 1e-8);
        }
    }

    #[test]
    fn fields_agree_with_columns_and_their_differences() {
        let sensor = Sensor { rows: 2, cols: 3, pitch_x_mm: 2.0, pitch_y_mm: 4.0, thickness_mm: 3.0 };
        let taxels = Taxels::new(&sensor);
        let empty = || [vec![0.0; 6], vec![0.0; 6], vec![0.0; 6]];
        let force = [0.3, -0.7, 2.0];
        let at = |place: [f64; 2]| {
            let mut columns = empty();
            taxels.add_unit_forces(place, 1.0, &mut columns);
            (0..6).map(|i| (0..3).map(|k| force[k] * columns[k][i]).sum::<f64>()).collect::<Vec<_>>()
        };
        let (x, y, d) = (0.4, -1.1, 1e-5);
        let mut field = empty();
        taxels.field([x, y], force, &mut field);
        let [value, along_x, along_y] = field;
        let ([right, left], [up, down]) = ([at([x + d, y]), at([x - d, y])], [at([x, y + d]), at([x, y - d])]);
        for (i, at) in at([x, y]).into_iter().enumerate() {
            assert!((value[i] - at).abs() < 1e-15);
            assert!((along_x[i] - (right[i] - left[i]) / (2.0 * d)).abs() < 1e-9);
            assert!((along_y[i] - (up[i] - down[i]) / (2.0 * d)).abs() < 1e-9);
        }
    }
}
