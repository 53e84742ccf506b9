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
use super::tracks::Tracks;
use super::{Engine, EngineError, State};
use crate::data::frame::Frame;
use crate::data::input::memory::Memory;
use crate::estimate::float::Past;
use crate::result::checks::history::History;
use crate::result::reconstruct::{Diagnostics, Reconstruction};
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
    /// Of the frames before.
    memory: Memory,
    resultant_N: [f64; 3],
}

/// What a stream and its worker hand to each other.
#[derive(Default)]
struct Exchange {
    job: Option<Job>,
    found: Option<(u64, Finding)>,
    closed: bool,
}

/// The thread beside a stream.
#[derive(Default)]
struct Worker {
    exchange: Mutex<Exchange>,
    changed: Condvar,
}

impl Worker {
    fn exchange(&self) -> MutexGuard<'_, Exchange> {
        self.exchange.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Answers jobs until the stream ends.
    fn work(&self, check: &CrossCheck) {
        let mut past = Past::default();
        loop {
            let mut exchange = self.exchange();
            let job = loop {
                match exchange.job.take() {
                    _ if exchange.closed => return,
                    Some(job) => break job,
                    None => exchange = self.changed.wait(exchange).unwrap_or_else(PoisonError::into_inner),
                }
            };
            drop(exchange);
            past = past.with_memory(job.memory);
            if let Some(finding) = check.finding(&job.frames, &mut past, job.resultant_N) {
                self.exchange().found = Some((job.number, finding));
            }
        }
    }
}

/// The checks of the results of an engine in the order of time.
pub struct StreamChecks {
    scene: Scene,
    /// That after the frames of the last result of [`StreamChecks::next`].
    state: State,
    history: History,
    tracks: Tracks,
    /// Frames of a block that is not complete.
    waiting: Vec<Frame>,
    /// What the last frames of the cross-check leave, where it has no thread of its own.
    checked: Past,
    check: Option<Arc<CrossCheck>>,
    pace: CheckPace,
    worker: Option<Arc<Worker>>,
    /// Number of the next result.
    next: u64,
    found: Option<(u64, Finding)>,
}

impl StreamChecks {
    /// Nothing received yet by `engine`.
    pub fn new(engine: &(impl Engine + ?Sized), pace: CheckPace) -> StreamChecks {
        let mut checks = StreamChecks {
            scene: engine.scene().clone(),
            state: State::default(),
            history: History::new(engine.scene()),
            tracks: Tracks::default(),
            waiting: Vec::new(),
            checked: Past::default(),
            check: None,
            pace,
            worker: None,
            next: 0,
            found: None,
        };
        checks.change(engine);
        checks
    }

    /// Takes the results of another `engine` of the same scene from now on. What the frames so far show stays; the cross-check begins
    /// anew.
    pub fn change(&mut self, engine: &(impl Engine + ?Sized)) {
        self.close();
        self.check = match self.pace {
            CheckPace::Never | CheckPace::Every(0) => None,
            CheckPace::Every(_) | CheckPace::Beside => CrossCheck::of(engine).map(Arc::new),
        };
        self.worker = self.check.as_ref().filter(|_| self.pace == CheckPace::Beside).map(|check| {
            let (worker, check) = (Arc::new(Worker::default()), Arc::clone(check));
            let own = Arc::clone(&worker);
            // Not joined: the stream does not wait for a finding after its end.
            std::thread::spawn(move || own.work(&check));
            worker
        });
        self.scene = engine.scene().clone();
        self.state.past = std::mem::take(&mut self.state.past).without_fits();
        (self.checked, self.found) = (Past::default(), None);
    }

    /// Ends the thread of the cross-check.
    fn close(&self) {
        if let Some(worker) = &self.worker {
            worker.exchange().closed = true;
            worker.changed.notify_one();
        }
    }

    /// The next result of `engine`, with figures and flags; of `frames` as [`StreamChecks::add`] has them.
    ///
    /// # Errors
    /// As [`Engine::reconstruct_after`].
    pub fn next(&mut self, engine: &(impl Engine + ?Sized), frames: &[Frame]) -> Result<Reconstruction, EngineError> {
        // Only the cross-check begins where the engine began.
        let before = self.check.as_ref().map(|_| self.state.past.memory.clone()).unwrap_or_default();
        let mut result = engine.reconstruct_after(&mut self.state, frames)?;
        self.state.begun = true;
        self.tracks.follow(&self.scene.sensor, &mut result);
        self.add_after(before, frames, result.resultant_N, &mut result.diagnostics());
        Ok(result)
    }

    /// The result of `engine` whose block `frame` completes, with the frames of the block; `None` before. Where the mean slides, every
    /// frame has a result.
    ///
    /// # Errors
    /// As [`Engine::reconstruct_after`]; the frames of the block are dropped.
    pub fn push(
        &mut self,
        engine: &(impl Engine + ?Sized),
        frame: Frame,
    ) -> Result<Option<(Vec<Frame>, Reconstruction)>, EngineError> {
        self.waiting.push(frame);
        if self.waiting.len() < self.scene.input.frames_per_result() {
            return Ok(None);
        }
        let frames = std::mem::take(&mut self.waiting);
        let result = self.next(engine, &frames)?;
        Ok(Some((frames, result)))
    }

    /// Adds figures and flags to the next result, with this resultant in N, of `frames`, its own. Zeros are fixed, and nothing slides.
    pub fn add(&mut self, frames: &[Frame], resultant_N: [f64; 3], result: &mut Diagnostics) {
        self.add_after(Memory::default(), frames, resultant_N, result);
    }

    /// The same after the frames of which `memory` is.
    fn add_after(&mut self, memory: Memory, frames: &[Frame], resultant_N: [f64; 3], result: &mut Diagnostics) {
        let number = self.next;
        self.next += 1;
        let checks = self.history.add(frames, *result.checks);
        result.add_checks(&self.scene, checks);
        let Some(check) = &self.check else { return };
        match (&self.worker, self.pace) {
            (Some(worker), _) => {
                let mut exchange = worker.exchange();
                exchange.job = Some(Job { number, frames: frames.to_vec(), memory, resultant_N });
                self.found = exchange.found.take().or(self.found.take());
                worker.changed.notify_one();
            }
            (None, CheckPace::Every(period)) if number.is_multiple_of(period) => {
                self.checked = std::mem::take(&mut self.checked).with_memory(memory);
                self.found = check.finding(frames, &mut self.checked, resultant_N).map(|finding| (number, finding));
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
        self.close();
    }
}
