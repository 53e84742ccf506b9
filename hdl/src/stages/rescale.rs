//! Stage `rescale`: accumulators to words of v_ij; v_00 after its block exponent has been measured.
//!
//! The first rows of a subarray are raw v_00: Q rows of the low limbs wait in a memory until the Q rows of the high limbs
//! are added to them, as they are read and written again. The magnitudes of the sums are measured, then they pass the
//! rescaler with the measured shift. All later rows pass it directly, with the constant shift of an A pass. The two
//! never overlap, because no A pass starts before v_00 is complete.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use crate::language::RustHdl;
use crate::primitives::{
    count_bits, largest, shift_bits, BitDelay, CaseCounter, Delay, Dff, LimbSum, Ram, RawLength, Rescaler,
    SATURATION_BITS,
};
use crate::wire::Wire;

/// Rows of accumulators in; words three cycles after they enter the rescaler, operands four.
#[derive(dermis_hdl_derive::Block)]
pub struct Rescale {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// Index of the case; constant while a frame is computed.
    pub which: Wire<In>,
    /// A subarray starts: v_00 comes next, and its saturations are counted from 0.
    pub start: Signal<In, Bit>,
    /// Accumulators of one row for the four parities, `lane_bits` each, signed; valid with `quad_valid`.
    pub quad: Wire<In>,
    /// `quad` holds a row.
    pub quad_valid: Signal<In, Bit>,
    /// `quad` holds a row two cycles later.
    pub quad_soon: Signal<In, Bit>,
    /// Four parities of a v_ij, `vector_bits` each, signed; valid with `words_valid`.
    pub words: Wire<Out>,
    /// `words` holds a quad.
    pub words_valid: Signal<Out, Bit>,
    /// The same, rounded to `data_bits` each, as operands of later passes; valid with `operands_valid`, a cycle later.
    pub operands: Wire<Out>,
    /// `operands` holds a quad.
    pub operands_valid: Signal<Out, Bit>,
    /// Measured right shift; valid from the first word until the next subarray.
    pub shift: Wire<Out>,
    /// Number of words saturated in this subarray; final two cycles after its last word.
    pub saturations: Wire<Out>,
    collecting: RustHdl<Dff>,
    replaying: RustHdl<Dff>,
    rows: RustHdl<CaseCounter>,
    reads: RustHdl<CaseCounter>,
    raw: RustHdl<Ram>,
    limb_sum: LimbSum,
    length: RawLength,
    rescaler: RustHdl<Rescaler>,
    started: RustHdl<BitDelay>,
    writes: RustHdl<BitDelay>,
    measures: RustHdl<BitDelay>,
    ends: RustHdl<BitDelay>,
    row: RustHdl<Delay>,
    read: RustHdl<BitDelay>,
    words_later: RustHdl<BitDelay>,
    operands_later: RustHdl<BitDelay>,
    collected: Signal<Local, Bit>,
    complete: Signal<Local, Bit>,
    enters: Signal<Local, Bit>,
}

impl Rescale {
    /// With the widths of `model`.
    pub fn new(model: &Model) -> Self {
        let formats = model.formats();
        let quads: Vec<usize> = model.cases().iter().map(|case| case.formats.quads).collect();
        let acc = 4 * formats.acc_bits as usize;
        Rescale {
            clk: Default::default(),
            rst: Default::default(),
            which: Wire::new(count_bits(quads.len())),
            start: Default::default(),
            quad: Wire::new(4 * formats.lane_bits as usize),
            quad_valid: Default::default(),
            quad_soon: Default::default(),
            words: Wire::new(4 * formats.vector_bits as usize),
            words_valid: Default::default(),
            operands: Wire::new(4 * formats.data_bits as usize),
            operands_valid: Default::default(),
            shift: Wire::new(shift_bits(formats)),
            saturations: Wire::new(SATURATION_BITS),
            collecting: Default::default(),
            replaying: Default::default(),
            rows: RustHdl::new(CaseCounter::new(&quads)),
            reads: RustHdl::new(CaseCounter::new(&quads)),
            raw: RustHdl::new(Ram::new(largest(&quads), 1, acc).holding([Holds::Raw]).registered()),
            limb_sum: LimbSum::new(formats),
            length: RawLength::new(formats),
            rescaler: RustHdl::new(Rescaler::new(formats)),
            started: RustHdl::new(BitDelay::new(1)),
            writes: RustHdl::new(BitDelay::new(1)),
            measures: RustHdl::new(BitDelay::new(1)),
            ends: RustHdl::new(BitDelay::new(1)),
            row: RustHdl::new(Delay::new(count_bits(largest(&quads)), 1)),
            read: RustHdl::new(BitDelay::new(2)),
            words_later: RustHdl::new(BitDelay::new(3)),
            operands_later: RustHdl::new(BitDelay::new(1)),
            collected: Default::default(),
            complete: Default::default(),
            enters: Default::default(),
        }
    }
}

impl Logic for Rescale {
    #[hdl_gen]
    fn update(&mut self) {
        self.collecting.clk.next = self.clk.val();
        self.replaying.clk.next = self.clk.val();
        self.rows.clk.next = self.clk.val();
        self.reads.clk.next = self.clk.val();
        self.raw.clk.next = self.clk.val();
        self.limb_sum.clk.next = self.clk.val();
        self.length.clk.next = self.clk.val();
        self.rescaler.clk.next = self.clk.val();
        self.read.clk.next = self.clk.val();
        self.words_later.clk.next = self.clk.val();
        self.operands_later.clk.next = self.clk.val();
        self.started.clk.next = self.clk.val();
        self.started.rst.next = self.rst.val();
        self.writes.clk.next = self.clk.val();
        self.writes.rst.next = self.rst.val();
        self.measures.clk.next = self.clk.val();
        self.measures.rst.next = self.rst.val();
        self.ends.clk.next = self.clk.val();
        self.ends.rst.next = self.rst.val();
        self.row.clk.next = self.clk.val();
        self.read.rst.next = self.rst.val();
        self.words_later.rst.next = self.rst.val();
        self.operands_later.rst.next = self.rst.val();

        comment!("Registered; the first row comes many cycles later");
        self.started.d.next = self.start.val();
        self.collected.next = self.collecting.q.val() & self.quad_valid.val();
        self.complete.next = self.collected.val() & self.limb_sum.complete.val();
        self.collecting.d.next = (self.started.q.val()
            | (self.collecting.q.val() & !(self.complete.val() & self.rows.last.val())))
            & !self.rst.val();
        self.rows.which.next = self.which.val();
        self.reads.which.next = self.which.val();
        self.rows.clear.next = self.started.q.val();
        self.rows.enable.next = self.collected.val();
        comment!("The sum of a row is registered");
        self.writes.d.next = self.collected.val();
        self.measures.d.next = self.complete.val();
        self.ends.d.next = self.complete.val() & self.rows.last.val();
        self.row.d.next = self.rows.value.val();
        self.raw.write.next = self.writes.q.val().into();
        self.raw.write_address.next = self.row.q.val();
        self.raw.write_data.next = self.limb_sum.sum.val();
        self.limb_sum.clear.next = self.started.q.val();
        self.limb_sum.last.next = self.collected.val() & self.rows.last.val();
        self.limb_sum.quad.next = self.quad.val();
        self.limb_sum.low.next = self.raw.read_data.val();
        self.length.clear.next = self.started.q.val();
        self.length.accept.next = self.measures.q.val();
        self.length.quad.next = self.limb_sum.sum.val();

        self.replaying.d.next =
            (self.ends.q.val() | (self.replaying.q.val() & !self.reads.last.val())) & !self.rst.val();
        comment!("Read two cycles before its high limbs come, and again");
        self.reads.clear.next = self.started.q.val();
        self.reads.enable.next = self.replaying.q.val() | (self.collecting.q.val() & self.quad_soon.val());
        self.raw.read.next = true;
        self.raw.read_address.next = self.reads.value.val();
        self.read.d.next = self.replaying.q.val();

        self.enters.next = self.read.q.val() | (self.quad_valid.val() & !self.collecting.q.val());
        self.rescaler.clear.next = self.started.q.val();
        self.rescaler.valid.next = self.enters.val();
        self.rescaler.measured.next = self.read.q.val();
        self.rescaler.shift.next = self.length.shift.val();
        self.rescaler.raw.next = self.raw.read_data.val();
        self.rescaler.quad.next = self.quad.val();
        self.words_later.d.next = self.enters.val();
        self.operands_later.d.next = self.words_later.q.val();
        self.words.next = self.rescaler.words.val();
        self.words_valid.next = self.words_later.q.val();
        self.operands.next = self.rescaler.operands.val();
        self.operands_valid.next = self.operands_later.q.val();
        self.shift.next = self.length.shift.val();
        self.saturations.next = self.rescaler.saturations.val();
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use dermis_golden::fixed::stages::pass::join_limbs;
    use dermis_golden::fixed::stages::rescale::{operand, raw_length, rescale, shift};

    use super::*;
    use crate::language::testbench::{block_subject, check_with_defects, Reference};
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

        /// Rows of v_00 of case `which`.
        fn rows(&self, which: usize) -> usize {
            let limbs = if self.model.formats().limb_align > 0 { 2 } else { 1 };
            limbs * self.model.cases()[which].formats.quads
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
            let [rst, which, start, _, valid] = [0, 1, 2, 3, 4].map(|input| inputs[input].number() as usize);
            let formats = self.model.formats();
            let quad = [0, 1, 2, 3].map(|parity| inputs[3].signed(parity, formats.lane_bits as usize));
            let all = self.rows(which);
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
                                rows.chunks(self.model.cases()[which].formats.quads).map(<[_]>::to_vec).collect();
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
            let which = random.usize(..model.cases().len());
            let quads = model.cases()[which].formats.quads;
            let (gaps, first) = (random.u8(..4), cycles.len());
            cycles.push((false, which, true, false));
            cycles.extend([(false, which, false, false); 4]);
            let rows = |cycles: &mut Vec<_>, random: &mut fastrand::Rng, count: usize| {
                for _ in 0..count {
                    let gap = if random.u8(..4) < gaps { random.usize(..4) } else { 0 };
                    cycles.extend(vec![(false, which, false, false); gap]);
                    cycles.push((false, which, false, true));
                }
            };
            rows(&mut cycles, &mut random, Rescaling::new(model).rows(which));
            cycles.extend(vec![(false, which, false, false); quads + LATENCY[0]]);
            let more = random.usize(..60);
            rows(&mut cycles, &mut random, more);
            cycles.extend([(false, which, false, false); 8]);
            if random.u8(..5) == 0 {
                cycles.truncate(random.usize(first + 1..cycles.len()));
                cycles.push((true, which, false, false));
            }
        }
        let magnitude = formats.acc_bits.min(formats.lane_bits + formats.limb_align) - formats.limb_align - 2;
        let mut quieter = 0;
        let inputs = |cycle: usize| {
            let (rst, which, start, valid) = cycles[cycle];
            let soon = cycles.get(cycle + 2).is_some_and(|(.., valid)| *valid);
            if start {
                quieter = random.u32(..magnitude);
            }
            let quad = [(); 4].map(|()| random.i64(-(1 << magnitude)..1 << magnitude) >> quieter);
            let quad = Word::of_fields(&quad, formats.lane_bits as usize);
            vec![rst.into(), Word::from(which as u64), start.into(), quad, valid.into(), soon.into()]
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
                block_subject!(
                    Rescale::new(&model),
                    changes,
                    inputs [rst, which, start, quad, quad_valid, quad_soon],
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
