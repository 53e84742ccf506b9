//! The readers of files and packets, and the seeds of each.

use std::path::Path;

use dermis_golden::data::frame::Frame;
use dermis_golden::data::import::{import, Correction, Format, Settings, Unit};
use dermis_golden::data::input::calibration::Calibration;
use dermis_golden::spec::board::Board;
use dermis_golden::spec::scene::Scene;
use dermis_golden::spec::sensor::Sensor;
use dermis_golden::wire::link::Decoder;
use dermis_hdl::manifest;

/// The folder of a reader's seeds, and the reader, which returns whether it accepted the bytes.
type Target = (&'static str, fn(&[u8]) -> bool);
/// All readers.
pub const TARGETS: [Target; 15] = [
    ("scene", scene),
    ("board", board),
    ("frame.json", json),
    ("frame.csv", csv),
    ("calibration", calibration),
    ("manifest", manifests),
    ("packets", packets),
    ("import.tekscan", |bytes| recording("fuzz.asf", Format::Tekscan, bytes)),
    ("import.lst", |bytes| recording("fuzz.lst", Format::Lst, bytes)),
    ("import.npy", |bytes| recording("fuzz.npy", Format::Npy, bytes)),
    ("import.xsensor", |bytes| recording("fuzz.csv", Format::Xsensor, bytes)),
    ("import.flexitac", |bytes| recording("fuzz.bin", Format::Flexitac, bytes)),
    ("import.paxini", |bytes| recording("fuzz.csv", Format::Paxini, bytes)),
    ("import.xela", |bytes| recording("fuzz.log", Format::Xela, bytes)),
    ("import.csv", |bytes| recording("fuzz.csv", Format::Csv, bytes)),
];

/// The seeds of a target, in the order of their names.
pub fn corpus(target: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target);
    let mut files: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert!(!files.is_empty(), "{target} has no seeds");
    files.iter().map(|path| std::fs::read(path).unwrap()).collect()
}

fn sensor() -> Sensor {
    Sensor { rows: 3, cols: 4, pitch_x_mm: 2.0, pitch_y_mm: 3.0, thickness_mm: 2.5 }
}

fn scene(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    match Scene::parse(&text, "fuzz.toml") {
        Ok(scene) => {
            assert!(scene.sensor.check().is_ok() && !scene.name.is_empty() && !scene.name.contains(['/', '\n']));
            let level = scene.inversion().level;
            assert!((0.0..1.0).contains(&level), "{level}");
            true
        }
        Err(error) => {
            assert!(error.to_string().starts_with("fuzz.toml"), "{error}");
            false
        }
    }
}

fn board(bytes: &[u8]) -> bool {
    match Board::parse("fuzz", "fuzz.toml", &String::from_utf8_lossy(bytes)) {
        Ok(board) => {
            assert!(board.clock_MHz > 0.0 && board.block_rams_for(1000, 18) > 0 && board.multipliers_for(40, 20) > 0);
            true
        }
        Err(error) => {
            assert!(error.to_string().starts_with("fuzz.toml"), "{error}");
            false
        }
    }
}

fn frame(name: &str, bytes: &[u8]) -> Option<Frame> {
    let text = String::from_utf8_lossy(bytes);
    let own = Scene::of_sensor(&sensor(), "own");
    match Frame::parse(name, &text, Some(&own)) {
        Ok(frame) => {
            assert_eq!(frame.stress_MPa.len(), frame.sensor.taxels());
            assert!(frame.stress_MPa.iter().all(|b| b.is_finite()));
            Some(frame)
        }
        Err(error) => {
            assert!(error.to_string().contains(name), "{error}");
            None
        }
    }
}

fn json(bytes: &[u8]) -> bool {
    let Some(read) = frame("fuzz.json", bytes) else { return false };
    assert_eq!(Frame::parse("fuzz.json", &read.to_json(), None).unwrap(), read);
    true
}

fn csv(bytes: &[u8]) -> bool {
    frame("fuzz.csv", bytes).is_some()
}

fn calibration(bytes: &[u8]) -> bool {
    match Calibration::parse(&String::from_utf8_lossy(bytes), "fuzz.csv", &sensor()) {
        Ok(table) => {
            assert!(table.gain.iter().all(|gain| *gain != 0.0 && gain.is_finite()));
            true
        }
        Err(error) => {
            assert!(error.to_string().starts_with("fuzz.csv"), "{error}");
            false
        }
    }
}

fn manifests(bytes: &[u8]) -> bool {
    let read = manifest::parse(&String::from_utf8_lossy(bytes), "manifest.json");
    assert!(read.as_ref().err().is_none_or(|error| error.to_string().starts_with("manifest.json")), "{read:?}");
    read.is_ok()
}

fn packets(bytes: &[u8]) -> bool {
    let mut decoder = Decoder::default();
    let mut any = false;
    for packet in bytes.iter().filter_map(|byte| decoder.next(*byte)).flatten() {
        let mut again = Decoder::default();
        let found: Vec<_> = packet.to_wire().iter().filter_map(|byte| again.next(*byte)).collect();
        assert_eq!(found, [Ok(packet)]);
        any = true;
    }
    any
}

/// Imports a recording of 3×4 sensels, where its format does not state the size, in the format's unit or as counts.
fn recording(name: &str, format: Format, bytes: &[u8]) -> bool {
    let plain = matches!(format, Format::Npy | Format::Csv);
    let sized = matches!(format, Format::Flexitac | Format::Paxini | Format::Xela);
    // Some are corrected.
    let [corrected, turned] = [3, 5].map(|k| bytes.len().is_multiple_of(k));
    let zero_frames = corrected.then_some(1);
    let correction =
        Correction { zero_frames, invert: corrected, transpose: turned, flip_x: turned, flip_y: corrected };
    let settings = Settings {
        format: Some(format),
        // NumPy states the size, but for lines of sensels.
        size: (sized || plain && (format == Format::Csv || !bytes.len().is_multiple_of(2))).then_some([3, 4]),
        unit: plain.then_some(Unit::KiloPa),
        pitch_mm: (plain || sized).then_some([2.0, 3.0]),
        full_scale_MPa: (sized || format == Format::Tekscan).then_some(1.0),
        partial: sized && turned,
        correction,
        ..Settings::default()
    };
    match import(name, bytes, &settings) {
        Ok(imported) => {
            let sensor = &imported.scene.sensor;
            assert_eq!(imported.frames.len(), imported.summary.frames.len());
            for (frame, record) in imported.frames.iter().zip(&imported.summary.frames) {
                assert_eq!(&frame.sensor, sensor);
                assert!(frame.stress_MPa.iter().all(|b| b.is_finite()));
                assert!(record.normal_N.is_finite() && record.outside_N.is_finite());
            }
            let again = Scene::parse(&imported.scene_text, &format!("{}.toml", imported.summary.name));
            assert_eq!(again.unwrap(), imported.scene);
            true
        }
        Err(error) => {
            assert!(error.to_string().contains("fuzz"), "{error}");
            false
        }
    }
}
