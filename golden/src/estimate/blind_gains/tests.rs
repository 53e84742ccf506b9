use super::*;
use crate::data::generator::draws::{DrawOptions, Draws};
use crate::data::input::calibration::Calibration;
use crate::random::Random;
use crate::spec::scene::Scene;

/// Standard deviation of the gains.
const SPREAD: f64 = 0.08;
/// Noise over the peak.
const NOISE: f64 = 0.003;
/// Zero of the readings in MPa.
const ZERO: f64 = 0.02;
/// max |b| of a press in MPa.
const PEAK: f64 = 0.1;

/// An array, its gains, and the exact stress of its presses.
struct Drawn {
    scene: Scene,
    gains: Vec<f64>,
    presses: Vec<Vec<f64>>,
}

fn drawn(count: u64, seed: u64) -> Drawn {
    let scene = Scene::builtin("eight-by-eight").unwrap();
    let options = DrawOptions { peak_MPa: Some(PEAK), seed, ..DrawOptions::default() };
    let draws = Draws::new(&scene, options).unwrap();
    let presses = (0..count).into_par_iter().map(|k| draws.frame(k).unwrap().exact_MPa).collect();
    let mut random = Random::new(seed);
    let gains = (0..scene.sensor.taxels()).map(|_| 1.0 + SPREAD * random.normal()).collect();
    Drawn { scene, gains, presses }
}

impl Drawn {
    /// The presses as they are read, each after a frame without load.
    fn recording(&self) -> Vec<Frame> {
        let mut random = Random::new(17);
        let mut frame = |exact: &[f64]| {
            let read = |(b, gain): (&f64, &f64)| ZERO + b * gain + NOISE * PEAK * random.normal();
            let readings = exact.iter().zip(&self.gains).map(read).collect();
            Frame::from_stress("press", &self.scene.sensor, readings).unwrap()
        };
        let none = vec![0.0; self.gains.len()];
        self.presses.iter().flat_map(|press| [frame(&none), frame(press)]).collect()
    }

    fn found(&self) -> Result<BlindGains, BlindError> {
        BlindGains::new(&self.scene, &self.recording(), &|_, _| ())
    }

    /// Root mean square of the rough part of what is left of the gains, and of the smooth part.
    fn left(&self, theta: &[f64]) -> [f64; 2] {
        let off: Vec<f64> = self.gains.iter().zip(theta).map(|(gain, theta)| gain.ln() - theta).collect();
        rough_and_smooth(&self.scene.sensor, &off)
    }
}

#[test]
fn the_spread_falls() {
    let drawn = drawn(240, 1);
    let found = drawn.found().unwrap();
    let (before, after) = (drawn.left(&[0.0; 64]), drawn.left(&found.log_gain));
    println!("rough {:.4} to {:.4}, smooth {:.4} to {:.4}", before[0], after[0], before[1], after[1]);
    println!("stated {:.4} to {:.4}, rise {:?}", found.spread_before, found.spread_after, found.rise);
    assert!(after[0] < 0.6 * before[0] && (after[1] - before[1]).abs() < 1e-3);
    assert!((found.spread_before / before[0] - 1.0).abs() < 0.4);
    assert_eq!((found.presses, found.flagged, found.spoiled, found.smooth), (240, 0, 0, 15));
    // The table reads what the gains say, over the zero of the frames without load.
    let Calibration { offset, gain } = &found.table;
    assert!(offset.iter().all(|zero| (zero - ZERO).abs() < 1e-4));
    assert!(gain.iter().zip(&found.log_gain).all(|(gain, theta)| (gain * theta.exp() - 1.0).abs() < 1e-12));
    assert_eq!(found, drawn.found().unwrap(), "the same recording gives the same gains");
}

/// Readings that belong to other taxels in every press have no gains in common.
#[test]
fn unrelated_readings_are_refused() {
    let mut shuffled = drawn(200, 2);
    let mut random = Random::new(5);
    for press in &mut shuffled.presses {
        for k in (1..press.len()).rev() {
            press.swap(k, random.between(0.0, (k + 1) as f64) as usize);
        }
    }
    let found = shuffled.found();
    assert!(matches!(found, Err(BlindError::NoRise { .. })), "{found:?}");
}

/// Seeded fault: smooth patterns that are not held run away.
#[test]
fn smooth_patterns_that_are_free_run_away() {
    let drawn = drawn(200, 3);
    let input = prepared(&drawn.scene).unwrap();
    let found = presses(&drawn.scene, &input, &drawn.recording());
    let all: Vec<usize> = (0..64).collect();
    let left = |order: i32| {
        let smooth = Smooth::new(&drawn.scene.sensor, &all, order);
        let search = Search::new(&drawn.scene, &found.presses, (&all, &smooth), &|_, _| ()).unwrap();
        drawn.left(&search.run().unwrap().top.theta)[1]
    };
    let (before, held, free) = (drawn.left(&[0.0; 64])[1], left(ORDER), left(-1));
    println!("smooth part {before:.4}, held {held:.4}, free {free:.4}");
    assert!((held - before).abs() < 1e-3 && free > 1.5 * before);
}

#[test]
fn recordings_that_tell_no_gains_are_refused() {
    let few = drawn(60, 4);
    let found = few.found();
    assert!(matches!(found, Err(BlindError::Few { presses: 60, frames: 120, .. })), "{found:?}");
    // One press 200 times covers too few taxels.
    let narrow = Drawn { presses: vec![few.presses[0].clone(); 200], ..few };
    let found = narrow.found();
    assert!(matches!(found, Err(BlindError::NotCovered { live: 64, .. })), "{found:?}");
    let mut curved = narrow.scene.clone();
    curved.input.curve = vec![[0.0, 0.0], [0.1, 0.2]];
    assert!(matches!(BlindGains::new(&curved, &[], &|_, _| ()), Err(BlindError::Curve { .. })));
}
