//! Tables that are measured: what they serve, how often they hold on other frames, what is refused.

use super::*;
use dermis_golden::data::generator::converter::Converter;
use dermis_golden::data::generator::draws::Draws;
use dermis_golden::spec::partition::Case;
use dermis_golden::spec::scene::{ForceOutput, Medium};

/// max |b| of the frames in MPa.
const PEAK_MPA: f64 = 0.1;

fn searched(name: &str) -> Scene {
    Scene::builtin(name).unwrap().estimated_by(EstimatorKind::Search)
}

/// A scene whose case is chosen per frame has a table of its own, and so has one of several subarrays that sends records.
#[test]
fn chosen_cases_and_records_have_their_tables() {
    let folder = tempfile::tempdir().unwrap();
    for (case, forces) in [(Case::Adaptive, ForceOutput::Taxels), (Case::numbered(1).unwrap(), ForceOutput::Resultants)]
    {
        let mut scene = searched("eight-by-eight");
        (scene.search.noise_floor_MPa, scene.input.full_scale_MPa) = (Some(1e-4 * PEAK_MPA), Some(1.2 * PEAK_MPA));
        scene.partition.case = case;
        let path = folder.path().join("t.deviations");
        std::fs::write(&path, measure_deviations(&scene, 60, 1, &|_, _| ()).unwrap().to_text()).unwrap();
        scene.search.deviations = Some(path);
        scene.output.forces = forces;
        let converter = Converter { noise: 1e-4, seed: 5, ..Default::default() };
        let options = DrawOptions { peak_MPa: Some(PEAK_MPA), converter, seed: 91, ..Default::default() };
        let own = Draws::new(&scene, options).unwrap().frame(4).unwrap().frame;
        let result = Model::new(&scene).unwrap().reconstruct(&own).unwrap();
        let searched = |own: &&dermis_golden::result::reconstruct::SubarrayResult| own.objective_value.is_some();
        assert!(result
            .subarrays
            .iter()
            .filter(searched)
            .any(|own| own.normal_sigma_N.is_some_and(|sigma| sigma > 0.0)));
        assert!(result.checks.shear_spread.is_some(), "{case}");
    }
}

/// One standard deviation covers 55 to 80 % of the errors of other frames, at levels between the table's; a third of it does
/// not.
#[test]
fn one_standard_deviation_covers_two_thirds_of_the_errors() {
    let levels = [2e-6, 5e-5, 6e-4, 2e-2];
    for (name, draws) in [("eight-by-eight", 300), ("sensor-1", 300), ("sensor-2", 300), ("sensor-3", 100)] {
        let scene = searched(name);
        let mut table = Deviations::of_scene(&scene, scene.model_estimator()).unwrap().unwrap();
        let covered =
            |table: &Deviations| deviations_coverage(&scene, table, &levels, [draws, 77], &|_, _| ()).unwrap();
        for (level, shares) in levels.iter().zip(covered(&table)) {
            assert!(shares.iter().all(|share| (0.55..=0.8).contains(share)), "{name} {level}: {shares:?}");
        }
        table.sigma.iter_mut().flatten().for_each(|own| *own = own.map(|sigma| sigma / 3.0));
        assert!(covered(&table).iter().flatten().all(|share| *share < 0.5), "{name}");
    }
}

#[test]
fn a_table_is_measured_again_from_its_seed() {
    let scene = searched("eight-by-eight");
    let measured = |seed| measure_deviations(&scene, 100, seed, &|_, _| ()).unwrap();
    assert_eq!(measured(3), measured(3));
    assert_ne!(measured(3), measured(4));
    let mut contacts = scene.clone();
    contacts.partition.case = Case::Contacts;
    let error = measure_deviations(&contacts, 100, 1, &|_, _| ()).unwrap_err().to_string();
    assert!(error.contains("one that is searched"), "{error}");
    // A medium without hardware is measured by the golden model.
    let bonded = Scene { medium: Medium::BondedLayer { poisson: 0.48 }, ..scene.clone() };
    assert!(measure_deviations(&bonded, 40, 1, &|_, _| ()).is_ok());
    // The same for one that no board holds; few frames leave classes without errors.
    let mut large = scene;
    large.hardware.board = Some("icebreaker".into());
    (large.sensor.rows, large.sensor.cols) = (12, 12);
    assert!(Model::new(&large).is_err() && measure_deviations(&large, 40, 1, &|_, _| ()).is_ok());
    let error = measure_deviations(&large, 2, 1, &|_, _| ()).unwrap_err().to_string();
    assert!(error.contains("at a noise of"), "{error}");
}
