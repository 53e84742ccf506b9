//! Estimators: what computes the results of a stream, the scene's estimator or a faster one that keeps up with the frames.
//!
//! ```text
//! frames ── StreamChecks ── engine of the estimator that is taken ── result, its time ── Keeper ── another estimator?
//! ```
//! What the frames before show stays where the estimator changes: zeros, history, a block that is not complete. The cross-check
//! with `evidence` begins where another estimator is taken.

use std::time::Duration;

use anyhow::Result;
use dermis_golden::data::frame::Frame;
use dermis_golden::data::input::Input;
use dermis_golden::engine::{CheckPace, Engine, EngineError, StreamChecks};
use dermis_golden::estimate::float::Golden;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::scene::{EstimatorKind, Scene};

use super::rate::{Clock, Keeper, Progress, Verdict};
use crate::engine::EngineName;

/// An estimator that is taken where a better one does not keep up; its engine is built when that is so.
pub struct Faster<'a> {
    name: &'static str,
    build: Box<dyn Fn() -> Result<Box<dyn Engine>> + 'a>,
    built: Option<Box<dyn Engine>>,
}

impl<'a> Faster<'a> {
    /// The estimator `name`, whose engine `build` builds.
    pub fn new(name: &'static str, build: impl Fn() -> Result<Box<dyn Engine>> + 'a) -> Faster<'a> {
        Faster { name, build: Box::new(build), built: None }
    }

    /// Its name.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Its engine, built anew.
    ///
    /// # Errors
    /// A scene that the engine refuses.
    pub fn build(&self) -> Result<Box<dyn Engine>> {
        (self.build)()
    }

    /// Those that a stream takes where the scene's one does not keep up: none with another engine than `golden`, nor where the scene
    /// states its estimator, unless frames are `wanted_Hz` at this rate.
    pub fn of_stream(scene: &'a Scene, name: EngineName, wanted_Hz: Option<f64>) -> Vec<Faster<'a>> {
        let free = scene.search.estimator.is_none() || wanted_Hz.is_some();
        if free && name == EngineName::Golden {
            Faster::of_scene(scene)
        } else {
            Vec::new()
        }
    }

    /// Those of a scene in floating point, the best first: after one with evidence the network, where the scene names one, and the
    /// search.
    pub fn of_scene(scene: &'a Scene) -> Vec<Faster<'a>> {
        let network = scene.search.network.as_ref().map(|_| EstimatorKind::Network);
        let kinds = network.into_iter().chain([EstimatorKind::Search]);
        let faster = |kind: EstimatorKind| {
            Faster::new(kind.name(), move || Ok(Box::new(Golden::with(scene, kind)?) as Box<dyn Engine>))
        };
        kinds.filter(|_| scene.model_estimator().has_evidence()).map(faster).collect()
    }
}

/// What is to be said of a stream.
#[derive(Clone, Debug, PartialEq)]
pub struct Note {
    /// A sentence.
    pub text: String,
    /// Whether results have another estimator from now on.
    pub changed: bool,
}

/// The estimators of a stream, and what its frames show.
pub struct Estimators<'a> {
    first: &'a dyn Engine,
    faster: Vec<Faster<'a>>,
    checks: StreamChecks,
    pace: CheckPace,
    keeper: Keeper,
    clock: Clock,
    /// Time that the frames of a block have taken.
    busy: Duration,
}

impl<'a> Estimators<'a> {
    /// The estimator of `first`, and where that does not keep up with the frames, of which `wanted_Hz` arrive per second or as many
    /// as are measured, `faster` ones, the best first. Results are cross-checked at `pace`.
    pub fn new(
        first: &'a dyn Engine,
        faster: Vec<Faster<'a>>,
        pace: CheckPace,
        wanted_Hz: Option<f64>,
        clock: Clock,
    ) -> Estimators<'a> {
        let own = first.estimator().name();
        let names: Vec<&'static str> = std::iter::once(own).chain(faster.iter().map(|own| own.name)).collect();
        let keeper = Keeper::new(wanted_Hz, first.scene().input.frames_per_result(), &names);
        let checks = StreamChecks::new(first, pace);
        Estimators { first, faster, checks, pace, keeper, clock, busy: Duration::ZERO }
    }

    /// The same estimator for every frame.
    pub fn only(engine: &'a dyn Engine, pace: CheckPace) -> Estimators<'a> {
        Estimators::new(engine, Vec::new(), pace, None, Clock::default())
    }

    /// The same with this share of a core, above 0 and at most 1: the others are for other streams.
    #[must_use]
    pub fn with_share(self, share: f64) -> Estimators<'a> {
        Estimators { keeper: self.keeper.with_share(share), ..self }
    }

    /// Forgets the frames so far.
    pub(super) fn restart(&mut self) {
        self.checks = StreamChecks::new(engine(self.first, &self.faster, self.keeper.taken()), self.pace);
    }

    /// The scene's input options.
    pub(super) fn input(&self) -> &'a Input {
        self.first.input()
    }

    /// The clock of the stream.
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// The scene.
    pub fn scene(&self) -> &'a Scene {
        self.first.scene()
    }

    /// Name of the estimator of the next result.
    pub fn name(&self) -> &'static str {
        self.keeper.name()
    }

    /// The estimators, the best first, separated by commas; `None` where there is only one.
    pub fn choice(&self) -> Option<String> {
        let names = |all: &[Faster]| all.iter().map(|own| own.name).collect::<Vec<_>>().join(", ");
        (!self.faster.is_empty()).then(|| format!("{}, {}", self.first.estimator().name(), names(&self.faster)))
    }

    /// As [`StreamChecks::push`].
    ///
    /// # Errors
    /// As [`StreamChecks::push`].
    pub fn push(&mut self, frame: Frame) -> Result<Option<(Vec<Frame>, Reconstruction)>, EngineError> {
        self.timed(|checks, engine| checks.push(engine, frame))
    }

    /// As [`StreamChecks::next`].
    ///
    /// # Errors
    /// As [`StreamChecks::next`].
    pub fn next(&mut self, frames: &[Frame]) -> Result<Reconstruction, EngineError> {
        self.timed(|checks, engine| checks.next(engine, frames))
    }

    fn timed<R>(
        &mut self,
        call: impl FnOnce(&mut StreamChecks, &dyn Engine) -> Result<R, EngineError>,
    ) -> Result<R, EngineError> {
        let begun = self.clock.now();
        let result = call(&mut self.checks, engine(self.first, &self.faster, self.keeper.taken()));
        self.busy = match result {
            Ok(_) => self.busy + self.clock.now().saturating_sub(begun),
            Err(_) => Duration::ZERO,
        };
        result
    }

    /// What follows after a result, whose last line has number `line` and was read at `received`; `full` lines so far found the
    /// queue full.
    pub fn after(&mut self, line: u64, received: Duration, full: u64) -> Option<Note> {
        let (now, busy) = (self.clock.now(), std::mem::take(&mut self.busy));
        match self.keeper.after(Progress { now, busy, line, received, full }) {
            Verdict::Hold => None,
            Verdict::Take(candidate, why) => Some(self.take(candidate, why)),
            Verdict::Behind(why) => Some(Note { text: format!("behind: {why}"), changed: false }),
            Verdict::CaughtUp => Some(Note { text: format!("{} keeps up again", self.name()), changed: false }),
        }
    }

    /// Takes an estimator, or leaves it out where it cannot be built.
    fn take(&mut self, candidate: usize, why: String) -> Note {
        if let Some(own) = candidate.checked_sub(1).map(|index| &mut self.faster[index]) {
            match own.built.take().map_or_else(|| own.build(), Ok) {
                Ok(engine) => own.built = Some(engine),
                Err(error) => {
                    let text = format!("{} is left out: {error}", own.name);
                    self.faster.remove(candidate - 1);
                    self.keeper.leave_out(candidate);
                    return Note { text, changed: false };
                }
            }
        }
        self.keeper.take(candidate, self.clock.now());
        self.checks.change(engine(self.first, &self.faster, candidate));
        Note { text: format!("{} from now on: {why}", self.name()), changed: true }
    }
}

/// The engine of an estimator by its number; of one that is not built the first.
fn engine<'e>(first: &'e dyn Engine, faster: &'e [Faster], taken: usize) -> &'e dyn Engine {
    let built = taken.checked_sub(1).and_then(|index| faster.get(index)?.built.as_deref());
    built.unwrap_or(first)
}
