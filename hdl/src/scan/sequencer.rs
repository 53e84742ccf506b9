//! Sequencer of a scan: rows, settling times, channels and samples as frames on the converters' serial bus.

use dermis_golden::fixed::plan::resources::count_bits;
use dermis_golden::spec::adc::timing::Timing;

use super::ScanParams;
use crate::block;
use crate::language::{Block, Builder, Expr, Inside, Type};

block! {
    /// Every period it scans the array: row by row, of a row channel by channel, of a channel sample by sample, as
    /// [`Timing`] says. The first frame of a row chooses channel 0, and its result is none.
    ///
    /// A scan begins while `room`, a frame while `clear`: where the engine holds codes up, the scan waits, and no code
    /// is lost. A scan that is due while the one before still runs follows it at once.
    ///
    /// `take` and `done` are one cycle after the edge of the pin: the input registers of `scan_capture` have the sample
    /// then. What belongs to `done` is held until the next.
    pub struct ScanSequencer {
        params: ScanParams,
    }
    ports ScanSequencerPorts {
        clock;
        /// Synchronous reset, active high; the first scan follows it.
        in rst;
        /// No code waits for the engine.
        in clear;
        /// There is room for the flags of one more scan.
        in room;
        /// Address of the row that is driven, unsigned; pins of the array.
        out row: count_bits(params.rows);
        /// Serial clock; pin of all converters.
        out sclk;
        /// Chip select, active low; pin of all converters.
        out cs_n;
        /// Commands, most significant bit first; pin of all converters.
        out mosi;
        /// The converters' outputs were sampled one cycle ago.
        out take;
        /// A frame ended one cycle ago.
        out done;
        /// The frame has a result; valid with `done`, as what follows.
        out result;
        /// It is the first sample of its channel.
        out opens;
        /// It is the last sample of its channel.
        out closes;
        /// It is in the last channel of the last row.
        out ends;
        /// Its channel, unsigned; valid with `done`.
        out channel: count_bits(params.scan.channels);
        /// For each converter whether its taxel is not dead; valid with `done`.
        out alive: params.scan.converters;
    }
}

impl ScanSequencer {
    /// For the scan of `params`.
    pub fn new(params: &ScanParams) -> Self {
        ScanSequencer { params: params.clone() }
    }
}

/// For each converter whether its taxel in this row and channel is not dead.
fn alive<'k>(k: &'k Builder, params: &ScanParams, row: Expr<'k>, channel: Expr<'k>) -> Expr<'k> {
    let ScanParams { scan, rows, dead, .. } = params;
    let count = scan.converters;
    let mask = |place: usize| {
        let (at, own) = (place >> channel.bits(), place & ((1 << channel.bits()) - 1));
        let is_dead =
            |k: &usize| at < *rows && own < scan.channels && dead.contains(&((at * scan.channels + own) * count + k));
        (0..count).filter(|k| !is_dead(k)).fold(0, |mask, k| mask | 1u64 << k)
    };
    if dead.is_empty() {
        return k.constant(count, (1 << count) - 1);
    }
    let place = row.concat(channel);
    let masks: Vec<u64> = (0..1usize << place.bits()).map(mask).collect();
    place.table(count, &masks)
}

impl Block for ScanSequencer {
    fn build<'k>(&self, k: &'k Builder, io: ScanSequencerPorts<Inside<'k>>) {
        let ScanParams { scan, timing, rows, dead, .. } = &self.params;
        let Timing { half, gap, channel_gap, row_gap, period, .. } = *timing;
        let converter = &scan.converter;
        let steps = 2 * u64::from(converter.frame_bits);
        let bits = |limit: u64| count_bits(limit as usize);
        let (one, zero) = (k.constant(1, 1), k.constant(1, 0));
        let state = |name: &str, bits: usize, value: u64| k.state(name, Type::unsigned(bits), io.rst, value);

        let (timer, due) = (state("timer", bits(period), 0), state("due", 1, 1));
        let running = state("running", 1, 0).comment("A scan is under way.");
        let rest =
            state("rest", bits(row_gap.max(channel_gap)), 0).comment("Cycles with CS high that are left, less one.");
        let active = state("active", 1, 0).comment("A frame is under way: CS is low.");
        let slot = state("slot", bits(half), half - 1).comment("Cycles of the half period that are left, less one.");
        let step = state("step", bits(steps + 1), 0).comment("Half periods of the frame so far.");
        let clocked = state("clocked", 1, 0).comment("SCLK is not at its idle level.");
        let command = state("command", converter.frame_bits as usize, 0);
        let primed = state("primed", 1, 0).comment("Channel 0 of the row has been chosen.");
        let row = io.row.state(io.rst, 0);
        let asked = state("asked", count_bits(scan.channels), 0).comment("Channel that the frame converts.");
        let sample = state("sample", count_bits(scan.samples()), 0);

        let wraps = k.wire("wraps", timer.is(period - 1));
        let start = k.wire("start", *due & !*running & io.room);
        let begins = k.wire("begins", *running & !*active & rest.is(0) & io.clear);
        let slot_ends = k.wire("slot_ends", slot.is(0));
        let advance = k.wire("advance", *active & slot_ends);
        let last_step = k.wire("last_step", step.is(steps));
        let leaves = k.wire("leaves", advance & last_step);
        let last_sample = k.wire("last_sample", sample.is(scan.samples() as u64 - 1));
        let last_channel = k.wire("last_channel", asked.is(scan.channels as u64 - 1));
        let last_row = k.wire("last_row", row.is(*rows as u64 - 1));
        let row_ends = k.wire("row_ends", *primed & last_sample & last_channel);
        let following = last_channel.mux(k.constant(asked.bits(), 0), asked.plus(1));
        let next = k.wire("next", (*primed & last_sample).mux(following, *asked));

        timer.set(wraps.mux(k.constant(timer.bits(), 0), timer.plus(1)));
        due.set(wraps | (*due & !start));
        let cycles = |number: u64| k.constant(rest.bits(), number - 1);
        k.when(*running & !*active & rest.any(), || rest.set(rest.minus(1)));
        k.when(start, || {
            running.set(one);
            rest.set(cycles(gap));
        });
        k.when(begins, || {
            active.set(one);
            let shift = converter.channel_shift as usize;
            let width = converter.frame_bits as usize;
            let choice = next.extend(width - shift).shift_left(shift);
            command.set(k.constant(width, u64::from(converter.command)) | choice);
        });
        k.when(*active, || slot.set(slot_ends.mux(k.constant(slot.bits(), half - 1), slot.minus(1))));
        k.when(advance, || {
            step.set(last_step.mux(k.constant(step.bits(), 0), step.plus(1)));
            clocked.set(!*clocked & !last_step);
        });
        k.when(advance & !*clocked & step.any(), || command.set(command.shift_left(1).low(command.bits())));
        k.when(leaves, || {
            active.set(zero);
            primed.set(!row_ends);
            let sampled = (last_sample & !last_channel).mux(cycles(channel_gap), cycles(gap));
            rest.set(primed.mux(sampled, cycles(row_gap)));
            k.when(*primed, || {
                sample.set(last_sample.mux(k.constant(sample.bits(), 0), sample.plus(1)));
                asked.set(next);
            });
            k.when(row_ends, || {
                row.set(last_row.mux(k.constant(row.bits(), 0), row.plus(1)));
                running.set(!last_row);
            });
        });

        io.sclk.set(if converter.idle_high { !*clocked } else { *clocked });
        io.cs_n.set(!*active);
        io.mosi.set(command.top());
        let [take, done] = [io.take, io.done].map(|output| output.state(io.rst, 0));
        take.set(advance & *clocked);
        done.set(leaves);
        let [result, opens, closes, ends] = [io.result, io.opens, io.closes, io.ends].map(|output| output.register());
        let channel = io.channel.register();
        k.when(leaves, || {
            result.set(*primed);
            opens.set(sample.is(0));
            closes.set(last_sample);
            ends.set(last_channel & last_row);
            channel.set(*asked);
        });
        let mask = alive(k, &self.params, *row, *asked);
        if dead.is_empty() {
            io.alive.set(mask);
        } else {
            let held = io.alive.register();
            k.when(leaves, || held.set(mask));
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::language::testbench::{check, check_with_defects, subject_of, Reference, Subject};
    use crate::language::Change;
    use crate::wire::Word;
    use dermis_golden::spec::adc::{AdcScan, CONVERTERS};

    /// A small scan at 100 MHz.
    pub fn params(converter: usize, converters: usize, average: u32, dead: &[usize]) -> ScanParams {
        let scan = AdcScan {
            converter: CONVERTERS[converter],
            converters,
            channels: 3,
            sclk_MHz: 14.0,
            row_settling_us: 3.0,
            channel_settling_us: 0.3,
            average,
            period_us: if average > 1 { 250.0 } else { 60.0 },
        };
        let timing = Timing::new(&scan, 2, 100.0).unwrap();
        ScanParams { scan, timing, rows: 2, code_bits: 17, dead: dead.to_vec() }
    }

    /// What belongs to the end of a frame: `result` to `alive`.
    type ConversionEnd = [u64; 6];
    /// Row, CS low, SCLK away from idle, MOSI where it is defined; for the end of a frame what belongs to it.
    type Pins = (u64, bool, bool, Option<u64>, Option<ConversionEnd>);

    /// The pins of a scan, cycle by cycle, written down as the documentation of [`Timing`] says.
    struct Schedule {
        params: ScanParams,
        pins: Vec<Pins>,
        at: Option<usize>,
        ended: Vec<Option<ConversionEnd>>,
        took: bool,
    }

    impl Schedule {
        fn new(params: &ScanParams) -> Self {
            let ScanParams { scan, timing, rows, .. } = params;
            let converter = &scan.converter;
            let mut pins = vec![(0, false, false, None, None)];
            for row in 0..*rows as u64 {
                let all =
                    (0..scan.channels).flat_map(|channel| (0..scan.samples()).map(move |sample| (channel, sample)));
                let all: Vec<(usize, usize)> = all.collect();
                for frame in 0..=all.len() {
                    let wait = match frame {
                        0 => timing.gap,
                        1 => timing.row_gap,
                        _ if all[frame - 1].1 == 0 => timing.channel_gap,
                        _ => timing.gap,
                    };
                    pins.extend(vec![(row, false, false, None, None); wait as usize]);
                    let next = all.get(frame).map_or(0, |(channel, _)| *channel);
                    let command = converter.command_of(next);
                    for step in 0..=2 * converter.frame_bits {
                        let at = converter.frame_bits - 1 - (step.max(1) - 1).min(2 * converter.frame_bits - 1) / 2;
                        let level = u64::from(command >> at & 1);
                        pins.extend(vec![(row, true, step % 2 == 1, Some(level), None); timing.half as usize]);
                    }
                    let (channel, sample) = all[frame.max(1) - 1];
                    let closes = sample + 1 == scan.samples();
                    let ends = row + 1 == *rows as u64 && channel + 1 == scan.channels;
                    let first = (row as usize * scan.channels + channel) * scan.converters;
                    let alive = (0..scan.converters).filter(|k| !params.dead.contains(&(first + k)));
                    let alive = alive.fold(0, |mask, k| mask | 1 << k);
                    let of = [frame > 0, sample == 0, closes, ends].map(u64::from);
                    pins.last_mut().unwrap().4 = Some([of[0], of[1], of[2], of[3], channel as u64, alive]);
                }
            }
            assert_eq!(pins.len() as u64, 1 + timing.scan);
            pins.resize(timing.period as usize, (0, false, false, None, None));
            Schedule { params: params.clone(), pins, at: None, ended: vec![None; 2], took: false }
        }
    }

    impl Reference for Schedule {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let Some(at) = self.at else { return vec![None; 12] };
            let (row, low, clocked, mosi, _) = self.pins[at % self.pins.len()];
            let bit = |bit: bool| Some(Word::from(bit));
            let done = self.ended[0];
            let of = |k: usize| done.filter(|of| k == 0 || of[0] == 1).map(|of| Word::from(of[k]));
            let idle = self.params.scan.converter.idle_high;
            vec![
                Some(Word::from(row)),
                bit(clocked ^ idle),
                bit(!low),
                mosi.map(Word::from),
                bit(self.took),
                bit(done.is_some()),
                of(0),
                of(1),
                of(2),
                of(3),
                of(4),
                of(5),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let Some(at) = self.at else {
                self.at = (inputs[0].number() == 1).then_some(0);
                return;
            };
            let here = self.pins[at % self.pins.len()];
            let next = self.pins[(at + 1) % self.pins.len()];
            self.took = here.2 && !next.2;
            self.ended[0] = here.4;
            self.at = Some(if inputs[0].number() == 1 { 0 } else { at + 1 });
            if inputs[0].number() == 1 {
                (self.took, self.ended[0]) = (false, None);
            }
        }
    }

    fn stimulus(cycles: usize) -> Vec<Vec<Word>> {
        let of = |cycle: usize| vec![Word::from(cycle < 2 || cycle == 1234), true.into(), true.into()];
        (0..cycles).map(of).collect()
    }

    #[test]
    fn pins_are_those_of_the_schedule() {
        for params in [params(0, 2, 1, &[]), params(1, 1, 0, &[4]), params(0, 3, 0, &[1, 17])] {
            check(subject(&params, &[]), &stimulus(14_000), &mut Schedule::new(&params));
        }
    }

    #[test]
    fn seeded_defects_are_found() {
        let params = params(0, 2, 1, &[]);
        let changed = |changes: &[Change]| subject(&params, changes);
        let defects = [
            // A row that stays.
            Change::value("", "row", |k| k.named("row")),
            // Commands for the channel that is being converted.
            Change::value("", "next", |k| k.named("asked")),
            // One edge of SCLK less.
            Change::value("", "last_step", |k| k.named("step").is(30)),
        ];
        check_with_defects(changed, &stimulus(9_000), || Schedule::new(&params), &defects);
    }

    fn subject<'a>(params: &ScanParams, changes: &[Change]) -> Subject<'a> {
        subject_of!(
            ScanSequencer::new(params),
            changes,
            inputs [rst, clear, room],
            outputs [row, sclk, cs_n, mosi, take, done, result, opens, closes, ends, channel, alive],
        )
    }

    #[test]
    fn an_engine_that_is_not_ready_holds_the_scan() {
        let params = params(0, 1, 0, &[]);
        let mut subject = subject(&params, &[]);
        let low = |subject: &mut Subject, clear: bool, room: bool, rst: bool| {
            let outputs = subject.cycle(&[rst, clear, room].map(Word::from));
            outputs[2].number() == 0
        };
        low(&mut subject, true, true, true);
        let all = |clear: bool, room: bool, subject: &mut Subject| {
            (0..4000).filter(|_| low(subject, clear, room, false)).count()
        };
        assert_eq!(all(true, false, &mut subject), 0);
        assert_eq!(all(false, true, &mut subject), 0);
        assert!(all(true, true, &mut subject) > 1000);
    }
}
