//! Stages `forces` and `send`: one product at a time, a beat every
//! [`BEAT`](dermis_golden::fixed::plan::serial::BEAT) cycles.
//!
//! ```text
//! phase  0 order | 1 bank | 2 … 4 factors μ1, μ2, 1 | 3 … 5 products | 4 … 6 rounder | 8 … 10 forces
//!        11 threshold | 12 beat
//! ```
//! The next taxel's value is read meanwhile and taken when the beat is accepted: from then on phases 3 to 12 repeat.
//! Before the first beat both μ words are computed in the same way; after the last force the status words take the
//! place of the forces.

use dermis_golden::fixed::plan::serial::{polynomials, word_bits, BEAT, FACTOR_BITS, FIRST_BEAT, MU_WORDS};
use dermis_golden::fixed::stages::send::{CONDITION, FOUND, FRAMING, STATUS_BEATS};
use dermis_golden::fixed::words::formats::{FORCE_BITS, FORCE_SHIFT_MAX, MU_ROUND};
use dermis_golden::fixed::Model;
use dermis_golden::result::flags::{NEGATIVE_PRESSURE, NO_CONTACT, SCORE_LOW};

use super::pass_sequencer::SATURATION_BITS;
use super::rounder::SHIFT_BITS;
use crate::block;
use crate::language::{concat, Block, Builder, Expr, Inside, Net, Type};
use crate::primitives::{count_bits, position_bits, status_bits, Balance, Stream};

const WORD: usize = FORCE_BITS as usize;
const FACTOR: usize = FACTOR_BITS as usize;
/// Start of the cycle count: cycles before `frame_begin` and after the count stops, at the first beat.
const COUNTED_LATER: u64 = 2;
const LAST_PHASE: u64 = FIRST_BEAT - 1;
/// First phase of a beat whose value has already been read.
const AGAIN_PHASE: u64 = FIRST_BEAT - BEAT;
/// Width of the count of cycles to the first beat, in bits.
const CYCLES: usize = 20;

block! {
    /// Values in, beats out; timing in the module docs.
    pub struct Forces {
        /// Width of a place.
        places: usize,
        /// Width of a polynomial's number.
        wanted: usize,
        /// A larger score is that of no clean frame.
        score_limit: Option<i64>,
        /// Sum of the normal forces that tells whether they pull, if it is taken.
        balance: Option<Balance>,
        /// Width of a word from the bank, and of the value p(μ*) in it.
        word: usize,
        value: usize,
        /// Width of the score.
        score: usize,
        /// Width of a word for the rounder.
        unrounded: usize,
        mu_step: i64,
        mu_fraction: u32,
        shift_base: i64,
        threshold: i64,
        taxels: u64,
    }
    ports ForcesPorts {
        clock;
        reset;
        /// All values are in the bank: start sending.
        in start;
        /// Row-major index of the taxel to read; valid from the cycle after `start` until the frame's last force.
        out index: places;
        /// Place 4·quad + lane of that taxel; one cycle after `index`.
        in place: places;
        /// Index of the taxel's polynomial; combinational from `place`.
        out wanted: wanted;
        /// Value p(μ*) of the taxel, signed; one cycle after `wanted`.
        in value: word;
        /// μ1 in grid steps of the last level, signed; stable while sending.
        in best_x: position_bits();
        /// μ2 in grid steps of the last level, signed; stable while sending.
        in best_y: position_bits();
        /// Score of the best candidate, signed, 2^−6; stable while sending.
        in score: score;
        /// The search found a candidate; stable while sending.
        in found;
        /// The frame meets the scene's condition; stable while sending.
        in condition;
        /// `tlast` was early or missing; stable while sending.
        in framing;
        /// Left shift of `normalise`; stable while sending.
        in normalise: SHIFT_BITS;
        /// Right shift of `rescale`; stable while sending.
        in rescale: SHIFT_BITS;
        /// Words saturated by `rescale`; stable while sending.
        in saturations: SATURATION_BITS;
        /// A frame starts: its cycle count restarts.
        in frame_begin;
        /// Product for the rounder, signed; its force word is on `rounded` four cycles later.
        out product: unrounded;
        /// Right shift for the rounder; valid with `product`.
        out round_shift: SHIFT_BITS;
        /// Word from the rounder, 32 bits signed; four cycles after `product`.
        in rounded: WORD;
        /// `rounded` was saturated.
        in clipped;
        /// `{fz, fy, fx}`, 32 bits signed each, or a status beat; valid with `m_axis_tvalid`.
        source<Stream> m_axis: 3 * WORD;
        /// The frame's last beat is accepted in this cycle.
        out done;
    }
}

impl Forces {
    /// With the widths and limits of `model`; the rounder takes words of `unrounded` bits.
    pub fn new(model: &Model, unrounded: usize) -> Self {
        let f = model.formats();
        let rescale_max = i64::from(f.raw_length_max.saturating_sub(f.vector_bits - 1));
        let headroom = i64::from(FORCE_BITS - f.search_bits[0]);
        Forces {
            places: count_bits(4 * f.quads),
            wanted: count_bits(polynomials(f)),
            word: word_bits(f),
            value: f.search_bits[0] as usize,
            score: f.score_bits as usize,
            unrounded,
            mu_step: f.mu_step,
            mu_fraction: f.mu_fraction,
            shift_base: i64::from(f.mu_fraction) + rescale_max - headroom,
            threshold: model.threshold(),
            score_limit: model.score_limit.map(i64::from),
            balance: Balance::of_model(model),
            taxels: 4 * f.quads as u64,
        }
    }
}

/// Right shift of the forces, 0 to [`FORCE_SHIFT_MAX`]; registered: its inputs are stable long before it is used.
fn force_shift<'k>(k: &'k Builder, base: i64, normalise: Expr<'k>, rescale: Expr<'k>) -> Expr<'k> {
    let sum = (k.signed_constant(10, base) + normalise.extend(10).signed()).low(10);
    let shift = k.wire("shift", (sum - rescale.extend(10)).low(10));
    let most = k.constant(SHIFT_BITS, FORCE_SHIFT_MAX.into());
    let own = shift.low(SHIFT_BITS);
    let above = shift.slice(6, 3).any() | most.less(own);
    let settled = k.register("settled_shift", Type::unsigned(SHIFT_BITS));
    settled.set(shift.top().mux(k.constant(SHIFT_BITS, 0), above.mux(most, own)));
    *settled
}

/// What the status words hold.
struct Status<'k> {
    /// x and y of the best position.
    best: [Expr<'k>; 2],
    score: Expr<'k>,
    /// The bits that are set, up to `framing`.
    flags: Expr<'k>,
    found: Expr<'k>,
    normalise: Expr<'k>,
    rescale: Expr<'k>,
    /// Saturations of `rescale` and of the forces; cycles to the first beat.
    counts: [Expr<'k>; 3],
}

impl<'k> Status<'k> {
    /// Word `axis` of status beat `beat`.
    fn word(&self, k: &'k Builder, beat: Expr<'k>, axis: usize) -> Expr<'k> {
        let zero = k.constant(WORD, 0);
        let number = |word: Expr<'k>| word.signed().extend(WORD).unsigned();
        let first = [number(self.best[0]), number(self.best[1]), self.flags];
        let second = [self.found.mux(number(self.score), zero), self.rescale, self.normalise];
        let choose = |words: [Expr<'k>; 3]| words[axis].extend(WORD);
        beat.is(0).mux(choose(first), beat.is(1).mux(choose(second), choose(self.counts)))
    }
}

/// Registers of the products and of the beats.
struct Registers<'k> {
    /// The μ words are computed; beats are sent; the beat is there.
    scaling: Net<'k>,
    sending: Net<'k>,
    valid: Net<'k>,
    /// The beat is one of the status; cycles are counted; the frame has a contact.
    status: Net<'k>,
    counting: Net<'k>,
    contact: Net<'k>,
    phase: Net<'k>,
    /// Number of the beat, and of the taxel that is read.
    beat: Net<'k>,
    ahead: Net<'k>,
    factor_a: Net<'k>,
    factor_b: Net<'k>,
    mu: [Net<'k>; 2],
    result: Net<'k>,
    /// fx, fy, fz.
    words: [Net<'k>; 3],
    force_saturations: Net<'k>,
    first_cycles: Net<'k>,
}

/// The sum of the normal forces, if it is taken.
type Balanced<'k> = Option<(Balance, Net<'k>)>;

impl<'k> Registers<'k> {
    fn new(k: &'k Builder, rst: Expr<'k>, of: &Forces) -> Self {
        let bit = Type::unsigned(1);
        let register = |name: &str, bits: usize| k.register(name, Type::unsigned(bits));
        let signed = |name: &str, bits: usize| k.register(name, Type::signed(bits));
        Registers {
            scaling: k.state("scaling", bit, rst, 0),
            sending: k.state("sending", bit, rst, 0),
            valid: k.state("valid", bit, rst, 0),
            status: register("status", 1),
            counting: register("counting", 1),
            contact: register("contact", 1),
            phase: register("phase", 4),
            beat: register("beat", of.places),
            ahead: register("ahead", of.places),
            factor_a: signed("factor_a", of.value),
            factor_b: signed("factor_b", FACTOR),
            mu: ["mu_x", "mu_y"].map(|name| signed(name, FACTOR)),
            result: signed("result", of.value + FACTOR),
            words: ["fx", "fy", "fz"].map(|name| register(name, WORD)),
            force_saturations: register("force_saturations", SATURATION_BITS),
            first_cycles: register("first_cycles", CYCLES),
        }
    }

    fn at(&self, k: &'k Builder, phases: &[usize]) -> Expr<'k> {
        super::one_of(k, *self.phase, phases)
    }

    /// The two μ words, from the `best` position.
    fn scale(&self, k: &'k Builder, of: &Forces, best: [Expr<'k>; 2], rounded: Expr<'k>) {
        let scaled = self.at(k, &[MU_WORDS as usize - 1]);
        k.when(*self.scaling, || {
            self.phase.set(scaled.mux(k.constant(4, 0), self.phase.plus(1)));
            k.when(self.at(k, &[0]), || {
                self.factor_a.set(k.signed_constant(of.value, of.mu_step));
                self.factor_b.set(best[0].signed());
            });
            k.when(self.at(k, &[1]), || self.factor_b.set(best[1].signed()));
            for (word, phase) in self.mu.iter().zip([6, 7]) {
                k.when(self.at(k, &[phase]), || word.set(rounded.low(FACTOR).signed()));
            }
            k.when(scaled, || {
                self.scaling.set(k.constant(1, 0));
                self.sending.set(k.constant(1, 1));
            });
        });
    }

    /// The start of a frame's beats.
    fn start(&self, k: &'k Builder, start: Expr<'k>, balance: &Balanced<'k>) {
        k.when(!*self.scaling & !*self.sending & start, || {
            self.scaling.set(k.constant(1, 1));
            let cleared = [self.phase, self.status, self.beat, self.ahead, self.force_saturations, self.contact];
            cleared.iter().for_each(|register| register.set(k.constant(register.bits(), 0)));
            balance.iter().for_each(|(own, sum)| sum.set(k.signed_constant(own.ty().bits, 0)));
        });
    }
}

impl Forces {
    /// The word of the status in the place of fx, fy or fz; the sum that a flag tells the sign of.
    fn status<'k>(&self, k: &'k Builder, io: &ForcesPorts<Inside<'k>>, r: &Registers<'k>) -> (Expr<'k>, Balanced<'k>) {
        let mut bits =
            vec![(FRAMING, io.framing), (NO_CONTACT, !*r.contact), (FOUND, io.found), (CONDITION, io.condition)];
        bits.extend(self.score_limit.map(|limit| {
            let low = io.found & k.signed_constant(self.score, limit).less(io.score.signed());
            (SCORE_LOW, k.wire("score_low", low))
        }));
        let balance = self.balance.map(|own| (own, k.register("balance", own.ty())));
        bits.extend(balance.as_ref().map(|(_, sum)| (NEGATIVE_PRESSURE, sum.top())));
        let highest = bits.iter().map(|(field, _)| field.low).fold(0, u32::max);
        let state = Status {
            best: [io.best_x, io.best_y],
            score: io.score,
            flags: concat(&status_bits(k, &bits, highest + 1)),
            found: io.found,
            normalise: io.normalise,
            rescale: io.rescale,
            counts: [io.saturations, *r.force_saturations, *r.first_cycles],
        };
        let own = r.beat.low(self.places.min(2));
        let [status_x, status_y, status_z] = [0, 1, 2].map(|axis| {
            let name = ["status_x", "status_y", "status_z"][axis];
            k.wire(name, state.word(k, own, axis))
        });
        (r.phase.at(1).mux(status_z, r.phase.at(0).mux(status_y, status_x)), balance)
    }
}

impl Block for Forces {
    fn build<'k>(&self, k: &'k Builder, io: ForcesPorts<Inside<'k>>) {
        let r = Registers::new(k, io.rst, self);
        let Registers { scaling, sending, valid, status, counting, phase, beat, ahead, .. } = r;
        let Registers { factor_a, factor_b, mu: [mu_x, mu_y], result, words: [fx, fy, fz], first_cycles, .. } = r;
        let (one, zero) = (k.constant(1, 1), k.constant(1, 0));
        let at = |phases: &[usize]| r.at(k, phases);
        let sends = k.wire("sends", !*scaling & *sending);
        let beat_taken = k.wire("beat_taken", *sending & at(&[LAST_PHASE as usize]) & io.m_axis.ready);
        let take_value = k.wire("take_value", beat_taken | (*sending & at(&[2])));
        let last_beat = k.wire("last_beat", *status & beat.is(STATUS_BEATS as u64 - 1));
        let last_force = k.wire("last_force", !*status & beat.is(self.taxels - 1));
        let size = fz.top().mux((k.constant(WORD, 0) - *fz).low(WORD), *fz);
        let too_small = match self.threshold {
            0 => zero,
            threshold => k.wire("too_small", size.less(k.constant(WORD + 1, threshold as u64))),
        };
        let settled_shift = force_shift(k, self.shift_base, io.normalise, io.rescale);
        let (of_status, balance) = self.status(k, &io, &r);
        let captured = k.wire("captured", (!*status).mux(io.rounded, of_status));

        result.set(*factor_a * *factor_b);
        // The beats. They come first: what waits for m_axis_tready arrives late, so the μ words take precedence.
        let is_force = !*status;
        k.when(sends, || {
            k.when(!at(&[LAST_PHASE as usize]), || phase.set(phase.plus(1)));
            k.when(take_value, || {
                factor_a.set(io.value.low(self.value).signed());
                factor_b.set(*mu_x);
                ahead.set(ahead.plus(1));
            });
            k.when(at(&[3]), || factor_b.set(*mu_y));
            k.when(at(&[4]), || factor_b.set(k.signed_constant(FACTOR, 1 << self.mu_fraction)));
            k.when(at(&[8, 9, 10]), || {
                // All three enter at fz and shift down: only one register has the multiplexer.
                fx.set(*fy);
                fy.set(*fz);
                fz.set(captured);
                k.when(io.clipped & is_force, || r.force_saturations.set(r.force_saturations.plus(1)));
            });
            k.when(at(&[11]), || {
                k.when(is_force & too_small, || r.words.iter().for_each(|word| word.set(k.constant(WORD, 0))));
                k.when(is_force & !too_small & fz.any(), || r.contact.set(one));
                counting.set(zero);
                valid.set(one);
            });
            k.when(beat_taken & is_force, || {
                balance.iter().for_each(|(own, sum)| sum.set(own.sum(**sum, own.weighed(fz.signed()))));
            });
            k.when(beat_taken, || {
                phase.set(k.constant(4, AGAIN_PHASE));
                valid.set(zero);
                beat.set(last_force.mux(k.constant(self.places, 0), beat.plus(1)));
                k.when(last_force, || status.set(one));
                k.when(last_beat, || sending.set(zero));
            });
        });
        r.scale(k, self, [io.best_x, io.best_y], io.rounded);
        r.start(k, io.start, &balance);
        k.when(*counting, || first_cycles.set(first_cycles.plus(1)));
        k.when(io.frame_begin, || {
            counting.set(one);
            first_cycles.set(k.constant(CYCLES, COUNTED_LATER));
        });

        io.index.set(*ahead);
        io.wanted.set(io.place.extend(self.wanted).plus(1));
        io.product.set(result.extend(self.unrounded).unsigned());
        io.round_shift.set(scaling.mux(k.constant(SHIFT_BITS, MU_ROUND.into()), settled_shift));
        io.m_axis.data.set(concat(&[*fz, *fy, *fx]));
        io.m_axis.valid.set(*valid);
        let last = io.m_axis.last.set(*valid & last_beat);
        io.done.set(last & io.m_axis.ready);
    }
}

#[cfg(test)]
mod tests;
