//! Beats of 96 bits as a stream of whole words without gaps.

use dermis_golden::fixed::plan::resources::count_bits;
use rust_hdl::prelude::*;

use super::ID_BITS;
use crate::kernel_block;
use crate::language::{concat, Body, Builder, Expr, Kernel, Type};
use crate::wire::Wire;

/// Words of a beat of the engine.
const TRIPLE: usize = 3;
/// Bits of a word.
const WORD: usize = 32;

/// Words of a beat of the output that can be chosen: 32, 64, 128 bits.
pub const WIDTHS: [usize; 3] = [1, 2, 4];

/// Each beat of the engine is three words: fx, fy, fz, or those of a status. They follow one another without gaps, so that a
/// frame is an array of triples in memory, whatever the width; only its last beat can have fewer words, by `tkeep`.
///
/// `tuser` has a bit for each word, high if it belongs to the beats behind the forces; above them a bit that is high in every
/// beat of a spoiled frame. `tid` is the frame's identifier. The label of the frame must be there before its first beat.
#[derive(dermis_hdl_derive::Block)]
pub struct StreamOut {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// {fz, fy, fx}, 32 bits signed each, or three words of status; valid with `s_axis_tvalid`.
    pub s_axis_tdata: Wire<In>,
    /// A beat is offered on `s_axis_tdata`; the sender holds it until `s_axis_tready`.
    pub s_axis_tvalid: Signal<In, Bit>,
    /// The block accepts a beat in this cycle.
    pub s_axis_tready: Signal<Out, Bit>,
    /// The beat is the last of its frame; valid with `s_axis_tvalid`.
    pub s_axis_tlast: Signal<In, Bit>,
    /// Identifier of the frame, and above it whether it is spoiled; valid while a frame is sent.
    pub label: Wire<In>,
    /// Words, the first in the low bits; valid with `m_axis_tvalid`.
    pub m_axis_tdata: Wire<Out>,
    /// Bytes of the beat that are there; valid with `m_axis_tvalid`.
    pub m_axis_tkeep: Wire<Out>,
    /// A bit per word that is no force, and whether the frame is spoiled; valid with `m_axis_tvalid`.
    pub m_axis_tuser: Wire<Out>,
    /// Identifier of the frame; valid with `m_axis_tvalid`.
    pub m_axis_tid: Wire<Out>,
    /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
    pub m_axis_tvalid: Signal<Out, Bit>,
    /// The receiver accepts a beat in this cycle.
    pub m_axis_tready: Signal<In, Bit>,
    /// The beat is the last of its frame; valid with `m_axis_tvalid`.
    pub m_axis_tlast: Signal<Out, Bit>,
    /// The last beat of a frame is accepted in this cycle.
    pub sent: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(
    StreamOut,
    clock clk,
    inputs [rst, s_axis_tdata, s_axis_tvalid, s_axis_tlast, label, m_axis_tready],
    outputs [
        s_axis_tready, m_axis_tdata, m_axis_tkeep, m_axis_tuser, m_axis_tid, m_axis_tvalid, m_axis_tlast, sent
    ]
);

impl StreamOut {
    /// For beats of `width` words, one of [`WIDTHS`]; the first `forces` beats of a frame are forces.
    pub fn new(width: usize, forces: usize) -> Self {
        let block = StreamOut {
            clk: Default::default(),
            rst: Default::default(),
            s_axis_tdata: Wire::new(TRIPLE * WORD),
            s_axis_tvalid: Default::default(),
            s_axis_tready: Default::default(),
            s_axis_tlast: Default::default(),
            label: Wire::new(ID_BITS + 1),
            m_axis_tdata: Wire::new(width * WORD),
            m_axis_tkeep: Wire::new(width * WORD / 8),
            m_axis_tuser: Wire::new(width + 1),
            m_axis_tid: Wire::new(ID_BITS),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            sent: Default::default(),
            kernel: Body::default(),
        };
        block.bind(kernel(width, forces))
    }
}

fn kernel(width: usize, forces: usize) -> Kernel {
    let k = Builder::new("stream_out");
    describe(&k, width, forces);
    k.finish()
}

fn describe<'k>(k: &'k Builder, width: usize, forces: usize) {
    let (rst, data) = (k.input("rst", 1), k.input("s_axis_tdata", TRIPLE * WORD));
    let (given, last) = (k.input("s_axis_tvalid", 1), k.input("s_axis_tlast", 1));
    let (label, ready) = (k.input("label", ID_BITS + 1), k.input("m_axis_tready", 1));
    let bit = Type::unsigned(1);
    // At most one word less than a beat is left when three more come.
    let places = width - 1 + TRIPLE;
    let filled_bits = count_bits(places + 1);
    let words = k.state("words", Type::unsigned(places * WORD), rst, 0);
    let words = words.comment("Words that wait, the next in the low bits; zero where there is none.");
    let kinds = k.state("kinds", Type::unsigned(places), rst, 0).comment("A bit per word that waits: no force.");
    let filled = k.state("filled", Type::unsigned(filled_bits), rst, 0).comment("Number of words that wait.");
    let ending = k.state("ending", bit, rst, 0).comment("The last words of a frame wait.");
    let beat = k.state("beat", Type::unsigned(count_bits(forces + 1)), rst, 0);
    let beat = beat.comment("Beats taken of the frame, up to the number of forces.");

    let number = |value: usize| k.constant(filled_bits, value as u64);
    let whole = k.wire("whole", !filled.less(number(width)));
    let valid = k.wire("m_axis_tvalid", whole | *ending);
    let ends = k.wire("m_axis_tlast", *ending & !number(width).less(*filled));
    let taken = k.wire("taken", valid & ready);
    let left = k.wire("left", taken.mux(whole.mux((*filled - number(width)).low(filled_bits), number(0)), *filled));
    let takes = k.wire("s_axis_tready", !*ending & left.less(number(width)));
    let accepted = k.wire("accepted", given & takes);
    let is_other = k.wire("is_other", beat.is(forces as u64));

    // The words left move down, the three new ones come behind them; what is empty is zero.
    let moved = |kept: Expr<'k>, new: Expr<'k>| {
        let bits = kept.bits() / places;
        let down = taken.mux(kept.shift_right(width * bits).extend(kept.bits()), kept);
        let behind: Vec<(u64, Expr<'k>)> =
            (0..width).map(|place| (place as u64, new.shift_left(place * bits).extend(kept.bits()))).collect();
        down | accepted.mux(left.case(&behind[1..], behind[0].1), k.constant(1, 0).repeat(kept.bits()))
    };
    words.set(moved(*words, data));
    kinds.set(moved(*kinds, is_other.repeat(TRIPLE)));
    filled.set((left + accepted.mux(number(TRIPLE), number(0))).low(filled_bits));
    ending.set((accepted & last) | (*ending & !(taken & ends)));
    k.when(accepted, || {
        let next = is_other.mux(*beat, beat.plus(1));
        beat.set(last.mux(k.constant(count_bits(forces + 1), 0), next));
    });

    k.wire("m_axis_tdata", words.low(width * WORD));
    let there: Vec<_> = (0..width).rev().map(|word| number(word).less(*filled).repeat(WORD / 8)).collect();
    k.wire("m_axis_tkeep", concat(&there));
    k.wire("m_axis_tuser", label.top().concat(kinds.low(width)));
    k.wire("m_axis_tid", label.low(ID_BITS));
    k.wire("sent", taken & ends);
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use super::*;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const FORCES: usize = 4;

    /// The words that wait, whether each is no force, whether it is its frame's last.
    struct Words {
        width: usize,
        waiting: VecDeque<(u64, bool, bool)>,
        beat: usize,
        reset: bool,
    }

    impl Words {
        fn is_ending(&self) -> bool {
            self.waiting.back().is_some_and(|(_, _, last)| *last)
        }

        fn is_valid(&self) -> bool {
            self.waiting.len() >= self.width || self.is_ending()
        }

        fn left(&self, ready: bool) -> usize {
            self.waiting.len().saturating_sub(if ready && self.is_valid() { self.width } else { 0 })
        }

        fn takes(&self, ready: bool) -> bool {
            !self.is_ending() && self.left(ready) < self.width
        }
    }

    impl Reference for Words {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let (label, ready) = (inputs[4].number(), inputs[5].number() == 1);
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
                bit(self.takes(ready)),
                shown(data),
                shown(Word::from(keep)),
                shown(Word::from(user | (label >> ID_BITS) << self.width)),
                Some(Word::from(label & ((1 << ID_BITS) - 1))),
                bit(last && ready),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            if inputs[0].number() == 1 {
                *self = Words { width: self.width, waiting: VecDeque::new(), beat: 0, reset: true };
                return;
            }
            let (valid, last, ready) = (inputs[2].number() == 1, inputs[3].number() == 1, inputs[5].number() == 1);
            let takes = self.takes(ready);
            if ready && self.is_valid() {
                self.waiting.drain(..self.width.min(self.waiting.len()));
            }
            if valid && takes {
                for word in 0..TRIPLE {
                    let ends = last && word == TRIPLE - 1;
                    self.waiting.push_back((inputs[1].field(WORD * word, WORD), self.beat >= FORCES, ends));
                }
                self.beat = if last { 0 } else { self.beat + 1 };
            }
        }
    }

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
                    Word::from(random.u64(..1 << (ID_BITS + 1))),
                    Word::from(random.u8(..8) > 1),
                ]
            });
            let stimulus: Vec<_> = stimulus.collect();
            let mut words = Words { width, waiting: VecDeque::new(), beat: 0, reset: false };
            check(StreamOut::new(width, FORCES).kernel.kernel(), &stimulus, &mut words);
        }
    }
}
