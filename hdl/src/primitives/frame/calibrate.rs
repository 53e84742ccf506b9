//! Codes to stress: subtracts the zero and multiplies by the gain of each taxel, from a table that a memory file initialises.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::stages::prepare::running_zero::RunningZero;
use dermis_golden::fixed::stages::prepare::{Prepare, GAIN_BITS, GAIN_FRACTION};

use super::arrays::Arrays;
use super::running_zero::{follow, Beat, Followed, RECOVERY};
use crate::block;
use crate::language::{Block, Builder, Contents, Inside, MemoryPort, Net, Type};
use crate::primitives::address::counter::count_bits;
use crate::primitives::stream::beats::Stream;

block! {
    /// ```text
    /// s_axis --> read table, hold code --> difference --> product --> round, saturate --> m_axis
    /// ```
    /// All registers advance together while the output is free: latency 4 cycles with gains, 2 with zeros alone. A
    /// running zero takes its drift off the difference, which takes 2 cycles more. The taxel count restarts at `tlast`, as in `receive`.
    pub struct Calibrate {
        /// Zero of each taxel, array after array.
        zero: Option<Vec<i32>>,
        /// Gain of each taxel, likewise.
        gain: Option<Vec<i32>>,
        running: Option<RunningZero>,
        arrays: Arrays,
        taxels: usize,
        /// Width of a code in bits.
        bits: usize,
        /// The table is written.
        written: bool,
    }
    ports CalibratePorts {
        clock;
        reset;
        /// A taxel's code, `bits` wide, two's complement; valid with `s_axis_tvalid`.
        sink<Stream> s_axis: (*bits, arrays.bits);
        /// A taxel's stress in codes, `bits` wide, two's complement, saturated; above it, where zeros run, whether one is at its
        /// limit. Valid with `m_axis_tvalid`.
        source<Stream> m_axis: (bits + usize::from(running.is_some()), arrays.bits);
        /// Writes `write_entry` to taxel `write_taxel`, where tables are writable; while no frame is under way.
        in write;
        /// Array of the taxel; valid with `write`.
        in write_array: if *written { arrays.bits } else { 0 };
        /// Index of the taxel; valid with `write`.
        in write_taxel: count_bits(*taxels);
        /// Zero in the low bits, gain above; valid with `write`.
        in write_entry: bits + GAIN_BITS as usize;
        /// Of several arrays that whose stress is held to 0 with `incomplete`.
        out incomplete_array: if *written { arrays.bits } else { 0 };
        /// Every stress is 0, where tables are writable: they are not whole.
        in incomplete;
        /// Of several arrays those whose running zeros begin anew, a bit each; only while no frame is under way.
        in anew: arrays.anew_bits(*written);
    }
}

/// File of the table, one line per taxel: zero in the low bits, gain above. Of several arrays each begins at a power of two.
const CALIBRATION_FILE: &str = "calibration.hex";

impl Calibrate {
    /// Calibrates codes of `bits` bits of `taxels` taxels of each of the `arrays` with the tables of `prepare`, which are `written`
    /// or not; `None` where they have no zero.
    pub fn new(prepare: &Prepare, taxels: usize, bits: usize, written: bool, arrays: Arrays) -> Option<Self> {
        let Prepare { zero, gain, running, .. } = prepare.clone();
        let calibrates = zero.is_some() || running.is_some();
        calibrates.then_some(Calibrate { zero, gain, running, arrays, taxels, bits, written })
    }

    /// Width of a gain in the table.
    fn gain_bits(&self) -> usize {
        self.gain.as_ref().map_or(0, |_| GAIN_BITS as usize)
    }

    /// The memory of the table; none without a zero.
    fn entries<'k>(&self, k: &'k Builder, io: &CalibratePorts<Inside<'k>>) -> Option<MemoryPort<'k>> {
        let (zero, bits, gain_bits) = (self.zero.as_ref()?, self.bits, self.gain_bits());
        let word = |index: usize| {
            let gain = self.gain.as_ref().map_or(0, |gain| gain[index] as u64 & ((1 << gain_bits) - 1));
            vec![gain << bits | zero[index] as u64 & ((1 << bits) - 1)]
        };
        // Between the last taxel of an array and the first of the next nothing is read.
        let filled = |place: usize| match place % (1 << count_bits(self.taxels)) {
            taxel if taxel < self.taxels => word((place >> count_bits(self.taxels)) * self.taxels + taxel),
            _ => vec![0],
        };
        let places = self.arrays.places(self.taxels);
        let words = (0..places).map(filled).collect();
        let contents = Contents::File { name: CALIBRATION_FILE.to_owned(), words };
        let entries = k.memory("entries", places, bits + gain_bits, contents).holds(Holds::Calibration);
        if !self.written {
            return Some(entries);
        }
        // What is read while it is written is of no frame.
        let entries = entries.unchecked();
        let place = match self.arrays.bits {
            0 => io.write_taxel,
            _ => k.wire("write_place", io.write_array.concat(io.write_taxel)),
        };
        entries.write(io.write, place, io.write_entry);
        Some(entries)
    }

    fn calibrated<'k>(&self, k: &'k Builder, io: CalibratePorts<Inside<'k>>) {
        let (bits, gain_bits, rst, tlast) = (self.bits, self.gain_bits(), io.rst, io.s_axis.last);
        let entries = self.entries(k, &io);
        let steps = 2 + if self.gain.is_some() { 2 } else { 0 } + if self.running.is_some() { 2 } else { 0 };
        let taxel = k.state("taxel", Type::unsigned(io.write_taxel.bits()), rst, 0);
        let place = self.arrays.place(k, io.s_axis.array, *taxel);
        let entry = entries.map(|entries| {
            let entry = k.register("entry", Type::unsigned(bits + gain_bits));
            (entry, entries)
        });
        let code = k.register("code", Type::signed(bits));
        let valids = k.state("valids", Type::unsigned(steps), rst, 0);
        let lasts = k.register("lasts", Type::unsigned(steps));
        let moves = k.wire("moves", !valids.top() | io.m_axis.ready);
        let running = self.running.as_ref().map(|zero| {
            let waits = k.state("waits", Type::unsigned(RECOVERY), rst, 0).comment("After an early `tlast`.");
            let end = k.wire("at_end", taxel.is(self.taxels as u64 - 1));
            (zero, waits, end)
        });
        let takes = running.map_or(moves, |(_, waits, _)| k.wire("takes", moves & !waits.any()));
        let offered = running.map_or(io.s_axis.valid, |(_, waits, _)| io.s_axis.valid & !waits.any());
        io.s_axis.ready.set(takes & !rst);
        io.m_axis.valid.set(valids.top());
        io.m_axis.last.set(lasts.top());

        let difference = match &entry {
            None => *code,
            Some((entry, _)) => k.wire("difference", *code - entry.low(bits).signed()),
        };
        let of_entry = |(entry, _): &(Net<'k>, MemoryPort<'k>)| entry.slice(bits, gain_bits).signed();
        let factor = entry.as_ref().filter(|_| self.gain.is_some()).map(of_entry);
        let followed = running.map(|(zero, waits, end)| {
            let early = k.wire("early", tlast & !end);
            k.when(moves, || waits.set(waits.low(RECOVERY - 1).concat(offered & early)));
            let (taxel, off, gain, valid) = (*taxel, difference, factor, valids.at(2));
            let beat = Beat { rst, moves, offered, taxel, place, end, early, off, gain, valid };
            follow(k, zero, self.arrays, self.arrays.resets(rst, io.anew, self.written), self.taxels, beat)
        });
        let (difference, factor, limited) = match followed {
            None => (difference, factor, None),
            Some(Followed { difference, gain, limited }) => (difference, gain, Some(limited)),
        };
        let (result, limited) = match factor {
            None => (difference, limited),
            Some(factor) => {
                let held = k.register("held", difference.ty());
                let held_gain = k.register("held_gain", Type::signed(gain_bits));
                let dropped = GAIN_FRACTION as usize - 1;
                let product = k.register("product", Type::signed(difference.bits() + gain_bits - dropped));
                k.when(moves, || {
                    held.set(difference);
                    held_gain.set(factor);
                    product.set((*held * *held_gain).shift_right(dropped));
                });
                let limited = limited.map(|limited| {
                    let limits = k.register("limits", Type::unsigned(2));
                    k.when(moves, || limits.set(limits.low(1).concat(limited)));
                    limits.top()
                });
                (k.wire("rounded", product.round_shift(1)), limited)
            }
        };
        let sign = k.wire("sign", result.slice(bits - 1, result.bits() - bits + 1));
        let clipped = k.wire("clipped", sign.differs(sign.top().repeat(sign.bits())));
        let limit = sign.top().concat((!sign.top()).repeat(bits - 1));
        let stress = io.m_axis.data.register();
        k.when(moves, || {
            valids.set(valids.low(steps - 1).concat(offered));
            let after = tlast | taxel.is(self.taxels as u64 - 1);
            k.when(offered, || taxel.set(after.mux(k.constant(taxel.bits(), 0), taxel.plus(1))));
            lasts.set(lasts.low(steps - 1).concat(tlast));
            if let Some((entry, entries)) = &entry {
                entry.set(entries.read(place));
            }
            code.set(io.s_axis.data.signed());
            let calibrated = clipped.mux(limit, result.low(bits));
            let calibrated = limited.map_or(calibrated, |limited| limited.concat(calibrated));
            stress.set(match self.written {
                true => io.incomplete.mux(k.constant(calibrated.bits(), 0), calibrated),
                false => calibrated,
            });
        });
        let array_bits = self.arrays.bits;
        if array_bits > 0 {
            let arrays =
                k.register("arrays", Type::unsigned(steps * array_bits)).comment("Of the beats in the registers.");
            k.when(moves, || arrays.set(arrays.low((steps - 1) * array_bits).concat(io.s_axis.array)));
            io.m_axis.array.set(arrays.slice((steps - 1) * array_bits, array_bits));
            if self.written {
                io.incomplete_array.set(arrays.slice((steps - 2) * array_bits, array_bits));
            }
        }
    }
}

impl Block for Calibrate {
    fn build<'k>(&self, k: &'k Builder, io: CalibratePorts<Inside<'k>>) {
        self.calibrated(k, io);
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use std::collections::VecDeque;

    use dermis_golden::fixed::words::arith::{round_shift, saturate};

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_word, Reference};
    use crate::wire::Word;

    /// Drifts and steps of the taxels, and what the frames so far have shown.
    struct Drift {
        zero: RunningZero,
        moved: Vec<i64>,
        steps: Vec<i64>,
        rests: bool,
        pressed: bool,
        /// A zero at its limit: in this frame, in the one before.
        limited: [bool; 2],
    }

    impl Drift {
        fn new(zero: &RunningZero, taxels: usize) -> Self {
            let [moved, steps] = [(); 2].map(|()| vec![0; taxels]);
            Drift { zero: zero.clone(), moved, steps, rests: false, pressed: false, limited: [false; 2] }
        }

        /// What is left of a difference, the last one of its frame or not, and what goes with it.
        fn follow(&mut self, taxel: usize, off: i64, gain: Option<i64>, [end, early]: [bool; 2]) -> (i64, bool) {
            let (limit, unit) = (i64::from(self.zero.limit), 1 << self.zero.average);
            let step = if self.rests { self.steps[taxel] } else { 0 };
            let moved = (self.moved[taxel] + step).min(limit * unit).max(-limit * unit);
            let rest = off - (2 * moved + unit).div_euclid(2 * unit);
            let dead = self.zero.dead.contains(&taxel) || gain == Some(0);
            let load = |off: i64| if gain.is_some_and(|gain| gain < 0) { -off } else { off };
            self.moved[taxel] = moved;
            self.steps[taxel] = if dead { 0 } else { rest.min(limit).max(-limit) };
            self.pressed |= !dead && load(off) > limit && load(rest) > limit;
            self.limited[0] |= moved.abs() == limit * unit;
            let limited = self.limited[1];
            if end || early {
                self.rests = end && !self.pressed;
                self.limited = [false, if end { self.limited[0] } else { limited }];
                self.pressed = false;
            }
            (rest, limited)
        }
    }

    /// The arithmetic in integers, and the beats in the block.
    pub(crate) struct Table {
        bits: usize,
        zero: Vec<i32>,
        gain: Option<Vec<i32>>,
        drift: Option<Drift>,
        /// Cycles in which no beat is taken.
        waits: usize,
        taxel: usize,
        pipe: VecDeque<Option<(i64, bool)>>,
        reset: bool,
    }

    impl Table {
        /// For codes of `bits` bits.
        pub(crate) fn new(zero: &[i32], gain: Option<&[i32]>, bits: usize) -> Self {
            let pipe = vec![None; if gain.is_some() { 4 } else { 2 }].into();
            let (zero, gain) = (zero.to_vec(), gain.map(<[i32]>::to_vec));
            Table { bits, zero, gain, drift: None, waits: 0, taxel: 0, pipe, reset: false }
        }

        /// With zeros that run.
        fn running(self, zero: &RunningZero) -> Self {
            let pipe = [vec![None; 2], self.pipe.into()].concat().into();
            Table { drift: Some(Drift::new(zero, self.zero.len())), pipe, ..self }
        }
    }

    impl Reference for Table {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let [rst, ready] = [0, 4].map(|k| inputs[k].number() == 1);
            let leaving = self.pipe[0];
            let bit = |bit: bool| self.reset.then(|| Word::from(bit));
            vec![
                bit((leaving.is_none() || ready) && !rst && self.waits == 0),
                bit(leaving.is_some()),
                leaving.map(|(_, last)| Word::from(last)),
                leaving.map(|(stress, _)| Word::of_fields(&[stress], self.bits + usize::from(self.drift.is_some()))),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, valid, last, ready] = [0, 2, 3, 4].map(|k| inputs[k].number() == 1);
            let before = self.taxel;
            if self.pipe[0].is_none() || ready {
                let taken = (valid && self.waits == 0).then(|| {
                    let difference = inputs[1].signed(0, self.bits) - i64::from(self.zero[self.taxel]);
                    let gain = self.gain.as_ref().map(|gain| i64::from(gain[self.taxel]));
                    let end = self.taxel + 1 == self.zero.len();
                    let followed = self
                        .drift
                        .as_mut()
                        .map(|drift| drift.follow(self.taxel, difference, gain, [end, last && !end]));
                    let (difference, limited) = followed.unwrap_or((difference, false));
                    let stress = gain.map_or(difference, |gain| round_shift(difference * gain, GAIN_FRACTION));
                    self.taxel = if last || end { 0 } else { self.taxel + 1 };
                    let stress = saturate(stress, self.bits as u32).0;
                    // The bit above an unsigned word.
                    let above = i64::from(limited) << self.bits;
                    (if self.drift.is_some() { above | (stress & ((1 << self.bits) - 1)) } else { stress }, last)
                });
                let early =
                    last && taken.is_some() && self.drift.is_some() && self.taxel == 0 && before + 1 < self.zero.len();
                self.waits = if early { 3 } else { self.waits.saturating_sub(1) };
                self.pipe.push_back(taken);
                self.pipe.pop_front();
            }
            if rst {
                self.pipe.iter_mut().for_each(|beat| *beat = None);
                self.drift = self.drift.take().map(|drift| Drift::new(&drift.zero, self.zero.len()));
                (self.taxel, self.waits, self.reset) = (0, 0, true);
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
        let calibrate = |zero: &[i32], gain: Option<&[i32]>, written| Calibrate {
            zero: Some(zero.to_vec()),
            gain: gain.map(<[i32]>::to_vec),
            running: None,
            arrays: Arrays::default(),
            taxels: TAXELS,
            bits: BITS,
            written,
        };
        for gain in [None, Some(&gain[..])] {
            check(&kernel_of(&calibrate(&zero, gain, false)), &stimulus, &mut Table::new(&zero, gain, BITS));
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
        let kernel = kernel_of(&calibrate(&[0; TAXELS], Some(&[0; TAXELS]), true));
        check(&kernel, &written, &mut Table::new(&zero, Some(&gain), BITS));
        // Until the table is whole every stress is 0.
        let mut incomplete = written.clone();
        incomplete.iter_mut().for_each(|inputs| inputs[8] = true.into());
        check(&kernel, &incomplete, &mut Table::new(&zero, Some(&[0; TAXELS]), BITS));
    }

    /// Codes that drift, presses, stalls, resets, early and missing `tlast`; of the fewest taxels too, back to back.
    #[test]
    fn zeros_follow_the_codes_of_frames_without_a_press() {
        const BITS: usize = 9;
        for (taxels, [with_zero, with_gain], dead) in [
            (4, [true, false], vec![]),
            (4, [true, true], vec![]),
            (7, [true, true], vec![2, 5]),
            (6, [false, false], vec![1]),
        ] {
            let mut random = fastrand::Rng::with_seed(11);
            let zero: Vec<i32> = (0..taxels).map(|_| if with_zero { random.i32(-60..60) } else { 0 }).collect();
            let gain: Vec<i32> = (0..taxels).map(|taxel| [1 << 16, -(1 << 16), 0, 40_000][taxel % 4]).collect();
            let gain = with_gain.then_some(&gain[..]);
            let running = RunningZero { average: 3, limit: 20, dead };
            let (mut taxel, mut level, mut frames) = (0, 0, [0; 3]);
            let mut reference = Table::new(&zero, gain, BITS).running(&running);
            let stimulus: Vec<Vec<Word>> = (0..9000)
                .map(|cycle| {
                    let rst = cycle < 2 || random.u16(..1500) == 0;
                    // Half of the time at full speed.
                    let stalls = cycle / 500 % 2 == 0;
                    let [offered, ready] = [(); 2].map(|()| !stalls || random.u8(..8) > 0);
                    let last = if random.u8(..60) == 0 { random.bool() } else { taxel + 1 == taxels };
                    if taxel == 0 {
                        // Frames at rest, pressed, pulled; the level changes slowly.
                        level = [0, 0, 0, 120, -100][random.usize(..5)] * i32::from(random.bool());
                    }
                    let drift = (cycle / 300 * 7 + taxel as i32 * 5) % 55 - 27;
                    let code = (zero[taxel] + drift + level + random.i32(-2..=2)).clamp(-256, 255);
                    let data = Word::of_fields(&[code.into()], BITS);
                    let beat = vec![rst.into(), data, offered.into(), last.into(), ready.into()];
                    let inputs = [beat, vec![Word::default(); 4]].concat();
                    let accepts = reference.outputs(&inputs)[0] == Some(true.into());
                    reference.clock(&inputs);
                    taxel = reference.taxel;
                    if let Some(drift) = reference.drift.as_ref().filter(|_| accepts && offered && taxel == 0) {
                        frames[0] += usize::from(drift.rests);
                        frames[1] += usize::from(!drift.rests);
                        frames[2] += usize::from(drift.limited[1]);
                    }
                    inputs
                })
                .collect();
            assert!(frames.iter().all(|count| *count > 50), "{frames:?}");
            let table = Table::new(&zero, gain, BITS).running(&running);
            let block = Calibrate {
                zero: with_zero.then_some(zero),
                gain: gain.map(<[i32]>::to_vec),
                running: Some(running),
                arrays: Arrays::default(),
                taxels,
                bits: BITS,
                written: false,
            };
            check(&kernel_of(&block), &stimulus, &mut { table });
        }
    }
}
