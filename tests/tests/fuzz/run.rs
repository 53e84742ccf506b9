//! Runs inputs on all processors and records failures and counts for the report.

use std::fmt::Write;
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::path::Path;
use std::thread::available_parallelism;
use std::time::{Duration, Instant};

use dermis_flow::jobs::{parallel, Interrupt};
use dermis_report::run_log::{RunLog, TargetCounts};
use dermis_tests::build_dir;

use super::counting::{mark, most_since};

/// Number of failing inputs that are printed in full.
const PRINTED: usize = 20;

/// Statistics of a set of inputs.
#[derive(Default)]
pub struct Outcome {
    /// Number of inputs.
    pub tried: usize,
    /// Number of inputs per outcome, by name.
    pub counts: Vec<(&'static str, usize)>,
    /// Failures with their inputs.
    pub failures: Vec<String>,
    /// Largest number of bytes allocated for one input.
    pub most_bytes: usize,
    /// Longest time for one input.
    pub slowest: Duration,
    /// Total time.
    pub elapsed: Duration,
}

impl Outcome {
    /// Runs one input. A panic or a timeout is a failure; otherwise the value is returned with the bytes allocated.
    pub fn survive<T>(
        &mut self,
        what: &str,
        input: &dyn Fn() -> String,
        longest: Duration,
        run: impl FnOnce() -> T,
    ) -> Option<(T, usize)> {
        let (before, start) = (mark(), Instant::now());
        let value = catch_unwind(AssertUnwindSafe(run));
        let (bytes, took) = (most_since(before), start.elapsed());
        (self.most_bytes, self.slowest) = (self.most_bytes.max(bytes), self.slowest.max(took));
        if took > longest {
            self.failures.push(format!("{took:?} for {what}: {}", input()));
        }
        match value {
            Ok(value) => Some((value, bytes)),
            Err(_) => {
                self.failures.push(format!("panic on {what}: {}", input()));
                None
            }
        }
    }

    /// Counts an outcome.
    pub fn count(&mut self, name: &'static str, more: usize) {
        match self.counts.iter_mut().find(|(own, _)| *own == name) {
            Some((_, count)) => *count += more,
            None => self.counts.push((name, more)),
        }
    }

    /// Number of inputs with an outcome.
    pub fn counted(&self, name: &str) -> usize {
        self.counts.iter().find(|(own, _)| *own == name).map_or(0, |(_, count)| *count)
    }

    /// The sum of both; times are added.
    pub fn add(&mut self, other: Outcome) {
        other.counts.iter().for_each(|(name, count)| self.count(name, *count));
        self.failures.extend(other.failures);
        self.tried += other.tried;
        self.most_bytes = self.most_bytes.max(other.most_bytes);
        self.slowest = self.slowest.max(other.slowest);
        self.elapsed += other.elapsed;
    }
}

/// Runs tasks 0 … `count` − 1 on all processors; the results are in their order.
pub fn on_all_processors<R: Send>(count: usize, work: impl Fn(usize) -> R + Sync) -> Vec<R> {
    let jobs = available_parallelism().map_or(1, usize::from);
    parallel("inputs", (0..count).collect(), jobs, &Interrupt::default(), |task| Ok(work(task))).unwrap()
}

/// Prints a line per target, stores the counts of a long run for the report, and fails if anything failed.
pub fn conclude(name: &str, unit: &str, long: bool, outcomes: Vec<(&str, Outcome)>) {
    let mut run = RunLog::new("make fuzz");
    let mut failures = String::new();
    for (what, outcome) in outcomes {
        let counts = outcome.counts.iter().copied().chain([("failed", outcome.failures.len())]);
        let counts = counts.map(|(name, count)| (name, count as u64));
        let line = TargetCounts::new(what, unit, outcome.tried as u64, counts, outcome.elapsed.as_secs_f64());
        println!("{line}; one at most {} bytes, {:.1?}", outcome.most_bytes, outcome.slowest);
        run.targets.push(line);
        for failure in outcome.failures.iter().take(PRINTED) {
            writeln!(failures, "{failure}").unwrap();
        }
    }
    if long {
        run.save(&build_dir(), name).unwrap();
        println!("kept in {}", Path::new("build/tried").join(name).with_extension("json").display());
    }
    assert!(failures.is_empty(), "{failures}");
}
