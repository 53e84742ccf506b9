use super::*;
use crate::data::generator::draws::{DrawOptions, Draws};
use crate::estimate::float::Golden;
use crate::spec::partition::Case;
use crate::spec::scene::EstimatorKind;
use crate::spec::window::{Place, Window};
use std::ops::ControlFlow::{Break, Continue};

fn scene(name: &str) -> Scene {
    let mut scene = Scene::builtin(name).unwrap();
    scene.search.estimator = Some(EstimatorKind::EvidenceNetwork);
    scene
}

fn small(steps: usize) -> Training {
    Training { steps, batch: 128, contacts: 40.max(2 * steps), hidden: vec![24, 12], ..Default::default() }
}

fn trained(scene: &Scene, steps: usize) -> Trained {
    Learned::train(scene, &small(steps), &mut |_| Continue(())).unwrap()
}

fn evaluate(learned: &Learned, b: &[f64], alive: &[bool], centre_mm: [f64; 2]) -> Gaussian {
    learned.shear(&OneContact { b, alive, centre_mm })
}

fn near(a: Gaussian, b: Gaussian, sign: [f64; 2]) -> bool {
    (0..2).all(|k| (a.mean[k] - sign[k] * b.mean[k]).abs() < 1e-4 && (a.sigma[k] - b.sigma[k]).abs() < 1e-4)
}

/// A network of seconds: the loss falls, and on fresh frames the shear is better than none.
#[test]
fn a_small_network_learns() {
    let scene = scene("sensor-1");
    let training = Training { rate: 5e-3, contacts: 1500, ..small(1000) };
    let Trained { learned, loss: [first, last], bytes, .. } =
        Learned::train(&scene, &training, &mut |_| Continue(())).unwrap();
    assert!(last < first - 0.8, "loss {first} {last}");
    assert!(bytes.len() < 2 * learned.weights(), "{} bytes", bytes.len());
    let draws = Draws::new(&scene, DrawOptions { seed: 77, ..Default::default() }).unwrap();
    let mut errors: Vec<f64> = Vec::new();
    for number in 0..60 {
        let drawn = draws.frame(number).unwrap();
        let found = evaluate(&learned, &drawn.exact_MPa, &[true; 100], [0.0; 2]);
        let [x, y, normal] = drawn.total_N;
        let off = [0, 1].map(|axis| found.mean[axis] - [x, y][axis] / normal);
        errors.push(off[0].hypot(off[1]) * normal / x.hypot(y));
    }
    errors.sort_by(f64::total_cmp);
    assert!(errors[30] < 0.7 && errors[48] < 1.0, "median {}, four of five {}", errors[30], errors[48]);
}

#[test]
fn equal_seeds_give_equal_files() {
    let scene = scene("eight-by-eight");
    let bytes =
        |seed: u64| Learned::train(&scene, &Training { seed, ..small(3) }, &mut |_| Continue(())).unwrap().bytes;
    assert_eq!(bytes(1), bytes(1));
    assert_ne!(bytes(1), bytes(2));
}

/// A training that is ended early gives the network so far, and its number of steps.
#[test]
fn an_ended_training_gives_its_network() {
    let scene = scene("sensor-1");
    let mut stages = Vec::new();
    let Trained { learned, steps, .. } = Learned::train(&scene, &small(100), &mut |stage| {
        stages.push(*stage);
        if stage.steps < 40 {
            Continue(())
        } else {
            Break(())
        }
    })
    .unwrap();
    assert_eq!((steps, stages.len()), (40, 2));
    assert!(stages.iter().all(|stage| stage.done < 0.4 && stage.loss.is_finite()));
    assert!(evaluate(&learned, &vec![0.1; 100], &[true; 100], [0.0; 2]).sigma.iter().all(|sigma| *sigma > 0.0));
    // So much time is over after the first step.
    let brief = Training { minutes: Some(1e-9), ..small(100) };
    assert_eq!(Learned::train(&scene, &brief, &mut |_| Continue(())).unwrap().steps, 1);
}

/// Covers within the tolerances are drawn, and what is trained on them differs.
#[test]
fn tolerances_are_trained() {
    let scene = scene("eight-by-eight-bonded");
    let bytes = |poisson_tolerance: f64, thickness_tolerance: f64| {
        let training = Training { poisson_tolerance, thickness_tolerance, ..small(3) };
        Learned::train(&scene, &training, &mut |_| Continue(())).unwrap().bytes
    };
    let exact = bytes(0.0, 0.0);
    assert!(exact != bytes(0.02, 0.0) && exact != bytes(0.0, 0.05));
}

/// A network for a range is read for any sensor in it, and differs between sensors; equal seeds give equal files here too.
#[test]
fn a_range_is_trained_and_read_for_each_sensor() {
    let scene = scene("eight-by-eight-bonded");
    let training = Training { pitch_over_thickness: Some([1.0, 2.0]), contacts: 200, ..small(4) };
    let train = || Learned::train(&scene, &training, &mut |_| Continue(())).unwrap();
    let Trained { learned, bytes, .. } = train();
    assert_eq!(bytes, train().bytes);
    assert_eq!(learned.weights(), trained(&scene, 1).learned.weights());
    let read = |scene: &Scene| Learned::from_bytes(scene, EstimatorKind::Network, &bytes, "n");
    let sensors = learned.signature().cover.scenes(&scene, 3);
    let b: Vec<f64> = (0..64).map(|taxel| f64::from(taxel % 7) - 1.0).collect();
    let found: Vec<Gaussian> =
        sensors.iter().map(|scene| evaluate(&read(scene).unwrap(), &b, &[true; 64], [0.0; 2])).collect();
    assert!(found[0] != found[1] && found[1] != found[2]);
    let mut finer = scene.clone();
    finer.sensor.pitch_x_mm = 2.9;
    assert!(matches!(read(&finer), Err(LearnedError::Mismatch { field: "sensor.pitch_x_mm", .. })));
}

/// Load, mirror image and dead taxels: what cannot matter does not.
#[test]
fn answers_follow_the_symmetries() {
    let scene = scene("sensor-1");
    let learned = trained(&scene, 60).learned;
    let drawn = Draws::new(&scene, DrawOptions::default()).unwrap().frame(4).unwrap();
    let b = &drawn.exact_MPa;
    let found = evaluate(&learned, b, &[true; 100], [0.0; 2]);
    assert!(found.mean.iter().all(|mu| mu.abs() > 1e-3), "{found:?}");
    let heavy: Vec<f64> = b.iter().map(|b| 8.0 * b).collect();
    assert!(near(found, evaluate(&learned, &heavy, &[true; 100], [0.0; 2]), [1.0; 2]));
    let quads = learned.signature.window.quads();
    for across in 0..4 {
        let image = |t: usize| {
            let at = quads.locate(t / 10, t % 10);
            b[quads.taxel(at.address, at.lane ^ across)]
        };
        let image: Vec<f64> = (0..100).map(image).collect();
        let sign = [1, 2].map(|axis| if across & axis != 0 { -1.0 } else { 1.0 });
        assert!(near(evaluate(&learned, &image, &[true; 100], [0.0; 2]), found, sign), "{across}");
    }
    let mut alive = vec![true; 100];
    alive[44] = false;
    let mut stuck = b.clone();
    stuck[44] = 9.0;
    assert_eq!(evaluate(&learned, b, &alive, [0.0; 2]), evaluate(&learned, &stuck, &alive, [0.0; 2]));
}

/// Where a network alone gives the μ of each contact, it has a window around each also on a small array; one that reads the
/// whole array would give all of them the same μ. `evidence` with a network, which takes the others out, takes either.
#[test]
fn several_contacts_need_a_window_around_each() {
    let mut scene = scene("sensor-1");
    let whole = trained(&scene, 10).bytes;
    scene.partition.case = Case::Contacts;
    let Trained { learned, bytes, .. } = trained(&scene, 10);
    assert_eq!(learned.signature.window, Window { place: Place::Contact, rows: 9, cols: 11 });
    let fits =
        |scene: &Scene, bytes: &[u8]| Learned::from_bytes(scene, scene.model_estimator(), bytes, "n").map(|_| ());
    assert!(fits(&scene, &whole).is_ok() && fits(&scene, &bytes).is_ok());
    scene.search.estimator = Some(EstimatorKind::Network);
    assert!(fits(&scene, &bytes).is_ok());
    let error = fits(&scene, &whole).unwrap_err();
    assert!(matches!(&error, LearnedError::Mismatch { field: "sensor.rows and cols", .. }), "{error}");
}

/// On a small array four contacts do not always fit; then fewer are drawn.
#[test]
fn as_many_contacts_are_drawn_as_fit() {
    let mut scene = scene("sensor-1");
    scene.partition.case = Case::Contacts;
    let options = DrawOptions { contacts: 4, seed: 1, ..Default::default() };
    let draws = Draws::new(&scene, options).unwrap();
    assert!((0..15).any(|frame| draws.contacts(4 * frame + 3).is_err()));
    let training = Training { contacts: 60, seed: 1, ..small(2) };
    assert!(Learned::train(&scene, &training, &mut |_| Continue(())).is_ok());
}

/// A network for windows serves every place, and every array of that pitch.
#[test]
fn a_window_moves_with_its_contact() {
    let scene = scene("sensor-3");
    let Trained { learned, bytes, .. } = trained(&scene, 10);
    assert_eq!(learned.signature.window, Window { place: Place::Contact, rows: 9, cols: 11 });
    let mut larger = scene.clone();
    (larger.sensor.rows, larger.sensor.cols) = (24, 22);
    let other = Learned::from_bytes(&larger, EstimatorKind::Network, &bytes, "n").unwrap();
    let stress = |cols: usize, at: [usize; 2]| {
        let mut b = vec![0.0; 24 * 22];
        for (k, value) in [0.2, 1.0, 0.3, 0.1, 0.7, -0.2].iter().enumerate() {
            b[(at[0] + k / 3) * cols + at[1] + k % 3] = *value;
        }
        b
    };
    let alive = vec![true; 24 * 22];
    let at = |learned: &Learned, cols: usize, place: [usize; 2]| {
        let [row, col] = place;
        let centre = learned.sensor.position_mm(row, col + 1);
        evaluate(learned, &stress(cols, place), &alive, centre)
    };
    let first = at(&learned, 20, [8, 8]);
    assert_eq!(first, at(&learned, 20, [10, 9]));
    assert_eq!(first, at(&other, 22, [11, 12]));
    // Half of the window is beyond the edge.
    assert_ne!(first, at(&learned, 20, [0, 0]));
}

#[test]
fn what_cannot_be_used_is_named() {
    let message = |scene: &Scene| match Golden::new(scene) {
        Err(error) => error.to_string(),
        Ok(_) => String::new(),
    };
    let mut scene = scene("sensor-1");
    scene.search.network = None;
    assert!(message(&scene).contains("search.network is missing"), "{}", message(&scene));
    scene.search.network = Some("nowhere/none.network".into());
    assert!(message(&scene).starts_with("nowhere/none.network: search.network cannot be read"), "{}", message(&scene));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("own.network");
    std::fs::write(&path, trained(&scene, 2).bytes).unwrap();
    scene.search.network = Some(path.clone());
    assert_eq!(message(&scene), "");
    scene.input.unipolar = true;
    assert!(message(&scene).contains("input.unipolar = false, the scene has true"), "{}", message(&scene));
    scene.search.estimator = None;
    assert_eq!(message(&scene), "");
    scene.search.estimator = Some(EstimatorKind::EvidenceNetwork);
    scene.input.unipolar = false;
    scene.partition.case = crate::spec::partition::Case::numbered(1).unwrap();
    assert!(message(&scene).contains("partition.case"), "{}", message(&scene));
    scene.partition.case = crate::spec::partition::Case::WHOLE;
    std::fs::write(&path, b"dermis network 1\n").unwrap();
    assert!(message(&scene).contains("not a network of this version"), "{}", message(&scene));
}

/// In words the network gives nearly the same μ, σ and forces as the golden model with the same estimator.
#[test]
fn in_words_the_network_is_nearly_the_same() {
    let scene = scene("sensor-1");
    let (model, golden) = (crate::fixed::Model::new(&scene).unwrap(), Golden::reference(&scene).unwrap());
    let draws = Draws::new(&scene, DrawOptions { seed: 78, ..Default::default() }).unwrap();
    let mut differences: Vec<f64> = Vec::new();
    for number in 0..40 {
        let frame = draws.frame(number).unwrap().frame;
        let (float, fixed) = (golden.run(&frame).unwrap(), model.reconstruct(&frame).unwrap());
        let [mu, own] = [&float, &fixed].map(|result| result.subarrays[0].mu);
        differences.push((mu[0] - own[0]).hypot(mu[1] - own[1]));
        let [normal, own] = [&float, &fixed].map(|result| result.resultant_N[2]);
        assert!((own / normal - 1.0).abs() < 2e-3, "{number}: {normal} {own}");
        let [spread, own] = [&float, &fixed].map(|result| result.checks.shear_spread.unwrap());
        assert!((own / spread - 1.0).abs() < 0.3, "{number}: {spread} {own}");
        assert_eq!(float.flags, fixed.flags, "{number}");
    }
    differences.sort_by(f64::total_cmp);
    assert!(
        differences[20] < 0.01 && differences[39] < 0.04,
        "median {}, largest {}",
        differences[20],
        differences[39]
    );
}
