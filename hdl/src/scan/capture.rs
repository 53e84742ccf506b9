//! Capture of a scan: from the converters' outputs to codes.

use dermis_golden::fixed::plan::resources::count_bits;
use dermis_golden::fixed::stages::scan::{alignment, rail};

use super::ScanParams;
use crate::block;
use crate::language::{concat, Block, Builder, Inside, Type};
use crate::primitives::Stream;

block! {
    /// ```text
    /// miso ─> 2 registers ─> shift ─(done)─> sum of a channel's samples ─(closes)─> code of each converter ─> m_axis
    /// ```
    /// Of each converter the end of its frame is tag and result. Codes, marks of samples at an end of the range and of
    /// tags that name another channel are those of [`dermis_golden::fixed::stages::scan`]. The codes of one channel of
    /// all converters leave one after the other, beginning three cycles after `done`; the frames before the next
    /// channel's last must leave them time for it: `clear`.
    pub struct ScanCapture {
        params: ScanParams,
    }
    ports ScanCapturePorts {
        clock;
        reset;
        /// Outputs of the converters, one bit each; pins, asynchronous to the clock.
        in miso: params.scan.converters;
        /// The pins were to be sampled one cycle ago.
        in take;
        /// A frame ended one cycle ago.
        in done;
        /// The frame has a result; valid with `done`, as what follows, and held until the next.
        in result;
        /// It is the first sample of its channel.
        in opens;
        /// It is the last sample of its channel.
        in closes;
        /// It is in the last channel of the last row.
        in ends;
        /// Its channel, unsigned; valid with `done`.
        in channel: count_bits(params.scan.channels);
        /// For each converter whether its taxel is not dead; valid with `done`.
        in alive: params.scan.converters;
        /// A taxel's code, two's complement; valid with `m_axis_tvalid`.
        source<Stream> m_axis: params.code_bits as usize;
        /// The last code of a scan is accepted in this cycle.
        out complete;
        /// A sample of the scan was at an end of the range; valid with `complete`.
        out rail;
        /// A sample of the scan named another channel; valid with `complete`.
        out other;
        /// No code waits.
        out clear;
    }
}

impl ScanCapture {
    /// For the scan of `params`.
    pub fn new(params: &ScanParams) -> Self {
        ScanCapture { params: params.clone() }
    }
}

impl Block for ScanCapture {
    fn build<'k>(&self, k: &'k Builder, io: ScanCapturePorts<Inside<'k>>) {
        let ScanParams { scan, code_bits, .. } = &self.params;
        let (converter, count, power) = (&scan.converter, scan.converters, scan.average as usize);
        let (bits, tag_bits, code) = (converter.bits as usize, converter.tag_bits as usize, *code_bits as usize);
        // One bit more than a result, for the sign of a unipolar one.
        let (value_bits, sum_bits) = (bits + 1, bits + 1 + power);
        let shift = alignment(converter, *code_bits) as usize;
        let bit = Type::unsigned(1);

        let first = k.delay("miso_1", io.miso);
        let pins = k.delay("miso_2", first);
        let [taken, ended, closing] = ["taken", "ended", "closing"].map(|name| k.state(name, bit, io.rst, 0));
        taken.set(io.take);
        ended.set(io.done & io.result);
        closing.set(*ended & io.closes);

        let waiting = k.state("waiting", Type::unsigned(count_bits(count + 1)), io.rst, 0).comment("Codes that wait.");
        let is_last = k.register("is_last", bit);
        let held: Vec<_> = (0..count).map(|pin| k.register(&format!("held_{pin}"), Type::unsigned(code))).collect();
        let offered = io.m_axis.valid.set(waiting.any());
        let moves = k.wire("moves", offered & io.m_axis.ready);
        k.when(moves, || {
            waiting.set(waiting.minus(1));
            held.windows(2).for_each(|pair| pair[0].set(*pair[1]));
        });
        let (mut at_end, mut at_other) = (Vec::new(), Vec::new());
        for (pin, to) in held.iter().enumerate() {
            let name = |of: &str| format!("{of}_{pin}");
            let answer = k.register(&name("answer"), Type::unsigned(bits + tag_bits));
            k.when(*taken, || answer.set(answer.low(answer.bits() - 1).concat(pins.at(pin))));
            let raw = answer.low(bits);
            let value = match converter.bipolar {
                // Less the middle of the range.
                true => (!raw.top()).concat(raw.low(bits - 1)).signed().extend(value_bits),
                false => raw.extend(value_bits).signed(),
            };
            let sum = k.register(&name("sum"), Type::signed(sum_bits));
            let zero = k.constant(1, 0);
            let marks = [
                ("high", raw.all()),
                ("low", if converter.bipolar { !raw.any() } else { zero }),
                (
                    "wrong",
                    if tag_bits > 0 { answer.slice(bits, tag_bits).differs(io.channel.extend(tag_bits)) } else { zero },
                ),
            ];
            let [high, low, wrong] = marks.map(|(of, now)| {
                if now.is_same(zero) {
                    return zero;
                }
                let mark = k.register(&name(of), bit);
                k.when(*ended, || mark.set(now | (*mark & !io.opens)));
                *mark
            });
            let before = io.opens.mux(k.signed_constant(sum_bits, 0), *sum);
            k.when(*ended, || sum.set((before + value.extend(sum_bits)).resize(sum_bits)));
            let mean = sum.shift_left(shift).round_shift(power).low(code);
            let [top, bottom] =
                [rail(*code_bits), -rail(*code_bits)].map(|end| k.signed_constant(code, end.into()).unsigned());
            let code_out = k.wire(&name("code"), (high | wrong).mux(top, low.mux(bottom, mean)));
            k.when(*closing, || to.set(code_out));
            at_end.push((high | low) & io.alive.at(pin));
            at_other.push(wrong & io.alive.at(pin));
        }
        k.when(*closing, || {
            waiting.set(k.constant(waiting.bits(), count as u64));
            is_last.set(io.ends);
        });
        io.m_axis.data.set(*held[0]);
        let last = io.m_axis.last.set(*is_last & waiting.is(1));
        let complete = io.complete.set(moves & last);
        io.clear.set(!offered);
        for (mark, marks) in [(io.rail, at_end), (io.other, at_other)] {
            let seen = mark.state(io.rst, 0);
            k.when(complete, || seen.set(k.constant(1, 0)));
            k.when(*closing, || seen.set(*seen | concat(&marks).any()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::sequencer::tests::params;
    use super::*;
    use crate::language::testbench::{check_with_defects, subject_of, Reference};
    use crate::language::Change;
    use crate::wire::Word;
    use dermis_golden::fixed::stages::scan::code;
    use dermis_golden::result::flags::{Flag, FlagSet};
    use std::collections::VecDeque;

    /// Codes of whole channels by the stage.
    struct Codes {
        params: ScanParams,
        /// Answers of each converter so far: all bits, then samples of the channel.
        bits: Vec<u32>,
        answers: Vec<Vec<u32>>,
        /// Pins of the cycles before.
        pins: VecDeque<u64>,
        taken: bool,
        /// What waits: code, last.
        waiting: VecDeque<(i32, bool)>,
        /// Codes on their way.
        later: VecDeque<Option<(Vec<i32>, bool, FlagSet)>>,
        ended: Option<[u64; 5]>,
        flags: FlagSet,
        reset: bool,
    }

    impl Codes {
        fn new(params: &ScanParams) -> Self {
            let count = params.scan.converters;
            Codes {
                params: params.clone(),
                bits: vec![0; count],
                answers: vec![Vec::new(); count],
                pins: [0, 0].into(),
                taken: false,
                waiting: VecDeque::new(),
                later: [None].into(),
                ended: None,
                flags: FlagSet::default(),
                reset: false,
            }
        }
    }

    impl Reference for Codes {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            if !self.reset {
                return vec![None; 7];
            }
            let bit = |bit: bool| Some(Word::from(bit));
            let next = self.waiting.front();
            let complete = next.is_some_and(|next| next.1) && inputs[10].number() == 1;
            let flag = |flag: Flag| complete.then(|| Word::from(self.flags.contains(flag)));
            vec![
                next.map(|next| Word::of_fields(&[next.0.into()], self.params.code_bits as usize)),
                bit(next.is_some()),
                next.map(|next| Word::from(next.1)),
                bit(complete),
                flag(Flag::Saturated),
                flag(Flag::WrongChannel),
                bit(next.is_none()),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let of = |k: usize| inputs[k].number();
            let scan = self.params.scan;
            if !self.waiting.is_empty() && of(10) == 1 && self.waiting.pop_front().is_some_and(|(_, last)| last) {
                self.flags = FlagSet::default();
            }
            if let Some(Some((codes, last, flags))) = self.later.pop_front() {
                let count = codes.len();
                self.flags = self.flags | flags;
                self.waiting =
                    codes.into_iter().enumerate().map(|(at, code)| (code, last && at + 1 == count)).collect();
            }
            let mut closed = None;
            if let Some([opens, closes, ends, channel, alive]) = self.ended.take() {
                for (own, answers) in self.answers.iter_mut().enumerate() {
                    if opens == 1 {
                        answers.clear();
                    }
                    answers.push(self.bits[own] & ((1 << scan.converter.answer_bits()) - 1));
                }
                if closes == 1 {
                    let codes = self
                        .answers
                        .iter()
                        .map(|answers| code(&scan, self.params.code_bits, channel as usize, answers.iter().copied()));
                    let codes: Vec<(i32, FlagSet)> = codes.collect();
                    let live = codes.iter().enumerate().filter(|(own, _)| alive >> own & 1 == 1);
                    let flags = live.fold(FlagSet::default(), |flags, (_, (_, own))| flags | *own);
                    closed = Some((codes.into_iter().map(|(code, _)| code).collect(), ends == 1, flags));
                }
            }
            self.later.push_back(closed);
            if self.taken {
                let pins = self.pins[0];
                self.bits.iter_mut().enumerate().for_each(|(own, bits)| *bits = *bits << 1 | (pins >> own & 1) as u32);
            }
            self.pins.pop_front();
            self.pins.push_back(of(1));
            self.taken = of(2) == 1;
            self.ended = (of(3) == 1 && of(4) == 1).then(|| [of(5), of(6), of(7), of(8), of(9)]);
            if of(0) == 1 {
                *self =
                    Codes { reset: true, pins: self.pins.clone(), bits: self.bits.clone(), ..Codes::new(&self.params) };
            }
        }
    }

    /// Frames of random answers, every fourth at an end of the range, every eighth of another channel; a receiver that stalls.
    fn stimulus(params: &ScanParams, channels: usize) -> Vec<Vec<Word>> {
        let (scan, mut random) = (&params.scan, fastrand::Rng::with_seed(7));
        let converter = &scan.converter;
        let mut all = Vec::new();
        let mut push = |miso: u64, take: bool, done: bool, of: [u64; 6], ready: bool, rst: bool| {
            let bits = [rst.into(), miso, take.into(), done.into()];
            let words = bits.into_iter().chain(of).chain([ready.into()]);
            all.push(words.map(Word::from).collect());
        };
        (0..2).for_each(|_| push(0, false, false, [0; 6], true, true));
        for group in 0..channels {
            let channel = group % scan.channels;
            for sample in 0..scan.samples() {
                let answers: Vec<u64> = (0..scan.converters)
                    .map(|_| {
                        let most = (1u64 << converter.bits) - 1;
                        let raw = match random.u8(..8) {
                            0 => most,
                            1 => 0,
                            _ => random.u64(..=most),
                        };
                        let tag = if random.u8(..8) == 0 { random.u64(..8) } else { channel as u64 };
                        if converter.tag_bits > 0 {
                            tag << converter.bits | raw
                        } else {
                            raw
                        }
                    })
                    .collect();
                let is = |yes: bool| u64::from(yes);
                let ends = channel + 1 == scan.channels && group / scan.channels % 2 == 1;
                let of = [
                    1,
                    is(sample == 0),
                    is(sample + 1 == scan.samples()),
                    is(ends),
                    channel as u64,
                    random.u64(..1 << scan.converters),
                ];
                for at in (0..converter.answer_bits()).rev() {
                    let miso =
                        answers.iter().enumerate().fold(0, |miso, (own, answer)| miso | (answer >> at & 1) << own);
                    // `take` comes one cycle after the pins.
                    push(miso, false, false, of, random.bool(), false);
                    push(random.u64(..1 << scan.converters), true, false, of, random.bool(), false);
                }
                push(0, false, true, of, random.bool(), false);
                for cycle in 0..12 + scan.converters {
                    push(0, false, false, of, cycle > 5 || random.bool(), false);
                }
            }
        }
        all
    }

    #[test]
    fn codes_and_marks_are_those_of_the_stage() {
        for params in [params(0, 3, 2, &[]), params(0, 1, 0, &[]), params(1, 2, 3, &[]), params(1, 8, 0, &[])] {
            let subject = |changes: &[Change]| {
                subject_of!(
                    ScanCapture::new(&params),
                    changes,
                    inputs [rst, miso, take, done, result, opens, closes, ends, channel, alive, m_axis_tready],
                    outputs [m_axis_tdata, m_axis_tvalid, m_axis_tlast, complete, rail, other, clear],
                )
            };
            let mut defects = vec![
                // The mean hides a sample at the end of the range.
                Change::value("", "high_0", |k| k.named("closing")),
                Change::value("", "taken", |k| k.named("take") & !k.named("miso").at(0)),
            ];
            if params.scan.converter.tag_bits > 0 {
                defects.push(Change::value("", "wrong_0", |k| k.constant(1, 0)));
            }
            check_with_defects(subject, &stimulus(&params, 40), || Codes::new(&params), &defects);
        }
    }
}
