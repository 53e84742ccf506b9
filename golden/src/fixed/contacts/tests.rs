use crate::data::frame::Frame;
use crate::data::generator::draws::{DrawOptions, Draws};
use crate::estimate::float::Golden;
use crate::estimate::learned::{with_network, Learned, OneContact, Training};
use crate::fixed::stages::receive::mask;
use crate::fixed::stages::send::{Status, STATUS_BEATS};
use crate::fixed::subarray::SubarrayTrace;
use crate::fixed::words::formats::MU_STEPS;
use crate::fixed::Model;
use crate::result::flags::Flag;
use crate::result::reconstruct::{Reconstruction, Region};
use crate::spec::scene::{ForceOutput, Scene};
use tempfile::NamedTempFile;

/// A scene of 13 × 18 taxels with a network of a few steps: as good as any to compare the models.
fn scene(more: &str, partition: &str) -> (Scene, NamedTempFile) {
    let sensor = "[sensor]\nrows = 13\ncols = 18\npitch_x_mm = 2\npitch_y_mm = 2.5\nthickness_mm = 2\n";
    let text = format!(
        "name = \"pad\"\n{sensor}[partition]\ncase = \"contacts\"\n{partition}[search]\nestimator = \"evidence+network\"\n{more}"
    );
    let training = Training { steps: 30, contacts: 60, ..Training::trial(&[16, 8]) };
    with_network(Scene::parse(&text, "pad.toml").unwrap(), &training).unwrap()
}

/// The contacts by their load in the golden model.
fn by_load(result: &Reconstruction) -> Vec<&Region> {
    let mut regions: Vec<&Region> = result.extra.regions.iter().flatten().collect();
    regions.sort_by(|a, b| b.load_N[2].total_cmp(&a.load_N[2]));
    regions
}

/// The contact with the most taxels in common.
fn twin<'a>(region: &Region, of: &'a Reconstruction) -> &'a Region {
    let common = |other: &&Region| other.taxels.iter().filter(|taxel| region.taxels.contains(taxel)).count();
    of.extra.regions.iter().flatten().max_by_key(common).unwrap()
}

/// Every contact has the μ and σ that the network gives for the window around its middle, up to rounding.
#[test]
fn a_contact_has_what_the_network_says_of_its_window() {
    let (scene, _file) = scene("[input]\ndead = [[4, 9], [12, 0]]\n", "");
    let model = Model::without_fit_check(&scene).unwrap();
    let (network, alive) = (
        Learned::of_scene(&scene, crate::spec::scene::EstimatorKind::Network).unwrap(),
        scene.input.alive(&scene.sensor),
    );
    let draws = Draws::new(&scene, DrawOptions { contacts: 2, seed: 9, ..Default::default() }).unwrap();
    let mut asked = 0;
    for number in 0..8 {
        let frame = draws.frame(number).unwrap().frame;
        let codes = mask(&model.codes(&frame).unwrap().codes, &model.dead, false);
        let stress: Vec<f64> = codes.iter().map(|code| f64::from(*code)).collect();
        let contacts = SubarrayTrace::new(&model, model.first(), &codes).contacts.unwrap();
        for contact in contacts.all {
            let [row, col] = contact.middle;
            let centre_mm = scene.sensor.position_mm(row, col);
            // The codes in place of the stress: the network divides either by a power of two.
            let output = network.shear(&OneContact { b: &stress, alive: &alive, centre_mm });
            for axis in [0, 1] {
                let unit = 1.0 / MU_STEPS as f64;
                let mu = f64::from(contact.position[axis]) * unit * scene.search.mu_max;
                assert!((mu - output.mean[axis]).abs() < 0.004, "{mu} {output:?} at {row}, {col}");
                let ln = f64::from(contact.ln_sigma[axis]) * unit;
                assert!((ln - (output.sigma[axis] / scene.search.mu_max).ln()).abs() < 0.01, "{ln} {output:?}");
            }
            asked += 1;
        }
    }
    assert!(asked >= 14, "{asked} contacts");
}

/// The same contacts as in the golden model, and forces that differ by little.
#[test]
fn contacts_are_those_of_the_golden_model() {
    let (scene, _file) = scene("[input]\ndead = [[4, 9], [12, 0]]\n", "");
    // Dead taxels break the symmetry, so that the matrices are too large for the board.
    let model = Model::without_fit_check(&scene).unwrap();
    let golden = Golden::reference(&scene).unwrap();
    let draws = Draws::new(&scene, DrawOptions { contacts: 3, seed: 5, ..Default::default() }).unwrap();
    let (mut taxels, mut other, mut compared, mut moved) = (0, 0, 0, 0);
    for number in 0..12 {
        let Ok(drawn) = draws.frame(number) else { continue };
        // A code is a power of two in MPa, so that both models divide by the same one: a network of a few steps has not learned
        // that the load does not matter.
        let per_code = 4096.0 * model.codes(&drawn.frame).unwrap().lsb_MPa();
        let stress_MPa = drawn.frame.stress_MPa.iter().map(|b| b / per_code).collect();
        let frame = Frame::from_stress("a code is 1/4096 MPa", &scene.sensor, stress_MPa).unwrap();
        let (fixed, float) = (model.reconstruct(&frame).unwrap(), golden.run(&frame).unwrap());
        let regions = fixed.extra.regions.as_ref().unwrap();
        assert_eq!(regions.len(), by_load(&float).len(), "frame {number}");
        for region in regions {
            let twin = twin(region, &float);
            taxels += region.taxels.len();
            other += region.taxels.iter().filter(|taxel| !twin.taxels.contains(taxel)).count();
            // A middle half way between two taxels may be rounded otherwise: another window, another μ.
            let off = (region.mu[0] - twin.mu[0]).hypot(region.mu[1] - twin.mu[1]);
            compared += 1;
            moved += usize::from(off > 0.005);
            let normal = region.load_N[2] / twin.load_N[2];
            assert!((normal - 1.0).abs() < 0.02, "frame {number}: {normal}");
        }
        let [sum, total] = [fixed.resultant_N, float.resultant_N].map(|force| force[2]);
        assert!((sum / total - 1.0).abs() < 5e-3, "frame {number}: {sum} N and {total} N");
        assert_eq!(fixed.flags, float.flags, "frame {number}");
    }
    // Ties and quantisation decide for a taxel now and then.
    assert!(compared >= 20 && 5 * moved < compared, "{moved} of {compared} contacts have another μ");
    assert!(50 * other < taxels, "{other} of {taxels} taxels are in another contact");
}

/// Of more contacts than the scene allows the largest have a μ; the others keep their normal force, and a flag tells it.
#[test]
fn of_more_contacts_the_largest_have_shear() {
    let (scene, _file) = scene("", "max_contacts = 1\n");
    let (model, golden) = (Model::new(&scene).unwrap(), Golden::reference(&scene).unwrap());
    let draws = Draws::new(&scene, DrawOptions { contacts: 2, seed: 3, ..Default::default() }).unwrap();
    let frame = draws.frame(1).unwrap().frame;
    let (fixed, float) = (model.reconstruct(&frame).unwrap(), golden.run(&frame).unwrap());
    let all = by_load(&float);
    assert_eq!((fixed.extra.regions.as_ref().unwrap().len(), all.len()), (1, 2));
    assert!(all[0].mu != [0.0; 2] && all[1].mu == [0.0; 2] && all[1].mu_sigma.is_none());
    for result in [&fixed, &float] {
        assert!(result.flags.contains(&Flag::TooManyContacts), "{:?}", result.flags);
        let second = all[1].taxels.iter();
        assert!(second.clone().all(|&taxel| result.forces_N.fx[taxel] == 0.0));
        assert!(second.map(|&taxel| result.forces_N.fz[taxel]).sum::<f64>() > 0.5 * all[1].load_N[2]);
    }
    let trace = model.run(&model.readings(&[frame]).unwrap());
    assert_eq!((trace.status.len(), trace.beats.len()), (STATUS_BEATS, 13 * 18 + 10));
}

/// Frames without a contact, and codes at the end of their range.
#[test]
fn nothing_and_the_largest_codes() {
    let (scene, _file) = scene("", "");
    let model = Model::new(&scene).unwrap();
    let largest = (1 << (model.formats().code_bits - 1)) - 1;
    for codes in [vec![0; 234], vec![-largest; 234], vec![largest; 234]] {
        let trace = model.run(&codes);
        let found: Vec<Status> = Status::all(&trace.status).collect();
        assert_eq!(found.len(), 8);
        // Pressure alone is a contact.
        let contacts = found.iter().filter(|status| status.found).count();
        assert_eq!(contacts == 0, codes[0] <= 0, "{contacts} contacts for {}", codes[0]);
    }
    let quiet = Frame {
        stress_MPa: vec![0.0; 234],
        ..Draws::new(&scene, DrawOptions::default()).unwrap().frame(0).unwrap().frame
    };
    let result = model.reconstruct(&quiet).unwrap();
    assert!(result.flags.contains(&Flag::NoContact) && result.extra.regions == Some(Vec::new()));
}

/// A record of each contact tells what its forces tell: contacts in the same order with the same figures, and the same wrench.
#[test]
fn records_tell_what_forces_tell() {
    let (scene, _file) = scene("", "max_contacts = 2\n");
    let mut short = scene.clone();
    short.output.forces = ForceOutput::Resultants;
    let [forces, records] = [&scene, &short].map(|scene| Model::new(scene).unwrap());
    let draws = Draws::new(&scene, DrawOptions { contacts: 3, seed: 5, ..Default::default() }).unwrap();
    let near = |a: f64, b: f64| assert!((a - b).abs() <= 1e-12 * (1.0 + a.abs()), "{a} and {b}");
    let mut seen = [0; 2];
    for drawn in (0..6).filter_map(|number| draws.frame(number).ok()) {
        let frame = drawn.frame;
        let trace = records.run(&records.readings(std::slice::from_ref(&frame)).unwrap());
        assert_eq!((trace.beats.len(), records.force_beats()), (3 * 7, 3 * 7));
        let [all, own] = [&forces, &records].map(|model| model.reconstruct(&frame).unwrap());
        let [regions, recorded] = [&all, &own].map(|result| result.extra.regions.as_ref().unwrap());
        assert_eq!(regions.len(), recorded.len());
        for (region, recorded) in regions.iter().zip(recorded) {
            assert_eq!((region.mu, region.mu_sigma, recorded.taxels.len()), (recorded.mu, recorded.mu_sigma, 0));
            assert_eq!((region.taxels.len(), region.taxel_count), (recorded.taxel_count, recorded.taxel_count));
            assert_eq!(region.centroid_condition, recorded.centroid_condition);
            (0..3).for_each(|axis| near(region.load_N[axis], recorded.load_N[axis]));
            for (a, b) in [(region.centre_mm, recorded.centre_mm), (region.shear_sigma_N, recorded.shear_sigma_N)] {
                (0..2).for_each(|axis| near(a.unwrap()[axis], b.unwrap()[axis]));
            }
        }
        assert_eq!(own.extra.resultants.as_ref().unwrap().len(), regions.len());
        let [wrench, sums] = [&all, &own].map(|result| result.extra.wrench.unwrap());
        for axis in 0..3 {
            near(wrench.force_N[axis], sums.force_N[axis]);
            near(wrench.moment_Nmm[axis], sums.moment_Nmm[axis]);
            near(all.resultant_N[axis], own.resultant_N[axis]);
        }
        assert_eq!((&all.flags, all.error.is_some()), (&own.flags, own.error.is_some()));
        // The taxels of no contact carry a part of the load.
        let loads: f64 = recorded.iter().map(|region| region.load_N[2]).sum();
        seen[0] += usize::from(recorded.iter().map(|region| region.taxel_count).sum::<usize>() < 234);
        seen[1] += usize::from((own.resultant_N[2] - loads).abs() > 1e-3);
    }
    assert!(seen.iter().all(|&frames| frames > 2), "{seen:?}");
    let quiet = records.decode(
        &[Frame::from_stress("quiet", &scene.sensor, vec![0.0; 234]).unwrap()],
        "fixed",
        &[[i32::MIN; 3]; 21],
        &[[0; 3]; 6],
    );
    assert!(quiet.is_ok(), "any words of a device are decoded: {quiet:?}");
}
