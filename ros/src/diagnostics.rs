//! What is known of each patch: counters, flags and source, as diagnostics of ROS 2.
//!
//! | level | when |
//! |---|---|
//! | ok | results come, without flags but `no-contact` |
//! | warning | flags; frames that were dropped, late or refused since the last second |
//! | error | the source cannot be read, or the stream has failed |
//! | stale | no result for two seconds, or the source has ended |
//!
//! All patches are reported once per second, and one whose flags, source or estimator changes at once.

use std::collections::BTreeSet;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use dermis_golden::data::recording::message::{DiagnosticStatus, KeyValue};
use dermis_golden::result::flags::Flag;
use dermis_host::stream::StreamAnswer;

/// Time between reports of all patches.
pub const PERIOD: Duration = Duration::from_secs(1);
/// Least time between reports of changes, which are gathered meanwhile.
const GATHER: Duration = Duration::from_millis(20);
/// Time without a result after which a patch is stale.
const STALE: Duration = Duration::from_secs(2);

/// Patches whose state has changed since they were reported.
#[derive(Default)]
pub struct Changes {
    patches: Mutex<BTreeSet<usize>>,
    changed: Condvar,
}

impl Changes {
    fn add(&self, patch: usize) {
        self.patches.lock().unwrap_or_else(PoisonError::into_inner).insert(patch);
        self.changed.notify_all();
    }

    /// The patches that have changed, once there are some, or none after `wait`.
    pub fn within(&self, wait: Duration) -> BTreeSet<usize> {
        let patches = self.patches.lock().unwrap_or_else(PoisonError::into_inner);
        let none = |patches: &mut BTreeSet<usize>| patches.is_empty();
        let waited = self.changed.wait_timeout_while(patches, wait, none);
        let (mut patches, _) = waited.unwrap_or_else(PoisonError::into_inner);
        std::mem::take(&mut *patches)
    }

    /// Waits until reports may follow each other.
    pub fn gather() {
        std::thread::sleep(GATHER);
    }
}

/// How a source is.
#[derive(Clone, Debug, PartialEq, Eq)]
enum SourceState {
    Waiting,
    Open,
    Failed(String),
    /// There will be no further result; the error, if there was one.
    Ended(Option<String>),
}

/// Counters since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Counters {
    results: u64,
    refused: u64,
    dropped: u64,
    late: u64,
}

struct Figures {
    source: SourceState,
    /// How often it was opened.
    opened: u64,
    counters: Counters,
    /// Those of the last report of all patches.
    reported: Counters,
    /// Largest time from a frame to its result since then.
    largest_lag: Duration,
    refusal: String,
    estimator: String,
    flags: Vec<Flag>,
    last: Option<Instant>,
    /// Time from each frame to its result, where that is measured.
    lags: Option<Vec<Duration>>,
}

/// The state of a patch.
pub struct PatchState {
    index: usize,
    name: String,
    scene: String,
    late: Duration,
    figures: Mutex<Figures>,
    changes: Arc<Changes>,
}

impl PatchState {
    /// That of patch `index`, before its source is opened; results are late after `late`.
    pub fn new(index: usize, name: &str, scene: &str, late: Duration, changes: Arc<Changes>) -> PatchState {
        let figures = Figures {
            source: SourceState::Waiting,
            opened: 0,
            counters: Counters::default(),
            reported: Counters::default(),
            largest_lag: Duration::ZERO,
            refusal: String::new(),
            estimator: String::new(),
            flags: Vec::new(),
            last: None,
            lags: None,
        };
        PatchState { index, name: name.into(), scene: scene.into(), late, figures: Mutex::new(figures), changes }
    }

    fn figures(&self) -> MutexGuard<'_, Figures> {
        self.figures.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The source was opened, or why it is not.
    pub fn source(&self, open: Result<(), String>) {
        let mut figures = self.figures();
        figures.opened += u64::from(open.is_ok());
        figures.source = open.map_or_else(SourceState::Failed, |()| SourceState::Open);
        drop(figures);
        self.changes.add(self.index);
    }

    /// There will be no further result.
    pub fn ended(&self, error: Option<String>) {
        self.figures().source = SourceState::Ended(error);
        self.changes.add(self.index);
    }

    /// Counts a result.
    pub fn answer(&self, answer: &StreamAnswer) {
        let lag = Duration::try_from_secs_f64(answer.answered_s - answer.received_s).unwrap_or_default();
        let mut figures = self.figures();
        figures.counters.results += 1;
        figures.counters.dropped = answer.dropped;
        figures.counters.late += u64::from(lag > self.late);
        figures.largest_lag = figures.largest_lag.max(lag);
        figures.last = Some(Instant::now());
        if let Some(lags) = &mut figures.lags {
            lags.push(lag);
        }
        let changed = figures.flags != answer.result.flags || figures.estimator != answer.estimator;
        if changed {
            figures.flags.clone_from(&answer.result.flags);
            figures.estimator = answer.estimator.to_owned();
            drop(figures);
            self.changes.add(self.index);
        }
    }

    /// Keeps the time from each frame to its result from now on.
    pub fn measure(&self) {
        self.figures().lags = Some(Vec::new());
    }

    /// What was measured, without the times before [`PatchState::measure`].
    pub fn measured(&self) -> Measured {
        let mut figures = self.figures();
        let Counters { dropped, late, .. } = figures.counters;
        Measured { lags: figures.lags.take().unwrap_or_default(), dropped, late }
    }

    /// Counts a line without a result; whether it is the first one.
    pub fn refused(&self, why: &str) -> bool {
        let mut figures = self.figures();
        figures.counters.refused += 1;
        figures.refusal = why.to_owned();
        figures.counters.refused == 1
    }

    /// Its status; with `all` as part of a report of all patches, from which on rates count anew.
    pub fn status(&self, all: bool) -> DiagnosticStatus {
        let mut figures = self.figures();
        let (level, message) = figures.level();
        let value = |key: &str, value: String| KeyValue { key: key.into(), value };
        let Counters { results, refused, dropped, late } = figures.counters;
        let flags: Vec<&str> = figures.flags.iter().map(|flag| flag.name()).collect();
        let values = vec![
            value("flags", flags.join(", ")),
            value("estimator", figures.estimator.clone()),
            value("results", results.to_string()),
            value("results per second", results.saturating_sub(figures.reported.results).to_string()),
            value("refused", refused.to_string()),
            value("last refusal", figures.refusal.clone()),
            value("dropped", dropped.to_string()),
            value("late", late.to_string()),
            value("largest lag in ms", format!("{:.3}", 1e3 * figures.largest_lag.as_secs_f64())),
            value("source opened", figures.opened.to_string()),
        ];
        if all {
            figures.reported = figures.counters;
            figures.largest_lag = Duration::ZERO;
        }
        DiagnosticStatus {
            level,
            name: format!("dermis: {}", self.name),
            message,
            hardware_id: self.scene.clone(),
            values,
        }
    }
}

/// Results of patches over a time.
#[derive(Clone, Debug, Default)]
pub struct Measured {
    /// Time from each frame to its result.
    pub lags: Vec<Duration>,
    /// Frames that were dropped, since the start.
    pub dropped: u64,
    /// Results that were late, since the start.
    pub late: u64,
}

impl Measured {
    /// Adds those of another patch.
    pub fn add(&mut self, other: Measured) {
        self.lags.extend(other.lags);
        self.dropped += other.dropped;
        self.late += other.late;
    }

    /// A line: results per second, frames lost, latency.
    pub fn line(mut self, name: &str, seconds: f64) -> String {
        self.lags.sort_unstable();
        let at = |share: f64| {
            let index = (share * self.lags.len().saturating_sub(1) as f64).round() as usize;
            self.lags.get(index).map_or(0.0, |lag| 1e3 * lag.as_secs_f64())
        };
        let results = self.lags.len() as f64;
        let lost = 100.0 * self.dropped as f64 / (results + self.dropped as f64).max(1.0);
        let (rate, late, median, last) = (results / seconds, self.late, at(0.5), at(0.999));
        format!("{name:16}  {rate:9.1} results/s  {lost:7.3} % lost  {late:7} late  median {median:8.3} ms  99.9 % {last:8.3} ms\n")
    }
}

impl Figures {
    fn level(&self) -> (u8, String) {
        let since = |now: u64, before: u64| now.saturating_sub(before);
        let (now, before) = (self.counters, self.reported);
        match &self.source {
            SourceState::Failed(why) | SourceState::Ended(Some(why)) => return (DiagnosticStatus::ERROR, why.clone()),
            SourceState::Ended(None) => return (DiagnosticStatus::STALE, "the source has ended".into()),
            SourceState::Waiting | SourceState::Open => (),
        }
        let Some(last) = self.last else { return (DiagnosticStatus::STALE, "no result yet".into()) };
        let silent = last.elapsed();
        if silent > STALE {
            return (DiagnosticStatus::STALE, format!("no result for {:.0} s", silent.as_secs_f64()));
        }
        let limits: Vec<&str> =
            self.flags.iter().filter(|flag| **flag != Flag::NoContact).map(|flag| flag.name()).collect();
        let counted = [
            (since(now.dropped, before.dropped), "dropped"),
            (since(now.late, before.late), "late"),
            (since(now.refused, before.refused), "refused"),
        ];
        let counted: Vec<String> =
            counted.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}")).collect();
        let said: Vec<String> = limits.into_iter().map(str::to_owned).chain(counted).collect();
        match said.is_empty() {
            true => (DiagnosticStatus::OK, format!("by {}", self.estimator)),
            false => (DiagnosticStatus::WARN, said.join(", ")),
        }
    }
}
