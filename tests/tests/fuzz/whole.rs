//! The whole path: a random scene and its random frames through both models.

use std::time::{Duration, Instant};

use dermis_golden::data::frame::Frame;
use dermis_golden::estimate::float::Golden;
use dermis_golden::fixed::Model;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::scene::Scene;
use fastrand::Rng;

use super::draw::{drawn_scene, drawn_stress};
use super::run::Outcome;

/// Number of frames of one scene, which share its matrices.
pub const FRAMES: usize = 10;
/// Time limits for the matrices of a scene and for one frame.
const LONGEST: Duration = Duration::from_secs(20);

/// The floating-point and the bit-true model of a scene, each if it accepts the scene.
type Engines = (Scene, Option<Golden>, Option<Model>);

/// The random scene of a seed, and its frames.
pub fn drawn(seed: u64) -> Outcome {
    let (mut random, start) = (Rng::with_seed(seed), Instant::now());
    let mut outcome = Outcome { tried: FRAMES, ..Outcome::default() };
    let text = drawn_scene(&mut random);
    let input = || format!("seed {seed}\n{text}");
    let engines = outcome.survive("a scene", &input, LONGEST, || engines(&text)).and_then(|(engines, _)| engines);
    match &engines {
        None => outcome.count("refused", FRAMES),
        Some(engines) => {
            for _ in 0..FRAMES {
                let stress = drawn_stress(&mut random, engines.0.sensor.taxels());
                let input = || format!("seed {seed}\n{text}{stress:?}");
                let Some((results, _)) = outcome.survive("a frame", &input, LONGEST, || both(engines, &stress)) else {
                    continue;
                };
                let names = [("golden result", results[0]), ("fixed result", results[1])];
                names.iter().for_each(|(name, is)| outcome.count(name, usize::from(*is)));
                outcome.count("refused", usize::from(results == [false; 2]));
            }
        }
    }
    outcome.elapsed = start.elapsed();
    outcome
}

/// Builds both models; errors must have a message.
fn engines(text: &str) -> Option<Engines> {
    let scene = Scene::parse(text, "fuzz.toml").ok()?;
    let (golden, model) = (Golden::reference(&scene), Model::new(&scene));
    let refusals = [golden.as_ref().err().map(ToString::to_string), model.as_ref().err().map(ToString::to_string)];
    for message in refusals.iter().flatten() {
        assert!(!message.is_empty() && !message.contains("internal"), "{message}");
    }
    Some((scene, golden.ok(), model.ok()))
}

/// The models that return forces for a stress; all forces must be finite.
fn both((scene, golden, model): &Engines, stress: &[f64]) -> [bool; 2] {
    let Ok(frame) = Frame::from_stress("drawn", &scene.sensor, stress.to_vec()) else { return [false; 2] };
    let golden = golden.as_ref().and_then(|golden| golden.run(&frame).ok());
    let fixed = model.as_ref().and_then(|model| model.reconstruct(&frame).ok());
    golden.iter().chain(&fixed).for_each(check);
    [golden.is_some(), fixed.is_some()]
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
