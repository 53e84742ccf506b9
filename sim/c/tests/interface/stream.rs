//! Streams: results are those of the Rust stream to the bit, with blocks, running zeros, history and cross-check; what is refused
//! is named, and the stream goes on.

use std::ffi::{CStr, CString};
use std::path::Path;
use std::ptr::{null, null_mut};

use dermis_c::guard::dermis_status;
use dermis_c::result::*;
use dermis_c::scene::*;
use dermis_c::stream::*;
use dermis_golden::data::frame::Frame;
use dermis_golden::engine::{CheckPace, StreamChecks};
use dermis_golden::result::flags::Flag;
use dermis_golden::spec::scene::Scene;
use dermis_host::engine::EngineName;

use super::input::{last_error, stress};

/// A stream, freed when dropped.
struct Stream(*mut dermis_stream);

impl Drop for Stream {
    fn drop(&mut self) {
        unsafe { dermis_stream_free(self.0) };
    }
}

/// A scene of the array of `stress` with these tables.
fn toml(more: &str) -> String {
    format!(
        "[sensor]\nrows = 8\ncols = 8\npitch_x_mm = 4\npitch_y_mm = 4\nthickness_mm = 3\n\
         [search]\nestimator = \"search\"\nnoise_floor_MPa = 0.0\n{more}"
    )
}

/// A stream of that scene, which is freed; or its error.
fn begun(more: &str, engine: &CStr, cross_check: u64) -> Result<Stream, String> {
    let text = CString::new(toml(more)).unwrap();
    let (mut scene, mut stream) = (null_mut(), null_mut::<dermis_stream>().wrapping_add(1));
    unsafe {
        assert_eq!(dermis_scene_parse(text.as_ptr(), c"pad.toml".as_ptr(), &mut scene), dermis_status::Ok);
        let status = dermis_stream_new(scene, engine.as_ptr(), cross_check, &mut stream);
        dermis_scene_free(scene);
        match status {
            dermis_status::Ok => Ok(Stream(stream)),
            status => {
                assert!(status == dermis_status::Input && stream.is_null());
                Err(last_error())
            }
        }
    }
}

impl Stream {
    /// The result as JSON; `None` where the frame completes no block.
    fn push(&self, stress: &[f64]) -> Result<Option<String>, String> {
        let mut result = null_mut::<dermis_result>().wrapping_add(1);
        unsafe {
            let status = dermis_stream_push(self.0, stress.as_ptr(), stress.len(), &mut result);
            if status != dermis_status::Ok {
                assert!(status == dermis_status::Input && result.is_null());
                return Err(last_error());
            }
            let json =
                (!result.is_null()).then(|| CStr::from_ptr(dermis_result_json(result)).to_str().unwrap().to_owned());
            dermis_result_free(result);
            Ok(json)
        }
    }
}

/// A press that grows, over a taxel that does not, on zeros that drift.
fn moments() -> Vec<Vec<f64>> {
    let press = stress();
    let peak = (0..64).max_by(|a, b| press[*a].total_cmp(&press[*b])).unwrap();
    let moment = |time: usize| {
        let mut now: Vec<f64> = press.iter().map(|b| 1e-4 * time as f64 + b * time.saturating_sub(3) as f64).collect();
        if time > 3 {
            now[peak] = press[peak];
        }
        now
    };
    (0..16).map(moment).collect()
}

#[test]
fn its_results_are_those_of_the_rust_stream() {
    let settings = [("", 1), ("[input]\naverage = 1\n", 2), ("[input]\nfull_scale_MPa = 2.0\nzero = \"running\"\n", 0)];
    for (more, period) in settings {
        let spec = Scene::parse(&toml(more), "pad.toml").unwrap();
        for engine in [c"golden", c"fixed"] {
            let stream = begun(more, engine, period).unwrap();
            let name = EngineName::software(engine.to_str().unwrap()).unwrap();
            let own = name.engine(&spec, None, Path::new("")).unwrap();
            let mut checks = StreamChecks::new(&*own, CheckPace::Every(period));
            let mut flags = Vec::new();
            for stress in moments() {
                let frame = Frame::from_stress("frame", &spec.sensor, stress.clone()).unwrap();
                let wanted = checks.push(&*own, frame).unwrap().map(|(_, result)| result);
                flags.extend(wanted.iter().flat_map(|result| result.flags.clone()));
                let json = wanted.map(|result| serde_json::to_string(&result).unwrap());
                assert_eq!(stream.push(&stress).unwrap(), json, "{more}, {engine:?}");
            }
            assert!(flags.contains(&Flag::TaxelConstant), "{more}: {flags:?}");
            assert_eq!(flags.contains(&Flag::TaxelSuspect), period > 0, "{more}: {flags:?}");
        }
    }
}

/// A thread of its own finds the taxel while frames go on.
#[test]
fn the_cross_check_beside_it_is_in_a_later_result() {
    let stream = begun("", c"fixed", DERMIS_CROSS_CHECK_BESIDE).unwrap();
    let last = moments().remove(15);
    let found = || stream.push(&last).unwrap().unwrap().contains("\"cross_check_age\"");
    assert!((0..5000).any(|_| {
        std::thread::sleep(std::time::Duration::from_millis(1));
        found()
    }));
}

/// Of a block the time of its last frame, to the nanosecond; none where the last frame states none.
#[test]
fn a_result_has_the_time_of_its_last_frame() {
    const TIME_NS: i64 = 1_732_770_000_020_000_003;
    let good = stress();
    for (more, frames) in [("", 1), ("[input]\naverage = 1\n", 2), ("[input]\nmean = \"sliding\"\naverage = 1\n", 1)] {
        let stream = begun(more, c"golden", 0).unwrap();
        let push = |time_ns: Option<i64>| {
            let mut result = null_mut::<dermis_result>();
            let (own, count) = (good.as_ptr(), good.len());
            let status = match time_ns {
                Some(time_ns) => unsafe { dermis_stream_push_at(stream.0, own, count, time_ns, &mut result) },
                None => unsafe { dermis_stream_push(stream.0, own, count, &mut result) },
            };
            assert_eq!(status, dermis_status::Ok, "{}", last_error());
            let mut found = -1;
            let status = unsafe { dermis_result_time(result, &mut found) };
            unsafe { dermis_result_free(result) };
            (status, found)
        };
        for k in 0..4 {
            let (status, found) = push(Some(TIME_NS + k));
            let complete = (k + 1) % frames == 0;
            // Before a block is complete there is no result.
            let wanted = if complete { (dermis_status::Ok, TIME_NS + k) } else { (dermis_status::Input, -1) };
            assert_eq!((status, found), wanted, "{more}: {k}");
        }
        for _ in 1..frames {
            push(None);
        }
        assert_eq!(push(None), (dermis_status::Absent, -1), "{more}");
        assert_eq!(last_error(), "the result has no time of acquisition");
    }
}

#[test]
fn what_is_refused_is_named_and_the_stream_goes_on() {
    let refused = |more: &str, engine: &CStr| begun(more, engine, 1).err().unwrap_or_default();
    assert!(refused("", c"rtl").starts_with("engine = \"rtl\" is not allowed"), "{}", last_error());
    assert!(refused("[input]\nunipolar = true\n", c"fixed").contains("input.unipolar"), "{}", last_error());
    assert!(refused("[input]\nmean = \"adaptive\"\n", c"fixed").contains("input.mean"), "{}", last_error());
    let stream = begun("[input]\naverage = 1\n", c"golden", 0).unwrap();
    let good = stress();
    assert_eq!(stream.push(&good), Ok(None));
    let two = [good.clone(), good.clone()].concat();
    assert_eq!(stream.push(&two).unwrap_err(), "count = 128 is not allowed; a stream takes one frame at a time");
    assert!(stream.push(&good[1..]).unwrap_err().starts_with("count = 63 is not allowed"));
    let mut infinite = good.clone();
    infinite[3] = f64::NEG_INFINITY;
    assert_eq!(stream.push(&infinite).unwrap_err(), "frame: stress_MPa[3] = -inf is not a finite number");
    assert!(stream.push(&good).unwrap().is_some_and(|json| json.contains("\"resultant_N\"")));
    let mut result = null_mut();
    let status = unsafe { dermis_stream_push(stream.0, null(), 64, &mut result) };
    assert_eq!((status, last_error().as_str()), (dermis_status::Input, "stress_MPa is NULL"));
}
