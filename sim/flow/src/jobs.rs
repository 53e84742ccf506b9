//! Runs a list of tasks on several threads until one fails or the user interrupts.

use std::io::Read;
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::Arc;

use anyhow::Result;
use rayon::prelude::*;
use rayon::ThreadPoolBuilder;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use signal_hook::low_level::pipe;
use thiserror::Error;

use crate::progress::Progress;

/// Exit code when a second signal ends the program at once.
const SECOND_INTERRUPT_EXIT: i32 = 130;

/// Interrupted by SIGINT or SIGTERM, with what became of the output.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("interrupted; {0}")]
pub struct Interrupted(pub &'static str);

/// Set when SIGINT or SIGTERM has arrived.
#[derive(Clone, Debug, Default)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Registers handlers: the first SIGINT or SIGTERM sets the flag, the second one ends the program at once.
    ///
    /// # Errors
    /// A handler cannot be registered.
    pub fn on_signals() -> Result<Interrupt> {
        // Tasks that run are not stopped and may take half a minute.
        Interrupt::with(|| {
            say!("interrupted: the tasks that run are ended first; a second signal ends them at once");
        })
    }

    /// The same; `act` is called after the first signal, in a thread of its own: a handler must not write or lock.
    ///
    /// # Errors
    /// A handler cannot be registered.
    pub fn with(act: impl FnOnce() + Send + 'static) -> Result<Interrupt> {
        let interrupt = Interrupt::default();
        let (mut woken, wakes) = UnixStream::pair()?;
        for signal in [SIGINT, SIGTERM] {
            // The order matters: on the first signal the shutdown handler must find the flag unset.
            flag::register_conditional_shutdown(signal, SECOND_INTERRUPT_EXIT, interrupt.0.clone())?;
            flag::register(signal, interrupt.0.clone())?;
            pipe::register(signal, wakes.try_clone()?)?;
        }
        std::thread::spawn(move || {
            if woken.read_exact(&mut [0]).is_ok() {
                act();
            }
        });
        Ok(interrupt)
    }

    /// Fails once a signal has arrived.
    ///
    /// # Errors
    /// [`Interrupted`].
    pub fn check(&self) -> Result<()> {
        match self.0.load(Ordering::Relaxed) {
            true => Err(Interrupted("nothing was written").into()),
            false => Ok(()),
        }
    }
}

/// Runs `work` on all tasks with `jobs` threads (at least one); the results are in the tasks' order. `what` names the
/// progress bar. After a failure no further task is started.
///
/// # Errors
/// The error of the first task, in list order, that was started and failed; [`Interrupted`]; no threads.
pub fn parallel<T: Send, R: Send>(
    what: &str,
    tasks: Vec<T>,
    jobs: usize,
    interrupt: &Interrupt,
    work: impl Fn(T) -> Result<R> + Sync,
) -> Result<Vec<R>> {
    let bar = Progress::steps(what, tasks.len() as u64);
    let (done, failed) = (AtomicUsize::new(0), AtomicBool::new(false));
    let one = |task| {
        if failed.load(Ordering::Relaxed) || interrupt.check().is_err() {
            return None;
        }
        let result = work(task);
        failed.fetch_or(result.is_err(), Ordering::Relaxed);
        bar.set(done.fetch_add(1, Ordering::Relaxed) as u64 + 1);
        Some(result)
    };
    let threads = ThreadPoolBuilder::new().num_threads(jobs.max(1)).build()?;
    let results: Vec<Option<Result<R>>> = threads.install(|| tasks.into_par_iter().with_max_len(1).map(one).collect());
    interrupt.check()?;
    // A task without a result was not started, as another one has failed, whose error `collect` returns.
    results.into_iter().flatten().collect()
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
