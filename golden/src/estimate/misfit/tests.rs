use super::*;
use crate::physics::influence::Influence;
use crate::random::Random;
use faer::{Col, Mat};

fn check(change: impl Fn(&mut Scene)) -> (Misfit, Vec<[f64; 2]>) {
    let mut scene = Scene::builtin("sensor-1").unwrap();
    change(&mut scene);
    (Misfit::new(&scene, 1.0), vec![[0.2, -0.1]; 100])
}

/// Of forces that press nothing is left, of others much; the load does not matter.
#[test]
fn what_presses_is_explained() {
    let (misfit, mu) = check(|_| ());
    let Influence { cx, cy, cz } = Influence::new(&Scene::builtin("sensor-1").unwrap().sensor);
    let mut random = Random::new(8);
    let p: Vec<f64> = (0..100).map(|k| if k / 10 % 9 > 2 { random.between(0.0, 2.0) } else { 0.0 }).collect();
    let b: Vec<f64> =
        (0..100).map(|t| (0..100).map(|k| (cz[(t, k)] + 0.2 * cx[(t, k)] - 0.1 * cy[(t, k)]) * p[k]).sum()).collect();
    let of = |b: &[f64]| misfit.of_stress(b, &mu, 0.0).unwrap();
    assert!(of(&b) < 0.2, "{}", of(&b));
    let heavy: Vec<f64> = b.iter().map(|b| 1e6 * b).collect();
    assert!((of(&heavy) / of(&b) - 1.0).abs() < 0.05);
    let pulls: Vec<f64> = b.iter().map(|b| -b).collect();
    assert!(of(&pulls) > 5.0);
    // Less noise is stated than the largest of the training, so that less may be left; more is not allowed for.
    let mut noisy = b.clone();
    let peak = b.iter().fold(0.0f64, |peak, b| b.max(peak));
    noisy.iter_mut().for_each(|b| *b += 0.02 * peak * random.normal());
    let [quiet, loud, louder] = [1e-3, 2e-2, 0.2].map(|noise| misfit.of_stress(&noisy, &mu, noise * peak).unwrap());
    assert!(quiet > loud && loud == louder && loud == of(&noisy), "{quiet} {loud} {louder}");
    assert_eq!(misfit.of_stress(&[0.0; 100], &mu, 0.0), None);
}

/// A dead taxel's reading does not count, nor on a unipolar array tension.
#[test]
fn what_is_not_read_does_not_count() {
    let mut b: Vec<f64> = (0..100).map(|t| (-((t / 10) as f64 - 4.5).powi(2) / 4.0).exp()).collect();
    let (plain, mu) = check(|_| ());
    let (masked, _) = check(|scene| scene.input.dead = vec![[4, 4]]);
    let before = masked.of_stress(&b, &mu, 0.0).unwrap();
    b[44] = 30.0;
    assert_eq!(masked.of_stress(&b, &mu, 0.0).unwrap(), before);
    assert!(plain.of_stress(&b, &mu, 0.0).unwrap() > 1.0);
    let (clipped, _) = check(|scene| scene.input.unipolar = true);
    b[44] = 1.0;
    b[..10].fill(-3.0);
    let [bipolar, unipolar] = [&plain, &clipped].map(|misfit| misfit.of_stress(&b, &mu, 0.0).unwrap());
    assert!(bipolar > 2.0 && unipolar < 1.0, "{bipolar} {unipolar}");
}

/// What [`STEPS`] steps leave, with matrices in double precision.
fn left_by_matrices(scene: &Scene, mu: &[[f64; 2]], b: &[f64]) -> f64 {
    let (n, Influence { cx, cy, cz }) = (b.len(), Influence::through(&scene.sensor, scene.medium));
    let (c, alive) = (
        Mat::from_fn(n, n, |t, k| cz[(t, k)] + mu[k][0] * cx[(t, k)] + mu[k][1] * cy[(t, k)]),
        scene.input.alive(&scene.sensor),
    );
    let rest = |p: &Col<f64>| {
        let stress = &c * p;
        let counts =
            |t: usize| if scene.input.unipolar && b[t] <= 0.0 { (-stress[t]).min(0.0) } else { b[t] - stress[t] };
        Col::from_fn(n, |t| if alive[t] { counts(t) } else { 0.0 })
    };
    let size = |along: &dyn Fn(usize, usize) -> f64| {
        (0..n).map(|i| (0..n).map(|j| along(i, j).abs()).sum::<f64>()).fold(0.0, f64::max)
    };
    let step = 1.0 / (size(&|i, j| c[(i, j)]) * size(&|i, j| c[(j, i)]));
    let (mut p, mut ahead, mut inertia) = (Col::<f64>::zeros(n), Col::<f64>::zeros(n), 1.0f64);
    for _ in 0..STEPS {
        let slope = c.transpose() * rest(&ahead);
        let next = (1.0 + (1.0 + 4.0 * inertia * inertia).sqrt()) / 2.0;
        let moved = Col::from_fn(n, |k| (ahead[k] + step * slope[k]).max(0.0));
        ahead = Col::from_fn(n, |k| moved[k] + (inertia - 1.0) / next * (moved[k] - p[k]));
        (p, inertia) = (moved, next);
    }
    rest(&p).norm_l2()
}

/// The convolutions are the products with the matrices: on any shape, with one μ and with one of each cell, with dead taxels, unipolar.
#[test]
fn the_fit_is_that_of_matrices() {
    let mut random = Random::new(4);
    for (rows, cols) in [(10, 10), (8, 8), (5, 7), (7, 5), (2, 17), (13, 2)] {
        for change in 0..4 {
            let sensor = Sensor { rows, cols, pitch_x_mm: 2.0, pitch_y_mm: 3.0, thickness_mm: 2.5 };
            let mut scene = Scene::of_sensor(&sensor, "pad");
            scene.input.unipolar = change == 1;
            scene.input.dead = if change == 2 { vec![[1, 0], [0, 1]] } else { Vec::new() };
            let n = sensor.taxels();
            let own = |k: usize| {
                if change == 3 {
                    [0.3 - 0.1 * (k % 3) as f64, 0.2 * (k / 9) as f64 / n as f64]
                } else {
                    [0.3, -0.2]
                }
            };
            let mu: Vec<[f64; 2]> = (0..n).map(own).collect();
            let alive = scene.input.alive(&sensor);
            let read = |b: f64| if scene.input.unipolar { b.max(0.0) } else { b };
            let b: Vec<f64> = (0..n).map(|t| if alive[t] { read(random.between(-0.3, 1.0)) } else { 0.0 }).collect();
            let single: Vec<f32> = b.iter().map(|b| *b as f32).collect();
            let readings = Readings { b: &single, alive: &alive, unipolar: scene.input.unipolar };
            let kernels = Kernels::new(&sensor, scene.medium).of_cells(&mu);
            let (own, wanted) = (f64::from(Fit::new(&kernels, &readings).left()), left_by_matrices(&scene, &mu, &b));
            // Single precision, rounded in a hundred products and twenty steps.
            assert!((own - wanted).abs() < 1e-5 * wanted, "{rows}×{cols}, {change}: {own} {wanted}");
        }
    }
}
