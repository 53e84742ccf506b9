//! Presses with an adaptive mean: errors, windows, and when the template holds.

use super::*;
use crate::data::generator::converter::Converter;
use crate::data::generator::draws::DrawOptions;
use crate::data::generator::presses::{Motion, Press};
use crate::result::errors::Errors;
use crate::spec::scene::{EstimatorKind, MeanKind, Scene};
use std::ops::Range;

const FRAMES: usize = 360;
/// The longest mean has settled.
const SETTLED: usize = 160;

fn adaptive(name: &str) -> Scene {
    let mut scene = Scene::builtin(name).unwrap();
    scene.input.mean = MeanKind::Adaptive;
    scene
}

fn press(scene: &Scene, motion: Motion, converter: Converter) -> Vec<Frame> {
    presses(scene, motion, converter, 3..4).remove(0)
}

/// The presses of these numbers.
fn presses(scene: &Scene, motion: Motion, converter: Converter, numbers: Range<u64>) -> Vec<Vec<Frame>> {
    let draw = DrawOptions { ratio: [0.4, 0.4], converter, ..DrawOptions::default() };
    let press = Press { frames: FRAMES, draw, ..Press::new(motion) };
    numbers.map(|number| press.frames(scene, number).unwrap()).collect()
}

/// Noise of 1 % of the peak, gains that differ by 1 %, codes of 10 bits.
fn noisy() -> Converter {
    Converter { noise: 0.01, gain_spread: 0.01, bits: Some(10), ..Converter::default() }
}

/// Results frame by frame.
fn results(golden: &Golden, frames: &[Frame]) -> Vec<Reconstruction> {
    let mut past = Past::default();
    frames.iter().map(|frame| golden.run_after(&mut past, std::slice::from_ref(frame)).unwrap()).collect()
}

/// Median e_t from frame `from` on, and share of frames there in which the template held.
fn figures(frames: &[Frame], results: &[Reconstruction], from: usize) -> [f64; 2] {
    let error = |k: usize| Errors::new(frames[k].resultant_N.unwrap(), results[k].resultant_N).tangential;
    let mut errors: Vec<f64> = (from..frames.len()).filter_map(error).collect();
    errors.sort_by(f64::total_cmp);
    let held = (from..frames.len()).filter(|k| results[*k].extra.template.is_some_and(|own| own.held)).count();
    [errors[errors.len() / 2], held as f64 / (frames.len() - from) as f64]
}

/// A contact that holds has the noise of the longest mean; one whose shear turns is followed without that mean's lag; one that moves is
/// not taken for a shear.
#[test]
fn the_pressure_of_a_contact_that_stays_is_remembered() {
    let scene = adaptive("sensor-1-noisy");
    let golden = Golden::with(&scene, EstimatorKind::Network).unwrap();
    let mut single = scene.clone();
    single.input.mean = MeanKind::Block;
    let single = Golden::with(&single, EstimatorKind::Network).unwrap();
    let mut long = scene.clone();
    (long.input.mean, long.input.average) = (MeanKind::Sliding, 6);
    let long = Golden::with(&long, EstimatorKind::Network).unwrap();
    for (motion, most, held) in [
        (Motion::Hold, 0.08, 0.95..=1.0),
        (Motion::Turn, 0.12, 0.3..=1.0),
        (Motion::Oscillation, 0.14, 0.3..=1.0),
        (Motion::Slide, 0.2, 0.0..=0.1),
    ] {
        let frames = press(&scene, motion, noisy());
        let found = results(&golden, &frames);
        let [error, share] = figures(&frames, &found, SETTLED);
        assert!(error < most && held.contains(&share), "{motion:?}: e_t {error}, held {share}");
        let [alone, _] = figures(&frames, &results(&single, &frames), SETTLED);
        assert!(error < 0.6 * alone, "{motion:?}: {error}, single frames {alone}");
        if matches!(motion, Motion::Turn | Motion::Oscillation) {
            let [behind, _] = figures(&frames, &results(&long, &frames), SETTLED);
            assert!(error < 0.5 * behind, "{motion:?}: {error}, the longest mean {behind}");
        }
        for (k, result) in found.iter().enumerate().skip(SETTLED) {
            let (lag, mean) = (result.extra.lag_frames.unwrap(), result.extra.mean_frames.unwrap());
            let held = result.extra.template.unwrap().held;
            assert!((0.0..64.0).contains(&lag) && (1..=127).contains(&mean) && (!held || mean > 100), "{motion:?} {k}");
        }
    }
}

/// Of contacts that slide or roll the shear has less of the noise than in the window alone; one whose load grows is followed.
#[test]
fn the_ratio_of_a_contact_that_moves_is_that_of_many_frames() {
    let scene = adaptive("sensor-1-noisy");
    let golden = Golden::with(&scene, EstimatorKind::Network).unwrap();
    let mut windows = scene.clone();
    windows.input.template = false;
    let windows = Golden::with(&windows, EstimatorKind::Network).unwrap();
    for (motion, most) in [(Motion::Slide, 0.85), (Motion::Roll, 0.85), (Motion::Ramp, 1.1)] {
        let presses = presses(&scene, motion, noisy(), 1..5);
        let error = |golden: &Golden| -> f64 {
            presses.iter().map(|frames| figures(frames, &results(golden, frames), SETTLED)[0]).sum()
        };
        let (own, alone) = (error(&golden), error(&windows));
        assert!(own < most * alone, "{motion:?}: e_t {}, windows alone {}", own / 4.0, alone / 4.0);
    }
}

/// The template ends with the frame in which another contact takes the place of the first, and the old pressure is not mixed in.
#[test]
fn a_contact_that_jumps_ends_the_template_at_once() {
    let scene = adaptive("sensor-1-noisy");
    let golden = Golden::with(&scene, EstimatorKind::Network).unwrap();
    let frames = press(&scene, Motion::Jump, noisy());
    let found = results(&golden, &frames);
    let half = FRAMES / 2;
    let held = |k: usize| found[k].extra.template.unwrap().held;
    assert!(held(half - 1) && (half..half + 8).all(|k| !held(k)));
    let normal = |k: usize| Errors::new(frames[k].resultant_N.unwrap(), found[k].resultant_N).normal.unwrap().abs();
    assert!((half + 24..FRAMES).all(|k| normal(k) < 0.1), "{:?}", (half..half + 40).map(normal).collect::<Vec<_>>());
}

/// All frames at once give the result of the last one in order; with a running zero, a calibration and missing readings too.
#[test]
fn frames_in_order_and_all_at_once_are_the_same() {
    for estimator in [EstimatorKind::Network, EstimatorKind::Evidence] {
        let scene = adaptive("sensor-1-noisy");
        let golden = Golden::with(&scene, estimator).unwrap();
        let mut frames = press(&scene, Motion::Turn, noisy());
        frames.truncate(40);
        frames[7].missing = vec![44];
        let found = results(&golden, &frames);
        for count in [1, 2, 3, 8, 40] {
            assert_eq!(golden.run_averaged(&frames[..count]).unwrap(), found[count - 1], "{estimator:?} {count}");
        }
        assert!(golden.run_averaged(&[]).unwrap_err().to_string().ends_with("got 0"));
    }
}

/// Every kind of array and cover for which a template is made, of one contact and of two.
#[test]
fn other_covers_contacts_and_faulty_taxels_have_templates_too() {
    let plain = adaptive("eight-by-eight");
    let mut dead = plain.clone();
    dead.input.dead = vec![[3, 4], [0, 0]];
    let mut unipolar = plain.clone();
    unipolar.input.unipolar = true;
    let converter = |scene: &Scene| Converter { noise: 2e-3, unipolar: scene.input.unipolar, ..Converter::default() };
    // With little noise the error of the remembered pressure ends the template of a shear that changes fast.
    for (name, scene, motion) in [
        ("plain", plain.clone(), Motion::Hold),
        ("dead", dead, Motion::Hold),
        ("unipolar", unipolar, Motion::Hold),
        ("bonded", adaptive("eight-by-eight-bonded"), Motion::Hold),
        ("second", plain, Motion::Second),
    ] {
        let golden = Golden::with(&scene, EstimatorKind::Evidence).unwrap();
        let mut frames = press(&scene, motion, converter(&scene));
        // Every fourth frame lacks a reading.
        for frame in frames.iter_mut().step_by(4) {
            frame.missing = vec![27];
        }
        // From a frame on at which the template can hold again.
        let found = results(&golden, &frames);
        let [error, held] = figures(&frames, &found, FRAMES - 80);
        // Without tension one fit is worse, whatever the mean.
        let most = if scene.input.unipolar { 0.2 } else { 0.15 };
        assert!(error < most && held > 0.9, "{name}: e_t {error}, held {held}");
        let contacts = found[FRAMES - 1].contacts().unwrap();
        assert_eq!(contacts.len(), if motion == Motion::Second { 2 } else { 1 }, "{name}");
        // The forces of contacts and of taxels have the same sum.
        let sum: Vec<f64> = (0..3).map(|axis| contacts.iter().map(|own| own.force_N[axis]).sum()).collect();
        let off = |axis: usize| (sum[axis] - found[FRAMES - 1].resultant_N[axis]).abs();
        assert!((0..3).all(|axis| off(axis) < 0.02 * sum[2]), "{name}: {sum:?}");
    }
}
