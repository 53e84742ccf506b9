//! The widths and scales of a scene's pipeline, from the norms of its quantised matrices.
//!
//! The largest input times the ∞-norm of the matrix it is multiplied by is the largest output of a stage;
//! [`formats`](crate::fixed::words::formats) has the table of the words.

use faer::Mat;

use crate::estimate::learned::{ComposedLayer, Learned};
use crate::fixed::error::FixedError;
use crate::fixed::stages::send::LN_SIGMA_BITS;
use crate::fixed::words::arith::{bit_length, signed_bits};
use crate::fixed::words::coefficients::{parity_blocks, quantise, Blocks, Flipped, Flips};
use crate::fixed::words::formats::{
    Formats, FORCE_BITS, LOG_FRACTION, MULTIPLIER_BITS, MU_ROUND, MU_STEPS, SEARCH_EXTRA_BITS,
};
use crate::fixed::words::network::WordNetwork;
use crate::fixed::words::quantised::Quantised;
use crate::fixed::words::schedule::{vectors, EXPONENTS};
use crate::physics::matrices::Matrices;
use crate::physics::symmetry::parity::{FLIP_X, FLIP_Y};
use crate::spec::board::{Board, EngineKind};
use crate::spec::quads::Quads;
use crate::spec::scene::{EstimatorKind, Scene};

/// Largest grid coordinate that coarse tiles and candidates beyond the disc reach.
const REACH: u64 = 4;

/// The subarrays of a case: their common matrices and their number.
#[derive(Clone, Debug)]
pub struct CaseMatrices {
    /// Matrices of one subarray.
    pub matrices: Matrices,
    /// Number of subarrays.
    pub parts: usize,
}

impl CaseMatrices {
    /// The quad layout of a subarray.
    pub fn quads(&self) -> Quads {
        Quads { rows: self.matrices.sensor.rows, cols: self.matrices.sensor.cols }
    }

    /// The case with all coefficients times `factor`.
    pub fn scaled(mut self, factor: f64) -> CaseMatrices {
        for matrix in [&mut self.matrices.cz_pinv, &mut self.matrices.ax, &mut self.matrices.ay] {
            *matrix *= faer::Scale(factor);
        }
        self
    }
}

/// The widths of all words, and the matrices in these widths.
pub struct Widths {
    /// Widths and scales, the same in all cases but for quads, lanes and groups.
    pub formats: Formats,
    /// The matrices of each case on one scale.
    pub quantised: Vec<Quantised>,
}

/// Quantises the matrices of a scene's cases and derives the widths of all words; `board` has the multipliers. Where
/// there are several cases the whole array's is the first. They share the hardware: every word has the width and scale
/// that serves all of them, and `specimens`, whose coefficients may be written at run time. The formats are those of the first
/// case with a lane for each row.
///
/// # Errors
/// [`FixedError::Format`] if a word needs more than the 48-bit accumulator, or a norm of A more headroom than the data
/// word has.
pub fn widths(
    scene: &Scene,
    cases: &[CaseMatrices],
    specimens: &[CaseMatrices],
    board: &Board,
) -> Result<Widths, FixedError> {
    let spec = &scene.fixed;
    let largest = cases.first().ok_or(FixedError::Internal("a scene has a case"))?;
    let all: &Vec<&CaseMatrices> = &cases.iter().chain(specimens).collect();
    let degree = all.iter().map(|case| case.matrices.degree).max().unwrap_or(0);
    // Narrower multipliers have narrower operands; the remaining bits of inverse and input go into low limbs.
    let operand_bits = MULTIPLIER_BITS.min(board.multiplier_bits[1]);
    let (data_bits, coef_bits) = (spec.data_bits.min(operand_bits), spec.coef_bits.min(operand_bits));
    let mut quantised = quantised(scene, all, coef_bits)?;
    let composed = composed(scene)?;
    // The same in all cases: a scene with dead taxels, which break the symmetry, has one case and one subarray.
    let Quantised { inverse, ax, ay, .. } = &quantised[0];
    let flips = Flips { inverse: inverse.flips(), ax: ax.flips(), ay: ay.flips() };

    let sensor = &largest.matrices.sensor;
    // Where all subarrays are square, one matrix is used for both axes.
    let square = sensor.rows == sensor.cols && sensor.pitch_x_mm == sensor.pitch_y_mm;
    let serial = board.engine == EngineKind::Serial;
    let shared_a = !serial && degree == 1 && square && cases.len() == 1 && flips.are_symmetric() && composed.is_empty();

    let input_bits = spec.input_bits + scene.input.longest_average();
    let limbs = Limbs::new(input_bits, spec.inverse_bits, operand_bits)?;
    let Limbs { fold_bits, input_low_bits, inverse_low_bits, align: limb_align, raw_shift } = limbs;
    let counts = all.iter().map(|case| case.quads().len());
    let Sums { raw_bound, acc_bits, lane_bits } =
        limbs.sums(quantised.iter().zip(counts), flips.inverse.len(), data_bits)?;
    // Scales are the same in all cases.
    let (inverse_exponent, a_exponent) = (quantised[0].inverse.exponent, quantised[0].ax.exponent);
    let vector_bits = data_bits + SEARCH_EXTRA_BITS;
    let a_shift = if degree == 0 { 0 } else { a_shift(a_exponent)? };

    let each = quantised.iter().zip(all);
    let growths: Vec<Vec<f64>> =
        each.map(|(q, case)| growth(&q.ax, &q.ay, case.quads().len(), EXPONENTS.len())).collect();
    let headroom = if composed.is_empty() { 0 } else { headroom(&growths, degree) };
    let taxels = (sensor.rows * sensor.cols) as u64;
    let shifted = shifted(&growths, degree, vector_bits);
    // Without a search p keeps its unfolded width.
    let search_bits: Vec<u32> = match degree > 0 && composed.is_empty() {
        true => shifted.iter().map(|&bound| signed_bits(bound)).collect(),
        false => vec![vector_bits + 2],
    };
    let sum_bits: Vec<u32> = shifted.iter().map(|&bound| signed_bits(bound * taxels)).collect();

    // A logarithm is below 2^6; the difference of two sums of `taxels` of them needs a sign.
    // With a network its word holds two ln σ.
    let score_bits = if composed.is_empty() { signed_bits(taxels << (6 + LOG_FRACTION)) } else { 2 * LN_SIGMA_BITS };
    let (mu_fraction, mu_step) = mu_scale(scene.search.mu_max);

    let raw_length_max = bit_length(raw_bound);
    let rescale_max = raw_length_max.saturating_sub(vector_bits - 1 - headroom);
    let force_headroom = FORCE_BITS - search_bits[0];
    let count = largest.quads().len();
    let formats = Formats {
        degree,
        quads: count,
        lanes_per_parity: count,
        groups: 1,
        search_width: if composed.is_empty() { search_width(scene, board, degree, cases) } else { Quads::LANES },
        layers: composed.iter().map(|layer| layer.bias[0].len()).collect(),
        // The mask is that of a window.
        window_quads: composed.first().and_then(|layer| layer.mask.as_ref()).map(|mask| mask[0].ncols()),
        headroom,
        shared_a,
        flips,
        code_bits: spec.input_bits,
        input_bits,
        fold_bits,
        input_low_bits,
        inverse_bits: spec.inverse_bits,
        inverse_low_bits,
        limb_align,
        raw_shift,
        inverse_exponent,
        coef_bits,
        a_exponent,
        acc_bits,
        lane_bits,
        raw_length_max,
        data_bits,
        vector_bits,
        a_shift,
        search_bits,
        sum_bits,
        score_bits,
        mu_fraction,
        mu_step,
        // Taxels are in quarters of a vector's LSB; the largest rescale must still fit the force word.
        force_exponent: raw_shift as i32 - inverse_exponent - 2 + rescale_max as i32 - force_headroom as i32,
    };
    if !composed.is_empty() {
        let network = WordNetwork::new(&formats, &composed);
        let missing = FixedError::Format { what: "network", needs: formats.lane_bits + 1, has: formats.lane_bits };
        quantised[0].network = Some(network.ok_or(missing)?);
    }
    quantised.truncate(cases.len());
    Ok(Widths { formats, quantised })
}

/// How the operands of the first pass are cut into limbs.
struct Limbs {
    /// Width of the folded input.
    fold_bits: u32,
    /// Widths of the low limbs of input and inverse.
    input_low_bits: u32,
    inverse_low_bits: u32,
    /// Left shift of the product of two high limbs.
    align: u32,
    /// The sums are in units of 2^`raw_shift`.
    raw_shift: u32,
}

/// Bound of v_00, widths of an accumulator and of a lane's sum.
struct Sums {
    raw_bound: u64,
    acc_bits: u32,
    lane_bits: u32,
}

impl Limbs {
    fn new(input_bits: u32, inverse_bits: u32, operand_bits: u32) -> Result<Limbs, FixedError> {
        let fold_bits = input_bits + 2;
        let input_low_bits = fold_bits.saturating_sub(operand_bits);
        if input_low_bits >= operand_bits {
            return Err(FixedError::Format { what: "folded input", needs: fold_bits, has: 2 * operand_bits - 1 });
        }
        let inverse_low_bits = inverse_bits.saturating_sub(operand_bits);
        let [align, raw_shift] = [input_low_bits.max(inverse_low_bits), input_low_bits.min(inverse_low_bits)];
        Ok(Limbs { fold_bits, input_low_bits, inverse_low_bits, align, raw_shift })
    }

    /// The largest sums over all cases and specimens, each with its number of quads; `flips` are those of Cz⁺.
    fn sums<'a>(
        &self,
        each: impl Iterator<Item = (&'a Quantised, usize)> + Clone,
        flips: usize,
        data_bits: u32,
    ) -> Result<Sums, FixedError> {
        let Limbs { fold_bits, input_low_bits, inverse_low_bits, align, raw_shift } = *self;
        let bound = |of: &dyn Fn(&Quantised, usize) -> u64| {
            each.clone().map(|(quantised, count)| of(quantised, count)).max().unwrap_or(0)
        };
        let products = |count: usize| (count * flips) as u64;
        // v_00 in units of 2^raw_shift: the folded input reaches 2^(fold_bits − 1); one unit more for each dropped low·low
        // product.
        let raw_bound = bound(&|quantised, count| {
            ((u128::from(quantised.inverse.norm(count)) << (fold_bits - 1)) >> raw_shift) as u64 + 2 * products(count)
        });
        let a_bound =
            bound(&|quantised, count| (quantised.ax.norm(count) + quantised.ay.norm(count)) << (data_bits - 1));
        let acc_bits = signed_bits(raw_bound.max(a_bound));
        if acc_bits > 48 {
            return Err(FixedError::Format { what: "accumulator", needs: acc_bits, has: 48 });
        }
        // The lanes add up the products of the low limbs and those of the high limbs of v_00 each on their own.
        let high_input = 1u64 << (fold_bits - 1 - input_low_bits);
        let lane_bound = bound(&|quantised, count| {
            let products = products(count);
            let high_norm = (quantised.inverse.norm(count) >> inverse_low_bits) + products;
            let of_input = if input_low_bits > 0 { high_norm << align } else { 0 };
            let of_inverse = if inverse_low_bits > 0 { (products * high_input) << align } else { 0 };
            (high_norm * high_input).max(of_input + of_inverse)
        });
        let lane_bits = signed_bits(lane_bound.max(a_bound)).min(acc_bits);
        Ok(Sums { raw_bound, acc_bits, lane_bits })
    }
}

/// Right shift of the products with A, from the exponent of its coefficients.
fn a_shift(a_exponent: i32) -> Result<u32, FixedError> {
    u32::try_from(a_exponent - SEARCH_EXTRA_BITS as i32).map_err(|_| FixedError::Format {
        what: "scaled A (mu_max too large for this sensor)",
        needs: SEARCH_EXTRA_BITS,
        has: a_exponent.max(0) as u32,
    })
}

/// Fraction bits of a μ word, and μ per step of the search.
fn mu_scale(mu_max: f64) -> (u32, i64) {
    // 18 bits of μ; fz, with its factor 1, needs no more fraction than that.
    let fraction = (f64::from((1 << 17) - 1) / mu_max).log2().floor().min(17.0) as u32;
    (fraction, (mu_max / MU_STEPS as f64 * 2f64.powi((fraction + MU_ROUND) as i32)).round() as i64)
}

/// Bounds of the coefficients of a taxel's polynomial wherever its centre is, from the growths of the cases.
fn shifted(growths: &[Vec<f64>], degree: usize, vector_bits: u32) -> Vec<u64> {
    let growth = |k: usize| growths.iter().map(|growth| growth[k]).fold(0.0, f64::max);
    let taxel_max = 1u64 << (vector_bits + 1);
    let used = vectors(degree);
    let coefficients: Vec<u64> = (0..used)
        .map(|k| {
            let (i, j) = EXPONENTS[k];
            ((taxel_max as f64 * growth(k).min(1.0)) / 4f64.powi((i + j) as i32)).ceil() as u64 + 1
        })
        .collect();
    (0..used).map(|k| reach(&coefficients, k)).collect()
}

/// The layers of the network that gives μ; none with a search.
fn composed(scene: &Scene) -> Result<Vec<ComposedLayer>, FixedError> {
    match scene.hardware_estimator() {
        kind @ EstimatorKind::Network => {
            Ok(Learned::of_scene(scene, kind)?.composed(&scene.input.alive(&scene.sensor)))
        }
        _ => Ok(Vec::new()),
    }
}

/// Bits by which p may be larger than v_00 after `steps` of `relax`: Σ r^k, r the norm of the product of a step at any μ.
fn headroom(growths: &[Vec<f64>], steps: usize) -> u32 {
    // The scaled matrices hold 4/3 of mu_max; |μ| is at most that.
    let of = |growth: &Vec<f64>| -> f64 {
        let largest = 0.75 * growth[1].hypot(growth[2]);
        (0..=steps as i32).map(|k| largest.powi(k)).sum()
    };
    growths.iter().map(of).fold(1.0, f64::max).log2().ceil() as u32
}

/// Taxels that the search computes per cycle: the scene's number, else the board's. What is not searched passes on in
/// quads; one quad alone is not worth a step for each of its taxels; where the case is chosen per frame, the values of all
/// cases begin alike.
fn search_width(scene: &Scene, board: &Board, degree: usize, cases: &[CaseMatrices]) -> usize {
    match cases {
        [only] if degree > 0 && only.quads().len() > 1 => scene.hardware.search_width.unwrap_or(board.search_width),
        _ => Quads::LANES,
    }
}

/// The matrices of all cases as stored, on one scale.
fn quantised(scene: &Scene, cases: &[&CaseMatrices], coef_bits: u32) -> Result<Vec<Quantised>, FixedError> {
    let spec = &scene.fixed;
    let scale = -4.0 / 3.0 * scene.search.mu_max;
    // A dead taxel breaks the mirror symmetry: then every flip is tried, that of the symmetry first.
    let range = &scene.hardware.table_range;
    let looked_at = if scene.input.dead.is_empty() && range.dead_taxels == 0 { 1 } else { 4 };
    let folded = |case: &CaseMatrices, matrix: &Mat<f64>, own: usize, scale: f64| -> Vec<Flipped<f64>> {
        let scaled = |Flipped { flip, parity }| {
            let parity: [Vec<f64>; 4] = parity;
            Flipped { flip, parity: parity.map(|block| block.iter().map(|c| c * scale).collect()) }
        };
        (0..looked_at).map(|other| scaled(parity_blocks(case.quads(), matrix, own ^ other))).collect()
    };
    let inverses: Vec<_> = cases.iter().map(|case| folded(case, &case.matrices.cz_pinv, 0, 1.0)).collect();
    let pair = |case: &&CaseMatrices| {
        [folded(case, &case.matrices.ax, FLIP_X, scale), folded(case, &case.matrices.ay, FLIP_Y, scale)]
    };
    let pairs: Vec<_> = cases.iter().flat_map(pair).collect();
    // What is zero here need not be so in another specimen.
    let all_flips = range.has_coefficients();
    let mut inverses = quantise(&inverses, spec.inverse_bits, all_flips).into_iter();
    let mut pairs = quantise(&pairs, coef_bits, all_flips).into_iter();
    let mut next =
        || Some(Quantised { inverse: inverses.next()?, ax: pairs.next()?, ay: pairs.next()?, network: None });
    cases.iter().map(|_| next().ok_or(FixedError::Internal("as many matrices out as in"))).collect()
}

/// Bounds of ‖v_ij‖∞ / ‖v_00‖∞ from the ∞-norms of the stored A.
fn growth(ax: &Blocks, ay: &Blocks, quads: usize, count: usize) -> Vec<f64> {
    let unit = 2f64.powi(-ax.exponent);
    let (x, y) = (ax.norm(quads) as f64 * unit, ay.norm(quads) as f64 * unit);
    let mut bounds: Vec<f64> = Vec::with_capacity(count);
    for &(i, j) in &EXPONENTS[..count] {
        let of = |i: u32, j: u32| EXPONENTS.iter().position(|&e| e == (i, j)).and_then(|k| bounds.get(k).copied());
        let bound = match (i, j) {
            (0, 0) => 1.0,
            _ => {
                let left = i.checked_sub(1).and_then(|i| of(i, j)).unwrap_or(0.0);
                let below = j.checked_sub(1).and_then(|j| of(i, j)).unwrap_or(0.0);
                x * left + y * below
            }
        };
        bounds.push(bound);
    }
    bounds
}

/// Bound of coefficient k after the centre has moved anywhere within ±[`REACH`]: Σ |v_ij| C(i, k) C(j, l)
/// REACH^(i−k+j−l).
fn reach(stored: &[u64], k: usize) -> u64 {
    let (ki, kj) = EXPONENTS[k];
    let choose = |n: u32, k: u32| (0..k).fold(1u64, |c, t| c * u64::from(n - t) / u64::from(t + 1));
    stored
        .iter()
        .zip(EXPONENTS)
        .filter(|(_, (i, j))| *i >= ki && *j >= kj)
        .map(|(&bound, (i, j))| bound * choose(i, ki) * choose(j, kj) * REACH.pow(i - ki + j - kj))
        .sum()
}
