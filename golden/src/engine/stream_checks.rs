//! Stream checks: what the frames before say of a result, and what the cross-check says of it or of an earlier one.
//!
//! ```text
//! Every(k)   results    0   1   2   3        Beside     results    0   1   2   3   4
//! (k = 2)    evidence   0       2            (a thread) evidence   0───────────3──────
//!            of result  0   0   2   2                   of result  –   –   –   0   0
//! ```
//!
//! The age of a finding in results is `cross_check_age`.

use super::cross_check::{CrossCheck, Finding};
use super::Engine;
use crate::data::frame::Frame;
use crate::result::checks::history::History;
use crate::result::reconstruct::Limits;
use crate::spec::scene::Scene;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// When the cross-check runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CheckPace {
    /// Never.
    Never,
    /// Before the result is given, at every so many results, from the first one on; with 0 never.
    Every(u64),
    /// In a thread of its own, always on the newest result, so that no result waits for it.
    Beside,
}

/// A result that waits for its finding.
struct Job {
    number: u64,
    frames: Vec<Frame>,
    resultant_N: [f64; 3],
}

/// What a stream and the thread beside it hand to each other.
#[derive(Default)]
struct Desk {
    job: Option<Job>,
    found: Option<(u64, Finding)>,
    closed: bool,
}

/// A desk, and the sign that something is on it.
#[derive(Default)]
struct Shared {
    desk: Mutex<Desk>,
    changed: Condvar,
}

impl Shared {
    fn desk(&self) -> MutexGuard<'_, Desk> {
        self.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Answers jobs until the desk is closed.
    fn work(&self, check: &CrossCheck) {
        loop {
            let mut desk = self.desk();
            let job = loop {
                match desk.job.take() {
                    _ if desk.closed => return,
                    Some(job) => break job,
                    None => desk = self.changed.wait(desk).unwrap_or_else(PoisonError::into_inner),
                }
            };
            drop(desk);
            if let Some(finding) = check.finding(&job.frames, job.resultant_N) {
                self.desk().found = Some((job.number, finding));
            }
        }
    }
}

/// The checks of the results of one engine in the order of time.
pub struct StreamChecks {
    scene: Scene,
    history: History,
    check: Option<Arc<CrossCheck>>,
    pace: CheckPace,
    beside: Option<Arc<Shared>>,
    /// Number of the next result.
    next: u64,
    found: Option<(u64, Finding)>,
}

impl StreamChecks {
    /// Nothing received yet by `engine`.
    pub fn new(engine: &(impl Engine + ?Sized), pace: CheckPace) -> StreamChecks {
        let check = match pace {
            CheckPace::Never | CheckPace::Every(0) => None,
            CheckPace::Every(_) | CheckPace::Beside => CrossCheck::of(engine).map(Arc::new),
        };
        let beside = check.as_ref().filter(|_| pace == CheckPace::Beside).map(|check| {
            let (shared, check) = (Arc::new(Shared::default()), Arc::clone(check));
            let its = Arc::clone(&shared);
            // Not joined: the stream does not wait for a finding that nobody reads.
            std::thread::spawn(move || its.work(&check));
            shared
        });
        let (scene, history) = (engine.scene().clone(), History::new(engine.scene()));
        StreamChecks { scene, history, check, pace, beside, next: 0, found: None }
    }

    /// Adds figures and flags to the next result, with this resultant in N, of `frames`: of a block its own, of a sliding mean
    /// all so far.
    pub fn add(&mut self, frames: &[Frame], resultant_N: [f64; 3], result: &mut Limits) {
        let number = self.next;
        self.next += 1;
        let new = if self.scene.input.slides() { 1 } else { frames.len() };
        let checks = self.history.add(&frames[frames.len().saturating_sub(new)..], *result.checks);
        result.add_checks(&self.scene, checks);
        let Some(check) = &self.check else { return };
        match (&self.beside, self.pace) {
            (Some(shared), _) => {
                let mut desk = shared.desk();
                desk.job = Some(Job { number, frames: frames.to_vec(), resultant_N });
                self.found = desk.found.take().or(self.found.take());
                shared.changed.notify_one();
            }
            (None, CheckPace::Every(period)) if number % period == 0 => {
                self.found = check.finding(frames, resultant_N).map(|finding| (number, finding));
            }
            _ => (),
        }
        if let Some((of, finding)) = &self.found {
            check.add(finding, number - of, result);
        }
    }
}

impl Drop for StreamChecks {
    fn drop(&mut self) {
        if let Some(shared) = &self.beside {
            shared.desk().closed = true;
            shared.changed.notify_one();
        }
    }
}
