//! Scenes, and what is computed of them.

use std::sync::{Arc, OnceLock};

use dermis_golden::data::frame::{Frame as Stress, FrameError};
use dermis_golden::data::generator::converter::Converter;
use dermis_golden::data::generator::slip::Slip;
use dermis_golden::data::generator::{generate, random_contacts, Draw, Shapes};
use dermis_golden::engine::{CheckPace, StreamChecks};
use dermis_golden::physics::forward::ForwardModel;
use dermis_golden::spec::scene::Scene as Spec;
use dermis_host::batch::Batch;
use dermis_host::engine::{self, EngineName, Engines};
use numpy::{PyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;
use std::path::PathBuf;

use crate::arrays::{cube, readings, shape};
use crate::contact::contacts;
use crate::exceptions::{input, model, not_allowed};
use crate::frame::{frames, Frame, Frames};
use crate::reconstruction::{Reconstruction, Reconstructions};
use crate::tracker::Tracker;

/// A sensor and the method that reconstructs its forces.
#[pyclass(frozen, module = "dermis")]
pub struct Scene {
    spec: Spec,
    engines: Engines,
    pub(crate) forward_model: OnceLock<ForwardModel>,
}

impl Scene {
    fn new(spec: Spec) -> Scene {
        Scene { spec, engines: Engines::default(), forward_model: OnceLock::new() }
    }

    /// The scene itself.
    pub fn spec(&self) -> &Spec {
        &self.spec
    }

    /// Rows and columns.
    pub fn lengths(&self) -> [usize; 2] {
        [self.spec.sensor.rows, self.spec.sensor.cols]
    }
}

/// An argument called `field` as a whole number of at least 0.
///
/// # Errors
/// `InputError` for a negative number or one that is too large.
pub fn count<T: TryFrom<i64>>(field: &str, value: i64) -> PyResult<T> {
    T::try_from(value).map_err(|_| not_allowed(field, value, "a whole number of at least 0"))
}

/// The taxel of an argument called `field`.
fn taxel(field: &str, [row, col]: [i64; 2]) -> PyResult<[usize; 2]> {
    Ok([count(field, row)?, count(field, col)?])
}

/// The shapes of random contacts by their name on the command line.
fn shapes_named(name: &str) -> PyResult<Shapes> {
    match name {
        "elliptic" => Ok(Shapes::Elliptic),
        "other" => Ok(Shapes::Other),
        _ => Err(not_allowed("shapes", format!("{name:?}"), "\"elliptic\" or \"other\"")),
    }
}

#[pymethods]
impl Scene {
    /// Make a scene from the text of a scene file.
    ///
    /// Parameters
    /// ----------
    /// text : str
    ///     TOML; the guide's page "your sensor" has every field.
    /// origin : str, default "scene.toml"
    ///     Path that stands in errors, and beside which the files are that the scene names.
    ///
    /// Raises
    /// ------
    /// InputError
    ///     A field that is unknown, missing or out of range.
    #[staticmethod]
    #[pyo3(signature = (text, origin = "scene.toml"))]
    fn from_toml(text: &str, origin: &str) -> PyResult<Scene> {
        Ok(Scene::new(Spec::parse(text, origin).map_err(input)?))
    }

    /// Load a scene by built-in name or by the path of its file, as the commands take it.
    ///
    /// Raises
    /// ------
    /// InputError
    ///     Neither a built-in name nor a file, or a field of the file.
    #[staticmethod]
    fn from_name(name: &str) -> PyResult<Scene> {
        Ok(Scene::new(Spec::load(name).map_err(input)?))
    }

    /// Names of the built-in scenes.
    #[staticmethod]
    fn builtin() -> Vec<&'static str> {
        Spec::builtin_names()
    }

    /// Name of the scene.
    #[getter]
    pub(crate) fn name(&self) -> &str {
        &self.spec.name
    }

    /// Number of rows, along y.
    #[getter]
    fn rows(&self) -> usize {
        self.spec.sensor.rows
    }

    /// Number of columns, along x.
    #[getter]
    fn cols(&self) -> usize {
        self.spec.sensor.cols
    }

    /// Distance of neighbouring taxels in mm: along x, along y.
    #[getter]
    fn pitch_mm(&self) -> (f64, f64) {
        (self.spec.sensor.pitch_x_mm, self.spec.sensor.pitch_y_mm)
    }

    /// Depth of the taxels under the surface in mm.
    #[getter]
    fn thickness_mm(&self) -> f64 {
        self.spec.sensor.thickness_mm
    }

    /// Centre of each taxel in mm from the array's centre, shape (rows, cols, 2): x, y.
    #[getter]
    fn positions_mm<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let [rows, cols] = self.lengths();
        let of_row = |row| (0..cols).flat_map(move |col| self.spec.sensor.position_mm(row, col));
        cube(py, (0..rows).flat_map(of_row).collect(), [rows, cols, 2])
    }

    /// Name of the estimator that the floating-point model takes, as in search.estimator.
    #[getter]
    fn estimator(&self) -> &'static str {
        self.spec.model_estimator().name()
    }

    /// Name of the estimator that the hardware and its bit-true model take, as in hardware.estimator.
    #[getter]
    fn hardware_estimator(&self) -> &'static str {
        self.spec.hardware_estimator().name()
    }

    /// Number of frames that one result takes: 2^average of a block, 1 of a mean that slides.
    #[getter]
    fn frames_per_result(&self) -> usize {
        self.spec.input.frames_per_result()
    }

    /// The frames that Dermis has for the scene's sensor, with their known forces.
    #[getter]
    fn frames(&self) -> Vec<Frame> {
        Stress::shipped(&self.spec).into_iter().map(Frame::from).collect()
    }

    /// Read all frames of a .csv, .json or .mcap file, or of a folder of them; `name.mcap:N` is frame N of a recording, from 1.
    ///
    /// Raises
    /// ------
    /// InputError
    ///     A file that cannot be read, or is of another sensor.
    fn load_frames(&self, path: PathBuf) -> PyResult<Vec<Frame>> {
        let checked = |frame: Stress| -> Result<Frame, FrameError> {
            frame.check(&self.spec)?;
            Ok(frame.into())
        };
        let frames = Stress::load_all(path, Some(&self.spec)).map_err(input)?;
        frames.into_iter().map(|frame| checked(frame).map_err(input)).collect()
    }

    /// Reconstruct the forces of one frame, or of frames in the order of time.
    ///
    /// Parameters
    /// ----------
    /// frames : array of shape (rows, cols) or (time, rows, cols), Frame, or list of Frame
    ///     Normal stress in MPa, compression positive; readings if the scene names a calibration or tare file.
    /// engine : "golden" or "fixed", default "golden"
    ///     The floating-point model, or the integers of the hardware bit for bit. Where the scene states no full scale
    ///     and "fixed" needs one, it takes the largest stress of all `frames`.
    /// cross_check : int, default 1
    ///     Every so many results, the estimator evidence reads the frames too, where the engine has another estimator, and
    ///     flags what noise, baseline or a faulty taxel hides from that, as `dermis reconstruct` does; 0: never. This takes
    ///     longer than a search. checks["cross_check_age"] says how many results ago.
    /// times_ns : sequence of int, shape (time,), optional
    ///     When each of several frames was acquired, in nanoseconds of any clock; default: the own times of Frames. A result has
    ///     that of the last of its frames.
    ///
    /// Returns
    /// -------
    /// Reconstruction
    ///     Of one frame; equal to what `dermis reconstruct` prints, to the last bit.
    /// Reconstructions
    ///     Of frames with an axis of time, a sequence: one result per frame; with input.average = k one per 2^k frames;
    ///     with input.mean = "sliding" or "adaptive" one per frame, of all frames up to it. With input.zero = "running"
    ///     the zero follows the readings from the first of them on.
    ///
    /// Raises
    /// ------
    /// InputError
    ///     An argument of another shape or type, a scene or frame that the model refuses.
    #[pyo3(signature = (frames, engine = "golden", *, cross_check = 1, times_ns = None))]
    fn reconstruct<'py>(
        &self,
        py: Python<'py>,
        frames: &Bound<'py, PyAny>,
        engine: &str,
        cross_check: u64,
        times_ns: Option<Vec<i64>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let name = EngineName::software(engine).map_err(model)?;
        let Frames { mut frames, single } = self::frames(&self.spec, frames)?;
        if let Some(times_ns) = times_ns {
            let (own, wanted) = (times_ns.len(), frames.len());
            if single || own != wanted {
                let of =
                    if single { "one frame without an axis of time".to_owned() } else { format!("{wanted} frames") };
                return Err(input(format!("times_ns has {own} values for {of}")));
            }
            frames.iter_mut().zip(times_ns).for_each(|(frame, ns)| frame.time_ns = Some(ns));
        }
        let engine = py.detach(|| self.engines.engine(name, &self.spec, &frames)).map_err(model)?;
        if single {
            let result = py.detach(|| engine::result(&engine, &frames, cross_check > 0)).map_err(model)?;
            let time_ns = Stress::time_of_result(&frames);
            return Ok(Bound::new(py, Reconstruction::new(Arc::new(result), time_ns, &self.spec.sensor))?.into_any());
        }
        let engine = engine.engine();
        let mut checks = StreamChecks::new(engine, CheckPace::Every(cross_check));
        let mut next = |frames: &[Stress]| {
            let result = checks.next(engine, frames).map_err(engine::typed)?;
            anyhow::Ok(Arc::new(result))
        };
        let (mut results, mut times_ns) = (Vec::new(), Vec::new());
        for frames in self.spec.input.frames_of_results(&frames) {
            times_ns.push(Stress::time_of_result(frames));
            results.push(py.detach(|| next(self.spec.input.newest(frames))).map_err(model)?);
            // Ctrl-C ends a long call.
            py.check_signals()?;
        }
        Ok(Bound::new(py, Reconstructions::new(results, times_ns, &self.spec.sensor))?.into_any())
    }

    /// Reconstruct frames that do not depend on each other, on all cores.
    ///
    /// Parameters
    /// ----------
    /// frames : array of shape (frames, rows, cols)
    ///     As for `reconstruct`. A contiguous array of float64 is read where it stands, without the interpreter's lock: nothing may
    ///     write to it meanwhile.
    /// engine : "golden" or "fixed", default "golden"
    ///     As for `reconstruct`.
    /// cross_check : bool, default True
    ///     Whether the estimator evidence reads every frame too, where the engine has another estimator. This takes longer than a
    ///     search.
    ///
    /// Returns
    /// -------
    /// Reconstructions
    ///     Those of each frame alone, in the order of the frames; with input.average = k one per 2^k frames. Frames of a sensor in the
    ///     order of time show more, and take less time with evidence: `reconstruct` and `tracker`.
    ///
    /// Raises
    /// ------
    /// InputError
    ///     An argument of another shape or type, a scene or frame that the model refuses; a scene whose results depend on the frames
    ///     before.
    #[pyo3(signature = (frames, engine = "golden", *, cross_check = true))]
    fn reconstruct_many(
        &self,
        py: Python<'_>,
        frames: &Bound<'_, PyAny>,
        engine: &str,
        cross_check: bool,
    ) -> PyResult<Reconstructions> {
        let name = EngineName::software(engine).map_err(model)?;
        let (array, [rows, cols]) = (readings("frames", frames)?, self.lengths());
        if array.ndim() != 3 || array.shape()[1..] != [rows, cols] {
            let (found, scene) = (shape(array.shape()), &self.spec.name);
            return Err(input(format!("frames has shape {found}, scene {scene} wants (frames, {rows}, {cols})")));
        }
        let stress_MPa = array.as_slice()?;
        let batch = py.detach(|| Batch::new(&self.engines, name, &self.spec, stress_MPa, cross_check));
        let (mut batch, mut results) = (batch.map_err(model)?, Vec::new());
        while let Some(chunk) = py.detach(|| batch.next()) {
            results.extend(chunk.map_err(model)?.into_iter().map(Arc::new));
            // Ctrl-C ends a long call.
            py.check_signals()?;
        }
        let times_ns = vec![None; results.len()];
        Ok(Reconstructions::new(results, times_ns, &self.spec.sensor))
    }

    /// Begin to reconstruct the frames of a sensor in the order of time, one by one.
    ///
    /// Parameters
    /// ----------
    /// engine : "golden" or "fixed", default "golden"
    ///     As for `reconstruct`; "fixed" of a scene that needs a full scale wants it stated.
    /// cross_check : int, default 1
    ///     As for `reconstruct`.
    ///
    /// Returns
    /// -------
    /// Tracker
    ///     Also a context manager.
    ///
    /// Raises
    /// ------
    /// InputError
    ///     A scene that the model refuses.
    #[pyo3(signature = (engine = "golden", *, cross_check = 1))]
    fn tracker(&self, py: Python<'_>, engine: &str, cross_check: u64) -> PyResult<Tracker> {
        let name = EngineName::software(engine).map_err(model)?;
        let begin = || {
            let engine = self.engines.of_stream(name, &self.spec)?;
            anyhow::Ok(Tracker::new(&self.spec, engine, CheckPace::Every(cross_check)))
        };
        py.detach(begin).map_err(model)
    }

    /// Compute a frame with known forces, as the scene's sensor reads it.
    ///
    /// Parameters
    /// ----------
    /// contacts : list of dict, optional
    ///     Contacts with the keys of a frame file: shape, centre_mm, size_mm, normal_N, tangential_N, kind_of_slip,
    ///     friction, rotation_rad; `dermis generate --help` lists the shapes.
    /// random : int, default 0
    ///     Number of random contacts, beside those described; at most 1000.
    /// shapes : "elliptic" or "other", default "elliptic"
    ///     Shapes of the random contacts.
    /// slip : str, default "full"
    ///     How the shear is spread over the random contacts: "full", "even", "mixed", or its share of the friction limit, such as "0.4".
    /// touching : bool, default False
    ///     Place random contacts so that they touch each other.
    /// seed : int, default 1
    ///     Seed of random contacts and of the noise.
    /// noise, gain_spread, drift : float, default 0
    ///     Standard deviations: of the noise of one frame over max |b|, of the taxels' gains, of the taxels' zeros since
    ///     the tare over max |b|.
    /// tare_frames : int, default 0
    ///     Frames without contact whose noisy mean is subtracted; 0: none.
    /// frames : int, default 1
    ///     Frames that are averaged, each with its own noise.
    /// unipolar : bool, default False
    ///     Whether tension reads as zero.
    /// bits : int, optional
    ///     Width of the codes to which the stress is rounded; 2 to 24.
    /// full_scale_MPa : float, optional
    ///     Stress of the largest code; default: the frame's peak.
    /// dead : list of (row, col), optional
    ///     Taxels that read zero.
    /// stuck : list of ((row, col), float), optional
    ///     Taxels that always read the given stress in MPa.
    /// id : str, default "generated"
    ///     Name of the frame.
    ///
    /// Raises
    /// ------
    /// InputError
    ///     No contact, a contact that is inconsistent or beside the array, an option out of range.
    #[allow(clippy::too_many_arguments)]
    #[pyo3(signature = (contacts = None, *, random = 0, shapes = "elliptic", slip = "full", touching = false, seed = 1,
        noise = 0.0, gain_spread = 0.0, drift = 0.0, tare_frames = 0, frames = 1, unipolar = false, bits = None,
        full_scale_MPa = None, dead = Vec::new(), stuck = Vec::new(), id = "generated"))]
    fn generate(
        &self,
        py: Python<'_>,
        contacts: Option<&Bound<'_, PyAny>>,
        random: i64,
        shapes: &str,
        slip: &str,
        touching: bool,
        seed: i64,
        noise: f64,
        gain_spread: f64,
        drift: f64,
        tare_frames: i64,
        frames: i64,
        unipolar: bool,
        bits: Option<i64>,
        full_scale_MPa: Option<f64>,
        dead: Vec<[i64; 2]>,
        stuck: Vec<([i64; 2], f64)>,
        id: &str,
    ) -> PyResult<Frame> {
        let mut all = contacts.map_or(Ok(Vec::new()), self::contacts)?;
        let seed = count("seed", seed)?;
        let slip: Slip = slip.parse().map_err(|error| input(format!("slip = {error}")))?;
        let draw = Draw { count: count("random", random)?, shapes: shapes_named(shapes)?, slip, touching, seed };
        draw.check().map_err(input)?;
        let converter = Converter {
            noise,
            gain_spread,
            drift,
            tare_frames: count("tare_frames", tare_frames)?,
            frames: count("frames", frames)?,
            unipolar,
            bits: bits.map(|bits| count("bits", bits)).transpose()?,
            full_scale_MPa,
            dead: dead.into_iter().map(|place| taxel("dead", place)).collect::<PyResult<_>>()?,
            stuck: stuck
                .into_iter()
                .map(|(place, reads)| Ok((taxel("stuck", place)?, reads)))
                .collect::<PyResult<_>>()?,
            seed,
        };
        py.detach(|| {
            all.extend(random_contacts(&self.spec.sensor, draw));
            let frame = generate(id, &self.spec.sensor, self.spec.medium, &all).map_err(input)?;
            Ok(converter.convert(&frame).map_err(input)?.into())
        })
    }

    fn __repr__(&self) -> String {
        let [rows, cols] = self.lengths();
        format!("Scene({:?}, {rows}×{cols}, estimator {:?})", self.spec.name, self.estimator())
    }
}
