//! The kernel of [`Average`](super::average::Average) with a sliding mean: every frame gives 2^k times the mean of the
//! frames so far, in which older ones fade.
//!
//! ```text
//! s_axis --> read mean, hold word --> (2^k word − mean − c) >> g --> add, round --> memory and m_axis
//! ```
//! g grows with the number of frames ([`gain_shift`]), so that the first frame after a reset is its own mean. c is 1 in
//! every second frame: halves are rounded up and down in turn. An early
//! `tlast` leaves with its beat, at which `receive` drops the frame; some taxels hold its words by then, so the mean
//! starts again with the next frame of its array. A missing `tlast` is missing behind the mean too, and changes nothing else.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::spec::sliding::gain_shift;

use super::arrays::{Arrays, Resets};
use crate::language::{Builder, Contents, Expr, Output, Type};
use crate::primitives::address::counter::count_bits;

/// Width of the number of frames in the mean, which stops where all its bits are set.
pub fn frames_bits(power: u32) -> usize {
    power as usize + 1
}

/// The ports of [`Average`](super::average::Average), for the kernels of means.
#[derive(Clone, Copy)]
pub(super) struct MeanPorts<'k> {
    pub rst: Expr<'k>,
    /// What resets the mean of each array.
    pub resets: Resets<'k>,
    pub data: Expr<'k>,
    pub array: Expr<'k>,
    pub offered: Expr<'k>,
    pub tlast: Expr<'k>,
    pub ready_out: Output<'k>,
    pub data_out: Output<'k>,
    pub array_out: Output<'k>,
    pub valid_out: Output<'k>,
    pub last_out: Output<'k>,
    pub ready: Expr<'k>,
    pub frames: Output<'k>,
}

/// The sizes of a sliding mean.
pub(super) struct SlidingMean {
    /// Taxels of a frame, at least three.
    pub taxels: usize,
    /// Width of a word in bits.
    pub bits: usize,
    /// k: the last gain is 2^−k.
    pub power: usize,
    /// There is a bit above a word, which leaves above the number of frames.
    pub limited: bool,
    /// Each has a mean of its own.
    pub arrays: Arrays,
}

impl SlidingMean {
    /// The kernel.
    pub fn build<'k>(&self, k: &'k Builder, io: MeanPorts<'k>) {
        let MeanPorts { rst, resets, data, array, offered, tlast, ready_out, .. } = io;
        let MeanPorts { data_out, array_out, valid_out, last_out, ready, frames, .. } = io;
        let (power, wide) = (self.power, self.bits + self.power);
        let (bit, index) = (Type::unsigned(1), Type::unsigned(count_bits(self.taxels)));
        let place_type = Type::unsigned(index.bits + self.arrays.bits);
        let (shift, count) = (Type::unsigned(count_bits(power + 1)), Type::unsigned(power + 1));
        let means = k.memory("means", self.arrays.words(self.taxels), wide, Contents::Undefined).holds(Holds::Average);
        k.comment("Place of the next word, g and c of its frame, whole frames in the mean.");
        let taxel = k.state("taxel", index, rst, 0);
        let gains = self.arrays.state(k, "gain", shift, resets, 0);
        let odds = self.arrays.state(k, "odd", bit, resets, 0);
        let wholes = self.arrays.state(k, "whole", count, resets, 0);
        let [gain, odd, whole] = [&gains, &odds, &wholes].map(|state| state.of(array));
        let [held, added] = ["held", "added"].map(|name| k.state(name, bit, rst, 0));
        let valid = valid_out.state(rst, 0);
        let (word, sofar) = (k.register("word", Type::signed(self.bits)), k.register("sofar", Type::signed(wide)));
        let place = self.arrays.address(k, array, *taxel);
        let [held_taxel, added_taxel] = ["held_taxel", "added_taxel"].map(|name| k.register(name, place_type));
        let held_gain = k.register("held_gain", shift);
        let held_odd = k.register("held_odd", bit);
        let [held_last, added_last] = ["held_last", "added_last"].map(|name| k.register(name, bit));
        let last_out = last_out.register();
        let marks = Type::unsigned(frames.bits());
        let [held_frames, added_frames] = ["held_frames", "added_frames"].map(|name| k.register(name, marks));
        let frames = frames.register();
        let (mean, mean_out) = (k.register("mean", Type::signed(wide)), data_out.register());
        let moved = k.register("moved", Type::signed(wide + 2));

        let at_end = k.wire("at_end", taxel.is(self.taxels as u64 - 1));
        let early = k.wire("early", tlast & !at_end);
        let next = k.wire("next", whole.all().mux(whole, whole.plus(1)));
        let rises = k.wire("rises", rises(k, whole, power));
        k.comment("Of the first frame nothing has been stored.");
        let stored = k.wire("stored", held_gain.is(0).mux(k.signed_constant(wide, 0), *sofar));
        // 2 (2^k word − mean) − c, which the shift rounds down to the same as 2 (2^k word − mean − c): g is 0 only with c = 0.
        let difference = word.shift_left(power + 1) - stored.unsigned().concat(*held_odd).signed();
        let half = (mean.unsigned().concat(k.constant(1, 1)).signed() + *moved).slice(1, wide);
        let result = k.wire("result", half);
        let moves = k.wire("moves", !*valid | ready);
        ready_out.set(moves & !rst);
        k.when(moves, || {
            k.when(offered, || {
                taxel.set((early | at_end).mux(k.constant(taxel.bits(), 0), taxel.plus(1)));
                k.when(at_end, || {
                    wholes.set(k, array, next);
                    odds.set(k, array, !odd);
                    gains.set(k, array, (gain + rises).low(gain.bits()));
                });
                k.when(early, || {
                    for (states, state) in [(&wholes, whole), (&odds, odd), (&gains, gain)] {
                        states.set(k, array, k.constant(state.bits(), 0));
                    }
                });
            });
            held.set(offered);
            word.set(data.low(self.bits).signed());
            sofar.set(means.read(place).signed());
            held_taxel.set(place);
            held_gain.set(gain);
            held_odd.set(odd);
            held_last.set(tlast);
            held_frames.set(if self.limited { data.top().concat(next) } else { next });
            added.set(*held);
            mean.set(stored);
            moved.set(difference.shift_right_by(*held_gain));
            added_taxel.set(*held_taxel);
            added_last.set(*held_last);
            added_frames.set(*held_frames);
            valid.set(*added);
            mean_out.set(result);
            last_out.set(*added_last);
            frames.set(*added_frames);
        });
        means.write(moves & *added, *added_taxel, result);
        if self.arrays.bits > 0 {
            let array_out = array_out.register();
            k.when(moves, || array_out.set(self.arrays.array_of(*added_taxel)));
        }
    }
}

/// Whether g grows by one from the frame after `whole` frames to the frame after that.
pub(super) fn rises<'k>(k: &'k Builder, whole: Expr<'k>, power: usize) -> Expr<'k> {
    let grows = |whole: &usize| gain_shift(whole + 2, power as u32) > gain_shift(whole + 1, power as u32);
    let numbers = (0..1 << power).filter(grows).map(|number| whole.is(number as u64));
    numbers.reduce(|any, one| any | one).unwrap_or(k.constant(1, 0))
}
