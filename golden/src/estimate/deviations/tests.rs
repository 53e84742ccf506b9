//! Tables that are read, refused by field, interpolated, and added to results; how often they hold on other frames.

use super::*;
use crate::data::generator::converter::Converter;
use crate::data::generator::draws::{DrawOptions, Draws};
use crate::estimate::float::Golden;
use crate::fixed::Model;
use crate::result::flags::Flag;
use crate::spec::scene::{Condition, ForceOutput};

/// max |b| of the frames in MPa.
const PEAK: f64 = 0.1;

fn searched(name: &str) -> Scene {
    Scene::builtin(name).unwrap().estimated_by(EstimatorKind::Search)
}

/// The scene with stated noise, in units of the frames' peak.
fn stated(name: &str, noise: f64) -> Scene {
    let mut scene = searched(name);
    (scene.search.noise_floor_MPa, scene.input.full_scale_MPa) = (Some(noise * PEAK), Some(1.2 * PEAK));
    scene
}

fn frame(scene: &Scene, noise: f64, number: u64) -> Frame {
    let converter = Converter { noise, seed: 5, ..Default::default() };
    let options = DrawOptions { peak_MPa: Some(PEAK), converter, seed: 91, ..Default::default() };
    Draws::new(scene, options).unwrap().frame(number).unwrap().frame
}

#[test]
fn the_built_in_scenes_have_a_table_each() {
    for (name, text) in SHIPPED {
        let table = Deviations::parse(text, name).unwrap();
        let scene = searched(name);
        assert_eq!(Some(&table.subject), Subject::of(&scene, scene.model_estimator()).as_ref(), "{name}");
        assert_eq!(table.to_text(), text, "{name}");
        assert_eq!(Deviations::of_scene(&scene, scene.model_estimator()).unwrap(), Some(table), "{name}");
    }
    // What no search finds has none, and what no table was measured for.
    let without = |change: fn(&mut Scene)| {
        let mut scene = searched("sensor-1");
        change(&mut scene);
        assert_eq!(Deviations::of_scene(&scene, scene.model_estimator()).unwrap(), None);
    };
    without(|s| s.search.mu_max = 0.0);
    without(|s| s.search.estimator = Some(EstimatorKind::Evidence));
    without(|s| s.search.objective = ObjectiveKind::Patch);
    without(|s| s.search.form = Form::Orthogonal);
    without(|s| s.partition.case = Case::Contacts);
    without(|s| s.input.unipolar = true);
    without(|s| s.sensor.thickness_mm = 3.5);
    without(|s| s.inverse.level = Some(0.3));
    without(|s| s.search.degree = Some(1));
    without(|s| s.fixed.data_bits = 12);
}

#[test]
fn between_levels_the_logarithm_is_linear() {
    let row = |sigma: f64| vec![[sigma, 2.0 * sigma, 0.1], [0.5, 0.5, 0.5]];
    let subject = Subject::of(&searched("sensor-1"), EstimatorKind::Search).unwrap();
    let table =
        Deviations::new(subject, [9, 1], vec![1e-4, 1e-2], vec![4.0], vec![row(0.01), row(0.16)], (None, Some(3)));
    // Beyond the last level that of the normal force grows with the noise.
    let [x, _, normal] = table.at(1.0, 3.9);
    assert!((x - 0.16).abs() < 1e-9 && (normal - 10.0).abs() < 1e-9);
    for (noise, wanted) in [(1e-9, 0.01), (1e-4, 0.01), (1e-3, 0.04), (1e-2, 0.16)] {
        let [x, y, normal] = table.at(noise, 3.9);
        assert!(
            (x / wanted - 1.0).abs() < 1e-9 && (y / x - 2.0).abs() < 1e-9 && (normal - 0.1).abs() < 1e-9,
            "{noise}"
        );
    }
    assert!(table.at(1e-3, 4.0).iter().all(|sigma| (sigma - 0.5).abs() < 1e-12));
    assert_eq!(Deviations::parse(&table.to_text(), "t").unwrap(), table);
}

#[test]
fn a_wrong_file_is_refused_by_what_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("own.deviations");
    let mut scene = searched("sensor-1");
    scene.search.deviations = Some(path.clone());
    let message = |scene: &Scene| {
        let error = Deviations::of_scene(scene, scene.model_estimator()).unwrap_err().to_string();
        assert_eq!(Model::new(scene).unwrap_err().to_string(), error);
        assert_eq!(Golden::new(scene).err().unwrap().to_string(), error);
        assert!(error.starts_with(&path.display().to_string()), "{error}");
        error
    };
    assert!(message(&scene).contains("search.deviations cannot be read"));
    let good = Deviations::of_scene(&searched("sensor-1"), EstimatorKind::Search).unwrap().unwrap();
    type Fault = (fn(&mut Deviations), &'static str);
    let faults: [Fault; 7] = [
        (|t| t.version = 2, "version"),
        (|t| t.levels.clear(), "levels"),
        (|t| t.levels[1] = t.levels[0], "levels"),
        (|t| t.sizes.swap(0, 1), "sizes"),
        (|t| t.sigma.truncate(3), "a row per level"),
        (|t| t.sigma[2].truncate(1), "per class"),
        (|t| t.sigma[1][1][2] = 0.0, "above 0"),
    ];
    for (fault, wanted) in faults {
        let mut bad = good.clone();
        fault(&mut bad);
        std::fs::write(&path, bad.to_text()).unwrap();
        assert!(message(&scene).contains(wanted), "{wanted}: {}", message(&scene));
    }
    for text in ["", "{}", "[1]", &good.to_text()[..900], &good.to_text().replace("\"seed\"", "\"seeds\"")] {
        std::fs::write(&path, text).unwrap();
        assert!(message(&scene).contains("not a table of standard deviations"), "{text}");
    }
    std::fs::write(&path, good.to_text()).unwrap();
    assert_eq!(Deviations::of_scene(&scene, scene.model_estimator()).unwrap(), Some(good));
    type Change = (fn(&mut Scene), &'static str);
    let changes: [Change; 10] = [
        (|s| s.inverse.level = Some(0.3), "inverse.level = None, the scene has Some(0.3)"),
        (|s| s.search.degree = Some(1), "search.degree = None, the scene has Some(1)"),
        (|s| s.fixed.coef_bits = 12, "fixed.coef_bits = 18, the scene has 12"),
        (|s| s.partition.condition = Condition::BothSigns, "partition.condition = Loaded, the scene has BothSigns"),
        (|s| s.sensor.rows = 12, "sensor.rows = 10, the scene has 12"),
        (|s| s.sensor.pitch_y_mm = 3.0, "sensor.pitch_y_mm = 4.0, the scene has 3.0"),
        (|s| s.sensor.thickness_mm = 2.5, "sensor.thickness_mm = 3.0, the scene has 2.5"),
        (|s| s.search.mu_max = 0.5, "search.mu_max = 0.6, the scene has 0.5"),
        (|s| s.partition.case = Case::numbered(1).unwrap(), "partition.case = \"0\", the scene has \"1\""),
        (|s| s.input.dead = vec![[1, 2]], "input.dead = [], the scene has [[1, 2]]"),
    ];
    for (change, wanted) in changes {
        let mut other = scene.clone();
        change(&mut other);
        assert!(message(&other).contains(wanted), "{}", message(&other));
    }
}

/// Golden and fixed results have the deviations of the table, records those of the forces; none without a stated noise.
#[test]
fn results_have_the_deviations_of_their_noise() {
    for noise in [1e-5, 1e-3] {
        let mut scene = stated("sensor-1", noise);
        let own = frame(&scene, noise, 3);
        let golden = Golden::new(&scene).unwrap().run(&own).unwrap();
        let fixed = Model::new(&scene).unwrap().reconstruct(&own).unwrap();
        for result in [&golden, &fixed] {
            let one = &result.subarrays[0];
            let (mu, shear, normal) = (one.mu_sigma.unwrap(), one.shear_sigma_N.unwrap(), one.normal_sigma_N.unwrap());
            assert_eq!(shear, mu.map(|mu| mu * result.resultant_N[2]));
            let table = Deviations::of_scene(&scene, scene.model_estimator()).unwrap().unwrap();
            let size = result.resultant_N[2] / (own.peak_MPa() * 8.0);
            let noise = scene.search.noise_floor_MPa().hypot(0.12 / 524_287.0 / 12f64.sqrt()) / own.peak_MPa();
            let [x, y, share] = table.at(noise, size);
            assert!((mu[0] - x).abs() < 1e-12 && (mu[1] - y).abs() < 1e-12);
            assert!((normal / result.resultant_N[2] - share).abs() < 1e-12);
            assert_eq!(result.flags.contains(&Flag::ShearNotResolved), result.checks.shear_spread.unwrap() > 1.0 / 3.0);
            assert_eq!(result.flags.contains(&Flag::ShearNotResolved), noise > 1e-4, "{:?}", result.checks);
        }
        scene.output.forces = ForceOutput::Resultants;
        let record = Model::new(&scene).unwrap().reconstruct(&own).unwrap().subarrays.remove(0);
        let [a, b] = [record, fixed.subarrays[0].clone()].map(|own| own.shear_sigma_N.unwrap()[0]);
        assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
    }
    let scene = searched("sensor-1");
    let own = frame(&scene, 1e-3, 3);
    for result in
        [Golden::new(&scene).unwrap().run(&own).unwrap(), Model::new(&scene).unwrap().reconstruct(&own).unwrap()]
    {
        let one = &result.subarrays[0];
        assert!(one.mu_sigma.is_none() && one.normal_sigma_N.is_none() && result.checks.shear_spread.is_none());
    }
}

/// With a mean the noise is that of the mean, with tare frames theirs; a threshold leaves no deviation of the normal force; noise that
/// is no number adds nothing.
#[test]
fn the_noise_is_that_of_the_reading() {
    let mut scene = stated("sensor-1", 1e-3);
    let own = frame(&scene, 1e-4, 2);
    let sigma = |scene: &Scene, frames: usize| {
        let frames = vec![own.clone(); frames];
        let [golden, fixed] = [
            Golden::new(scene).unwrap().run_averaged(&frames).unwrap(),
            Model::new(scene).unwrap().reconstruct_averaged(&frames).unwrap(),
        ];
        let [a, b] = [golden, fixed].map(|result| result.subarrays[0].clone());
        assert!((a.mu_sigma.unwrap()[0] / b.mu_sigma.unwrap()[0] - 1.0).abs() < 0.02);
        a
    };
    let single = sigma(&scene, 1);
    scene.input.average = 4;
    let mean = sigma(&scene, 16);
    assert!(single.mu_sigma.unwrap()[0] > 1.5 * mean.mu_sigma.unwrap()[0]);
    scene.input.average = 0;
    scene.threshold.min_force_N = 1e-3;
    let one = sigma(&scene, 1);
    assert!(one.shear_sigma_N.is_some() && one.normal_sigma_N.is_none());
    let mut result = Golden::new(&searched("sensor-1")).unwrap().run(&own).unwrap();
    let plain = result.clone();
    let table = Deviations::of_scene(&searched("sensor-1"), EstimatorKind::Search).unwrap().unwrap();
    for noise in [f64::NAN, f64::INFINITY, 0.0, -1.0] {
        table.add(&mut result, &scene, &own, noise);
        assert_eq!(result, plain, "{noise}");
    }
}

/// Each searched subarray has its own; one without a contact has none.
#[test]
fn each_searched_subarray_has_its_own() {
    let scene = stated("sensor-4", 1e-4);
    let own = frame(&scene, 1e-4, 1);
    let result = Golden::new(&scene).unwrap().run(&own).unwrap();
    let known = result.subarrays.iter().filter(|own| own.shear_sigma_N.is_some()).count();
    let searched = result.subarrays.iter().filter(|own| own.objective_value.is_some()).count();
    assert!(known > 0 && known <= searched && searched < 9 * known, "{known} of {searched}");
}
