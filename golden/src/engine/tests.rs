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

/// The ages and flags of results 0 to 4 where only result 2 has a stuck taxel.
fn ages(pace: CheckPace, wait: &dyn Fn()) -> Vec<(Option<u64>, bool)> {
    let scene = Scene::builtin("eight-by-eight").unwrap();
    let engine = Golden::with(&scene, EstimatorKind::Search).unwrap();
    let mut checks = StreamChecks::new(&engine, pace);
    let [exact, _, stuck] = frames(&scene, 1).remove(0);
    let result = |number: usize| {
        let frames = [if number == 2 { stuck.clone() } else { exact.clone() }];
        let mut result = engine.reconstruct(&frames).unwrap();
        checks.add(&frames, result.resultant_N, &mut result.diagnostics());
        wait();
        (result.checks.cross_check_age, result.flags.contains(&Flag::TaxelSuspect))
    };
    (0..5).map(result).collect()
}

#[test]
fn findings_of_a_stream_have_their_age() {
    let some = |all: [u64; 5], flagged: [bool; 5]| std::iter::zip(all.map(Some), flagged).collect::<Vec<_>>();
    let nothing = || ();
    assert_eq!(ages(CheckPace::Every(1), &nothing), some([0; 5], [false, false, true, false, false]));
    assert_eq!(ages(CheckPace::Every(2), &nothing), some([0, 1, 0, 1, 0], [false, false, true, true, false]));
    assert_eq!(ages(CheckPace::Every(0), &nothing), vec![(None, false); 5]);
    assert_eq!(ages(CheckPace::Never, &nothing), vec![(None, false); 5]);
    // The thread beside has more time for each result than a fit takes, but for the first there is none yet.
    let second = || std::thread::sleep(std::time::Duration::from_secs(1));
    let beside = ages(CheckPace::Beside, &second);
    assert!(beside[0] == (None, false) && beside[4].0 >= Some(1), "{beside:?}");
    assert!(beside.iter().any(|(_, flagged)| *flagged), "{beside:?}");
}
