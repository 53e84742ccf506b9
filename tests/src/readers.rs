//! The readers of files, streams, packets and requests, and the seeds of each: fuzzed by mutation in `tests/tests/fuzz`, by coverage in
//! `tests/fuzz-targets`.

use std::fmt::Display;
use std::io::Cursor;
use std::path::Path;

use dermis_golden::data::frame::Frame;
use dermis_golden::data::import::{import, Correction, Format, Settings, Unit};
use dermis_golden::data::input::calibration::Calibration;
use dermis_golden::data::recording::{FrameOptions, Frames};
use dermis_golden::data::text::{frames, Form, Line, NoReadings, Read, Reader, Stated};
use dermis_golden::plain_words::REFUSED;
use dermis_golden::spec::board::Board;
use dermis_golden::spec::scene::Scene;
use dermis_golden::spec::sensor::Sensor;
use dermis_golden::wire::link::Decoder;
use dermis_golden::wire::udp::{Answers, Packet};
use dermis_hdl::manifest;
use dermis_sim::live::request;

/// A reader, which returns whether it accepted the bytes.
pub type Target = fn(&[u8]) -> bool;
/// All readers, by the folder of their seeds.
pub const TARGETS: [(&str, Target); 19] = [
    ("scene", scene),
    ("board", board),
    ("frame.json", json),
    ("frame.csv", csv),
    ("calibration", calibration),
    ("manifest", manifests),
    ("packets", packets),
    ("datagrams", datagrams),
    ("import.tekscan", |bytes| recording("fuzz.asf", Format::Tekscan, bytes)),
    ("import.lst", |bytes| recording("fuzz.lst", Format::Lst, bytes)),
    ("import.npy", |bytes| recording("fuzz.npy", Format::Npy, bytes)),
    ("import.xsensor", |bytes| recording("fuzz.csv", Format::Xsensor, bytes)),
    ("import.flexitac", |bytes| recording("fuzz.bin", Format::Flexitac, bytes)),
    ("import.paxini", |bytes| recording("fuzz.csv", Format::Paxini, bytes)),
    ("import.xela", |bytes| recording("fuzz.log", Format::Xela, bytes)),
    ("import.csv", |bytes| recording("fuzz.csv", Format::Csv, bytes)),
    ("lines", lines),
    ("recording.mcap", recorded),
    ("http", http),
];

/// The reader of a name.
///
/// # Panics
/// If there is none.
pub fn named(name: &str) -> Target {
    let target = TARGETS.iter().find(|(own, _)| *own == name);
    target.unwrap_or_else(|| panic!("{name:?} is none of {:?}", TARGETS.map(|(own, _)| own))).1
}

/// The seeds of a target, in the order of their names.
///
/// # Panics
/// If it has none.
pub fn corpus(target: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target);
    let mut files: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert!(!files.is_empty(), "{target} has no seeds");
    files.iter().map(|path| std::fs::read(path).unwrap()).collect()
}

/// Checks an error: it begins with the file's name, and has no words of the program.
fn check_error(file: &str, error: impl Display, bytes: &[u8]) {
    let text = error.to_string();
    assert!(text.starts_with(file), "{text}");
    check_words(&text, bytes);
}

/// Checks that a message has no words of the program but those that it quotes from `bytes`.
fn check_words(text: &str, bytes: &[u8]) {
    let input = String::from_utf8_lossy(bytes);
    assert!(!REFUSED.iter().any(|words| text.contains(words) && !input.contains(words)), "{text}");
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
            check_error("fuzz.toml", error, bytes);
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
            check_error("fuzz.toml", error, bytes);
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
            check_error(name, error, bytes);
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
            check_error("fuzz.csv", error, bytes);
            false
        }
    }
}

fn manifests(bytes: &[u8]) -> bool {
    let read = manifest::parse(&String::from_utf8_lossy(bytes), "manifest.json");
    read.map_err(|error| check_error("manifest.json", error, bytes)).is_ok()
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

/// A sequence of packets of UDP, each behind its length in two bytes.
fn datagrams(bytes: &[u8]) -> bool {
    let (mut answers, mut any, mut rest) = (Answers::default(), false, bytes);
    while let Some((length, behind)) = rest.split_first_chunk() {
        let (own, behind) = behind.split_at(behind.len().min(u16::from_le_bytes(*length).into()));
        if let Some(packet) = Packet::of_bytes(own) {
            assert_eq!(packet.to_bytes(), own);
        }
        any |= answers.add(own).is_some();
        rest = behind;
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
            check_error("fuzz", error, bytes);
            false
        }
    }
}

/// The frames of the lines of 3×4 sensels, as a stream and as a whole text.
fn lines(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    let shape = [sensor().rows, sensor().cols];
    let mut reader = Reader::new(shape, Stated { form: Some(Form::Line), ..Stated::default() });
    let mut read: Vec<Read> =
        text.lines().enumerate().flat_map(|(k, text)| reader.push(Line { number: k + 1, text })).collect();
    read.extend(reader.finish());
    let whole =
        frames(&text, shape, &Stated::default()).map_err(|error: NoReadings| check_words(&error.to_string(), bytes));
    let mut any = false;
    for read in read {
        match read {
            Read::Frame(frame) => {
                assert_eq!(frame.readings.len(), sensor().taxels());
                assert!(frame.readings.iter().all(|reading| !reading.is_infinite()));
                any = true;
            }
            Read::LeftOut(left_out) => check_words(&left_out.reason.to_string(), bytes),
            Read::Header(_) => (),
        }
    }
    for frame in whole.iter().flat_map(|whole| &whole.frames) {
        assert!(frame.readings.len() == sensor().taxels() && frame.first_line <= frame.line);
    }
    any
}

/// The frames of an MCAP file up to its end or to what is wrong.
fn recorded(bytes: &[u8]) -> bool {
    let options = FrameOptions { MPa_per_count: Some(1e-3), ..FrameOptions::default() };
    let mut frames = Frames::of(Cursor::new(bytes.to_vec()), options);
    let mut any = false;
    loop {
        match frames.next_frame() {
            Ok(Some(frame)) => assert_eq!(frame.stress_MPa.len(), frame.shape[0] * frame.shape[1]),
            Ok(None) => return any,
            Err(error) => {
                check_words(&error.to_string(), bytes);
                return any;
            }
        }
        any = true;
    }
}

/// A request of a browser.
fn http(bytes: &[u8]) -> bool {
    match request::read(&mut &*bytes) {
        Ok(Some(Ok(request))) => {
            assert!(request.body.len() <= bytes.len() && !request.method.is_empty() && !request.path.is_empty());
            true
        }
        Ok(Some(Err((status, text)))) => {
            assert!(status.starts_with('4'), "{status}");
            check_words(&text, bytes);
            false
        }
        Ok(None) | Err(_) => false,
    }
}
