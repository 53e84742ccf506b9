//! Mirror: the symmetry of a regular grid, restored to the bit after rounding.

use crate::sensor::Sensor;
use faer::Mat;

/// Averages a matrix over the array's mirror images, signs `sx` and `sy` (±1) saying whether a mirror in x or y turns
/// its sign. Each orbit is averaged once and written to all its places, so that the symmetry holds to the bit.
pub(super) fn mirror(sensor: &Sensor, m: &mut Mat<f64>, sx: f64, sy: f64) {
    let (rows, cols) = (sensor.rows, sensor.cols);
    let flip_x = |i: usize| i - i % cols + (cols - 1 - i % cols);
    let flip_y = |i: usize| (rows - 1 - i / cols) * cols + i % cols;
    for i in 0..sensor.taxels() {
        for j in 0..sensor.taxels() {
            let (x, y) = ((flip_x(i), flip_x(j)), (flip_y(i), flip_y(j)));
            let xy = (flip_y(x.0), flip_y(x.1));
            let images = [((i, j), 1.0), (x, sx), (y, sy), (xy, sx * sy)];
            if images.iter().any(|(image, _)| *image < (i, j)) {
                continue;
            }
            // In pairs, so that a place that is its own image under an odd mirror becomes exactly zero.
            let sum = (m[(i, j)] + sy * m[y]) + sx * (m[x] + sy * m[xy]);
            for (image, sign) in images {
                m[image] = sign * sum / 4.0;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odd_counts_keep_their_middle() {
        let sensor = Sensor { rows: 3, cols: 5, pitch_x_mm: 1.0, pitch_y_mm: 1.0, thickness_mm: 1.0 };
        let mut m = Mat::from_fn(15, 15, |i, j| ((i * 31 + j * 17) % 23) as f64 / 7.0);
        mirror(&sensor, &mut m, -1.0, 1.0);
        for i in 0..15 {
            for j in 0..15 {
                let flip = |k: usize| k - k % 5 + (4 - k % 5);
                let turn = |k: usize| 14 - k;
                assert_eq!(m[(i, j)], -m[(flip(i), flip(j))]);
                assert_eq!(m[(i, j)], -m[(turn(i), turn(j))]);
            }
        }
        // Taxel 7 is the centre: its own image under an odd mirror.
        assert_eq!(m[(7, 7)], 0.0);
    }

    #[test]
    fn a_symmetric_matrix_stays() {
        let sensor = Sensor { rows: 2, cols: 2, pitch_x_mm: 1.0, pitch_y_mm: 1.0, thickness_mm: 1.0 };
        let original = Mat::from_fn(4, 4, |i, j| [3.0, 2.0, 1.5, 0.25][i ^ j]);
        let mut m = original.clone();
        mirror(&sensor, &mut m, 1.0, 1.0);
        assert_eq!(m, original);
    }
}
