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
use rust_hdl::prelude::*;

use super::rounder::SHIFT_BITS;
use crate::kernel_block;
use crate::language::{concat, Body, Builder, Expr, Type};
use crate::primitives::count_bits;
use crate::wire::Wire;

/// Width of the count of saturated words, in bits.
pub const SATURATION_BITS: usize = 16;
const FOLD_HIGH: u64 = 1;
const FOLD_LOW: u64 = 2;
const FIRST: u64 = 3;
const REPLAY: u64 = 4;
const OTHERS: u64 = 5;

/// The sequencer and its counters; steps in the module docs.
#[derive(dermis_hdl_derive::Block)]
pub struct PassSequencer {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high; stops the sequence.
    pub rst: Signal<In, Bit>,
    /// The frame buffer holds a frame: start.
    pub start: Signal<In, Bit>,
    /// OR of the frame's magnitudes; valid with `start`.
    pub magnitude: Wire<In>,
    /// Place of the taxel to read; valid while `busy` is high and the input is folded.
    pub index: Wire<Out>,
    /// Its code, signed; two cycles after `index`.
    pub code: Wire<In>,
    /// An accumulator of the passes, `acc_bits` wide, signed; valid with `row_valid`.
    pub row_word: Wire<In>,
    /// `row_word` is valid.
    pub row_valid: Signal<In, Bit>,
    /// Write `row_word` to the raw memory.
    pub raw_write: Signal<Out, Bit>,
    /// Address in the raw memory; valid with `raw_write`.
    pub raw_write_address: Wire<Out>,
    /// Address of the raw word to read; valid while `rescale` replays v_00, step 4.
    pub raw_read_address: Wire<Out>,
    /// The raw word; one cycle after `raw_read_address`.
    pub raw_word: Wire<In>,
    /// Word for the rounder, signed; valid with `round`.
    pub unrounded: Wire<Out>,
    /// Right shift for the rounder; valid with `round`.
    pub round_shift: Wire<Out>,
    /// `unrounded` is valid.
    pub round: Signal<Out, Bit>,
    /// Word from the rounder, signed; valid with `round_done`.
    pub rounded: Wire<In>,
    /// `rounded` was saturated.
    pub clipped: Signal<In, Bit>,
    /// `rounded` is valid.
    pub round_done: Signal<In, Bit>,
    /// `rounded` goes to the butterfly in this cycle.
    pub transform: Signal<Out, Bit>,
    /// Word from the butterfly, signed; valid with `transformed_valid`.
    pub transformed: Wire<In>,
    /// `transformed` is valid.
    pub transformed_valid: Signal<In, Bit>,
    /// A product is issued to `pass` in this cycle.
    pub issue: Signal<Out, Bit>,
    /// The product is the last of its row; valid with `issue`.
    pub last: Signal<Out, Bit>,
    /// Wide matrix, row and column; valid with `issue`.
    pub address: Wire<Out>,
    /// Use the low limb of Cz⁺; valid with `issue`.
    pub low: Signal<Out, Bit>,
    /// Vector and column of the operand; valid with `issue`.
    pub operand_address: Wire<Out>,
    /// Read the operand with both parity bits inverted; valid with `issue`.
    pub flip: Signal<Out, Bit>,
    /// The product is of two high limbs; valid with `issue`.
    pub align: Signal<Out, Bit>,
    /// Write `write_data` to the operand memory.
    pub write: Signal<Out, Bit>,
    /// Vector and quad to write; valid with `write`.
    pub write_address: Wire<Out>,
    /// Parity to write, 2 bits; valid with `write`.
    pub write_lane: Wire<Out>,
    /// Operand of 16 bits, signed; valid with `write`.
    pub write_data: Wire<Out>,
    /// The rounder's word is a normalised code.
    pub normalised_valid: Signal<Out, Bit>,
    /// The butterfly's quads are folded input, high limb.
    pub folding: Signal<Out, Bit>,
    /// The rounder's word is a rescaled v_ij.
    pub rescaled_valid: Signal<Out, Bit>,
    /// The butterfly's words are taxels of a v_ij.
    pub unfolding: Signal<Out, Bit>,
    /// The frame buffer has been read; high for one cycle.
    pub free: Signal<Out, Bit>,
    /// Left shift of `normalise`; valid from step 2 or 3 until the next `start`.
    pub normalise: Wire<Out>,
    /// Right shift of `rescale`; valid from step 4 until the next `start`.
    pub rescale: Wire<Out>,
    /// Number of words saturated by `rescale`, 16 bits; complete from `done` until the next `start`.
    pub saturations: Wire<Out>,
    /// The sequence is running; rounder and butterfly are in use.
    pub busy: Signal<Out, Bit>,
    /// Last cycle of the sequence.
    pub done: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(
    PassSequencer,
    clock clk,
    inputs [
        rst, start, magnitude, code, row_word, row_valid, raw_word, rounded, clipped, round_done, transformed, transformed_valid
    ],
    outputs [
        index, raw_write, raw_write_address, raw_read_address, unrounded, round_shift, round, transform, issue, last, address,
        low, operand_address, flip, align, write, write_address, write_lane, write_data, normalised_valid, folding,
        rescaled_valid, unfolding, free, normalise, rescale, saturations, busy, done
    ]
);

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
        let f = formats;
        let (quads, words) = (count_bits(f.quads), count_bits(4 * f.quads));
        let vectors = count_bits(first_vector(f) + f.operand_vectors());
        let block = PassSequencer {
            clk: Default::default(),
            rst: Default::default(),
            start: Default::default(),
            magnitude: Wire::new(f.input_bits as usize - 1),
            index: Wire::new(words),
            code: Wire::new(f.input_bits as usize),
            row_word: Wire::new(f.acc_bits as usize),
            row_valid: Default::default(),
            raw_write: Default::default(),
            raw_write_address: Wire::new(words),
            raw_read_address: Wire::new(words),
            raw_word: Wire::new(f.acc_bits as usize),
            unrounded: Wire::new(unrounded),
            round_shift: Wire::new(SHIFT_BITS),
            round: Default::default(),
            rounded: Wire::new(rounded),
            clipped: Default::default(),
            round_done: Default::default(),
            transform: Default::default(),
            transformed: Wire::new(rounded + 2),
            transformed_valid: Default::default(),
            issue: Default::default(),
            last: Default::default(),
            address: Wire::new(2 + 2 * quads),
            low: Default::default(),
            operand_address: Wire::new(vectors + quads),
            flip: Default::default(),
            align: Default::default(),
            write: Default::default(),
            write_address: Wire::new(vectors + quads),
            write_lane: Wire::new(2),
            write_data: Wire::new(OPERAND_BITS as usize),
            normalised_valid: Default::default(),
            folding: Default::default(),
            rescaled_valid: Default::default(),
            unfolding: Default::default(),
            free: Default::default(),
            normalise: Wire::new(SHIFT_BITS),
            rescale: Wire::new(SHIFT_BITS),
            saturations: Wire::new(SATURATION_BITS),
            busy: Default::default(),
            done: Default::default(),
            kernel: Body::default(),
        };
        let k = Builder::new("pass_sequencer");
        build(&k, f, &program(f), unrounded, rounded);
        block.bind(k.finish())
    }
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

/// The circuit for `program`; the rounder takes words of `unrounded` bits and returns words of `rounded_bits` bits.
fn build<'k>(k: &'k Builder, f: &Formats, program: &[Instruction], unrounded: usize, rounded_bits: usize) {
    let (quads, words) = (count_bits(f.quads), count_bits(4 * f.quads));
    let (count, operands) = (program.len(), OPERAND_BITS as usize);
    let pc = count_bits(count + 1);
    let vectors = count_bits(first_vector(f) + f.operand_vectors());
    let (acc, code_bits, data) = (f.acc_bits as usize, f.input_bits as usize, f.data_bits as usize);
    let seen_bits = acc.max(code_bits) - 1;
    let (low, extra) = (f.input_low_bits as usize, SEARCH_EXTRA_BITS as usize);

    let (rst, start, magnitude) = (k.input("rst", 1), k.input("start", 1), k.input("magnitude", code_bits - 1));
    let (code, row_word, row_valid) = (k.input("code", code_bits), k.input("row_word", acc), k.input("row_valid", 1));
    let (raw_word, rounded) = (k.input("raw_word", acc), k.input("rounded", rounded_bits));
    let (clipped, round_done) = (k.input("clipped", 1), k.input("round_done", 1));
    let (transformed, transformed_valid) = (k.input("transformed", rounded_bits + 2), k.input("transformed_valid", 1));

    let register = |name: &str, bits: usize| k.register(name, Type::unsigned(bits));
    let zero = |bits: usize| k.constant(bits, 0);
    let step = k.state("step", Type::unsigned(3), rst, 0);
    let draining = k.state("draining", Type::unsigned(1), rst, 0);
    let row_gap = row_gap(f.quads);
    let gap_bits = count_bits(row_gap as usize + 1);
    let (phase, gap, wait_count) = (register("phase", 3), register("gap", gap_bits), register("wait_count", 4));
    let (quad, column) = (register("quad", quads), register("column", quads));
    let (product, first_product) = (register("product", pc), register("first_product", pc));
    let (seen, length) = (register("seen", seen_bits), register("length", SHIFT_BITS));
    let (read, replayed) = (register("read", 2), register("replayed", 1));
    let (written, stored, vector) =
        (register("written", words), register("stored", words), register("vector", vectors));
    let (normalise, rescale) = (register("normalise", SHIFT_BITS), register("rescale", SHIFT_BITS));
    let saturations = register("saturations", SATURATION_BITS);

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
    let is = |number: u64| step.is(number);

    let row_folding = k.wire("row_folding", is(FOLD_HIGH) | is(FOLD_LOW));
    let unfolding = k.wire("unfolding", is(REPLAY) | is(OTHERS));
    let rescaled = k.wire("rescaled", unfolding & round_done);
    let drained = k.wire("drained", *draining & wait_count.is(DRAIN - 1));
    let last_quad = k.wire("last_quad", wraps(*quad, f.quads - 1));
    let last_column = k.wire("last_column", wraps(*column, f.quads - 1));
    let row_last = k.wire("row_last", set(&|i| i.last));
    let next_product = k.wire("next_product", product.plus(1));
    let place = k.wire("place", quad.concat(phase.low(2)).low(words));
    let folded = k.wire("folded", row_folding & transformed_valid);
    let row_magnitude = k.wire("row_magnitude", row_word.low(acc - 1) ^ row_word.top().repeat(acc - 1));
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
    replayed.set(is(REPLAY) & runs);
    k.when(is(FOLD_HIGH), || {
        normalise.set((k.constant(SHIFT_BITS, u64::from(f.input_bits - 1)) - *length).low(SHIFT_BITS));
    });
    let full = k.constant(SHIFT_BITS, u64::from(f.vector_bits - 1));
    k.when(is(FIRST), || rescale.set(full.less(*length).mux((*length - full).low(SHIFT_BITS), zero(SHIFT_BITS))));
    k.when(rescaled & clipped, || saturations.set(saturations.plus(1)));
    k.when(is(FIRST) & row_valid, || {
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
    let (after_fold, freed) = if low == 0 { (FIRST, FOLD_HIGH) } else { (FOLD_LOW, FOLD_LOW) };
    k.when(drained, || {
        draining.set(zero(1));
        step.set(is(FOLD_HIGH).mux(k.constant(3, after_fold), is(OTHERS).mux(zero(3), step.plus(1))));
        k.when(is(freed), || seen.set(zero(seen_bits)));
    });
    k.when(!*draining & (row_folding | is(REPLAY)), || {
        phase.set(phase.plus(1));
        k.when(phase.all(), || {
            quad.set(last_quad.mux(zero(quads), quad.plus(1)));
            draining.set(last_quad);
        });
    });
    let multiplies = is(FIRST) | is(OTHERS);
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
            draining.set(last_quad & (is(FIRST) | product.is(count as u64 - 1)));
        });
        k.when(!gap.is(0) & !gap.is(row_gap), || gap.set(gap.plus(1)));
    });
    k.when(is(0) & start, || {
        step.set(k.constant(3, FOLD_HIGH));
        draining.set(zero(1));
        seen.set(magnitude.resize(seen_bits));
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
    let overflows = !rounded.at(top) & rounded.slice(half, top - half).all();
    let nearest = (rounded.slice(extra, data) + rounded.at(half)).low(data);
    let nearest = k.wire("nearest", overflows.mux(most, nearest));
    let wide = |word: Expr<'k>, bits: usize| word.signed().resize(bits).unsigned();
    let high_limb = wide(transformed.slice(low, (transformed.bits() - low).min(operands)), operands);
    let align = (f.limb_align as usize).saturating_sub(low);
    let low_limb = if low == 0 { high_limb } else { transformed.low(low).shift_left(align).resize(operands) };

    k.wire("index", place);
    k.wire("raw_read_address", place);
    k.wire("raw_write", is(FIRST) & row_valid);
    k.wire("raw_write_address", *stored);
    let from = |replay, others, fold| is(REPLAY).mux(replay, is(OTHERS).mux(others, fold));
    let code_word = code.signed().shift_left(code_bits - 1).resize(unrounded).unsigned();
    k.wire("unrounded", from(wide(raw_word, unrounded), wide(row_word, unrounded), code_word));
    k.wire("round_shift", from(*rescale, k.constant(SHIFT_BITS, u64::from(f.a_shift)), *length));
    k.wire("round", from(*replayed, row_valid, read.at(1)));
    let busy = k.wire("busy", step.any());
    k.wire("transform", round_done & busy);
    k.wire("issue", multiplies & !*draining & gap.is(0));
    k.wire("last", row_last & last_column);
    k.wire("address", concat(&[field(2, &|i| i.matrix), *quad, *column]));
    k.wire("low", set(&|i| i.low));
    k.wire("operand_address", field(vectors, &|i| i.operand).concat(*column));
    k.wire("flip", set(&|i| i.flip));
    k.wire("align", set(&|i| i.align));
    let kept = vector.less(k.constant(vectors, f.operand_vectors() as u64));
    k.wire("write", folded | rescaled & kept);
    let target =
        is(FOLD_HIGH).mux(zero(vectors), is(FOLD_LOW).mux(k.constant(vectors, 1), vector.plus(first_vector(f) as u64)));
    // An array of one quad has a quad address of one bit, which is 0.
    let written_quad = if f.quads == 1 { zero(quads) } else { written.slice(2, quads) };
    k.wire("write_address", target.concat(written_quad));
    k.wire("write_lane", written.at(1).concat(written.at(0) ^ !row_folding));
    let operand = is(FOLD_HIGH).mux(high_limb, is(FOLD_LOW).mux(low_limb, wide(nearest, operands)));
    k.wire("write_data", operand);
    k.wire("normalised_valid", is(FOLD_HIGH) & round_done);
    k.wire("folding", is(FOLD_HIGH));
    k.wire("rescaled_valid", rescaled);
    k.wire("free", drained & is(freed));
    k.wire("done", drained & is(OTHERS));
}

#[cfg(test)]
mod tests;
