//! The running zero of [`Calibrate`](super::calibrate::Calibrate): what a code is above its zero, without drift.
//!
//! ```text
//! code − zero --> difference ----------> difference − drift ---------. rests
//! drifts ------> drift, drift + step --> difference − (drift + step) -+---> difference, pressed?
//!    ^---------- drift, step <---------------------------------------'
//! ```
//! Whether something pressed in the frame before is known when its last beat leaves these registers, one cycle before the
//! first of the next frame needs it: until then both differences are there, with the step and without. So no cycle is lost,
//! and no comparison is in series with a sum. A word is written three cycles after it was read, which four taxels allow; after
//! an early `tlast` no beat is taken for [`RECOVERY`] cycles.
//!
//! After a reset drifts are 0 until the first frame is complete; an early `tlast` leaves no step.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::stages::prepare::running_zero::RunningZero;

use super::arrays::{Arrays, Resets};
use crate::language::{Builder, Contents, Expr, Type};

/// Cycles after an early `tlast` in which no beat is taken, so that the words of a frame of one beat have been written.
pub(super) const RECOVERY: usize = 3;

/// What comes with a beat.
pub(super) struct Beat<'k> {
    /// Reset, and whether the registers advance.
    pub rst: Expr<'k>,
    pub moves: Expr<'k>,
    /// In the cycle in which a beat is offered: whether one is, its taxel and place, whether it is the last, whether `tlast` is early.
    pub offered: Expr<'k>,
    pub taxel: Expr<'k>,
    pub place: Expr<'k>,
    pub end: Expr<'k>,
    pub early: Expr<'k>,
    /// A cycle later: its code less the zero, and its gain.
    pub off: Expr<'k>,
    pub gain: Option<Expr<'k>>,
    /// Three cycles later: whether there is one.
    pub valid: Expr<'k>,
}

/// The same three cycles after the beat was offered.
pub(super) struct Followed<'k> {
    /// Its code less zero and drift.
    pub difference: Expr<'k>,
    pub gain: Option<Expr<'k>>,
    /// Whether a zero was at its limit in the frame before.
    pub limited: Expr<'k>,
}

/// For `taxels` taxels of each of the `arrays`, whose zeros begin anew with `resets`.
pub(super) fn follow<'k>(
    k: &'k Builder,
    zero: &RunningZero,
    arrays: Arrays,
    resets: Resets<'k>,
    taxels: usize,
    beat: Beat<'k>,
) -> Followed<'k> {
    let Beat { rst, moves, offered, taxel, place, end, early, off, gain, valid } = beat;
    let [moved_bits, step_bits] = [zero.moved_bits(), zero.step_bits()].map(|bits| bits as usize);
    let (limit, most) = (i64::from(zero.limit), i64::from(zero.limit) << zero.average);
    let bit = Type::unsigned(1);
    let drifts =
        k.memory("drifts", arrays.words(taxels), moved_bits + step_bits, Contents::Undefined).holds(Holds::Drift);

    k.comment("The drift as it was stored, 0 in the first frame after a reset.");
    let array = arrays.array_of(place);
    let firsts = arrays.state(k, "first", bit, resets, 1);
    let word = k.register("word", Type::unsigned(moved_bits + step_bits));
    let held = |name: &str, value: Expr<'k>| {
        let register = k.register(name, value.ty());
        k.when(moves, || register.set(value));
        *register
    };
    k.when(moves, || word.set(drifts.read(place)));
    k.when(moves & offered & end, || firsts.set(k, array, k.constant(1, 0)));
    let taxels_held = held("taxel_1", place);
    let ends = held("end_1", end);
    let early_held = held("early_1", early);
    let first = held("first_1", firsts.of(array));
    let dead = (!zero.dead.is_empty()).then(|| {
        let table: Vec<u64> = (0..1 << taxel.bits()).map(|at| u64::from(zero.dead.contains(&at))).collect();
        held("dead_1", taxel.table(1, &table))
    });

    k.comment("With the step of the frame before and without it.");
    let stored = k.wire("stored", first.mux(k.constant(word.bits(), 0), *word));
    let stay = k.wire("stay", stored.low(moved_bits).signed());
    let sum = k.wire("sum", stay + stored.slice(moved_bits, step_bits).signed());
    let bound = |limit: i64, bits: usize| k.signed_constant(bits, limit);
    let (high, low) = (bound(most, moved_bits), bound(-most, moved_bits));
    let go = k.wire("go", high.less(sum).mux(high, sum.less(low).mux(low, sum.low(moved_bits).signed())));
    let (off, stay, go) = (held("off_2", off), held("stay_2", stay), held("go_2", go));
    let silent = gain.map(|gain| gain.unsigned().is(0));
    let dead = dead.into_iter().chain(silent).reduce(|dead, silent| dead | silent).map(|dead| held("dead_2", dead));
    let gain = gain.map(|gain| held("gain_2", gain));
    let [taxels_held, ends, early_held] =
        [("taxel_2", taxels_held), ("end_2", ends), ("early_2", early_held)].map(|(name, value)| held(name, value));

    let average = zero.average as usize;
    let [rest_stay, rest_go] =
        [("rest_stay", stay), ("rest_go", go)].map(|(name, moved)| held(name, off - moved.round_shift(average)));
    let (off, stay, go) = (held("off_3", off), held("stay_3", stay), held("go_3", go));
    let dead = dead.map(|dead| held("dead_3", dead));
    let gain = gain.map(|gain| held("gain_3", gain));
    let [place, end, early] =
        [("taxel_3", taxels_held), ("end_3", ends), ("early_3", early_held)].map(|(name, value)| held(name, value));

    let [pressed, limiting] = ["pressed", "limiting"].map(|name| k.state(name, bit, rst, 0));
    k.comment("Nothing pressed in the frame before; a zero was at its limit in it.");
    let [all_rest, all_limited] = ["rests", "limited"].map(|name| arrays.state(k, name, bit, resets, 0));
    let array = arrays.array_of(place);
    let [rests, limited] = [&all_rest, &all_limited].map(|state| state.of(array));
    let either = |go: Expr<'k>, stay: Expr<'k>| rests.mux(go, stay);
    let difference = k.wire("rest", either(rest_go, rest_stay));
    let moved = k.wire("moved", either(go, stay));
    let (high, low) = (bound(limit, difference.bits()), bound(-limit, difference.bits()));
    let above = k.wire("above", either(high.less(rest_go), high.less(rest_stay)));
    let below = k.wire("below", either(rest_go.less(low), rest_stay.less(low)));
    let [above_zero, below_zero] = [high.less(off), off.less(low)];
    let touch = match gain {
        None => above & above_zero,
        Some(gain) => gain.unsigned().top().mux(below & below_zero, above & above_zero),
    };
    let live = dead.map_or(k.constant(1, 1), |dead| !dead);
    let touched = k.wire("touched", *pressed | (touch & live));
    let at_limit = moved.equals(bound(most, moved_bits)) | moved.equals(bound(-most, moved_bits));
    let reached = k.wire("reached", *limiting | at_limit);
    let step =
        above.mux(bound(limit, step_bits), below.mux(bound(-limit, step_bits), difference.low(step_bits).signed()));
    let step = dead.map_or(step, |dead| dead.mux(k.signed_constant(step_bits, 0), step));
    let steps = k.wire("steps", moves & valid);
    k.when(steps, || {
        let over = end | early;
        pressed.set(touched & !over);
        limiting.set(reached & !over);
        k.when(over, || all_rest.set(k, array, end & !touched));
        k.when(end, || all_limited.set(k, array, reached));
    });
    drifts.write(steps, place, step.unsigned().concat(moved.unsigned()));
    Followed { difference, gain, limited }
}
