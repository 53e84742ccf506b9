//! Streams with drift, presses between, in both models.

use super::*;
use crate::data::frame::Contact;
use crate::data::generator::generate;
use crate::engine::{CheckPace, Engine, State, StreamChecks};
use crate::estimate::float::Golden;
use crate::fixed::Model;
use crate::result::flags::Flag;
use crate::result::reconstruct::Reconstruction;
use crate::spec::scene::{RunningZero, Scene, Zero};

/// L of the scenes.
const LIMIT: f64 = 0.02;
/// k of the scenes.
const AVERAGE: u32 = 5;

/// Normal forces of 6 × 5 taxels, which are linear in the stress; a running zero.
fn scene(more: &str) -> Scene {
    let text = format!(
        "[sensor]\nrows = 6\ncols = 5\npitch_x_mm = 4\npitch_y_mm = 4\nthickness_mm = 3\n[search]\nmu_max = 0\n\
         estimator = \"search\"\n[input]\nfull_scale_MPa = 1\nzero = \"running\"\nzero_average = {AVERAGE}\n\
         zero_limit_MPa = {LIMIT}\n{more}"
    );
    Scene::parse(&text, "drift.toml").unwrap()
}

fn fixed_zero(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.input.zero = Zero::Fixed;
    scene
}

fn engines(scene: &Scene) -> [Box<dyn Engine>; 2] {
    [Box::new(Golden::reference(scene).unwrap()), Box::new(Model::new(scene).unwrap())]
}

/// A press of 5 N.
fn press(scene: &Scene) -> Frame {
    let size_mm = vec![6.0];
    let contact = Contact { shape: Some("hertz-circle".into()), size_mm, normal_N: Some(5.0), ..Contact::default() };
    generate("press", &scene.sensor, scene.medium, &[contact]).unwrap()
}

fn frame(scene: &Scene, stress: impl Fn(usize) -> f64) -> Frame {
    Frame::from_stress("moment", &scene.sensor, (0..scene.sensor.taxels()).map(stress).collect()).unwrap()
}

fn run(engine: &dyn Engine, frames: &[Frame]) -> Vec<Reconstruction> {
    let mut state = State::default();
    let each = engine.scene().input.frames_per_result();
    frames.chunks(each).map(|frames| engine.reconstruct_after(&mut state, frames).unwrap()).collect()
}

fn largest(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(one, other)| (one - other).abs()).fold(0.0, f64::max)
}

/// One side warms up over 2000 frames; every 100 frames there is a press of 40. Without drift the results are those of the
/// press; with it they are off by what drifts in a press, with what is left of the one before, and in 2^k frames, over the
/// whole drift, of what they are off with a fixed zero.
#[test]
fn a_warm_side_does_not_change_the_forces() {
    let scene = scene("");
    let (press, frames) = (press(&scene), 2000);
    let drift = |moment: usize, taxel: usize| 0.9 * LIMIT * (taxel % 5) as f64 / 4.0 * moment as f64 / frames as f64;
    let moments: Vec<Frame> = (0..frames)
        .map(|moment| {
            let load = if moment % 100 >= 60 { 1.0 } else { 0.0 };
            frame(&scene, |taxel| load * press.stress_MPa[taxel] + drift(moment, taxel))
        })
        .collect();
    let constant = f64::from(1u32 << AVERAGE);
    let lag = (40.0 / (1.0 - (1.0 - 1.0 / constant).powi(60)) + constant) / frames as f64;
    for (running, fixed) in engines(&scene).into_iter().zip(engines(&fixed_zero(&scene))) {
        let wanted = run(&*fixed, std::slice::from_ref(&press)).remove(0).forces_N;
        let drifted = run(&*fixed, &moments[frames - 1..]).remove(0).forces_N;
        let results = run(&*running, &moments);
        let off = largest(&drifted.fz, &wanted.fz);
        assert!(off > 0.05 * wanted.fz.iter().fold(0.0, |most: f64, fz| most.max(*fz)), "{off}");
        for (moment, result) in results.iter().enumerate().filter(|(moment, _)| moment % 100 == 99) {
            let error = largest(&result.forces_N.fz, &wanted.fz);
            assert!(error < 1.01 * lag * off, "{moment}: {error} of {off}");
            assert!(!result.flags.contains(&Flag::ZeroLimit));
        }
        // Between the presses nothing is left but the lag.
        let [rest, rests] = [&moments[1959], &moments[1958]].map(|frame| largest(&frame.stress_MPa, &[0.0; 30]));
        let share = results[1959].checks.zero_share.unwrap();
        assert!((share * LIMIT - rest).abs() < lag * rests, "{share}");
    }
}

/// As an incremental stream, and from all frames since the reset; with blocks and missing readings too.
#[test]
fn all_frames_since_the_reset_give_the_same() {
    for more in ["", "average = 1\n", "dead = [[0, 0]]\n", "average = 2\nmean = \"sliding\"\n"] {
        let scene = scene(more);
        let press = press(&scene);
        let load = |moment: usize| if moment % 4 < 2 { 0.3 } else { 0.0 };
        let off = |moment: usize, taxel: usize| 1e-3 * (moment * taxel % 7) as f64;
        let mut moments: Vec<Frame> = (0..12)
            .map(|moment| frame(&scene, |taxel| load(moment) * press.stress_MPa[taxel] + off(moment, taxel)))
            .collect();
        // A reading is missing in one frame, another in both of a block.
        moments[3].missing = vec![7];
        moments[6..8].iter_mut().for_each(|frame| frame.missing = vec![16]);
        let (all, mut differs) = (scene.input.frames_of_results(&moments), false);
        for engine in engines(&scene) {
            let mut state = State::default();
            for frames in &all {
                let newest = scene.input.newest(frames);
                let result = engine.reconstruct_after(&mut state, newest).unwrap();
                assert_eq!(result, engine.reconstruct(frames).unwrap(), "{more}");
                differs |=
                    frames.len() > newest.len() && result.forces_N != engine.reconstruct(newest).unwrap().forces_N;
            }
        }
        assert!(differs || scene.input.slides());
        let error = engines(&scene)[0].reconstruct(&[]).unwrap_err().to_string();
        assert!(error.ends_with("got 0"), "{error}");
    }
}

/// What presses with more than the limit is never taken for drift; what creeps is, by the limit, and the flag says so.
#[test]
fn a_light_touch_is_not_lost_beyond_the_limit() {
    let scene = scene("");
    let shape = press(&scene);
    let peak = shape.stress_MPa.iter().fold(0.0f64, |most, b| most.max(*b));
    let touch = |size: f64| frame(&scene, |taxel| size / peak * shape.stress_MPa[taxel]);
    for engine in engines(&scene) {
        let light = run(&*engine, &vec![touch(1.1 * LIMIT); 600]);
        assert_eq!(light.first().map(|result| &result.forces_N), light.last().map(|result| &result.forces_N));
        let creeping: Vec<Frame> = (0..1500).map(|moment| touch(3.0 * LIMIT * f64::from(moment) / 1500.0)).collect();
        let results = run(&*engine, &creeping);
        let alone = run(&*engine, &creeping[1499..]).remove(0);
        let last = results.last().unwrap();
        assert!(last.flags.contains(&Flag::ZeroLimit) && last.checks.zero_share == Some(1.0));
        assert!(last.resultant_N[2] < 0.9 * alone.resultant_N[2]);
        // By the limit and no more, in every taxel.
        let left = engine.input().without_drift(&mut Drift::default(), &creeping).last().unwrap().stress_MPa.clone();
        let lost = largest(&left, &creeping[1499].stress_MPa);
        assert!((lost - LIMIT).abs() < 1e-12, "{lost}");
        // Flagged from where the limit takes effect, not before.
        let flagged = |result: &&Reconstruction| result.flags.contains(&Flag::ZeroLimit);
        let first = results.iter().position(|result| flagged(&result)).unwrap();
        assert!((500..700).contains(&first), "{first}");
    }
}

/// The drift runs from below the stored zero to above it within one press: the zero finds it afterwards.
#[test]
fn the_zero_finds_any_drift_within_the_limit() {
    let scene = scene("");
    let at = |size: f64, load: f64| {
        let press = press(&scene);
        frame(&scene, move |taxel| size * LIMIT + load * press.stress_MPa[taxel])
    };
    let moments: Vec<Frame> = [(-0.95, 0.0, 400), (-0.95, 1.0, 100), (0.95, 1.0, 100), (0.95, 0.0, 400)]
        .into_iter()
        .flat_map(|(size, load, count)| vec![at(size, load); count])
        .collect();
    let input = Input::new(&scene).unwrap();
    let mut drift = Drift::default();
    let all: Vec<Frame> = moments
        .iter()
        .flat_map(|frame| input.without_drift(&mut drift, std::slice::from_ref(frame)).into_owned())
        .collect();
    let [below, pressed, above] = [399, 600, 999].map(|moment: usize| largest(&all[moment].stress_MPa, &[0.0; 30]));
    assert!(below < 1e-5 && pressed > 1.8 * LIMIT && above < 1e-4, "{below} {pressed} {above}");
}

/// A missing reading neither presses nor moves a zero, and a dead taxel does neither.
#[test]
fn only_live_readings_count() {
    let scene = scene("dead = [[0, 0]]\n");
    let input = Input::new(&scene).unwrap();
    let mut drift = Drift::default();
    let mut odd = frame(&scene, |taxel| if taxel == 0 { 0.9 } else { 0.5 * LIMIT });
    odd.missing = vec![7];
    for _ in 0..400 {
        input.without_drift(&mut drift, std::slice::from_ref(&odd));
    }
    let moved = drift.moved();
    assert_eq!((moved[0], moved[7]), (0.0, 0.0));
    assert!((moved[1] - 0.5 * LIMIT).abs() < 1e-5 && moved[1] == moved[29], "{moved:?}");
    // That of the last frame, before its step.
    assert!((drift.share().unwrap() - moved[1] / LIMIT).abs() < 1e-6);
}

/// Gains of both signs: the limit is a stress at the largest gain.
#[test]
fn the_limit_is_a_stress() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("table.csv");
    let line = |taxel: usize| format!("{},{},0.5,{}\n", taxel / 5, taxel % 5, if taxel == 4 { -0.02 } else { -0.04 });
    std::fs::write(&path, format!("row,col,offset,gain\n{}", (0..30).map(line).collect::<String>())).unwrap();
    let mut scene = scene("");
    scene.input.calibration = Some(path);
    scene.input.zero = Zero::Running(RunningZero { average: 1, limit_MPa: LIMIT });
    let (input, limit) = (Input::new(&scene).unwrap(), LIMIT / 0.04);
    let read = |off: f64| {
        let mut drift = Drift::default();
        let frame = frame(&scene, |taxel| 0.5 + if taxel == 4 { off } else { 0.0 });
        (0..50).for_each(|_| drop(input.without_drift(&mut drift, std::slice::from_ref(&frame))));
        drift.moved()[4] / limit
    };
    // It falls under load.
    assert!(read(-1.01 * limit) == 0.0 && (read(-0.99 * limit) + 0.99).abs() < 1e-9 && read(5.0 * limit) == 1.0);
    let model = Model::new(&scene).unwrap();
    let running = model.prepare.running.clone().unwrap();
    assert_eq!(f64::from(running.limit), (LIMIT * f64::from((1 << 19) - 1)).ceil());
}

/// The cross-check of a stream reads frames without the drift of their zeros: a rough one would be noise to it.
#[test]
fn the_cross_check_has_the_drift_of_the_stream() {
    let mut scene = scene("");
    scene.search.mu_max = 0.3;
    let press = press(&scene);
    let drift = |taxel: usize| if taxel.is_multiple_of(2) { 0.9 * LIMIT } else { -0.9 * LIMIT };
    let engine = Golden::reference(&scene).unwrap();
    let mut checks = StreamChecks::new(&engine, CheckPace::Every(200));
    let mut noise = |load: f64| {
        let frame = frame(&scene, |taxel| load * press.stress_MPa[taxel] + drift(taxel));
        checks.next(&engine, &[frame]).unwrap().checks.noise_MPa
    };
    let first = noise(1.0).unwrap();
    for _ in 1..200 {
        noise(0.0);
    }
    let last = noise(1.0).unwrap();
    assert!(first > 0.2 * LIMIT && last < 0.02 * LIMIT, "{first} {last}");
}
