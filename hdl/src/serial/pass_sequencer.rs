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
use crate::language::{concat, Block, Builder, Expr, Inside, Machine, Net, Type};
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

/// The program, at the product that is issued next.
struct Program<'k> {
    k: &'k Builder,
    instructions: Vec<Instruction>,
    product: Expr<'k>,
}

impl<'k> Program<'k> {
    /// Whether the product has a property. As gates: synthesis would map a table to a memory.
    fn set(&self, bit: &dyn Fn(&Instruction) -> bool) -> Expr<'k> {
        let own = self.instructions.iter().zip(0..).filter(|(instruction, _)| bit(instruction));
        let terms = own.map(|(_, at)| self.product.is(at));
        terms.reduce(|any, term| any | term).unwrap_or(self.k.constant(1, 0))
    }

    /// A number of `bits` bits of the product.
    fn field(&self, bits: usize, of: &dyn Fn(&Instruction) -> usize) -> Expr<'k> {
        let bits: Vec<Expr> = (0..bits).rev().map(|bit| self.set(&|i| of(i) >> bit & 1 == 1)).collect();
        concat(&bits)
    }
}

/// Registers of the sequencer.
struct Registers<'k> {
    step: Machine<'k, Step>,
    /// The step's last words reach their memory.
    draining: Net<'k>,
    /// Lane of the word of a quad that is read, then a gap.
    phase: Net<'k>,
    /// Cycles of the gap after a row; cycles of `draining`.
    gap: Net<'k>,
    wait_count: Net<'k>,
    /// Quad that is read, or row of the product; column of the product.
    quad: Net<'k>,
    column: Net<'k>,
    /// Product of the program; the first one of its row.
    product: Net<'k>,
    first_product: Net<'k>,
    /// OR of the magnitudes, and its length.
    seen: Net<'k>,
    length: Net<'k>,
    /// A code was addressed one and two cycles before; a raw word was.
    read: Net<'k>,
    replayed: Net<'k>,
    /// Places of the next operand and of the next raw word; vector of the operand.
    written: Net<'k>,
    stored: Net<'k>,
    vector: Net<'k>,
    normalise: Net<'k>,
    rescale: Net<'k>,
    saturations: Net<'k>,
}

impl<'k> Registers<'k> {
    /// `pc` is the width of the number of a product.
    fn new(k: &'k Builder, io: &PassSequencerPorts<Inside<'k>>, f: &Formats, pc: usize) -> Self {
        let register = |name: &str, bits: usize| k.register(name, Type::unsigned(bits));
        let (quads, words) = (count_bits(f.quads), count_bits(4 * f.quads));
        Registers {
            step: k.machine("step", io.rst, Step::Idle),
            draining: k.state("draining", Type::unsigned(1), io.rst, 0),
            phase: register("phase", 3),
            gap: register("gap", count_bits(row_gap(f.quads) as usize + 1)),
            wait_count: register("wait_count", 4),
            quad: register("quad", quads),
            column: register("column", quads),
            product: register("product", pc),
            first_product: register("first_product", pc),
            seen: register("seen", f.acc_bits.max(f.input_bits) as usize - 1),
            length: register("length", SHIFT_BITS),
            read: register("read", 2),
            replayed: register("replayed", 1),
            written: register("written", words),
            stored: register("stored", words),
            vector: register("vector", vector_bits(f)),
            normalise: io.normalise.register(),
            rescale: io.rescale.register(),
            saturations: io.saturations.register(),
        }
    }

    fn is(&self, step: Step) -> Expr<'k> {
        self.step.is(step)
    }

    /// Products are issued.
    fn multiplies(&self) -> Expr<'k> {
        self.is(Step::First) | self.is(Step::Others)
    }
}

/// `count` + 1, or 0 after `last`.
fn next<'k>(k: &'k Builder, count: Net<'k>, last: Expr<'k>) -> Expr<'k> {
    last.mux(k.constant(count.bits(), 0), count.plus(1))
}

/// Length of the largest of the magnitudes whose OR is `seen`.
fn length<'k>(k: &'k Builder, seen: Expr<'k>) -> Expr<'k> {
    k.comment("Binary search for the leading one.");
    let (mut rest, mut leading) = (seen.resize(64), Vec::new());
    for half in [32, 16, 8, 4, 2] {
        let upper = rest.slice(half, half);
        leading.push(upper.any());
        rest = upper.any().mux(upper, rest.low(half));
    }
    leading.push(rest.at(1));
    k.wire("seen_length", (concat(&leading) + rest.any()).low(SHIFT_BITS))
}

impl PassSequencer {
    /// The step with whose end the frame buffer has been read.
    fn freed(&self) -> Step {
        if self.formats.input_low_bits == 0 {
            Step::FoldHigh
        } else {
            Step::FoldLow
        }
    }

    /// Magnitudes and shifts, and places of the words that are `folded`, stored raw or `rescaled`.
    fn words<'k>(
        &self,
        k: &'k Builder,
        io: &PassSequencerPorts<Inside<'k>>,
        r: &Registers<'k>,
        [row_folding, folded, rescaled]: [Expr<'k>; 3],
    ) {
        let (f, acc) = (&self.formats, self.formats.acc_bits as usize);
        let row_magnitude = k.wire("row_magnitude", io.row_word.low(acc - 1) ^ io.row_word.top().repeat(acc - 1));
        r.length.set(length(k, *r.seen));
        let runs = !*r.draining & !r.phase.at(2);
        r.read.set(r.read.at(0).concat(row_folding & runs));
        r.replayed.set(r.is(Step::Replay) & runs);
        k.when(r.is(Step::FoldHigh), || {
            r.normalise.set((k.constant(SHIFT_BITS, u64::from(f.input_bits - 1)) - *r.length).low(SHIFT_BITS));
        });
        let full = k.constant(SHIFT_BITS, u64::from(f.vector_bits - 1));
        k.when(r.is(Step::First), || {
            r.rescale.set(full.less(*r.length).mux((*r.length - full).low(SHIFT_BITS), k.constant(SHIFT_BITS, 0)))
        });
        k.when(rescaled & io.clipped, || r.saturations.set(r.saturations.plus(1)));
        let last = 4 * f.quads as u64 - 1;
        k.when(r.is(Step::First) & io.row_valid, || {
            r.seen.set(*r.seen | row_magnitude.resize(r.seen.bits()));
            r.stored.set(next(k, r.stored, r.stored.is(last)));
        });
        k.when(folded | rescaled, || {
            let end = r.written.is(last);
            r.written.set(next(k, r.written, end));
            // The vectors of the highest degree are not kept: the count stays at their first.
            let kept = !r.vector.is(f.operand_vectors() as u64);
            k.when(rescaled & end & kept, || r.vector.set(r.vector.plus(1)));
        });
    }

    /// The steps, one after the other; the quads of those that do not multiply.
    fn steps<'k>(
        &self,
        k: &'k Builder,
        r: &Registers<'k>,
        drained: Expr<'k>,
        row_folding: Expr<'k>,
        last_quad: Expr<'k>,
    ) {
        r.wait_count.set(r.draining.mux(r.wait_count.plus(1), k.constant(4, 0)));
        let after_fold = if self.formats.input_low_bits == 0 { Step::First } else { Step::FoldLow };
        k.when(drained, || {
            r.draining.set(k.constant(1, 0));
            let next = r.is(Step::Others).mux(r.step.number(Step::Idle), r.step.following());
            r.step.goes_to(r.is(Step::FoldHigh).mux(r.step.number(after_fold), next));
            k.when(r.is(self.freed()), || r.seen.set(k.constant(r.seen.bits(), 0)));
        });
        k.when(!*r.draining & (row_folding | r.is(Step::Replay)), || {
            r.phase.set(r.phase.plus(1));
            k.when(r.phase.all(), || {
                r.quad.set(next(k, r.quad, last_quad));
                r.draining.set(last_quad);
            });
        });
    }

    /// The products of a row, a gap, the next row.
    fn products<'k>(
        &self,
        k: &'k Builder,
        r: &Registers<'k>,
        [last_quad, last_column, row_last, next_product]: [Expr<'k>; 4],
        last_product: Expr<'k>,
    ) {
        let (gap, row_gap) = (r.gap, row_gap(self.formats.quads));
        k.when(!*r.draining & r.multiplies(), || {
            k.when(gap.is(0), || {
                r.column.set(next(k, r.column, last_column));
                k.when(last_column & row_last, || gap.set(k.constant(gap.bits(), 1)));
                k.when(last_column & !row_last, || r.product.set(next_product));
            });
            k.when(gap.is(row_gap), || {
                gap.set(k.constant(gap.bits(), 0));
                r.quad.set(next(k, r.quad, last_quad));
                r.product.set(last_quad.mux(next_product, *r.first_product));
                k.when(last_quad, || r.first_product.set(next_product));
                r.draining.set(last_quad & (r.is(Step::First) | last_product));
            });
            k.when(!gap.is(0) & !gap.is(row_gap), || gap.set(gap.plus(1)));
        });
    }

    /// The start of a frame.
    fn start<'k>(&self, k: &'k Builder, io: &PassSequencerPorts<Inside<'k>>, r: &Registers<'k>) {
        k.when(r.is(Step::Idle) & io.start, || {
            r.step.goes(Step::FoldHigh);
            r.seen.set(io.magnitude.resize(r.seen.bits()));
            let Registers { draining, phase, gap, quad, column, product, first_product, length, .. } = *r;
            let Registers { saturations, read, replayed, written, stored, vector, normalise, rescale, .. } = *r;
            let counts = [draining, phase, gap, quad, column, product, first_product, length];
            let words = [saturations, read, replayed, written, stored, vector, normalise, rescale];
            let cleared = counts.iter().chain(&words);
            cleared.for_each(|register| register.set(k.constant(register.bits(), 0)));
        });
    }

    /// The operand that is written: a limb of the folded input, or a word of a v_ij.
    fn operand<'k>(&self, k: &'k Builder, io: &PassSequencerPorts<Inside<'k>>, r: &Registers<'k>) -> Expr<'k> {
        let (f, operands) = (&self.formats, OPERAND_BITS as usize);
        let (data, low, extra) = (f.data_bits as usize, f.input_low_bits as usize, SEARCH_EXTRA_BITS as usize);
        k.comment("Adds half an LSB of the operand; only the largest positive values can overflow.");
        let (top, half) = (data + extra - 1, extra - 1);
        let most = k.constant(1, 0).concat(k.constant(1, 1).repeat(data - 1));
        let overflows = !io.rounded.at(top) & io.rounded.slice(half, top - half).all();
        let nearest = (io.rounded.slice(extra, data) + io.rounded.at(half)).low(data);
        let nearest = k.wire("nearest", overflows.mux(most, nearest));
        let high_limb = wide(io.transformed.slice(low, (io.transformed.bits() - low).min(operands)), operands);
        let align = (f.limb_align as usize).saturating_sub(low);
        let low_limb = if low == 0 { high_limb } else { io.transformed.low(low).shift_left(align).resize(operands) };
        r.is(Step::FoldHigh).mux(high_limb, r.is(Step::FoldLow).mux(low_limb, wide(nearest, operands)))
    }
}

/// A signed word in `bits` bits.
fn wide(word: Expr<'_>, bits: usize) -> Expr<'_> {
    word.signed().resize(bits).unsigned()
}

impl Block for PassSequencer {
    fn build<'k>(&self, k: &'k Builder, io: PassSequencerPorts<Inside<'k>>) {
        let (f, unrounded) = (&self.formats, self.unrounded);
        let (quads, words, vectors) = (count_bits(f.quads), count_bits(4 * f.quads), vector_bits(f));
        let (instructions, code_bits) = (program(f), f.input_bits as usize);
        let count = instructions.len();
        let r = Registers::new(k, &io, f, count_bits(count + 1));
        let program = Program { k, instructions, product: *r.product };

        let row_folding = k.wire("row_folding", r.is(Step::FoldHigh) | r.is(Step::FoldLow));
        let unfolding = io.unfolding.set(r.is(Step::Replay) | r.is(Step::Others));
        let rescaled = k.wire("rescaled", unfolding & io.round_done);
        let drained = k.wire("drained", *r.draining & r.wait_count.is(DRAIN - 1));
        let last_quad = k.wire("last_quad", r.quad.is(f.quads as u64 - 1));
        let last_column = k.wire("last_column", r.column.is(f.quads as u64 - 1));
        let row_last = k.wire("row_last", program.set(&|i| i.last));
        let next_product = k.wire("next_product", r.product.plus(1));
        let place = k.wire("place", r.quad.concat(r.phase.low(2)).low(words));
        let folded = k.wire("folded", row_folding & io.transformed_valid);
        self.words(k, &io, &r, [row_folding, folded, rescaled]);
        self.steps(k, &r, drained, row_folding, last_quad);
        let last_product = r.product.is(count as u64 - 1);
        self.products(k, &r, [last_quad, last_column, row_last, next_product], last_product);
        self.start(k, &io, &r);
        let operand = self.operand(k, &io, &r);

        io.index.set(place);
        io.raw_read_address.set(place);
        io.raw_write.set(r.is(Step::First) & io.row_valid);
        io.raw_write_address.set(*r.stored);
        let from = |replay, others, fold| r.is(Step::Replay).mux(replay, r.is(Step::Others).mux(others, fold));
        let code_word = io.code.signed().shift_left(code_bits - 1).resize(unrounded).unsigned();
        io.unrounded.set(from(wide(io.raw_word, unrounded), wide(io.row_word, unrounded), code_word));
        io.round_shift.set(from(*r.rescale, k.constant(SHIFT_BITS, u64::from(f.a_shift)), *r.length));
        io.round.set(from(*r.replayed, io.row_valid, r.read.at(1)));
        let busy = io.busy.set(!r.is(Step::Idle));
        io.transform.set(io.round_done & busy);
        io.issue.set(r.multiplies() & !*r.draining & r.gap.is(0));
        io.last.set(row_last & last_column);
        io.address.set(concat(&[program.field(2, &|i| i.matrix), *r.quad, *r.column]));
        io.low.set(program.set(&|i| i.low));
        io.operand_address.set(program.field(vectors, &|i| i.operand).concat(*r.column));
        io.flip.set(program.set(&|i| i.flip));
        io.align.set(program.set(&|i| i.align));
        let kept = r.vector.less(k.constant(vectors, f.operand_vectors() as u64));
        io.write.set(folded | rescaled & kept);
        let target = r.is(Step::FoldHigh).mux(
            k.constant(vectors, 0),
            r.is(Step::FoldLow).mux(k.constant(vectors, 1), r.vector.plus(first_vector(f) as u64)),
        );
        // An array of one quad has a quad address of one bit, which is 0.
        let written_quad = if f.quads == 1 { k.constant(quads, 0) } else { r.written.slice(2, quads) };
        io.write_address.set(target.concat(written_quad));
        io.write_lane.set(r.written.at(1).concat(r.written.at(0) ^ !row_folding));
        io.write_data.set(operand);
        io.normalised_valid.set(r.is(Step::FoldHigh) & io.round_done);
        io.folding.set(r.is(Step::FoldHigh));
        io.rescaled_valid.set(rescaled);
        io.free.set(drained & r.is(self.freed()));
        io.done.set(drained & r.is(Step::Others));
    }
}

#[cfg(test)]
mod tests;
