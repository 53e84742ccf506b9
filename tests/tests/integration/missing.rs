//! Missing readings by every way into Dermis: the same taxels are named, and the forces are those of the frame that a program gives
//! as numbers, to the bit, by both models. What a simulation or a board gets are the codes of the bit-true model.

use std::io::{Cursor, Read};

use dermis_golden::data::frame::Frame;
use dermis_golden::data::import::{import, Settings, Unit};
use dermis_golden::data::recording::FrameOptions;
use dermis_golden::data::text::Stated;
use dermis_golden::engine::{CheckPace, Engine, State};
use dermis_golden::estimate::float::Golden;
use dermis_golden::fixed::Model;
use dermis_golden::result::flags::Flag;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::scene::Scene;
use dermis_host::recording::{Lines, Pace, Paced, Recorder};
use dermis_host::stream::{run, Estimators, Input, Outcome, Policy, StreamOptions};

/// Missing taxels of eight-by-eight, [row, col].
const MISSING: [[usize; 2]; 3] = [[3, 3], [3, 4], [6, 2]];

fn scene() -> Scene {
    Scene::builtin("eight-by-eight").unwrap()
}

/// Stress of a shipped press.
fn whole() -> Vec<f64> {
    Frame::shipped(&scene()).remove(1).stress_MPa
}

/// The same with NaN on the missing taxels.
fn lacking() -> Vec<f64> {
    let mut stress = whole();
    MISSING.iter().for_each(|[row, col]| stress[8 * row + col] = f64::NAN);
    stress
}

/// Readings as fields of text, `absent` where they are missing.
fn fields(stress: &[f64], absent: &str) -> String {
    let field = |b: &f64| if b.is_nan() { absent.to_owned() } else { b.to_string() };
    stress.iter().map(field).collect::<Vec<_>>().join(",")
}

/// A NumPy file of frames.
fn npy(frames: [&[f64]; 2]) -> Vec<u8> {
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': (2, 8, 8), }}{}\n", " ".repeat(50));
    let values: Vec<u8> = frames.concat().iter().flat_map(|b| b.to_le_bytes()).collect();
    [b"\x93NUMPY\x01\x00", &(header.len() as u16).to_le_bytes()[..], header.as_bytes(), &values].concat()
}

/// The frame of a file of each kind.
fn files(stress: &[f64]) -> Vec<(String, Frame)> {
    let (scene, mut all) = (scene(), Vec::new());
    for absent in ["", " ", "nan", "NaN", "null"] {
        let csv: String = stress.chunks(8).map(|row| fields(row, absent) + "\n").collect();
        all.push((format!("CSV {absent:?}"), Frame::parse("press.csv", &csv, Some(&scene)).unwrap()));
    }
    let json = format!("{{\"stress_MPa\": [{}]}}", fields(stress, "null"));
    all.push(("JSON".to_owned(), Frame::parse("press.json", &json, Some(&scene)).unwrap()));
    let settings = Settings {
        unit: Some(Unit::MegaPa),
        pitch_mm: Some([4.0, 4.0]),
        thickness_mm: Some(3.0),
        size: Some([8, 8]),
        ..Settings::default()
    };
    // Beside a whole frame, so that no sensel is without any reading.
    let csv = |absent: &str| (fields(stress, absent) + "\n" + &fields(&whole(), "") + "\n").into_bytes();
    let recordings = [("press.csv", csv("B")), ("press.csv", csv("NaN")), ("press.npy", npy([stress, &whole()]))];
    for (name, bytes) in recordings {
        let imported = import(name, &bytes, &settings).unwrap();
        assert!(imported.scene.input.dead.is_empty() && imported.summary.missing_readings == MISSING.len(), "{name}");
        let written = imported.frames[0].to_json();
        all.push((format!("import of {name}"), Frame::parse("again.json", &written, Some(&scene)).unwrap()));
    }
    all
}

/// The lines of a stream that hold a frame.
fn lines(stress: &[f64]) -> Vec<String> {
    let json = format!("{{\"stress_MPa\": [{}]}}\n", fields(stress, "null"));
    ["", "nan", "NaN", "null"].map(|absent| fields(stress, absent) + "\n").into_iter().chain([json]).collect()
}

/// The results of a stream, all but the frame's name; and the recording of it.
fn streamed(engine: &dyn Engine, input: Input, recorder: &mut Recorder) -> Vec<Reconstruction> {
    let (options, mut all) =
        (StreamOptions { queue: 4, policy: Policy::All, live: false, layout: Stated::default() }, Vec::new());
    let mut output = |outcome: &Outcome| match outcome {
        Outcome::Answer(answer) => {
            all.push(answer.result.clone());
            recorder.outcome(outcome).map_err(std::io::Error::other)
        }
        Outcome::Refusal(refusal) => panic!("line {}: {}", refusal.line, refusal.error),
        Outcome::Note(text) => panic!("{text}"),
    };
    run(Estimators::only(engine, CheckPace::Never), (input, "memory"), options, &mut output).unwrap();
    all
}

/// Of a result what does not depend on the frame's name, nor on a stream.
fn bare(result: &Reconstruction) -> Reconstruction {
    let mut bare = result.clone();
    bare.frame.clear();
    (bare.checks.constant_share, bare.checks.torn_share) = (None, None);
    bare.extra.tracks.clear();
    bare
}

#[test]
fn every_way_in_names_the_same_taxels_and_gives_the_same_forces() {
    let (scene, folder) = (scene(), tempfile::tempdir().unwrap());
    let stress = lacking();
    let engines: [(Box<dyn Engine>, f64); 2] =
        [(Box::new(Golden::new(&scene).unwrap()), 0.02), (Box::new(Model::new(&scene).unwrap()), 0.1)];
    for (engine, bound) in engines {
        let of = |frame: &Frame| engine.reconstruct(std::slice::from_ref(frame)).unwrap();
        let exact = of(&Frame::from_stress("whole", &scene.sensor, whole()).unwrap());
        let wanted = of(&Frame::from_stress("numbers", &scene.sensor, stress.clone()).unwrap());
        let named: Vec<[usize; 2]> = wanted.extra.missing.iter().map(|own| [own.row, own.col]).collect();
        assert!(named == MISSING && wanted.flags.contains(&Flag::TaxelMissing), "{:?}", wanted.flags);
        let off = (0..3).map(|k| (wanted.resultant_N[k] - exact.resultant_N[k]).abs() / exact.resultant_N[2]);
        assert!(off.fold(0.0, f64::max) < bound, "{:?} {:?}", wanted.resultant_N, exact.resultant_N);
        for (name, frame) in files(&stress) {
            assert_eq!(bare(&of(&frame)), bare(&wanted), "{}: {name}", exact.engine);
        }
        let path = |name: &str| folder.path().join(format!("{}-{name}.mcap", exact.engine));
        let mut recorder = Recorder::create(&path("press"), &scene).unwrap();
        let input = lines(&stress);
        let bytes = |bytes: Box<dyn Read + Send>| Input::Bytes(bytes);
        let results = streamed(&*engine, bytes(Box::new(Cursor::new(input.concat().into_bytes()))), &mut recorder);
        assert_eq!(results.len(), input.len());
        recorder.finish().unwrap();
        let again = || Paced::open(path("press"), FrameOptions::default(), Pace::Unbounded, [false, false]).unwrap();
        let mut other = Recorder::create(&path("replayed"), &scene).unwrap();
        let replayed = streamed(&*engine, bytes(Box::new(Lines::of(again()))), &mut other);
        assert_eq!(replayed.len(), input.len());
        // Values are the same as their lines.
        let mut values = Recorder::create(&path("values"), &scene).unwrap();
        assert_eq!(streamed(&*engine, Input::Frames(Box::new(again())), &mut values), replayed);
        // A frame of a stream goes on from the one before it.
        let mut state = State::default();
        let frame = Frame::from_stress("numbers", &scene.sensor, stress.clone()).unwrap();
        for (found, again) in results.iter().zip(&replayed) {
            let next = engine.reconstruct_after(&mut state, std::slice::from_ref(&frame)).unwrap();
            assert_eq!((bare(found), bare(again)), (bare(&next), bare(&next)), "{}", exact.engine);
            assert_eq!(next.extra.missing, wanted.extra.missing);
            assert!((next.resultant_N[2] / wanted.resultant_N[2] - 1.0).abs() < 1e-3, "{:?}", next.resultant_N);
        }
    }
    // With 0 in place of the missing readings, as a seeded fault, the forces are others.
    let zeros: Vec<f64> = stress.iter().map(|b| if b.is_nan() { 0.0 } else { *b }).collect();
    let model = Model::new(&scene).unwrap();
    let force = |stress: &[f64]| {
        let frame = Frame::from_stress("now", &scene.sensor, stress.to_vec()).unwrap();
        model.reconstruct(&frame).unwrap().resultant_N[2]
    };
    assert!((force(&zeros) / force(&whole()) - 1.0).abs() > 0.1, "{} {}", force(&zeros), force(&whole()));
}

/// A device gets numbers: the codes of what is predicted, those of the bit-true model.
#[test]
fn codes_of_missing_readings_are_those_of_predicted_stress() {
    let (scene, stress) = (scene(), lacking());
    let model = Model::new(&scene).unwrap();
    let frame = Frame::from_stress("lacking", &scene.sensor, stress).unwrap();
    let found = model.reconstruct(&frame).unwrap();
    let mut filled = frame.clone();
    filled.missing.clear();
    found.extra.missing.iter().for_each(|own| filled.stress_MPa[8 * own.row + own.col] = own.stress_MPa);
    assert_eq!(model.readings(&[frame]).unwrap(), model.readings(&[filled.clone()]).unwrap());
    assert_eq!(model.reconstruct(&filled).unwrap().forces_N, found.forces_N);
    let [row, col] = MISSING[0];
    assert!(filled.stress_MPa[8 * row + col] > 0.0);
}
