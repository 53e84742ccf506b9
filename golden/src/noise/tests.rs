//! The study with few contacts: properties of the bound and the estimators.

use super::*;
use crate::scene::{ObjectiveKind, Scene};

/// Medians of few contacts scatter; the ratios of the full study are below 1.3.
const RATIO: f64 = 1.5;

fn rows(scene: &str, levels: Vec<f64>, objectives: Vec<ObjectiveKind>, frames: usize) -> Vec<Row> {
    let scene = Scene::builtin(scene).unwrap();
    let wanted = Study { levels, draws: 40, seed: 5, objectives, frames };
    study(&scene, &wanted, &mut |_, _| ()).unwrap()
}

#[test]
fn patch_stays_near_the_bound() {
    for scene in ["sensor-1", "sensor-2"] {
        for row in rows(scene, vec![1e-4, 2e-3, 1e-2], vec![ObjectiveKind::Patch], 1) {
            assert!(row.ratio_6.unwrap() <= RATIO, "{scene}: {row:?}");
        }
    }
}

#[test]
fn without_noise_the_bound_is_zero_and_the_patch_exact() {
    let row = &rows("sensor-2", vec![0.0], vec![ObjectiveKind::Patch], 1)[0];
    assert_eq!((row.bound_6.rms, row.ratio_6), (0.0, None));
    // The quadrature's error, a tenth of the bound at the lowest noise of the table.
    assert!(row.found.ninety < 5e-4, "{row:?}");
}

#[test]
fn auto_is_as_good_as_the_better() {
    let kinds = vec![ObjectiveKind::Symmetric, ObjectiveKind::Patch, ObjectiveKind::Auto];
    for three in rows("sensor-1", vec![0.0, 5e-4, 1e-2], kinds, 1).chunks(3) {
        let better = three[0].found.median.min(three[1].found.median);
        assert!(three[2].found.median <= 1.2 * better, "{three:?}");
    }
}

#[test]
fn averaging_divides_the_bound_and_repeats() {
    let run = || rows("sensor-1", vec![1e-2], vec![ObjectiveKind::Compressive], 64);
    let two = run();
    assert_eq!((two[0].frames, two[1].frames), (1, 64));
    assert!((two[0].bound_6.rms / two[1].bound_6.rms - 8.0).abs() < 1e-9);
    assert!(two[0].bound_9.rms >= two[0].bound_6.rms);
    assert_eq!(two, run());
}

#[test]
fn parameters_out_of_range_are_refused() {
    let scene = Scene::builtin("sensor-1").unwrap();
    let good = Study::default();
    let bad = [
        Study { draws: 0, ..good.clone() },
        Study { frames: 0, ..good.clone() },
        Study { levels: vec![f64::NAN], ..good.clone() },
        Study { levels: vec![-1.0], ..good },
    ];
    for bad in bad {
        assert!(matches!(study(&scene, &bad, &mut |_, _| ()), Err(StudyError::Parameter { .. })));
    }
}
