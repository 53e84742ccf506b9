//! The golden engine on shipped frames, the JSON of its result, and extreme frames.

use super::*;
use crate::data::frame::{Contact, Forces, Frame};
use crate::data::generator::generate;
use crate::data::reception::SubarrayStats;
use crate::estimate::float::forces::residual;
use crate::estimate::learned::{self, Training};
use crate::result::flags::Flag;
use crate::result::reconstruct::{assemble, Reconstruction, SubarrayResult};
use crate::spec::partition::{Case, Grid, Subarray};
use crate::spec::scene::Condition;
use crate::spec::scene::Scene;
use proptest::prelude::*;
use std::sync::OnceLock;

/// Targets on sensor 1: median tangential error, normal error of each frame.
const TANGENTIAL_MEDIAN: f64 = 0.03;
const NORMAL_EACH: f64 = 0.015;

fn scene() -> Scene {
    Scene::builtin("sensor-1").unwrap()
}

fn hertz() -> Frame {
    let mut frames = Frame::shipped(&scene()).into_iter();
    frames.find(|frame| frame.id == "S1-hs-hertz").unwrap()
}

fn run(scene: &Scene, frame: &Frame) -> Reconstruction {
    Golden::reference(scene).unwrap().run(frame).unwrap()
}

#[test]
fn sensor_1_meets_its_targets() {
    let golden = Golden::new(&scene()).unwrap();
    let mut tangential = Vec::new();
    for frame in Frame::shipped(&scene()) {
        let errors = golden.run(&frame).unwrap().error.unwrap();
        assert!(errors.normal.unwrap() <= NORMAL_EACH, "{}: {errors:?}", frame.id);
        tangential.push(errors.tangential.unwrap());
    }
    tangential.sort_by(f64::total_cmp);
    let n = tangential.len();
    let median = (tangential[(n - 1) / 2] + tangential[n / 2]) / 2.0;
    assert!(n == 8 && median <= TANGENTIAL_MEDIAN, "{tangential:?}");
}

#[test]
fn json_keeps_the_contract_and_comes_back() {
    let result = run(&scene(), &hertz());
    let text = serde_json::to_string(&result).unwrap();
    let keys = [
        "{\"scene\":\"sensor-1\",\"frame\":\"S1-hs-hertz\",\"engine\":\"golden\",\"case\":{\"rows\":1,\"cols\":1}",
        "\"subarrays\":[{\"row0\":0,\"col0\":0,\"rows\":10,\"cols\":10,\"centroid_condition\":true",
        "\"compression_centroid_mm\":[",
        "\"tension_centroid_mm\":",
        "\"mu\":[",
        "\"objective_value\":",
        "\"resultant_N\":[",
        "\"forces_N\":{\"fx\":[",
        "\"fy\":[",
        "\"fz\":[",
        "\"error\":{\"x1\":",
        "\"x2\":",
        "\"x3\":",
        "\"tangential\":",
        "\"normal\":",
        "\"flags\":[]",
        "\"checks\":{\"peak_MPa\":",
        "\"mu_share\":",
        "\"border_share\":",
        "\"load_ratio\":",
        "}}",
    ];
    let mut from = 0;
    for key in keys {
        from += text[from..].find(key).unwrap_or_else(|| panic!("{key} after {from}")) + key.len();
    }
    assert_eq!(from, text.len());
    assert_eq!(serde_json::from_str::<Reconstruction>(&text).unwrap(), result);
}

#[test]
fn shear_points_from_tension_to_compression() {
    // In full sliding b is compressive ahead of the contact and tensile behind it.
    let result = run(&scene(), &hertz());
    let part = &result.subarrays[0];
    let (c, t) = (part.compression_centroid_mm.unwrap(), part.tension_centroid_mm.unwrap());
    assert!(part.mu[0] * (c[0] - t[0]) + part.mu[1] * (c[1] - t[1]) > 0.0);
}

#[test]
fn mirrored_stress_gives_mirrored_forces() {
    let (scene, frame) = (scene(), hertz());
    let mut mirrored = frame.clone();
    for (k, b) in mirrored.stress_MPa.iter_mut().enumerate() {
        *b = frame.stress_MPa[k - k % 10 + 9 - k % 10];
    }
    let (a, b) = (run(&scene, &frame), run(&scene, &mirrored));
    assert_eq!(a.subarrays[0].mu[0], -b.subarrays[0].mu[0]);
    for k in 0..100 {
        let off = a.forces_N.fx[k] + b.forces_N.fx[k - k % 10 + 9 - k % 10];
        // The same sums in another order.
        assert!(off.abs() < 1e-13 * a.resultant_N[2]);
    }
}

#[test]
fn no_stress_is_no_contact() {
    let mut frame = hertz();
    frame.stress_MPa.fill(0.0);
    let result = run(&scene(), &frame);
    assert_eq!(result.forces_N, Forces::zeros(100));
    assert_eq!(result.flags, [Flag::NoContact, Flag::ConditionUnmet]);
    assert_eq!(result.subarrays[0].objective_value, None);
    assert_eq!(result.error.unwrap().normal, Some(1.0));
}

#[test]
fn pure_tension_is_no_compression() {
    let mut frame = hertz();
    frame.stress_MPa.iter_mut().for_each(|b| *b = -b.abs());
    let result = run(&scene(), &frame);
    assert!(result.flags.contains(&Flag::NoCompression), "{:?}", result.flags);
    assert_eq!(result.subarrays[0].mu, [0.0; 2]);
    assert!(result.resultant_N[2] < 0.0);
}

#[test]
fn unmet_condition_gives_normal_forces_only() {
    let mut scene = scene();
    scene.partition.condition = Condition::BothSigns;
    let mut frame = hertz();
    frame.stress_MPa.iter_mut().for_each(|b| *b = b.max(0.0));
    let result = run(&scene, &frame);
    assert_eq!(result.flags, [Flag::ConditionUnmet]);
    assert_eq!(result.resultant_N[..2], [0.0; 2]);
    assert!(result.resultant_N[2] > 4.0);
}

#[test]
fn threshold_drops_small_forces() {
    let mut scene = scene();
    scene.threshold.min_force_N = 0.01;
    let kept = run(&scene, &hertz());
    assert!(kept.forces_N.fz.iter().all(|&fz| fz == 0.0 || fz.abs() >= 0.01));
    assert!(kept.forces_N.fz.contains(&0.0));
    scene.threshold.min_force_N = 1e3;
    assert_eq!(run(&scene, &hertz()).flags, [Flag::NoContact]);
}

#[test]
fn a_mu_max_of_zero_asks_for_no_shear() {
    let mut scene = scene();
    scene.search.mu_max = 0.0;
    let result = run(&scene, &hertz());
    assert_eq!(result.resultant_N[..2], [0.0; 2]);
    assert!(result.error.unwrap().normal.unwrap() < NORMAL_EACH);
}

#[test]
fn a_mu_max_of_zero_is_no_search_in_both_models() {
    let mut scene = scene();
    scene.search.mu_max = 0.0;
    let mut frame = hertz();
    for sign in [1.0, -1.0] {
        frame.stress_MPa.iter_mut().for_each(|b| *b = sign * b.abs());
        let golden = run(&scene, &frame);
        let fixed = crate::fixed::Model::new(&scene).unwrap().reconstruct(&frame).unwrap();
        for result in [golden, fixed] {
            assert_eq!(result.subarrays[0].objective_value, None, "{}, sign {sign}", result.engine);
            assert!(!result.flags.contains(&Flag::NoCompression), "{}, sign {sign}", result.engine);
        }
    }
}

#[test]
fn extreme_stress_is_an_error_or_a_finite_result() {
    // With `adaptive` and `contacts` ellipses are fitted, whose sums of squares overflow first.
    for case in [Case::WHOLE, Case::Adaptive, Case::Contacts] {
        let mut scene = scene();
        scene.partition.case = case;
        let golden = Golden::reference(&scene).unwrap();
        for scale in [1e-300, 1e150, 1e300, 1e307, 1e308] {
            let mut frame = hertz();
            frame.stress_MPa.iter_mut().for_each(|b| *b *= scale);
            match golden.run(&frame) {
                Ok(result) => assert!(result.resultant_N.iter().all(|sum| sum.is_finite())),
                Err(error) => assert!(matches!(error, GoldenError::TooStrong { .. }), "{error}"),
            }
        }
    }
}

#[test]
fn frames_of_another_sensor_are_rejected() {
    let eight = Scene::builtin("eight-by-eight").unwrap();
    let other = Golden::reference(&eight).unwrap().run(&hertz());
    assert!(matches!(other, Err(GoldenError::Frame(_))));
}

#[test]
fn the_case_is_counted_from_the_subarrays() {
    let mut scene = scene();
    scene.partition.case = Case::numbered(2).unwrap();
    let parts = crate::spec::partition::subarrays(scene.partition.case, &scene.sensor).unwrap();
    let result = |part: &Subarray| SubarrayResult {
        row0: part.row0,
        col0: part.col0,
        rows: part.rows,
        cols: part.cols,
        centroid_condition: true,
        compression_centroid_mm: None,
        tension_centroid_mm: None,
        mu: [0.0; 2],
        mu_sigma: None,
        shear_sigma_N: None,
        normal_sigma_N: None,
        objective_value: None,
    };
    let results = parts.iter().map(result).collect();
    let flags = vec![Flag::Saturated, Flag::Saturated];
    let whole = assemble(&scene, &hertz(), "fixed", results, Forces::zeros(100), flags);
    assert_eq!(whole.case, Grid { rows: 1, cols: 2 });
    assert_eq!(whole.flags, [Flag::NoContact, Flag::Saturated]);
}

#[test]
fn subarrays_have_the_standard_deviation_of_their_shear() {
    let mut scene = scene();
    scene.partition.case = Case::numbered(2).unwrap();
    let parts = crate::spec::partition::subarrays(scene.partition.case, &scene.sensor).unwrap();
    let received = || SubarrayStats {
        max_code: 1,
        positive: true,
        negative: false,
        compression_centroid_mm: None,
        tension_centroid_mm: None,
        condition_met: true,
        loaded: true,
    };
    let result = |part: &Subarray| SubarrayResult::new(part, &received(), [0.3, 0.0], None);
    let mut results: Vec<SubarrayResult> = parts.iter().map(result).collect();
    results[1].mu_sigma = Some([0.25, 0.5]);
    let forces = Forces { fz: vec![2.0; 100], ..Forces::zeros(100) };
    let whole = assemble(&scene, &hertz(), "fixed", results, forces, Vec::new());
    let sigmas: Vec<_> = whole.subarrays.iter().map(|own| own.shear_sigma_N).collect();
    assert_eq!(sigmas, [None, Some([25.0, 50.0])]);
    assert!(!serde_json::to_string(&whole.subarrays[0]).unwrap().contains("sigma"));
}

/// A scene with several contacts, and a network that has hardly been trained for it.
fn with_network() -> &'static Scene {
    static TRAINED: OnceLock<(Scene, tempfile::NamedTempFile)> = OnceLock::new();
    let train = || {
        let text = "name = \"two\"\n[sensor]\nrows = 16\ncols = 16\npitch_x_mm = 3.0\npitch_y_mm = 3.0\n\
                    thickness_mm = 3.0\n[partition]\ncase = \"contacts\"\n[search]\nestimator = \"network\"\n";
        let training = Training { steps: 1200, batch: 48, contacts: 400, hidden: vec![32, 16], ..Default::default() };
        learned::with_network(Scene::parse(text, "two").unwrap(), &training).unwrap()
    };
    &TRAINED.get_or_init(train).0
}

/// With a network that has hardly been trained: contacts are told apart, their forces explain the stress, and the error of
/// each shear is below the shear.
#[test]
fn contacts_by_network_explain_the_stress() {
    let scene = with_network();
    let contact = |x: f64, shear: [f64; 2]| Contact {
        shape: Some("hertz-ellipse".to_string()),
        centre_mm: Some([x, 2.0]),
        size_mm: vec![6.0, 5.0, 0.0],
        normal_N: Some(4.0),
        tangential_N: Some(shear),
        ..Default::default()
    };
    let contacts = [contact(-11.0, [1.4, 0.0]), contact(11.0, [0.0, -1.2])];
    let frame = generate("two", &scene.sensor, scene.medium, &contacts).unwrap();
    let golden = Golden::new(scene).unwrap();
    let result = golden.run(&frame).unwrap();
    let regions = result.extra.regions.unwrap();
    assert_eq!((regions.len(), result.extra.sweeps), (2, Some(1)));
    for (region, truth) in regions.iter().zip([[1.4, 0.0], [0.0, -1.2]]) {
        let [x, y, normal] = region.load_N;
        let off = (x - truth[0]).hypot(y - truth[1]);
        assert!(off < 0.6 * truth[0].hypot(truth[1]) && (normal - 4.0).abs() < 0.2, "{:?}", region.load_N);
        let sigma = region.mu_sigma.unwrap();
        assert!(sigma.iter().all(|sigma| *sigma > 0.0 && *sigma < 0.5));
        assert_eq!(region.shear_sigma_N, Some(sigma.map(|sigma| sigma * normal)));
    }
    assert!(result.checks.shear_spread.is_some_and(|spread| spread > 0.0));
    let rest = residual(golden.matrices().unwrap(), &frame.stress_MPa, &result.forces_N);
    assert!(rest.iter().all(|rest| rest.abs() < 1e-4 * frame.peak_MPa()), "{rest:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    /// Whatever the stress: finite, shear in the stated ratio and within mu_max.
    #[test]
    fn any_stress_gives_forces_in_proportion(
        stress in proptest::collection::vec(-1.0f64..1.0, 64),
        exponent in -40i32..40,
    ) {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let stress = stress.iter().map(|b| b * 2f64.powi(exponent)).collect();
        let frame = Frame::from_stress("random", &scene.sensor, stress).unwrap();
        let result = run(&scene, &frame);
        let mu = result.subarrays[0].mu;
        prop_assert!(mu[0].hypot(mu[1]) <= scene.search.mu_max * (1.0 + f64::EPSILON));
        let Forces { fx, fy, fz } = &result.forces_N;
        for k in 0..64 {
            prop_assert!(fz[k].is_finite());
            prop_assert_eq!((fx[k], fy[k]), (mu[0] * fz[k], mu[1] * fz[k]));
        }
    }
}
