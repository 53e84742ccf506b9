//! Scenes, and reconstruction of their frames.

use std::ffi::c_char;
use std::sync::OnceLock;

use dermis_golden::data::frame::Frame;
use dermis_golden::physics::forward::ForwardModel;
use dermis_golden::spec::scene::Scene;
use dermis_host::engine::{self, EngineName, Engines};

use crate::guard::{attempt, dermis_status, free, guarded, output, reference, text, values, Error};
use crate::result::dermis_result;

/// A sensor and the method that reconstructs its forces. Any number of threads may use one at the same time.
pub struct dermis_scene {
    pub(crate) spec: Scene,
    pub(crate) engines: Engines,
    pub(crate) forward_model: OnceLock<ForwardModel>,
}

impl dermis_scene {
    fn into_raw(spec: Scene) -> *mut dermis_scene {
        Box::into_raw(Box::new(dermis_scene { spec, engines: Engines::default(), forward_model: OnceLock::new() }))
    }
}

/// The frames of the argument `stress_MPa` of `count` values, which are whole frames of a scene's sensor, at least one.
///
/// # Errors
/// Another number of values, one that is infinite.
///
/// # Safety
/// As [`values`].
pub(crate) unsafe fn frames(scene: &Scene, stress_MPa: *const f64, count: usize) -> Result<Vec<Frame>, Error> {
    let sensor = &scene.sensor;
    let taxels = sensor.taxels();
    if count == 0 || !count.is_multiple_of(taxels) {
        let (name, rows, cols) = (&scene.name, sensor.rows, sensor.cols);
        return Err(Error::input(format!(
            "count = {count} is not allowed; scene {name} has frames of {rows} * {cols} = {taxels} values"
        )));
    }
    let stress = unsafe { values("stress_MPa", stress_MPa, count) }?;
    let frame = |(time, stress): (usize, &[f64])| {
        let id = if count == taxels { "frame".to_owned() } else { format!("frame {time}") };
        Frame::from_stress(&id, sensor, stress.to_vec()).map_err(Error::input)
    };
    stress.chunks(taxels).enumerate().map(frame).collect()
}

/// The only frame of `count` values, that of `what`, such as "a stream".
///
/// # Errors
/// As [`frames`]; several frames.
///
/// # Safety
/// As [`frames`].
pub(crate) unsafe fn one_frame(
    scene: &Scene,
    stress_MPa: *const f64,
    count: usize,
    what: &str,
) -> Result<Frame, Error> {
    let mut frames = unsafe { frames(scene, stress_MPa, count) }?;
    let (frame, others) = (frames.pop(), frames.len());
    frame
        .filter(|_| others == 0)
        .ok_or_else(|| Error::input(format!("count = {count} is not allowed; {what} takes one frame at a time")))
}

/// Load a scene by built-in name or by the path of its file, as the commands take it. The scene belongs to the caller:
/// dermis_scene_free. After an error *scene is NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_scene_load(name: *const c_char, scene: *mut *mut dermis_scene) -> dermis_status {
    guarded(|| {
        let scene = unsafe { output("scene", scene) }?;
        scene.write(std::ptr::null_mut());
        let spec = Scene::load(unsafe { text("name", name) }?).map_err(Error::input)?;
        scene.write(dermis_scene::into_raw(spec));
        Ok(())
    })
}

/// Make a scene from the text of a scene file. origin is the path that stands in errors, and beside which the files are that
/// the scene names. The scene belongs to the caller: dermis_scene_free. After an error *scene is NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_scene_parse(
    toml: *const c_char,
    origin: *const c_char,
    scene: *mut *mut dermis_scene,
) -> dermis_status {
    guarded(|| {
        let scene = unsafe { output("scene", scene) }?;
        scene.write(std::ptr::null_mut());
        let (toml, origin) = unsafe { (text("toml", toml)?, text("origin", origin)?) };
        scene.write(dermis_scene::into_raw(Scene::parse(toml, origin).map_err(Error::input)?));
        Ok(())
    })
}

/// Free a scene; NULL is allowed. Its results and links stay valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_scene_free(scene: *mut dermis_scene) {
    unsafe { free(scene) }
}

fn number(scene: *const dermis_scene, of: impl FnOnce(&Scene) -> usize) -> usize {
    attempt(|| Ok(of(&unsafe { reference("scene", scene) }?.spec))).unwrap_or(0)
}

/// Number of rows, along y; 0 after an error.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_scene_rows(scene: *const dermis_scene) -> usize {
    number(scene, |spec| spec.sensor.rows)
}

/// Number of columns, along x; 0 after an error.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_scene_cols(scene: *const dermis_scene) -> usize {
    number(scene, |spec| spec.sensor.cols)
}

/// Number of frames that one result takes: 2^average of a block, 1 of a sliding mean; 0 after an error. A sliding mean and a
/// running zero take all frames since the start.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_scene_frames_per_result(scene: *const dermis_scene) -> usize {
    number(scene, |spec| spec.input.frames_per_result())
}

/// Reconstruct the forces of a frame, or of the frames of one result in the order of time.
///
/// engine is "golden", the floating-point model, or "fixed", the integers of the hardware bit for bit. stress_MPa has count
/// values, frame after frame of rows * cols; readings if the scene names a calibration or tare file; NaN where a reading is
/// missing. With cross_check the estimator evidence reads the frames too, where the engine has another one, and flags what
/// noise, baseline or a faulty taxel hides from that: as `dermis reconstruct` does. It takes longer than a search.
///
/// The result belongs to the caller: dermis_result_free. After an error *result is NULL. The first call for a scene and engine
/// builds the model, which takes longer than the others.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_reconstruct(
    scene: *const dermis_scene,
    engine: *const c_char,
    stress_MPa: *const f64,
    count: usize,
    cross_check: bool,
    result: *mut *mut dermis_result,
) -> dermis_status {
    guarded(|| {
        let result = unsafe { output("result", result) }?;
        result.write(std::ptr::null_mut());
        let scene = unsafe { reference("scene", scene) }?;
        let name = EngineName::software(unsafe { text("engine", engine) }?)?;
        let frames = unsafe { frames(&scene.spec, stress_MPa, count) }?;
        let engine = scene.engines.engine(name, &scene.spec, &frames)?;
        let found = engine::result(&engine, &frames, cross_check)?;
        result.write(dermis_result::of_model(found).into_raw());
        Ok(())
    })
}
