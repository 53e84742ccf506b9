//! The serial engine: the same stages and arithmetic on four lanes, one taxel after the other.
//!
//! For devices of a few thousand logic cells ([`EngineKind::Serial`](crate::spec::board::EngineKind)). The bit-true model is
//! that of the parallel engine; this file has what differs: memories, multipliers and cycles. At 8×8 and degree 3 on an
//! iCE40UP5K:
//!
//! | part | how | cycles |
//! |---|---|---:|
//! | normalise, fold | one shifter, one butterfly that takes a quad in four cycles; once for each limb | 290 |
//! | pass | one lane per parity, 16-bit operands, row by row | 4 480 |
//! | rescale, unfold | the same shifter and butterfly, while the lanes work on the next row | 180 |
//! | search | 16 cycles per polynomial and sweep: two Horner chains, nine candidates, one logarithm | 17 500 |
//! | force, send | one multiplier, the same shifter: 10 cycles per beat | 680 |
//!
//! The polynomials are stored in two single-port memories, in block RAM where the device has no single-port RAMs. A sweep reads one and writes the other, so neither needs a
//! second port; the polynomial about the best centre stays in its own region until a better one is found.

use super::resources::{count_bits, Holds, Memory, Resources};
use super::storage::{LaidOut, Storage};
use crate::fixed::stages::search::COARSE_CENTRES;
use crate::fixed::words::formats::{Formats, EPSILON_SHIFT, HALVINGS};
use crate::fixed::words::quantised::{coefficient, Quantised};
use crate::fixed::words::schedule::{schedule, Kind, Matrix, Operand, Product};
use crate::spec::board::Board;

/// Cycles per polynomial and sweep: one for each (i, j) with i, j ≤ 3, also beyond the degree.
pub const SLOT: u64 = 16;
/// Cycles from one quad into the butterfly to the next: four words in, four out.
pub const QUAD: u64 = 8;
/// Cycles after each part of the passes until its last word is written.
pub const DRAIN: u64 = 16;
/// Least number of cycles between two rows, in which the four accumulators are read.
const ROW_GAP: u64 = 4;
/// Latency of a sweep beyond its slots: memories, Horner chains, candidates, score.
pub const SWEEP_TAIL: u64 = 33;
/// Cycles to select the best of nine candidates: one starts every two cycles and takes five.
pub const SELECTION: u64 = 2 * 8 + 5;
/// Cycles per beat on the output.
pub const BEAT: u64 = 10;
/// Cycles from the μ words to the first output beat.
pub const FIRST_BEAT: u64 = 13;
/// Cycles to compute both μ words.
pub const MU_WORDS: u64 = 8;
/// Cycles by which the second Horner chain reads later than the first.
pub const TRANSPOSE: u64 = 18;
/// Width of the factor by which p(μ*) is multiplied, a μ word or one, in bits.
pub const FACTOR_BITS: u32 = 19;
/// Operand width of the multipliers in bits.
pub const OPERAND_BITS: u32 = 16;

/// Width of a polynomial's coefficient in memory in bits; the taxels and their sum have the same.
pub fn word_bits(formats: &Formats) -> usize {
    formats.sum_bits.iter().copied().max().unwrap_or(1) as usize
}

/// Width of ⌊Σp / 2^20⌋ in bits, at least one.
pub fn floor_bits(formats: &Formats) -> usize {
    word_bits(formats).saturating_sub(EPSILON_SHIFT as usize).max(1)
}

/// Number of polynomials of a sweep: one per taxel and their sum.
pub fn polynomials(formats: &Formats) -> usize {
    4 * formats.quads + 1
}

/// Width of a product in the force stage in bits.
pub fn product_bits(formats: &Formats) -> usize {
    (formats.search_bits[0] + FACTOR_BITS) as usize
}

/// Index of v_00 in the operand memory: the limbs of the input stand before it.
pub fn first_vector(formats: &Formats) -> usize {
    1 + usize::from(formats.input_low_bits > 0)
}

/// Index of a product's operand in the operand memory; this engine has no network.
pub fn operand_index(formats: &Formats, product: &Product) -> usize {
    match product.operand {
        Operand::InputLow => 1,
        Operand::Vector(index) => first_vector(formats) + index,
        Operand::InputHigh
        | Operand::Layer(_)
        | Operand::Window
        | Operand::Mask
        | Operand::Shear(..)
        | Operand::One => 0,
    }
}

/// Matrices with full-width operands, in order of storage; the low limb of Cz⁺ has a narrower memory.
pub const WIDE: [Kind; 3] = [Kind::InverseHigh, Kind::Ax, Kind::Ay];

/// The words of a matrix, four coefficients each, one per parity; word (row, column) is at row·2^b + column, b the
/// width of a quad's address.
pub fn coefficients(formats: &Formats, quantised: &Quantised, kind: Kind) -> Vec<[i64; 4]> {
    let side = 1 << count_bits(formats.quads);
    // The serial engine has no dead taxels: the only flip is that of the mirror symmetry.
    let own = &quantised.flips(kind)[0].parity;
    let word = |at: usize| {
        let (i, j) = (at / side, at % side);
        let inside = i < formats.quads && j < formats.quads;
        let raw = |parity: usize| coefficient(formats, kind, own[parity][i * formats.quads + j]);
        let low = formats.limb_align - formats.inverse_low_bits;
        std::array::from_fn(|parity| match (inside, kind) {
            (false, _) => 0,
            (true, Kind::InverseLow) => raw(parity) >> low,
            (true, _) => raw(parity),
        })
    };
    (0..side * side).map(word).collect()
}

/// Layout and resources of the serial engine: every column is kept, one row is computed at a time.
pub(super) fn fit(
    formats: &Formats,
    order: &[Matrix],
    quantised: &Quantised,
    board: &Board,
) -> (Vec<LaidOut>, Resources) {
    let quads = formats.quads;
    let formats = Formats { lanes_per_parity: 1, groups: quads, ..formats.clone() };
    let storage = Storage::new(order.iter().map(|&matrix| (matrix, 0)).collect(), quantised, quads, 1);
    let resources = resources(&formats, board);
    (vec![LaidOut { formats, storage, parts: 1 }], resources)
}

fn resources(f: &Formats, board: &Board) -> Resources {
    let (taxels, side) = (4 * f.quads, 1 << count_bits(f.quads));
    let memory = |holds, words: usize, bits: usize| Memory {
        holds,
        words,
        bits,
        block_rams: board.block_rams_for(words, bits),
        large_rams: 0,
    };
    // A device without single-port RAMs has its block RAMs.
    let large = |holds, words: usize, bits: usize| match board.large_rams {
        0 => memory(holds, words, bits),
        _ => Memory { block_rams: 0, large_rams: board.large_rams_for(words, bits), ..memory(holds, words, bits) },
    };
    // Each is stored twice: for the lane of its own parity and for that of the flipped parity.
    let operands = 2 << (count_bits(first_vector(f) + f.operand_vectors()) + count_bits(f.quads));
    let bank = 2 << (count_bits(polynomials(f)) + 4);
    let mut memories = vec![
        memory(Holds::Frame { case: 0, lane: 0 }, taxels, f.input_bits as usize),
        memory(Holds::TaxelOrder, 2 << count_bits(taxels), count_bits(taxels)),
        memory(Holds::Coefficients, WIDE.len() * side * side, 4 * OPERAND_BITS as usize),
    ];
    if f.inverse_low_bits > 0 {
        memories.push(memory(Holds::LowCoefficients, side * side, 4 * f.inverse_low_bits as usize));
    }
    memories.extend((0..4).map(|lane| memory(Holds::Operands(lane), operands, OPERAND_BITS as usize)));
    memories.push(memory(Holds::Raw, taxels, f.acc_bits as usize));
    memories.extend([0, 1].map(|number| large(Holds::Bank(number), bank, word_bits(f))));
    memories.push(memory(Holds::Transposed, 4 * SLOT as usize, word_bits(f)));
    memories.push(memory(Holds::Floors, SLOT as usize, floor_bits(f)));
    memories.push(memory(Holds::Totals, SLOT as usize, f.score_bits as usize + 1));
    let multipliers = vec![
        ("pass", 4 * board.multipliers_for(OPERAND_BITS, OPERAND_BITS)),
        ("forces", board.multipliers_for(f.search_bits[0], FACTOR_BITS)),
    ];
    Resources { memories, multipliers, overlaps: false }
}

/// Cycles from the last input beat to the first output beat, for a frame whose subarray is `searched` or not.
pub(super) fn first_output(formats: &Formats, searched: bool) -> u64 {
    let quads = formats.quads as u64;
    let limbs = first_vector(formats) as u64;
    let fold = limbs * (quads * QUAD + DRAIN);
    let sweep = 1 + polynomials(formats) as u64 * SLOT + SWEEP_TAIL;
    let sweeps = if searched { COARSE_CENTRES.len() as u64 + u64::from(HALVINGS) } else { 0 };
    let search = sweeps * (sweep + SELECTION) + sweep;
    START + fold + passes(formats) + search + MU_WORDS + FIRST_BEAT
}

/// Cycles from one frame to the next, which is received while the `beats` output beats of the first one leave.
pub(super) fn frame_interval(formats: &Formats, beats: u64) -> u64 {
    first_output(formats, true) + (beats - 1) * BEAT
}

/// Cycles between two rows of an array of `quads` quads: in fewer than four the products of a row are done before the butterfly
/// has given the quad of the row before, or a v_ij before the one of which the next is made has been written.
pub fn row_gap(quads: usize) -> u64 {
    let quads = quads as u64;
    let shortest = QUAD.max(DRAIN.div_ceil(quads));
    ROW_GAP.max(shortest.saturating_sub(quads))
}

/// Cycles from the first product to the end of the last v_ij.
fn passes(formats: &Formats) -> u64 {
    let quads = formats.quads as u64;
    let row = |products: &Vec<Product>| quads * (products.len() as u64 * quads + row_gap(formats.quads));
    // v_00 is replayed between the passes; there is a drain after v_00, after its replay and after the last v_ij.
    schedule(formats).iter().map(row).sum::<u64>() + quads * QUAD + 3 * DRAIN
}

/// Fraction of the cycles of the passes in which the lanes multiply; 0 to 1.
pub(super) fn lane_utilisation(formats: &Formats) -> f64 {
    let quads = formats.quads as u64;
    let products: usize = schedule(formats).iter().map(Vec::len).sum();
    (products as u64 * quads * quads) as f64 / passes(formats) as f64
}

/// Cycles from the last input beat to the first quad, and from the last value to the forces.
const START: u64 = 2;
