//! Stage `rescale`: accumulators to words of v_ij; v_00 after its block exponent has been measured.
//!
//! The first rows of a subarray are raw v_00: Q rows of the low limbs wait in a memory until the Q rows of the high limbs
//! are added to them, as they are read and written again. The magnitudes of the sums are measured, then they pass the
//! rescaler with the measured shift. All later rows pass it directly, with the constant shift of an A pass. The two
//! never overlap, because no A pass starts before v_00 is complete.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::Model;

use crate::block;
use crate::language::{Block, Builder, Inside};
use crate::primitives::{
    count_bits, largest, BitDelay, CaseCounter, Delay, Dff, LimbSum, Ram, RawLength, Rescaler, SATURATION_BITS,
};

block! {
    /// Rows of accumulators in; words three cycles after they enter the rescaler, operands four.
    pub struct Rescale {
        /// Quads of a subarray, by case.
        quads: Vec<usize>,
        lane_bits: usize,
        raw: Ram,
        limb_sum: LimbSum,
        length: RawLength,
        rescaler: Rescaler,
    }
    ports RescalePorts {
        clock;
        reset;
        /// Index of the case; constant while a frame is computed.
        in case_index: count_bits(quads.len());
        /// A subarray starts: v_00 comes next, and its saturations are counted from 0.
        in start;
        /// Accumulators of one row for the four parities, `lane_bits` each, signed; valid with `quad_valid`.
        in quad: 4 * lane_bits;
        /// `quad` holds a row.
        in quad_valid;
        /// `quad` holds a row two cycles later.
        in quad_soon;
        /// Four parities of a v_ij, `vector_bits` each, signed; valid with `words_valid`.
        out words: rescaler.widths().words;
        /// `words` holds a quad.
        out words_valid;
        /// The same, rounded to `data_bits` each, as operands of later passes; valid with `operands_valid`, a cycle later.
        out operands: rescaler.widths().operands;
        /// `operands` holds a quad.
        out operands_valid;
        /// Measured right shift; valid from the first word until the next subarray.
        out shift: length.widths().shift;
        /// Number of words saturated in this subarray; final two cycles after its last word.
        out saturations: SATURATION_BITS;
    }
}

impl Rescale {
    /// With the widths of `model`.
    pub fn new(model: &Model) -> Self {
        let formats = model.formats();
        let quads: Vec<usize> = model.cases().iter().map(|case| case.formats.quads).collect();
        let acc = 4 * formats.acc_bits as usize;
        Rescale {
            lane_bits: formats.lane_bits as usize,
            raw: Ram::new(largest(&quads), 1, acc).holding([Holds::Raw]).registered(),
            limb_sum: LimbSum::new(formats),
            length: RawLength::new(formats),
            rescaler: Rescaler::new(formats),
            quads,
        }
    }
}

impl Block for Rescale {
    fn build<'k>(&self, k: &'k Builder, io: RescalePorts<Inside<'k>>) {
        let collecting = k.instance("collecting", Dff {});
        let replaying = k.instance("replaying", Dff {});
        let rows = k.instance("rows", CaseCounter::new(&self.quads));
        let reads = k.instance("reads", CaseCounter::new(&self.quads));
        let raw = k.instance("raw", &self.raw);
        let limb_sum = k.instance("limb_sum", &self.limb_sum);
        let length = k.instance("length", &self.length);
        let rescaler = k.instance("rescaler", &self.rescaler);
        let started = k.instance("started", BitDelay::new(1));
        let writes = k.instance("writes", BitDelay::new(1));
        let measures = k.instance("measures", BitDelay::new(1));
        let ends = k.instance("ends", BitDelay::new(1));
        let row = k.instance("row", Delay::new(rows.value.bits(), 1));
        let read = k.instance("read", BitDelay::new(2));
        let words_later = k.instance("words_later", BitDelay::new(3));
        let operands_later = k.instance("operands_later", BitDelay::new(1));

        k.comment("Registered; the first row comes many cycles later");
        started.d.set(io.start);
        let collected = k.wire("collected", collecting.q & io.quad_valid);
        let complete = k.wire("complete", collected & limb_sum.complete);
        collecting.d.set((started.q | (collecting.q & !(complete & rows.last))) & !io.rst);
        rows.case_index.set(io.case_index);
        reads.case_index.set(io.case_index);
        rows.clear.set(started.q);
        rows.enable.set(collected);
        k.comment("The sum of a row is registered");
        writes.d.set(collected);
        measures.d.set(complete);
        ends.d.set(complete & rows.last);
        row.d.set(rows.value);
        raw.write.set(writes.q);
        raw.write_address.set(row.q);
        raw.write_data.set(limb_sum.sum);
        limb_sum.clear.set(started.q);
        limb_sum.last.set(collected & rows.last);
        limb_sum.quad.set(io.quad);
        limb_sum.low.set(raw.read_data);
        length.clear.set(started.q);
        length.accept.set(measures.q);
        length.quad.set(limb_sum.sum);

        replaying.d.set((ends.q | (replaying.q & !reads.last)) & !io.rst);
        k.comment("Read two cycles before its high limbs come, and again");
        reads.clear.set(started.q);
        reads.enable.set(replaying.q | (collecting.q & io.quad_soon));
        raw.read.set(k.constant(1, 1));
        raw.read_address.set(reads.value);
        read.d.set(replaying.q);

        let enters = k.wire("enters", read.q | (io.quad_valid & !collecting.q));
        rescaler.clear.set(started.q);
        rescaler.valid.set(enters);
        rescaler.measured.set(read.q);
        rescaler.shift.set(length.shift);
        rescaler.raw.set(raw.read_data);
        rescaler.quad.set(io.quad);
        words_later.d.set(enters);
        operands_later.d.set(words_later.q);
        io.words.set(rescaler.words);
        io.words_valid.set(words_later.q);
        io.operands.set(rescaler.operands);
        io.operands_valid.set(operands_later.q);
        io.shift.set(length.shift);
        io.saturations.set(rescaler.saturations);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use dermis_golden::fixed::stages::pass::join_limbs;
    use dermis_golden::fixed::stages::rescale::{operand, raw_length, rescale, shift};

    use super::*;
    use crate::language::testbench::{check_with_defects, subject_of, Reference};
    use crate::language::Change;
    use crate::scenes::model;
    use crate::wire::Word;

    /// Cycles from the last row of v_00 to its first word, and from a later row to its word.
    const LATENCY: [usize; 2] = [7, 3];

    struct Rescaling<'a> {
        model: &'a Model,
        cycle: usize,
        /// The rows of v_00 so far; none when it is complete.
        rows: Option<Vec<[i64; 4]>>,
        /// The subarray's shift, from the cycle of its first word on.
        shift: Option<(usize, u32)>,
        saturations: u32,
        /// Words by the cycle in which they are output; none before the first reset.
        words: Option<BTreeMap<usize, [i64; 4]>>,
    }

    impl<'a> Rescaling<'a> {
        fn new(model: &'a Model) -> Self {
            Rescaling { model, cycle: 0, rows: None, shift: None, saturations: 0, words: None }
        }

        /// Rows of v_00 of case `case_index`.
        fn rows(&self, case_index: usize) -> usize {
            let limbs = if self.model.formats().limb_align > 0 { 2 } else { 1 };
            limbs * self.model.cases()[case_index].formats.quads
        }

        /// All words have been output two cycles ago.
        fn is_idle(&self) -> bool {
            self.words.iter().flatten().all(|(&cycle, _)| cycle + 2 <= self.cycle)
        }
    }

    impl Reference for Rescaling<'_> {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let formats = self.model.formats();
            let words = |cycle: Option<usize>| {
                let all = self.words.as_ref()?;
                Some(cycle.and_then(|cycle| all.get(&cycle).copied()))
            };
            let (word, last) = (words(Some(self.cycle)), words(self.cycle.checked_sub(1)));
            let operands =
                last.flatten().map(|words| Word::of_fields(&operand(formats, &[words])[0], formats.data_bits as usize));
            let shift =
                self.shift.filter(|(from, _)| *from <= self.cycle).map(|(_, shift)| Word::from(u64::from(shift)));
            vec![
                word.flatten().map(|words| Word::of_fields(&words, formats.vector_bits as usize)),
                word.map(|word| word.is_some().into()),
                operands,
                last.map(|last| last.is_some().into()),
                shift,
                shift.filter(|_| self.is_idle()).map(|_| Word::from(u64::from(self.saturations))),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, case_index, start, _, valid] = [0, 1, 2, 3, 4].map(|input| inputs[input].number() as usize);
            let formats = self.model.formats();
            let quad = [0, 1, 2, 3].map(|parity| inputs[3].signed(parity, formats.lane_bits as usize));
            let all = self.rows(case_index);
            let mut words = self.words.take();
            if let (1, Some(due)) = (valid, &mut words) {
                let mut add = |rows: &[[i64; 4]], shift: u32, latency: usize| {
                    let (words, saturations) = rescale(formats, rows, shift);
                    due.extend((self.cycle + latency..).zip(words));
                    self.saturations += saturations;
                };
                match self.rows.take() {
                    None => add(&[quad], formats.a_shift, LATENCY[1]),
                    Some(mut rows) => {
                        rows.push(quad);
                        if rows.len() < all {
                            self.rows = Some(rows);
                        } else {
                            let limbs: Vec<_> =
                                rows.chunks(self.model.cases()[case_index].formats.quads).map(<[_]>::to_vec).collect();
                            let raw = join_limbs(formats, &limbs);
                            let shift = shift(formats, raw_length(&raw));
                            add(&raw, shift, LATENCY[0]);
                            self.shift = Some((self.cycle + LATENCY[0], shift));
                        }
                    }
                }
            }
            if start == 1 {
                (self.rows, self.shift, self.saturations) = (Some(Vec::new()), None, 0);
            }
            if rst == 1 {
                (self.rows, self.shift, words) = (None, None, Some(BTreeMap::new()));
            }
            self.words = words;
            self.cycle += 1;
        }
    }

    /// Subarrays: v_00, then rows of other v_ij, with gaps and resets.
    fn stimulus(model: &Model, subarrays: usize) -> Vec<Vec<Word>> {
        let formats = model.formats();
        let mut random = fastrand::Rng::with_seed(12);
        // Reset, case, start, a row.
        let mut cycles: Vec<(bool, usize, bool, bool)> = vec![(true, 0, false, false)];
        for _ in 0..subarrays {
            let case_index = random.usize(..model.cases().len());
            let quads = model.cases()[case_index].formats.quads;
            let (gaps, first) = (random.u8(..4), cycles.len());
            cycles.push((false, case_index, true, false));
            cycles.extend([(false, case_index, false, false); 4]);
            let rows = |cycles: &mut Vec<_>, random: &mut fastrand::Rng, count: usize| {
                for _ in 0..count {
                    let gap = if random.u8(..4) < gaps { random.usize(..4) } else { 0 };
                    cycles.extend(vec![(false, case_index, false, false); gap]);
                    cycles.push((false, case_index, false, true));
                }
            };
            rows(&mut cycles, &mut random, Rescaling::new(model).rows(case_index));
            cycles.extend(vec![(false, case_index, false, false); quads + LATENCY[0]]);
            let more = random.usize(..60);
            rows(&mut cycles, &mut random, more);
            cycles.extend([(false, case_index, false, false); 8]);
            if random.u8(..5) == 0 {
                cycles.truncate(random.usize(first + 1..cycles.len()));
                cycles.push((true, case_index, false, false));
            }
        }
        let magnitude = formats.acc_bits.min(formats.lane_bits + formats.limb_align) - formats.limb_align - 2;
        let mut quieter = 0;
        let inputs = |cycle: usize| {
            let (rst, case_index, start, valid) = cycles[cycle];
            let soon = cycles.get(cycle + 2).is_some_and(|(.., valid)| *valid);
            if start {
                quieter = random.u32(..magnitude);
            }
            let quad = [(); 4].map(|()| random.i64(-(1 << magnitude)..1 << magnitude) >> quieter);
            let quad = Word::of_fields(&quad, formats.lane_bits as usize);
            vec![rst.into(), Word::from(case_index as u64), start.into(), quad, valid.into(), soon.into()]
        };
        (0..cycles.len()).map(inputs).collect()
    }

    #[test]
    fn v_00_is_measured_and_shifted_and_later_rows_pass() {
        let two_limbs = model(8, 8, "[partition]\ncases = [0, 1]\n");
        let one_limb = model(4, 4, "[fixed]\ninput_bits = 12\ninverse_bits = 18\n");
        assert!(two_limbs.formats().limb_align > 0 && one_limb.formats().limb_align == 0);
        for model in [two_limbs, one_limb] {
            let subject = |changes: &[Change]| {
                subject_of!(
                    Rescale::new(&model),
                    changes,
                    inputs [rst, case_index, start, quad, quad_valid, quad_soon],
                    outputs [words, words_valid, operands, operands_valid, shift, saturations],
                )
            };
            let defects = [
                Change::value("", "raw__write_address", |k| k.named("rows__value")),
                Change::value("", "length__clear", |k| k.named("rst")),
            ];
            let defects = if model.cases().len() == 2 { &defects[..] } else { &[] };
            check_with_defects(subject, &stimulus(&model, 60), || Rescaling::new(&model), defects);
        }
    }
}
