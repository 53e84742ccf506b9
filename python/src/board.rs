//! A board on a serial port, as `dermis host` uses it.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use dermis_golden::data::frame::Frame as Stress;
use dermis_golden::engine::{CheckPace, StreamChecks};
use dermis_golden::fixed::Model;
use dermis_host::link::{open_board, HostError, Session};
use pyo3::exceptions::{PyOSError, PyRuntimeError};
use pyo3::prelude::*;
use pyo3::types::PyIterator;

use crate::exceptions::{fixed, input};
use crate::frame::{frames, Frame, Frames};
use crate::reconstruction::Reconstruction;
use crate::scene::Scene;

pyo3::create_exception!(
    dermis,
    BoardError,
    PyOSError,
    "A board cannot be used: a port that fails, no answer, a board that was built for another scene."
);

/// A board behind a serial port, or a core behind Ethernet, which reconstructs with a scene's hardware.
///
/// The port belongs to it until it is closed, at the end of a `with` block or with its last reference.
///
/// Parameters
/// ----------
/// port : str
///     Path of the port, such as "/dev/ttyUSB0", or of the pseudo-terminal of `dermis board`; or "udp:192.168.1.50", the address of
///     a core behind Ethernet, of several arrays with a number as in "udp:192.168.1.50#3", whose results have the time at which the core had the frame in time_ns, if the frame has none.
/// scene : Scene
///     The scene for which the board was built.
/// baud : int, optional
///     Bit rate; default: that of the scene's board.
/// timeout_s : float, default 1
///     Seconds without an answer after which a request is sent again.
/// check : bool, default False
///     Compare every answer with the bit-true model; a difference raises RuntimeError.
/// cross_check : int, optional
///     Cross-check every so many results with the estimator evidence, before they are returned; 0: never. Default: the newest
///     results, beside the others, as often as there is time. checks["cross_check_age"] says how many results ago.
/// tare : Frame, optional
///     Frame without contact, which takes the place of the scene's tare.
///
/// Raises
/// ------
/// BoardError
///     A port that cannot be opened, no answer, a board of another scene.
/// InputError
///     A scene without hardware or whose board has no UART, a tare of another sensor.
#[pyclass(frozen, module = "dermis")]
pub struct Board {
    /// `None` once it is closed.
    session: Mutex<Option<(Session, StreamChecks)>>,
    scene: Py<Scene>,
}

/// A failed exchange with a board as the exception of its cause.
fn failure(error: anyhow::Error) -> PyErr {
    match error.downcast::<HostError>() {
        Ok(error) => BoardError::new_err(error.to_string()),
        Err(error) => input(error),
    }
}

/// The exception for a board that was closed.
fn closed() -> PyErr {
    BoardError::new_err("the board is closed")
}

impl Board {
    fn request(&self, py: Python<'_>, frame: &Stress) -> PyResult<Reconstruction> {
        let scene = self.scene.get();
        py.detach(|| {
            let mut session = self.session.lock().unwrap_or_else(PoisonError::into_inner);
            let (session, checks) = session.as_mut().ok_or_else(closed)?;
            let (readings, answer) = session.request(frame).map_err(failure)?;
            if let Some(Some(difference)) = &answer.difference {
                return Err(PyRuntimeError::new_err(format!(
                    "frame {}: board and model differ: {difference}",
                    frame.id
                )));
            }
            let result = answer.decode(&session.model, &readings).map_err(fixed)?;
            let mut result = result.ok_or_else(|| PyRuntimeError::new_err("the answer has no forces"))?;
            checks.add(std::slice::from_ref(&readings), result.resultant_N, &mut result.diagnostics());
            let time_ns = frame.time_ns.or(answer.acquired.map(|acquired| acquired.time_ns));
            Ok(Reconstruction::new(Arc::new(result), time_ns, &scene.spec().sensor))
        })
    }
}

#[pymethods]
impl Board {
    #[new]
    #[allow(clippy::too_many_arguments)]
    #[pyo3(signature = (port, scene, *, baud = None, timeout_s = 1.0, check = false, cross_check = None, tare = None))]
    fn new(
        py: Python<'_>,
        port: &str,
        scene: Py<Scene>,
        baud: Option<u32>,
        timeout_s: f64,
        check: bool,
        cross_check: Option<u64>,
        tare: Option<&Frame>,
    ) -> PyResult<Board> {
        let spec = scene.get().spec();
        let timeout = Duration::try_from_secs_f64(timeout_s)
            .map_err(|error| input(format!("timeout_s = {timeout_s}: {error}")))?;
        if let Some(tare) = tare {
            tare.0.check(spec).map_err(input)?;
        }
        let session = py.detach(|| {
            let model = Model::new(spec).map_err(fixed)?;
            let board = open_board(port, &model, baud, timeout, "host").map_err(failure)?;
            let checks = StreamChecks::new(&model, cross_check.map_or(CheckPace::Beside, CheckPace::Every));
            let session = Session::new(board, model, None, tare.map(|tare| tare.0.as_ref()), true, check);
            Ok::<_, PyErr>((session.map_err(failure)?, checks))
        })?;
        Ok(Board { session: Mutex::new(Some(session)), scene })
    }

    /// Send one frame and return the board's forces.
    ///
    /// Parameters
    /// ----------
    /// frame : array of shape (rows, cols), or Frame
    ///     As in Scene.reconstruct.
    ///
    /// Raises
    /// ------
    /// BoardError
    ///     No answer.
    /// InputError
    ///     A frame of another shape.
    fn reconstruct(&self, py: Python<'_>, frame: &Bound<'_, PyAny>) -> PyResult<Reconstruction> {
        let Frames { frames, single } = frames(self.scene.get().spec(), frame)?;
        let one = frames.first().filter(|_| single).ok_or_else(|| input("frame: wanted one frame"))?;
        self.request(py, one)
    }

    /// Iterate over frames: each is sent when its result is asked for.
    ///
    /// Parameters
    /// ----------
    /// frames : iterable of arrays of shape (rows, cols), or of Frame
    ///     Also one that never ends, such as a generator that reads a sensor.
    ///
    /// Returns
    /// -------
    /// iterator of Reconstruction
    fn stream(board: Py<Board>, frames: &Bound<'_, PyAny>) -> PyResult<Answers> {
        Ok(Answers { board, frames: frames.try_iter()?.unbind() })
    }

    /// Numbers of requests that were sent again and of answers that were damaged, so far.
    #[getter]
    fn link_errors(&self, py: Python<'_>) -> PyResult<(u64, u64)> {
        py.detach(|| {
            let session = self.session.lock().unwrap_or_else(PoisonError::into_inner);
            let errors = session.as_ref().ok_or_else(closed)?.0.board.link_errors();
            Ok((errors.repeated, errors.damaged))
        })
    }

    /// Give the port back; the board answers no more.
    fn close(&self, py: Python<'_>) {
        py.detach(|| drop(self.session.lock().unwrap_or_else(PoisonError::into_inner).take()));
    }

    fn __enter__(own: Py<Board>) -> Py<Board> {
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

/// The results of a board, one for each frame of an iterable.
#[pyclass(frozen, module = "dermis")]
pub struct Answers {
    board: Py<Board>,
    frames: Py<PyIterator>,
}

#[pymethods]
impl Answers {
    fn __iter__(own: Py<Answers>) -> Py<Answers> {
        own
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<Reconstruction>> {
        let Some(frame) = self.frames.bind(py).clone().next() else { return Ok(None) };
        self.board.get().reconstruct(py, &frame?).map(Some)
    }
}
