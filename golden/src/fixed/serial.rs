//! The serial schedule: the same stages and the same arithmetic on four lanes, one taxel after the other.
//!
//! For devices of a few thousand logic cells ([`EngineKind::Serial`](crate::board::EngineKind)). The bit-true model is the one
//! of the parallel engine; what differs is here: memories, multipliers and cycles. At 8×8 and degree 3 on an iCE40UP5K:
//!
//! | part | how | cycles |
//! |---|---|---:|
//! | normalise, fold | one shifter, one butterfly that takes a quad in four cycles; once for each limb | 290 |
//! | pass | one lane per parity, 16-bit operands, row by row | 4 480 |
//! | rescale, unfold | the same shifter and butterfly, while the lanes work on the next row | 180 |
//! | search | 16 cycles per polynomial and sweep: two Horner chains, nine candidates, one logarithm | 17 500 |
//! | force, send | one multiplier, the same shifter: 10 cycles per beat | 680 |
//!
//! The polynomials lie in two single-port memories. A sweep reads one and writes the other, so that neither needs a second
//! port; the polynomial about the best centre stays in a region of its own until a better one is found.

use super::cycles::Cycles;
use super::formats::{Formats, LaidOut, Quantised, EPSILON_SHIFT, HALVINGS};
use super::model::Model;
use super::pass::coefficient;
use super::resources::{count_bits, operand_vectors, Memory, Resources};
use super::schedule::{schedule, Kind, Matrix, Operand, Product};
use super::search::COARSE_CENTRES;
use super::send::STATUS_BEATS;
use super::storage::Storage;
use crate::board::Board;

/// Cycles per polynomial and sweep: one for each v_ij with i, j ≤ 3, those beyond the degree included.
pub const SLOT: u64 = 16;
/// From one quad into the butterfly to the next: four in, four out.
pub const QUAD: u64 = 8;
/// After each part of the passes, until its last word has been written.
pub const DRAIN: u64 = 16;
/// Cycles between two rows, in which the four accumulators are read.
pub const ROW_GAP: u64 = 4;
/// A sweep beyond its slots: memories, chains, candidates, score.
pub const SWEEP_TAIL: u64 = 33;
/// Nine candidates are judged, one every two cycles, in five cycles each.
pub const SELECTION: u64 = 2 * 8 + 5;
/// Cycles per beat on the output.
pub const BEAT: u64 = 10;
/// Cycles to the first beat.
pub const FIRST_BEAT: u64 = 13;
/// Cycles for both μ words.
pub const MU_WORDS: u64 = 8;
/// Delay of the second Horner chain's reads against the first's.
pub const TRANSPOSE: u64 = 18;
/// Width of a factor of p(μ*): a μ word, or one.
pub const FACTOR_BITS: u32 = 19;
/// Width of an operand that one multiplier takes.
pub const OPERAND_BITS: u32 = 16;

/// Width of a polynomial's coefficient in memory: taxels and their sum share it.
pub fn word_bits(formats: &Formats) -> usize {
    formats.sum_bits.iter().copied().max().unwrap_or(1) as usize
}

/// Width of ⌊Σp / 2^20⌋, at least one.
pub fn floor_bits(formats: &Formats) -> usize {
    word_bits(formats).saturating_sub(EPSILON_SHIFT as usize).max(1)
}

/// Polynomials of a sweep: the taxels' and their sum.
pub fn polynomials(formats: &Formats) -> usize {
    4 * formats.quads + 1
}

/// Width of a product of the force stage's factors.
pub fn product_bits(formats: &Formats) -> usize {
    (formats.search_bits[0] + FACTOR_BITS) as usize
}

/// Vectors in the operand memory: the limbs of the input first, then the v_ij.
pub fn first_vector(formats: &Formats) -> usize {
    1 + usize::from(formats.input_low_bits > 0)
}

/// Place of an operand in the operand memory.
pub fn operand_index(formats: &Formats, operand: Operand) -> usize {
    match operand {
        Operand::InputHigh => 0,
        Operand::InputLow => 1,
        Operand::Vector(index) => first_vector(formats) + index,
    }
}

/// Matrices whose coefficients fill an operand, in order of storage; the low limb of Cz⁺ has a narrower memory.
pub const WIDE: [Kind; 3] = [Kind::InverseHigh, Kind::Ax, Kind::Ay];

/// Four coefficients per word, one of each parity; word (row, column) of a matrix at row·2^b + column, b bits of a quad's address.
pub fn coefficients(formats: &Formats, quantised: &Quantised, kind: Kind) -> Vec<[i64; 4]> {
    let side = 1 << count_bits(formats.quads);
    let blocks = match kind {
        Kind::InverseHigh | Kind::InverseLow => &quantised.inverse,
        Kind::Ax => &quantised.ax,
        Kind::Ay => &quantised.ay,
    };
    // No taxel is dead here: the one flip is that of the mirror symmetry.
    let own = &blocks.flips[0].parity;
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

/// The layout and resources of the serial engine: every column kept, one row at a time.
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
    let memory = |block, array: &str, words: usize, bits: usize| Memory {
        block,
        array: array.to_string(),
        words,
        bits,
        block_rams: board.block_rams_for(words, bits),
        large_rams: 0,
    };
    let large = |block, array: &str, words: usize, bits: usize| Memory {
        block_rams: 0,
        large_rams: board.large_rams_for(words, bits),
        ..memory(block, array, words, bits)
    };
    // Each stands twice: for the lane of its own parity, and for that of the other parities.
    let operands = 2 << (count_bits(first_vector(f) + operand_vectors(f.degree)) + count_bits(f.quads));
    let bank = 2 << (count_bits(polynomials(f)) + 4);
    let mut memories = vec![
        memory("receive$frame", "field0", taxels, f.input_bits as usize),
        memory("order", "places", 2 << count_bits(taxels), count_bits(taxels)),
        memory("pass", "wide", WIDE.len() * side * side, 4 * OPERAND_BITS as usize),
    ];
    if f.inverse_low_bits > 0 {
        memories.push(memory("pass", "low_memory", side * side, 4 * f.inverse_low_bits as usize));
    }
    memories.extend((0..4).map(|lane| memory("pass", &format!("operands{lane}"), operands, OPERAND_BITS as usize)));
    memories.push(memory("raw", "field0", taxels, f.acc_bits as usize));
    memories.extend(["even", "odd_bank"].map(|array| large("banks", array, bank, word_bits(f))));
    memories.push(memory("turned", "field0", 4 * SLOT as usize, word_bits(f)));
    memories.push(memory("floors", "field0", SLOT as usize, floor_bits(f)));
    memories.push(memory("totals", "field0", SLOT as usize, f.score_bits as usize + 1));
    let multipliers = vec![
        ("pass", 4 * board.multipliers_for(OPERAND_BITS, OPERAND_BITS)),
        ("forces", board.multipliers_for(f.search_bits[0], FACTOR_BITS)),
    ];
    Resources { memories, multipliers }
}

/// The serial engine's cycles for a frame that is `searched` or not.
pub(super) fn cycles(model: &Model, searched: bool) -> Cycles {
    let formats = &model.formats;
    let quads = formats.quads as u64;
    let limbs = first_vector(formats) as u64;
    let fold = limbs * (quads * QUAD + DRAIN);
    let passes = passes(model);
    let sweep = 1 + polynomials(formats) as u64 * SLOT + SWEEP_TAIL;
    let sweeps = if searched { COARSE_CENTRES.len() as u64 + u64::from(HALVINGS) } else { 0 };
    let search = sweeps * (sweep + SELECTION) + sweep;
    let first_output = START + fold + passes + search + MU_WORDS + FIRST_BEAT;
    let beats = (model.scene.sensor.taxels() + STATUS_BEATS) as u64;
    let latency = first_output + (beats - 1) * BEAT;
    Cycles { first_output, latency, total: model.scene.sensor.taxels() as u64 + latency, interval: BEAT }
}

/// From the first product to the end of the last v_ij.
fn passes(model: &Model) -> u64 {
    let quads = model.formats.quads as u64;
    let row = |products: &Vec<Product>| quads * (products.len() as u64 * quads + ROW_GAP);
    // The replay of v_00 between the passes; a drain after v_00, after its replay, after the last v_ij.
    schedule(&model.formats).iter().map(row).sum::<u64>() + quads * QUAD + 3 * DRAIN
}

/// Share of the cycles of the passes in which the lanes multiply.
pub(super) fn lane_utilisation(model: &Model) -> f64 {
    let quads = model.formats.quads as u64;
    let products: usize = schedule(&model.formats).iter().map(Vec::len).sum();
    (products as u64 * quads * quads) as f64 / passes(model) as f64
}

/// From the last input beat to the first quad, and from the last value to the forces.
const START: u64 = 2;
