//! The study with few contacts: properties of the bound and the estimators.

use super::*;
use dermis_golden::data::generator::converter::Converter;
use dermis_golden::data::generator::draws::{ContactShape, DrawOptions};
use dermis_golden::spec::partition::Case;
use dermis_golden::spec::scene::{EstimatorKind, ObjectiveKind, PartitionSpec, Scene};

/// Medians of few contacts scatter; the ratios of the full study are below 1.3.
const RATIO: f64 = 1.5;

fn rows(scene: &str, levels: Vec<f64>, objectives: Vec<ObjectiveKind>, frames: usize) -> Vec<NoiseRow> {
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

/// A small study of drawn shapes.
fn shapes(scene: &str, options: DrawOptions, candidates: Vec<Candidate>, levels: Vec<f64>) -> Vec<ShapeRow> {
    let wanted = ShapeStudy { levels, draws: 20, options, candidates, ..Default::default() };
    shape_study(&Scene::builtin(scene).unwrap(), &wanted, &|_, _| ()).unwrap()
}

const SPARSE: Candidate = Candidate::Objective(ObjectiveKind::Sparse);

#[test]
fn sparse_holds_any_shape_without_noise_and_none_with() {
    let rows = shapes("sensor-1", DrawOptions::default(), vec![SPARSE], vec![0.0, 1e-2]);
    let median = |k: usize| rows[k].summary.tangential.median.value;
    assert_eq!(
        rows.iter().map(|row| row.estimator.as_str()).collect::<Vec<_>>(),
        ["none", "search sparse", "none", "search sparse"]
    );
    assert!(median(1) < 0.05 && median(3) > 0.5, "{rows:?}");
    // The baseline knows no shear; the integral of the stress is within some percent of the normal force.
    assert_eq!((median(0), rows[0].summary.tangential.ninety.value), (1.0, 1.0));
    assert!(rows[0].summary.normal.median.value < 0.2 && rows[0].summary.normal.median.value > 1e-3);
    assert_eq!((rows[1].bound.tangential, rows[1].bound.draws), ([0.0; 2], 20));
    assert!(rows[3].bound.tangential[0] < median(3));
    // Stated noise is flagged.
    assert_eq!(rows[3].summary.flagged.value, 1.0);
}

#[test]
fn the_bound_is_a_smooth_pressures_inside_its_support() {
    // Published for sensor-1 and a friction ratio of 0.3: 0.4, 1.6, 5.0, 18 % of the shear as standard deviation of a
    // component pair; medians of drawn shapes and ratios scatter about it.
    let rows = shapes("sensor-1", DrawOptions::default(), vec![], vec![1e-4, 5e-4, 2e-3, 1e-2]);
    for (row, published) in rows.iter().zip([0.004, 0.016, 0.05, 0.18]) {
        let ratio = row.bound.tangential[0] / published;
        assert!((0.4..2.0).contains(&ratio), "{}: {:?}", row.noise, row.bound);
    }
}

#[test]
fn averaging_divides_the_bound_until_the_gains_limit_it() {
    let bound = |noise: f64, frames: usize, gain_spread: f64| {
        let converter = Converter { frames, gain_spread, ..Default::default() };
        let options = DrawOptions { converter, ..Default::default() };
        shapes("sensor-1", options, vec![], vec![noise])[0].bound.tangential[0]
    };
    let (one, many, gains) = (bound(1e-3, 1, 0.0), bound(1e-3, 64, 0.0), bound(1e-3, 64, 0.01));
    // By at most 8: with much noise the smoothness helps.
    assert!((5.0..8.01).contains(&(one / many)), "{one} {many}");
    // A spread of 1 % is noise of at most 1 % of the largest stress.
    assert!(gains > 1.5 * many && gains < bound(1e-2, 1, 0.0), "{gains} {many}");
}

#[test]
fn several_contacts_have_their_own_errors() {
    let scene = Scene {
        partition: PartitionSpec { case: Case::Contacts, ..Default::default() },
        ..Scene::builtin("sensor-3").unwrap()
    };
    let options = DrawOptions { contacts: 2, ..Default::default() };
    let wanted = ShapeStudy { levels: vec![0.0], draws: 8, options, candidates: vec![SPARSE], ..Default::default() };
    let rows = shape_study(&scene, &wanted, &|_, _| ()).unwrap();
    let own = rows[1].summary.contact_tangential.unwrap();
    assert!(own.median.value < 0.2, "{own:?}");
    assert_eq!(rows[0].summary.contact_tangential.unwrap().median.value, 1.0);
    // Without any shear the error is the resultant's share of all shears, which cancel in part.
    let over_all = [0, 1].map(|row| rows[row].summary.over_all.unwrap().median.value);
    assert!(over_all[1] < 0.2 && (0.2..1.0).contains(&over_all[0]), "{over_all:?}");
}

#[test]
fn unipolar_readings_unstated_noise_and_shapes_are_rows() {
    let converter = Converter { unipolar: true, ..Default::default() };
    let options =
        DrawOptions { converter, shapes: vec![ContactShape::Ring, ContactShape::Tilted], ..Default::default() };
    let run = |noise_stated| {
        let wanted = ShapeStudy {
            levels: vec![2e-3],
            draws: 10,
            options: options.clone(),
            noise_stated,
            candidates: vec![SPARSE],
            by_shape: true,
        };
        shape_study(&Scene::builtin("sensor-1").unwrap(), &wanted, &|_, _| ()).unwrap()
    };
    let (stated, unstated) = (run(true), run(false));
    let names: Vec<&str> = stated.iter().map(|row| row.shape).collect();
    assert_eq!(names, ["all", "ring", "tilted", "all", "ring", "tilted"]);
    assert_eq!(stated.iter().map(|row| row.summary.draws).collect::<Vec<_>>(), [10, 5, 5, 10, 5, 5]);
    assert!(stated[3].unipolar && stated[3].summary.flagged.value == 1.0 && unstated[3].summary.flagged.value < 1.0);
    // Clipping takes information away: the bound without it is smaller.
    let bipolar = DrawOptions { shapes: options.shapes, ..Default::default() };
    let all = shapes("sensor-1", bipolar, vec![], vec![2e-3]);
    assert!(all[0].bound.tangential[0] < stated[0].bound.tangential[0]);
}

#[test]
fn what_is_stated_wrongly_costs_accuracy() {
    let wanted = ShapeStudy { levels: vec![0.0], draws: 5, candidates: vec![SPARSE], ..Default::default() };
    let rows = sensitivities(&Scene::builtin("sensor-1").unwrap(), &wanted, &|_, _| ()).unwrap();
    assert_eq!(rows.len(), 1 + 6 + 6 + 6 + 1 + 4);
    let of = |what: &str, off: Option<f64>| {
        let row = rows.iter().find(|row| row.what == what && row.off == off).unwrap();
        row.summary.tangential.median.value
    };
    let exact = of("nothing", None);
    assert!(exact < 0.05);
    for what in ["cover thickness", "pitch"] {
        assert!(of(what, Some(0.10)) > 2.0 * exact, "{what}");
    }
    // A bonded layer read as a half-space loses half of the shear.
    assert!(of("half-space for bonded layer", None) > 0.2);
    assert!(of("gain spread", Some(0.10)) > of("gain spread", Some(0.005)));
}

/// One σ of the network covers 55 to 80 % of the shears, in floating point and in hardware.
#[test]
fn standard_deviations_of_the_network_are_honest() {
    let scene = Scene::builtin("sensor-1-noisy").unwrap();
    let candidates = vec![Candidate::Estimator(EstimatorKind::Network), Candidate::Hardware];
    let wanted =
        ShapeStudy { levels: vec![0.002, 0.01], draws: 100, noise_stated: false, candidates, ..Default::default() };
    for row in shape_study(&scene, &wanted, &|_, _| ()).unwrap().iter().filter(|row| row.estimator != "none") {
        let coverage = row.summary.coverage.unwrap();
        assert!((0.55..0.8).contains(&coverage.within_1.value), "{} {}: {coverage:?}", row.estimator, row.noise);
        assert_eq!((coverage.frames, coverage.normal_within_1), (100, None));
    }
}

/// The hardware on bonded layers, by its networks: errors in full slip, of every shape; error bars; bias of contacts held at 0.8 and
/// 0.6 of the friction. The search on the same frames is beyond each of these errors, and has no standard deviation where no noise is
/// stated.
#[test]
fn the_hardware_on_bonded_layers_meets_its_limits() {
    let shapes = ContactShape::NAMES.map(|(_, shape)| shape).to_vec();
    let study = ShapeStudy {
        levels: vec![2e-3],
        draws: 102,
        options: DrawOptions { shapes, ..Default::default() },
        noise_stated: false,
        candidates: vec![Candidate::Hardware],
        ..Default::default()
    };
    let rows = |scene: &Scene, study: &ShapeStudy| slip_study(scene, study, &|_, _| ()).unwrap();
    for (name, limits) in [("sensor-1-bonded", [0.08, 0.18]), ("eight-by-eight-bonded", [0.12, 0.26])] {
        let mut scene = Scene::builtin(name).unwrap();
        let found = rows(&scene, &study);
        let full = &found[0];
        assert!((0..2).all(|k| full.tangential[k] <= limits[k]), "{name}: {full:?}");
        assert!((0.6..=0.76).contains(&full.within_1.unwrap()), "{name}: {full:?}");
        assert!(found[1..3].iter().all(|held| held.bias.abs() <= 0.05), "{name}: {found:?}");
        scene.hardware.estimator = Some(EstimatorKind::Search);
        let full = &rows(&scene, &ShapeStudy { draws: 24, ..study.clone() })[0];
        assert!((0..2).all(|k| full.tangential[k] > limits[k]) && full.within_1.is_none(), "{name}: {full:?}");
    }
}

/// Hardware that sends resultants gives the same standard deviation of the shear as with a force per taxel.
#[test]
fn resultants_have_the_standard_deviation_of_the_shear() {
    let mut scene = Scene::builtin("sensor-1-noisy").unwrap();
    let frame = dermis_golden::data::frame::Frame::shipped(&scene).remove(1);
    let sigma = |scene: &Scene| {
        let result = dermis_golden::fixed::Model::new(scene).unwrap().reconstruct(&frame).unwrap();
        (result.forces_N.fz.len(), result.subarrays[0].shear_sigma_N.unwrap())
    };
    let (taxels, wanted) = sigma(&scene);
    scene.output.forces = dermis_golden::spec::scene::ForceOutput::Resultants;
    let (none, found) = sigma(&scene);
    assert_eq!((taxels, none), (100, 0));
    assert!((0..2).all(|axis| wanted[axis] > 0.0 && (found[axis] / wanted[axis] - 1.0).abs() < 1e-9), "{found:?}");
}

/// With "auto" the hardware is that of the scene as it states its noise, although the study leaves out the noise floor.
#[test]
fn the_hardware_of_a_study_has_the_scene_s_estimator() {
    let scene = Scene::builtin("sensor-1").unwrap();
    let study =
        ShapeStudy { levels: vec![1e-3], draws: 20, candidates: vec![Candidate::Hardware], ..Default::default() };
    let error = |noise_stated: bool| {
        let rows = shape_study(&scene, &ShapeStudy { noise_stated, ..study.clone() }, &|_, _| ()).unwrap();
        rows[1].summary.tangential.median.value
    };
    // The network where noise is stated, else the search, which cannot find shear in it.
    assert!(error(true) < 0.2 && error(false) > 0.4, "{} {}", error(true), error(false));
}

/// The deviations of a search are those of the array: of frames with several contacts there is no coverage.
#[test]
fn the_deviations_of_a_search_are_not_those_of_one_of_several_contacts() {
    let scene = Scene::builtin("sensor-1").unwrap();
    for contacts in [1, 2] {
        let options = DrawOptions { contacts, ..Default::default() };
        let candidates = vec![Candidate::Estimator(EstimatorKind::Search)];
        let study = ShapeStudy { levels: vec![1e-3], draws: 10, candidates, options, ..Default::default() };
        let rows = shape_study(&scene, &study, &|_, _| ()).unwrap();
        assert_eq!(rows[1].summary.coverage.is_some(), contacts == 1);
    }
}
