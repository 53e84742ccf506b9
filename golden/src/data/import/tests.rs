//! The formats on excerpts of real recordings (`data/recordings`), on arrays that NumPy wrote, and on damaged files.

use super::*;
use crate::estimate::float::Golden;
use std::path::PathBuf;

const ISCAN: &[u8] = include_bytes!("../../../data/recordings/iscan-finger.csv");
const FSCAN: &[u8] = include_bytes!("../../../data/recordings/fscan-walk.asf");
const EMED: &[u8] = include_bytes!("../../../data/recordings/emed-step.lst");

/// 1 MPa for a count of 255.
fn counts() -> Settings {
    counts_of(1.0)
}

fn counts_of(full_scale_MPa: f64) -> Settings {
    Settings { full_scale_MPa: Some(full_scale_MPa), ..Settings::default() }
}

fn message(file: &str, bytes: &[u8], settings: &Settings) -> String {
    import(file, bytes, settings).err().map(|error| error.to_string()).unwrap()
}

#[test]
fn tekscan_counts_with_pads_and_raw_sums() {
    let imported = import("iscan-finger.csv", ISCAN, &counts()).unwrap();
    let (summary, sensor) = (&imported.summary, &imported.scene.sensor);
    assert_eq!((summary.format, summary.unit, summary.array), (Format::Tekscan, Unit::Raw, [28, 28]));
    assert_eq!(summary.device.as_deref(), Some("Tekscan 6900"));
    // Four pads of 11×11 with a gap of two; the lines without sensels around them are left out.
    assert_eq!(summary.window, Window { row0: 2, col0: 2, rows: 24, cols: 24 });
    assert_eq!((summary.missing, imported.scene.input.dead.len()), (24 * 24 - 4 * 11 * 11, 24 * 24 - 4 * 11 * 11));
    assert_eq!((sensor.pitch_x_mm, sensor.pitch_y_mm, sensor.thickness_mm), (1.27, 1.27, 0.127));
    // "Frame 60, 5.96,, …": the sums of the file's lines are those of the readings.
    let first = &summary.frames[0];
    assert_eq!((summary.frames.len(), first.number, first.time_s), (24, 60, Some(5.96)));
    for (frame, record) in imported.frames.iter().zip(&summary.frames) {
        let closure = record.closure().unwrap();
        assert!(closure.abs() < 1e-12, "{}: {closure}", frame.id);
        let force = 1.27 * 1.27 * frame.stress_MPa.iter().sum::<f64>();
        assert!((force - record.normal_N).abs() < 1e-12 * force);
    }
    assert_eq!(summary.outside_share(), 0.0);
    // Counts of 8 bits in steps of one.
    assert!((summary.codes.step_MPa.unwrap() * 255.0 - 1.0).abs() < 1e-12);
    assert_eq!((summary.codes.bits, summary.codes.at_full_scale), (Some(8), 0));
}

/// Counts of 12 bits that stand at 3000 without load and fall under it; and the recordings of real arrays, which do not.
#[test]
fn inverted_counts_are_told_by_the_level_without_load() {
    let count = |k: i32, load: i32| (3000 - k % 3 - if k == 5 { load } else { 0 }).to_string();
    let line = |load: i32| (0..16).map(|k| count(k, load)).collect::<Vec<_>>().join(",") + "\n";
    let csv = line(0) + &line(900) + &line(1800);
    let stated = Settings {
        unit: Some(Unit::Raw),
        bits: Some(12),
        size: Some([4, 4]),
        pitch_mm: Some([5.0, 5.0]),
        ..counts_of(0.1)
    };
    let summary = import("glove.csv", csv.as_bytes(), &stated).unwrap().summary;
    let share = summary.idle_share().unwrap();
    assert!(summary.idle.unwrap().falls && (share - 2999.0 / 4095.0).abs() < 1e-12, "{share}");
    for (file, bytes) in [("iscan-finger.csv", ISCAN), ("fscan-walk.asf", FSCAN), ("emed-step.lst", EMED)] {
        let summary = import(file, bytes, &counts()).unwrap().summary;
        assert_eq!(summary.idle_share(), None, "{file}: {:?}", summary.idle);
    }
}

/// The same falling counts in every format that has counts: told in each, and with what is told the same stress.
#[test]
fn inverted_counts_are_told_and_turned_in_every_format() {
    let count = |frame: i32, k: i32| 200 - k % 3 - if k == 5 { 50 * frame } else { 0 };
    let frames: Vec<Vec<i32>> = (0..4).map(|frame| (0..16).map(|k| count(frame, k)).collect()).collect();
    let joined = |row: &[i32]| row.iter().map(i32::to_string).collect::<Vec<_>>().join(",");
    let lines: String = frames.iter().map(|frame| joined(frame) + "\n").collect();
    let rows = |frame: &Vec<i32>| frame.chunks(4).map(|row| joined(row) + "\n").collect::<String>();
    let grid = frames.iter().map(rows).collect::<Vec<_>>().join("\n");
    let tekscan: String =
        frames.iter().enumerate().map(|(k, frame)| format!("\nFrame {}\n{}", k + 1, rows(frame))).collect();
    let tekscan =
        format!("ROWS 4\nCOLS 4\nROW_SPACING 5 mm\nCOL_SPACING 5 mm\nUNITS RAW\nASCII_DATA @@\n{tekscan}@@\n");
    let bytes: Vec<u8> = frames.concat().iter().map(|count| *count as u8).collect();
    let npy = |shape: &str| {
        let header = format!("{{'descr': '|u1', 'fortran_order': False, 'shape': {shape}, }}\n");
        [b"\x93NUMPY\x01\x00", &(header.len() as u16).to_le_bytes()[..], header.as_bytes(), &bytes].concat()
    };
    let serial: Vec<u8> = bytes.chunks(16).flat_map(|frame| [&[0xaa, 0x55][..], frame].concat()).collect();
    let message = |frame: &Vec<i32>| {
        let data: Vec<String> = frame.iter().map(|count| format!("0,0,{count:X}")).collect();
        format!(
            "{{\"message\": 1, \"1\": {{\"data\": \"{}\", \"taxels\": 16, \"calibrated\": null}}}}\n",
            data.join(",")
        )
    };
    let files = [
        ("glove.csv", lines.into_bytes()),
        ("grid.csv", grid.into_bytes()),
        ("glove.asf", tekscan.into_bytes()),
        ("frames.npy", npy("(4, 4, 4)")),
        ("lines.npy", npy("(4, 16)")),
        ("glove.bin", serial),
        ("glove.log", frames.iter().map(message).collect::<String>().into_bytes()),
    ];
    let stated = Settings {
        unit: Some(Unit::Raw),
        bits: Some(8),
        size: Some([4, 4]),
        pitch_mm: Some([5.0, 5.0]),
        ..counts_of(0.255)
    };
    let correction = Correction { zero_frames: Some(1), invert: true, ..Correction::default() };
    for (file, bytes) in files {
        let read = |settings: &Settings| import(file, &bytes, settings).map_err(|error| error.to_string()).unwrap();
        let as_is = read(&stated).summary;
        assert!(as_is.idle.unwrap().falls && as_is.idle_share() > Some(0.7), "{file}: {:?}", as_is.idle);
        let turned = read(&Settings { correction, ..stated.clone() });
        assert_eq!(turned.summary.idle_share(), None, "{file}");
        for (k, frame) in turned.frames.iter().enumerate() {
            let pressed = |b: &f64| (b * 1e3).round();
            let wanted: Vec<f64> = (0..16).map(|taxel| if taxel == 5 { 50.0 * k as f64 } else { 0.0 }).collect();
            assert_eq!(frame.stress_MPa.iter().map(pressed).collect::<Vec<_>>(), wanted, "{file}, frame {k}");
        }
    }
}

#[test]
fn tekscan_in_kilopascal_around_the_foot() {
    let imported = import("fscan-walk.asf", FSCAN, &Settings { crop: Crop::Contact, ..Settings::default() }).unwrap();
    let summary = &imported.summary;
    assert_eq!((summary.unit, summary.array, summary.full_scale_MPa), (Unit::KiloPa, [60, 21], 1.51473));
    assert_eq!((summary.frames.len(), summary.frames[1].time_s), (12, Some(0.032)));
    assert!(summary.window.rows < 60 && summary.window.cols < 21, "{:?}", summary.window);
    // Row 24 of the first frame, "0,0,18,36,59,42,…" kPa.
    let Window { row0, col0, cols, .. } = summary.window;
    let first = &imported.frames[0];
    let own = |row: usize, col: usize| first.stress_MPa[(row - row0) * cols + col - col0];
    assert_eq!([own(23, 2), own(23, 3), own(23, 4)], [0.018, 0.036, 0.059]);
    // The heel and its margin have the whole load.
    assert!(summary.outside_share() < 0.01, "{}", summary.outside_share());
    // Without a force in the file there is no closure.
    assert_eq!(summary.closure(), None);
}

#[test]
fn novel_pictures_close_to_the_printed_force() {
    let imported = import("emed-step.lst", EMED, &Settings::default()).unwrap();
    let summary = &imported.summary;
    assert_eq!((summary.format, summary.unit, summary.array), (Format::Lst, Unit::KiloPa, [54, 22]));
    assert_eq!((summary.frames.len(), summary.frames[0].number, summary.frames[0].time_s), (8, 30, Some(0.29)));
    // Forces are printed in steps of N/8.
    let [largest, _] = summary.closure().unwrap();
    assert!(largest < 1e-3, "{largest}");
    assert!(summary.frames.iter().all(|frame| frame.device_N.unwrap() > 700.0 && frame.outside_N == 0.0));
    assert!(imported.scene.input.dead.is_empty());
    // On a tenth of the area the same forces take N/cm²; on a quarter no unit explains them.
    let pitch = |cm: &str| decoded(EMED).replace("0.500x0.500 cm", &format!("{cm}x{cm} cm"));
    let tenth = import("emed.lst", pitch("0.1581").as_bytes(), &Settings::default()).unwrap();
    assert_eq!((tenth.summary.unit, tenth.scene.sensor.pitch_x_mm), (Unit::NewtonPerCm2, 1.581));
    let quarter = message("emed.lst", pitch("0.25").as_bytes(), &Settings::default());
    assert!(quarter.starts_with("emed.lst: the unit is missing; give it with --units"), "{quarter}");
}

#[test]
fn without_a_cover_there_is_normal_force_and_no_shear() {
    let settings = Settings { frames: Some([3, 4]), ..counts() };
    let imported = import("iscan-finger.csv", ISCAN, &settings).unwrap();
    assert_eq!((imported.scene.search.mu_max, imported.scene.input.unipolar), (0.0, false));
    assert_eq!(imported.summary.frames[0].number, 62);
    let result = Golden::new(&imported.scene).unwrap().run(&imported.frames[0]).unwrap();
    assert_eq!(&result.resultant_N[..2], &[0.0, 0.0]);
    // At a depth of a tenth of the pitch a force is stress times area; those on dead taxels come from the neighbours'.
    let cols = imported.scene.sensor.cols;
    let is_dead = |k: usize| imported.scene.input.dead.contains(&[k / cols, k % cols]);
    let alive: f64 = result.forces_N.fz.iter().enumerate().filter(|(k, _)| !is_dead(*k)).map(|(_, force)| force).sum();
    let share = alive / imported.summary.frames[0].normal_N;
    assert!((share - 1.0).abs() < 0.01, "{share}");
    // The finger lies over the gap between the pads.
    assert!(result.resultant_N[2] > 1.01 * alive, "{} {alive}", result.resultant_N[2]);
    // Stated to read 0, they have no force.
    let zero = import("iscan-finger.csv", ISCAN, &Settings { missing_as_zero: true, ..settings.clone() }).unwrap();
    assert_eq!((zero.summary.missing, zero.scene.input.dead.len()), (imported.summary.missing, 0));
    let result = Golden::new(&zero.scene).unwrap().run(&zero.frames[0]).unwrap();
    assert!((result.resultant_N[2] / imported.summary.frames[0].normal_N - 1.0).abs() < 0.01);
    let covered = import("iscan-finger.csv", ISCAN, &Settings { thickness_mm: Some(2.0), ..settings }).unwrap();
    assert!(covered.scene.search.mu_max > 0.0 && covered.scene.input.unipolar);
    assert_eq!(covered.scene.sensor.thickness_mm, 2.0);
}

#[test]
fn saved_and_opened_again() {
    let folder = tempfile::tempdir().unwrap();
    let settings = Settings { name: Some("finger 1".into()), frames: Some([1, 2]), ..counts() };
    let imported = import("iscan-finger.csv", ISCAN, &settings).unwrap();
    let path = imported.save(&folder.path().join("a/b")).unwrap();
    assert_eq!(path, folder.path().join("a/b/finger 1.toml"));
    let opened = Imported::open(&folder.path().join("a/b")).unwrap();
    assert_eq!(
        (&opened.scene, &opened.frames, &opened.summary),
        (&imported.scene, &imported.frames, &imported.summary)
    );
    // All frames are in one file, which a second import replaces.
    imported.save(&folder.path().join("a/b")).unwrap();
    let files = std::fs::read_dir(folder.path().join("a/b")).unwrap();
    let mut files: Vec<_> = files.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    files.sort();
    assert_eq!(files, ["finger 1.mcap", "finger 1.toml", "recording.json"]);
    let fewer = Imported { frames: imported.frames[..1].to_vec(), ..imported.clone() };
    fewer.save(&folder.path().join("fewer")).unwrap();
    let error = Imported::open(&folder.path().join("fewer")).unwrap_err().to_string();
    assert!(error.contains("finger 1.mcap: number of frames = 1"), "{error}");
    let summary = folder.path().join("a/b/recording.json");
    std::fs::write(&summary, "{\"name\": 1}").unwrap();
    let error = Imported::open(&folder.path().join("a/b")).unwrap_err().to_string();
    assert!(error.contains("recording.json, line 1, column 10"), "{error}");
    let error = Imported::open(folder.path()).unwrap_err().to_string();
    assert!(error.contains("recording.json: cannot be read"), "{error}");
}

/// Unit and pitch of the arrays below.
fn stated() -> Settings {
    Settings { unit: Some(Unit::MegaPa), pitch_mm: Some([2.0, 3.0]), ..Settings::default() }
}

#[test]
fn arrays_that_numpy_wrote() {
    macro_rules! array {
        ($name:literal) => {
            include_bytes!(concat!("../../../data/recordings/numpy/", $name, ".npy"))
        };
    }
    let a = |frame: usize, k: usize| 100.0 * frame as f64 + 10.0 * (k / 4) as f64 + (k % 4) as f64;
    let lines = Settings { size: Some([3, 4]), ..stated() };
    type Value = fn(f64) -> f64;
    let cases: [(&str, &[u8], Settings, usize, Value); 6] = [
        ("i2", array!("i2"), stated(), 0, |a| a - 5.0),
        ("f4-fortran", array!("f4-fortran"), stated(), 0, |a| a),
        ("f8-big", array!("f8-big"), stated(), 0, |a| a / 8.0),
        ("u1-lines", array!("u1-lines"), lines.clone(), 0, |a| a),
        ("f2-frame", array!("f2-frame"), stated(), 1, |a| a / 16.0),
        ("i8-lines-fortran", array!("i8-lines-fortran"), lines, 0, |a| -a),
    ];
    for (name, bytes, settings, first, value) in cases {
        let imported = import("a.npy", bytes, &settings).unwrap();
        let dead = if name == "f4-fortran" { 1 } else { 0 };
        // A value that is not a number, in one of two frames.
        assert_eq!((imported.summary.missing, imported.summary.missing_readings), (0, dead), "{name}");
        assert_eq!(imported.frames.len(), if first == 0 { 2 } else { 1 }, "{name}");
        for (index, frame) in imported.frames.iter().enumerate() {
            for (k, stress) in frame.stress_MPa.iter().enumerate().take(12 - dead) {
                assert_eq!(*stress, value(a(first + index, k)), "{name} {index} {k}");
            }
        }
    }
}

#[test]
fn plain_csv_with_times_names_and_missing_values() {
    let settings = Settings { size: Some([2, 3]), ..stated() };
    let read = |text: &str| import("p.csv", text.as_bytes(), &settings).unwrap();
    let plain = read("0,2,1,3,4,5\n\n6,7,8,9,10,11\n");
    assert_eq!(plain.frames[1].stress_MPa, [6.0, 7.0, 8.0, 9.0, 10.0, 11.0]);
    // The numbers of the columns are a header.
    assert_eq!(read("0,1,2,3,4,5\n6,7,8,9,10,11\n").frames[0].stress_MPa, plain.frames[1].stress_MPa);
    for text in [
        "# a remark\ntime;a;b;c;d;e;f\n0,5;0,25;1;2;3;;5\n",
        "0.5\t0.25\t1\t2\t3\tNaN\t5\n0.6\t0.25\t1\t2\t3\tNaN\t5\n",
        "0.5  0.25 1 2   3 B 5\n0.6  0.25 1 2   3 B 5\n",
        "0.5,0.25,1,2,3,,5\n0.6,0.25,1,2,3,,5",
    ] {
        let imported = read(text);
        assert_eq!(imported.frames[0].stress_MPa, [0.25, 1.0, 2.0, 3.0, 0.0, 5.0], "{text}");
        assert_eq!((imported.summary.frames[0].time_s, imported.scene.input.dead), (Some(0.5), vec![[1, 1]]), "{text}");
    }
}

/// 20 moments of a press on 6 × 6 sensels as NumPy and as CSV, with 14 single readings missing in different sensels, and one moment
/// that was lost: no sensel is dead, the missing ones are named, and the force is that of the whole recording.
#[test]
fn readings_missing_in_some_frames_are_missing_there_alone() {
    let load = |t: usize, k: usize| {
        let (x, y) = ((k % 6) as f64 - 2.3, (k / 6) as f64 - 2.8);
        (30.0 + t as f64) * (-(x * x + y * y) / 3.0).exp()
    };
    let gap = |t: usize, k: usize| t < 14 && k == (t * 11 + 5) % 36;
    let reading = |t: usize, k: usize| if gap(t, k) { f64::NAN } else { load(t, k) };
    let bytes = |lost: Option<usize>| {
        let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': (20, 6, 6), }}{}\n", " ".repeat(50));
        let values = (0..720).map(|i| if lost == Some(i / 36) { f64::NAN } else { reading(i / 36, i % 36) });
        let values: Vec<u8> = values.flat_map(f64::to_le_bytes).collect();
        [b"\x93NUMPY\x01\x00", &(header.len() as u16).to_le_bytes()[..], header.as_bytes(), &values].concat()
    };
    let csv = |absent: &str| -> Vec<u8> {
        let cell = |t: usize, k: usize| if gap(t, k) { absent.to_string() } else { load(t, k).to_string() };
        let line = |t: usize| (0..36).map(|k| cell(t, k)).collect::<Vec<_>>().join(",") + "\n";
        (0..20).map(line).collect::<String>().into_bytes()
    };
    let settings =
        Settings { unit: Some(Unit::KiloPa), pitch_mm: Some([5.0, 5.0]), size: Some([6, 6]), ..Settings::default() };
    let whole: Vec<f64> = (0..20).map(|t| 0.025 * (0..36).map(|k| load(t, k)).sum::<f64>()).collect();
    let files = [
        ("a.npy", bytes(None)),
        ("a.csv", csv("nan")),
        ("a.csv", csv("NaN")),
        ("a.csv", csv("")),
        ("a.csv", csv("B")),
        ("a.csv", csv("null")),
    ];
    for (file, bytes) in files {
        let imported = import(file, &bytes, &settings).unwrap();
        let (summary, frames) = (&imported.summary, &imported.frames);
        assert_eq!((summary.missing, summary.missing_readings, summary.left_out.len()), (0, 14, 0), "{file}");
        assert!(imported.scene.input.dead.is_empty() && frames.len() == 20);
        let golden = Golden::new(&imported.scene).unwrap();
        for (t, (frame, record)) in frames.iter().zip(&summary.frames).enumerate() {
            let gaps: Vec<usize> = (0..36).filter(|&k| gap(t, k)).collect();
            assert_eq!(frame.missing, gaps, "{file} {t}");
            assert!((record.normal_N / whole[t] - 1.0).abs() < 0.05, "{file} {t}: {} {}", record.normal_N, whole[t]);
            let read = Frame::parse("a.json", &frame.to_json(), Some(&imported.scene)).unwrap();
            assert_eq!(read, *frame);
            let found = golden.run(&read).unwrap().resultant_N[2];
            assert!((found / whole[t] - 1.0).abs() < 0.05, "{file} {t}: {found} {}", whole[t]);
        }
    }
    // A frame without any reading is left out and named; alone it is an error.
    let lost = import("a.npy", &bytes(Some(9)), &settings).unwrap();
    assert_eq!((lost.frames.len(), lost.summary.left_out.as_slice()), (19, &[10][..]));
    assert!(lost.scene.input.dead.is_empty() && lost.summary.frames.iter().all(|frame| frame.number != 10));
    let cell = |t: usize, k: usize| if k % 3 == t { String::new() } else { load(t, k).to_string() };
    let line = |t: usize| (0..36).map(|k| cell(t, k)).collect::<Vec<_>>().join(",") + "\n";
    let holes = line(0) + &line(1);
    let text = message("a.csv", holes.as_bytes(), &settings);
    assert!(text.starts_with("a.csv, frame 1: ") && text.contains("input.missing_share = 0.2"), "{text}");
}

#[test]
fn what_is_missing_or_wrong_is_named() {
    let none = Settings::default();
    let tekscan = |from: &str, to: &str| decoded(ISCAN).replacen(from, to, 1);
    let cases = [
        (message("a.bin", b"0,1", &none), "a.bin: the format is not recognised; give it with --format"),
        (message("a.csv", ISCAN, &none), "a.csv: the full scale is missing; raw counts have no stress"),
        (message("a.csv", tekscan("ROWS 28", "ROWS x").as_bytes(), &counts()), "a.csv: ROWS = x is not allowed"),
        (message("a.csv", tekscan("ROWS 28\n", "").as_bytes(), &counts()), "a.csv: ROWS is missing"),
        (
            message("a.csv", tekscan("UNITS raw", "UNITS stone").as_bytes(), &counts()),
            "a.csv: UNITS = stone is not allowed",
        ),
        (
            message("a.csv", tekscan("B,B,0,0", "B,B,0,x").as_bytes(), &counts()),
            "a.csv, line 31, value 17: \"x\" is not allowed; it must be a number",
        ),
        (
            message("a.csv", tekscan("B,B,0,0", "B,B,0").as_bytes(), &counts()),
            "a.csv, line 31: \"B,B,5,0,0,0,0,0,0,0,0,0,0,B,B,0,0,0,0,0,\" is not allowed; it must be 28 values",
        ),
        (message("a.csv", &ISCAN[..ISCAN.len() / 2], &counts()), "a.csv: ends early: frame 71 is not complete"),
        (message("a.lst", &EMED[..2000], &none), "a.lst: ends early: the table of picture 30 is not complete"),
        (message("a.npy", b"\x93NUMPY\x01\x00", &none), "a.npy: the NumPy header = cut off is not allowed"),
        (message("a.csv", b"1,2,3,4", &Settings { size: Some([2, 2]), ..none.clone() }), "a.csv: the unit is missing"),
        (
            message("a.csv", b"1,2,3", &Settings { size: Some([2, 2]), ..stated() }),
            "a.csv, line 1: 3 values, wanted 4 of a frame or 2 of a row",
        ),
        (
            message("a.csv", ISCAN, &Settings { frames: Some([20, 25]), ..counts() }),
            "a.csv: --frames = 20..25 is not allowed; it must be within 1..24",
        ),
        (
            message("a.csv", ISCAN, &Settings { crop: Crop::Lines { rows: [0, 28], cols: [0, 9] }, ..counts() }),
            "a.csv: --crop = 0..28,0..9 is not allowed; it must be rows within 0..27",
        ),
        (message("a.csv", ISCAN, &Settings { name: Some("../up".into()), ..counts() }), "../up.toml: name = \"../up\""),
    ];
    for (message, start) in cases {
        assert!(message.starts_with(start), "{message}\nwanted {start}");
    }
}

/// Files of every format with an end that can be missing, cut at many places: an error, and with `partial` the frames before. Between
/// two pages of LST and two frames of XSENSOR nothing shows that there were more.
#[test]
fn of_a_file_that_is_cut_no_frame_is_another_one() {
    let xsensor = "FRAME,1,,\nRows,2,,\nColumns,2,,\nSensel Width (cm),1.0,,\nSensel Height (cm),1.5,,\nUnits,mmHg,,\n\
                   SENSELS,,,\n10.5,0,,\n0,20.25,,\n,,,\nFRAME,2,,\nSENSELS,,,\n1.5,0.25,,\n0,30.75,,\n,,,\n";
    let files: [(&str, Vec<u8>, Settings); 5] = [
        ("a.csv", ISCAN.to_vec(), counts()),
        ("a.asf", decoded(FSCAN).replace(',', ";").replace('.', ",").into_bytes(), Settings::default()),
        ("a.lst", EMED.to_vec(), Settings::default()),
        ("a.npy", include_bytes!("../../../data/recordings/numpy/i2.npy").to_vec(), stated()),
        ("x.csv", xsensor.into(), Settings::default()),
    ];
    for (file, bytes, settings) in files {
        let all = Settings { missing_as_zero: true, ..settings };
        let whole = import(file, &bytes, &all).unwrap_or_else(|error| panic!("{error}"));
        let stress = |imported: &Imported| -> Vec<Vec<f64>> {
            imported.frames.iter().map(|frame| frame.stress_MPa.clone()).collect()
        };
        let (mut refused, mut partial) = (0, 0);
        for at in (0..bytes.len()).rev().step_by(bytes.len() / 60) {
            match import(file, &bytes[..at], &all) {
                // The last line end is no loss.
                Ok(own) => {
                    let (own, whole, has_end) = (stress(&own), stress(&whole), !["a.lst", "x.csv"].contains(&file));
                    assert!(own == whole[..own.len()], "{file} to byte {at}");
                    assert!(!has_end || own.len() == whole.len() && at + 2 >= bytes.len(), "{file} to byte {at}");
                }
                Err(_) => refused += 1,
            }
            if let Ok(own) = import(file, &bytes[..at], &Settings { partial: true, ..all.clone() }) {
                let (own, whole) = (stress(&own), stress(&whole));
                assert!(own.len() <= whole.len() && own == whole[..own.len()], "{file} to byte {at}");
                partial += 1;
            }
        }
        assert!(refused > 30 && partial > 10, "{file}: {refused} refused, {partial} in part");
    }
}

/// What is left of the line that begins a frame takes nothing from the frame before.
#[test]
fn a_file_that_is_cut_between_two_frames_keeps_the_one_before() {
    let text = decoded(ISCAN);
    let partial = Settings { partial: true, ..counts() };
    for behind in ["", "Fr", "Frame 70", "Frame 70, 6"] {
        let cut = format!("{}{behind}", text.split("Frame 70").next().unwrap());
        assert_eq!(message("a.csv", cut.as_bytes(), &counts()).matches("the 10 frames").count(), 1, "{behind:?}");
        assert_eq!(import("a.csv", cut.as_bytes(), &partial).unwrap().frames.len(), 10, "{behind:?}");
    }
}

/// Lines of a comment are no keys, and a file that a spreadsheet has saved again is the same recording.
#[test]
fn comments_and_spreadsheets_change_nothing() {
    let walk = decoded(FSCAN);
    let wanted = import("walk.asf", FSCAN, &Settings::default()).unwrap();
    let remark = |text: &str| walk.replacen("COMMENTS:\n", &format!("COMMENTS:\n{text}\n"), 1);
    let filled = |separator: &str, text: &str| -> String {
        text.lines().map(|line| format!("{line}{}\n", separator.repeat(3))).collect()
    };
    let texts = [
        remark("ROW_SPACING 10 mm"),
        remark("ROWS of the mat run heel to toe"),
        remark("UNITS PSI"),
        remark("UNITS checked against the scale"),
        remark("ASCII_DATA exported by the lab"),
        walk.replacen("END_FRAME", "COMMENTS: UNITS PSI\nSECONDS_PER_FRAME 1\nEND_FRAME", 1),
        format!("\u{feff}{walk}"),
        filled(",", &walk),
        filled(";", &walk.replace(',', ";").replace('.', ",")),
    ];
    for text in texts {
        assert_ne!(text, walk);
        let own = import("walk.asf", text.as_bytes(), &Settings::default()).unwrap_or_else(|error| panic!("{error}"));
        assert!(own.summary == wanted.summary && own.frames == wanted.frames, "{:?}", text.lines().take(30));
    }
}

#[test]
fn arrays_larger_than_a_scene_are_cropped_around_the_contact_or_refused() {
    let mut taxels = vec!["0"; 60 * 60];
    taxels[60 * 20 + 30] = "0.5";
    let settings = Settings { size: Some([60, 60]), ..stated() };
    let imported = import("large.csv", taxels.join(",").as_bytes(), &settings).unwrap();
    assert_eq!(imported.summary.window, Window { row0: 18, col0: 28, rows: 5, cols: 5 });
    let all = message("large.csv", ["0.5"; 60 * 60].join(",").as_bytes(), &settings);
    assert!(
        all.starts_with("large.csv: size = 60×60 is not allowed; it must be at least 2×2 and at most 2304"),
        "{all}"
    );
    let unloaded = message("large.csv", ["0"; 60 * 60].join(",").as_bytes(), &settings);
    assert!(unloaded.contains("the contact is missing"), "{unloaded}");
}

/// A file in its folder, by the way of the program.
fn saved(path: &Path, settings: &Settings, folder: &Path) -> Result<PathBuf, String> {
    load(path, settings).and_then(|imported| imported.save(folder)).map_err(|error| error.to_string())
}

#[test]
fn an_import_replaces_none_of_another_file() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::create_dir(at("other")).unwrap();
    let lines = Settings { size: Some([2, 2]), ..stated() };
    for name in ["my log.csv", "my-log.csv", "other/my-log.csv"] {
        std::fs::write(at(name), "1,2,3,4\n").unwrap();
    }
    let out = at("recordings/my-log");
    saved(&at("my-log.csv"), &lines, &out).unwrap();
    // The same file once more, changed or not.
    std::fs::write(at("my-log.csv"), "1,2,3,4\n5,6,7,8\n").unwrap();
    saved(&at("my-log.csv"), &lines, &out).unwrap();
    for name in ["my log.csv", "other/my-log.csv"] {
        let error = saved(&at(name), &lines, &out).unwrap_err();
        assert!(error.contains("has the import of") && error.contains("my-log.csv already; --out"), "{error}");
    }
    assert_eq!(Imported::open(&out).unwrap().frames.len(), 2);
    // A scene of the user's own.
    std::fs::write(at("my-log.toml"), "").unwrap();
    let error = saved(&at("my-log.csv"), &lines, folder.path()).unwrap_err();
    assert!(error.contains("has a file my-log.toml that no import wrote already"), "{error}");
}

#[test]
fn counts_above_those_of_the_stated_bits_are_refused() {
    let settings = Settings { unit: Some(Unit::Raw), bits: Some(10), size: Some([2, 2]), ..counts() };
    let of = |last: &str, more: Settings| {
        let settings = Settings { pitch_mm: Some([4.0, 4.0]), ..more };
        import("a.csv", format!("1,2,3,4\n1,2,{last},4\n").as_bytes(), &settings).map_err(|error| error.to_string())
    };
    assert!(of("1023", settings.clone()).is_ok());
    let error = of("1024", settings.clone()).unwrap_err();
    assert_eq!(
        error,
        "a.csv: frame 2, row 1, column 0 = 1024 is not allowed; it must be at most 1023, the largest count of 10 bits (--bits)"
    );
    // As the file has them, whatever is corrected.
    let correction = Correction { zero_frames: Some(1), ..Correction::default() };
    assert_eq!(of("1024", Settings { correction, ..settings }).unwrap_err(), error);
}

#[test]
fn a_file_of_tekscan_with_other_frames_than_its_header_states_is_cut() {
    let walk = decoded(FSCAN);
    let stated = |last: &str| walk.replace("END_FRAME 12", &format!("END_FRAME {last}"));
    let error = message("walk.asf", stated("205").as_bytes(), &Settings::default());
    assert!(
        error.contains("the header states frames 1 to 205, which are 205, not 12; --partial takes the 12"),
        "{error}"
    );
    assert!(message("walk.asf", stated("11").as_bytes(), &Settings::default()).contains("which are 11, not 12"));
    let partial = Settings { partial: true, ..Settings::default() };
    assert_eq!(import("walk.asf", stated("205").as_bytes(), &partial).unwrap().frames.len(), 12);
}

#[test]
fn a_file_of_emed_that_ends_in_the_heading_of_a_page_is_cut() {
    let text = decoded(EMED);
    let heading = text.split("Pict-No.: 33").next().unwrap();
    let error = message("a.lst", heading.as_bytes(), &Settings::default());
    assert!(
        error.contains("the heading of the last page has no table below it; --partial takes the 3 frames"),
        "{error}"
    );
}

#[test]
fn lines_of_json_are_frames_in_megapascal() {
    let text = "{\"stress_MPa\": [0.01, 0.02, 0.05, 0.04], \"time_ns\": 0}\n{\"stress_MPa\": [0.01, 0.02, 0.03, 0.04], \"t\": 0.5}\n";
    for file in ["l.ndjson", "l.jsonl", "l.json", "l"] {
        let settings = Settings { size: Some([2, 2]), pitch_mm: Some([4.0, 4.0]), ..Settings::default() };
        let imported = import(file, text.as_bytes(), &settings).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((imported.summary.unit, imported.frames.len()), (Unit::MegaPa, 2));
        assert_eq!((imported.frames[1].stress_MPa[3], imported.summary.frames[1].time_s), (0.04, Some(0.5)));
    }
}

#[test]
fn what_is_no_array_is_named_as_it_is_written() {
    let header = |text: &str| {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend(u16::try_from(text.len()).unwrap().to_le_bytes());
        bytes.extend(text.bytes());
        message("a.npy", &bytes, &stated())
    };
    let cases = [
        ("{'descr': [('a', '<f4'), ('b', '<f4')], 'fortran_order': False}", "descr = [('a', '<f4'), ('b', '<f4')] is"),
        ("{'descr': '<f4', 'fortran_order': 'no', 'shape': (2, 2)}", "fortran_order = 'no' is"),
        ("{'descr': '<f4', 'fortran_order': False, 'shape': (2, -2)}", "shape = (2, -2) is"),
        ("{'descr': '<f4', 'fortran_order': False, 'shape': 5, }", "shape = 5 is"),
    ];
    for (text, wanted) in cases {
        let error = header(text);
        assert!(error.contains(wanted), "{error}");
    }
    let archive = [b"PK\x03\x04".as_slice(), &[0; 26], b"arr_0.npy"].concat();
    let error = message("a.npz", &archive, &stated());
    assert!(error.contains("numpy.save(\"frames.npy\", numpy.load(\"a.npz\")[\"NAME\"])"), "{error}");
}
