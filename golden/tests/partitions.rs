//! Accuracy of the partition cases on the shipped half-space frames with known forces.

use dermis_golden::data::frame::Frame;
use dermis_golden::estimate::float::Golden;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::partition::{Case, Grid};
use dermis_golden::spec::scene::{Condition, Form, Scene};

const SENSORS: [&str; 3] = ["sensor-1", "sensor-2", "sensor-3"];

fn scene(sensor: &str, case: Case) -> Scene {
    let mut scene = Scene::builtin(sensor).unwrap();
    scene.partition.case = case;
    scene
}

fn run(scene: &Scene, frames: &[Frame]) -> Vec<Reconstruction> {
    let golden = Golden::reference(scene).unwrap();
    frames.iter().map(|frame| golden.run(frame).unwrap()).collect()
}

fn shipped(sensor: &str, contacts: impl Fn(usize) -> bool) -> Vec<Frame> {
    let frames = Frame::shipped(&Scene::builtin(sensor).unwrap()).into_iter();
    frames.filter(|frame| contacts(frame.contacts.len())).collect()
}

/// The quantile `share` (0 to 1) of the values, by the next rank.
fn quantile(values: impl IntoIterator<Item = f64>, share: f64) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    values[((values.len() as f64 * share).ceil() as usize).clamp(1, values.len()) - 1]
}

fn tangential(results: &[Reconstruction]) -> Vec<f64> {
    results.iter().filter_map(|result| result.error?.tangential).collect()
}

fn normal(results: &[Reconstruction]) -> Vec<f64> {
    results.iter().filter_map(|result| result.error?.normal).collect()
}

fn length([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}

#[test]
fn single_contacts_meet_their_targets() {
    for (sensor, normal_median) in SENSORS.into_iter().zip([0.005, 0.01, 0.005]) {
        let results = run(&scene(sensor, Case::WHOLE), &shipped(sensor, |contacts| contacts == 1));
        let (t, n) = (tangential(&results), normal(&results));
        assert!(quantile(t.clone(), 0.5) <= 0.02 && quantile(t.clone(), 0.9) <= 0.06, "{sensor}: {t:?}");
        assert!(quantile(n.clone(), 0.5) <= normal_median, "{sensor}: {n:?}");
    }
}

#[test]
fn each_axis_is_below_the_papers_table_2() {
    // Case 0 of the table; its 1 % for X3 of sensor 2 is the bound there.
    for (sensor, bounds) in [("sensor-1", [0.1284, 0.1293, 0.0754]), ("sensor-2", [0.39, 0.16, 0.01])] {
        let results = run(&scene(sensor, Case::WHOLE), &shipped(sensor, |contacts| contacts == 1));
        let errors: Vec<_> = results.iter().filter_map(|result| result.error).collect();
        let axes = [0, 1, 2].map(|k| quantile(errors.iter().filter_map(|e| [e.x1, e.x2, e.x3][k]).map(f64::abs), 0.5));
        assert!(axes.iter().zip(bounds).all(|(axis, bound)| *axis < bound), "{sensor}: {axes:?}");
    }
}

#[test]
fn contacts_tell_contacts_apart() {
    let frames = shipped("sensor-3", |contacts| contacts > 1);
    let results = run(&scene("sensor-3", Case::Contacts), &frames);
    let (mut whole, mut own) = (Vec::new(), Vec::new());
    for (frame, result) in frames.iter().zip(&results) {
        let shear = |contact: &dermis_golden::data::frame::Contact| contact.tangential_N.unwrap();
        let total: f64 = frame.contacts.iter().map(|contact| length(shear(contact))).sum();
        let truth = frame.resultant_N.unwrap();
        whole.push(length([result.resultant_N[0] - truth[0], result.resultant_N[1] - truth[1]]) / total);
        let regions = result.extra.regions.as_ref().unwrap();
        assert_eq!(regions.len(), frame.contacts.len(), "{}", frame.id);
        assert_eq!(regions.iter().map(|region| region.taxels.len()).sum::<usize>(), 400);
        for contact in &frame.contacts {
            let centre = contact.centre_mm.unwrap();
            let distance = |at: [f64; 2]| length([at[0] - centre[0], at[1] - centre[1]]);
            let of = |k: usize| regions[k].centre_mm.map_or(f64::INFINITY, distance);
            let nearest = (0..regions.len()).min_by(|&a, &b| of(a).total_cmp(&of(b))).unwrap();
            let load = regions[nearest].load_N;
            let t = shear(contact);
            own.push(length([load[0] - t[0], load[1] - t[1]]) / length(t));
        }
    }
    assert!(quantile(whole.clone(), 0.5) <= 0.05 && quantile(whole.clone(), 0.9) <= 0.15, "{whole:?}");
    assert!(quantile(own.clone(), 0.5) <= 0.10, "{own:?}");
}

#[test]
fn one_contact_is_the_plain_method() {
    for sensor in SENSORS {
        let frames = shipped(sensor, |contacts| contacts == 1);
        let (plain, contacts) =
            (run(&scene(sensor, Case::WHOLE), &frames), run(&scene(sensor, Case::Contacts), &frames));
        for (plain, contacts) in plain.iter().zip(&contacts) {
            assert_eq!(plain.forces_N, contacts.forces_N, "{}", plain.frame);
        }
    }
}

#[test]
fn adaptive_is_next_to_the_best_case() {
    for sensor in SENSORS {
        let frames = shipped(sensor, |_| true);
        let median = |case: Case| quantile(tangential(&run(&scene(sensor, case), &frames)), 0.5);
        let best = (0..4).filter_map(Case::numbered).map(median).fold(f64::INFINITY, f64::min);
        let adaptive = median(Case::Adaptive);
        assert!(adaptive <= best + 0.02, "{sensor}: {adaptive} {best}");
    }
}

#[test]
fn adaptive_says_what_it_took_and_why() {
    let frames = shipped("sensor-3", |_| true);
    for result in run(&scene("sensor-3", Case::Adaptive), &frames) {
        let taken = result.extra.taken.as_ref().unwrap();
        let cases = ["1", "2", "3", "0"];
        let place = cases.iter().position(|case| *case == taken.case).unwrap();
        let refused: Vec<&str> = taken.refused.iter().map(|refused| refused.case.as_str()).collect();
        assert_eq!(refused, cases[..place]);
        let json = serde_json::to_string(&result).unwrap();
        assert!(json.contains(&format!("\"taken\":{{\"case\":\"{}\",\"reason\":\"", taken.case)));
        assert_eq!(serde_json::from_str::<Reconstruction>(&json).unwrap(), result);
    }
    // With the paper's condition a subarray without tension rules out a case.
    let mut both = scene("sensor-3", Case::Adaptive);
    both.partition.condition = Condition::BothSigns;
    let mut frame = frames[0].clone();
    frame.stress_MPa.iter_mut().for_each(|b| *b = b.max(0.0));
    let taken = run(&both, &[frame]).remove(0).extra.taken.unwrap();
    assert_eq!((taken.case.as_str(), taken.refused.len()), ("0", 3));
}

#[test]
fn any_grid_that_divides_and_both_forms() {
    for (rows, cols) in [(1, 1), (2, 2), (5, 2), (4, 1), (10, 10)] {
        let mut scene = scene("sensor-3", Case::Grid(Grid { rows, cols }));
        let frames = &shipped("sensor-3", |_| true)[..1];
        let oblique = run(&scene, frames).remove(0);
        assert_eq!((oblique.case, oblique.subarrays.len()), (Grid { rows, cols }, rows * cols));
        assert_eq!(oblique.extra.truncation, None);
        scene.search.form = Form::Orthogonal;
        let orthogonal = run(&scene, frames).remove(0);
        let truncation = orthogonal.extra.truncation.unwrap();
        assert_eq!(truncation.len(), rows * cols);
        // r is 0.42 at mu_max: the remainder at degree 3 is at most r^4/(1 − r) = 5 % there.
        assert!(truncation.iter().all(|share| (0.0..0.06).contains(share)), "{rows}×{cols}: {truncation:?}");
    }
}

#[test]
fn sensor_4_in_four_parts_is_next_to_the_whole() {
    let frames = shipped("sensor-4", |_| true);
    assert!(!frames.is_empty());
    let four = run(&Scene::builtin("sensor-4").unwrap(), &frames);
    for (result, frame) in four.iter().zip(&frames) {
        assert_eq!(result.case, Grid { rows: 2, cols: 2 });
        // A cell is nine times wider than the cover is thick: in the worst frame 6 % of the load is not measured.
        assert!(result.error.unwrap().normal.unwrap() < 0.07, "{}: {:?}", frame.id, result.error);
    }
}
