//! Both models check frames against a network's training, and the study counts what they flag.

use super::*;
use dermis_golden::data::frame::Frame;
use dermis_golden::data::generator::converter::Converter;
use dermis_golden::data::generator::draws::{ContactShape, DrawOptions, Draws};
use dermis_golden::estimate::float::Golden;
use dermis_golden::estimate::learned::{with_network, Learned, Training};
use dermis_golden::estimate::misfit::Misfit;
use dermis_golden::fixed::Model;
use dermis_golden::result::flags::Flag;
use dermis_golden::spec::scene::{EstimatorKind, ForceOutput, Scene};

/// A frame like the training of a network for `scene`, with 0.5 % of noise.
fn like(scene: &Scene, contacts: usize, number: u64) -> Frame {
    let shapes = ContactShape::NAMES.map(|(_, shape)| shape).to_vec();
    let converter = Converter { noise: 5e-3, unipolar: scene.input.unipolar, ..Default::default() };
    let options = DrawOptions { shapes, contacts, converter, seed: 31, ..Default::default() };
    let frame = Draws::new(scene, options).unwrap().frame(number).unwrap().frame;
    Frame::from_stress("like", &scene.sensor, frame.stress_MPa).unwrap()
}

/// The same with one row at the peak.
fn unlike(mut frame: Frame) -> Frame {
    let (peak, cols) = (frame.peak_MPa(), frame.sensor.cols);
    frame.stress_MPa[2 * cols..3 * cols].fill(peak);
    frame
}

/// The misfit by the golden model with the network, with the most probable forces, and by the model in integers; whether all
/// flag it.
fn misfits(scene: &Scene, frame: &Frame) -> ([f64; 3], bool) {
    let model = Model::without_fit_check(scene).unwrap().reconstruct(frame).unwrap();
    let golden = [Golden::reference(scene), Golden::new(scene)].map(|golden| golden.unwrap().run(frame).unwrap());
    let [network, learned] = golden;
    let all = [network, learned, model];
    let flagged = all.each_ref().map(|result| result.flags.contains(&Flag::Misfit));
    assert!(flagged == [flagged[0]; 3], "{}: {flagged:?}", frame.id);
    (all.map(|result| result.checks.network_misfit.unwrap()), flagged[0])
}

/// Both models flag a frame unlike the training, and none like it; with forces and with resultants.
#[test]
fn both_models_flag_what_is_unlike_the_training() {
    for (name, forces) in [("sensor-1-noisy", ForceOutput::Taxels), ("sensor-1-unipolar", ForceOutput::Resultants)] {
        let mut scene = Scene::builtin(name).unwrap();
        scene.output.forces = forces;
        for number in 0..6 {
            let frame = like(&scene, 1, number);
            let ([network, learned, fixed], flagged) = misfits(&scene, &frame);
            assert!(!flagged && network < 0.8, "{name} {number}: {network}");
            // μ is rounded to its LSB, and the most probable forces have that of the network: so near, as shares of the limit, that a
            // frame on one side of it is on no other side.
            for own in [learned, fixed] {
                assert!((own - network).abs() < 0.03, "{name} {number}: {network} {own}");
            }
            let (figures, flagged) = misfits(&scene, &unlike(frame));
            assert!(flagged && figures.iter().all(|misfit| *misfit > 1.0), "{name} {number}: {figures:?}");
        }
    }
}

/// The flag is that of the limit: with a larger one the same frame has none, without one nothing is checked.
#[test]
fn the_limit_of_the_file_decides() {
    let mut scene = Scene::builtin("sensor-1-noisy").unwrap().estimated_by(EstimatorKind::Network);
    let frame = unlike(like(&scene, 1, 0));
    let run = |scene: &Scene| Golden::new(scene).unwrap().run(&frame).unwrap();
    let own = run(&scene);
    let folder = tempfile::tempdir().unwrap();
    let (limit, path) = (Learned::misfit_limit(&scene).unwrap().unwrap(), folder.path().join("own.network"));
    std::fs::write(&path, Learned::with_misfit_limit(&scene, 100.0 * limit).unwrap()).unwrap();
    scene.search.network = Some(path);
    let other = run(&scene);
    assert_eq!([&own, &other].map(|result| result.flags.contains(&Flag::Misfit)), [true, false]);
    let [a, b] = [own, other].map(|result| result.checks.network_misfit.unwrap());
    assert!((a / b / 100.0 - 1.0).abs() < 1e-12, "{a} {b}");
    let (scene, _file) = with_network(scene, &Training::trial(&[8])).unwrap();
    assert_eq!(run(&scene).checks.network_misfit, None);
    let refused = unlike_study(&scene, 1, 1, &[Candidate::Scene], &|_, _| ()).unwrap_err().to_string();
    assert!(refused.starts_with("search.network = ") && refused.contains("--limit-of"), "{refused}");
}

/// A scene of 13 × 18 taxels with a small network for several contacts, and the limit measured for it.
fn several() -> (Scene, tempfile::NamedTempFile) {
    let sensor = "[sensor]\nrows = 13\ncols = 18\npitch_x_mm = 2\npitch_y_mm = 2.5\nthickness_mm = 2\n";
    let text = format!(
        "name = \"pad\"\n{sensor}[partition]\ncase = \"contacts\"\n[search]\nestimator = \"evidence+network\"\n"
    );
    let training = Training { steps: 200, contacts: 200, ..Training::trial(&[16, 8]) };
    let (scene, file) = with_network(Scene::parse(&text, "pad.toml").unwrap(), &training).unwrap();
    let limit = misfit_limit(&scene, 60, 1, &|_, _| ()).unwrap().unwrap();
    std::fs::write(file.path(), Learned::with_misfit_limit(&scene, limit).unwrap()).unwrap();
    (scene, file)
}

/// With several contacts each taxel has the μ of its contact; with records of contacts that of the nearest one.
#[test]
fn frames_of_several_contacts_are_checked() {
    let (scene, _file) = several();
    let mut with_records = scene.clone();
    with_records.output.forces = ForceOutput::Resultants;
    let with_records = Model::new(&with_records).unwrap();
    for number in 0..3 {
        let frame = like(&scene, 2, number);
        let ([network, _, fixed], flagged) = misfits(&scene, &frame);
        assert!(!flagged && (fixed / network - 1.0).abs() < 0.05, "{number}: {network} {fixed}");
        let records = with_records.reconstruct(&frame).unwrap();
        let of_taxels = Misfit::new(&scene, 1.0).mu_of_taxels(&records).unwrap();
        let of_regions: Vec<[f64; 2]> = records.extra.regions.iter().flatten().map(|region| region.mu).collect();
        assert!(of_regions.iter().all(|mu| *mu != [0.0; 2] && of_taxels.contains(mu)), "{number}: {of_regions:?}");
        assert!(of_taxels.iter().all(|mu| of_regions.contains(mu)), "{number}: {of_regions:?}");
        let (figures, flagged) = misfits(&scene, &unlike(frame));
        assert!(flagged, "{number}: {figures:?}");
    }
}

/// The study counts what the engines flag: none of the frames like the training, and all checkerboards.
#[test]
fn the_study_counts_flags() {
    let scene = Scene::builtin("sensor-1-noisy").unwrap();
    let estimators = [Candidate::Estimator(EstimatorKind::Network), Candidate::Hardware];
    let rows = unlike_study(&scene, 6, 3, &estimators, &|_, _| ()).unwrap();
    let of = |name: &'static str| rows.iter().filter(move |row| row.frame.starts_with(name));
    assert!(of("like the training").count() == 8 && of("checkerboard").count() == 4);
    for row in of("like the training") {
        assert!((row.flagged.value, row.flagged_if_stated.value) == (0.0, 0.0), "{row:?}");
    }
    for row in of("checkerboard").chain(of("taxels permuted")).chain(of("sign reversed")) {
        assert!(row.flagged.value == 1.0 && row.misfit.unwrap() > 1.0 && row.any.value == 1.0, "{row:?}");
    }
}
