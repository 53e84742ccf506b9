//! Cell: the stress on one taxel from one uniformly loaded cell on a bonded layer.
//!
//! Mean of the point kernel over the a × b cell, d = taxel − cell centre, u over the cell:
//!
//! ```text
//! cz = mean gn(|d − u|/h)/h²        cx = mean (d − u)x gs(|d − u|/h)/h³
//! ```
//!
//! The kernel is analytic within h, so panels of at most h a side with 12 nodes along each side integrate it to
//! rounding (error E^(−24), E = 2 + √5). The part of a cell beyond the kernel's reach is omitted.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: dx, dy, a, b, h | scalars | mm, a, b, h above 0 |
//! | out: cx, cy, cz | 3 | 1/mm², that is MPa per N |

use super::kernel::{Kernel, REACH};
use crate::physics::gauss::rule;

/// Nodes of a panel along each side.
const NODES: usize = 12;

/// Stress in MPa per N along x, y and z on the cell; offset taxel − cell, sides of the cell and `h` in mm.
pub fn influence(kernel: &Kernel, [dx, dy]: [f64; 2], [a, b]: [f64; 2], h: f64) -> [f64; 3] {
    // Taxel − force, in units of h, over the part of the cell within reach.
    let (along_x, along_y) = (side(dx, a, h), side(dy, b, h));
    let mut sums = [0.0; 3];
    for &(y, wy) in &along_y {
        for &(x, wx) in &along_x {
            let [normal, shear] = kernel.at(x.hypot(y));
            let weight = wx * wy;
            sums[0] += weight * x * shear;
            sums[1] += weight * y * shear;
            sums[2] += weight * normal;
        }
    }
    // Odd in dx and dy: exactly zero in the middle, where rounding could leave a remainder.
    let [x, y, z] = sums.map(|sum| sum / (a * b));
    [if dx == 0.0 { 0.0 } else { x }, if dy == 0.0 { 0.0 } else { y }, z]
}

/// Nodes and weights along one side, in units of h.
fn side(d: f64, length: f64, h: f64) -> Vec<(f64, f64)> {
    let low = ((d - length / 2.0) / h).max(-REACH);
    let high = ((d + length / 2.0) / h).min(REACH);
    if low >= high {
        return Vec::new();
    }
    // At most 2 REACH.
    let panels = (high - low).ceil() as usize;
    let half = (high - low) / panels as f64 / 2.0;
    let nodes = rule(NODES);
    let panel = |k: usize| {
        let middle = low + half * (2 * k + 1) as f64;
        nodes.iter().map(move |(x, weight)| (middle + half * x, half * weight))
    };
    (0..panels).flat_map(panel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_of_unit_tractions() {
        // Largest b on a 0.5 mm grid for unit traction on one cell, h = 3 mm, from an independent Hankel quadrature.
        let known = [
            (0.48, [4.0, 4.0], [0.210012, 0.210012, 0.663606]),
            (0.48, [2.0, 4.0], [0.139561, 0.125117, 0.420265]),
            (0.40, [4.0, 4.0], [0.208056, 0.208056, 0.653969]),
            (0.40, [2.0, 4.0], [0.135926, 0.123007, 0.410186]),
        ];
        for (poisson, [a, b], wanted) in known {
            let kernel = Kernel::new(poisson);
            let mut peaks = [0.0f64; 3];
            for row in 0..12 {
                for col in 0..12 {
                    let offset = [0.5 * f64::from(col), 0.5 * f64::from(row)];
                    let got = influence(&kernel, offset, [a, b], 3.0);
                    for (peak, c) in peaks.iter_mut().zip(got) {
                        *peak = peak.max(c * a * b);
                    }
                }
            }
            assert!((0..3).all(|k| (peaks[k] - wanted[k]).abs() < 0.6e-6), "{poisson} {a}: {peaks:?}");
        }
    }

    #[test]
    fn a_wide_cell_hands_its_pressure_on() {
        let kernel = Kernel::new(0.3);
        let [x, y, z] = influence(&kernel, [0.0; 2], [1e5, 1e5], 1.0);
        assert_eq!([x, y], [0.0; 2]);
        assert!((z * 1e10 - 1.0).abs() < 1e-9);
        assert_eq!(influence(&kernel, [2e5, 0.0], [1e5, 1e5], 1.0), [0.0; 3]);
    }

    #[test]
    fn four_quarters_make_a_cell() {
        let kernel = Kernel::new(0.48);
        let whole = influence(&kernel, [3.0, -2.0], [4.0, 2.0], 1.5);
        let mut sum = [0.0; 3];
        for [x, y] in [[-1.0, -0.5], [1.0, -0.5], [-1.0, 0.5], [1.0, 0.5]] {
            let quarter = influence(&kernel, [3.0 + x, -2.0 + y], [2.0, 1.0], 1.5);
            (0..3).for_each(|k| sum[k] += quarter[k] / 4.0);
        }
        assert!((0..3).all(|k| (sum[k] - whole[k]).abs() < 1e-15), "{sum:?} {whole:?}");
    }
}
