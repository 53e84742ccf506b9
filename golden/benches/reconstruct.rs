//! One 10 × 10 frame through the golden model, the matrices being there, and the matrices themselves.

use criterion::{criterion_group, criterion_main, Criterion};
use dermis_golden::frame::Frame;
use dermis_golden::reconstruct::Golden;
use dermis_golden::scene::Scene;
use std::hint::black_box;

fn reconstruct(criterion: &mut Criterion) {
    let scene = Scene::builtin("sensor-1").expect("sensor-1 is built in");
    let golden = Golden::new(&scene).expect("sensor-1 has matrices");
    let frame = &Frame::shipped(&scene)[0];
    criterion.bench_function("golden frame sensor-1", |bencher| {
        bencher.iter(|| golden.run(black_box(frame)));
    });
    criterion.bench_function("golden matrices sensor-1", |bencher| {
        bencher.iter(|| Golden::new(black_box(&scene)));
    });
}

criterion_group!(benches, reconstruct);
criterion_main!(benches);
