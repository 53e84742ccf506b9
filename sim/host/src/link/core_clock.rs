//! The clock of a core beside the host's: when a cycle was, and how well that is known.
//!
//! A request is sent at a, answered at b, and the answer has the core's cycle c between: cycle c was in [a, b]. From one answer to
//! the next the interval widens by what two oscillators can differ, [`DRIFT`], and is cut with the new one. So nothing is assumed of
//! how long packets take in each direction.
//!
//! | | | |
//! |---|---|---|
//! | in: times of request and answer, cycle | ns since 1970, cycles since the core's reset | |
//! | out: time of a cycle, its error | ns | half of the interval |

use std::time::{Instant, SystemTime};

use crate::stream::nanoseconds;

/// Largest difference of two oscillators, as a share of their rates: each within 100 ppm.
const DRIFT: f64 = 200e-6;

/// When a frame entered a core.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Acquired {
    /// Cycle of the core's clock since its reset.
    pub cycles: u64,
    /// Time in ns since 1970.
    pub time_ns: i64,
    /// The time differs from the true one by at most so many ns.
    pub error_ns: u64,
}

/// The host's clock, which no correction of the system's sets back.
#[derive(Clone, Copy, Debug)]
pub(super) struct HostClock {
    base: Instant,
    base_ns: i64,
}

impl HostClock {
    /// The system's time from now on.
    pub(super) fn new() -> Self {
        HostClock { base: Instant::now(), base_ns: nanoseconds(SystemTime::now()) }
    }

    /// ns since 1970.
    pub(super) fn now_ns(&self) -> i64 {
        self.base_ns + i64::try_from(self.base.elapsed().as_nanos()).unwrap_or(i64::MAX / 2)
    }
}

/// A cycle of the core, and the interval in which it was.
#[derive(Clone, Copy, Debug)]
struct Known {
    cycles: u64,
    /// Its middle, ns since 1970.
    middle_ns: i64,
    /// Half of its length.
    half_ns: f64,
}

/// How far the core's rate is from the one that it states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// Positive where the core is fast.
    pub ppm: f64,
    /// It differs from the true one by at most so much.
    pub error_ppm: f64,
}

/// The clock of a core.
#[derive(Clone, Debug)]
pub struct CoreClock {
    ns_per_cycle: f64,
    first: Option<Known>,
    last: Option<Known>,
    /// Answers after which the core's clock could not be the one of before: the core was reset, or a clock is wrong.
    pub restarts: u64,
}

impl CoreClock {
    /// A core with a clock of so many Hz.
    pub fn new(clock_hz: u32) -> Self {
        CoreClock { ns_per_cycle: 1e9 / f64::from(clock_hz.max(1)), first: None, last: None, restarts: 0 }
    }

    /// Cycle `cycles` was between these times of the host, in ns since 1970.
    pub fn add(&mut self, from_ns: i64, cycles: u64, to_ns: i64) {
        let half_ns = (to_ns - from_ns).max(0) as f64 / 2.0;
        let own = Known { cycles, middle_ns: from_ns + half_ns as i64, half_ns };
        let cut = self.expected(cycles).and_then(|expected| {
            // Both intervals, from the middle of the expected one on.
            let apart = (own.middle_ns - expected.middle_ns) as f64;
            let from = (apart - own.half_ns).max(-expected.half_ns);
            let to = (apart + own.half_ns).min(expected.half_ns);
            // A nanosecond is lost where intervals are rounded.
            let middle_ns = expected.middle_ns + ((from + to) / 2.0).round() as i64;
            (to - from >= -1.0).then(|| Known { cycles, middle_ns, half_ns: ((to - from) / 2.0).max(0.0) + 1.0 })
        });
        if cut.is_none() {
            self.restarts += u64::from(self.last.is_some());
            self.first = Some(own);
        }
        self.last = Some(cut.unwrap_or(own));
    }

    /// The interval of a cycle by the answers so far.
    fn expected(&self, cycles: u64) -> Option<Known> {
        let last = self.last?;
        // Of frames that were overtaken by another answer, cycles are before the last.
        let since_ns = (cycles.wrapping_sub(last.cycles) as i64) as f64 * self.ns_per_cycle;
        let half_ns = last.half_ns + since_ns.abs() * DRIFT;
        Some(Known { cycles, middle_ns: last.middle_ns + since_ns as i64, half_ns })
    }

    /// When a cycle was; `None` before the first answer.
    pub fn at(&self, cycles: u64) -> Option<Acquired> {
        let own = self.expected(cycles)?;
        Some(Acquired { cycles, time_ns: own.middle_ns, error_ns: own.half_ns.ceil() as u64 })
    }

    /// How the core's rate differs from the stated one; `None` before two answers.
    pub fn drift(&self) -> Option<Drift> {
        let (first, last) = self.first.zip(self.last).filter(|(first, last)| last.cycles > first.cycles)?;
        let stated_ns = (last.cycles - first.cycles) as f64 * self.ns_per_cycle;
        let host_ns = (last.middle_ns - first.middle_ns) as f64;
        let (drift, error) = (stated_ns / host_ns - 1.0, (first.half_ns + last.half_ns) / host_ns);
        (host_ns > 0.0).then_some(Drift { ppm: drift * 1e6, error_ppm: error * 1e6 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What became of a clock that is polled.
    struct Polled {
        clock: CoreClock,
        /// Largest error of its times in ns, once it has been polled for a while.
        largest_ns: i64,
        /// Whether every error was within what was said of it.
        is_within: bool,
    }

    /// A core whose clock of 100 MHz is `ppm` fast and begins at `START_NS`, polled each millisecond over a network with delays of
    /// 20 to 420 µs in each direction, by far not alike.
    fn polled(ppm: f64, questions: usize) -> Polled {
        const START_NS: i64 = 1_790_000_000_000_000_000;
        let mut random = fastrand::Rng::with_seed(7);
        let mut all = Polled { clock: CoreClock::new(100_000_000), largest_ns: 0, is_within: true };
        for question in 0..questions {
            let [there, back] = [20e3, 120e3].map(|least| least + 300e3 * random.f64());
            let request_ns = question as f64 * 1e6;
            let truth_ns = request_ns + there;
            let cycles = (truth_ns * (1.0 + ppm * 1e-6) / 10.0) as u64;
            all.clock.add(START_NS + request_ns as i64, cycles, START_NS + (truth_ns + back) as i64);
            let own = all.clock.at(cycles).unwrap();
            let error = own.time_ns - START_NS - truth_ns as i64;
            // Times and cycles are rounded.
            all.is_within &= error.unsigned_abs() <= own.error_ns + 20;
            all.largest_ns = if question >= 20 { all.largest_ns.max(error.abs()) } else { 0 };
        }
        all
    }

    #[test]
    fn the_time_of_a_cycle_is_within_the_error_that_is_said_and_within_a_tenth_of_a_millisecond() {
        for ppm in [-150.0, -20.0, 0.0, 20.0, 150.0] {
            let Polled { clock, largest_ns, is_within } = polled(ppm, 2000);
            assert!(is_within && largest_ns < 100_000, "{ppm} ppm: {largest_ns} ns");
            let drift = clock.drift().unwrap();
            assert!((drift.ppm - ppm).abs() <= drift.error_ppm && drift.error_ppm < 300.0, "{ppm} ppm: {drift:?}");
            assert_eq!(clock.restarts, 0);
        }
    }

    #[test]
    fn a_core_that_was_reset_and_a_rate_that_no_oscillator_has_are_told() {
        let mut clock = polled(0.0, 10).clock;
        let now = clock.at(900_000).unwrap().time_ns + 5_000_000;
        clock.add(now, 12, now + 40_000);
        let own = clock.at(12).unwrap();
        assert_eq!((clock.restarts, own.time_ns, own.error_ns), (1, now + 20_000, 20_000));
        // Such a rate is seen as restarts, and before one the times are not what is said of them.
        let wrong = polled(5000.0, 200);
        assert!(wrong.clock.restarts > 0 && !wrong.is_within);
        assert_eq!((CoreClock::new(1).at(3), CoreClock::new(1).drift()), (None, None));
    }
}
