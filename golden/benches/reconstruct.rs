//! Matrices and frames of the golden model, and beside them a baseline as the paper describes it.
//!
//! The baseline multiplies the dense C† and I − C†C for every candidate μ and leaves the search to a general-purpose
//! optimiser, Nelder–Mead's simplex; objective, family w(μ) and disc are those of the golden model. Its matrices are
//! timed too.

use argmin::core::{CostFunction, Error, Executor};
use argmin::solver::neldermead::NelderMead;
use criterion::{criterion_group, criterion_main, Criterion};
use dermis_golden::float::force::force;
use dermis_golden::float::objective::{Objective, Sparse};
use dermis_golden::float::orthogonal::Orthogonal;
use dermis_golden::float::pass::Polynomial;
use dermis_golden::frame::{Forces, Frame};
use dermis_golden::generator::{generate, random_contacts, Draw, Shapes};
use dermis_golden::matrices::Matrices;
use dermis_golden::partition::Case;
use dermis_golden::reconstruct::Golden;
use dermis_golden::scene::{ObjectiveKind, Scene};
use std::hint::black_box;

/// Cost outside the disc and where nothing presses: above every score's negative.
const REFUSED: f64 = 1e9;
/// Spread of the simplex's costs, in bits, at which it has settled.
const SETTLED: f64 = 1e-6;
/// Most steps of the simplex.
const STEPS: u64 = 200;

/// Eq. 1 for one frame of one subarray.
struct Literal<'a> {
    orthogonal: &'a Orthogonal,
    family: Polynomial,
    b: &'a [f64],
    mu_max: f64,
}

impl Literal<'_> {
    fn forces(&self, mu: [f64; 2]) -> Forces {
        self.orthogonal.apply(self.b, &force(&self.family.eval(mu), mu, 0.0))
    }
}

impl CostFunction for Literal<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, mu: &Vec<f64>) -> Result<f64, Error> {
        if mu[0].hypot(mu[1]) > self.mu_max {
            return Ok(REFUSED);
        }
        Ok(Sparse::default().score(&self.forces([mu[0], mu[1]]).fz).map_or(REFUSED, |score| -score))
    }
}

/// Forces of one frame by the baseline.
fn literal(matrices: &Matrices, orthogonal: &Orthogonal, b: &[f64], mu_max: f64) -> Result<Forces, Error> {
    let problem = || Literal { orthogonal, family: Polynomial::new(matrices, b), b, mu_max };
    let corners = vec![vec![0.0, 0.0], vec![mu_max / 3.0, 0.0], vec![0.0, mu_max / 3.0]];
    let solver = NelderMead::new(corners).with_sd_tolerance(SETTLED)?;
    let found = Executor::new(problem(), solver).configure(|state| state.max_iters(STEPS)).run()?;
    let mu = found.state.best_param.unwrap_or_else(|| vec![0.0; 2]);
    Ok(problem().forces([mu[0], mu[1]]))
}

fn reconstruct(criterion: &mut Criterion) {
    for name in ["sensor-1", "sensor-3", "sensor-4"] {
        let scene = Scene::builtin(name).expect("the scene is built in");
        let golden = Golden::new(&scene).expect("the scene has matrices");
        let frame = &Frame::shipped(&scene)[0];
        criterion.bench_function(&format!("golden frame {name}"), |bencher| {
            bencher.iter(|| golden.run(black_box(frame)));
        });
        criterion.bench_function(&format!("golden matrices {name}"), |bencher| {
            bencher.iter(|| Golden::new(black_box(&scene)));
        });
    }
}

/// What takes longer than the plain method: contacts on a frame of several, the fit of an ellipse.
fn beyond(criterion: &mut Criterion) {
    for (name, case, objective) in
        [("sensor-3", Case::Contacts, ObjectiveKind::Sparse), ("sensor-1", Case::WHOLE, ObjectiveKind::Patch)]
    {
        let mut scene = Scene::builtin(name).expect("the scene is built in");
        (scene.partition.case, scene.search.objective) = (case, objective);
        let golden = Golden::new(&scene).expect("the scene has matrices");
        for shapes in [Shapes::Elliptic, Shapes::Other] {
            let count = if case == Case::Contacts { 3 } else { 1 };
            let contacts = random_contacts(&scene.sensor, Draw { count, shapes, touching: false, seed: 1 });
            let frame = generate("drawn", &scene.sensor, scene.medium, &contacts).expect("drawn contacts are sound");
            let id = format!("golden frame {name}, case {case}, {}, {shapes:?}", objective.name());
            criterion.bench_function(&id, |bencher| bencher.iter(|| golden.run(black_box(&frame))));
        }
    }
}

fn baseline(criterion: &mut Criterion) {
    for name in ["sensor-1", "sensor-3"] {
        let scene = Scene::builtin(name).expect("the scene is built in");
        let mu_max = scene.search.mu_max;
        let matrices = Matrices::new(&scene.sensor, mu_max).expect("the scene has matrices");
        let orthogonal = Orthogonal::new(&matrices).expect("the scene is small enough");
        let frame = &Frame::shipped(&scene)[0];
        criterion.bench_function(&format!("literal frame {name}"), |bencher| {
            bencher.iter(|| literal(&matrices, &orthogonal, black_box(&frame.stress_MPa), mu_max));
        });
        criterion.bench_function(&format!("literal matrices {name}"), |bencher| {
            bencher.iter(|| Orthogonal::new(black_box(&matrices)));
        });
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = reconstruct, beyond, baseline
}
criterion_main!(benches);
