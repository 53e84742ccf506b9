//! Frames with known forces, and frames from arrays.

use std::path::PathBuf;
use std::sync::Arc;

use dermis_golden::data::frame::Frame as Stress;
use dermis_golden::spec::scene::Scene;
use numpy::{PyArray1, PyArray2, PyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};

use crate::arrays::{array, cube, grid, interleaved, readings, shape};
use crate::datasets;
use crate::exceptions::input;

/// The stress on every taxel at one moment, with its true forces where they are known.
#[pyclass(frozen, module = "dermis")]
pub struct Frame(pub(crate) Arc<Stress>);

impl From<Stress> for Frame {
    fn from(frame: Stress) -> Frame {
        Frame(Arc::new(frame))
    }
}

impl Frame {
    fn lengths(&self) -> [usize; 2] {
        [self.0.sensor.rows, self.0.sensor.cols]
    }
}

#[pymethods]
impl Frame {
    /// Read a frame from a .json file that has its sensor; Scene.load_frames reads the others.
    ///
    /// Raises
    /// ------
    /// InputError
    ///     A file that cannot be read; the message names file, line and field.
    #[staticmethod]
    fn load(path: PathBuf) -> PyResult<Frame> {
        Ok(Stress::load(path, None).map_err(input)?.into())
    }

    /// Name of the frame.
    #[getter]
    fn id(&self) -> &str {
        &self.0.id
    }

    /// Normal stress in MPa, shape (rows, cols); compression is positive, NaN where a reading is missing.
    #[getter]
    fn stress_MPa<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        grid(py, &self.0.readings(), self.lengths())
    }

    /// When it was acquired, in ns since 1970 or since a moment that its file does not say; None where it is not known.
    #[getter]
    fn time_ns(&self) -> Option<i64> {
        self.0.time_ns
    }

    /// True force of all contacts in N, shape (3,): x, y, normal; None where it is not known.
    #[getter]
    fn resultant_N<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.0.resultant_N.map(|force| array(py, force))
    }

    /// True force on each taxel's cell in N, shape (rows, cols, 3); None where it is not known.
    #[getter]
    fn cell_forces_N<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray3<f64>>>> {
        let [rows, cols] = self.lengths();
        let cells = self.0.cell_forces_N.as_ref();
        cells.map(|cells| cube(py, interleaved(cells).collect(), [rows, cols, 3])).transpose()
    }

    /// The frame as the text of a .json file.
    fn to_json(&self) -> String {
        self.0.to_json()
    }

    /// The frame as a dataset of xarray, which must be installed; the package's guide lists its variables.
    ///
    /// Raises
    /// ------
    /// ImportError
    ///     xarray is not installed.
    fn to_xarray<'py>(own: &Bound<'py, Frame>) -> PyResult<Bound<'py, PyAny>> {
        datasets::made("of_frame", own, &own.get().0.sensor)
    }

    fn __repr__(&self) -> String {
        let [rows, cols] = self.lengths();
        format!("Frame({:?}, {rows}×{cols}, peak {:.4} MPa)", self.0.id, self.0.peak_MPa())
    }
}

/// The frames of an argument, and whether it is a single one.
pub struct Frames {
    /// In the order of time.
    pub frames: Vec<Stress>,
    /// Whether the argument has no axis of time.
    pub single: bool,
}

/// The frames of the argument `frames`: an array of shape (rows, cols) or (time, rows, cols), a `Frame`, a list of them. A value
/// that is NaN, masked or None is a missing reading.
///
/// # Errors
/// `InputError` for another shape or type, or an infinite number.
pub fn frames(scene: &Scene, value: &Bound<'_, PyAny>) -> PyResult<Frames> {
    if let Ok(frame) = value.cast::<Frame>() {
        return Ok(Frames { frames: vec![frame.get().0.as_ref().clone()], single: true });
    }
    if let Some(frames) = listed(value)? {
        return Ok(Frames { frames, single: false });
    }
    let array = readings("frames", value)?;
    let (rows, cols) = (scene.sensor.rows, scene.sensor.cols);
    let single = array.ndim() == 2;
    if !(single || array.ndim() == 3) || array.shape()[array.ndim() - 2..] != [rows, cols] {
        return Err(input(format!(
            "frames has shape {}, scene {} wants ({rows}, {cols}) or (time, {rows}, {cols})",
            shape(array.shape()),
            scene.name
        )));
    }
    let of_time = |(time, stress): (usize, &[f64])| {
        let id = if single { "frame".to_owned() } else { format!("frame {time}") };
        Stress::from_stress(&id, &scene.sensor, stress.to_vec()).map_err(input)
    };
    let frames = array.as_slice()?.chunks(scene.sensor.taxels()).enumerate().map(of_time);
    Ok(Frames { frames: frames.collect::<PyResult<_>>()?, single })
}

/// The frames of a list or tuple that begins with a `Frame`.
fn listed(value: &Bound<'_, PyAny>) -> PyResult<Option<Vec<Stress>>> {
    if !(value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>()) {
        return Ok(None);
    }
    let items: Vec<Bound<'_, PyAny>> = value.try_iter()?.collect::<PyResult<_>>()?;
    if !items.first().is_some_and(|first| first.is_instance_of::<Frame>()) {
        return Ok(None);
    }
    let frame = |(index, item): (usize, &Bound<'_, PyAny>)| match item.cast::<Frame>() {
        Ok(frame) => Ok(frame.get().0.as_ref().clone()),
        Err(_) => Err(input(format!("frames[{index}] is not a Frame, frames[0] is one"))),
    };
    items.iter().enumerate().map(frame).collect::<PyResult<_>>().map(Some)
}

/// Make one dataset of xarray of frames of one sensor, with an axis of time, as Frame.to_xarray has it of one.
///
/// Parameters
/// ----------
/// frames : iterable of Frame
///     At least one, all of the same array.
///
/// Raises
/// ------
/// InputError
///     No frame, what is none, or frames of different arrays.
/// ImportError
///     xarray is not installed.
#[pyfunction]
pub fn frames_to_xarray<'py>(frames: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let (mut sensor, mut all) = (None, Vec::new());
    for (index, frame) in frames.try_iter()?.enumerate() {
        let frame = frame?;
        let own = frame.cast::<Frame>().map_err(|_| input(format!("frames[{index}] is not a Frame")))?;
        let own = own.get().0.sensor.clone();
        let first = sensor.get_or_insert_with(|| own.clone());
        if *first != own {
            return Err(input(format!("frames[{index}] has the array {own}, frames[0] {first}")));
        }
        all.push(frame);
    }
    match sensor {
        Some(sensor) => datasets::made("of_frames", PyList::new(frames.py(), all)?.as_any(), &sensor),
        None => Err(input("frames is empty, wanted at least one")),
    }
}
