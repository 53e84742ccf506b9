//! Run times of the golden model, matrices and frames, and of the paper's algorithm ([`baseline`]).

use criterion::{criterion_group, criterion_main, Criterion};
use dermis_golden::data::frame::Frame;
use dermis_golden::data::generator::slip::Slip;
use dermis_golden::data::generator::{generate, random_contacts, Draw, Shapes};
use dermis_golden::estimate::float::Golden;
use dermis_golden::spec::partition::Case;
use dermis_golden::spec::scene::{EstimatorKind, ObjectiveKind, Scene};
use dermis_study::baseline::Baseline;
use std::hint::black_box;

fn reconstruct(criterion: &mut Criterion) {
    for name in ["sensor-1", "sensor-3", "sensor-4"] {
        let scene = Scene::builtin(name).expect("the scene is built in");
        let frame = &Frame::shipped(&scene)[0];
        for estimator in [EstimatorKind::Search, EstimatorKind::Evidence] {
            let mut own = scene.clone();
            own.search.estimator = Some(estimator);
            // Evidence refuses pitches as large as sensor-4's.
            let Ok(golden) = Golden::new(&own) else { continue };
            criterion.bench_function(&format!("golden frame {name}, {}", estimator.name()), |bencher| {
                bencher.iter(|| golden.run(black_box(frame)));
            });
        }
        criterion.bench_function(&format!("golden matrices {name}"), |bencher| {
            bencher.iter(|| Golden::new(black_box(&scene)));
        });
    }
}

/// Slower methods: regions per contact on a frame of several contacts, the fit of an ellipse.
fn beyond(criterion: &mut Criterion) {
    for (name, case, objective) in
        [("sensor-3", Case::Contacts, ObjectiveKind::Sparse), ("sensor-1", Case::WHOLE, ObjectiveKind::Patch)]
    {
        let mut scene = Scene::builtin(name).expect("the scene is built in");
        (scene.partition.case, scene.search.objective) = (case, objective);
        scene.search.estimator = Some(EstimatorKind::Search);
        let golden = Golden::new(&scene).expect("the scene has matrices");
        for shapes in [Shapes::Elliptic, Shapes::Other] {
            let count = if case == Case::Contacts { 3 } else { 1 };
            let contacts =
                random_contacts(&scene.sensor, Draw { count, shapes, slip: Slip::Full, touching: false, seed: 1 });
            let frame = generate("drawn", &scene.sensor, scene.medium, &contacts).expect("drawn contacts are sound");
            let id = format!("golden frame {name}, case {case}, {}, {shapes:?}", objective.name());
            criterion.bench_function(&id, |bencher| bencher.iter(|| golden.run(black_box(&frame))));
        }
    }
}

fn baseline(criterion: &mut Criterion) {
    for name in ["sensor-1", "sensor-3"] {
        let scene = Scene::builtin(name).expect("the scene is built in");
        let baseline = Baseline::new(&scene).expect("the scene is small enough");
        let frame = &Frame::shipped(&scene)[0];
        criterion.bench_function(&format!("literal frame {name}"), |bencher| {
            bencher.iter(|| baseline.run(black_box(frame)));
        });
        criterion.bench_function(&format!("literal matrices {name}"), |bencher| {
            bencher.iter(|| Baseline::new(black_box(&scene)));
        });
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = reconstruct, beyond, baseline
}
criterion_main!(benches);
