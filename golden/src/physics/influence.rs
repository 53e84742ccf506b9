//! Influence: the stress that one loaded cell causes on one taxel.
//!
//! A unit force spread evenly over an a × b cell (Love's rectangle), d = taxel − cell centre, corners X = dx ± a/2,
//! Y = dy ± b/2 with sign s, R = √(X² + Y² + h²):
//!
//! ```text
//! cz =  1/(2πab)  Σ s [atan(XY/(hR)) + (XYh/R)(1/(X²+h²) + 1/(Y²+h²))]
//! cx = −h²/(2πab) Σ s Y/((X²+h²)R)                     cy: X and Y exchanged
//! ```
//!
//! Far from the cell the terms of the four corners cancel to a billionth of their size, and the closed form keeps 8 of
//! 16 digits. There the mean of the point kernel 3h²(dx, dy, h)/(2πρ⁵) over the cell is computed by Gauss quadrature,
//! whose terms do not cancel. The kernel is analytic up to ρ = 0, so the error with N nodes is E^(−2N), where E is the
//! sum of the half-axes of the ellipse around the cell's side through the nearest singularity. The quadrature is used
//! where E^(−2N) is below rounding in both directions, the closed form elsewhere, that is close to cells much wider
//! than h. On a bonded layer [`crate::physics::bonded`] replaces both.
//! | | shape | unit |
//! |---|---|---|
//! | in: dx, dy, a, b, h | scalars | mm, a, b, h above 0 |
//! | out: cx, cy, cz | scalars | 1/mm², that is MPa per N |

use crate::physics::bonded::{cell, kernel::Kernel};
use crate::physics::gauss::rule;
use crate::spec::scene::Medium;
use crate::spec::sensor::Sensor;
use faer::Mat;
use std::f64::consts::TAU;

/// Nodes of the quadrature along each side of a cell.
const NODES: usize = 24;

/// Normal stress in MPa per N along x; offset taxel − cell `dx`, `dy`, cell `a` × `b` and depth `h` in mm.
pub fn cx(dx: f64, dy: f64, a: f64, b: f64, h: f64) -> f64 {
    // Odd in dx: exactly zero in the middle, where rounding could leave a remainder.
    if dx == 0.0 {
        return 0.0;
    }
    if far(dx, dy, a, b, h) {
        return mean(dx, dy, a, b, |x, y| 3.0 * h * h * x / (TAU * rho5(x, y, h)));
    }
    let corner = |x: f64, y: f64| y / ((x * x + h * h) * norm(x, y, h));
    -h * h / (TAU * a * b) * corners(dx, dy, a, b, corner)
}

/// Normal stress in MPa per N along y; arguments as for [`cx`].
pub fn cy(dx: f64, dy: f64, a: f64, b: f64, h: f64) -> f64 {
    cx(dy, dx, b, a, h)
}

/// Normal stress in MPa per N along z; arguments as for [`cx`].
///
/// ```
/// use dermis_golden::physics::influence::{cx, cz};
///
/// // 1 N on a cell much wider than its depth: below its centre the stress is the pressure on the cell.
/// let (side, depth) = (1e4, 1.0);
/// assert!((cz(0.0, 0.0, side, side, depth) * side * side - 1.0).abs() < 1e-9);
/// // Shear towards a taxel compresses it as much as shear away from it pulls.
/// let [ahead, behind] = [2.0, -2.0].map(|dx| cx(dx, 1.0, 4.0, 4.0, 3.0));
/// assert!(ahead > 0.0 && (ahead + behind).abs() < 1e-14 * ahead);
/// ```
pub fn cz(dx: f64, dy: f64, a: f64, b: f64, h: f64) -> f64 {
    if far(dx, dy, a, b, h) {
        return mean(dx, dy, a, b, |x, y| 3.0 * h * h * h / (TAU * rho5(x, y, h)));
    }
    let corner = |x: f64, y: f64| {
        let r = norm(x, y, h);
        let widths = 1.0 / (x * x + h * h) + 1.0 / (y * y + h * h);
        (x * y / (h * r)).atan() + x * y * h / r * widths
    };
    corners(dx, dy, a, b, corner) / (TAU * a * b)
}

fn norm(x: f64, y: f64, h: f64) -> f64 {
    (x * x + y * y + h * h).sqrt()
}

fn rho5(x: f64, y: f64, h: f64) -> f64 {
    let square = x * x + y * y + h * h;
    square * square * square.sqrt()
}

/// Σ s f(X, Y) over the cell's corners.
fn corners(dx: f64, dy: f64, a: f64, b: f64, f: impl Fn(f64, f64) -> f64) -> f64 {
    let [x0, x1] = [dx - a / 2.0, dx + a / 2.0];
    let [y0, y1] = [dy - b / 2.0, dy + b / 2.0];
    f(x1, y1) - f(x0, y1) - f(x1, y0) + f(x0, y0)
}

/// Whether the quadrature is accurate to rounding.
fn far(dx: f64, dy: f64, a: f64, b: f64, h: f64) -> bool {
    // E^(−2N) = ε
    smallest_ellipse(dx, dy, a, b, h) >= f64::EPSILON.powf(-0.5 / NODES as f64)
}

/// The smaller E of both directions.
fn smallest_ellipse(dx: f64, dy: f64, a: f64, b: f64, h: f64) -> f64 {
    let gap = |d: f64, side: f64| (d.abs() - side / 2.0).max(0.0);
    ellipse(dx, gap(dy, b).hypot(h), a / 2.0).min(ellipse(dy, gap(dx, a).hypot(h), b / 2.0))
}

/// Sum of the half-axes, in units of `half`, of the ellipse with foci ±half through along + i·across.
fn ellipse(along: f64, across: f64, half: f64) -> f64 {
    let (x, y) = (along / half, across / half);
    let major = ((x + 1.0).hypot(y) + (x - 1.0).hypot(y)) / 2.0;
    major + ((major - 1.0).max(0.0) * (major + 1.0)).sqrt()
}

/// Mean of f over the cell, f being a function of taxel − force.
fn mean(dx: f64, dy: f64, a: f64, b: f64, f: impl Fn(f64, f64) -> f64) -> f64 {
    let rule = rule(NODES);
    let mut sum = 0.0;
    for &(y, wy) in rule {
        for &(x, wx) in rule {
            sum += wx * wy * f(dx + x * a / 2.0, dy + y * b / 2.0);
        }
    }
    sum / 4.0
}

/// The stress that a loaded cell of one size causes under a medium.
pub struct CellInfluence {
    /// Sides of the cell in mm, along x and y.
    cell_mm: [f64; 2],
    /// Depth of the taxels in mm.
    h: f64,
    /// The point kernel of a bonded layer.
    layer: Option<Kernel>,
}

impl CellInfluence {
    /// For cells of `cell_mm`, \[x, y\], at a height of `h` mm above the taxels.
    pub fn new(cell_mm: [f64; 2], h: f64, medium: Medium) -> CellInfluence {
        let layer = match medium {
            Medium::HalfSpace => None,
            Medium::BondedLayer { poisson } => Some(Kernel::new(poisson)),
        };
        CellInfluence { cell_mm, h, layer }
    }

    /// Stress in MPa per N along x, y and z on the cell; `offset` is taxel − cell centre in mm.
    pub fn at(&self, offset: [f64; 2]) -> [f64; 3] {
        let ([dx, dy], [a, b]) = (offset, self.cell_mm);
        match &self.layer {
            None => [cx, cy, cz].map(|f| f(dx, dy, a, b, self.h)),
            Some(kernel) => cell::influence(kernel, offset, self.cell_mm, self.h),
        }
    }

    /// The same up to rounding, on a half-space by no more nodes than the distance needs, in one pass: for tables of many distances.
    pub(crate) fn in_table(&self, offset: [f64; 2]) -> [f64; 3] {
        let ([dx, dy], [a, b], h) = (offset, self.cell_mm, self.h);
        // E^(−2N) = ε, and one more: the error has a factor.
        let needed = -0.5 * f64::EPSILON.ln() / smallest_ellipse(dx, dy, a, b, h).ln() + 2.0;
        if self.layer.is_some() || needed.is_nan() || needed >= NODES as f64 {
            return self.at(offset);
        }
        let rule = rule(needed as usize);
        let mut sums = [0.0; 3];
        for &(v, wv) in rule {
            for &(u, wu) in rule {
                let (x, y) = (dx + u * a / 2.0, dy + v * b / 2.0);
                let weight = wu * wv / rho5(x, y, h);
                sums = [sums[0] + weight * x, sums[1] + weight * y, sums[2] + weight * h];
            }
        }
        // The mean has a weight of 4; zero in the middle as in `cx`.
        let [x, y, z] = sums.map(|sum| 0.75 * h * h / TAU * sum);
        [if dx == 0.0 { 0.0 } else { x }, if dy == 0.0 { 0.0 } else { y }, z]
    }
}

/// Stress in MPa per N along x, y, z for each distance in rows and columns, row-major. cx is odd along the columns, cy
/// along the rows.
pub fn table(sensor: &Sensor, medium: Medium) -> Vec<[f64; 3]> {
    let Sensor { cols, pitch_x_mm: a, pitch_y_mm: b, thickness_mm: h, .. } = *sensor;
    let cell = CellInfluence::new([a, b], h, medium);
    (0..sensor.taxels()).map(|index| cell.at([(index % cols) as f64 * a, (index / cols) as f64 * b])).collect()
}

/// The influence at a distance taxel − cell in rows and columns of either sign, from a [`table`] of an array of `cols` columns.
pub(crate) fn at_distance(table: &[[f64; 3]], cols: usize, [down, right]: [isize; 2]) -> [f64; 3] {
    let [x, y, z] = table[down.unsigned_abs() * cols + right.unsigned_abs()];
    [if right < 0 { -x } else { x }, if down < 0 { -y } else { y }, z]
}

/// Influence matrices of an array, taxels × cells; row t, column f is the stress in MPa on taxel t per N on cell f.
pub struct Influence {
    /// Stress per force along x, MPa/N.
    pub cx: Mat<f64>,
    /// Stress per force along y, MPa/N.
    pub cy: Mat<f64>,
    /// Stress per normal force, MPa/N.
    pub cz: Mat<f64>,
}

impl Influence {
    /// The matrices of an array on a half-space; the mirror symmetry of the array holds to the bit.
    pub fn new(sensor: &Sensor) -> Influence {
        Influence::through(sensor, Medium::HalfSpace)
    }

    /// The matrices of an array on any medium; the mirror symmetry of the array holds to the bit.
    pub fn through(sensor: &Sensor, medium: Medium) -> Influence {
        let Sensor { rows, cols, .. } = *sensor;
        let table = table(sensor, medium);
        let fill = |axis: usize| {
            Mat::from_fn(rows * cols, rows * cols, |taxel, force| {
                let place = |index: usize| [(index / cols) as isize, (index % cols) as isize];
                let ([row, col], [from_row, from_col]) = (place(taxel), place(force));
                at_distance(&table, cols, [row - from_row, col - from_col])[axis]
            })
        };
        Influence { cx: fill(0), cy: fill(1), cz: fill(2) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::values;
    use proptest::prelude::*;

    /// 576 terms of one sign carry at most a few roundings each: 1e-12 is 4500 ε.
    const RELATIVE: f64 = 1e-12;

    fn near(value: f64, wanted: f64) -> bool {
        // The reference prints one zero as 2e-53.
        (value - wanted).abs() <= RELATIVE * wanted.abs() + 1e-40
    }

    #[test]
    fn agrees_with_values_of_50_digits() {
        for r in &values().influence {
            let (a, b, h) = (r.cell_x_mm, r.cell_y_mm, r.thickness_mm);
            let got = [cx, cy, cz].map(|f| f(r.dx_mm, r.dy_mm, a, b, h));
            for (value, wanted) in got.iter().zip([&r.cx, &r.cy, &r.cz]) {
                assert!(near(*value, wanted.parse().unwrap()), "{value:e} {wanted} at {r:?}");
            }
        }
    }

    #[test]
    fn far_away_a_cell_is_a_point() {
        let point = 3.0 * 27.0 / (TAU * rho5(3000.0, 4000.0, 3.0));
        // The next term of the series in cell size over distance is about (2/5000)².
        assert!((cz(3000.0, 4000.0, 2.0, 4.0, 3.0) / point - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_wide_cell_hands_its_pressure_on() {
        // 1 N on a cell much wider than h: under its middle the stress is the pressure 1/(ab).
        assert!((cz(0.0, 0.0, 1e4, 1e4, 1.0) * 1e8 - 1.0).abs() < 1e-9);
    }

    /// Near and far, cells finer and wider than they are deep.
    #[test]
    fn in_a_table_the_influence_is_the_same() {
        for [a, b, h] in [[1.0, 1.0, 3.0], [4.0, 4.0, 3.0], [4.0, 1.0, 2.0], [30.0, 20.0, 1.0]] {
            let cell = CellInfluence::new([a, b], h, Medium::HalfSpace);
            let largest = cell.at([0.0; 2])[2];
            for k in 0..60 {
                for l in 0..60 {
                    let offset = [a * f64::from(k) / 2.0, b * f64::from(l)];
                    let (exact, own) = (cell.at(offset), cell.in_table(offset));
                    let off = (0..3).map(|axis| (exact[axis] - own[axis]).abs()).fold(0.0, f64::max);
                    assert!(off < 1e-14 * largest, "{a} {b} {h} {offset:?}: {off:e}");
                }
            }
        }
    }

    proptest! {
        /// Closed form and quadrature agree where both are accurate.
        #[test]
        fn both_ways_agree(dx in -6.0f64..6.0, dy in -6.0f64..6.0, h in 2.0f64..4.0) {
            let (a, b) = (2.0, 2.5);
            prop_assert!(far(dx, dy, a, b, h));
            let corner = |x: f64, y: f64| y / ((x * x + h * h) * norm(x, y, h));
            let closed = -h * h / (TAU * a * b) * corners(dx, dy, a, b, corner);
            // Four corners of up to 1/h² each, rounded; h²/(2πab) h⁻² ε · 10.
            prop_assert!((cx(dx, dy, a, b, h) - closed).abs() < 1e-15);
        }
    }
}
