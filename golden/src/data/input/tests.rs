//! Input options on frames with known forces, and invalid tables.

use super::*;
use crate::data::generator::converter::Converter;
use crate::estimate::float::Golden;
use crate::fixed::Model;
use crate::result::reconstruct::Reconstruction;
use crate::spec::scene::{ForceOutput, MeanKind, Scene};
use crate::spec::sensor::Sensor;
use crate::spec::sliding;
use std::cell::Cell;

thread_local! {
    /// Calls of [`Input::calibrate`] in this thread.
    pub(super) static CALIBRATIONS: Cell<usize> = const { Cell::new(0) };
}

fn scene(name: &str) -> Scene {
    Scene::builtin(name).unwrap()
}

fn hertz() -> Frame {
    Frame::shipped(&scene("sensor-1")).into_iter().find(|frame| frame.id == "S1-hs-hertz").unwrap()
}

fn run(scene: &Scene, frame: &Frame) -> Reconstruction {
    Golden::reference(scene).unwrap().run(frame).unwrap()
}

fn shears(results: impl Iterator<Item = Reconstruction>) -> Vec<f64> {
    let mut errors: Vec<f64> = results.filter_map(|result| result.error?.tangential).collect();
    errors.sort_by(f64::total_cmp);
    errors
}

#[test]
fn a_dead_taxel_costs_little_and_its_reading_nothing() {
    let mut scene = scene("sensor-1");
    let mut results = Vec::new();
    for frame in Frame::shipped(&scene) {
        let peak = (0..100).max_by(|a, b| frame.stress_MPa[*a].total_cmp(&frame.stress_MPa[*b])).unwrap();
        scene.input.dead = vec![[peak / 10, peak % 10]];
        let golden = Golden::reference(&scene).unwrap();
        let result = golden.run(&frame).unwrap();
        // A masked taxel may read anything: forces, condition, centroids and flags do not change.
        for share in [-0.5, 1e6] {
            let mut stuck = frame.clone();
            stuck.stress_MPa[peak] *= share;
            assert_eq!(golden.run(&stuck).unwrap(), result);
        }
        assert!(result.error.as_ref().unwrap().normal.unwrap() <= 0.02, "{}", frame.id);
        results.push(result);
    }
    let errors = shears(results.into_iter());
    // Without dead taxels the median is 1.4 %.
    assert!(errors[errors.len() / 2] <= 0.03, "{errors:?}");
}

#[test]
fn a_masked_taxel_beats_one_taken_for_zero() {
    let scene = scene("sensor-2");
    for frame in Frame::shipped(&scene).iter().filter(|frame| frame.id.contains("hertz") || frame.id.contains("ring")) {
        let peak = (0..100).max_by(|a, b| frame.stress_MPa[*a].total_cmp(&frame.stress_MPa[*b])).unwrap();
        let taxel = [peak / 10, peak % 10];
        let broken = Converter { dead: vec![taxel], ..Default::default() }.convert(frame).unwrap();
        let mut masked = scene.clone();
        masked.input.dead = vec![taxel];
        let normal = |scene: &Scene| run(scene, &broken).error.unwrap().normal.unwrap();
        assert!(normal(&masked) < 0.5 * normal(&scene), "{}", frame.id);
    }
}

#[test]
fn every_part_of_a_partition_is_masked_for_itself() {
    let mut scene = scene("sensor-2");
    scene.partition.case = crate::spec::partition::Case::numbered(1).unwrap();
    scene.input.dead = vec![[0, 0], [9, 9], [4, 5]];
    let frame = Frame::shipped(&scene).remove(0);
    let mut changed = frame.clone();
    [0, 99, 45].into_iter().for_each(|k| changed.stress_MPa[k] = 0.0);
    assert_eq!(run(&scene, &frame).forces_N, run(&scene, &changed).forces_N);
}

#[test]
fn table_and_tare_undo_what_the_sensor_did() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene("sensor-1");
    let frame = hertz();
    let (offset, gain) = (|k: usize| 0.1 + 0.01 * k as f64, |k: usize| 0.5 + 0.02 * (k % 7) as f64);
    let mut readings = frame.clone();
    (0..100).for_each(|k| readings.stress_MPa[k] = frame.stress_MPa[k] / gain(k) + offset(k));
    let line = |k: usize| format!("{},{},{},{}\n", k / 10, k % 10, offset(k), gain(k));
    let table: String = (0..100).rev().map(line).collect();
    let path = folder.path().join("table.csv");
    std::fs::write(&path, format!("# sensor 7\n row, col,offset,gain\n\n{table}")).unwrap();
    scene.input.calibration = Some(path);
    let near = |result: Reconstruction| {
        let wanted = run(&Scene::builtin("sensor-1").unwrap(), &frame).resultant_N;
        (0..3).all(|axis| (result.resultant_N[axis] - wanted[axis]).abs() < 1e-9)
    };
    assert!(near(run(&scene, &readings)));
    // A tare frame replaces the offsets.
    let zero = Frame::from_stress("zero", &scene.sensor, (0..100).map(|k| offset(k) + 0.3).collect()).unwrap();
    let path = folder.path().join("zero.json");
    std::fs::write(&path, zero.to_json()).unwrap();
    scene.input.tare = Some(path);
    readings.stress_MPa.iter_mut().for_each(|b| *b += 0.3);
    assert!(near(run(&scene, &readings)));
    scene.input.tare = Some(folder.path().join("absent.json"));
    assert!(Golden::reference(&scene).err().unwrap().to_string().contains("absent.json: cannot be read"));
}

#[test]
fn bad_tables_are_refused_with_their_place() {
    let sensor = Sensor { rows: 2, cols: 2, pitch_x_mm: 1.0, pitch_y_mm: 1.0, thickness_mm: 1.0 };
    let cases = [
        ("", "t.csv, line 1: \"\" is not allowed; it must be the header row,col,offset,gain"),
        ("row,col,gain,offset\n", "line 1: \"row,col,gain,offset\""),
        ("0,0,0\n", "line 2: \"0,0,0\" is not allowed; it must be four values"),
        ("2,0,0,1\n", "line 2: \"2\" is not allowed; it must be a row from 0 to 1"),
        ("0,-1,0,1\n", "\"-1\" is not allowed; it must be a col from 0 to 1"),
        ("0,0,x,1\n", "\"x\" is not allowed; it must be a finite offset"),
        ("0,0,0,0\n", "\"0\" is not allowed; it must be a finite gain other than 0"),
        ("0,0,0,NaN\n", "\"NaN\""),
        ("0,0,0,1\n0,0,0,1\n", "line 3: \"0,0\" is not allowed; it must be a taxel that has no line yet"),
        ("0,0,0,1\n1,1,0,1\n", "no line for taxel 0,1; 2 of 4 taxels are missing"),
    ];
    for (text, wanted) in cases {
        let own = text.is_empty() || text.starts_with("row");
        let text = if own { text.to_string() } else { format!("{}\n{text}", calibration::HEADER) };
        let error = Calibration::parse(&text, "t.csv", &sensor).unwrap_err().to_string();
        assert!(error.starts_with("t.csv") && error.contains(wanted), "{error}");
    }
}

#[test]
fn averages_lower_the_noise_by_the_root_of_their_count() {
    let mut scene = scene("sensor-1");
    scene.input.average = 6;
    let input = Input::new(&scene).unwrap();
    let frame = hertz();
    let noisy = |seed| Converter { noise: 0.01, seed, ..Default::default() }.convert(&frame).unwrap();
    let frames: Vec<Frame> = (0..64).map(noisy).collect();
    let mean = input.average(&scene, &frames).unwrap();
    let squares = mean.stress_MPa.iter().zip(&frame.stress_MPa).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    let deviation = (squares / 100.0).sqrt() / frame.peak_MPa();
    // 100 draws estimate a deviation to 1/√200 = 7 %; four times that.
    assert!((deviation / 0.00125 - 1.0).abs() < 0.28, "{deviation}");
    let error = Golden::reference(&scene).unwrap().run_averaged(&frames[1..]).unwrap_err().to_string();
    assert_eq!(error, "scene sensor-1: input.average = 6 takes 64 frames at a time, got 63");
    assert!(input.average(&scene, &[]).is_err());
}

/// Of 15 frames, at which the count stops, and of fewer; the result has the last frame's name and the count.
#[test]
fn a_sliding_mean_has_the_noise_of_its_frames() {
    let mut scene = scene("sensor-1");
    (scene.input.average, scene.input.mean) = (3, MeanKind::Sliding);
    scene.search.noise_floor_MPa = Some(1e-3);
    let input = Input::new(&scene).unwrap();
    let frame = hertz();
    let noisy = |seed| Converter { noise: 0.01, seed, ..Default::default() }.convert(&frame).unwrap();
    let frames: Vec<Frame> = (0..40).map(noisy).collect();
    assert_eq!(input.average(&scene, &frames[..1]).unwrap(), frames[0]);
    let constant = vec![frame.clone(); 20];
    let near = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-15;
    assert!(input.average(&scene, &constant).unwrap().stress_MPa.iter().zip(&frame.stress_MPa).all(near));
    for (count, variance) in [(2, 0.5), (3, 0.34375), (40, 1.0 / 15.0)] {
        let mean = input.average(&scene, &frames[..count]).unwrap();
        let squares = mean.stress_MPa.iter().zip(&frame.stress_MPa).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        let deviation = (squares / 100.0).sqrt() / frame.peak_MPa();
        // 100 draws estimate a deviation to 1/√200 = 7 %; four times that.
        assert!((deviation / (0.01 * f64::sqrt(variance)) - 1.0).abs() < 0.28, "{count}: {deviation}");
        assert!(
            (input.noise_of_mean_MPa(sliding::variance(count, 3)) / (1e-3 * f64::sqrt(variance)) - 1.0).abs() < 0.01,
            "{count}"
        );
    }
    let mut newest = frames.clone();
    newest[39].id = "newest".to_string();
    let golden = Golden::reference(&scene).unwrap();
    let model = Model::for_frames(&scene, &newest).unwrap();
    for result in [golden.run_averaged(&newest).unwrap(), model.reconstruct_averaged(&newest).unwrap()] {
        assert_eq!((result.frame.as_str(), result.extra.mean_frames), ("newest", Some(15)));
    }
    assert_eq!(golden.run_averaged(&newest[..4]).unwrap().extra.mean_frames, Some(4));
    assert!(input.average(&scene, &[]).is_err());
}

/// Median and largest error.
fn spread(mut errors: Vec<f64>) -> [f64; 2] {
    errors.sort_by(f64::total_cmp);
    [(errors[(errors.len() - 1) / 2] + errors[errors.len() / 2]) / 2.0, errors[errors.len() - 1]]
}

#[test]
fn filled_readings_beat_zeros_and_are_reported() {
    for name in ["sensor-1", "sensor-2", "eight-by-eight"] {
        let plain = scene(name);
        let mut scene = plain.clone();
        scene.input.unipolar = true;
        let (golden, zeros) = (Golden::reference(&scene).unwrap(), Golden::reference(&plain).unwrap());
        let converter = Converter { unipolar: true, ..Default::default() };
        let (mut with, mut without) = (Vec::new(), Vec::new());
        for frame in Frame::shipped(&scene) {
            let clipped = converter.convert(&frame).unwrap();
            let filled = golden.run(&clipped).unwrap();
            let report = filled.extra.unipolar.as_ref().unwrap();
            let count = clipped.stress_MPa.iter().filter(|b| **b == 0.0).count();
            assert_eq!(report.clipped, count);
            assert!(report.pulled <= count && report.misfit < 0.04, "{}: {report:?}", frame.id);
            let error = |result: &Reconstruction| result.error.unwrap();
            let normal = |result: &Reconstruction| error(result).normal.unwrap().abs();
            // No worse than with all readings.
            assert!(normal(&filled) <= normal(&zeros.run(&frame).unwrap()) + 0.002, "{}", frame.id);
            if count > 0 {
                with.extend(error(&filled).tangential);
                without.extend(error(&zeros.run(&clipped).unwrap()).tangential);
            }
        }
        let ([median, worst], [zeros_median, zeros_worst]) = (spread(with), spread(without));
        assert!(median <= 0.7 * zeros_median, "{name}: {median} {zeros_median}");
        assert!(worst <= 0.25 * zeros_worst, "{name}: {worst} {zeros_worst}");
    }
}

#[test]
fn masked_and_clipped_taxels_go_together() {
    let mut scene = scene("sensor-2");
    scene.input.unipolar = true;
    scene.partition.case = crate::spec::partition::Case::numbered(3).unwrap();
    let frame = Frame::shipped(&scene).remove(0);
    let mut clipped = Converter { unipolar: true, ..Default::default() }.convert(&frame).unwrap();
    let peak = (0..100).max_by(|a, b| frame.stress_MPa[*a].total_cmp(&frame.stress_MPa[*b])).unwrap();
    let zero = (0..100).find(|k| clipped.stress_MPa[*k] == 0.0).unwrap();
    scene.input.dead = [peak, zero].map(|k| [k / 10, k % 10]).to_vec();
    let result = run(&scene, &clipped);
    let count = clipped.stress_MPa.iter().filter(|b| **b == 0.0).count();
    assert_eq!(result.extra.unipolar.as_ref().unwrap().clipped, count - 1);
    clipped.stress_MPa[zero] = 0.5 * frame.stress_MPa[peak];
    assert_eq!(run(&scene, &clipped).forces_N, result.forces_N);
}

#[test]
fn no_stress_and_no_shear_are_no_trouble_when_clipped() {
    let mut silent = hertz();
    silent.stress_MPa.fill(0.0);
    let mut scene = scene("sensor-1");
    scene.input.unipolar = true;
    assert_eq!(run(&scene, &silent).resultant_N, [0.0; 3]);
    scene.search.mu_max = 0.0;
    let clipped = Converter { unipolar: true, ..Default::default() }.convert(&hertz()).unwrap();
    let [x, y, z] = run(&scene, &clipped).resultant_N;
    assert!(x == 0.0 && y == 0.0 && z > 0.0);
}

#[test]
fn resultants_stand_for_the_forces() {
    let mut scene = scene("sensor-2");
    scene.partition.case = crate::spec::partition::Case::numbered(1).unwrap();
    let frame = Frame::shipped(&scene).remove(0);
    let full = run(&scene, &frame);
    scene.output.forces = ForceOutput::Resultants;
    let short = run(&scene, &frame);
    assert_eq!((short.resultant_N, short.forces_N.fz.len()), (full.resultant_N, 0));
    let parts = short.extra.resultants.unwrap();
    assert_eq!(parts.len(), 4);
    for axis in 0..3 {
        let sum: f64 = parts.iter().map(|part| part.force_N[axis]).sum();
        assert!((sum - full.resultant_N[axis]).abs() < 1e-12);
    }
    assert!(parts.iter().flat_map(|part| part.centre_mm).flatten().all(|mm| mm.abs() <= 20.0));
}

/// A model reads the files of its scene when it is built: neither a changed nor a deleted one matters afterwards.
#[test]
fn files_are_read_once_and_a_frame_is_calibrated_once() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene("sensor-1");
    let frame = hertz();
    let path = folder.path().join("table.csv");
    let write = |gain: f64| {
        let lines = (0..100).map(|k| format!("{},{},0,{gain}\n", k / 10, k % 10)).collect::<String>();
        std::fs::write(&path, format!("{}\n{lines}", calibration::HEADER)).unwrap();
    };
    write(2.0);
    scene.input.calibration = Some(path.clone());
    scene.input.full_scale_MPa = Some(4.0 * frame.peak_MPa());
    let (golden, model) = (Golden::reference(&scene).unwrap(), Model::new(&scene).unwrap());
    let results = || {
        let sent = model.run(&model.readings(std::slice::from_ref(&frame)).unwrap());
        let decoded = model.decode(std::slice::from_ref(&frame), "fixed", &sent.beats, &sent.status).unwrap();
        [golden.run(&frame).unwrap(), model.reconstruct(&frame).unwrap(), decoded]
    };
    let before = results();
    write(3.0);
    assert_eq!(results(), before);
    // The file matters: a model that is built now differs.
    assert_ne!(Model::new(&scene).unwrap().reconstruct(&frame).unwrap().resultant_N, before[1].resultant_N);
    std::fs::remove_file(&path).unwrap();
    assert_eq!(results(), before);
    CALIBRATIONS.with(|count| count.set(0));
    model.reconstruct(&frame).unwrap();
    assert_eq!(CALIBRATIONS.with(Cell::get), 1);
}
