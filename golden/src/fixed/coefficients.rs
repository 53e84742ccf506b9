//! The matrices of the passes as the hardware stores them: folded into parity blocks and quantised.
//!
//! For a matrix M that commutes with the mirrors up to a sign, the folded vector `f_p(j) = Σ_l (−1)^{p·l} x(image l of j)`
//! obeys `y_{p'}(i) = Σ_j B_{p'}(i, j) f_p(j)` with
//! ```text
//! B_{p'}(i, j) = Σ over the distinct images n of j of (−1)^{p·n} M(i, image n of j)
//! ```
//! where p = p' for Cz⁺, p' with the column parity flipped for Ax, with the row parity flipped for Ay: a quarter of the
//! coefficients and products of M, and exact. Rows and columns that lie on a middle line vanish in the odd parities.
//!
//! | matrix | stored as | width | LSB |
//! |---|---|---|---|
//! | Cz⁺ | two limbs, high signed, low unsigned | `inverse_bits` | 2^−`inverse_exponent` N/MPa |
//! | Ax, Ay | −A·(4/3)·mu_max | `coef_bits` | 2^−`a_exponent` |

use faer::Mat;

use super::quads::Quads;

/// Column parity: Ax flips it.
pub const FLIP_X: usize = 1;
/// Row parity: Ay flips it.
pub const FLIP_Y: usize = 2;

/// One matrix, folded and quantised: four blocks of Q × Q, row-major, indexed by the target's parity.
#[derive(Clone, Debug, PartialEq)]
pub struct Blocks {
    /// Integer coefficients per target parity.
    pub parity: [Vec<i64>; 4],
    /// Source parity = target parity XOR `flip`.
    pub flip: usize,
    /// LSB of the coefficients is 2^−`exponent`.
    pub exponent: i32,
}

impl Blocks {
    /// Largest Σ_j |B(i, j)| over all rows and parities, in LSBs: the ∞-norm that bounds a pass.
    pub fn norm(&self, quads: usize) -> u64 {
        self.parity
            .iter()
            .flat_map(|block| block.chunks(quads))
            .map(|row| row.iter().map(|c| c.unsigned_abs()).sum())
            .max()
            .unwrap_or(0)
    }
}

/// Folds `matrix` (n × n over a subarray's row-major taxels), not yet quantised.
pub fn parity_blocks(quads: Quads, matrix: &Mat<f64>, flip: usize) -> [Vec<f64>; 4] {
    let count = quads.len();
    std::array::from_fn(|target| {
        let source = target ^ flip;
        let mut block = vec![0.0; count * count];
        for i in (0..count).filter(|&i| lives(quads, i, target)) {
            for j in (0..count).filter(|&j| lives(quads, j, source)) {
                block[i * count + j] = (0..4)
                    .filter(|lane| quads.counts(j) >> lane & 1 == 1)
                    .map(|lane| sign(source, lane) * matrix[(quads.taxel(i, 0), quads.taxel(j, lane))])
                    .sum();
            }
        }
        block
    })
}

/// Quantises folded matrices to `bits`-bit signed integers that share the largest exponent at which all fit.
pub fn quantise(folded: &[(&[Vec<f64>; 4], usize)], bits: u32) -> Vec<Blocks> {
    let largest = folded.iter().flat_map(|(blocks, _)| blocks.iter().flatten()).fold(0.0f64, |m, c| m.max(c.abs()));
    let limit = ((1i64 << (bits - 1)) - 1) as f64;
    let mut exponent = if largest > 0.0 { (limit / largest).log2().floor() as i32 } else { 0 };
    // The logarithm may round up across an integer; one step down is always enough.
    if (largest * 2f64.powi(exponent)).round() > limit {
        exponent -= 1;
    }
    folded
        .iter()
        .map(|&(blocks, flip)| Blocks {
            parity: std::array::from_fn(|p| {
                blocks[p].iter().map(|c| (c * 2f64.powi(exponent)).round() as i64).collect()
            }),
            flip,
            exponent,
        })
        .collect()
}

/// Whether quad `index` has an entry of `parity`: odd parities vanish on the middle line they mirror.
pub fn lives(quads: Quads, index: usize, parity: usize) -> bool {
    let counts = quads.counts(index);
    let own_column = counts & 0b0010 != 0;
    let own_row = counts & 0b0100 != 0;
    (own_column || parity & FLIP_X == 0) && (own_row || parity & FLIP_Y == 0)
}

/// Sign of the image `lane` under `parity`: (−1)^(parity·lane).
pub fn sign(parity: usize, lane: usize) -> f64 {
    if (parity & lane).count_ones().is_multiple_of(2) {
        1.0
    } else {
        -1.0
    }
}

#[cfg(test)]
mod tests {
    use super::super::fold::fold;
    use super::*;
    use crate::matrices::Matrices;
    use crate::sensor::Sensor;

    /// Folding, multiplying by blocks and unfolding is the dense product, for even and odd sizes.
    #[test]
    fn folded_product_is_the_dense_product() {
        for (rows, cols) in [(4, 4), (5, 4), (3, 5)] {
            let sensor = Sensor { rows, cols, pitch_x_mm: 3.0, pitch_y_mm: 4.0, thickness_mm: 3.0 };
            let matrices = Matrices::new(&sensor, 0.6).expect("a small regular sensor");
            let quads = Quads { rows, cols };
            let x: Vec<i64> = (0..rows * cols).map(|t| ((t * t * 7 + 3 * t) % 41) as i64 - 20).collect();
            let folded = fold(&quads.pack(&x));
            for (matrix, flip) in [(&matrices.cz_pinv, 0), (&matrices.ax, FLIP_X), (&matrices.ay, FLIP_Y)] {
                let blocks = parity_blocks(quads, matrix, flip);
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

    #[test]
    fn quantised_coefficients_fill_their_word() {
        let block = [vec![0.3], vec![-0.7], vec![0.0], vec![0.1]];
        let blocks = &quantise(&[(&block, 0)], 8)[0];
        assert_eq!(blocks.exponent, 7);
        assert_eq!(blocks.parity[1], vec![-90]);
        assert_eq!(blocks.norm(1), 90);
    }
}
