//! Sequencer from the frame buffer to the polynomials: which word goes where in which cycle.
//!
//! ```text
//! step 1, 2  frame --> rounder (normalise) --> butterfly (fold) --> operands, high and low limbs
//! step 3     pass of v_00 --> raw memory, length
//! step 4     raw memory --> rounder (rescale) --> operands; butterfly --> unfold
//! step 5     the other passes --> rounder --> operands; butterfly --> unfold
//! ```
//! Each step ends with [`DRAIN`] cycles, in which its last words reach their memory.

use dermis_golden::fixed::plan::serial::{first_vector, operand_index, row_gap, DRAIN, OPERAND_BITS, WIDE};
use dermis_golden::fixed::words::formats::{Formats, SEARCH_EXTRA_BITS};
use dermis_golden::fixed::words::schedule::{schedule, Kind, Product};

use super::rounder::SHIFT_BITS;
use crate::language::{concat, Block, Builder, Expr, Inside, Type};
use crate::primitives::count_bits;
use crate::{block, states};

/// Width of the count of saturated words, in bits.
pub const SATURATION_BITS: usize = 16;

states! {
    /// The steps of the module docs, from 1 on.
    enum Step { Idle, FoldHigh, FoldLow, First, Replay, Others }
}

block! {
    /// The sequencer and its counters; steps in the module docs.
    pub struct PassSequencer {
        formats: Formats,
        /// Width of a word for the rounder.
        unrounded: usize,
        /// Width of a word from it.
        rounded: usize,
    }
    ports PassSequencerPorts {
        clock;
        /// Synchronous reset, active high; stops the sequence.
        in rst;
        /// The frame buffer holds a frame: start.
        in start;
        /// OR of the frame's magnitudes; valid with `start`.
        in magnitude: formats.input_bits as usize - 1;
        /// Place of the taxel to read; valid while `busy` is high and the input is folded.
        out index: count_bits(4 * formats.quads);
        /// Its code, signed; two cycles after `index`.
        in code: formats.input_bits as usize;
        /// An accumulator of the passes, `acc_bits` wide, signed; valid with `row_valid`.
        in row_word: formats.acc_bits as usize;
        /// `row_word` is valid.
        in row_valid;
        /// Write `row_word` to the raw memory.
        out raw_write;
        /// Address in the raw memory; valid with `raw_write`.
        out raw_write_address: count_bits(4 * formats.quads);
        /// Address of the raw word to read; valid while `rescale` replays v_00, step 4.
        out raw_read_address: count_bits(4 * formats.quads);
        /// The raw word; one cycle after `raw_read_address`.
        in raw_word: formats.acc_bits as usize;
        /// Word for the rounder, signed; valid with `round`.
        out unrounded: unrounded;
        /// Right shift for the rounder; valid with `round`.
        out round_shift: SHIFT_BITS;
        /// `unrounded` is valid.
        out round;
        /// Word from the rounder, signed; valid with `round_done`.
        in rounded: rounded;
        /// `rounded` was saturated.
        in clipped;
        /// `rounded` is valid.
        in round_done;
        /// `rounded` goes to the butterfly in this cycle.
        out transform;
        /// Word from the butterfly, signed; valid with `transformed_valid`.
        in transformed: rounded + 2;
        /// `transformed` is valid.
        in transformed_valid;
        /// A product is issued to `pass` in this cycle.
        out issue;
        /// The product is the last of its row; valid with `issue`.
        out last;
        /// Wide matrix, row and column; valid with `issue`.
        out address: 2 + 2 * count_bits(formats.quads);
        /// Use the low limb of Cz⁺; valid with `issue`.
        out low;
        /// Vector and column of the operand; valid with `issue`.
        out operand_address: operand_address_bits(formats);
        /// Read the operand with both parity bits inverted; valid with `issue`.
        out flip;
        /// The product is of two high limbs; valid with `issue`.
        out align;
        /// Write `write_data` to the operand memory.
        out write;
        /// Vector and quad to write; valid with `write`.
        out write_address: operand_address_bits(formats);
        /// Parity to write, 2 bits; valid with `write`.
        out write_lane: 2;
        /// Operand of 16 bits, signed; valid with `write`.
        out write_data: OPERAND_BITS as usize;
        /// The rounder's word is a normalised code.
        out normalised_valid;
        /// The butterfly's quads are folded input, high limb.
        out folding;
        /// The rounder's word is a rescaled v_ij.
        out rescaled_valid;
        /// The butterfly's words are taxels of a v_ij.
        out unfolding;
        /// The frame buffer has been read; high for one cycle.
        out free;
        /// Left shift of `normalise`; valid from step 2 or 3 until the next `start`.
        out normalise: SHIFT_BITS;
        /// Right shift of `rescale`; valid from step 4 until the next `start`.
        out rescale: SHIFT_BITS;
        /// Number of words saturated by `rescale`, 16 bits; complete from `done` until the next `start`.
        out saturations: SATURATION_BITS;
        /// The sequence is running; rounder and butterfly are in use.
        out busy;
        /// Last cycle of the sequence.
        out done;
    }
}

/// One product of the program. The operand memory holds the v_ij with their column parity inverted, as Ax needs them;
/// for Ay both parity bits of the address are inverted.
#[derive(Clone, Copy, Debug)]
struct Instruction {
    matrix: usize,
    low: bool,
    operand: usize,
    flip: bool,
    align: bool,
    last: bool,
}

impl PassSequencer {
    /// With the schedule of `formats`; the rounder takes words of `unrounded` bits and returns words of `rounded` bits.
    pub fn new(formats: &Formats, unrounded: usize, rounded: usize) -> Self {
        PassSequencer { formats: formats.clone(), unrounded, rounded }
    }
}

/// Width of an address of the operand memory: vector and quad.
fn operand_address_bits(f: &Formats) -> usize {
    vector_bits(f) + count_bits(f.quads)
}

/// Width of the number of a vector in the operand memory.
fn vector_bits(f: &Formats) -> usize {
    count_bits(first_vector(f) + f.operand_vectors())
}

/// The products of all passes of `f` in their order.
fn program(f: &Formats) -> Vec<Instruction> {
    let instructions = schedule(f).into_iter().flat_map(|products| {
        let count = products.len();
        products.into_iter().enumerate().map(move |(at, product)| (product, at + 1 == count)).collect::<Vec<_>>()
    });
    let instruction = |(product, last): (Product, bool)| Instruction {
        matrix: WIDE.iter().position(|&kind| kind == product.matrix.kind).unwrap_or(0),
        low: product.matrix.kind == Kind::InverseLow,
        operand: operand_index(f, &product),
        flip: product.matrix.kind == Kind::Ay,
        align: product.align,
        last,
    };
    instructions.map(instruction).collect()
}

impl Block for PassSequencer {
    fn build<'k>(&self, k: &'k Builder, io: PassSequencerPorts<Inside<'k>>) {
        let (f, unrounded) = (&self.formats, self.unrounded);
        let (quads, words) = (count_bits(f.quads), count_bits(4 * f.quads));
        let program = program(f);
        let (count, operands) = (program.len(), OPERAND_BITS as usize);
        let pc = count_bits(count + 1);
        let vectors = vector_bits(f);
        let (acc, code_bits, data) = (f.acc_bits as usize, f.input_bits as usize, f.data_bits as usize);
        let seen_bits = acc.max(code_bits) - 1;
        let (low, extra) = (f.input_low_bits as usize, SEARCH_EXTRA_BITS as usize);

        let register = |name: &str, bits: usize| k.register(name, Type::unsigned(bits));
        let zero = |bits: usize| k.constant(bits, 0);
        let step = k.machine("step", io.rst, Step::Idle);
        let draining = k.state("draining", Type::unsigned(1), io.rst, 0);
        let row_gap = row_gap(f.quads);
        let gap_bits = count_bits(row_gap as usize + 1);
        let (phase, gap, wait_count) = (register("phase", 3), register("gap", gap_bits), register("wait_count", 4));
        let (quad, column) = (register("quad", quads), register("column", quads));
        let (product, first_product) = (register("product", pc), register("first_product", pc));
        let (seen, length) = (register("seen", seen_bits), register("length", SHIFT_BITS));
        let (read, replayed) = (register("read", 2), register("replayed", 1));
        let (written, stored, vector) =
            (register("written", words), register("stored", words), register("vector", vectors));
        let (normalise, rescale) = (io.normalise.register(), io.rescale.register());
        let saturations = io.saturations.register();

        // As gates: synthesis would map a table to a memory.
        let set = |bit: &dyn Fn(&Instruction) -> bool| {
            let terms = (0..count).filter(|&at| bit(&program[at])).map(|at| product.is(at as u64));
            terms.reduce(|any, term| any | term).unwrap_or(zero(1))
        };
        let field = |bits: usize, of: &dyn Fn(&Instruction) -> usize| {
            let bits: Vec<Expr> = (0..bits).rev().map(|bit| set(&|i| of(i) >> bit & 1 == 1)).collect();
            concat(&bits)
        };
        let wraps = |count: Expr<'k>, last: usize| count.is(last as u64);
        let is = |wanted: Step| step.is(wanted);

        let row_folding = k.wire("row_folding", is(Step::FoldHigh) | is(Step::FoldLow));
        let unfolding = io.unfolding.set(is(Step::Replay) | is(Step::Others));
        let rescaled = k.wire("rescaled", unfolding & io.round_done);
        let drained = k.wire("drained", *draining & wait_count.is(DRAIN - 1));
        let last_quad = k.wire("last_quad", wraps(*quad, f.quads - 1));
        let last_column = k.wire("last_column", wraps(*column, f.quads - 1));
        let row_last = k.wire("row_last", set(&|i| i.last));
        let next_product = k.wire("next_product", product.plus(1));
        let place = k.wire("place", quad.concat(phase.low(2)).low(words));
        let folded = k.wire("folded", row_folding & io.transformed_valid);
        let row_magnitude = k.wire("row_magnitude", io.row_word.low(acc - 1) ^ io.row_word.top().repeat(acc - 1));
        k.comment("Binary search for the leading one.");
        let (mut rest, mut leading) = (seen.resize(64), Vec::new());
        for half in [32, 16, 8, 4, 2] {
            let upper = rest.slice(half, half);
            leading.push(upper.any());
            rest = upper.any().mux(upper, rest.low(half));
        }
        leading.push(rest.at(1));
        let seen_length = k.wire("seen_length", (concat(&leading) + rest.any()).low(SHIFT_BITS));

        length.set(seen_length);
        let runs = !*draining & !phase.at(2);
        read.set(read.at(0).concat(row_folding & runs));
        replayed.set(is(Step::Replay) & runs);
        k.when(is(Step::FoldHigh), || {
            normalise.set((k.constant(SHIFT_BITS, u64::from(f.input_bits - 1)) - *length).low(SHIFT_BITS));
        });
        let full = k.constant(SHIFT_BITS, u64::from(f.vector_bits - 1));
        k.when(is(Step::First), || {
            rescale.set(full.less(*length).mux((*length - full).low(SHIFT_BITS), zero(SHIFT_BITS)))
        });
        k.when(rescaled & io.clipped, || saturations.set(saturations.plus(1)));
        k.when(is(Step::First) & io.row_valid, || {
            seen.set(*seen | row_magnitude.resize(seen_bits));
            stored.set(wraps(*stored, 4 * f.quads - 1).mux(zero(words), stored.plus(1)));
        });
        k.when(folded | rescaled, || {
            let end = wraps(*written, 4 * f.quads - 1);
            written.set(end.mux(zero(words), written.plus(1)));
            // The vectors of the highest degree are not kept: the count stays at their first.
            k.when(rescaled & end & !vector.is(f.operand_vectors() as u64), || vector.set(vector.plus(1)));
        });
        wait_count.set(draining.mux(wait_count.plus(1), zero(4)));
        let (after_fold, freed) = if low == 0 { (Step::First, Step::FoldHigh) } else { (Step::FoldLow, Step::FoldLow) };
        k.when(drained, || {
            draining.set(zero(1));
            let next = is(Step::Others).mux(step.number(Step::Idle), step.following());
            step.goes_to(is(Step::FoldHigh).mux(step.number(after_fold), next));
            k.when(is(freed), || seen.set(zero(seen_bits)));
        });
        k.when(!*draining & (row_folding | is(Step::Replay)), || {
            phase.set(phase.plus(1));
            k.when(phase.all(), || {
                quad.set(last_quad.mux(zero(quads), quad.plus(1)));
                draining.set(last_quad);
            });
        });
        let multiplies = is(Step::First) | is(Step::Others);
        k.when(!*draining & multiplies, || {
            k.when(gap.is(0), || {
                column.set(last_column.mux(zero(quads), column.plus(1)));
                k.when(last_column & row_last, || gap.set(k.constant(gap_bits, 1)));
                k.when(last_column & !row_last, || product.set(next_product));
            });
            k.when(gap.is(row_gap), || {
                gap.set(zero(gap_bits));
                quad.set(last_quad.mux(zero(quads), quad.plus(1)));
                product.set(last_quad.mux(next_product, *first_product));
                k.when(last_quad, || first_product.set(next_product));
                draining.set(last_quad & (is(Step::First) | product.is(count as u64 - 1)));
            });
            k.when(!gap.is(0) & !gap.is(row_gap), || gap.set(gap.plus(1)));
        });
        k.when(is(Step::Idle) & io.start, || {
            step.goes(Step::FoldHigh);
            draining.set(zero(1));
            seen.set(io.magnitude.resize(seen_bits));
            let cleared = [
                phase,
                gap,
                quad,
                column,
                product,
                first_product,
                length,
                saturations,
                read,
                replayed,
                written,
                stored,
                vector,
                normalise,
                rescale,
            ];
            cleared.iter().for_each(|register| register.set(zero(register.bits())));
        });

        k.comment("Adds half an LSB of the operand; only the largest positive values can overflow.");
        let (top, half) = (data + extra - 1, extra - 1);
        let most = zero(1).concat(k.constant(1, 1).repeat(data - 1));
        let overflows = !io.rounded.at(top) & io.rounded.slice(half, top - half).all();
        let nearest = (io.rounded.slice(extra, data) + io.rounded.at(half)).low(data);
        let nearest = k.wire("nearest", overflows.mux(most, nearest));
        let wide = |word: Expr<'k>, bits: usize| word.signed().resize(bits).unsigned();
        let high_limb = wide(io.transformed.slice(low, (io.transformed.bits() - low).min(operands)), operands);
        let align = (f.limb_align as usize).saturating_sub(low);
        let low_limb = if low == 0 { high_limb } else { io.transformed.low(low).shift_left(align).resize(operands) };

        io.index.set(place);
        io.raw_read_address.set(place);
        io.raw_write.set(is(Step::First) & io.row_valid);
        io.raw_write_address.set(*stored);
        let from = |replay, others, fold| is(Step::Replay).mux(replay, is(Step::Others).mux(others, fold));
        let code_word = io.code.signed().shift_left(code_bits - 1).resize(unrounded).unsigned();
        io.unrounded.set(from(wide(io.raw_word, unrounded), wide(io.row_word, unrounded), code_word));
        io.round_shift.set(from(*rescale, k.constant(SHIFT_BITS, u64::from(f.a_shift)), *length));
        io.round.set(from(*replayed, io.row_valid, read.at(1)));
        let busy = io.busy.set(!is(Step::Idle));
        io.transform.set(io.round_done & busy);
        io.issue.set(multiplies & !*draining & gap.is(0));
        io.last.set(row_last & last_column);
        io.address.set(concat(&[field(2, &|i| i.matrix), *quad, *column]));
        io.low.set(set(&|i| i.low));
        io.operand_address.set(field(vectors, &|i| i.operand).concat(*column));
        io.flip.set(set(&|i| i.flip));
        io.align.set(set(&|i| i.align));
        let kept = vector.less(k.constant(vectors, f.operand_vectors() as u64));
        io.write.set(folded | rescaled & kept);
        let target = is(Step::FoldHigh)
            .mux(zero(vectors), is(Step::FoldLow).mux(k.constant(vectors, 1), vector.plus(first_vector(f) as u64)));
        // An array of one quad has a quad address of one bit, which is 0.
        let written_quad = if f.quads == 1 { zero(quads) } else { written.slice(2, quads) };
        io.write_address.set(target.concat(written_quad));
        io.write_lane.set(written.at(1).concat(written.at(0) ^ !row_folding));
        let operand = is(Step::FoldHigh).mux(high_limb, is(Step::FoldLow).mux(low_limb, wide(nearest, operands)));
        io.write_data.set(operand);
        io.normalised_valid.set(is(Step::FoldHigh) & io.round_done);
        io.folding.set(is(Step::FoldHigh));
        io.rescaled_valid.set(rescaled);
        io.free.set(drained & is(freed));
        io.done.set(drained & is(Step::Others));
    }
}

#[cfg(test)]
mod tests;
