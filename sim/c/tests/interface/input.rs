//! Wrong arguments give a status and a text with field and value; no panic leaves the library.

use std::ffi::{c_char, CStr, CString};
use std::ptr::{null, null_mut};

use dermis_c::guard::{dermis_last_error, dermis_status, dermis_version, guarded};
use dermis_c::link::*;
use dermis_c::result::*;
use dermis_c::scene::*;
use dermis_c::stream::*;
use dermis_golden::data::frame::Frame;
use dermis_golden::estimate::float::Golden;
use dermis_golden::fixed::Model;
use dermis_golden::result::flags::Flag;
use dermis_golden::spec::scene::Scene;

/// The text of the last error on this thread.
pub fn last_error() -> String {
    unsafe { CStr::from_ptr(dermis_last_error()) }.to_str().unwrap().to_owned()
}

/// A built-in scene.
pub fn scene(name: &str) -> *mut dermis_scene {
    let (name, mut scene) = (CString::new(name).unwrap(), null_mut());
    assert_eq!(unsafe { dermis_scene_load(name.as_ptr(), &mut scene) }, dermis_status::Ok, "{}", last_error());
    scene
}

/// A frame of eight-by-eight.
pub fn stress() -> Vec<f64> {
    Frame::shipped(&Scene::builtin("eight-by-eight").unwrap()).remove(1).stress_MPa
}

/// The status and text of a failed reconstruction of eight-by-eight; whose result is then NULL.
fn reconstruct(engine: *const c_char, stress: &[f64], count: usize) -> (dermis_status, String) {
    let scene = scene("eight-by-eight");
    let mut result = null_mut::<dermis_result>().wrapping_add(1);
    let status = unsafe { dermis_reconstruct(scene, engine, stress.as_ptr(), count, true, &mut result) };
    unsafe { dermis_scene_free(scene) };
    assert!(result.is_null());
    (status, last_error())
}

#[test]
fn wrong_values_are_named() {
    let golden = c"golden".as_ptr();
    let (mut infinite, good) = (stress(), stress());
    infinite[3] = f64::INFINITY;
    let engine = "engine = \"rtl\" is not allowed; it must be \"golden\" or \"fixed\"";
    let count = "count = 63 is not allowed; scene eight-by-eight has frames of 8 * 8 = 64 values";
    let utf8 = "engine is not UTF-8: invalid utf-8 sequence of 1 bytes from index 1";
    let cases = [
        (reconstruct(golden, &infinite, 64), "frame: stress_MPa[3] = inf is not a finite number"),
        (reconstruct(golden, &good, 63), count),
        (
            reconstruct(golden, &good, 0),
            "count = 0 is not allowed; scene eight-by-eight has frames of 8 * 8 = 64 values",
        ),
        (reconstruct(golden, &good, usize::MAX / 64 * 64), "values are more than memory has"),
        (reconstruct(c"rtl".as_ptr(), &good, 64), engine),
        (reconstruct(c"g\xff".as_ptr(), &good, 64), utf8),
        (reconstruct(null(), &good, 64), "engine is NULL"),
    ];
    for ((status, text), wanted) in cases {
        assert!(status == dermis_status::Input && text.contains(wanted), "{status:?} {text:?}, wanted {wanted:?}");
    }
    // Two frames where the scene takes one.
    let two = [good.clone(), good].concat();
    let (status, text) = reconstruct(golden, &two, 128);
    assert!(status == dermis_status::Input && text.contains("input.average"), "{text}");
}

/// NaN is a missing reading: the result is that of the Rust call and names the taxels; too many are refused.
#[test]
fn missing_readings_are_named() {
    let spec = Scene::builtin("eight-by-eight").unwrap();
    let mut lacking = stress();
    (lacking[27], lacking[50]) = (f64::NAN, f64::NAN);
    let frame = Frame::from_stress("frame", &spec.sensor, lacking.clone()).unwrap();
    let wanted = [
        (c"golden", Golden::new(&spec).unwrap().run(&frame).unwrap()),
        (c"fixed", Model::new(&spec).unwrap().reconstruct(&frame).unwrap()),
    ];
    let scene = scene("eight-by-eight");
    for (engine, wanted) in wanted {
        let (mut result, mut flags) = (null_mut(), 0);
        let status = unsafe { dermis_reconstruct(scene, engine.as_ptr(), lacking.as_ptr(), 64, false, &mut result) };
        assert_eq!(status, dermis_status::Ok, "{}", last_error());
        assert_eq!(unsafe { dermis_result_flags(result, &mut flags) }, dermis_status::Ok);
        assert_ne!(flags & Flag::TaxelMissing.bit(), 0);
        let json = unsafe { CStr::from_ptr(dermis_result_json(result)) }.to_str().unwrap();
        assert_eq!(json, serde_json::to_string(&wanted).unwrap());
        assert!(
            json.contains("\"missing\":[{\"row\":3,\"col\":3,") && json.contains("{\"row\":6,\"col\":2,"),
            "{json}"
        );
        unsafe { dermis_result_free(result) };
    }
    unsafe { dermis_scene_free(scene) };
    lacking[..13].fill(f64::NAN);
    let (status, text) = reconstruct(c"golden".as_ptr(), &lacking, 64);
    let limit = "frame: 15 of 64 readings are missing, wanted at most 12 (input.missing_share = 0.2)";
    assert!(status == dermis_status::Input && text == limit, "{text}");
}

#[test]
fn scenes_are_refused_by_file_and_field() {
    let mut scene = null_mut::<dermis_scene>().wrapping_add(1);
    let toml = c"[sensor]\nrows = 8\ncols = 8\npitch_x_mm = -4\npitch_y_mm = 4\nthickness_mm = 3\n";
    let parse = |toml: *const c_char, origin: *const c_char, scene: *mut *mut dermis_scene| {
        let status = unsafe { dermis_scene_parse(toml, origin, scene) };
        (status, last_error())
    };
    let (status, text) = parse(toml.as_ptr(), c"pad.toml".as_ptr(), &mut scene);
    assert!(status == dermis_status::Input && text.starts_with("pad.toml: sensor.pitch_x_mm = -4"), "{text}");
    assert!(scene.is_null());
    for (toml, origin, wanted) in [(null(), c"a".as_ptr(), "toml is NULL"), (toml.as_ptr(), null(), "origin is NULL")] {
        assert_eq!(parse(toml, origin, &mut scene), (dermis_status::Input, wanted.to_owned()));
    }
    assert_eq!(parse(toml.as_ptr(), c"a".as_ptr(), null_mut()).1, "scene is NULL");
    assert_eq!(unsafe { dermis_scene_load(null(), &mut scene) }, dermis_status::Input);
    assert_eq!(last_error(), "name is NULL");
}

#[test]
fn null_is_an_error_everywhere_and_frees_nothing() {
    let (mut flags, mut count, mut force) = (7u32, 7usize, [0.0; 64]);
    let (mut size, mut used, mut wire, mut answer) = (7usize, 7usize, [0u8; 8], dermis_answer::Other);
    let mut result = null_mut();
    let force = force.as_mut_ptr();
    let statuses = unsafe {
        dermis_scene_free(null_mut());
        dermis_result_free(null_mut());
        dermis_link_free(null_mut());
        dermis_stream_free(null_mut());
        [
            (dermis_reconstruct(null(), c"golden".as_ptr(), force, 64, true, &mut result), "scene is NULL"),
            (dermis_reconstruct(null(), c"golden".as_ptr(), force, 64, true, null_mut()), "result is NULL"),
            (dermis_result_resultant(null(), force), "result is NULL"),
            (dermis_result_forces(null(), force, force, force, 64), "result is NULL"),
            (dermis_result_contacts(null(), null_mut(), 0, &mut count), "result is NULL"),
            (dermis_result_contacts(null(), null_mut(), 0, null_mut()), "count is NULL"),
            (dermis_result_flags(null(), &mut flags), "result is NULL"),
            (dermis_link_new(null(), 0, &mut null_mut()), "scene is NULL"),
            (dermis_stream_new(null(), c"golden".as_ptr(), 0, &mut null_mut()), "scene is NULL"),
            (dermis_stream_push(null_mut(), force, 64, &mut result), "stream is NULL"),
            (dermis_link_identify(null_mut(), wire.as_mut_ptr(), 8, &mut size), "link is NULL"),
            (dermis_link_frame(null_mut(), force, 64, true, wire.as_mut_ptr(), 8, &mut size), "link is NULL"),
            (dermis_link_receive(null_mut(), wire.as_ptr(), 8, &mut used, &mut answer, &mut result), "link is NULL"),
            (dermis_link_receive(null_mut(), wire.as_ptr(), 8, null_mut(), &mut answer, &mut result), "used is NULL"),
        ]
        .map(|(status, wanted)| (status, wanted, last_error()))
    };
    assert!(statuses.iter().all(|(status, ..)| *status == dermis_status::Input), "{statuses:?}");
    // The text of each call is overwritten by the next one's.
    assert_eq!(last_error(), "used is NULL");
    assert_eq!((count, size, used), (0, 0, 0));
    unsafe {
        let zeros = [dermis_scene_rows(null()), dermis_scene_cols(null()), dermis_scene_frames_per_result(null())];
        assert_eq!((zeros, last_error()), ([0; 3], "scene is NULL".to_owned()));
        assert_eq!((dermis_link_capacity(null()), last_error()), (0, "link is NULL".to_owned()));
        assert!(dermis_result_json(null()).is_null());
    }
}

#[test]
fn a_result_refuses_what_has_no_room_and_says_what_it_lacks() {
    let scene = scene("eight-by-eight");
    let (stress, mut result) = (stress(), null_mut());
    unsafe {
        assert_eq!(
            [dermis_scene_rows(scene), dermis_scene_cols(scene), dermis_scene_frames_per_result(scene)],
            [8, 8, 1]
        );
        let status = dermis_reconstruct(scene, c"fixed".as_ptr(), stress.as_ptr(), 64, false, &mut result);
        assert_eq!(status, dermis_status::Ok, "{}", last_error());
        dermis_scene_free(scene);
        // NaN shows that nothing was written.
        let mut force = [f64::NAN; 64];
        let all = force.as_mut_ptr();
        assert_eq!(dermis_result_forces(result, all, all, all, 63), dermis_status::Input);
        assert_eq!(last_error(), "taxels = 63 is not allowed; the result has 64");
        assert_eq!(dermis_result_forces(result, all, all, null_mut(), 64), dermis_status::Input);
        assert_eq!(last_error(), "fz_N is NULL");
        let beside = all.cast::<u8>().wrapping_add(1).cast();
        assert_eq!(dermis_result_resultant(result, beside), dermis_status::Input);
        assert!(last_error().ends_with("is not aligned to 8 bytes"), "{}", last_error());
        assert!(force.iter().all(|force| force.is_nan()));
        let mut count = 7;
        assert_eq!(dermis_result_contacts(result, null_mut(), 0, &mut count), dermis_status::Absent);
        assert_eq!((last_error().as_str(), count), ("the result has no contacts", 0));
        let json = CStr::from_ptr(dermis_result_json(result)).to_str().unwrap();
        let json: serde_json::Value = serde_json::from_str(json).unwrap();
        assert_eq!((&json["engine"], json["forces_N"]["fz"].as_array().unwrap().len()), (&"fixed".into(), 64));
        dermis_result_free(result);
    }
}

#[test]
fn error_bars_are_marked_and_absent_ones_are_no_zeros() {
    let search = c"[sensor]\nrows = 8\ncols = 8\npitch_x_mm = 4\npitch_y_mm = 4\nthickness_mm = 3\n\
                   [partition]\ncase = \"contacts\"\n[search]\nestimator = \"search\"\n";
    let evidence = c"[sensor]\nrows = 8\ncols = 8\npitch_x_mm = 4\npitch_y_mm = 4\nthickness_mm = 3\n";
    let stress = stress();
    for (toml, known) in [(search, false), (evidence, true)] {
        let (mut scene, mut result, mut count) = (null_mut(), null_mut(), 0);
        unsafe {
            assert_eq!(dermis_scene_parse(toml.as_ptr(), c"pad.toml".as_ptr(), &mut scene), dermis_status::Ok);
            let status = dermis_reconstruct(scene, c"golden".as_ptr(), stress.as_ptr(), 64, false, &mut result);
            assert_eq!(status, dermis_status::Ok, "{}", last_error());
            let mut contacts = Vec::<dermis_contact>::with_capacity(1);
            assert_eq!(dermis_result_contacts(result, contacts.as_mut_ptr(), 1, &mut count), dermis_status::Ok);
            contacts.set_len(count.min(1));
            let own = contacts[0];
            assert!(own.force_N[2] > 0.1 && own.has_centre_mm, "{own:?}");
            let markers = [own.has_shear_sigma_N, own.has_normal_sigma_N, own.has_mu_sigma];
            assert_eq!(markers, [known; 3], "{own:?}");
            let bars = [&own.shear_sigma_N[..], &[own.normal_sigma_N], &own.mu_sigma].concat();
            assert!(bars.iter().all(|bar| if known { *bar > 0.0 } else { bar.is_nan() }), "{own:?}");
            dermis_result_free(result);
            dermis_scene_free(scene);
        }
    }
}

#[test]
fn flags_are_bits_named_as_in_json() {
    let header = std::fs::read_to_string(super::header::folder().join("dermis.h")).unwrap();
    for flag in Flag::ALL {
        // The header's comment of a flag is its name in JSON.
        let name = flag.name();
        let number = flag.bit().trailing_zeros();
        let constant = format!("DERMIS_FLAG_{} = (1 << {number}),", name.to_uppercase().replace('-', "_"));
        let at = header.find(&constant).unwrap_or_else(|| panic!("{constant}"));
        assert!(header[..at].trim_end().ends_with(&format!("/**\n   * `{name}`\n   */")), "{name}");
    }
    let nothing = [0.0; 64];
    let (scene, mut result, mut flags) = (scene("eight-by-eight"), null_mut(), 0);
    unsafe {
        dermis_reconstruct(scene, c"golden".as_ptr(), nothing.as_ptr(), 64, false, &mut result);
        assert_eq!(dermis_result_flags(result, &mut flags), dermis_status::Ok);
        dermis_result_free(result);
        dermis_scene_free(scene);
    }
    assert_ne!(flags & Flag::NoContact.bit(), 0);
}

#[test]
fn a_panic_is_a_status() {
    let index = std::hint::black_box(3);
    let status = guarded(|| {
        let _ = [0; 3][index];
        Ok(())
    });
    assert_eq!(status, dermis_status::Internal);
    assert_eq!(last_error(), "a defect of Dermis: index out of bounds: the len is 3 but the index is 3");
    assert_eq!(unsafe { CStr::from_ptr(dermis_version()) }.to_str(), Ok(env!("CARGO_PKG_VERSION")));
    // Another thread has its own text.
    assert_eq!(std::thread::spawn(last_error).join().unwrap(), "");
}
