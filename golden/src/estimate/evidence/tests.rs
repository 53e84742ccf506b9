//! The estimator as a whole, on drawn frames: errors, standard deviations and flags. The full figures are those of
//! `dermis noise --shapes`; the limits here are those of few frames.

use super::*;
use crate::data::generator::converter::Converter;
use crate::data::generator::draws::{DrawOptions, DrawnFrame, Draws};
use crate::data::generator::slip::Slip;
use crate::estimate::float::Golden;
use crate::result::checks::NOT_RESOLVED;
use crate::result::flags::Flag;
use crate::result::reconstruct::ContactEstimate;
use crate::result::reconstruct::Reconstruction;
use crate::spec::scene::{EstimatorKind, Medium, Scene};

fn scene(name: &str) -> Scene {
    let mut scene = Scene::builtin(name).unwrap();
    scene.search.estimator = Some(EstimatorKind::Evidence);
    scene
}

/// Results of `frames` drawn frames; the noise, a share of the peak, is stated if it is above 0.
fn results(
    scene: &Scene,
    frames: u64,
    noise: f64,
    contacts: usize,
    converter: Converter,
) -> Vec<(DrawnFrame, Reconstruction)> {
    let golden = Golden::new(scene).unwrap();
    let draws = Draws::new(scene, DrawOptions { contacts, seed: 5, ..Default::default() }).unwrap();
    let one = |number| {
        let drawn = draws.frame(number).unwrap();
        let frame = drawn.read(&Converter { noise, seed: number, ..converter.clone() }).unwrap();
        let result = golden.run_with_noise(&frame, noise * drawn.peak_MPa()).unwrap();
        (drawn, result)
    };
    (0..frames).map(one).collect()
}

/// e_t of each result, sorted.
fn shear_errors(results: &[(DrawnFrame, Reconstruction)]) -> Vec<f64> {
    let error = |(drawn, result): &(DrawnFrame, Reconstruction)| {
        crate::result::errors::Errors::new(drawn.total_N, result.resultant_N).tangential.unwrap()
    };
    let mut errors: Vec<f64> = results.iter().map(error).collect();
    errors.sort_by(f64::total_cmp);
    errors
}

#[test]
fn any_shape_without_noise() {
    for medium in [Medium::HalfSpace, Medium::BondedLayer { poisson: 0.48 }] {
        let scene = Scene { medium, ..scene("sensor-1") };
        let results = results(&scene, 10, 0.0, 1, Converter::default());
        let errors = shear_errors(&results);
        assert!(errors[5] < 0.015 && errors[9] < 0.04, "{medium}: {errors:?}");
        for (drawn, result) in &results {
            assert!((result.resultant_N[2] / drawn.total_N[2] - 1.0).abs() < 0.03, "{}", result.frame);
            assert!(!result.flags.contains(&Flag::ShearNotResolved), "{}", result.frame);
        }
    }
}

/// The limits of the table for 0.2 % of noise, and standard deviations that cover what they should, with and without
/// tension.
#[test]
fn noise_and_standard_deviations() {
    for unipolar in [false, true] {
        let mut scene = scene("sensor-1");
        scene.input.unipolar = unipolar;
        let results = results(&scene, 30, 0.002, 1, Converter { unipolar, ..Default::default() });
        let errors = shear_errors(&results);
        assert!(errors[15] < 0.14 && errors[26] < 0.35, "{errors:?}");
        let (mut within, mut all) = (0, 0);
        for (drawn, result) in &results {
            let contacts = result.extra.contacts.as_ref().unwrap();
            for axis in 0..3 {
                let off = (result.resultant_N[axis] - drawn.total_N[axis]).abs();
                assert!(off < 6.0 * contacts[0].sigma_N[axis].max(1e-3 * drawn.total_N[2]), "{}", result.frame);
                all += 1;
                within += usize::from(off < contacts[0].sigma_N[axis]);
            }
        }
        let share = within as f64 / all as f64;
        // 68 %, and three standard deviations of 90 draws.
        assert!((0.53..0.84).contains(&share), "{share}");
    }
}

#[test]
fn each_contact_has_its_own_shear() {
    let results = results(&scene("sensor-3"), 4, 5e-4, 2, Converter::default());
    for (drawn, result) in &results {
        let contacts = result.extra.contacts.as_ref().unwrap();
        assert_eq!(contacts.len(), 2, "{}", result.frame);
        for truth in &drawn.truth {
            let far = |contact: &&ContactEstimate| {
                (contact.centre_mm[0] - truth.centre_mm[0]).hypot(contact.centre_mm[1] - truth.centre_mm[1])
            };
            let found = contacts.iter().min_by(|a, b| far(a).total_cmp(&far(b))).unwrap();
            assert!(far(&found) < 1.0);
            for axis in 0..2 {
                let off = (found.force_N[axis] - truth.force_N[axis]).abs();
                assert!(off < 5.0 * found.sigma_N[axis], "{} {axis}: {off} {:?}", result.frame, found.sigma_N);
            }
        }
    }
}

/// Frames of one contact with a kind of slip, read with noise that is stated: error along the true shear over it, and whether each
/// component of the shear is within its standard deviation.
fn along_the_shear(evidence: &Evidence, scene: &Scene, slip: Slip, frames: u64, noise: f64) -> Vec<(f64, [bool; 2])> {
    let draws = Draws::new(scene, DrawOptions { slip, seed: 21, ..Default::default() }).unwrap();
    let one = |number| {
        let drawn = draws.frame(number).unwrap();
        let frame = drawn.read(&Converter { noise, seed: number, ..Default::default() }).unwrap();
        let estimate = evidence.solve(&frame.stress_MPa, Some(noise * drawn.peak_MPa()));
        let ([x, y, _], [tx, ty, _]) = (estimate.forces_N.resultant(), drawn.total_N);
        let [sx, sy, _] = estimate.contacts[0].sigma_N;
        ((x * tx + y * ty) / (tx * tx + ty * ty) - 1.0, [(x - tx).abs() < sx, (y - ty).abs() < sy])
    };
    (0..frames).map(one).collect()
}

fn median_bias(all: &[(f64, [bool; 2])]) -> f64 {
    let mut sorted: Vec<f64> = all.iter().map(|(bias, _)| *bias).collect();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

/// A contact that sticks in part is not read with too much shear where the noise lets see it, and its standard deviation says how
/// far the rest may be off. Taken for one in full slip, it is read with up to a tenth too much.
#[test]
fn partial_slip_has_no_bias() {
    let scene = scene("sensor-1");
    let evidence = Evidence::new(&scene);
    for (slip, noise, most) in
        [(0.8, 0.0, 0.03), (0.6, 0.0, 0.03), (0.4, 0.0, 0.03), (0.6, 5e-4, 0.05), (0.4, 5e-4, 0.05)]
    {
        let bias = median_bias(&along_the_shear(&evidence, &scene, Slip::Partial(slip), 15, noise));
        assert!(bias.abs() < most, "{slip} {noise}: {bias}");
    }
    let mixed = along_the_shear(&evidence, &scene, Slip::Mixed, 40, 2e-3);
    let within = mixed.iter().flat_map(|(_, within)| within).filter(|within| **within).count() as f64 / 80.0;
    // 68 %, and three standard deviations of 80 components.
    assert!((0.52..0.84).contains(&within), "{within}");
    let full = Evidence { spreads: slip::SpreadPrior::FULL_SLIP, ..evidence };
    assert!(median_bias(&along_the_shear(&full, &scene, Slip::Partial(0.4), 15, 0.0)) > 0.06);
}

/// A frame of another scale has the forces of that scale, and noise that is not stated is found.
#[test]
fn scale_and_unknown_noise() {
    let scene = scene("sensor-1");
    let draws = Draws::new(&scene, DrawOptions::default()).unwrap();
    let drawn = draws.frame(3).unwrap();
    let frame = drawn.read(&Converter { noise: 0.01, ..Default::default() }).unwrap();
    let evidence = Evidence::new(&scene);
    let one = evidence.solve(&frame.stress_MPa, None);
    let found = one.noise_MPa / drawn.peak_MPa();
    assert!((0.008..0.012).contains(&found) && one.misfit_probability.is_none(), "{found}");
    let larger: Vec<f64> = frame.stress_MPa.iter().map(|b| 1024.0 * b).collect();
    let other = evidence.solve(&larger, None);
    for (a, b) in one.contacts.iter().zip(&other.contacts) {
        assert_eq!((a.mu, a.force_N.map(|force| 1024.0 * force)), (b.mu, b.force_N));
    }
}

#[test]
fn without_a_reading_above_zero_there_is_no_contact() {
    let scene = scene("eight-by-eight");
    let evidence = Evidence::new(&scene);
    for b in [0.0, -1.0] {
        let estimate = evidence.solve(&[b; 64], None);
        assert!(estimate.contacts.is_empty() && estimate.forces_N.fz.iter().all(|force| *force == 0.0));
    }
    // The smallest and largest numbers are no reason to stop.
    for b in [f64::MIN_POSITIVE, 1e300] {
        let mut stress = [0.0; 64];
        stress[27] = b;
        assert!(evidence.solve(&stress, Some(b / 100.0)).contacts.iter().all(|own| own.mu[0].is_finite()));
    }
}

/// What a sensor adds to every frame, smooth over the array, changes no force beyond its standard deviation, and noise does
/// not have to be stated for it.
#[test]
fn baselines_are_no_forces() {
    for name in ["sensor-1", "eight-by-eight"] {
        let scene = scene(name);
        let evidence = Evidence::new(&scene);
        let (rows, cols) = (scene.sensor.rows, scene.sensor.cols);
        let draws = Draws::new(&scene, DrawOptions { seed: 11, ..Default::default() }).unwrap();
        for (number, [offset, slope]) in (0..).zip([[-0.01, 0.0], [0.02, 0.0], [0.0, 0.005], [0.0, -0.05]]) {
            let drawn = draws.frame(number).unwrap();
            let peak = drawn.peak_MPa();
            let x = |k: usize| 2.0 * (k % cols) as f64 / (cols - 1) as f64 - 1.0;
            let b: Vec<f64> = (0..rows * cols).map(|k| drawn.exact_MPa[k] + peak * (offset + slope * x(k))).collect();
            for noise in [None, Some(1e-4 * peak)] {
                let estimate = evidence.solve(&b, noise);
                let force = estimate.forces_N.resultant();
                let error = crate::result::errors::Errors::new(drawn.total_N, force);
                assert!(!estimate.failed && estimate.suspects.is_empty(), "{name} {offset} {slope}");
                assert!(error.tangential.unwrap() < 0.08, "{name} {offset} {slope}: {error:?}");
                assert!(error.normal.unwrap().abs() < 0.05, "{name} {offset} {slope}: {error:?}");
            }
        }
    }
}

/// Clean frames have no suspect taxel, and what the estimate leaves of them is white noise.
#[test]
fn clean_frames_stay_below_the_limits() {
    for (name, noise) in [("sensor-1", 0.0), ("sensor-1", 0.002), ("eight-by-eight", 1e-4), ("eight-by-eight", 0.01)] {
        let scene = scene(name);
        let evidence = Evidence::new(&scene);
        let draws = Draws::new(&scene, DrawOptions { seed: 13, ..Default::default() }).unwrap();
        for number in 0..8 {
            let frame =
                draws.frame(number).unwrap().read(&Converter { noise, seed: number, ..Default::default() }).unwrap();
            let estimate = evidence.solve(&frame.stress_MPa, None);
            let (outlier, correlation) = (estimate.outlier.unwrap(), estimate.residual_correlation.unwrap());
            assert!(!estimate.failed && estimate.suspects.is_empty(), "{name} {noise} {number}");
            assert!(outlier < crate::result::checks::OUTLIER, "{name} {noise} {number}: {outlier}");
            assert!(correlation < crate::result::checks::CORRELATED, "{name} {noise} {number}: {correlation}");
        }
    }
}

/// Rows and columns that couple: a tenth of the mean of its row and column on every taxel. No noise leaves that.
#[test]
fn coupled_lines_do_not_fit() {
    let scene = scene("sensor-1");
    let golden = Golden::new(&scene).unwrap();
    let draws = Draws::new(&scene, DrawOptions { seed: 14, ..Default::default() }).unwrap();
    let mut misfits = 0;
    for number in 0..8 {
        let mut frame = draws.frame(number).unwrap().frame;
        let b = frame.stress_MPa.clone();
        let mean = |of: &dyn Fn(usize) -> usize| (0..10).map(|k| b[of(k)]).sum::<f64>().max(0.0) / 10.0;
        let coupled = |k: usize| b[k] + 0.1 * (mean(&|col| k / 10 * 10 + col) + mean(&|row| 10 * row + k % 10));
        frame.stress_MPa = (0..100).map(coupled).collect();
        let result = golden.run(&frame).unwrap();
        misfits += usize::from(result.flags.contains(&Flag::Misfit));
        // Or the taxel is left out that shows it most.
        let expected = [Flag::Misfit, Flag::TaxelSuspect];
        assert!(result.flags.iter().any(|flag| expected.contains(flag)), "{number} {:?}", result.checks);
    }
    assert!(misfits >= 7, "{misfits} of 8");
}

/// A taxel that is stuck is named and does not bend the rest.
#[test]
fn stuck_taxels_are_named() {
    let scene = scene("sensor-1");
    let evidence = Evidence::new(&scene);
    let draws = Draws::new(&scene, DrawOptions { seed: 12, ..Default::default() }).unwrap();
    // The last one reads far more than the press: what it leaves is fitted in its own units.
    for (number, taxel, share) in [(0, 33, 1.0), (1, 9, 0.3), (2, 90, -0.2), (3, 71, 0.3), (4, 28, 30.0)] {
        let drawn = draws.frame(number).unwrap();
        let mut b = drawn.exact_MPa.clone();
        b[taxel] = share * drawn.peak_MPa();
        let estimate = evidence.solve(&b, None);
        let named: Vec<usize> = estimate.suspects.iter().map(|own| 10 * own.row + own.col).collect();
        assert_eq!(named, [taxel], "{number}");
        let error = crate::result::errors::Errors::new(drawn.total_N, estimate.forces_N.resultant());
        assert!(error.normal.unwrap().abs() < 0.05 && error.tangential.unwrap() < 0.08, "{number}: {error:?}");
        // The same frame without the fault has no suspect.
        assert!(evidence.solve(&drawn.exact_MPa, None).suspects.is_empty(), "{number}");
    }
}

/// The press of a pad whose baseline is 1 and 3 % of full scale too low has its force, and an even load on the whole array
/// has its normal force without a shear.
#[test]
fn no_estimate_is_no_zero() {
    let press = "0.0000259,0.0000577,0.0001996,0.0007612,0.0010964,0.0007213,0.0000070,0.0002582,0.0016502,0.0053776,\
                 0.0080775,0.0054106,0.0000410,0.0007224,0.0053843,0.0179904,0.0267940,0.0179658,0.0000544,0.0010784,\
                 0.0080907,0.0268205,0.0399865,0.0267939,0.0000352,0.0007520,0.0054159,0.0179778,0.0268062,0.0179680,\
                 0.0000177,0.0001838,0.0016627,0.0053977,0.0080645,0.0054402";
    let text = "[sensor]\nrows = 6\ncols = 6\npitch_x_mm = 4.0\npitch_y_mm = 4.0\nthickness_mm = 2.0\n\
                [search]\nnoise_floor_MPa = 2e-5\n";
    let pad = Scene::parse(text, "pad.toml").unwrap();
    let golden = Golden::new(&pad).unwrap();
    for offset in [0.0, 0.001, 0.003] {
        let b = press.split(',').map(|b| b.trim().parse::<f64>().unwrap() - offset).collect();
        let result = golden.run(&crate::data::frame::Frame::from_stress("press", &pad.sensor, b).unwrap()).unwrap();
        let normal = result.resultant_N[2];
        assert!(normal > 2.0 && normal < 9.0 && !result.flags.contains(&Flag::NoContact), "{offset}: {normal}");
        let right = (3.9..5.1).contains(&normal);
        assert!(right || !result.flags.is_empty(), "{offset}: {:?} {:?}", result.resultant_N, result.extra.contacts);
    }
    let scene = scene("sensor-1");
    let contact = crate::data::frame::Contact {
        shape: Some("rectangle".to_string()),
        size_mm: vec![20.0, 40.0, 0.0],
        normal_N: Some(80.0),
        tangential_N: Some([0.0, 16.0]),
        centre_mm: Some([0.0; 2]),
        ..Default::default()
    };
    let frame = crate::data::generator::generate("even", &scene.sensor, scene.medium, &[contact]).unwrap();
    let result = Golden::new(&scene).unwrap().run(&frame).unwrap();
    assert!((result.resultant_N[2] / 80.0 - 1.0).abs() < 0.05, "{:?}", result.resultant_N);
    assert!(result.flags.contains(&Flag::ShearNotResolved), "{:?}", result.flags);
    // Readings that no contact causes are not fitted.
    let counts = crate::data::frame::Frame::from_stress("counts", &scene.sensor, vec![3000.0; 100]).unwrap();
    let result = Golden::new(&scene).unwrap().run(&counts).unwrap();
    assert!(result.flags.contains(&Flag::EstimateFailed) && result.flags.contains(&Flag::ShearNotResolved));
    assert!((result.resultant_N[2] / (3000.0 * 800.0) - 1.0).abs() < 1e-9, "{:?}", result.resultant_N);
}

/// Dead taxels read anything.
#[test]
fn dead_taxels_are_not_read() {
    let mut scene = scene("sensor-1");
    scene.input.dead = vec![[4, 5], [5, 5]];
    let draws = Draws::new(&scene, DrawOptions::default()).unwrap();
    let frame = draws.frame(1).unwrap().frame;
    let evidence = Evidence::new(&scene);
    let mut other = frame.stress_MPa.clone();
    other[45] = 1e3;
    other[55] = -1e3;
    assert_eq!(evidence.solve(&frame.stress_MPa, None), evidence.solve(&other, None));
}

/// Tare frames tell zero and noise of each taxel: the right half of the array is five times as noisy. The bit-true model
/// takes the same noise for its flag.
#[test]
fn noise_of_each_taxel_from_tare_frames() {
    let mut scene = scene("sensor-1");
    let drawn = Draws::new(&scene, DrawOptions::default()).unwrap().frame(0).unwrap();
    let peak = drawn.peak_MPa();
    let sigma = |taxel: usize| peak * if taxel % 10 < 5 { 0.001 } else { 0.005 };
    let mut random = crate::random::Random::new(9);
    let mut read = |stress: &dyn Fn(usize) -> f64| -> Vec<f64> {
        (0..100).map(|taxel| stress(taxel) + 0.1 * peak + sigma(taxel) * random.normal()).collect()
    };
    let line = |row: &[f64]| row.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
    let zeros: Vec<String> = (0..40).flat_map(|_| read(&|_| 0.0).chunks(10).map(line).collect::<Vec<_>>()).collect();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("zeros.csv");
    std::fs::write(&path, zeros.join("\n")).unwrap();
    scene.input.tare = Some(path);
    scene.input.full_scale_MPa = Some(2.0 * peak);
    let stress = read(&|taxel| drawn.exact_MPa[taxel]);
    let frame = crate::data::frame::Frame::from_stress("read", &scene.sensor, stress).unwrap();
    let result = Golden::new(&scene).unwrap().run(&frame).unwrap();
    let expected = peak * ((0.001f64.powi(2) + 0.005f64.powi(2)) / 2.0 * (1.0 + 1.0 / 40.0)).sqrt();
    let found = result.checks.noise_MPa.unwrap();
    assert!((found / expected - 1.0).abs() < 0.1, "{found} {expected}");
    assert!(result.checks.misfit_probability.unwrap() > 0.01, "{:?}", result.checks);
    // One noise for all does not fit: the right half is too loud for it.
    let one = Scene {
        search: crate::spec::scene::SearchSpec { noise_floor_MPa: Some(0.001 * peak), ..scene.search.clone() },
        ..scene.clone()
    };
    let other = Golden::new(&one).unwrap().run(&frame).unwrap();
    assert!(other.flags.contains(&Flag::Misfit), "{:?}", other.checks);
    let fixed = crate::fixed::Model::new(&scene).unwrap().reconstruct(&frame).unwrap();
    assert!(fixed.flags.contains(&Flag::ShearUnreliable), "{:?}", fixed.flags);
}

/// A bonded layer read as a half-space does not fit, and 2 % of noise does not resolve a small shear.
#[test]
fn flags_with_their_figures() {
    let layer = Scene { medium: Medium::BondedLayer { poisson: 0.48 }, ..scene("sensor-1") };
    let drawn = Draws::new(&layer, DrawOptions::default()).unwrap().frame(0).unwrap();
    let golden = Golden::new(&scene("sensor-1")).unwrap();
    let result = golden.run_with_noise(&drawn.frame, 1e-4 * drawn.peak_MPa()).unwrap();
    assert!(result.flags.contains(&Flag::Misfit), "{:?}", result.checks);
    let small = DrawOptions { ratio: [0.05, 0.06], ..Default::default() };
    let drawn = Draws::new(&scene("sensor-1"), small).unwrap().frame(0).unwrap();
    let frame = drawn.read(&Converter { noise: 0.02, ..Default::default() }).unwrap();
    let result = golden.run_with_noise(&frame, 0.02 * drawn.peak_MPa()).unwrap();
    assert!(result.flags.contains(&Flag::ShearNotResolved) && result.checks.shear_spread.unwrap() > NOT_RESOLVED);
}

/// A cover five times as thick as the smaller pitch: a contact narrower than the cover is not made wider.
#[test]
fn thick_cover() {
    let mut scene = scene("sensor-1");
    scene.sensor.thickness_mm = 10.0;
    let results = results(&scene, 10, 0.0, 1, Converter::default());
    let errors = shear_errors(&results);
    assert!(errors[5] < 0.01 && errors[9] < 0.03, "{errors:?}");
    for (drawn, result) in &results {
        let sigma = result.extra.contacts.as_ref().unwrap()[0].sigma_N;
        for axis in 0..2 {
            let off = (result.resultant_N[axis] - drawn.total_N[axis]).abs();
            assert!(off < 3.0 * sigma[axis], "{} {axis}: {off} {sigma:?}", result.frame);
        }
    }
}

/// More shear than `search.mu_max` admits never comes without a flag, whether noise is stated or not.
#[test]
fn shear_beyond_the_bound_is_flagged() {
    let scene = scene("sensor-1");
    let golden = Golden::new(&scene).unwrap();
    let bound = scene.search.mu_max;
    for ratio in [1.5, 3.0, 50.0] {
        let options = DrawOptions { ratio: [ratio * bound, 1.01 * ratio * bound], ..Default::default() };
        let draws = Draws::new(&scene, options).unwrap();
        for number in 0..6 {
            let drawn = draws.frame(number).unwrap();
            for noise in [0.0, 0.001] {
                let result = golden.run_with_noise(&drawn.frame, noise * drawn.peak_MPa()).unwrap();
                let expected = [Flag::MuAtBound, Flag::Misfit, Flag::EstimateFailed];
                assert!(
                    result.flags.iter().any(|flag| expected.contains(flag)),
                    "{ratio} {number} {:?}",
                    result.checks
                );
            }
        }
    }
}

#[test]
fn refused_by_field() {
    let layer = "[medium]\nkind = \"bonded-layer\"\npoisson = 0.48\n[search]\nestimator = \"evidence\"";
    for (text, thickness, field) in [
        ("[search]\nestimator = \"evidence\"", 1.3, "sensor.thickness_mm"),
        (layer, 2.5, "sensor.thickness_mm"),
        ("[search]\nestimator = \"evidence\"\nobjective = \"patch\"", 3.0, "search.objective"),
        ("[search]\nestimator = \"evidence\"\nmu_max = 0", 3.0, "search.mu_max"),
        ("[search]\nestimator = \"evidence\"\n[partition]\ncase = 1", 3.0, "partition.case"),
        ("[search]\nestimator = \"evidence\"\nform = \"orthogonal\"", 3.0, "search.form"),
    ] {
        let pitches = "[sensor]\nrows = 8\ncols = 8\npitch_x_mm = 4\npitch_y_mm = 4\n";
        let scene = Scene::parse(&format!("{pitches}thickness_mm = {thickness}\n{text}"), "mine.toml").unwrap();
        let error = Golden::new(&scene).err().unwrap().to_string();
        assert!(error.contains(field), "{error}");
        // `auto` takes the other estimator.
        let auto = Scene { search: crate::spec::scene::SearchSpec { estimator: None, ..scene.search }, ..scene };
        assert!(auto.model_estimator() == EstimatorKind::Search && Golden::new(&auto).is_ok(), "{field}");
    }
}
