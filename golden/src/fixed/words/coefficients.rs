//! The matrices of the passes as the hardware stores them: folded into parity blocks and quantised.
//!
//! For a matrix M that commutes with the mirrors up to a sign, the folded vector `f_p(j) = Σ_l (−1)^{p·l} x(image l of j)`
//! obeys `y_{p'}(i) = Σ_j B_{p'}(i, j) f_p(j)` with
//! ```text
//! B_{p'}(i, j) = Σ over the distinct images n of j of (−1)^{p·n} M(i, image n of j)
//! ```
//! where p = p' for Cz⁺, p' with the column parity flipped for Ax, with the row parity flipped for Ay. This is exact
//! and takes a quarter of the coefficients and products of M. Rows and columns that lie on a middle line vanish in the
//! odd parities.
//!
//! A matrix without some of its taxels ([`crate::physics::matrices::Matrices::without`]) has no mirror symmetry. In the basis of
//! parities it has all 16 blocks, four for each flip f = p XOR p', and the transform is exact again:
//! ```text
//! y_{p'}(i) = Σ_f Σ_j B_{p',f}(i, j) f_{p' XOR f}(j)
//! B_{p',f}(i, j) = mean over the distinct images k of i of (−1)^{p'·k}
//!                  Σ over the distinct images n of j of (−1)^{p·n} M(image k of i, image n of j)
//! ```
//! If dead taxels come in mirrored pairs, one symmetry remains: a flip whose coefficients all round to zero is not
//! stored, unless coefficients are written at run time.
//!
//! | matrix | stored as | width | LSB |
//! |---|---|---|---|
//! | Cz⁺ | two limbs, high signed, low unsigned | `inverse_bits` | 2^−`inverse_exponent` N/MPa |
//! | Ax, Ay | −A·(4/3)·mu_max | `coef_bits` | 2^−`a_exponent` |

use faer::Mat;
use serde::Serialize;

use crate::physics::symmetry::parity::{has_entry, sign, FLIP_X, FLIP_Y};
use crate::spec::quads::Quads;

/// The four Q × Q blocks of a folded matrix that flip the parity by `flip`; row-major, indexed by the target parity.
#[derive(Clone, Debug, PartialEq)]
pub struct Flipped<T> {
    /// Source parity = target parity XOR `flip`.
    pub flip: usize,
    /// Coefficients per target parity.
    pub parity: [Vec<T>; 4],
}

/// One matrix, folded and quantised.
#[derive(Clone, Debug, PartialEq)]
pub struct Blocks {
    /// Coefficients of each flip in LSBs; the flip of the mirror symmetry is the first.
    pub flips: Vec<Flipped<i64>>,
    /// LSB of the coefficients is 2^−`exponent`.
    pub exponent: i32,
}

impl Blocks {
    /// The ∞-norm in LSBs: largest Σ_j |B(i, j)| over all flips, of all rows i and parities. It bounds the growth of a
    /// pass.
    pub fn norm(&self, quads: usize) -> u64 {
        let row = |target: usize, i: usize| -> u64 {
            let own = |flipped: &Flipped<i64>| -> u64 {
                flipped.parity[target][i * quads..][..quads].iter().map(|c| c.unsigned_abs()).sum()
            };
            self.flips.iter().map(own).sum()
        };
        (0..4).flat_map(|target| (0..quads).map(move |i| row(target, i))).max().unwrap_or(0)
    }

    /// All coefficients, flip by flip.
    pub fn coefficients(&self) -> impl Iterator<Item = &i64> {
        self.flips.iter().flat_map(|flipped| flipped.parity.iter().flatten())
    }

    /// The parity flips that are stored.
    pub fn flips(&self) -> Vec<usize> {
        self.flips.iter().map(|flipped| flipped.flip).collect()
    }
}

/// The parity flips of each matrix; that of its mirror symmetry is the first, others exist only where the symmetry is
/// broken.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Flips {
    /// Flips of Cz⁺.
    pub inverse: Vec<usize>,
    /// Flips of Ax.
    pub ax: Vec<usize>,
    /// Flips of Ay.
    pub ay: Vec<usize>,
}

impl Flips {
    /// The flips of an array without dead taxels.
    pub fn symmetric() -> Flips {
        Flips { inverse: vec![0], ax: vec![FLIP_X], ay: vec![FLIP_Y] }
    }

    /// Whether the mirror symmetry holds.
    pub fn are_symmetric(&self) -> bool {
        *self == Flips::symmetric()
    }
}

/// Folds `matrix` (n × n over the row-major taxels of a subarray) into the blocks of one flip, unquantised. These are
/// the whole matrix if it has the mirror symmetry `flip`, else a quarter of it.
pub fn parity_blocks(quads: Quads, matrix: &Mat<f64>, flip: usize) -> Flipped<f64> {
    let count = quads.len();
    let parity = std::array::from_fn(|target| {
        let source = target ^ flip;
        let mut block = vec![0.0; count * count];
        for i in (0..count).filter(|&i| has_entry(quads, i, target)) {
            for j in (0..count).filter(|&j| has_entry(quads, j, source)) {
                // The row sum seen from image `from` of row i; with mirror symmetry it is the same for each image, to
                // the bit.
                let seen = |from: usize| -> f64 {
                    let images = (0..4).filter(|lane| quads.lane_mask(j) >> lane & 1 == 1).map(|lane| lane ^ from);
                    images.map(|lane| sign(source, lane) * matrix[(quads.taxel(i, from), quads.taxel(j, lane))]).sum()
                };
                let images = (0..4).filter(|lane| quads.lane_mask(i) >> lane & 1 == 1);
                let sum: f64 = images.map(|from| sign(target, from) * seen(from)).sum();
                block[i * count + j] = sum / f64::from(quads.lane_mask(i).count_ones());
            }
        }
        block
    });
    Flipped { flip, parity }
}

/// Quantises folded matrices to signed integers of `bits` bits with one common exponent, the largest at which all fit.
/// The first flip of a matrix is always kept, another flip only if a coefficient of it is not zero, or `all_flips` are asked for.
pub fn quantise(folded: &[Vec<Flipped<f64>>], bits: u32, all_flips: bool) -> Vec<Blocks> {
    let all = folded.iter().flatten().flat_map(|flipped| flipped.parity.iter().flatten());
    let largest = all.fold(0.0f64, |m, c| m.max(c.abs()));
    let limit = ((1i64 << (bits - 1)) - 1) as f64;
    let mut exponent = if largest > 0.0 { (limit / largest).log2().floor() as i32 } else { 0 };
    // The logarithm may round up to the next integer; one step down is always enough.
    if (largest * 2f64.powi(exponent)).round() > limit {
        exponent -= 1;
    }
    let integers = |Flipped { flip, parity }: &Flipped<f64>| Flipped {
        flip: *flip,
        parity: std::array::from_fn(|p| parity[p].iter().map(|c| (c * 2f64.powi(exponent)).round() as i64).collect()),
    };
    let kept = |(index, flipped): &(usize, Flipped<i64>)| {
        *index == 0 || all_flips || flipped.parity.iter().flatten().any(|&c| c != 0)
    };
    let blocks = |flips: &Vec<Flipped<f64>>| {
        let flips = flips.iter().map(integers).enumerate().filter(kept).map(|(_, flipped)| flipped).collect();
        Blocks { flips, exponent }
    };
    folded.iter().map(blocks).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::matrices::Matrices;
    use crate::physics::symmetry::parity::hadamard;
    use crate::spec::sensor::Sensor;

    /// Folding, multiplying by blocks and unfolding is the dense product, for even and odd sizes.
    #[test]
    fn folded_product_is_the_dense_product() {
        for (rows, cols) in [(4, 4), (5, 4), (3, 5)] {
            let sensor = Sensor { rows, cols, pitch_x_mm: 3.0, pitch_y_mm: 4.0, thickness_mm: 3.0 };
            let matrices = Matrices::new(&sensor, 0.6).expect("a small regular sensor");
            let quads = Quads { rows, cols };
            let x: Vec<i64> = (0..rows * cols).map(|t| ((t * t * 7 + 3 * t) % 41) as i64 - 20).collect();
            let folded: Vec<[i64; 4]> = quads.pack(&x).into_iter().map(hadamard).collect();
            for (matrix, flip) in [(&matrices.cz_pinv, 0), (&matrices.ax, FLIP_X), (&matrices.ay, FLIP_Y)] {
                let blocks = parity_blocks(quads, matrix, flip).parity;
                for i in 0..quads.len() {
                    let y: Vec<f64> = (0..4)
                        .map(|target| {
                            (0..quads.len())
                                .map(|j| blocks[target][i * quads.len() + j] * folded[j][target ^ flip] as f64)
                                .sum()
                        })
                        .collect();
                    for lane in 0..4 {
                        let unfolded: f64 = (0..4).map(|p| sign(p, lane) * y[p]).sum::<f64>() / 4.0;
                        let dense: f64 = (0..x.len()).map(|t| matrix[(quads.taxel(i, lane), t)] * x[t] as f64).sum();
                        assert!((unfolded - dense).abs() < 1e-9 * (1.0 + dense.abs()), "{rows}×{cols} {i} {lane}");
                    }
                }
            }
        }
    }

    /// A matrix without any symmetry takes all four flips, and is exact again.
    #[test]
    fn a_matrix_without_symmetry_is_the_sum_of_its_flips() {
        for (rows, cols) in [(4, 4), (5, 4), (3, 5)] {
            let n = rows * cols;
            let quads = Quads { rows, cols };
            let matrix = Mat::from_fn(n, n, |i, j| f64::from(((i * 31 + j * 17 + i * j) % 23) as u32) - 11.0);
            let x: Vec<i64> = (0..n).map(|t| ((t * t * 7 + 3 * t) % 41) as i64 - 20).collect();
            let folded: Vec<[i64; 4]> = quads.pack(&x).into_iter().map(hadamard).collect();
            let flips: Vec<_> = (0..4).map(|flip| parity_blocks(quads, &matrix, flip)).collect();
            for i in 0..quads.len() {
                let y = |target: usize| -> f64 {
                    let own = |f: &Flipped<f64>, j: usize| {
                        f.parity[target][i * quads.len() + j] * folded[j][target ^ f.flip] as f64
                    };
                    flips.iter().flat_map(|f| (0..quads.len()).map(move |j| own(f, j))).sum()
                };
                for lane in 0..4 {
                    let unfolded: f64 = (0..4).map(|p| sign(p, lane) * y(p)).sum::<f64>() / 4.0;
                    let dense: f64 = (0..n).map(|t| matrix[(quads.taxel(i, lane), t)] * x[t] as f64).sum();
                    assert!((unfolded - dense).abs() < 1e-9 * (1.0 + dense.abs()), "{rows}×{cols} {i} {lane}");
                }
            }
        }
    }

    #[test]
    fn quantised_coefficients_fill_their_word() {
        let own = Flipped { flip: 0, parity: [vec![0.3], vec![-0.7], vec![0.0], vec![0.1]] };
        let other = |flip, value: f64| Flipped { flip, parity: [vec![0.0], vec![value], vec![0.0], vec![0.0]] };
        let folded = [vec![own, other(1, 0.003), other(3, -0.02)]];
        let blocks = &quantise(&folded, 8, false)[0];
        assert_eq!(blocks.exponent, 7);
        assert_eq!(blocks.flips[0].parity[1], vec![-90]);
        // All coefficients of flip 1 round to zero.
        assert_eq!(blocks.flips(), [0, 3]);
        assert_eq!(quantise(&folded, 8, true)[0].flips(), [0, 1, 3]);
        assert_eq!(blocks.norm(1), 93);
    }
}
