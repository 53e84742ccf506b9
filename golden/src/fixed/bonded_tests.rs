//! The bit-true model on bonded layers: whatever the half-space has, for every Poisson ratio of an elastomer.

use super::stages::load::Outcome;
use super::Model;
use crate::data::frame::Frame;
use crate::estimate::float::Golden;
use crate::estimate::learned::{with_network, Training};
use crate::result::flags::Flag;
use crate::spec::scene::{EstimatorKind, Medium, Scene};

const ARRAY: &str = "[sensor]\nrows = 8\ncols = 8\npitch_x_mm = 4.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n";

fn bonded(text: &str) -> Scene {
    let medium = "[medium]\nkind = \"bonded-layer\"\npoisson = 0.48\n";
    Scene::parse(&format!("name = \"layer\"\n{ARRAY}{medium}{text}"), "layer").unwrap()
}

/// Compressible to almost incompressible rubber: the inverse is better conditioned than that of the half-space, the series has
/// the same degree, and one that is too slow names the field with a value that works.
#[test]
fn every_ratio_of_an_elastomer_has_hardware() {
    for name in ["sensor-1", "eight-by-eight"] {
        let half_space = Scene::builtin(name).unwrap();
        let condition = |scene: &Scene| Golden::reference(scene).unwrap().matrices().unwrap().condition;
        let degree = Model::new(&half_space).unwrap().formats().degree;
        for poisson in [0.3, 0.4, 0.45, 0.48, 0.49, 0.499] {
            let mut scene = Scene { medium: Medium::BondedLayer { poisson }, ..half_space.clone() };
            scene.search.network = None;
            assert!(condition(&scene) < 0.65 * condition(&half_space), "{name}, {poisson}");
            assert_eq!(Model::new(&scene).unwrap().formats().degree, degree, "{name}, {poisson}");
            // Ten taxels along both sides, twice as fine.
            (scene.sensor.rows, scene.sensor.cols) = (10, 10);
            (scene.sensor.pitch_x_mm, scene.sensor.pitch_y_mm) = (2.0, 2.0);
            let Err(refused) = Model::new(&scene) else { panic!("{name}, {poisson}: a series of degree 3") };
            let refused = refused.to_string();
            assert!(refused.contains("r = 0.4") && refused.contains("use search.mu_max = 0.5"), "{refused}");
            let suggested = refused.split("search.mu_max = ").nth(1).unwrap().split(' ').next().unwrap();
            scene.search.mu_max = suggested.parse().unwrap();
            assert!(Model::new(&scene).is_ok(), "{name}, {poisson}: {suggested}");
        }
    }
}

/// Both boards' engines, partitions, outputs, and what tables hold: within a hundredth of the search in floating point, on the
/// same codes within rounding.
#[test]
fn every_partition_and_output_reads_the_layer() {
    let cover = "[input]\nfull_scale_MPa = 1.0\n[hardware]\ntables = \"writable\"\n[hardware.table_range]\n";
    let network = "[hardware]\nestimator = \"network\"\n";
    let scenes = [
        (String::new(), true),
        ("[partition]\ncase = 2\n".to_owned(), true),
        ("[partition]\ncases = [0, 1]\n".to_owned(), true),
        ("[hardware]\nboard = \"icebreaker\"\n".to_owned(), true),
        ("[output]\nforces = \"resultants\"\n".to_owned(), true),
        ("[input]\ndead = [[3, 4]]\n".to_owned(), true),
        (format!("{cover}thickness_mm = [2.5, 3.5]\ndead_taxels = 1\n"), true),
        (network.to_owned(), false),
        (format!("[partition]\ncase = \"contacts\"\n{network}"), false),
    ];
    for (text, searched) in scenes {
        let scene = bonded(&text);
        let (scene, _file) = match searched {
            true => (scene, None),
            false => with_network(scene, &Training::trial(&[8])).map(|(scene, file)| (scene, Some(file))).unwrap(),
        };
        let frame = Frame::shipped(&scene).into_iter().find(|frame| frame.id == "S8-bl48-rect").unwrap();
        let model = Model::new(&scene).unwrap();
        let fixed = model.reconstruct(&frame).unwrap();
        let golden = Golden::with(&scene, scene.hardware_estimator()).unwrap().run(&frame).unwrap();
        let off = (0..3).map(|axis| (fixed.resultant_N[axis] - golden.resultant_N[axis]).abs()).fold(0.0, f64::max);
        assert!(off < 0.12, "{text}: {:?} {:?}", fixed.resultant_N, golden.resultant_N);
        assert!(!fixed.flags.contains(&Flag::MediumMismatch));
    }
}

/// A frame of the other medium, and a specimen of the other medium, are refused or flagged.
#[test]
fn the_other_medium_is_found() {
    let text = "[input]\nfull_scale_MPa = 1.0\n[hardware]\ntables = \"writable\"\n";
    let own = bonded(text);
    let other = Scene { medium: Medium::HalfSpace, ..own.clone() };
    let [mut layer, half_space] = [&own, &other].map(|scene| Model::new(scene).unwrap());
    let error = layer.with_tables(&other, 1).unwrap_err().to_string();
    assert!(error.starts_with("medium: differs from that of the hardware's scene"), "{error}");
    assert_eq!(layer.load(&half_space.with_tables(&other, 1).unwrap().image()), Outcome::Refused);
    assert_eq!(layer.load(&layer.with_tables(&own, 1).unwrap().image()), Outcome::Whole);
    let frame = Frame::shipped(&other).remove(0);
    assert!(layer.reconstruct(&frame).unwrap().flags.contains(&Flag::MediumMismatch));
}

/// Contacts wider than the array, whose shear no estimator finds, have flags; by the network and by the search.
#[test]
fn a_contact_wider_than_the_array_is_flagged() {
    let own = Scene::builtin("eight-by-eight-bonded").unwrap();
    let mut searched = own.estimated_by(EstimatorKind::Search);
    searched.hardware.estimator = None;
    for (scene, estimator) in [(own, EstimatorKind::Network), (searched, EstimatorKind::Search)] {
        assert_eq!(scene.hardware_estimator(), estimator);
        let frame = Frame::shipped(&scene).into_iter().find(|frame| frame.id == "S8-bl48-cover").unwrap();
        let golden = Golden::new(&scene).unwrap().run(&frame).unwrap();
        for result in [golden, Model::new(&scene).unwrap().reconstruct(&frame).unwrap()] {
            assert!(result.error.unwrap().tangential.unwrap() > 0.5, "{estimator:?}, {}", result.engine);
            assert!(result.flags.contains(&Flag::LoadOutside), "{estimator:?}, {}: {:?}", result.engine, result.flags);
        }
    }
}
