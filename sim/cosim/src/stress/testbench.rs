//! Test bench of the stress experiments: a device between sender and receiver, checked in every cycle.

use dermis_golden::fixed::stages::load;
use dermis_golden::fixed::Model;
use dermis_hdl::device::{Device, Inputs};

use super::super::drive::{StabilityCheck, STABILITY_RULE};
use super::handshake_rates::HandshakeRates;
use super::outcome::Outcome;
use super::samples::{Code, Sample};
use super::scoreboard::Scoreboard;

/// Cycles of the reset before an experiment.
pub(crate) const RESET_CYCLES: u64 = 4;
/// Cycles without a transfer after which the device counts as hung, in addition to four times a frame's cycles.
const WATCHDOG: u64 = 20_000;
/// Cycles after the last beat during which no further beat may come.
const QUIET_CYCLES: u64 = 16;

/// A sequence of codes with their `tlast`.
pub(crate) struct Burst {
    sample: usize,
    codes: Vec<(i32, bool)>,
    /// Array of its frames.
    array: usize,
}

impl Burst {
    /// A correct frame.
    pub(crate) fn whole(of: &Sample, sample: usize) -> Burst {
        let end = |index: usize| (index + 1).is_multiple_of(of.taxels);
        let codes = of.codes.iter().enumerate().map(|(index, &code)| (code, end(index))).collect();
        Burst { sample, codes, array: 0 }
    }

    /// The first `count` codes with `tlast` on the last one; one code less where `tlast` would be correct there.
    pub(super) fn cut(of: &Sample, sample: usize, count: usize) -> Burst {
        let count = if count.is_multiple_of(of.taxels) { count - 1 } else { count };
        let mut burst = Burst::whole(of, sample);
        burst.codes.truncate(count);
        burst.codes[count - 1].1 = true;
        burst
    }

    /// A frame without `tlast`.
    pub(super) fn missing(of: &Sample, sample: usize) -> Burst {
        Burst { sample, codes: of.codes.iter().map(|&code| (code, false)).collect(), array: 0 }
    }

    /// `tlast` on the last code and on the one before: two frames cut short.
    pub(super) fn doubled(of: &Sample, sample: usize) -> Burst {
        let mut burst = Burst::whole(of, sample);
        let count = burst.codes.len();
        burst.codes[count - 2].1 = true;
        burst
    }

    /// An image of tables.
    pub(super) fn image(image: &[u8], code_bits: u32) -> Burst {
        let beats = load::beats(image, code_bits);
        let last = beats.len() - 1;
        let codes = beats.into_iter().enumerate().map(|(at, beat)| (beat, at == last)).collect();
        Burst { sample: 0, codes, array: 0 }
    }

    /// The same frames of array `array`.
    pub(super) fn of_array(self, array: usize) -> Burst {
        Burst { array, ..self }
    }

    /// The beat at `at`; where `tid` does not count it is another.
    fn code(&self, at: usize, counts: bool) -> Code {
        let (data, last) = self.codes[at];
        Code { data, last, array: if counts { self.array } else { self.array + at } }
    }

    /// Without `tlast` at the end.
    pub(super) fn without_end(mut self) -> Burst {
        self.codes.iter_mut().for_each(|(_, last)| *last = false);
        self
    }

    /// `other` before the beat `at`.
    pub(super) fn with(mut self, at: usize, other: Burst) -> Burst {
        self.codes.splice(at..at, other.codes);
        self
    }

    /// `tlast` one beat late: a frame without `tlast`, and one cut after a single code.
    pub(super) fn late(of: &Sample, sample: usize) -> Burst {
        let mut burst = Burst::missing(of, sample);
        burst.codes.push((of.codes[0], true));
        burst
    }
}

/// A device with a sender, a receiver and a scoreboard that checks every transfer.
pub(crate) struct Testbench<'a> {
    device: &'a mut dyn Device,
    samples: &'a [Sample],
    scoreboard: Scoreboard<'a>,
    cycle: u64,
    /// Cycles since the last transfer.
    idle: u64,
    watchdog: u64,
    stability: StabilityCheck,
    hung: bool,
}

impl<'a> Testbench<'a> {
    /// With the model of each array of the device.
    pub(crate) fn new(device: &'a mut dyn Device, models: &'a [Model], samples: &'a [Sample]) -> Self {
        let longest = samples.iter().map(|sample| sample.cycles.total).max().unwrap_or(0);
        let scoreboard = Scoreboard::new(models, samples);
        let watchdog = WATCHDOG + 4 * longest;
        Testbench {
            device,
            samples,
            scoreboard,
            cycle: 0,
            idle: 0,
            watchdog,
            stability: StabilityCheck::default(),
            hung: false,
        }
    }

    pub(super) fn sample_count(&self) -> usize {
        self.samples.len()
    }

    pub(super) fn sample(&self, index: usize) -> &'a Sample {
        &self.samples[index]
    }

    /// Number of arrays.
    pub(super) fn arrays(&self) -> usize {
        self.scoreboard.arrays()
    }

    /// A correct frame of any sample and any array.
    pub(super) fn any(&self, random: &mut fastrand::Rng) -> Burst {
        let sample = random.usize(..self.sample_count());
        Burst::whole(self.sample(sample), sample).of_array(random.usize(..self.arrays()))
    }

    pub(crate) fn cycle(&self) -> u64 {
        self.cycle
    }

    /// Whether the experiment can continue: the device is not hung, and the limit of violations is not reached.
    pub(super) fn can_continue(&self) -> bool {
        !self.hung && !self.scoreboard.is_over_limit()
    }

    pub(super) fn finish(self) -> Outcome {
        Outcome { cycles: self.cycle, ..self.scoreboard.outcome }
    }

    pub(super) fn outcome(&mut self) -> &mut Outcome {
        &mut self.scoreboard.outcome
    }

    /// Sends a burst, unless the device is hung.
    pub(crate) fn send(&mut self, burst: &Burst, rates: &mut HandshakeRates) {
        self.offer(burst, rates, false);
    }

    /// Sends a frame at full speed after all earlier ones have left, and waits until it has left; the cycles of its
    /// beats are checked.
    pub(crate) fn send_alone(&mut self, burst: &Burst) {
        let mut rates = HandshakeRates::full_speed();
        self.drain(&mut rates);
        self.offer(burst, &mut rates, true);
        self.drain(&mut rates);
    }

    fn offer(&mut self, burst: &Burst, rates: &mut HandshakeRates, alone: bool) {
        for at in 0..burst.codes.len() {
            let code = burst.code(at, self.scoreboard.names_array());
            // AXI4-Stream: once valid, a beat stays until it is accepted.
            let mut offering = false;
            loop {
                offering |= rates.sends();
                if self.step(offering.then_some(code), rates.receives()) {
                    self.scoreboard.accepted(self.cycle - 1, burst.sample, code, alone);
                    break;
                }
                if !self.can_continue() {
                    return;
                }
            }
        }
    }

    /// Sends a burst at full speed up to cycle `end`; whether the whole burst was accepted.
    pub(super) fn send_until(&mut self, burst: &Burst, end: u64) -> bool {
        let alone = self.scoreboard.is_empty();
        for at in 0..burst.codes.len() {
            let code = burst.code(at, self.scoreboard.names_array());
            while self.cycle == end || !self.step(Some(code), true) {
                if self.cycle >= end || !self.can_continue() {
                    return false;
                }
            }
            self.scoreboard.accepted(self.cycle - 1, burst.sample, code, alone);
        }
        true
    }

    /// Waits until all expected beats have left, then checks that no further beat comes.
    pub(crate) fn drain(&mut self, rates: &mut HandshakeRates) {
        while self.can_continue() && !self.scoreboard.is_empty() {
            self.step(None, rates.receives());
        }
        for _ in 0..QUIET_CYCLES {
            self.step(None, true);
        }
    }

    /// Holds the reset for `cycles`, with random inputs.
    pub(crate) fn reset(&mut self, cycles: u64, random: &mut fastrand::Rng) {
        self.scoreboard.reset();
        for held in 0..cycles {
            let (s_valid, m_ready, s_data) = (random.bool(), random.bool(), random.i32(..));
            let inputs = Inputs { rst: true, s_valid, s_data, s_array: 0, s_last: random.bool(), m_ready };
            let outputs = self.device.cycle(&inputs);
            if outputs.s_ready {
                self.scoreboard.violate(self.cycle, "s_axis_tready is high during reset".to_owned());
            }
            // In the first cycle the registers still hold their old values.
            if outputs.m_valid && held > 0 {
                self.scoreboard.violate(self.cycle, "m_axis_tvalid is high during reset".to_owned());
            }
            self.cycle += 1;
        }
        (self.stability, self.idle) = (StabilityCheck::default(), 0);
    }

    /// Simulates one cycle; whether the offered code was accepted.
    fn step(&mut self, offer: Option<Code>, m_ready: bool) -> bool {
        let Code { data: s_data, last: s_last, array } = offer.unwrap_or_default();
        let (s_valid, s_array) = (offer.is_some(), array % self.scoreboard.arrays());
        let outputs = self.device.cycle(&Inputs { rst: false, s_valid, s_data, s_array, s_last, m_ready });
        let (transferred, stable) = self.stability.observe(&outputs, m_ready);
        if !stable {
            self.scoreboard.violate(self.cycle, STABILITY_RULE.to_owned());
        }
        if let Some((data, last, array)) = transferred {
            self.scoreboard.delivered(self.cycle, data, last, array);
        }
        let accepted = offer.is_some() && outputs.s_ready;
        let stalled = (offer.is_none() && outputs.s_ready) || self.stability.is_pending();
        self.scoreboard.outcome.stalled += u64::from(stalled);
        let active = accepted || transferred.is_some();
        self.idle = if active { 0 } else { self.idle + 1 };
        if self.idle == self.watchdog && (offer.is_some() || !self.scoreboard.is_empty()) {
            self.scoreboard.violate(self.cycle, format!("no transfer for {} cycles", self.watchdog));
            self.hung = true;
        }
        self.cycle += 1;
        accepted
    }
}
