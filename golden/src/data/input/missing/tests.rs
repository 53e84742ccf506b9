//! What is taken for missing readings, on drawn presses; the results of both engines, and the same in means, calibrated frames and
//! streams.

use super::*;
use crate::data::generator::draws::{DrawOptions, DrawnFrame, Draws};
use crate::data::input::memory::Memory;
use crate::data::input::{calibration, Input};
use crate::engine::Engine;
use crate::estimate::float::Golden;
use crate::fixed::Model;
use crate::random::Random;
use crate::result::checks::NOT_RESOLVED;
use crate::result::flags::Flag;
use crate::result::reconstruct::Reconstruction;
use crate::spec::scene::{MeanKind, Scene};

fn scene() -> Scene {
    Scene::builtin("eight-by-eight").unwrap()
}

/// A press on eight-by-eight, without noise.
fn press(number: u64) -> (DrawnFrame, Frame) {
    let drawn = Draws::new(&scene(), DrawOptions::default()).unwrap().frame(number).unwrap();
    let exact =
        Frame { stress_MPa: drawn.exact_MPa.clone(), resultant_N: None, cell_forces_N: None, ..drawn.frame.clone() };
    (drawn, exact)
}

/// The frame without the readings of some taxels, as a sensor gives it.
fn without(frame: &Frame, missing: &[usize]) -> Frame {
    let mut stress = frame.stress_MPa.clone();
    missing.iter().for_each(|&taxel| stress[taxel] = f64::NAN);
    Frame::from_stress(&frame.id, &frame.sensor, stress).unwrap()
}

fn peak(frame: &Frame) -> usize {
    (0..frame.stress_MPa.len()).max_by(|a, b| frame.stress_MPa[*a].total_cmp(&frame.stress_MPa[*b])).unwrap()
}

/// Difference of the shear and of the normal force, over the normal force.
fn differences(one: &Reconstruction, other: &Reconstruction) -> [f64; 2] {
    let off = |axis: usize| (one.resultant_N[axis] - other.resultant_N[axis]) / other.resultant_N[2];
    [off(0).hypot(off(1)), off(2).abs()]
}

/// The flags that say that a force, or its shear, is not to be trusted.
fn doubted(result: &Reconstruction) -> bool {
    [Flag::LoadMismatch, Flag::ShearNotResolved, Flag::EstimateFailed, Flag::Misfit]
        .iter()
        .any(|flag| result.flags.contains(flag))
}

/// Root sum square of the errors of `predicted`, over the peak.
fn off(exact: &Frame, predicted: &Frame) -> f64 {
    let squares = std::iter::zip(&exact.stress_MPa, &predicted.stress_MPa).map(|(a, b)| (a - b).powi(2));
    squares.sum::<f64>().sqrt() / exact.peak_MPa()
}

/// The mean of the four taxels around each missing one, until it stands still.
fn harmonic(frame: &Frame) -> Frame {
    let (mut filled, rows, cols) = (frame.clone(), frame.sensor.rows, frame.sensor.cols);
    for _ in 0..500 {
        for &taxel in &frame.missing {
            let (row, col) = (taxel / cols, taxel % cols);
            let around = [
                (row > 0).then(|| taxel - cols),
                (row + 1 < rows).then(|| taxel + cols),
                (col > 0).then(|| taxel - 1),
                (col + 1 < cols).then(|| taxel + 1),
            ];
            let around: Vec<f64> = around.into_iter().flatten().map(|k| filled.stress_MPa[k]).collect();
            filled.stress_MPa[taxel] = around.iter().sum::<f64>() / around.len() as f64;
        }
    }
    filled
}

#[test]
fn drawn_presses_are_predicted_better_than_by_the_mean_of_neighbours() {
    let (mut own, mut others) = (0.0, 0.0);
    for name in ["sensor-1", "sensor-2", "eight-by-eight"] {
        let scene = Scene::builtin(name).unwrap();
        let draws = Draws::new(&scene, DrawOptions::default()).unwrap();
        for number in 0..12 {
            let drawn = draws.frame(number).unwrap();
            let exact = Frame { stress_MPa: drawn.exact_MPa.clone(), ..drawn.frame.clone() };
            let peak = (0..exact.stress_MPa.len())
                .max_by(|a, b| exact.stress_MPa[*a].total_cmp(&exact.stress_MPa[*b]))
                .unwrap();
            let mut missing = vec![peak, peak + 1 - 2 * (number as usize % 2), (number as usize * 13 + 5) % 60];
            missing.sort_unstable();
            missing.dedup();
            let mut lacking = Frame { missing, ..exact.clone() };
            lacking.missing.iter().for_each(|&taxel| lacking.stress_MPa[taxel] = 0.0);
            let filled = complete(&scene.input, lacking.clone());
            // The other taxels stay as they are.
            assert!((0..60).all(|k| lacking.missing.contains(&k) || filled.stress_MPa[k] == exact.stress_MPa[k]));
            own += off(&exact, &filled);
            others += off(&exact, &harmonic(&lacking));
        }
    }
    assert!(own < 0.6 * others, "{own} {others}");
}

/// An even stress is predicted, and a cluster leaves more open than one taxel; dead taxels and other missing ones have no say.
#[test]
fn only_live_readings_have_a_say() {
    let mut scene = Scene::builtin("eight-by-eight").unwrap();
    scene.input.dead = vec![[3, 3]];
    let frame = |missing: Vec<usize>| {
        let mut stress = vec![0.5; 64];
        stress[27] = 99.0;
        missing.iter().for_each(|&taxel| stress[taxel] = -99.0);
        Frame { missing, ..Frame::from_stress("even", &scene.sensor, stress).unwrap() }
    };
    let (one, cluster) = (frame(vec![28]), frame(vec![18, 19, 20, 26, 28, 34, 35, 36]));
    for frame in [&one, &cluster] {
        let filled = complete(&scene.input, frame.clone());
        assert!(frame.missing.iter().all(|&taxel| (filled.stress_MPa[taxel] - 0.5).abs() < 0.04), "{filled:?}");
    }
    let open = |frame: &Frame| open_share(&scene.input, &complete(&scene.input, frame.clone())).unwrap();
    assert!(open(&cluster) > 8.0 * open(&one) && open_share(&scene.input, &frame(Vec::new())).is_none());
}

/// Row and column of the missing taxels of a result.
fn named(result: &Reconstruction) -> Vec<usize> {
    result.extra.missing.iter().map(|own| own.row * 8 + own.col).collect()
}

/// The peak and up to two other taxels missing, on a pitch wider than the cover: both engines name them and give the forces of the
/// whole frame, within a bound each. With zeros in place of
/// the readings, as a seeded fault, they do not.
#[test]
fn single_missing_readings_hardly_change_the_forces_of_both_engines() {
    let scene = scene();
    let engines: [(Box<dyn Engine>, [f64; 2]); 2] =
        [(Box::new(Golden::new(&scene).unwrap()), [0.01, 0.02]), (Box::new(Model::new(&scene).unwrap()), [0.03, 0.11])];
    for (engine, bound) in engines {
        let (mut worst, mut with_zeros) = ([0.0f64; 2], 0);
        for number in 0..8 {
            let (_, exact) = press(number);
            let mut random = Random::new(number);
            let mut missing: Vec<usize> =
                (0..number as usize % 3).map(|_| random.between(0.0, 64.0) as usize).collect();
            missing.push(peak(&exact));
            missing.sort_unstable();
            missing.dedup();
            let run = |frame: &Frame| engine.reconstruct(std::slice::from_ref(frame)).unwrap();
            let (whole, lacking) = (run(&exact), run(&without(&exact, &missing)));
            assert!(!whole.flags.contains(&Flag::TaxelMissing) && whole.extra.missing.is_empty());
            assert!(lacking.flags.contains(&Flag::TaxelMissing) && named(&lacking) == missing, "{:?}", lacking.flags);
            assert_eq!(lacking.checks.missing_share, Some(missing.len() as f64 / 64.0));
            let off = differences(&lacking, &whole);
            (0..2).for_each(|k| worst[k] = worst[k].max(off[k]));
            let mut zeros = exact.clone();
            missing.iter().for_each(|&taxel| zeros.stress_MPa[taxel] = 0.0);
            let off = differences(&run(&zeros), &whole);
            with_zeros += usize::from(off[0] > bound[0] || off[1] > bound[1]);
        }
        assert!(worst[0] < bound[0] && worst[1] < bound[1], "{worst:?}");
        // Of a zero beside loaded taxels the evidence finds three of four by itself, as stuck.
        let least = if engine.estimator().has_evidence() { 2 } else { 6 };
        assert!(with_zeros >= least, "{with_zeros}");
    }
}

/// Clusters at the peak: where the force is off by more than a fifth, a flag says so; the golden model stays right.
#[test]
fn large_clusters_are_doubted_where_the_force_is_wrong() {
    let scene = scene();
    let (golden, fixed) = (Golden::new(&scene).unwrap(), Model::new(&scene).unwrap());
    let (mut right, mut wrong, mut silent) = (0, 0, 0);
    for number in 0..8 {
        let (drawn, exact) = press(number);
        let (row, col) = ((peak(&exact) / 8).clamp(1, 6), (peak(&exact) % 8).clamp(1, 6));
        let missing: Vec<usize> = (0..9).map(|k| (row - 1 + k / 3) * 8 + col - 1 + k % 3).collect();
        let lacking = without(&exact, &missing);
        for engine in [&golden as &dyn Engine, &fixed] {
            let found = engine.reconstruct(std::slice::from_ref(&lacking)).unwrap();
            let off = (found.resultant_N[2] / drawn.total_N[2] - 1.0).abs();
            (wrong, silent) = (wrong + usize::from(off > 0.2), silent + usize::from(off > 0.2 && !doubted(&found)));
            right += usize::from(found.engine == "golden" && off < 0.05);
        }
    }
    assert!(right >= 6 && wrong >= 3 && silent == 0, "{right} {wrong} {silent}");
}

/// Readings in counts, each taxel with its own zero and gain: the same forces as of the stress, missing taxels too.
#[test]
fn missing_readings_are_predicted_as_stress() {
    let (mut scene, folder) = (scene(), tempfile::tempdir().unwrap());
    let (zero, gain) = (|k: usize| 600.0 + 37.0 * (k % 5) as f64, |k: usize| 4e-4 * (1.0 + 0.1 * (k % 7) as f64));
    let (_, exact) = press(1);
    scene.input.full_scale_MPa = Some(2.0 * exact.peak_MPa());
    let missing = [peak(&exact), 3];
    let plain = Model::new(&scene).unwrap().reconstruct(&without(&exact, &missing)).unwrap();
    let line = |k: usize| format!("{},{},{},{}\n", k / 8, k % 8, zero(k), gain(k));
    let path = folder.path().join("table.csv");
    std::fs::write(&path, format!("{}\n{}", calibration::HEADER, (0..64).map(line).collect::<String>())).unwrap();
    scene.input.calibration = Some(path);
    scene.input.full_scale_MPa = None;
    let mut counts = exact.clone();
    (0..64).for_each(|k| counts.stress_MPa[k] = exact.stress_MPa[k] / gain(k) + zero(k));
    let counts = without(&counts, &missing);
    let model = Model::for_frames(&scene, std::slice::from_ref(&counts)).unwrap();
    let found = model.reconstruct(&counts).unwrap();
    // The zeros are most of a code's range.
    assert!(differences(&found, &plain)[1] < 5e-3, "{:?} {:?}", found.resultant_N, plain.resultant_N);
    let taken = |result: &Reconstruction| result.extra.missing.iter().map(|own| own.stress_MPa).collect::<Vec<_>>();
    let off = std::iter::zip(taken(&found), taken(&plain)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off < 1e-9 * exact.peak_MPa() && taken(&found).len() == 2, "{off}");
}

/// A block takes the mean of the frames that have a reading, a sliding mean goes on without it; both models alike.
#[test]
fn means_take_the_frames_that_have_a_reading() {
    let mut scene = scene();
    let (_, exact) = press(2);
    let top = peak(&exact);
    let times = |load: f64| Frame { stress_MPa: exact.stress_MPa.iter().map(|b| load * b).collect(), ..exact.clone() };
    let frames = [times(0.8), without(&times(1.0), &[top]), without(&times(1.0), &[top, 5]), times(1.2)];
    (scene.input.average, scene.input.full_scale_MPa) = (2, Some(2.0 * exact.peak_MPa()));
    let input = Input::new(&scene).unwrap();
    let mean = input.average(&scene, &frames).unwrap();
    assert!((mean.stress_MPa[top] - exact.stress_MPa[top]).abs() < 1e-12 && mean.missing.is_empty());
    assert!((mean.stress_MPa[5] - exact.stress_MPa[5]).abs() < 1e-12);
    let all = [&Golden::new(&scene).unwrap() as &dyn Engine, &Model::new(&scene).unwrap()];
    for engine in all {
        let found = engine.reconstruct(&frames).unwrap();
        let counts: Vec<usize> = found.extra.missing.iter().map(|own| own.frames).collect();
        assert!(found.flags.contains(&Flag::TaxelMissing) && counts.len() == 2, "{:?}", found.extra.missing);
        assert!(counts.contains(&2) && counts.contains(&1) && found.checks.missing_load.is_none());
        let whole = engine.reconstruct(&[0.8, 1.0, 1.0, 1.2].map(times)).unwrap();
        assert!(differences(&found, &whole)[1] < 1e-3);
    }
    // Missing in every frame.
    let never = [0.8, 1.0, 1.0, 1.2].map(|load| without(&times(load), &[top]));
    assert_eq!(input.average(&scene, &never).unwrap().missing, [top]);
    scene.input.mean = MeanKind::Sliding;
    let input = Input::new(&scene).unwrap();
    let moments = [without(&times(1.0), &[top]), times(0.5), without(&times(1.0), &[top])];
    let filled = input.complete_after(&Memory::default(), &moments);
    // What the others predict before there is a reading; then the mean of both.
    let values: Vec<f64> = filled.iter().map(|frame| frame.stress_MPa[top] / exact.stress_MPa[top]).collect();
    assert!((values[0] - 1.0).abs() < 0.2 && values[1] == 0.5, "{values:?}");
    assert!((values[2] - (values[0] + 0.5) / 2.0).abs() < 1e-12, "{values:?}");
    assert_eq!(input.average(&scene, &moments[..1]).unwrap().missing, [top]);
    assert!(input.average(&scene, &moments[..2]).unwrap().missing.is_empty());
}

#[test]
fn more_than_the_scenes_share_is_refused_and_dead_taxels_do_not_count() {
    let mut scene = scene();
    let (_, exact) = press(0);
    let lacking = without(&exact, &(0..13).collect::<Vec<_>>());
    let refused = |scene: &Scene| lacking.check(scene).err().map(|error| error.to_string());
    let wanted = format!("{}: 13 of 64 readings are missing, wanted at most 12 (input.missing_share = 0.2)", exact.id);
    assert_eq!(refused(&scene), Some(wanted.clone()));
    assert!(Golden::new(&scene).unwrap().run(&lacking).is_err_and(|error| error.to_string() == wanted));
    assert!(Model::new(&scene).unwrap().reconstruct(&lacking).is_err_and(|error| error.to_string() == wanted));
    scene.input.dead = vec![[0, 0], [0, 1]];
    assert_eq!(refused(&scene), None);
    scene.input = InputSpec { missing_share: 0.21, ..InputSpec::default() };
    assert_eq!(refused(&scene), None);
    scene.input.missing_share = 0.0;
    assert!(without(&exact, &[9]).check(&scene).is_err() && exact.check(&scene).is_ok());
}

/// The flag of the shear follows from the share of the load that is open.
#[test]
fn what_predicted_stress_leaves_open_is_in_the_figures() {
    let scene = scene();
    let (_, exact) = press(4);
    let found = Model::new(&scene).unwrap().reconstruct(&without(&exact, &[peak(&exact)])).unwrap();
    let open = found.checks.missing_load.unwrap() / 2.0;
    let doubted = found.checks.missing_shear.unwrap() > NOT_RESOLVED;
    assert!(open > 1e-4 && open < 0.05 && doubted == found.flags.contains(&Flag::ShearNotResolved), "{open}");
}
