//! Extended: the stress of known forces on the cells in double-double arithmetic, rounded once to double.
//!
//! ```text
//! b_t = Σ_f [μ1 cx(t − f) + μ2 cy(t − f) + cz(t − f)] p_f          Love's closed form, [`dermis_golden::physics::influence`]
//! ```
//!
//! Far from a cell the closed form loses up to ten of its 31 digits; more than 20 remain for the rounding to double.
//! The entries for a bonded layer are integrals known to double precision only: there only products and sums are
//! extended, and the layer that these entries describe is the reference.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: p | taxels, row-major | N |
//! | in: μ | 2 | – |
//! | out: b | taxels | MPa |

use dermis_golden::physics::influence::table;
use dermis_golden::spec::scene::Medium;
use dermis_golden::spec::sensor::Sensor;
use qd::Quad;

/// Stress in MPa, row-major, of normal forces `p` in N on the cells with the shear μ p.
pub fn stress_MPa(sensor: &Sensor, medium: Medium, p: &[f64], mu: [f64; 2]) -> Vec<f64> {
    let (rows, cols) = (sensor.rows as isize, sensor.cols as isize);
    let entries = entries(sensor, medium);
    // μ·C at every signed distance, rows −(rows − 1) … rows − 1.
    let wide = 2 * cols - 1;
    let kernel: Vec<Quad> = (0..(2 * rows - 1) * wide)
        .map(|index| {
            let (down, right) = (index / wide - (rows - 1), index % wide - (cols - 1));
            let [cx, cy, cz] = entries[(down.unsigned_abs()) * sensor.cols + right.unsigned_abs()];
            let along = |mu: f64, steps: isize| two(mu * steps.signum() as f64);
            cz + cx * along(mu[0], right) + cy * along(mu[1], down)
        })
        .collect();
    let under = |taxel: usize| {
        let (r, c) = (taxel as isize / cols, taxel as isize % cols);
        let mut sum = Quad::ZERO;
        for (force, p) in p.iter().enumerate() {
            let (s, d) = (force as isize / cols, force as isize % cols);
            sum += kernel[((r - s + rows - 1) * wide + c - d + cols - 1) as usize] * two(*p);
        }
        // The leading part of a double-double number is its value rounded to double.
        sum.0
    };
    (0..sensor.taxels()).map(under).collect()
}

/// cx, cy, cz for each distance in rows and columns, row-major, the taxel to the right of and below the cell.
fn entries(sensor: &Sensor, medium: Medium) -> Vec<[Quad; 3]> {
    let Sensor { cols, pitch_x_mm: a, pitch_y_mm: b, thickness_mm: h, .. } = *sensor;
    match medium {
        Medium::HalfSpace => (0..sensor.taxels())
            .map(|index| influence([(index % cols) as f64, (index / cols) as f64], [a, b], h))
            .collect(),
        Medium::BondedLayer { .. } => table(sensor, medium).into_iter().map(|entry| entry.map(two)).collect(),
    }
}

/// Stress per unit force along x, y, z, `steps` pitches away from a cell with `sides` in mm.
fn influence(steps: [f64; 2], sides: [f64; 2], h: f64) -> [Quad; 3] {
    let [a, b, h] = [sides[0], sides[1], h].map(two);
    let square = h * h;
    let mut sums = [Quad::ZERO; 3];
    for (sy, sx) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        let x = a * two(steps[0] + sx / 2.0);
        let y = b * two(steps[1] + sy / 2.0);
        let (across, along) = (x * x + square, y * y + square);
        let r = (across + y * y).sqrt();
        let terms = [
            -square * y / (across * r),
            -square * x / (along * r),
            atan(x * y / (r * h)) + x * y * h / r * (Quad::ONE / across + Quad::ONE / along),
        ];
        for (sum, term) in sums.iter_mut().zip(terms) {
            *sum += term * two(sx * sy);
        }
    }
    let area = Quad::PI * two(2.0) * a * b;
    sums.map(|sum| sum / area)
}

/// atan to all digits: the angle is halved until a short series is accurate.
fn atan(mut x: Quad) -> Quad {
    const HALVINGS: i32 = 6;
    const TERMS: usize = 12;
    for _ in 0..HALVINGS {
        x /= (x * x + Quad::ONE).sqrt() + Quad::ONE;
    }
    // |x| < tan(π/2 / 2^6) = 0.025: the first term left out is below 0.025^24 = 1e-38 of the sum.
    let square = x * x;
    let mut sum = Quad::ZERO;
    for k in (0..TERMS).rev() {
        sum = Quad::ONE / two((2 * k + 1) as f64) - square * sum;
    }
    x * sum * two(2f64.powi(HALVINGS))
}

fn two(value: f64) -> Quad {
    Quad::from_f64(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::references;

    #[test]
    fn atan_to_30_digits() {
        // atan 1 = π/4, and atan x + atan 1/x = π/2.
        let off = |value: Quad, wanted: Quad| (value - wanted).0.abs();
        assert!(off(atan(Quad::ONE) * two(4.0), Quad::PI) < 1e-30);
        for x in [3.0, 0.7, 1e9] {
            assert!(off(atan(two(x)) + atan(Quad::ONE / two(x)), Quad::PI / two(2.0)) < 1e-30, "{x}");
        }
    }

    #[test]
    fn entries_of_50_digits() {
        let mut checked = 0;
        let values: serde_json::Value =
            serde_json::from_str(include_str!("../../../data/reference/values.json")).unwrap();
        for r in values["influence"].as_array().unwrap() {
            let [a, b, dx, dy, thickness] =
                ["cell_x_mm", "cell_y_mm", "dx_mm", "dy_mm", "thickness_mm"].map(|name| r[name].as_f64().unwrap());
            let steps = [dx / a, dy / b];
            // Offsets that are whole pitches, which is all there are in an array.
            if steps.iter().any(|step| step.fract() != 0.0) {
                continue;
            }
            let got = influence(steps, [a, b], thickness);
            for (value, wanted) in got.iter().zip(["cx", "cy", "cz"]) {
                let wanted: f64 = r[wanted].as_str().unwrap().parse().unwrap();
                // The wanted value is rounded to a double; zeros are printed as 2e-53.
                assert!((value.0 - wanted).abs() <= f64::EPSILON * wanted.abs() + 1e-30, "{value:?} {wanted}");
                checked += 1;
            }
        }
        assert!(checked >= 30, "{checked}");
    }

    #[test]
    fn stress_of_50_digits() {
        for frame in references() {
            let [t1, t2, n] = frame.resultant_N.unwrap();
            let p = frame.cell_forces_N.unwrap().fz;
            let b = stress_MPa(&frame.sensor, Medium::HalfSpace, &p, [t1 / n, t2 / n]);
            // The file prints p and μ with 15 digits.
            let peak = b.iter().fold(0.0f64, |peak, b| peak.max(b.abs()));
            let off = b.iter().zip(&frame.stress_MPa).map(|(b, c)| (b - c).abs()).fold(0.0, f64::max);
            assert!(off <= 1e-14 * peak, "{}: {:e}", frame.id, off / peak);
        }
    }
}
