//! Codes to stress: subtracts the zero and multiplies by the gain of each taxel, from a table that a memory file initialises.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::stages::prepare::{Prepare, GAIN_BITS, GAIN_FRACTION};
use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Contents, Expr, Type};
use crate::primitives::address::counter::count_bits;
use crate::primitives::stream::pass_through::wires;
use crate::wire::Wire;

/// ```text
/// s_axis --> read table, hold code --> difference --> product --> round, saturate --> m_axis
/// ```
/// All registers advance together while the output is free: latency 4 cycles with gains, 2 with zeros alone, 0 with no
/// table, where the stream passes through. The taxel count restarts at `tlast`, as in `receive`.
#[derive(dermis_hdl_derive::Block)]
pub struct Calibrate {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A taxel's code, `bits` wide, two's complement; valid with `s_axis_tvalid`.
    pub s_axis_tdata: Wire<In>,
    /// A beat is offered on `s_axis_tdata`; the sender holds it until `s_axis_tready`.
    pub s_axis_tvalid: Signal<In, Bit>,
    /// The block accepts a beat in this cycle.
    pub s_axis_tready: Signal<Out, Bit>,
    /// The beat is the last of its frame; valid with `s_axis_tvalid`.
    pub s_axis_tlast: Signal<In, Bit>,
    /// A taxel's stress in codes, `bits` wide, two's complement, saturated; valid with `m_axis_tvalid`.
    pub m_axis_tdata: Wire<Out>,
    /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
    pub m_axis_tvalid: Signal<Out, Bit>,
    /// The receiver accepts a beat in this cycle.
    pub m_axis_tready: Signal<In, Bit>,
    /// The beat is the last of its frame; valid with `m_axis_tvalid`.
    pub m_axis_tlast: Signal<Out, Bit>,
    /// Writes `write_entry` to taxel `write_taxel`, where tables are writable; during a reset.
    pub write: Signal<In, Bit>,
    /// Index of the taxel; valid with `write`.
    pub write_taxel: Wire<In>,
    /// Zero in the low bits, gain above; valid with `write`.
    pub write_entry: Wire<In>,
    /// Every stress is 0, where tables are writable: they are not whole.
    pub incomplete: Signal<In, Bit>,
    kernel: Body,
}

kernel_block!(
    Calibrate,
    clock clk,
    inputs [rst, s_axis_tdata, s_axis_tvalid, s_axis_tlast, m_axis_tready, write, write_taxel, write_entry, incomplete],
    outputs [s_axis_tready, m_axis_tdata, m_axis_tvalid, m_axis_tlast]
);

/// File of the table, one line per taxel: zero in the low bits, gain above.
pub const CALIBRATION_FILE: &str = "calibration.hex";

impl Calibrate {
    /// Calibrates codes of `bits` bits of `taxels` taxels with the tables of `prepare`, which are `written` or not.
    pub fn new(prepare: &Prepare, taxels: usize, bits: usize, written: bool) -> Self {
        Calibrate::of(prepare.zero.as_deref(), prepare.gain.as_deref(), taxels, bits, written)
    }

    fn of(zero: Option<&[i32]>, gain: Option<&[i32]>, taxels: usize, bits: usize, written: bool) -> Self {
        let block = Calibrate {
            clk: Default::default(),
            rst: Default::default(),
            s_axis_tdata: Wire::new(bits),
            s_axis_tvalid: Default::default(),
            s_axis_tready: Default::default(),
            s_axis_tlast: Default::default(),
            m_axis_tdata: Wire::new(bits),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            write: Default::default(),
            write_taxel: Wire::new(count_bits(taxels)),
            write_entry: Wire::new(bits + GAIN_BITS as usize),
            incomplete: Default::default(),
            kernel: Body::default(),
        };
        let k = match zero {
            None => wires("calibrate", bits, "No zero and no gain: the stream passes through."),
            Some(_) => Builder::new("calibrate"),
        };
        let stream = zero.is_some().then(|| {
            let bit = |name: &str| k.input(name, 1);
            let (rst, data) = (bit("rst"), k.input("s_axis_tdata", bits));
            Stream { rst, data, offered: bit("s_axis_tvalid"), tlast: bit("s_axis_tlast"), ready: bit("m_axis_tready") }
        });
        let write = [
            ("write", 1),
            ("write_taxel", block.write_taxel.width()),
            ("write_entry", block.write_entry.width()),
            ("incomplete", 1),
        ];
        let write = write.map(|(name, bits)| k.input(name, bits));
        if let Some((zero, stream)) = zero.zip(stream) {
            let table = Table { zero, gain, written: written.then_some(write) };
            calibrated(&k, stream, table, bits);
        }
        let kernel = k.finish();
        block.bind(kernel)
    }

    /// Content of [`CALIBRATION_FILE`] for `$readmemh`; `None` without a table.
    pub fn table_file(&self) -> Option<String> {
        self.kernel.kernel().memory_files().into_iter().next().map(|(_, text)| text)
    }
}

/// The table, and how it is written.
struct Table<'a, 'k> {
    zero: &'a [i32],
    gain: Option<&'a [i32]>,
    /// Whether, where, what; whether the table is not whole.
    written: Option<[Expr<'k>; 4]>,
}

/// The inputs of the stream.
struct Stream<'k> {
    rst: Expr<'k>,
    data: Expr<'k>,
    offered: Expr<'k>,
    tlast: Expr<'k>,
    ready: Expr<'k>,
}

fn calibrated<'k>(k: &'k Builder, stream: Stream<'k>, table: Table<'_, 'k>, bits: usize) {
    let Stream { rst, data, offered, tlast, ready } = stream;
    let Table { zero, gain, written } = table;
    let taxels = zero.len();
    let (gain_bits, steps) = gain.map_or((0, 2), |_| (GAIN_BITS as usize, 4));
    let word = |taxel: usize| {
        let gain = gain.map_or(0, |gain| gain[taxel] as u64 & ((1 << gain_bits) - 1));
        vec![gain << bits | zero[taxel] as u64 & ((1 << bits) - 1)]
    };
    let contents = Contents::File { name: CALIBRATION_FILE.to_owned(), words: (0..taxels).map(word).collect() };
    let entries = k.memory("entries", taxels, bits + gain_bits, contents).holds(Holds::Calibration);
    let entries = match written {
        None => entries,
        Some([write, taxel, entry, _]) => {
            // Nothing is read during the reset in which it is written.
            let entries = entries.unchecked();
            entries.write(write, taxel, entry);
            entries
        }
    };
    let taxel = k.state("taxel", Type::unsigned(count_bits(taxels)), rst, 0);
    let entry = k.register("entry", Type::unsigned(bits + gain_bits));
    let code = k.register("code", Type::signed(bits));
    let valids = k.state("valids", Type::unsigned(steps), rst, 0);
    let lasts = k.register("lasts", Type::unsigned(steps));
    let moves = k.wire("moves", !valids.top() | ready);
    k.wire("s_axis_tready", moves & !rst);
    k.wire("m_axis_tvalid", valids.top());
    k.wire("m_axis_tlast", lasts.top());

    let difference = k.wire("difference", *code - entry.low(bits).signed());
    let result = match gain {
        None => difference,
        Some(_) => {
            let held = k.register("held", difference.ty());
            let held_gain = k.register("held_gain", Type::signed(gain_bits));
            let dropped = GAIN_FRACTION as usize - 1;
            let product = k.register("product", Type::signed(difference.bits() + gain_bits - dropped));
            k.when(moves, || {
                held.set(difference);
                held_gain.set(entry.slice(bits, gain_bits).signed());
                product.set((*held * *held_gain).shift_right(dropped));
            });
            k.wire("rounded", product.round_shift(1))
        }
    };
    let sign = k.wire("sign", result.slice(bits - 1, result.bits() - bits + 1));
    let clipped = k.wire("clipped", sign.differs(sign.top().repeat(sign.bits())));
    let limit = sign.top().concat((!sign.top()).repeat(bits - 1));
    let stress = k.register("m_axis_tdata", Type::unsigned(bits));
    k.when(moves, || {
        valids.set(valids.low(steps - 1).concat(offered));
        let after = tlast | taxel.is(taxels as u64 - 1);
        k.when(offered, || taxel.set(after.mux(k.constant(taxel.bits(), 0), taxel.plus(1))));
        lasts.set(lasts.low(steps - 1).concat(tlast));
        entry.set(entries.read(*taxel));
        code.set(data.signed());
        let calibrated = clipped.mux(limit, result.low(bits));
        let whole = |[.., incomplete]: [Expr<'k>; 4]| incomplete.mux(k.constant(bits, 0), calibrated);
        stress.set(written.map_or(calibrated, whole));
    });
}

#[cfg(test)]
pub(crate) mod tests {
    use std::collections::VecDeque;

    use dermis_golden::fixed::words::arith::{round_shift, saturate};

    use super::*;
    use crate::language::testbench::{check, random_word, Reference};
    use crate::wire::Word;

    /// The arithmetic in integers, and the beats in the block.
    pub(crate) struct Table {
        bits: usize,
        zero: Vec<i32>,
        gain: Option<Vec<i32>>,
        taxel: usize,
        pipe: VecDeque<Option<(i64, bool)>>,
        reset: bool,
    }

    impl Table {
        /// For codes of `bits` bits.
        pub(crate) fn new(zero: &[i32], gain: Option<&[i32]>, bits: usize) -> Self {
            let pipe = vec![None; if gain.is_some() { 4 } else { 2 }].into();
            let (zero, gain) = (zero.to_vec(), gain.map(<[i32]>::to_vec));
            Table { bits, zero, gain, taxel: 0, pipe, reset: false }
        }
    }

    impl Reference for Table {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let [rst, ready] = [0, 4].map(|k| inputs[k].number() == 1);
            let leaving = self.pipe[0];
            let bit = |bit: bool| self.reset.then(|| Word::from(bit));
            vec![
                bit((leaving.is_none() || ready) && !rst),
                bit(leaving.is_some()),
                leaving.map(|(_, last)| Word::from(last)),
                leaving.map(|(stress, _)| Word::of_fields(&[stress], self.bits)),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, valid, last, ready] = [0, 2, 3, 4].map(|k| inputs[k].number() == 1);
            if self.pipe[0].is_none() || ready {
                let taken = valid.then(|| {
                    let difference = inputs[1].signed(0, self.bits) - i64::from(self.zero[self.taxel]);
                    let gain = self.gain.as_ref().map(|gain| i64::from(gain[self.taxel]));
                    let stress = gain.map_or(difference, |gain| round_shift(difference * gain, GAIN_FRACTION));
                    self.taxel = if last || self.taxel + 1 == self.zero.len() { 0 } else { self.taxel + 1 };
                    (saturate(stress, self.bits as u32).0, last)
                });
                self.pipe.push_back(taken);
                self.pipe.pop_front();
            }
            if rst {
                self.pipe.iter_mut().for_each(|beat| *beat = None);
                (self.taxel, self.reset) = (0, true);
            }
        }
    }

    #[test]
    fn codes_are_calibrated_with_their_taxel_s_words() {
        const TAXELS: usize = 6;
        const BITS: usize = 8;
        let mut random = fastrand::Rng::with_seed(7);
        let zero: Vec<i32> = (0..TAXELS).map(|_| random.i32(-128..128)).collect();
        let gain: Vec<i32> = (0..TAXELS).map(|_| random.i32(-(1 << 17)..1 << 17)).collect();
        let stimulus: Vec<Vec<Word>> = (0..4000)
            .map(|cycle| {
                let rst = cycle < 2 || random.u16(..300) == 0;
                let [offered, ready] = [(); 2].map(|()| Word::from(random.u8(..8) > 0));
                let last = Word::from(random.u8(..10) == 0);
                let beat = vec![rst.into(), random_word(&mut random, BITS), offered, last, ready];
                [beat, vec![Word::default(); 4]].concat()
            })
            .collect();
        for gain in [None, Some(&gain[..])] {
            let block = Calibrate::of(Some(&zero), gain, TAXELS, BITS, false);
            check(block.kernel.kernel(), &stimulus, &mut Table::new(&zero, gain, BITS));
        }
        // What is written during a reset is used from then on.
        let writes = (0..TAXELS).map(|taxel| {
            let word = (gain[taxel] as u64) << BITS | zero[taxel] as u64 & ((1 << BITS) - 1);
            let rest = [Word::default(); 4];
            let write =
                [Word::from(true), (taxel as u64).into(), Word::from(word & ((1 << (BITS + 18)) - 1)), false.into()];
            [&[Word::from(true)], &rest[..], &write].concat()
        });
        let written: Vec<Vec<Word>> = writes.chain(stimulus).collect();
        let block = Calibrate::of(Some(&[0; TAXELS]), Some(&[0; TAXELS]), TAXELS, BITS, true);
        check(block.kernel.kernel(), &written, &mut Table::new(&zero, Some(&gain), BITS));
        // Until the table is whole every stress is 0.
        let mut incomplete = written.clone();
        incomplete.iter_mut().for_each(|inputs| inputs[8] = true.into());
        check(block.kernel.kernel(), &incomplete, &mut Table::new(&zero, Some(&[0; TAXELS]), BITS));
    }
}
