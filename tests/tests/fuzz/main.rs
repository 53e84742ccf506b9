//! Fuzzing: every reader of files and packets, and the whole way from a scene's text to forces, on mutated and random
//! input.
//!
//! | part | input | must hold |
//! |---|---|---|
//! | scene, frame, calibration, manifest | seeds of `corpus/`, bytes and words changed | error or value, no panic |
//! | frame.json | the same | what is read is written and read again as the same |
//! | packets | the same | a packet found is found again when it is sent |
//! | whole | drawn scenes, drawn and broken frames | error or finite forces, in floating point and in integers |
//!
//! Besides: no input takes longer than [`SLOWEST`], and reading allocates no more than [`BYTES_PER_BYTE`] for each byte
//! of text and [`BYTES`]. Inputs are drawn from a seed and repeat; a failing one is printed, to be added to `corpus/`,
//! all of which is read first.
//!
//! `make fuzz` runs 10⁷ inputs over the readers and 10⁵ over the whole way; without its variables a short part of both.

use std::panic::{catch_unwind, AssertUnwindSafe};
use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use dermis_golden::fixed::Model;
use dermis_golden::frame::Frame;
use dermis_golden::input::calibration::Calibration;
use dermis_golden::link::Decoder;
use dermis_golden::reconstruct::{Golden, Reconstruction};
use dermis_golden::scene::Scene;
use dermis_golden::sensor::Sensor;
use dermis_hdl::manifest;
use fastrand::Rng;

mod counting;
mod draw;

use counting::{Counting, MOST, NOW};
use draw::{drawn_scene, drawn_stress, mutated};

/// Longest time for one input of a reader.
const SLOWEST: Duration = Duration::from_secs(2);
/// Longest time for one scene and frame.
const SLOWEST_WHOLE: Duration = Duration::from_secs(20);
/// Most bytes that reading may take, besides those for each byte of text.
const BYTES: usize = 8 << 20;
/// Most bytes for each byte of text: a parsed value for every character.
const BYTES_PER_BYTE: usize = 400;
#[global_allocator]
static COUNTING: Counting = Counting;

/// The counts are of one test at a time.
static ALONE: Mutex<()> = Mutex::new(());

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

/// The folder of a reader's seeds, and the reader: whether it took the bytes.
type Target = (&'static str, fn(&[u8]) -> bool);
const TARGETS: [Target; 6] = [
    ("scene", scene),
    ("frame.json", json),
    ("frame.csv", csv),
    ("calibration", calibration),
    ("manifest", manifests),
    ("packets", packets),
];

/// The seeds of a target, in the order of their names.
fn corpus(target: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target);
    let mut files: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert!(!files.is_empty(), "{target} has no seeds");
    files.iter().map(|path| std::fs::read(path).unwrap()).collect()
}

/// Runs one input; a panic, a long time or much memory fails with the input.
fn survive(name: &str, bytes: &[u8], slowest: Duration, run: impl FnOnce()) -> usize {
    let (before, start) = (NOW.load(Ordering::Relaxed), Instant::now());
    MOST.store(before, Ordering::Relaxed);
    let outcome = catch_unwind(AssertUnwindSafe(run));
    let taken = MOST.load(Ordering::Relaxed).saturating_sub(before);
    let input = || format!("{name}: {:?}", String::from_utf8_lossy(bytes));
    assert!(outcome.is_ok(), "panic on {}", input());
    assert!(start.elapsed() <= slowest, "{:?} for {}", start.elapsed(), input());
    taken
}

/// How many inputs: the variable's, or a short part.
fn wanted(variable: &str, short: usize) -> usize {
    std::env::var(variable).map_or(short, |text| text.parse().expect("a number of inputs"))
}

#[test]
fn readers_take_anything() {
    let _alone = ALONE.lock();
    let each = wanted("DERMIS_FUZZ_INPUTS", 30_000).div_ceil(TARGETS.len());
    for (number, (name, target)) in TARGETS.into_iter().enumerate() {
        let seeds = corpus(name);
        let mut random = Rng::with_seed(number as u64);
        let (mut most, mut taken_by_it) = (0, 0);
        for k in 0..seeds.len() + each {
            let bytes = seeds.get(k).cloned().unwrap_or_else(|| mutated(&mut random, &seeds));
            let taken = survive(name, &bytes, SLOWEST, || taken_by_it += usize::from(target(&bytes)));
            assert!(
                taken <= BYTES + BYTES_PER_BYTE * bytes.len(),
                "{taken} bytes for {:?}",
                String::from_utf8_lossy(&bytes)
            );
            most = most.max(taken);
        }
        println!("{name}: {} inputs, {taken_by_it} taken, at most {most} bytes", seeds.len() + each);
        // The draw reaches both sides of the reader.
        assert!(0 < taken_by_it && taken_by_it < each, "{name}: {taken_by_it} taken");
    }
}

fn check(result: &Reconstruction) {
    let forces = &result.forces_N;
    let all = [&forces.fx, &forces.fy, &forces.fz].into_iter().flatten().chain(&result.resultant_N);
    for force in all {
        assert!(force.is_finite(), "{force}");
    }
    for part in &result.subarrays {
        assert!(part.mu.iter().all(|mu| mu.abs() <= 2.0 + 1e-9));
    }
}

#[test]
fn the_whole_way_takes_anything() {
    /// Frames of one scene.
    const FRAMES: usize = 10;
    let _alone = ALONE.lock();
    let runs = wanted("DERMIS_FUZZ_RUNS", 600);
    let mut random = Rng::with_seed(7);
    let (mut golden_results, mut fixed_results, mut refused) = (0, 0, 0);
    for _ in 0..runs.div_ceil(FRAMES) {
        let text = drawn_scene(&mut random);
        let mut engines = (None, None, None);
        survive("scene", text.as_bytes(), SLOWEST_WHOLE, || {
            let Ok(scene) = Scene::parse(&text, "fuzz.toml") else { return };
            let golden = Golden::new(&scene);
            let model = Model::new(&scene);
            for message in golden
                .as_ref()
                .err()
                .map(ToString::to_string)
                .iter()
                .chain(&model.as_ref().err().map(ToString::to_string))
            {
                assert!(!message.is_empty() && !message.contains("internal"), "{message}");
            }
            engines = (Some(scene), golden.ok(), model.ok());
        });
        let (scene, golden, model) = engines;
        for _ in 0..FRAMES {
            let Some(scene) = &scene else {
                refused += 1;
                continue;
            };
            let stress = drawn_stress(&mut random, scene.sensor.taxels());
            let input = format!("{text}{stress:?}");
            survive("whole", input.as_bytes(), SLOWEST_WHOLE, || {
                let Ok(frame) = Frame::from_stress("drawn", &scene.sensor, stress) else { return };
                let golden = golden.as_ref().map(|golden| golden.run(&frame));
                let fixed = model.as_ref().map(|model| model.reconstruct(&frame));
                refused += usize::from(golden.is_none() && fixed.is_none());
                if let Some(Ok(result)) = &golden {
                    check(result);
                    golden_results += 1;
                }
                if let Some(Ok(result)) = &fixed {
                    check(result);
                    fixed_results += 1;
                }
            });
        }
    }
    println!(
        "{runs} frames: {golden_results} golden results, {fixed_results} fixed, {refused} frames of refused scenes"
    );
    // The draw is worth something: a good share of it goes all the way.
    assert!(3 * golden_results > runs && 10 * fixed_results > runs, "{golden_results} {fixed_results} of {runs}");
}
