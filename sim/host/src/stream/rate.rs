//! Rate: whether the results of a stream keep up with its frames, and the fastest estimator that is needed for it.
//!
//! ```text
//! load = time of a result · frames per second / frames per result / share of a core        mean over half a second or more
//!
//! load > 1                                   the next faster estimator
//! load of a better one ≤ 0.7, as measured    back to it
//! 10 s after a change, 20 s, 40 s, …         back to it, in case its frames have become easier
//! ```
//!
//! | | unit |
//! |---|---|
//! | in: time of a result, number and arrival of its line, lines that found the queue full | s, –, s, – |
//! | in: frames per second that are wanted; else they are measured from the arrivals | 1/s |
//! | out: number of the estimator, from the best one on, or that none is fast enough | – |

use std::sync::Arc;
use std::time::{Duration, Instant};

/// Least time over which a load is measured.
const WINDOW: Duration = Duration::from_millis(500);
/// Least number of results over which a load is measured, unless they take long.
const RESULTS: u32 = 3;
/// Time after which a load is measured from fewer results.
const LONG: Duration = Duration::from_secs(2);
/// Load below which a better estimator is taken again.
const LIGHT: f64 = 0.7;
/// First time from a change to a faster estimator until the better one is tried again; doubled each time up to the second.
const RETRY: [Duration; 2] = [Duration::from_secs(10), Duration::from_secs(320)];
/// Time after which a stream that is still behind says so again.
const REPEAT: Duration = Duration::from_secs(10);
/// Share of the lines that find the queue full from which a stream is behind whatever the measured load.
const FULL: f64 = 0.5;

/// Time since a fixed moment.
#[derive(Clone)]
pub struct Clock(Arc<dyn Fn() -> Duration + Send + Sync>);

impl Clock {
    /// A clock that reads `now`.
    pub fn new(now: impl Fn() -> Duration + Send + Sync + 'static) -> Clock {
        Clock(Arc::new(now))
    }

    /// The time now.
    pub fn now(&self) -> Duration {
        (self.0)()
    }
}

impl Default for Clock {
    /// The monotonic clock of the computer.
    fn default() -> Clock {
        let begun = Instant::now();
        Clock::new(move || begun.elapsed())
    }
}

/// Where a stream is after a result.
#[derive(Clone, Copy, Debug)]
pub(super) struct Progress {
    /// Time now.
    pub now: Duration,
    /// Time that the result took, without waiting.
    pub busy: Duration,
    /// Number of its last line.
    pub line: u64,
    /// When that line was read.
    pub received: Duration,
    /// Number of lines so far that found the queue full.
    pub full: u64,
}

/// What follows from the results so far.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Verdict {
    /// Nothing.
    Hold,
    /// Another estimator, by its number, and why.
    Take(usize, String),
    /// The frames are faster than every estimator, and by how much.
    Behind(String),
    /// They no longer are.
    CaughtUp,
}

/// An estimator of the stream.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    name: &'static str,
    /// Mean time of a result, as last measured.
    cost: Option<Duration>,
    /// When it is tried again.
    again: Duration,
    /// Time from the next change away from it until then.
    wait: Duration,
}

/// What is measured since the last verdict.
#[derive(Clone, Copy, Debug)]
struct Window {
    begun: Duration,
    /// The line before.
    line: u64,
    received: Duration,
    full: u64,
    results: u32,
    busy: Duration,
}

/// Keeps the rate of a stream.
#[derive(Debug)]
pub(super) struct Keeper {
    wanted_Hz: Option<f64>,
    frames_per_result: f64,
    /// Of a core that the stream has.
    share: f64,
    candidates: Vec<Candidate>,
    taken: usize,
    window: Option<Window>,
    /// When it was last said that the stream is behind.
    behind: Option<Duration>,
}

impl Keeper {
    /// For frames at `wanted_Hz` per second, or as they arrive, and the estimators `names`, the best first; there is at least one.
    pub(super) fn new(wanted_Hz: Option<f64>, frames_per_result: usize, names: &[&'static str]) -> Keeper {
        let candidate = |name: &&'static str| Candidate { name, cost: None, again: Duration::ZERO, wait: RETRY[0] };
        Keeper {
            wanted_Hz,
            frames_per_result: frames_per_result as f64,
            share: 1.0,
            candidates: names.iter().map(candidate).collect(),
            taken: 0,
            window: None,
            behind: None,
        }
    }

    /// The same with this share of a core.
    pub(super) fn with_share(self, share: f64) -> Keeper {
        Keeper { share, ..self }
    }

    /// Number of the estimator that is taken.
    pub(super) fn taken(&self) -> usize {
        self.taken
    }

    /// Name of the estimator that is taken.
    pub(super) fn name(&self) -> &'static str {
        self.candidates[self.taken].name
    }

    /// Takes an estimator that a verdict names.
    pub(super) fn take(&mut self, candidate: usize, now: Duration) {
        for own in &mut self.candidates[self.taken..candidate.max(self.taken)] {
            own.again = now + own.wait;
            own.wait = (2 * own.wait).min(RETRY[1]);
        }
        self.taken = candidate;
    }

    /// Leaves out an estimator that is not taken.
    pub(super) fn leave_out(&mut self, candidate: usize) {
        self.candidates.remove(candidate);
        self.taken -= usize::from(candidate < self.taken);
    }

    /// What follows after a result.
    pub(super) fn after(&mut self, at: Progress) -> Verdict {
        let Progress { now, busy, line, received, full } = at;
        let begun = now.saturating_sub(busy);
        let window =
            self.window.get_or_insert(Window { begun, line, received, full, results: 0, busy: Duration::ZERO });
        window.results += 1;
        window.busy += busy;
        let lasted = now.saturating_sub(window.begun);
        if lasted < WINDOW || (window.results < RESULTS && lasted < LONG) {
            return Verdict::Hold;
        }
        let past = *window;
        self.window = Some(Window { begun: now, line, received, full, results: 0, busy: Duration::ZERO });
        let cost = past.busy / past.results;
        self.candidates[self.taken].cost = Some(cost);
        let lines = line.saturating_sub(past.line) as f64;
        let arrived_Hz = lines / received.saturating_sub(past.received).as_secs_f64();
        // Of one line there is no rate.
        let Some(rate_Hz) = self.wanted_Hz.or((lines > 0.0).then_some(arrived_Hz)) else { return Verdict::Hold };
        let overflow = full.saturating_sub(past.full) as f64;
        self.verdict(now, rate_Hz, overflow > 0.0, overflow >= FULL * lines)
    }

    /// What follows from a rate of frames; `full` says whether lines found the queue full, `often` whether many did.
    fn verdict(&mut self, now: Duration, rate_Hz: f64, full: bool, often: bool) -> Verdict {
        let left = self.share * self.frames_per_result / rate_Hz;
        let load = |cost: Option<Duration>| cost.map_or(0.0, |cost| cost.as_secs_f64() / left);
        let own = self.candidates[self.taken];
        let why = |name: &str, cost: Option<Duration>| {
            let [takes_ms, left_ms] = [cost.unwrap_or_default().as_secs_f64(), left].map(|s| 1e3 * s);
            format!("{name} takes {takes_ms:.3} ms a result, {rate_Hz:.1} frames per second leave {left_ms:.3} ms")
        };
        let slow = load(own.cost) > 1.0;
        if slow && self.taken + 1 < self.candidates.len() {
            return Verdict::Take(self.taken + 1, why(own.name, own.cost));
        }
        let lighter = |other: &Candidate| load(other.cost) <= LIGHT || now >= other.again;
        if let Some(better) = self.candidates[..self.taken].iter().position(lighter).filter(|_| !slow) {
            let other = self.candidates[better];
            let why = match load(other.cost) <= LIGHT {
                true => why(other.name, other.cost),
                false => format!("{} is tried again", other.name),
            };
            return Verdict::Take(better, why);
        }
        let behind = full && (slow || often);
        match (behind, self.behind) {
            (true, Some(said)) if now < said + REPEAT => Verdict::Hold,
            (true, _) => {
                self.behind = Some(now);
                Verdict::Behind(why(own.name, own.cost))
            }
            (false, Some(_)) => {
                self.behind = None;
                Verdict::CaughtUp
            }
            (false, None) => Verdict::Hold,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: [&str; 3] = ["evidence", "network", "search"];

    /// A stream of frames at a rate, whose results take `cost_ms` by each estimator: when which one was taken, in seconds.
    fn taken(
        keeper: &mut Keeper,
        from_s: f64,
        until_s: f64,
        rate_Hz: f64,
        cost_ms: [f64; 3],
    ) -> Vec<(f64, &'static str)> {
        let (mut now, mut all, mut full, mut last) = (from_s, Vec::new(), 0.0, (from_s * rate_Hz).floor());
        while now < until_s {
            let busy = cost_ms[keeper.taken()] / 1e3;
            // The newest frame that has arrived; the queue is full where several have.
            let line = (now * rate_Hz).floor().max(1.0);
            full += (line - last - 1.0).max(0.0);
            last = line;
            let [now_t, busy_t, received] = [now + busy, busy, line / rate_Hz].map(Duration::from_secs_f64);
            let at = Progress { now: now_t, busy: busy_t, line: line as u64, received, full: full as u64 };
            if let Verdict::Take(candidate, _) = keeper.after(at) {
                keeper.take(candidate, now_t);
                all.push((now, keeper.name()));
            }
            now = (now + busy).max((line + 1.0) / rate_Hz);
        }
        all
    }

    #[test]
    fn the_best_that_keeps_up_is_taken() {
        let names = |all: Vec<(f64, &'static str)>| all.into_iter().map(|(_, name)| name).collect::<Vec<_>>();
        for wanted in [None, Some(100.0)] {
            let run = |cost_ms| names(taken(&mut Keeper::new(wanted, 1, &NAMES), 0.0, 5.0, 100.0, cost_ms));
            assert_eq!(run([9.0, 1.0, 1.0]), [""; 0]);
            assert_eq!(run([12.0, 1.0, 0.5]), ["network"]);
            assert_eq!(run([300.0, 20.0, 0.5]), ["network", "search"]);
        }
        // Four frames for each result leave four times as long.
        assert_eq!(taken(&mut Keeper::new(None, 4, &NAMES), 0.0, 5.0, 100.0, [30.0, 1.0, 1.0]), []);
        // What is wanted counts, not what arrives.
        let mut keeper = Keeper::new(Some(1000.0), 1, &NAMES);
        assert_eq!(names(taken(&mut keeper, 0.0, 5.0, 100.0, [2.0, 0.5, 0.1])), ["network"]);
    }

    #[test]
    fn a_better_one_is_taken_again_when_there_is_time() {
        let mut keeper = Keeper::new(None, 1, &NAMES[..2]);
        let down = taken(&mut keeper, 0.0, 5.0, 200.0, [8.0, 1.0, 0.0]);
        assert!(matches!(down[..], [(at, "network")] if at < 1.0), "{down:?}");
        // Fewer frames: at once. Light enough is not just enough.
        assert_eq!(taken(&mut keeper, 5.0, 8.0, 100.0, [8.0, 1.0, 0.0]), []);
        let up = taken(&mut keeper, 8.0, 10.0, 50.0, [8.0, 1.0, 0.0]);
        assert!(matches!(up[..], [(_, "evidence")]), "{up:?}");
        // Easier frames, which only a try can show: 10 s after the change, and half as often each time in vain.
        let mut keeper = Keeper::new(None, 1, &NAMES[..2]);
        let tries = taken(&mut keeper, 0.0, 80.0, 200.0, [8.0, 1.0, 0.0]);
        let up: Vec<f64> = tries.iter().filter(|(_, name)| *name == "evidence").map(|(at, _)| at.round()).collect();
        assert!(up.len() == 3 && up[0] >= 10.0 && up[1] >= 30.0 && up[2] >= 70.0, "{tries:?}");
        let found = taken(&mut keeper, 80.0, 240.0, 200.0, [2.0, 1.0, 0.0]);
        assert!(matches!(found[..], [(_, "evidence")]), "{found:?}");
    }

    #[test]
    fn what_none_keeps_up_with_is_said_once_in_a_while() {
        let mut keeper = Keeper::new(None, 1, &NAMES[2..]);
        let mut verdicts = Vec::new();
        for k in 1..=3000u64 {
            // 100 lines per second, of which every result takes as long as two, and then as long as a half.
            let [now, received] = [20 * k, 20 * k - 15].map(Duration::from_millis);
            let (busy, full) = if k < 1500 { (20, k) } else { (5, 1500) };
            let busy = Duration::from_millis(busy);
            match keeper.after(Progress { now, busy, line: 2 * k, received, full }) {
                Verdict::Hold => (),
                other => verdicts.push((now.as_secs(), other)),
            }
        }
        let why = "search takes 20.000 ms a result, 100.0 frames per second leave 10.000 ms".to_owned();
        let said: Vec<u64> = verdicts.iter().map(|(at, _)| *at).collect();
        assert!(verdicts.len() == 4 && verdicts[..3].iter().all(|(_, own)| *own == Verdict::Behind(why.clone())));
        assert!(verdicts[3].1 == Verdict::CaughtUp && said[1] - said[0] >= 10 && said[3] >= 30, "{verdicts:?}");
    }

    #[test]
    fn one_that_cannot_be_built_is_left_out() {
        let mut keeper = Keeper::new(None, 1, &NAMES);
        keeper.leave_out(1);
        let all = taken(&mut keeper, 0.0, 5.0, 100.0, [12.0, 1.0, 0.0]);
        assert!(matches!(all[..], [(_, "search")]), "{all:?}");
    }
}
