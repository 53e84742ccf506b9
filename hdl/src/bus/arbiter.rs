//! Frames of several senders, whole and in turn to the core that serves their arrays.

use dermis_golden::fixed::plan::resources::count_bits;

use super::bundles::{CoreStream, WORD_BYTES};
use crate::block;
use crate::language::{concat, Block, Builder, Contents, Expr, Inside, Type};
use crate::primitives::{Arrays, Resets};

/// Width of a sender's beat.
const BITS: usize = 8 * WORD_BYTES;

block! {
    /// Each array has a sender of its own. A frame waits in memory until all of it is there, so that a sender that stalls within a frame
    /// keeps the others waiting for nothing; then it goes to the core at a beat in a cycle, and the sender's next frame can come.
    /// ```text
    /// s_axis of sender 0 ──┐             ┌───────────┐
    /// s_axis of sender 1 ──┼── a beat ── │ a frame   │ ── a frame ── m_axis, tid: the sender
    /// s_axis of sender 2 ──┘   in turn   │ of each   │    in turn
    ///                                    └───────────┘
    /// ```
    /// A frame that is too short or too long is passed on as one: the core says so. Of one that is too long all beats behind the first
    /// one too many are left out.
    pub struct FrameArbiter {
        arrays: Arrays,
        /// Beats of a frame.
        taxels: usize,
    }
    ports FrameArbiterPorts {
        clock aclk;
        /// Synchronous reset, active low.
        in aresetn;
        /// A code of each sender, 32 bits signed, that of sender 0 in the low bits; valid with its bit of `s_axis_tvalid`.
        in s_axis_tdata: BITS * arrays.count();
        /// A sender offers a beat; a bit for each, held until that of `s_axis_tready`.
        in s_axis_tvalid: arrays.count();
        /// The beat of a sender is accepted in this cycle; a bit for each.
        out s_axis_tready: arrays.count();
        /// The beat is the last of its frame; a bit for each sender, valid with that of `s_axis_tvalid`.
        in s_axis_tlast: arrays.count();
        /// A code of the frame that goes to the core; valid with `m_axis_tvalid`.
        source<CoreStream> m_axis: CoreStream::of_codes(*arrays);
    }
}

impl FrameArbiter {
    /// For as many senders as there are arrays, each with frames of `taxels` codes.
    pub fn new(arrays: Arrays, taxels: usize) -> Self {
        FrameArbiter { arrays, taxels }
    }
}

/// Of the senders that ask the next one behind `last`, in turn.
fn next_in_turn<'k>(k: &'k Builder, name: &str, asks: Expr<'k>, last: Expr<'k>) -> Expr<'k> {
    let number = |at: usize| k.constant(last.bits(), at as u64);
    let lowest = (0..asks.bits()).rev().fold(number(0), |rest, at| asks.at(at).mux(number(at), rest));
    let behind = |at: usize| asks.at(at) & last.less(number(at));
    let next = (1..asks.bits()).rev().fold(lowest, |rest, at| behind(at).mux(number(at), rest));
    k.wire(name, next)
}

impl Block for FrameArbiter {
    fn build<'k>(&self, k: &'k Builder, io: FrameArbiterPorts<Inside<'k>>) {
        let (arrays, senders) = (self.arrays, self.arrays.count());
        // One beat more says that a frame is too long.
        let index_bits = count_bits(self.taxels + 1);
        let rst = k.wire("rst", !io.aresetn);
        let resets = Resets { rst, anew: None };
        let index = arrays.state(k, "index", Type::unsigned(index_bits), resets, 0);
        let whole = arrays.state(k, "whole", Type::unsigned(1), resets, 0);
        let frames = k.memory("frames", arrays.words(self.taxels + 1), BITS, Contents::Undefined);

        k.comment("A beat of the senders in turn, of those whose frame is not whole.");
        let heard = k.state("heard", Type::unsigned(arrays.bits), rst, 0);
        let waits = k.wire("waits", concat(&(0..senders).rev().map(|at| whole.number(at)).collect::<Vec<_>>()));
        let asks = k.wire("asks", io.s_axis_tvalid & !waits & (!rst).repeat(senders));
        let sender = next_in_turn(k, "sender", asks, *heard);
        let takes = k.wire("takes", asks.any());
        let accepts: Vec<Expr> = (0..senders).rev().map(|at| takes & sender.is(at as u64)).collect();
        io.s_axis_tready.set(concat(&accepts));
        let of_sender = |port: Expr<'k>, bits: usize| {
            let arms: Vec<(u64, Expr<'k>)> = (0..senders).map(|at| (at as u64, port.slice(bits * at, bits))).collect();
            sender.case(&arms, k.constant(bits, 0))
        };
        let place = k.wire("place", index.of(sender));
        let ends = k.wire("ends", of_sender(io.s_axis_tlast, 1));
        frames.write(takes, sender.concat(place), of_sender(io.s_axis_tdata, BITS));
        k.when(takes, || {
            heard.set(sender);
            k.when(ends, || whole.set(k, sender, k.constant(1, 1)));
            k.when(!ends & !place.is(self.taxels as u64), || index.set(k, sender, place.plus(1)));
        });

        k.comment("A frame that is whole, in turn, to the core.");
        let sends = k.state("sends", Type::unsigned(1), rst, 0);
        let sent = k.state("sent", Type::unsigned(arrays.bits), rst, 0);
        let at = k.register("at", Type::unsigned(index_bits));
        let next = next_in_turn(k, "next", waits, *sent);
        let valid = io.m_axis.valid.state(rst, 0);
        let [data, last, id] = [io.m_axis.data, io.m_axis.last, io.m_axis.id].map(|output| output.register());
        let moves = k.wire("moves", !*valid | io.m_axis.ready);
        let at_end = k.wire("at_end", at.equals(index.of(*sent)));
        k.when(!*sends, || {
            sends.set(waits.any());
            at.set(k.constant(index_bits, 0));
            k.when(waits.any(), || sent.set(next));
        });
        k.when(moves, || {
            valid.set(*sends);
            data.set(frames.read(sent.concat(*at)));
            last.set(at_end);
            id.set(*sent);
        });
        k.when(*sends & moves, || {
            at.set(at.plus(1));
            k.when(at_end, || {
                sends.set(k.constant(1, 0));
                whole.set(k, *sent, k.constant(1, 0));
                index.set(k, *sent, k.constant(index_bits, 0));
            });
        });
        io.m_axis.keep.set(k.constant(1, 1).repeat(WORD_BYTES));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check_with_defects, subject_of, Reference};
    use crate::language::Change;
    use crate::wire::Word;
    use std::collections::VecDeque;

    const ARRAYS: Arrays = Arrays { bits: 2 };
    const SENDERS: usize = 4;
    const TAXELS: usize = 5;

    /// The block in plain integers.
    #[derive(Clone, Default)]
    struct Senders {
        /// Beats so far of the frame of each, and whether all of it is there; of one that is too long the last beat takes the place of
        /// those before it.
        frames: [Vec<u32>; SENDERS],
        whole: [bool; SENDERS],
        heard: usize,
        sends: bool,
        sent: usize,
        at: usize,
        /// Data, sender and whether it is the last, on offer.
        beat: Option<(u32, usize, bool)>,
        reset: bool,
    }

    /// What the senders offer, and whether the core takes a beat.
    struct Cycle {
        rst: bool,
        data: [u32; SENDERS],
        valid: [bool; SENDERS],
        last: [bool; SENDERS],
        ready: bool,
    }

    impl Cycle {
        fn of(inputs: &[Word]) -> Cycle {
            let bits = |word: &Word| std::array::from_fn(|at| word.field(at, 1) == 1);
            Cycle {
                rst: inputs[0].number() == 0,
                data: std::array::from_fn(|at| inputs[1].field(32 * at, 32) as u32),
                valid: bits(&inputs[2]),
                last: bits(&inputs[3]),
                ready: inputs[4].number() == 1,
            }
        }

        fn words(&self) -> Vec<Word> {
            let bits = |bits: [bool; SENDERS]| {
                Word::from(bits.iter().enumerate().map(|(at, bit)| u64::from(*bit) << at).sum::<u64>())
            };
            let mut data = Word::default();
            self.data.iter().enumerate().for_each(|(at, own)| data.set(32 * at, 32, u64::from(*own)));
            vec![Word::from(!self.rst), data, bits(self.valid), bits(self.last), Word::from(self.ready)]
        }
    }

    /// The next one behind `last` that asks.
    fn turn(asks: [bool; SENDERS], last: usize) -> Option<usize> {
        (1..=SENDERS).map(|step| (last + step) % SENDERS).find(|at| asks[*at])
    }

    impl Senders {
        /// The sender whose beat is accepted.
        fn accepts(&self, cycle: &Cycle) -> Option<usize> {
            let asks = std::array::from_fn(|at| cycle.valid[at] && !self.whole[at] && !cycle.rst);
            turn(asks, self.heard)
        }
    }

    impl Reference for Senders {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            if !self.reset {
                return vec![None; 6];
            }
            let ready = self.accepts(&Cycle::of(inputs)).map_or(0, |at| 1 << at);
            let offered = |of: &dyn Fn((u32, usize, bool)) -> u64| self.beat.map(|beat| Word::from(of(beat)));
            vec![
                Some(Word::from(ready)),
                offered(&|(data, _, _)| u64::from(data)),
                Some(Word::from(15)),
                offered(&|(_, sender, _)| sender as u64),
                Some(Word::from(self.beat.is_some())),
                offered(&|(_, _, last)| u64::from(last)),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let cycle = Cycle::of(inputs);
            if cycle.rst {
                *self = Senders { reset: true, ..Senders::default() };
                return;
            }
            let (accepted, waits) = (self.accepts(&cycle), self.whole);
            let moves = self.beat.is_none() || cycle.ready;
            if moves {
                self.beat = self.sends.then(|| {
                    let frame = &self.frames[self.sent];
                    (frame[self.at], self.sent, self.at + 1 == frame.len())
                });
            }
            if !self.sends {
                self.sends = waits.contains(&true);
                self.sent = turn(waits, self.sent).unwrap_or(self.sent);
                self.at = 0;
            } else if moves {
                self.at += 1;
                if self.at == self.frames[self.sent].len() {
                    self.sends = false;
                    self.whole[self.sent] = false;
                    self.frames[self.sent].clear();
                }
            }
            if let Some(sender) = accepted {
                let frame = &mut self.frames[sender];
                frame.truncate(TAXELS);
                frame.push(cycle.data[sender]);
                self.whole[sender] = cycle.last[sender];
                self.heard = sender;
            }
        }
    }

    /// Frames of the senders, of which some are too short or too long and the last sender stops within its third; pauses on all sides.
    fn stimulus(cycles: usize) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(7);
        let (mut model, mut frames) = (Senders::default(), [0; SENDERS]);
        let mut left: [usize; SENDERS] = [0; SENDERS];
        let mut offered: [Option<(u32, bool)>; SENDERS] = [None; SENDERS];
        let mut of = |number: usize| {
            let pace = [1, 4][number / 500 % 2];
            for sender in 0..SENDERS {
                let stalls = sender == SENDERS - 1 && frames[sender] == 3 && left[sender] == 2;
                if offered[sender].is_some() || stalls || random.u8(..pace) > 0 {
                    continue;
                }
                if left[sender] == 0 {
                    left[sender] = if random.u8(..4) == 0 { random.usize(1..2 * TAXELS) } else { TAXELS };
                    frames[sender] += 1;
                }
                left[sender] -= 1;
                offered[sender] = Some((random.u32(..), left[sender] == 0));
            }
            let cycle = Cycle {
                rst: number < 2,
                data: offered.map(|beat| beat.map_or(0, |beat| beat.0)),
                valid: offered.map(|beat| beat.is_some()),
                last: offered.map(|beat| beat.is_some_and(|beat| beat.1)),
                ready: random.u8(..4) > 0,
            };
            if let Some(sender) = model.accepts(&cycle) {
                offered[sender] = None;
            }
            let inputs = cycle.words();
            model.clock(&inputs);
            inputs
        };
        (0..cycles).map(&mut of).collect()
    }

    #[test]
    fn it_is_its_reference() {
        let subject = |changes: &[Change]| {
            subject_of!(
                FrameArbiter::new(ARRAYS, TAXELS),
                changes,
                inputs [aresetn, s_axis_tdata, s_axis_tvalid, s_axis_tlast, m_axis_tready],
                outputs [s_axis_tready, m_axis_tdata, m_axis_tkeep, m_axis_tid, m_axis_tvalid, m_axis_tlast],
            )
        };
        let defects = [
            // A frame is sent before it is there; always that of the first sender first; one that is too long begins again.
            Change::value("", "waits", |k| !k.constant(4, 0)),
            Change::value("", "next", |k| k.constant(2, 0)),
            Change::within("", "index_of_0", |k| [k.named("place").is(TAXELS as u64), k.constant(1, 0)]),
        ];
        check_with_defects(subject, &stimulus(6000), Senders::default, &defects);
    }

    /// What comes out, whatever the cycles: the frames of each sender in their order, each as a whole; while one waits, no more than two
    /// of each other, one of them under way already. A sender that stalls within a frame keeps no other one waiting.
    #[test]
    fn frames_are_whole_in_order_and_in_turn() {
        let (mut model, stimulus) = (Senders::default(), stimulus(6000));
        let (mut sent, mut open): ([VecDeque<Vec<u32>>; SENDERS], [Vec<u32>; SENDERS]) = Default::default();
        let (mut received, mut frame): (Vec<usize>, Vec<(usize, u32)>) = Default::default();
        let mut since: [VecDeque<usize>; SENDERS] = Default::default();
        for inputs in &stimulus {
            let cycle = Cycle::of(inputs);
            if let Some(sender) = model.accepts(&cycle) {
                open[sender].push(cycle.data[sender]);
                if cycle.last[sender] {
                    let mut own = std::mem::take(&mut open[sender]);
                    if own.len() > TAXELS {
                        own.drain(TAXELS..own.len() - 1);
                    }
                    sent[sender].push_back(own);
                    since[sender].push_back(received.len());
                }
            }
            if let Some((data, sender, last)) = model.beat.filter(|_| cycle.ready && !cycle.rst) {
                frame.push((sender, data));
                if last {
                    assert!(frame.iter().all(|own| own.0 == sender));
                    let own: Vec<u32> = std::mem::take(&mut frame).into_iter().map(|own| own.1).collect();
                    assert_eq!(sent[sender].pop_front(), Some(own));
                    let waited = &received[since[sender].pop_front().unwrap()..];
                    let of = |other: usize| waited.iter().filter(|own| **own == other).count();
                    assert!((0..SENDERS).all(|other| of(other) <= 2), "{sender} behind {waited:?}");
                    received.push(sender);
                }
            }
            model.clock(inputs);
        }
        let count = |sender: usize| received.iter().filter(|own| **own == sender).count();
        assert!(count(SENDERS - 1) == 2 && (0..SENDERS - 1).all(|sender| count(sender) > 150), "{received:?}");
    }
}
