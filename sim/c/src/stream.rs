//! Streams: the frames of a sensor in the order of time.
//!
//! ```text
//! frame ── dermis_stream_push ─┬─ no result yet, of a block that is not complete
//!                              └─ dermis_result ── of this block, with what the frames before show of the sensor
//! ```
//! Results are those of `dermis reconstruct --stream`: means of blocks or that slide, running zeros, the checks of the history and the
//! cross-check.

use std::ffi::c_char;
use std::path::Path;

use dermis_golden::data::frame::Frame;
use dermis_golden::engine::{CheckPace, Engine, StreamChecks};
use dermis_host::engine::{typed, EngineName};

use crate::guard::{dermis_status, exclusive, free, guarded, output, reference, text};
use crate::result::dermis_result;
use crate::scene::{dermis_scene, one_frame};

/// Cross-check in a thread of its own, always the newest result, so that no result waits for it.
pub const DERMIS_CROSS_CHECK_BESIDE: u64 = 0xffff_ffff_ffff_ffff;

/// The frames of a sensor in the order of time, and what they show of it. One thread at a time may use it.
pub struct dermis_stream {
    engine: Box<dyn Engine>,
    checks: StreamChecks,
}

/// When results are cross-checked, from the number that C gives.
pub(crate) fn pace(cross_check: u64) -> CheckPace {
    match cross_check {
        DERMIS_CROSS_CHECK_BESIDE => CheckPace::Beside,
        period => CheckPace::Every(period),
    }
}

/// Begin a stream of frames of a scene. It belongs to the caller: dermis_stream_free; the scene may be freed before it. After
/// an error *stream is NULL; DERMIS_STATUS_INPUT for a scene that the engine refuses.
///
/// engine is "golden" or "fixed", as for dermis_reconstruct. cross_check says which results the estimator evidence reads too,
/// where the engine has another one: every so many, from the first one on, before they are given; 0: none;
/// DERMIS_CROSS_CHECK_BESIDE: the newest ones, as often as there is time. A finding is in the results up to the next one;
/// checks.cross_check_age in the text of dermis_result_json says how many results ago.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_stream_new(
    scene: *const dermis_scene,
    engine: *const c_char,
    cross_check: u64,
    stream: *mut *mut dermis_stream,
) -> dermis_status {
    guarded(|| {
        let stream = unsafe { output("stream", stream) }?;
        stream.write(std::ptr::null_mut());
        let spec = &unsafe { reference("scene", scene) }?.spec;
        let name = EngineName::software(unsafe { text("engine", engine) }?)?;
        let engine = name.engine(spec, None, Path::new(""))?;
        let checks = StreamChecks::new(&*engine, pace(cross_check));
        stream.write(Box::into_raw(Box::new(dermis_stream { engine, checks })));
        Ok(())
    })
}

/// Free a stream; NULL is allowed. Results that it gave stay valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_stream_free(stream: *mut dermis_stream) {
    unsafe { free(stream) }
}

/// Take the next frame: count = rows * cols values, as for dermis_reconstruct. *result belongs to the caller:
/// dermis_result_free; it is NULL after an error, and where input.average = k until the last of 2^k frames.
///
/// A frame that is refused for its values has no part in the results; one that the engine refuses ends its block. Either way the
/// stream goes on with the next frame.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_stream_push(
    stream: *mut dermis_stream,
    stress_MPa: *const f64,
    count: usize,
    result: *mut *mut dermis_result,
) -> dermis_status {
    unsafe { push(stream, stress_MPa, count, None, result) }
}

/// As dermis_stream_push, of a frame that was acquired at time_ns: nanoseconds since 1970, or of any clock of the caller's.
/// dermis_result_time gives it back to the nanosecond.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_stream_push_at(
    stream: *mut dermis_stream,
    stress_MPa: *const f64,
    count: usize,
    time_ns: i64,
    result: *mut *mut dermis_result,
) -> dermis_status {
    unsafe { push(stream, stress_MPa, count, Some(time_ns), result) }
}

/// Take the next frame, with the time of its acquisition if that is stated.
unsafe fn push(
    stream: *mut dermis_stream,
    stress_MPa: *const f64,
    count: usize,
    time_ns: Option<i64>,
    result: *mut *mut dermis_result,
) -> dermis_status {
    guarded(|| {
        let result = unsafe { output("result", result) }?;
        result.write(std::ptr::null_mut());
        let dermis_stream { engine, checks } = unsafe { exclusive("stream", stream) }?;
        let frame = unsafe { one_frame(engine.scene(), stress_MPa, count, "a stream") }?;
        if let Some((frames, found)) = checks.push(&**engine, Frame { time_ns, ..frame }).map_err(typed)? {
            let time_ns = Frame::time_of_result(&frames);
            result.write(dermis_result::of_model(found).at(time_ns).into_raw());
        }
        Ok(())
    })
}
