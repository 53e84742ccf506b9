//! Search sequencer: the order of sweeps, centres and buffers.

use dermis_golden::fixed::stages::search::COARSE_CENTRES;
use dermis_golden::fixed::words::formats::HALVINGS;

use crate::block;
use crate::language::{concat, Block, Builder, Expr, Inside, Type};
use crate::primitives::search::store::{base, base_bits};
use crate::primitives::search::sweep::{position_bits, square_bits, sweep_bits, Fields, BUFFER_BITS, START};

block! {
    /// Sweeps over the coarse tiles, then the halvings, then a last sweep that only moves to the best position.
    ///
    /// `set_up` starts a sweep. Its `step`, `sweep` and `source` are valid from the next cycle until the following
    /// `set_up`; `target`, also a field of `sweep`, one cycle later. In the coarse grid `set_up` may coincide with
    /// `compared`; otherwise it comes three cycles after `compared` or `begin_frame`.
    ///
    /// Coarse sweeps follow one another without waiting for the comparison of their candidates (`chains`): each reads
    /// the buffer that the previous one wrote, and writes the one that is neither that nor the best so far. Three
    /// buffers are enough as long as a sweep is compared before the next but one is set up. Halvings work in place.
    /// `compared` with `improved` makes the buffer of a coarse sweep the best.
    pub struct SearchSequencer {
        /// Quads of a buffer.
        quads: usize,
    }
    ports SearchSequencerPorts {
        clock;
        /// Synchronous reset, active high; clears `chains` only.
        in rst;
        /// A new search starts.
        in begin_frame;
        /// Search; otherwise only the last sweep follows. Valid with `begin_frame`.
        in enabled;
        /// Set up the next sweep.
        in set_up;
        /// The candidates of a sweep have been compared.
        in compared;
        /// The best candidate changed; valid with `compared`.
        in improved;
        /// Word of that sweep; valid with `compared`.
        in compared_sweep: sweep_bits();
        /// Best position, x, in grid steps, signed; constant in the two cycles before a halving or the last sweep is
        /// set up.
        in best_x: position_bits();
        /// Best position, y, in grid steps, signed; as `best_x`.
        in best_y: position_bits();
        /// Move of the sweep, as in [`Taylor`](super::taylor::Taylor), x in bits 1:0, y in bits 3:2, halving in bit 4;
        /// valid from the cycle after `set_up` until the next.
        out step: 5;
        /// The sweep is the last: it only moves to the best position.
        out last;
        /// The next sweep is a halving.
        out next_halves;
        /// The next sweep is the last.
        out next_last;
        /// The next sweep may be set up without waiting for the comparison of this one.
        out chains;
        /// Buffer to read; valid from the cycle after `set_up` until the next.
        out source: BUFFER_BITS;
        /// First address of the buffer that the next sweep reads; one cycle after that buffer is known.
        out next_base: base_bits(*quads);
        /// Buffer to write; valid from two cycles after `set_up` to one cycle after the next.
        out target: BUFFER_BITS;
        /// Word of the sweep (`Fields`); valid from two cycles after `set_up` until the next.
        out sweep: sweep_bits();
        /// Squared radius of the search disc in grid steps of the level; valid from the cycle after `set_up` until the
        /// next.
        out radius: square_bits();
    }
}

/// Number of sweeps whose candidates are compared.
const COMPARED: usize = COARSE_CENTRES.len() + HALVINGS as usize;
/// Width of the number of a sweep, in bits.
const COUNT_BITS: usize = 4;
/// Squared radius of the search disc in steps of the coarse grid.
const COARSE_RADIUS: u64 = 9;

impl SearchSequencer {
    /// For a search memory with buffers of `quads` quads.
    pub fn new(quads: usize) -> Self {
        SearchSequencer { quads }
    }
}

/// Moves between the centres of the coarse sweeps, in order.
fn coarse_moves() -> Vec<[i64; 2]> {
    let mut at = [0, 0];
    let step = |to: &[i32; 2]| {
        let step = [to[0] - at[0], to[1] - at[1]].map(i64::from);
        at = *to;
        step
    };
    COARSE_CENTRES.iter().map(step).collect()
}

/// The coordinate `from` after the move `go` of −1, 0 or 1.
fn moved<'k>(from: Expr<'k>, go: Expr<'k>) -> Expr<'k> {
    (from + go.signed().resize(from.bits())).resize(from.bits())
}

/// 1 − 2 c: (c + u)² − c² for the move u = −1 from c, modulo the width of a square.
fn grows_down<'k>(k: &'k Builder, from: Expr<'k>) -> Expr<'k> {
    let bits = square_bits();
    (k.constant(bits, 1) - from.shift_left(1).resize(bits).unsigned()).low(bits)
}

/// (c + u)² − c² for the move `go` of −1, 0 or 1 from `from`, modulo the width of a square; `down` is that for −1.
fn grows<'k>(k: &'k Builder, from: Expr<'k>, go: Expr<'k>, down: Expr<'k>) -> Expr<'k> {
    let bits = square_bits();
    // 1 + 2 c: the lowest bit of 2 c is 0.
    let up = from.resize(bits - 1).unsigned().concat(k.constant(1, 1));
    go.at(1).mux(down, go.at(0).mux(up, k.constant(bits, 0)))
}

/// A number times 2^`by` with its own width.
fn shifted(value: Expr<'_>, by: usize) -> Expr<'_> {
    value.shift_left(by).low(value.bits())
}

impl Block for SearchSequencer {
    fn build<'k>(&self, k: &'k Builder, io: SearchSequencerPorts<Inside<'k>>) {
        let (p, q) = (position_bits(), square_bits());
        let (final_coarse, final_halving) = (COARSE_CENTRES.len() as u64 - 1, COMPARED as u64 - 1);
        let best = [io.best_x, io.best_y];
        let bit = Type::unsigned(1);
        let zero = k.constant(1, 0);
        let number = |buffer: usize| k.constant(BUFFER_BITS, buffer as u64);
        let count = k.register("count", Type::unsigned(COUNT_BITS));
        let (is_coarse, is_halving) = (k.register("is_coarse", bit), k.register("is_halving", bit));
        let (step, last) = (io.step.register(), io.last.register());
        let chains = io.chains.state(io.rst, 0);
        let (source, target) = (io.source.register(), io.target.register());
        let radius = io.radius.register();
        let kept = k.register("kept", Type::unsigned(sweep_bits()));
        let (closes, coarse) = (k.register("taken_closes", bit), k.register("taken_coarse", bit));
        let place = k.register("place", Type::unsigned(q + 2 * p));

        let at_last_coarse = k.wire("at_last_coarse", count.is(final_coarse));
        let closing = k.wire("closing", !*is_coarse | at_last_coarse);
        io.next_halves.set(*is_halving);
        let next_last = io.next_last.set(!*is_coarse & !*is_halving);
        k.comment("A coarse sweep set up in the cycle of `compared` already uses its result for the choice of");
        k.comment("buffers; a halving is set up later.");
        let keeps = k.wire("keeps", io.compared & io.improved & Fields::of(io.compared_sweep).coarse);
        let kept_buffer = k.wire("kept_buffer", Fields::of(*kept).buffer);
        let sweep = io.sweep.set(concat(&[*closes, *coarse, *target, *place]));
        let from = Fields::of(k.wire("from", is_coarse.mux(sweep, *kept)));

        k.comment("The best position is at most one step from the centre of its polynomials, so two bits of the");
        k.comment("difference are the move. Move, starting point and destination are registered before the sweep is");
        k.comment("set up.");
        let moves = coarse_moves();
        let axis = |axis: usize, name: &str| {
            let table: Vec<u64> =
                (0..1 << COUNT_BITS).map(|n| moves.get(n).map_or(0, |by| by[axis] as u64 & 3)).collect();
            let to_best = (best[axis].low(2) - from.centre[axis].low(2)).low(2);
            let go = k.delay(&format!("go_{name}"), is_coarse.mux(count.table(2, &table), to_best));
            let down = k.delay(&format!("down_{name}"), grows_down(k, from.centre[axis]));
            (go, k.delay(&format!("base_{name}"), from.centre[axis]), down)
        };
        let [(go_x, base_x, down_x), (go_y, base_y, down_y)] = [axis(0, "x"), axis(1, "y")];
        let base_square = k.delay("base_square", from.square);
        let base_buffer = k.delay("base_buffer", from.buffer);
        let bases: Vec<u64> = (0..1 << BUFFER_BITS).map(|b| base(b, self.quads) as u64).collect();
        io.next_base.delay(from.buffer.table(base_bits(self.quads), &bases));
        let to_square = base_square + grows(k, base_x, go_x, down_x) + grows(k, base_y, go_y, down_y);
        let at_square = k.delay("at_square", to_square.low(q));
        let at_x = k.delay("at_x", moved(base_x, go_x));
        let at_y = k.delay("at_y", moved(base_y, go_y));
        let next = [(at_square, 2), (at_y, 1), (at_x, 1)];
        let next = next.map(|(value, by)| is_halving.mux(shifted(value, by), value.unsigned()));
        let next = k.wire("next", concat(&next));

        k.comment("The first sweep of a search, halvings and the last one; registered before the sweep is set up.");
        let in_place = k.delay("in_place", !*is_coarse | count.is(0));

        k.comment("A coarse sweep writes the first of buffers 1, 2, 0 that is neither read nor the best, chosen one");
        k.comment("cycle after the set-up, when a `compared` in the cycle of the set-up has taken effect. The first,");
        k.comment("which reads START, writes 1. Other sweeps work in place.");
        let unused = |b: u64| !source.is(b) & !kept_buffer.is(b);
        let other = unused(2).mux(number(2), number(0));
        let free = k.wire("free", (source.is(START as u64) | unused(1)).mux(number(1), other));
        let (set_up_1, coarse_1) = (k.delay("set_up_1", io.set_up), k.delay("coarse_1", *is_coarse));
        k.when(set_up_1, || target.set(coarse_1.mux(free, *source)));
        k.when(io.set_up, || {
            count.set(count.plus(1));
            k.when(at_last_coarse, || is_coarse.set(zero));
            is_halving.set((*is_halving | at_last_coarse) & !count.is(final_halving));
            closes.set(closing);
            coarse.set(*is_coarse);
            place.set(next);
            k.when(*is_halving, || radius.set(shifted(*radius, 2)));
            chains.set(!closing);
        });
        k.when(io.set_up & !io.begin_frame, || {
            step.set(concat(&[*is_halving, go_y, go_x]));
            last.set(next_last);
            source.set(base_buffer);
        });
        k.when(keeps, || kept.set(io.compared_sweep));
        k.when(io.set_up & in_place, || {
            kept.set(concat(&[closing, *is_coarse, is_coarse.mux(number(1), kept_buffer), next]));
        });
        k.when(io.begin_frame, || {
            count.set(io.enabled.mux(k.constant(COUNT_BITS, 0), k.constant(COUNT_BITS, COMPARED as u64)));
            is_coarse.set(io.enabled);
            is_halving.set(zero);
            closes.set(zero);
            coarse.set(zero);
            place.set(zero.repeat(place.bits()));
            target.set(number(START));
            kept.set(concat(&[zero, zero, number(START), zero.repeat(place.bits())]));
            radius.set(k.constant(q, COARSE_RADIUS));
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::primitives::search::sweep::{Sweep, BUFFERS};
    use crate::wire::Word;

    const QUADS: usize = 25;

    /// The search in plain integers; a sweep is computed in the cycle in which it is set up.
    #[derive(Clone, Copy, Debug, Default)]
    struct Search {
        /// A search has started; before, nothing is defined.
        begun: bool,
        count: usize,
        sweep: Sweep,
        kept: Sweep,
        radius: i64,
        /// The target buffer of the sweep is output in the next cycle.
        chosen: bool,
        target: usize,
        chains: Option<bool>,
        next_base: Option<usize>,
        /// Step, last, source of a sweep.
        taken: Option<(Word, bool, usize)>,
    }

    impl Search {
        fn is_coarse(&self) -> bool {
            self.count < COARSE_CENTRES.len()
        }

        fn advance(&mut self, best: [i64; 2]) {
            let coarse = self.is_coarse();
            let halving = !coarse && self.count < COMPARED;
            let from = if coarse { self.sweep } else { self.kept };
            let by = match coarse_moves().get(self.count) {
                Some(by) => *by,
                None => [best[0] - from.centre[0], best[1] - from.centre[1]],
            };
            let double = i64::from(halving) + 1;
            let centre = [0, 1].map(|axis| double * (from.centre[axis] + by[axis]));
            let free = (1..=BUFFERS).map(|b| b % BUFFERS).find(|b| *b != from.buffer && *b != self.kept.buffer);
            let buffer = if coarse { free.unwrap_or(0) } else { self.kept.buffer };
            let closes = !coarse || self.count + 1 == COARSE_CENTRES.len();
            let square = centre[0] * centre[0] + centre[1] * centre[1];
            self.sweep = Sweep { centre, square, buffer, coarse, closes };
            self.radius *= double * double;
            if !coarse || self.count == 0 {
                self.kept = self.sweep;
            }
            self.count += 1;
            self.chosen = true;
            let step = Word::of_fields(&[by[0], by[1], i64::from(halving)], 2);
            self.taken = Some((step, !coarse && !halving, from.buffer));
            self.chains = Some(!closes);
        }
    }

    impl Reference for Search {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let number = |value: usize| Word::from(value as u64);
            let begun = |word: Word| self.begun.then_some(word);
            vec![
                self.taken.map(|(step, ..)| step),
                self.taken.map(|(_, last, _)| last.into()),
                self.chains.map(Word::from),
                self.taken.map(|(.., source)| number(source)),
                begun(number(self.target)),
                begun(Word::from(self.radius as u64)),
                begun((COARSE_CENTRES.len()..COMPARED).contains(&self.count).into()),
                begun((self.count >= COMPARED).into()),
                begun(Sweep { buffer: self.target, ..self.sweep }.word()),
                self.next_base.map(number),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, begin_frame, enabled, set_up, compared, improved] =
                [0, 1, 2, 3, 4, 5].map(|k| inputs[k].number() == 1);
            let next = if self.is_coarse() { self.target } else { self.kept.buffer };
            self.next_base = self.begun.then_some(base(next, QUADS));
            if begin_frame {
                let start = Sweep { buffer: START, ..Sweep::default() };
                let count = if enabled { 0 } else { COMPARED };
                let before = *self;
                *self = Search { begun: true, count, radius: 9, sweep: start, kept: start, target: START, ..before };
                self.chosen = false;
            }
            if std::mem::take(&mut self.chosen) {
                self.target = self.sweep.buffer;
            }
            let sweep = Sweep::of_word(&inputs[6]);
            if compared && improved && sweep.coarse {
                self.kept = sweep;
            }
            if set_up {
                self.advance([7, 8].map(|k| inputs[k].signed(0, position_bits())));
            }
            if rst {
                self.chains = Some(false);
            }
        }
    }

    /// Searches with results of comparisons at random times: in the coarse grid also in the cycle of a set-up,
    /// otherwise at least three cycles before it.
    fn stimulus(cycles: usize) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(7);
        let mut search = Search::default();
        let (mut since, mut go, mut coarse) = (0, [0, 0], Vec::new());
        let inputs = |cycle: usize| {
            let done = search.count > COMPARED;
            let begin_frame = cycle > 2 && (!search.begun || (done && random.u8(..4) == 0) || random.u16(..500) == 0);
            let enabled = random.u8(..6) > 0;
            let set_up = search.begun && !begin_frame && !done && since > 4 && random.u8(..4) == 0;
            // After the last coarse sweep nothing is kept in the last cycles before a halving.
            let quiet = since > 0 && !search.is_coarse();
            let compared = !begin_frame && !quiet && !coarse.is_empty() && random.u8(..3) == 0;
            let improved = random.bool();
            let compared_sweep = if compared { coarse[random.usize(..coarse.len())] } else { Sweep::default() };
            let best = [0, 1].map(|axis| Word::of_fields(&[search.kept.centre[axis] + go[axis]], position_bits()));
            let inputs = vec![
                (cycle < 2 || random.u16(..100) == 0).into(),
                begin_frame.into(),
                enabled.into(),
                set_up.into(),
                compared.into(),
                improved.into(),
                compared_sweep.word(),
                best[0],
                best[1],
            ];
            since = if begin_frame || set_up { 0 } else { since + 1 };
            search.clock(&inputs);
            if begin_frame {
                coarse.clear();
                go = [0, 0];
            }
            if set_up {
                go = [random.i64(-1..2), random.i64(-1..2)];
                if search.sweep.coarse {
                    coarse.push(search.sweep);
                }
            }
            inputs
        };
        (0..cycles).map(inputs).collect()
    }

    #[test]
    fn sweeps_are_those_of_the_search_in_integers() {
        let block = SearchSequencer::new(QUADS);
        check(&kernel_of(&block), &stimulus(10_000), &mut Search::default());
    }
}
