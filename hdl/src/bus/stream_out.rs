//! Beats of 96 bits as a stream of whole words without gaps.

use dermis_golden::fixed::plan::resources::count_bits;

use super::bundles::{id_bits, CoreStream};
use crate::block;
use crate::language::{concat, Block, Builder, Expr, Inside, Type};
use crate::primitives::{Arrays, Stream};

/// Words of a beat of the engine.
const TRIPLE: usize = 3;
/// Bits of a word.
const WORD: usize = 32;

/// Words of a beat of the output that can be chosen: 32, 64, 128 bits.
pub const WIDTHS: [usize; 3] = [1, 2, 4];

block! {
    /// Each beat of the engine is three words: fx, fy, fz, or those of a status. They follow one another without gaps,
    /// so that a frame is an array of triples in memory, whatever the width; only its last beat can have fewer words,
    /// by `tkeep`.
    ///
    /// `tuser` has a bit for each word, high if it belongs to the beats behind the forces; above them a bit that is
    /// high in every beat of a spoiled frame. `tid` is the frame's identifier. The label of a frame must be there from its first
    /// beat to its last.
    ///
    /// `abandon` ends the frame of which beats have been accepted and not the last: three words of zeros that are no forces
    /// follow, the frame is spoiled from then on, and `tlast` is on the last word. A beat on the output stays as it is until it
    /// is accepted; what the receiver does not accept yet, it accepts later.
    pub struct StreamOut {
        /// Words of a beat of the output.
        width: usize,
        /// Beats of a frame that are forces, its first.
        forces: usize,
        arrays: Arrays,
    }
    ports StreamOutPorts {
        clock;
        reset;
        /// {fz, fy, fx}, 32 bits signed each, or three words of status; valid with `s_axis_tvalid`.
        sink<Stream> s_axis: TRIPLE * WORD;
        /// Identifier of the frame, and above it whether it is spoiled; valid with `s_axis_tvalid`.
        in label: id_bits(*arrays) + 1;
        /// The rest of the frame will not come; no beat is accepted in this cycle.
        in abandon;
        /// Words, the first in the low bits; valid with `m_axis_tvalid`.
        source<CoreStream> m_axis: CoreStream::of_words(*width, *arrays);
        /// The last beat of a frame is taken over in this cycle.
        out whole;
        /// The last beat of a frame that was not abandoned is accepted in this cycle.
        out sent;
    }
}

impl StreamOut {
    /// For beats of `width` words, one of [`WIDTHS`]; the first `forces` beats of a frame, which is of one of the `arrays`, are
    /// forces.
    pub fn new(width: usize, forces: usize, arrays: Arrays) -> Self {
        StreamOut { width, forces, arrays }
    }
}

impl Block for StreamOut {
    fn build<'k>(&self, k: &'k Builder, io: StreamOutPorts<Inside<'k>>) {
        let StreamOut { width, forces, arrays } = *self;
        let id_bits = id_bits(arrays);
        let bit = Type::unsigned(1);
        // At most one word less than a beat is left when three more come.
        let places = width - 1 + TRIPLE;
        let filled_bits = count_bits(places + 1);
        let words = k.state("words", Type::unsigned(places * WORD), io.rst, 0);
        let words = words.comment("Words that wait, the next in the low bits; zero where there is none.");
        let kinds = k.state("kinds", Type::unsigned(places), io.rst, 0).comment("A bit per word that waits: no force.");
        let filled = k.state("filled", Type::unsigned(filled_bits), io.rst, 0).comment("Number of words that wait.");
        let ending = k.state("ending", bit, io.rst, 0).comment("The last words of a frame wait.");
        let beat = k.state("beat", Type::unsigned(count_bits(forces + 1)), io.rst, 0);
        let beat = beat.comment("Beats taken of the frame, up to the number of forces.");
        let label = k.register("own_label", Type::unsigned(id_bits + 1)).comment("Of the frame whose words wait.");
        let closing =
            k.state("closing", bit, io.rst, 0).comment("The frame was abandoned, and its end has no place yet.");
        let abandoned = k.state("abandoned", bit, io.rst, 0).comment("The end of an abandoned frame waits.");

        let number = |value: usize| k.constant(filled_bits, value as u64);
        let full = k.wire("full", !filled.less(number(width)));
        let valid = io.m_axis.valid.set(full | *ending);
        let ends = io.m_axis.last.set(*ending & !number(width).less(*filled));
        let taken = k.wire("taken", valid & io.m_axis.ready);
        let left = k.wire("left", taken.mux(full.mux((*filled - number(width)).low(filled_bits), number(0)), *filled));
        let room = k.wire("room", !*ending & left.less(number(width)));
        let is_open = k.wire("is_open", beat.any());
        let closes = k.wire("closes", is_open & (io.abandon | *closing));
        let takes = io.s_axis.ready.set(room & !closes & !io.abandon);
        let given = k.wire("given", io.s_axis.valid & takes);
        let closed = k.wire("closed", room & closes);
        let accepted = k.wire("accepted", given | closed);
        let is_other = k.wire("is_other", beat.is(forces as u64) | closes);
        let last = k.wire("last", io.s_axis.last | closes);
        closing.set(closes & !room);
        abandoned.set(closed | (*abandoned & !(taken & ends)));

        // The words left move down, the three new ones come behind them; what is empty is zero.
        let moved = |kept: Expr<'k>, new: Expr<'k>, comes: Expr<'k>| {
            let bits = kept.bits() / places;
            let down = taken.mux(kept.shift_right(width * bits).extend(kept.bits()), kept);
            let behind: Vec<(u64, Expr<'k>)> =
                (0..width).map(|place| (place as u64, new.shift_left(place * bits).extend(kept.bits()))).collect();
            down | comes.mux(left.case(&behind[1..], behind[0].1), k.constant(1, 0).repeat(kept.bits()))
        };
        words.set(moved(*words, io.s_axis.data, given));
        kinds.set(moved(*kinds, is_other.repeat(TRIPLE), accepted));
        filled.set((left + accepted.mux(number(TRIPLE), number(0))).low(filled_bits));
        ending.set((accepted & last) | (*ending & !(taken & ends)));
        k.when(accepted, || {
            let next = is_other.mux(*beat, beat.plus(1));
            beat.set(last.mux(k.constant(count_bits(forces + 1), 0), next));
        });
        k.when(given & !is_open, || label.set(io.label));

        io.m_axis.data.set(words.low(width * WORD));
        let there: Vec<_> = (0..width).rev().map(|word| number(word).less(*filled).repeat(WORD / 8)).collect();
        io.m_axis.keep.set(concat(&there));
        io.m_axis.user.set((label.top() | *abandoned).concat(kinds.low(width)));
        io.m_axis.id.set(label.low(id_bits));
        io.whole.set(given & io.s_axis.last);
        io.sent.set(taken & ends & !*abandoned);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const ARRAYS: Arrays = Arrays { bits: 2 };
    /// Bits of an identifier.
    const ID: usize = 6;
    const FORCES: usize = 4;

    /// The words that wait, whether each is no force, whether it is its frame's last.
    struct Words {
        width: usize,
        waiting: VecDeque<(u64, bool, bool)>,
        beat: usize,
        /// Of the frame whose words wait, or the one before; none before the first.
        label: Option<u64>,
        /// The frame was abandoned, and its end does not wait yet; it waits.
        closing: bool,
        abandoned: bool,
        reset: bool,
    }

    impl Words {
        fn new(width: usize) -> Self {
            let waiting = VecDeque::new();
            Words { width, waiting, beat: 0, label: None, closing: false, abandoned: false, reset: false }
        }

        fn is_ending(&self) -> bool {
            self.waiting.back().is_some_and(|(_, _, last)| *last)
        }

        fn is_valid(&self) -> bool {
            self.waiting.len() >= self.width || self.is_ending()
        }

        fn left(&self, ready: bool) -> usize {
            self.waiting.len().saturating_sub(if ready && self.is_valid() { self.width } else { 0 })
        }

        fn has_room(&self, ready: bool) -> bool {
            !self.is_ending() && self.left(ready) < self.width
        }

        /// Whether the open frame is to be ended.
        fn closes(&self, abandon: bool) -> bool {
            self.beat > 0 && (abandon || self.closing)
        }

        fn takes(&self, ready: bool, abandon: bool) -> bool {
            self.has_room(ready) && !self.closes(abandon) && !abandon
        }

        /// Puts a beat behind the words that wait.
        fn push(&mut self, words: [u64; TRIPLE], is_other: bool, last: bool) {
            let word = |(place, word): (usize, u64)| (word, is_other, last && place == TRIPLE - 1);
            self.waiting.extend(words.into_iter().enumerate().map(word));
            self.beat = if last { 0 } else { self.beat + 1 };
        }
    }

    impl Reference for Words {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let [valid, ends, abandon, ready] = [2, 3, 5, 6].map(|k| inputs[k].number() == 1);
            let takes = self.takes(ready, abandon);
            let label = self.label.map(|label| label | u64::from(self.abandoned) << ID);
            let now: Vec<_> = self.waiting.iter().take(self.width).copied().collect();
            let last = self.is_ending() && self.waiting.len() <= self.width;
            let (mut data, mut keep, mut user) = (Word::default(), 0, 0);
            for (place, (word, other, _)) in now.iter().enumerate() {
                data.set(WORD * place, WORD, *word);
                keep |= 15 << (4 * place);
                user |= u64::from(*other) << place;
            }
            let shown = |word: Word| (self.reset && self.is_valid()).then_some(word);
            let bit = |bit: bool| self.reset.then(|| Word::from(bit));
            vec![
                bit(self.is_valid()),
                shown(Word::from(last)),
                bit(takes),
                shown(data),
                shown(Word::from(keep)),
                label.and_then(|label| shown(Word::from(user | (label >> ID) << self.width))),
                label.and_then(|label| shown(Word::from(label & ((1 << ID) - 1)))),
                bit(takes && valid && ends),
                bit(last && ready && !self.abandoned),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            if inputs[0].number() == 1 {
                *self = Words { label: self.label, reset: true, ..Words::new(self.width) };
                return;
            }
            let [valid, last, abandon, ready] = [2, 3, 5, 6].map(|k| inputs[k].number() == 1);
            let (takes, closes, has_room) = (self.takes(ready, abandon), self.closes(abandon), self.has_room(ready));
            if ready && self.is_valid() {
                self.waiting.drain(..self.width.min(self.waiting.len()));
            }
            self.abandoned &= !self.waiting.is_empty();
            self.closing = closes && !has_room;
            if closes && has_room {
                self.push([0; TRIPLE], true, true);
                self.abandoned = true;
            } else if valid && takes {
                if self.beat == 0 {
                    self.label = Some(inputs[4].number());
                }
                let words = [0, 1, 2].map(|word| inputs[1].field(WORD * word, WORD));
                self.push(words, self.beat >= FORCES, last);
            }
        }
    }

    /// Beats of which some are of a frame that is abandoned.
    #[test]
    fn words_leave_without_gaps_in_every_width() {
        for width in WIDTHS {
            let mut random = fastrand::Rng::with_seed(5);
            let stimulus = (0..20_000).map(|cycle| {
                let mut data = Word::default();
                data.set_limbs(&[random.u64(..), random.u64(..1 << 32)]);
                vec![
                    Word::from(cycle < 2 || random.u16(..700) == 0),
                    data,
                    Word::from(random.u8(..8) > 1),
                    Word::from(random.u8(..7) == 0),
                    Word::from(random.u64(..1 << (ID + 1))),
                    Word::from(random.u8(..20) == 0),
                    Word::from(random.u8(..8) > 1),
                ]
            });
            let stimulus: Vec<_> = stimulus.collect();
            check(&kernel_of(&StreamOut::new(width, FORCES, ARRAYS)), &stimulus, &mut Words::new(width));
        }
    }
}
