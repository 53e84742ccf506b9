//! Frames that are read or rejected; each message names file, field or line, and value.

use super::*;
use std::path::PathBuf;

const SENSOR: &str = r#""sensor":{"rows":2,"cols":2,"pitch_x_mm":1,"pitch_y_mm":1,"thickness_mm":1}"#;

/// Loads text through a file of the given name, without and with a 2 × 2 scene.
fn load(name: &str, text: &str, with_scene: bool) -> Result<Frame, FrameError> {
    let folder = tempfile::tempdir().unwrap();
    let path: PathBuf = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    let sensor = Sensor { rows: 2, cols: 2, pitch_x_mm: 1.0, pitch_y_mm: 1.0, thickness_mm: 1.0 };
    let scene = with_scene.then(|| Scene::of_sensor(&sensor, "small"));
    Frame::load(path, scene.as_ref())
}

fn json(fields: &str) -> Result<Frame, FrameError> {
    load("f.json", &format!("{{{SENSOR},{fields}}}"), false)
}

#[test]
fn stress_alone_is_enough() {
    let frame = json(r#""stress_MPa":[1,2.5,-0,0],"colour":"blue""#).unwrap();
    assert_eq!((frame.id.as_str(), frame.peak_MPa()), ("f", 2.5));
    let frame = load("g.json", r#"{"id":"own","stress_MPa":[1,2,3,4]}"#, true).unwrap();
    assert_eq!((frame.id.as_str(), frame.sensor.rows), ("own", 2));
}

#[test]
fn csv_is_rows_of_numbers() {
    let frame = load("f.CSV", "1, 2\n\n-3e-1,4\n", true).unwrap();
    assert_eq!(frame.stress_MPa, [1.0, 2.0, -0.3, 4.0]);
}

/// A frame with missing readings is written and read again, in every form of text.
#[test]
fn missing_readings_are_read_and_written() {
    let frame = json(r#""stress_MPa":[1,null,3,NaN],"notes":"NaN""#).unwrap();
    assert_eq!(frame.notes.as_deref(), Some("NaN"));
    assert_eq!((frame.stress_MPa.as_slice(), frame.missing.as_slice()), (&[1.0, 0.0, 3.0, 0.0][..], &[1, 3][..]));
    assert!(frame.readings().iter().zip([false, true, false, true]).all(|(b, missing)| b.is_nan() == missing));
    assert!(frame.to_json().contains("[1.0,null,3.0,null]"), "{}", frame.to_json());
    assert_eq!(Frame::parse("f.json", &frame.to_json(), None).unwrap(), frame);
    let mut scene = Scene::of_sensor(&frame.sensor, "small");
    scene.input.missing_share = 0.5;
    for field in ["", " ", "nan", "NaN", "-nan", "null"] {
        let csv = Frame::parse("f.csv", &format!("1,{field}\n3,{field}\n"), Some(&scene)).unwrap();
        assert_eq!((csv.missing, csv.stress_MPa), (frame.missing.clone(), frame.stress_MPa.clone()), "{field:?}");
    }
    // Infinite readings are none, and neither are NaN and null where a force is.
    assert!(json(r#""stress_MPa":[1,2,3,4],"resultant_N":[0,0,null]"#).is_err());
    let infinite = Frame::from_stress("now", &frame.sensor, vec![1.0, f64::NAN, f64::NEG_INFINITY, 0.0]).unwrap_err();
    assert_eq!(infinite.to_string(), "now: stress_MPa[2] = -inf is not a finite number");
}

/// The error of a recording in one CSV file has the line at which the frame begins.
#[test]
fn a_frame_that_lacks_too_many_readings_is_named_by_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("zero.csv");
    std::fs::write(&path, "1,2\n3,4\n\n5,6\n7,\n").unwrap();
    let sensor = Sensor { rows: 2, cols: 2, pitch_x_mm: 1.0, pitch_y_mm: 1.0, thickness_mm: 1.0 };
    let mut scene = Scene::of_sensor(&sensor, "small");
    let text = Frame::load_all(&path, Some(&scene)).unwrap_err().to_string();
    assert!(
        text.ends_with("zero.csv, line 4: 1 of 4 readings are missing, wanted at most 0 (input.missing_share = 0.2)"),
        "{text}"
    );
    scene.input.missing_share = 0.25;
    assert_eq!(Frame::load_all(&path, Some(&scene)).unwrap()[1].missing, [3]);
}

#[test]
fn lines_of_json_are_frames_whatever_the_file_is_called() {
    let folder = tempfile::tempdir().unwrap();
    let sensor = Sensor { rows: 2, cols: 2, pitch_x_mm: 1.0, pitch_y_mm: 1.0, thickness_mm: 1.0 };
    let scene = Scene::of_sensor(&sensor, "small");
    let text = "{\"stress_MPa\": [1, 2, 3, 4]}\n{\"stress_MPa\": [2, 3, 4, 5], \"time_ns\": 7}\n";
    for name in ["a.ndjson", "b.jsonl", "c.json", "d.csv"] {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        let frames = Frame::load_all(&path, Some(&scene)).unwrap();
        assert_eq!((frames.len(), frames[1].stress_MPa[0], frames[1].time_ns), (2, 2.0, Some(7)), "{name}");
    }
    // One object over several lines is a frame.
    let path = folder.path().join("one.json");
    std::fs::write(&path, "{\n\"stress_MPa\":\n[1, 2, 3, 4]\n}\n").unwrap();
    assert_eq!(Frame::load_all(&path, Some(&scene)).unwrap().len(), 1);
}

#[test]
fn bad_json_is_refused_with_its_place() {
    let cases = [
        (r#""stress_MPa":[1,2,3]"#, "stress_MPa has 3 values, wanted 4"),
        (r#""stress_MPa":[1,2,3,Infinity]"#, "line 1, column"),
        (r#""stress_MPa":[1,2,3,1e400]"#, "number out of range"),
        (r#""stress_MPa":[1,2,3,"4"]"#, ", stress_MPa[3]: the text \"4\" where a number is wanted"),
        (r#""stress_MPa":{}"#, ", stress_MPa: an object where a list is wanted"),
        (r#""stress_MPa":[1,2,3,4],"cell_forces_N":[]"#, ", cell_forces_N: "),
        (r#""stress_MPa":[1,2,3,4],"medium":"rubber""#, ", medium: "),
        (r#""stress_MPa":[1,2,3,4],"contacts":[{"centre_mm":[1]}]"#, ", contacts[0].centre_mm: "),
        (r#""id":"x""#, "stress_MPa is missing"),
        (r#""stress_MPa":[1,2,3,4],"resultant_N":[1,2]"#, "line 1, column"),
        (
            r#""stress_MPa":[1,2,3,4],"cell_forces_N":{"fx":[1,2,3,4],"fy":[1,2,3,4],"fz":[1]}"#,
            "cell_forces_N.fz has 1 values",
        ),
        (r#""stress_MPa":[1,2"#, "line 1, column"),
    ];
    for (fields, wanted) in cases {
        let text = json(fields).unwrap_err().to_string();
        assert!(text.contains("f.json") && text.contains(wanted), "{text}");
        let names = ["f64", "usize", "struct", "enum", "Sensor,", "Forces", "Medium", "Contact"];
        assert!(!names.iter().any(|name| text.contains(name)), "{text}");
        assert!(text.matches("column").count() <= 1, "{text}");
    }
    let after = load("f.json", &format!("{{{SENSOR},\"stress_MPa\":[1,2,3,4]}} 5"), false);
    assert!(matches!(after, Err(FrameError::Json { field: None, .. })));
    let half = r#"{"sensor":{"rows":2.5},"stress_MPa":[]}"#;
    let text = load("f.json", half, false).unwrap_err().to_string();
    assert!(text.ends_with(", sensor.rows: the number 2.5 where a whole number is wanted"), "{text}");
    let cut = load("f.json", "{\"stress_MPa\":\n[1,2,3", true).unwrap_err();
    assert!(matches!(cut, FrameError::Json { line: 2, .. }), "{cut}");
}

#[test]
fn a_mediums_poisson_ratio_has_the_scenes_range() {
    let with = |poisson: &str| {
        json(&format!(r#""stress_MPa":[1,2,3,4],"medium":{{"kind":"bonded-layer","poisson":{poisson}}}"#))
    };
    assert_eq!(with("0.49").unwrap().medium, Some(Medium::BondedLayer { poisson: 0.49 }));
    for poisson in ["0", "0.5", "-0.1"] {
        let text = with(poisson).unwrap_err().to_string();
        let wanted = format!("medium.poisson = {poisson} is not allowed; it must be a number above 0 and below 0.5");
        assert!(text.contains("f.json") && text.ends_with(&wanted), "{text}");
    }
}

#[test]
fn fields_unknown_to_this_version_are_passed_over_in_the_sensor_too() {
    let sensor = SENSOR.replace("{\"rows\"", "{\"maker\":\"own\",\"rows\"");
    let frame = load("f.json", &format!("{{{sensor},\"stress_MPa\":[1,2,3,4]}}"), false).unwrap();
    assert_eq!(frame.sensor.rows, 2);
}

#[test]
fn a_byte_order_mark_is_passed_over() {
    assert_eq!(load("f.csv", "\u{feff}1,2\n3,4\n", true).unwrap().stress_MPa, [1.0, 2.0, 3.0, 4.0]);
    assert!(load("f.json", "\u{feff}{\"stress_MPa\":[1,2,3,4]}", true).is_ok());
}

#[test]
fn bad_sensors_are_refused_before_anything_is_allocated() {
    let huge =
        r#"{"sensor":{"rows":1000000000,"cols":10,"pitch_x_mm":1,"pitch_y_mm":1,"thickness_mm":1},"stress_MPa":[]}"#;
    let text = load("f.json", huge, false).unwrap_err().to_string();
    assert!(text.contains("sensor.rows = 1000000000 is not allowed"), "{text}");
    let flat =
        r#"{"sensor":{"rows":2,"cols":2,"pitch_x_mm":0,"pitch_y_mm":1,"thickness_mm":1},"stress_MPa":[1,2,3,4]}"#;
    let text = load("f.json", flat, false).unwrap_err().to_string();
    assert!(text.contains("sensor.pitch_x_mm = 0"), "{text}");
    let none = load("f.json", r#"{"stress_MPa":[1]}"#, false).unwrap_err();
    assert!(matches!(none, FrameError::NoSensor { .. }));
}

#[test]
fn bad_csv_is_refused_with_its_place() {
    let cases = [
        ("1,2\n3\n", "1 values, wanted"),
        ("1,2\n3,4\n5,6\n7,8\n", "f.csv: has 2 frames, wanted one"),
        ("1,2\n3,x\n", "line 2, value 2: \"x\" is not a finite number"),
        ("1,2\ninf,4\n", "line 2, value 1: \"inf\" is not a finite number"),
        ("1,2\nNaN,4\n", "f.csv: 1 of 4 readings are missing, wanted at most 0 (input.missing_share = 0.2)"),
        ("1,2\n1e400,4\n", "\"1e400\""),
        ("1,2\n", "line 1: the frame ends after 1 of 2 rows"),
        ("", "f.csv: no line with readings"),
    ];
    for (csv, wanted) in cases {
        let text = load("f.csv", csv, true).unwrap_err().to_string();
        assert!(text.contains("f.csv") && text.contains(wanted), "{text}");
    }
    assert!(matches!(load("f.csv", "1,2\n3,4", false), Err(FrameError::NoSensor { .. })));
}

#[test]
fn files_that_are_none_or_too_large() {
    assert!(matches!(load("f.txt", "", true), Err(FrameError::UnknownKind { .. })));
    assert!(matches!(Frame::load("absent.json", None), Err(FrameError::Unreadable { .. })));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("f.json");
    // A sparse file: large by its length, nothing on disk.
    std::fs::File::create(&path).unwrap().set_len((64 << 20) + 1).unwrap();
    assert!(matches!(Frame::load(&path, None), Err(FrameError::TooLarge { .. })));
}

#[test]
fn sensors_that_disagree_are_both_printed() {
    let frame = json(r#""stress_MPa":[1,2,3,4]"#).unwrap();
    let text = frame.check(&Scene::builtin("sensor-1").unwrap()).unwrap_err().to_string();
    let both = ["2×2 taxels, pitch 1×1 mm, thickness 1 mm", "10×10 taxels, pitch 2×4 mm, thickness 3 mm"];
    assert!(both.iter().all(|sensor| text.contains(sensor)), "{text}");
}

#[test]
fn changed_values_are_checked_again() {
    let scene = Scene::builtin("sensor-1").unwrap();
    let mut frame = Frame::eq2(&scene.sensor);
    assert!(frame.check(&scene).is_ok());
    frame.stress_MPa[7] = f64::NAN;
    let text = frame.check(&scene).unwrap_err().to_string();
    assert_eq!(text, "eq2: stress_MPa[7] = NaN is not a finite number");
    let short = Frame::from_stress("now", &scene.sensor, vec![0.0; 99]);
    assert!(matches!(short, Err(FrameError::WrongCount { got: 99, wanted: 100, .. })));
}

#[test]
fn every_shipped_file_parses_and_belongs_to_its_scene() {
    let counts = [
        ("sensor-1", 8),
        ("sensor-1-noisy", 8),
        ("sensor-1-unipolar", 8),
        ("sensor-1-bonded", 5),
        ("sensor-2", 9),
        ("sensor-3", 7),
        ("sensor-3-contacts", 7),
        ("sensor-4", 3),
        ("eight-by-eight", 5),
        ("eight-by-eight-bonded", 5),
        ("eight-by-eight-contacts", 5),
    ];
    for (name, count) in counts {
        let scene = Scene::builtin(name).unwrap();
        let frames = Frame::shipped(&scene);
        assert_eq!(frames.len(), count, "{name}");
        assert!(frames.windows(2).all(|pair| pair[0].id < pair[1].id));
        assert!(frames.iter().all(|frame| frame.check(&scene).is_ok() && frame.resultant_N.is_some()));
    }
    assert!(shipped::all_parse());
}

#[test]
fn eq2_spans_what_it_should() {
    // From the corner at 4 × 2 mm: −16 145 … 36 000 N/m².
    let sensor = Sensor { rows: 10, cols: 10, pitch_x_mm: 4.0, pitch_y_mm: 2.0, thickness_mm: 3.0 };
    let stress = Frame::eq2(&sensor).stress_MPa;
    let (low, high) = stress.iter().fold((0.0f64, 0.0f64), |(l, h), &b| (l.min(b), h.max(b)));
    assert!((low * 1e6 + 16_145.0).abs() < 1.0 && (high * 1e6 - 36_000.0).abs() < 1e-6);
    assert_eq!(stress[1], 0.004);
}
