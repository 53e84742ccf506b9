//! The cross-check on drawn frames, alone and in a stream.

use super::*;
use crate::data::generator::draws::{DrawOptions, Draws};
use crate::result::flags::Flag;

/// Exact frames of a scene's sensor, and the same with a slope and with a stuck taxel.
fn frames(scene: &Scene, count: u64) -> Vec<[Frame; 3]> {
    let draws = Draws::new(scene, DrawOptions { seed: 15, ..Default::default() }).unwrap();
    let cols = scene.sensor.cols;
    let of = |number: u64| {
        let drawn = draws.frame(number).unwrap();
        let peak_MPa = drawn.peak_MPa();
        let (mut slope, mut stuck) = (drawn.frame.clone(), drawn.frame.clone());
        slope.stress_MPa.iter_mut().enumerate().for_each(|(k, b)| *b += 1e-3 * peak_MPa * (k % cols) as f64);
        stuck.stress_MPa[cols * (cols - 1)] = -0.5 * peak_MPa;
        [drawn.frame, slope, stuck]
    };
    (0..count).map(of).collect()
}

/// The search takes every reading as it is: its results say what `evidence` finds in them. Both models, alone and as the first
/// result of a stream.
#[test]
fn search_is_warned_of_baseline_and_stuck_taxel() {
    let mut scene = Scene::builtin("sensor-1").unwrap();
    scene.hardware.estimator = Some(EstimatorKind::Search);
    let golden: Box<dyn Engine> = Box::new(Golden::with(&scene, EstimatorKind::Search).unwrap());
    for engine in [golden, Box::new(Model::new(&scene).unwrap())] {
        let checked = CheckedEngine::new(engine);
        for [exact, slope, stuck] in frames(&scene, 5) {
            for (frame, disturbed) in [(exact, false), (slope, true), (stuck, true)] {
                let frames = [frame];
                let alone = checked.result(&frames, false).unwrap();
                assert!(!alone.flags.contains(&Flag::ShearUnreliable));
                let single = checked.result(&frames, true).unwrap();
                assert_eq!(single.flags.contains(&Flag::ShearUnreliable), disturbed, "{:?}", single.checks);
                let (mut streamed, mut checks) =
                    (alone.clone(), StreamChecks::new(checked.engine(), CheckPace::Every(1)));
                checks.add(&frames, alone.resultant_N, &mut streamed.diagnostics());
                assert_eq!((streamed.flags, streamed.extra.suspects), (single.flags, single.extra.suspects));
            }
        }
    }
}

/// Zeros that have moved, all alike, by a share of the peak: a press keeps its normal force, or a flag says that the fit failed. It is
/// never an array without contact.
#[test]
fn a_press_over_zeros_that_moved_is_not_lost() {
    let text = "[sensor]\nrows = 6\ncols = 6\npitch_x_mm = 4\npitch_y_mm = 4\nthickness_mm = 2\n\
                [input]\nfull_scale_MPa = 2\n[search]\nnoise_floor_MPa = NOISE\n";
    let bare = Scene::parse(&text.replace("NOISE", "0"), "pad.toml").unwrap();
    let draws = Draws::new(&bare, DrawOptions { seed: 5, ..Default::default() }).unwrap();
    let failed = [Flag::Misfit, Flag::LoadMismatch, Flag::MuAtBound, Flag::EstimatesDiffer, Flag::ShearUnreliable];
    for number in 0..6 {
        let drawn = draws.frame(number).unwrap();
        let (peak_MPa, true_N) = (drawn.peak_MPa(), drawn.total_N[2]);
        let noise = format!("{:e}", 5e-4 * peak_MPa);
        let scene = Scene::parse(&text.replace("NOISE", &noise), "pad.toml").unwrap();
        let golden: Box<dyn Engine> = Box::new(Golden::new(&scene).unwrap());
        let engines = [golden, Box::new(Model::new(&scene).unwrap())].map(CheckedEngine::new);
        for share in [-0.03, -0.01, -0.005, 0.02] {
            let stress_MPa = drawn.frame.stress_MPa.iter().map(|b| b + share * peak_MPa).collect();
            let moved = Frame::from_stress("moved", &scene.sensor, stress_MPa).unwrap();
            for (k, checked) in engines.iter().enumerate() {
                let result = checked.result(std::slice::from_ref(&moved), true).unwrap();
                let normal_N = result.resultant_N[2];
                let is_near = (normal_N / true_N - 1.0).abs() < 0.15;
                let is_flagged = failed.iter().any(|flag| result.flags.contains(flag));
                let what =
                    format!("frame {number}, engine {k}, {share}: {normal_N} N of {true_N} N, {:?}", result.flags);
                assert!(
                    normal_N > 0.0 && !result.flags.contains(&Flag::NoContact) && (is_near || is_flagged),
                    "{what}"
                );
            }
        }
    }
}

/// A force that is not that of the readings: the seeded fault is one of the result, not of the readings.
#[test]
fn another_force_than_that_of_evidence_is_flagged() {
    let scene = Scene::builtin("eight-by-eight").unwrap();
    let engine = Golden::with(&scene, EstimatorKind::Search).unwrap();
    let check = CrossCheck::of(&engine).unwrap();
    for [frame, ..] in frames(&scene, 5) {
        let frames = [frame];
        let differs = |factor: [f64; 3]| {
            let mut result = engine.reconstruct(&frames).unwrap();
            let changed = std::array::from_fn(|axis| factor[axis] * result.resultant_N[axis]);
            check.check(&frames, changed, &mut result.diagnostics());
            result.flags.contains(&Flag::EstimatesDiffer)
        };
        let all = [[1.0; 3], [1.5, 1.5, 1.0], [-1.0, -1.0, 1.0], [1.0, 1.0, 1.3], [0.0, 0.0, 1.0], [0.0; 3]];
        assert_eq!(all.map(differs), [false, true, true, true, true, true]);
    }
}

/// What has evidence needs no cross-check, nor what `evidence` refuses.
#[test]
fn engines_with_evidence_have_no_cross_check() {
    let mut scene = Scene::builtin("eight-by-eight").unwrap();
    assert!(CrossCheck::of(&Golden::new(&scene).unwrap()).is_none());
    scene.search.mu_max = 0.0;
    assert!(CrossCheck::of(&Golden::with(&scene, EstimatorKind::Search).unwrap()).is_none());
}

/// A stream of a search, and its frames without and with a stuck taxel.
fn stream() -> (Golden, [Frame; 2]) {
    let scene = Scene::builtin("eight-by-eight").unwrap();
    let [exact, _, stuck] = frames(&scene, 1).remove(0);
    (Golden::with(&scene, EstimatorKind::Search).unwrap(), [exact, stuck])
}

/// Age of the finding in the next result, of this frame, and whether it names a suspect taxel.
fn next(checks: &mut StreamChecks, engine: &Golden, frame: &Frame) -> (Option<u64>, bool) {
    let result = checks.next(engine, std::slice::from_ref(frame)).unwrap();
    (result.checks.cross_check_age, result.flags.contains(&Flag::TaxelSuspect))
}

/// Of five results only the third has a stuck taxel.
#[test]
fn findings_of_a_stream_have_their_age() {
    let (engine, [exact, stuck]) = stream();
    let ages = |pace: CheckPace| -> Vec<(Option<u64>, bool)> {
        let mut checks = StreamChecks::new(&engine, pace);
        (0..5).map(|number| next(&mut checks, &engine, if number == 2 { &stuck } else { &exact })).collect()
    };
    let some = |all: [u64; 5], flagged: [bool; 5]| std::iter::zip(all.map(Some), flagged).collect::<Vec<_>>();
    assert_eq!(ages(CheckPace::Every(1)), some([0; 5], [false, false, true, false, false]));
    assert_eq!(ages(CheckPace::Every(2)), some([0, 1, 0, 1, 0], [false, false, true, true, false]));
    assert_eq!(ages(CheckPace::Every(0)), vec![(None, false); 5]);
    assert_eq!(ages(CheckPace::Never), vec![(None, false); 5]);
}

/// The thread beside a stream is not waited for: its finding comes with a later result.
#[test]
fn findings_beside_a_stream_come_with_later_results() {
    const TRIES: usize = 600;
    let (engine, [_, stuck]) = stream();
    let mut checks = StreamChecks::new(&engine, CheckPace::Beside);
    assert_eq!(next(&mut checks, &engine, &stuck), (None, false));
    let found = (0..TRIES).find_map(|_| {
        std::thread::sleep(std::time::Duration::from_millis(50));
        let (age, flagged) = next(&mut checks, &engine, &stuck);
        flagged.then_some(age)
    });
    assert!(found.flatten() >= Some(1), "{found:?}");
}

/// A taxel that stood still before the estimator changed is found after it; the cross-check is that of the new engine.
#[test]
fn another_estimator_goes_on_with_the_same_stream() {
    let (search, [exact, stuck]) = stream();
    let evidence = Golden::with(search.scene(), EstimatorKind::Evidence).unwrap();
    let peak = (0..64).max_by(|a, b| exact.stress_MPa[*a].total_cmp(&exact.stress_MPa[*b])).unwrap();
    let grown = |moment: usize| {
        let mut frame = exact.clone();
        frame.stress_MPa.iter_mut().for_each(|b| *b *= moment as f64);
        frame.stress_MPa[peak] = exact.stress_MPa[peak];
        frame
    };
    let constant = |changes: bool| {
        let mut checks = StreamChecks::new(&evidence, CheckPace::Every(1));
        let mut flagged = Vec::new();
        for moment in 1..=10 {
            if changes && moment == 6 {
                checks.change(&search);
            }
            let engine = if changes && moment >= 6 { &search } else { &evidence };
            let result = checks.next(engine, &[grown(moment)]).unwrap();
            assert_eq!(result.checks.cross_check_age, (changes && moment >= 6).then_some(0));
            flagged.push(result.flags.contains(&Flag::TaxelConstant));
        }
        flagged
    };
    assert_eq!(constant(true), constant(false));
    assert_eq!(constant(true).iter().filter(|flagged| **flagged).count(), 3);
    // Findings of the engine before are no longer given.
    let mut checks = StreamChecks::new(&search, CheckPace::Every(100));
    assert_eq!(next(&mut checks, &search, &stuck), (Some(0), true));
    checks.change(&search);
    assert_eq!(next(&mut checks, &search, &exact), (None, false));
}
