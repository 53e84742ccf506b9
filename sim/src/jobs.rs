//! Runs a list of tasks on several threads until one fails or the user interrupts.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use anyhow::Result;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use thiserror::Error;

use crate::progress::Progress;

/// Exit code when a second signal ends the program at once.
const SECOND_INTERRUPT_EXIT: i32 = 130;

/// Interrupted by SIGINT or SIGTERM.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("interrupted; nothing was written")]
pub struct Interrupted;

/// Set when SIGINT or SIGTERM has arrived.
#[derive(Clone, Debug, Default)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Registers handlers: the first SIGINT or SIGTERM sets the flag, the second one ends the program at once.
    ///
    /// # Errors
    /// A handler cannot be registered.
    pub fn on_signals() -> Result<Interrupt> {
        let interrupt = Interrupt::default();
        for signal in [SIGINT, SIGTERM] {
            // The order matters: on the first signal the shutdown handler must find the flag unset.
            flag::register_conditional_shutdown(signal, SECOND_INTERRUPT_EXIT, interrupt.0.clone())?;
            flag::register(signal, interrupt.0.clone())?;
        }
        Ok(interrupt)
    }

    /// Fails once a signal has arrived.
    ///
    /// # Errors
    /// [`Interrupted`].
    pub fn check(&self) -> Result<()> {
        match self.0.load(Ordering::Relaxed) {
            true => Err(Interrupted.into()),
            false => Ok(()),
        }
    }
}

/// Runs `work` on all tasks with `jobs` threads (at least one); the results are in the tasks' order. `what` names the
/// progress bar.
///
/// # Errors
/// The error of the first failed task in list order; [`Interrupted`].
pub fn parallel<T: Send, R: Send>(
    what: &str,
    tasks: Vec<T>,
    jobs: usize,
    interrupt: &Interrupt,
    work: impl Fn(T) -> Result<R> + Sync,
) -> Result<Vec<R>> {
    let bar = Progress::steps(what, tasks.len() as u64);
    let tasks: Vec<Mutex<Option<T>>> = tasks.into_iter().map(|task| Mutex::new(Some(task))).collect();
    let results: Vec<Mutex<Option<Result<R>>>> = tasks.iter().map(|_| Mutex::new(None)).collect();
    let (next, done, failed) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicBool::new(false));
    let take = |index: usize| tasks[index].lock().unwrap_or_else(PoisonError::into_inner).take();
    let worker = || {
        while !failed.load(Ordering::Relaxed) && interrupt.check().is_ok() {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(task) = tasks.get(index).and_then(|_| take(index)) else { break };
            let result = work(task);
            failed.fetch_or(result.is_err(), Ordering::Relaxed);
            *results[index].lock().unwrap_or_else(PoisonError::into_inner) = Some(result);
            bar.set(done.fetch_add(1, Ordering::Relaxed) as u64 + 1);
        }
    };
    std::thread::scope(|scope| (0..jobs.max(1)).for_each(|_| drop(scope.spawn(worker))));
    interrupt.check()?;
    let results = results.into_iter().map(|result| result.into_inner().unwrap_or_else(PoisonError::into_inner));
    // Tasks without a result were not started: they come after a failed one, whose error `collect` returns first.
    results.flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::anyhow;

    #[test]
    fn results_in_order_whatever_the_threads() {
        for jobs in [0, 1, 3] {
            let squares =
                parallel("squares", (0..20u64).collect(), jobs, &Interrupt::default(), |n| Ok(n * n)).unwrap();
            assert_eq!(squares, (0..20).map(|n| n * n).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_failure_ends_it() {
        let work = |n: u64| if n == 2 { Err(anyhow!("two")) } else { Ok(n) };
        assert_eq!(parallel("n", (0..20).collect(), 2, &Interrupt::default(), work).unwrap_err().to_string(), "two");
    }

    #[test]
    fn an_interruption_ends_it() {
        let interrupt = Interrupt::default();
        let stop = |n: u64| {
            interrupt.0.store(n == 3, Ordering::Relaxed);
            Ok(n)
        };
        let error = parallel("n", (0..20).collect(), 1, &interrupt, stop).unwrap_err();
        assert!(error.is::<Interrupted>(), "{error}");
    }
}
