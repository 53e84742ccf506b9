//! Trackers: the frames of a sensor in the order of time, one by one.

use std::sync::{Arc, Mutex, PoisonError};

use dermis_golden::data::frame::Frame as Stress;
use dermis_golden::engine::{CheckPace, CheckedEngine, StreamChecks};
use dermis_golden::spec::scene::Scene;
use dermis_host::engine::{typed, SharedEngine};
use pyo3::prelude::*;

use crate::exceptions::{input, model};
use crate::frame::{frames, Frames};
use crate::reconstruction::Reconstruction;

/// The frames of a sensor in the order of time, and what they show of it; Scene.tracker makes one.
///
/// A result is that of `dermis reconstruct --stream`: means of blocks, zeros that follow the readings, the flags of a taxel that
/// stands still; the estimator evidence begins where the last frame ended, which is many times faster. Memory does not grow.
#[pyclass(frozen, module = "dermis")]
pub struct Tracker {
    scene: Scene,
    engine: Arc<CheckedEngine<SharedEngine>>,
    pace: CheckPace,
    /// `None` once it is closed.
    checks: Mutex<Option<StreamChecks>>,
}

impl Tracker {
    /// Nothing received yet.
    pub fn new(scene: &Scene, engine: Arc<CheckedEngine<SharedEngine>>, pace: CheckPace) -> Tracker {
        let checks = Mutex::new(Some(StreamChecks::new(engine.engine(), pace)));
        Tracker { scene: scene.clone(), engine, pace, checks }
    }

    fn set(&self, checks: Option<StreamChecks>) {
        *self.checks.lock().unwrap_or_else(PoisonError::into_inner) = checks;
    }
}

#[pymethods]
impl Tracker {
    /// Take the next frame.
    ///
    /// Parameters
    /// ----------
    /// frame : array of shape (rows, cols), or Frame
    ///     As for Scene.reconstruct.
    /// time_ns : int, optional
    ///     When it was acquired, in nanoseconds of any clock, such as time.time_ns(); default: the Frame's own.
    ///
    /// Returns
    /// -------
    /// Reconstruction or None
    ///     None where input.average = k, until the last of 2^k frames; time_ns is that of the last frame.
    ///
    /// Raises
    /// ------
    /// InputError
    ///     An array of another shape, a frame that the model refuses, which has no part in the results; a closed tracker.
    #[pyo3(signature = (frame, *, time_ns = None))]
    fn push(&self, py: Python<'_>, frame: &Bound<'_, PyAny>, time_ns: Option<i64>) -> PyResult<Option<Reconstruction>> {
        let Frames { mut frames, single } = frames(&self.scene, frame)?;
        let frame: Stress =
            frames.pop().filter(|_| single).ok_or_else(|| input("frame: a tracker takes one at a time"))?;
        let frame = Stress { time_ns: time_ns.or(frame.time_ns), ..frame };
        let result = py.detach(|| {
            let mut checks = self.checks.lock().unwrap_or_else(PoisonError::into_inner);
            let checks = checks.as_mut().ok_or_else(|| input("the tracker is closed"))?;
            checks.push(self.engine.engine(), frame).map_err(|error| model(typed(error)))
        })?;
        let timed = |(frames, result): (Vec<Stress>, _)| {
            Reconstruction::new(Arc::new(result), Stress::time_of_result(&frames), &self.scene.sensor)
        };
        Ok(result.map(timed))
    }

    /// Forget the frames so far: the next one is the first.
    fn reset(&self, py: Python<'_>) {
        py.detach(|| self.set(Some(StreamChecks::new(self.engine.engine(), self.pace))));
    }

    /// End the tracker; it takes no more frames.
    fn close(&self, py: Python<'_>) {
        py.detach(|| self.set(None));
    }

    fn __enter__(own: Py<Tracker>) -> Py<Tracker> {
        own
    }

    fn __exit__(
        &self,
        py: Python<'_>,
        _kind: &Bound<'_, PyAny>,
        _error: &Bound<'_, PyAny>,
        _traceback: &Bound<'_, PyAny>,
    ) {
        self.close(py);
    }
}
