//! Widths and scales of the whole pipeline, derived from the scene and its matrices.
//!
//! Widths are norm bounds: the largest input times the ∞-norm of the matrix it is multiplied by is the largest output
//! of a stage, so nothing before `rescale` can overflow. `rescale` shifts v_00 to a full word by one measured exponent
//! per subarray; what does not fit is saturated and counted. Where the norms of the scaled A are below one, nothing
//! saturates.
//!
//! | word | bits | default | LSB |
//! |---|---|---|---|
//! | code | `code_bits` | 20 | full scale / (2^(code_bits − 1) − 1) |
//! | frame buffer's word | `input_bits` = `code_bits` + average | 20 | that / 2^average, times 2^−normalise |
//! | parity of the input | `fold_bits` = `input_bits` + 2 | 22 | as the code |
//! | Cz⁺ | `inverse_bits` | 24 | 2^−`inverse_exponent` N/MPa |
//! | Ax, Ay | `coef_bits` | 18 | 2^−`a_exponent` |
//! | accumulator | `acc_bits` | 42 | v_00: 2^`raw_shift` · code · Cz⁺ |
//! | v_ij, parities | `vector_bits` = `data_bits` + 4 | 22 | accumulator · 2^rescale |
//! | v_ij, operand of a pass | `data_bits` | 18 | 16 LSBs of the above |
//! | v_ij, taxels, in the search | `search_bits[k]` | 27 and less | a quarter of `vector_bits`' |
//! | Σ over taxels of v_ij | `sum_bits[k]` | | the same |
//! | log2 | `LOG_FRACTION` fraction bits | 6 | 2^−6 |
//! | μ | 18 | | 2^−`mu_fraction` |
//! | force | 32 | | `force_exponent` |

use faer::Mat;
use serde::Serialize;

use super::arith::{bit_length, signed_bits};
use super::coefficients::{parity_blocks, quantise, Blocks, Flipped};
use super::schedule::{products, vectors, Flips, Kind, Matrix, EXPONENTS};
use crate::board::{Board, EngineKind};
use crate::fixed::plan::resources::Resources;
use crate::fixed::plan::serial;
use crate::fixed::plan::storage::{storage_order, Storage};
use crate::fixed::FixedError;
use crate::matrices::Matrices;
use crate::scene::Scene;
use crate::symmetry::parity::{FLIP_X, FLIP_Y};
use crate::symmetry::quads::Quads;

/// Operand width of the multipliers in bits; a board with narrower multipliers has its own.
pub const MULTIPLIER_BITS: u32 = 18;
/// Bits by which a v_ij in the search is wider than an operand of the passes.
pub const SEARCH_EXTRA_BITS: u32 = 4;
/// ε of the sparse objective is 2^−`EPSILON_SHIFT`. Of 17 to 21, 20 comes nearest to the floating-point model on 200
/// drawn frames of each sensor.
pub const EPSILON_SHIFT: u32 = 20;
/// Fraction bits of a logarithm.
pub const LOG_FRACTION: u32 = 6;
/// The logarithm's table has 2^`LOG_TABLE_BITS` entries.
pub const LOG_TABLE_BITS: u32 = 4;
/// Halvings of the search step after the coarse grid.
pub const HALVINGS: u32 = 7;
/// μ is counted in mu_max / (3·2^7): the grid's step after all halvings.
pub const MU_STEPS: i64 = 3 << HALVINGS;
/// Right shift from X·`mu_step` to a μ word, X a search position.
pub const MU_ROUND: u32 = 8;
/// Width of a force word on the output stream.
pub const FORCE_BITS: u32 = 32;
/// Largest right shift of the force stage; a larger one would shift out every product.
pub const FORCE_SHIFT_MAX: u32 = 62;
/// Fewest lanes per parity; with fewer, the lanes would wait for the accumulators to be shifted out.
const MIN_LANES: usize = 4;
/// Largest grid coordinate that coarse tiles and candidates beyond the disc reach.
const REACH: u64 = 4;

/// Widths and scales of one scene's pipeline, widths in bits; see the table of the module.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Formats {
    /// Degree of p(μ).
    pub degree: usize,
    /// Quads per subarray, Q.
    pub quads: usize,
    /// Matrix lanes per parity; the engine has four times as many.
    pub lanes_per_parity: usize,
    /// Groups of `lanes_per_parity` rows that a pass computes one after the other.
    pub groups: usize,
    /// Ay is Ax with x and y exchanged and is not stored.
    pub shared_a: bool,
    /// Parity flips of the matrices; serialised where the mirror symmetry is broken.
    #[serde(skip_serializing_if = "Flips::are_symmetric")]
    pub flips: Flips,
    /// Width of a code on the input stream.
    pub code_bits: u32,
    /// Width of a word of the frame buffer: a code, or a sum of several.
    pub input_bits: u32,
    /// Width of a folded input.
    pub fold_bits: u32,
    /// Width of the low limb of the folded input, 0 if the input fits one multiplier operand.
    pub input_low_bits: u32,
    /// Width of Cz⁺.
    pub inverse_bits: u32,
    /// Width of the low limb of Cz⁺, 0 if Cz⁺ fits one multiplier operand.
    pub inverse_low_bits: u32,
    /// The larger of the two low limbs' widths: the left shift of the product of the high limbs.
    pub limb_align: u32,
    /// LSB of the raw v_00 is 2^`raw_shift` times the LSBs of its factors.
    pub raw_shift: u32,
    /// LSB of Cz⁺ is 2^−`inverse_exponent` N/MPa.
    pub inverse_exponent: i32,
    /// Width of Ax, Ay.
    pub coef_bits: u32,
    /// LSB of −A·(4/3)·mu_max is 2^−`a_exponent`.
    pub a_exponent: i32,
    /// Width of an accumulator.
    pub acc_bits: u32,
    /// Largest bit length of a raw v_00.
    pub raw_length_max: u32,
    /// Width of an operand of the passes.
    pub data_bits: u32,
    /// Width of a v_ij in parities, after `rescale`.
    pub vector_bits: u32,
    /// Right shift from the accumulator of an A pass to a v_ij.
    pub a_shift: u32,
    /// Width of each v_ij in the search memory, in order of [`EXPONENTS`].
    pub search_bits: Vec<u32>,
    /// Width of Σ over taxels of each v_ij.
    pub sum_bits: Vec<u32>,
    /// Width of a score.
    pub score_bits: u32,
    /// Fraction bits of a μ word.
    pub mu_fraction: u32,
    /// μ per step of the search, in 2^−(`mu_fraction` + `MU_ROUND`).
    pub mu_step: i64,
    /// LSB of a force word is 2^`force_exponent` · code LSB in MPa · 1 N/MPa.
    pub force_exponent: i32,
}

/// Quantised matrices of one subarray shape.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantised {
    /// Cz⁺.
    pub inverse: Blocks,
    /// −Ax·(4/3)·mu_max.
    pub ax: Blocks,
    /// −Ay·(4/3)·mu_max.
    pub ay: Blocks,
}

/// What is derived from a scene's matrices for one case.
#[derive(Clone, Debug)]
pub struct Design {
    /// Widths and scales.
    pub formats: Formats,
    /// The matrices as stored.
    pub quantised: Quantised,
    /// The coefficient memory's layout.
    pub storage: Storage,
    /// Memories and multipliers of the whole design.
    pub resources: Resources,
}

/// The subarrays of a case: their common matrices and their number.
#[derive(Clone, Debug)]
pub struct Shape {
    /// Matrices of one subarray.
    pub matrices: Matrices,
    /// Number of subarrays.
    pub parts: usize,
}

impl Shape {
    fn quads(&self) -> Quads {
        Quads { rows: self.matrices.sensor.rows, cols: self.matrices.sensor.cols }
    }
}

/// Quantises the matrices of a scene's cases, derives all formats, lays out the coefficient memory and counts the
/// resources, whether `board` has them or not. Where there are several cases the whole array's is the first. They share
/// the hardware: every word has the width and scale that serves all of them, and only `quads` and `groups` differ.
///
/// # Errors
/// [`FixedError::Format`] if a word needs more than the 48-bit accumulator, or a norm of A more headroom than the data
/// word has.
pub fn derive(scene: &Scene, shapes: &[Shape], board: &Board) -> Result<Vec<Design>, FixedError> {
    let spec = &scene.fixed;
    let largest = shapes.first().ok_or(FixedError::Internal("a scene has a case"))?;
    let degree = shapes.iter().map(|shape| shape.matrices.degree).max().unwrap_or(0);
    // Narrower multipliers have narrower operands; the remaining bits of inverse and input go into low limbs.
    let operand_bits = MULTIPLIER_BITS.min(board.multiplier_bits);
    let (data_bits, coef_bits) = (spec.data_bits.min(operand_bits), spec.coef_bits.min(operand_bits));
    let mut quantised = quantised(scene, shapes, coef_bits)?;
    // The largest of a bound over all cases.
    let bound = |of: &dyn Fn(&Quantised, usize) -> u64| {
        let each = quantised.iter().zip(shapes).map(|(quantised, shape)| of(quantised, shape.quads().len()));
        each.max().unwrap_or(0)
    };
    // The same in all cases: a scene with dead taxels, which break the symmetry, has one case and one subarray.
    let Quantised { inverse, ax, ay } = &quantised[0];
    let flips = Flips { inverse: inverse.flips(), ax: ax.flips(), ay: ay.flips() };

    let sensor = &largest.matrices.sensor;
    // Where all subarrays are square, one matrix is used for both axes.
    let square = sensor.rows == sensor.cols && sensor.pitch_x_mm == sensor.pitch_y_mm;
    let serial = board.engine == EngineKind::Serial;
    let shared_a = !serial && degree == 1 && square && shapes.len() == 1 && flips.are_symmetric();

    let input_bits = spec.input_bits + scene.input.average;
    let fold_bits = input_bits + 2;
    let input_low_bits = fold_bits.saturating_sub(operand_bits);
    if input_low_bits >= operand_bits {
        return Err(FixedError::Format { what: "folded input", needs: fold_bits, has: 2 * operand_bits - 1 });
    }
    let inverse_low_bits = spec.inverse_bits.saturating_sub(operand_bits);
    let limb_align = input_low_bits.max(inverse_low_bits);
    let raw_shift = input_low_bits.min(inverse_low_bits);

    // v_00 in units of 2^raw_shift: the folded input reaches 2^(fold_bits − 1); one unit more for each dropped low·low
    // product.
    let raw_bound = bound(&|quantised, count| {
        let dropped = (count * flips.inverse.len()) as u64;
        ((u128::from(quantised.inverse.norm(count)) << (fold_bits - 1)) >> raw_shift) as u64 + 2 * dropped
    });
    let a_bound = bound(&|quantised, count| (quantised.ax.norm(count) + quantised.ay.norm(count)) << (data_bits - 1));
    let acc_bits = signed_bits(raw_bound.max(a_bound));
    if acc_bits > 48 {
        return Err(FixedError::Format { what: "accumulator", needs: acc_bits, has: 48 });
    }
    // Scales are the same in all cases.
    let (inverse_exponent, a_exponent) = (quantised[0].inverse.exponent, quantised[0].ax.exponent);
    let vector_bits = data_bits + SEARCH_EXTRA_BITS;
    let a_shift = if degree == 0 { 0 } else { a_exponent - SEARCH_EXTRA_BITS as i32 };
    let a_shift = u32::try_from(a_shift).map_err(|_| FixedError::Format {
        what: "scaled A (mu_max too large for this sensor)",
        needs: SEARCH_EXTRA_BITS,
        has: a_exponent.max(0) as u32,
    })?;

    let each = quantised.iter().zip(shapes);
    let growths: Vec<Vec<f64>> =
        each.map(|(q, shape)| growth(&q.ax, &q.ay, shape.quads().len(), EXPONENTS.len())).collect();
    let growth = |k: usize| growths.iter().map(|growth| growth[k]).fold(0.0, f64::max);
    let taxel_max = 1u64 << (vector_bits + 1);
    let used = vectors(degree);
    let coefficients: Vec<u64> = (0..used)
        .map(|k| {
            let (i, j) = EXPONENTS[k];
            ((taxel_max as f64 * growth(k).min(1.0)) / 4f64.powi((i + j) as i32)).ceil() as u64 + 1
        })
        .collect();
    let shifted: Vec<u64> = (0..used).map(|k| reach(&coefficients, k)).collect();
    let taxels = (sensor.rows * sensor.cols) as u64;
    // Without a search v_00 keeps its unfolded width.
    let search_bits: Vec<u32> = match degree {
        0 => vec![vector_bits + 2],
        _ => shifted.iter().map(|&bound| signed_bits(bound)).collect(),
    };
    let sum_bits: Vec<u32> = shifted.iter().map(|&bound| signed_bits(bound * taxels)).collect();

    // A logarithm is below 2^6; the difference of two sums of `taxels` of them needs a sign.
    let score_bits = signed_bits(taxels << (6 + LOG_FRACTION));
    // 18 bits of μ; fz, with its factor 1, needs no more fraction than that.
    let mu_fraction = (f64::from((1 << 17) - 1) / scene.search.mu_max).log2().floor().min(17.0) as u32;
    let mu_step = (scene.search.mu_max / MU_STEPS as f64 * 2f64.powi((mu_fraction + MU_ROUND) as i32)).round() as i64;

    let raw_length_max = bit_length(raw_bound);
    let rescale_max = raw_length_max.saturating_sub(vector_bits - 1);
    let headroom = FORCE_BITS - search_bits[0];
    let limbs = (input_low_bits > 0, inverse_low_bits > 0);
    let order = storage_order(&products(degree, limbs, shared_a, &flips));
    let count = largest.quads().len();
    let formats = Formats {
        degree,
        quads: count,
        lanes_per_parity: count,
        groups: 1,
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
        force_exponent: raw_shift as i32 - inverse_exponent - 2 + rescale_max as i32 - headroom as i32,
    };
    let (laid_out, resources) = match serial {
        true => serial::fit(&formats, &order, &quantised[0], board),
        false => fit(&formats, &order, &quantised, scene, shapes, board),
    };
    let design = |((laid_out, mut quantised), shape): ((LaidOut, Quantised), &Shape)| {
        let LaidOut { formats, storage, .. } = laid_out;
        storage.zero_pruned(&mut quantised, shape.quads().len(), formats.lanes_per_parity);
        Design { formats, quantised, storage, resources: resources.clone() }
    };
    Ok(laid_out.into_iter().zip(quantised.drain(..)).zip(shapes).map(design).collect())
}

/// The matrices of all cases as stored, on one scale.
fn quantised(scene: &Scene, shapes: &[Shape], coef_bits: u32) -> Result<Vec<Quantised>, FixedError> {
    let spec = &scene.fixed;
    let scale = -4.0 / 3.0 * scene.search.mu_max;
    // A dead taxel breaks the mirror symmetry: then every flip is tried, that of the symmetry first.
    let looked_at = if scene.input.dead.is_empty() { 1 } else { 4 };
    let folded = |shape: &Shape, matrix: &Mat<f64>, own: usize, scale: f64| -> Vec<Flipped<f64>> {
        let scaled = |Flipped { flip, parity }| {
            let parity: [Vec<f64>; 4] = parity;
            Flipped { flip, parity: parity.map(|block| block.iter().map(|c| c * scale).collect()) }
        };
        (0..looked_at).map(|other| scaled(parity_blocks(shape.quads(), matrix, own ^ other))).collect()
    };
    let inverses: Vec<_> = shapes.iter().map(|shape| folded(shape, &shape.matrices.cz_pinv, 0, 1.0)).collect();
    let pair = |shape: &Shape| {
        [folded(shape, &shape.matrices.ax, FLIP_X, scale), folded(shape, &shape.matrices.ay, FLIP_Y, scale)]
    };
    let pairs: Vec<_> = shapes.iter().flat_map(pair).collect();
    let mut inverses = quantise(&inverses, spec.inverse_bits).into_iter();
    let mut pairs = quantise(&pairs, coef_bits).into_iter();
    let mut next = || Some(Quantised { inverse: inverses.next()?, ax: pairs.next()?, ay: pairs.next()? });
    shapes.iter().map(|_| next().ok_or(FixedError::Internal("as many matrices out as in"))).collect()
}

/// A case with its lanes and its part of the coefficient memory.
#[derive(Clone, Debug)]
pub struct LaidOut {
    /// Widths, lanes and groups of rows of the case.
    pub formats: Formats,
    /// The columns kept in the coefficient memory.
    pub storage: Storage,
    /// Number of subarrays.
    pub parts: usize,
}

/// Chooses lanes and memories: the scene's number of lanes, else the most for which there is block RAM. Block RAM is
/// preferred to distributed RAM, since a deep distributed RAM is the longest path of its design.
fn fit(
    formats: &Formats,
    matrices: &[Matrix],
    quantised: &[Quantised],
    scene: &Scene,
    shapes: &[Shape],
    board: &Board,
) -> (Vec<LaidOut>, Resources) {
    let (quads, prune_bits) = (formats.quads, scene.fixed.prune_bits);
    let largest = |quantised: &Quantised| quantised.inverse.coefficients().map(|c| c.abs()).max().unwrap_or(0);
    let threshold = |quantised: &Quantised, matrix: Matrix| match matrix.kind {
        Kind::InverseHigh | Kind::InverseLow => largest(quantised) >> prune_bits,
        Kind::Ax => 2f64.powi(quantised.ax.exponent - prune_bits as i32) as i64,
        Kind::Ay => 2f64.powi(quantised.ay.exponent - prune_bits as i32) as i64,
    };
    let with = |groups: usize| {
        let lanes_per_parity = quads.div_ceil(groups);
        let lay_out = |(quantised, shape): (&Quantised, &Shape)| {
            let quads = shape.quads().len();
            let formats =
                Formats { quads, lanes_per_parity, groups: quads.div_ceil(lanes_per_parity), ..formats.clone() };
            let limits = matrices.iter().map(|&matrix| (matrix, threshold(quantised, matrix))).collect();
            let storage = Storage::new(limits, quantised, quads, lanes_per_parity);
            LaidOut { formats, storage, parts: shape.parts }
        };
        let mut laid_out: Vec<LaidOut> = quantised.iter().zip(shapes).map(lay_out).collect();
        Storage::share(laid_out.iter_mut().map(|case| (&mut case.storage, case.formats.clone())));
        let [first, second] = board.distributed_words.map(|shallow| Resources::new(&laid_out, scene, board, shallow));
        let resources = if first.fits(board) { first } else { second };
        (laid_out, resources)
    };
    let product = board.multipliers_for(MULTIPLIER_BITS, MULTIPLIER_BITS);
    // The multipliers of the other blocks do not depend on the number of lanes.
    let all = with(1);
    let others = all.1.multipliers() - 4 * quads * product;
    let left = (board.multipliers as usize).saturating_sub(others);
    let least = MIN_LANES.min(quads);
    let per_parity = match scene.fixed.lanes {
        Some(lanes) => (lanes as usize / 4).clamp(1, quads)..=(lanes as usize / 4).clamp(1, quads),
        None => least..=(left / (4 * product)).clamp(least, quads),
    };
    let mut groups: Vec<usize> = per_parity.rev().map(|lanes| quads.div_ceil(lanes)).collect();
    groups.dedup();
    // Where nothing fits, the design with the fewest block RAMs.
    let mut leanest: Option<(Vec<LaidOut>, Resources)> = None;
    for groups in groups {
        let design = with(groups);
        if design.1.fits(board) {
            return design;
        }
        if leanest.as_ref().is_none_or(|leanest| design.1.block_rams() < leanest.1.block_rams()) {
            leanest = Some(design);
        }
    }
    leanest.unwrap_or(all)
}

/// The right shift of the force stage for a subarray shifted left by `normalise` and right by `rescale`: the fraction
/// of the μ word plus the distance of the subarray's exponent from that of the force word.
pub fn force_shift(formats: &Formats, normalise: u32, rescale: u32) -> u32 {
    let rescale_max = formats.raw_length_max.saturating_sub(formats.vector_bits - 1);
    let headroom = FORCE_BITS - formats.search_bits[0];
    (formats.mu_fraction + rescale_max + normalise).saturating_sub(headroom + rescale).min(FORCE_SHIFT_MAX)
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
