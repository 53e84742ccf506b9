//! Properties for any contact: the forces under scaled loads, mirrors, quarter turns, shifts by a pitch and loads in
//! several subarrays, and the difference between fixed and floating point.

use dermis_golden::data::frame::{Forces, Frame};
use dermis_golden::data::generator::slip::Slip;
use dermis_golden::data::generator::{generate, random_contacts, Draw, Shapes};
use dermis_golden::estimate::float::Golden;
use dermis_golden::fixed::Model;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::partition::{subarrays, Case};
use dermis_golden::spec::scene::largest_code;
use dermis_golden::spec::scene::Scene;
use proptest::prelude::*;

/// Steps of the search, in mu_max/384, by which rounding may change μ if two candidates have similar scores.
const STEPS: f64 = 2.0;

fn scene() -> Scene {
    Scene::builtin("eight-by-eight").unwrap()
}

fn drawn(scene: &Scene, seed: u64) -> Frame {
    let draw = Draw { count: 1, shapes: Shapes::Elliptic, slip: Slip::Full, touching: false, seed };
    generate("drawn", &scene.sensor, scene.medium, &random_contacts(&scene.sensor, draw)).unwrap()
}

fn run(scene: &Scene, frame: &Frame) -> Reconstruction {
    Golden::reference(scene).unwrap().run(frame).unwrap()
}

/// The frame with the stress of taxel `from(row, col)` at each taxel.
fn moved(frame: &Frame, from: impl Fn(usize, usize) -> [usize; 2]) -> Frame {
    let cols = frame.sensor.cols;
    let taxel = |index: usize| {
        let [row, col] = from(index / cols, index % cols);
        frame.stress_MPa[row * cols + col]
    };
    Frame { stress_MPa: (0..frame.stress_MPa.len()).map(taxel).collect(), ..frame.clone() }
}

/// Whether μ agrees up to [`STEPS`] and the normal force up to 1 %.
fn alike(scene: &Scene, a: &Reconstruction, mu: [f64; 2], normal: f64) -> bool {
    let step = scene.search.mu_max / 384.0;
    let own = a.subarrays[0].mu;
    let near = (0..2).all(|k| (own[k] - mu[k]).abs() <= STEPS * step);
    near && (a.resultant_N[2] / normal - 1.0).abs() <= 1e-2
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Powers of two scale every force exactly; fixed point gives the same words.
    #[test]
    fn the_load_scales_the_forces(seed in 0u64..1000, power in -40i32..40) {
        let scene = scene();
        let frame = drawn(&scene, seed);
        let factor = 2f64.powi(power);
        let mut larger = frame.clone();
        larger.stress_MPa.iter_mut().for_each(|b| *b *= factor);
        let (small, large) = (run(&scene, &frame), run(&scene, &larger));
        prop_assert_eq!(small.subarrays[0].mu, large.subarrays[0].mu);
        for (a, b) in [(&small.forces_N.fx, &large.forces_N.fx), (&small.forces_N.fz, &large.forces_N.fz)] {
            prop_assert!(a.iter().zip(b).all(|(a, b)| a * factor == *b));
        }
        let model = Model::new(&scene).unwrap();
        let words = |frame: &Frame| model.run(&model.readings(std::slice::from_ref(frame)).unwrap()).beats;
        prop_assert_eq!(words(&frame), words(&larger));
    }

    /// A mirrored frame has mirrored forces.
    #[test]
    fn mirrors(seed in 0u64..1000) {
        let scene = scene();
        let frame = drawn(&scene, seed);
        let (rows, cols) = (scene.sensor.rows, scene.sensor.cols);
        let plain = run(&scene, &frame);
        let ([x, y], normal) = (plain.subarrays[0].mu, plain.resultant_N[2]);
        let across = run(&scene, &moved(&frame, |row, col| [row, cols - 1 - col]));
        prop_assert!(alike(&scene, &across, [-x, y], normal), "{:?} {:?}", plain.subarrays[0], across.subarrays[0]);
        let along = run(&scene, &moved(&frame, |row, col| [rows - 1 - row, col]));
        prop_assert!(alike(&scene, &along, [x, -y], normal), "{:?} {:?}", plain.subarrays[0], along.subarrays[0]);
    }

    /// A quarter turn of the frame on a square array turns the shear.
    #[test]
    fn quarter_turns(seed in 0u64..1000) {
        let scene = scene();
        let frame = drawn(&scene, seed);
        let last = scene.sensor.cols - 1;
        // (x, y) → (−y, x): the right side moves to the bottom.
        let turned = run(&scene, &moved(&frame, |row, col| [last - col, row]));
        let plain = run(&scene, &frame);
        let [x, y] = plain.subarrays[0].mu;
        prop_assert!(
            alike(&scene, &turned, [-y, x], plain.resultant_N[2]),
            "{:?} {:?}", plain.subarrays[0], turned.subarrays[0]
        );
    }

    /// A contact moved by one pitch has its forces moved by one pitch, away from the array's edge.
    #[test]
    fn one_pitch_aside(seed in 0u64..1000) {
        let mut scene = Scene::builtin("sensor-3").unwrap();
        scene.search.mu_max = 0.0;
        let golden = Golden::reference(&scene).unwrap();
        let (cols, pitch) = (scene.sensor.cols, scene.sensor.pitch_x_mm);
        let draw = Draw { count: 1, shapes: Shapes::Elliptic, slip: Slip::Full, touching: false, seed };
        let mut contacts = random_contacts(&scene.sensor, draw);
        contacts[0].centre_mm = Some([0.3 * pitch, 0.1 * pitch]);
        let frame = |contacts: &[_]| generate("aside", &scene.sensor, scene.medium, contacts).unwrap();
        let here = golden.run(&frame(&contacts)).unwrap().forces_N.fz;
        contacts[0].centre_mm = Some([1.3 * pitch, 0.1 * pitch]);
        let there = golden.run(&frame(&contacts)).unwrap().forces_N.fz;
        let peak = here.iter().fold(0.0f64, |peak, f| peak.max(f.abs()));
        for row in 4..scene.sensor.rows - 4 {
            for col in 4..cols - 5 {
                let (a, b) = (here[row * cols + col], there[row * cols + col + 1]);
                // The effect of the edges is a thousandth of the peak this far inside.
                prop_assert!((a - b).abs() <= 1e-3 * peak, "{row},{col}: {a} {b}, peak {peak}");
            }
        }
    }

    /// Subarrays are independent: the forces of a frame are the sums of those of each subarray's stress alone, to the
    /// bit.
    #[test]
    fn subarrays_add_up(seed in 0u64..1000) {
        let mut scene = scene();
        scene.partition.case = Case::numbered(1).unwrap();
        scene.input.full_scale_MPa = Some(10.0);
        let frame = drawn(&scene, seed);
        let golden = Golden::reference(&scene).unwrap();
        let model = Model::new(&scene).unwrap();
        let engines: [&dyn Fn(&Frame) -> Forces; 2] =
            [&|frame| golden.run(frame).unwrap().forces_N, &|frame| model.reconstruct(frame).unwrap().forces_N];
        for engine in engines {
            let whole = engine(&frame);
            let mut sum = Forces::zeros(scene.sensor.taxels());
            for part in subarrays(scene.partition.case, &scene.sensor).unwrap() {
                let mut alone = frame.clone();
                alone.stress_MPa.fill(0.0);
                part.scatter(&scene.sensor, &part.gather(&scene.sensor, &frame.stress_MPa), &mut alone.stress_MPa);
                let own = engine(&alone);
                for (sum, own) in [(&mut sum.fx, own.fx), (&mut sum.fy, own.fy), (&mut sum.fz, own.fz)] {
                    sum.iter_mut().zip(own).for_each(|(sum, own)| *sum += own);
                }
            }
            prop_assert_eq!(&whole, &sum);
        }
    }

    /// Without a search the difference between fixed and floating point is bounded by the roundings: ‖Cz⁺‖∞ times an
    /// input LSB, rounding and pruning of the coefficients times n and the peak, an LSB of a vector word.
    #[test]
    fn fixed_stays_near_golden(seed in 0u64..1000) {
        let mut scene = scene();
        scene.search.mu_max = 0.0;
        let frame = drawn(&scene, seed);
        let golden = Golden::reference(&scene).unwrap();
        let model = Model::new(&scene).unwrap();
        let (float, fixed) = (golden.run(&frame).unwrap().forces_N.fz, model.reconstruct(&frame).unwrap().forces_N.fz);
        let (matrices, peak, n) = (golden.matrices().unwrap(), frame.peak_MPa(), float.len());
        let row = |i: usize| (0..n).map(|j| matrices.cz_pinv[(i, j)].abs()).sum::<f64>();
        let norm = (0..n).map(row).fold(0.0, f64::max);
        let largest = (0..n).map(|i| matrices.cz_pinv[(i, i)]).fold(0.0, f64::max);
        let lsb = peak / f64::from(largest_code(scene.fixed.input_bits));
        let coefficient = 0.5 * 2f64.powi(-model.formats().inverse_exponent)
            + 4.0 * largest * 2f64.powi(-(scene.fixed.prune_bits as i32));
        let strongest = float.iter().fold(0.0f64, |most, f| most.max(f.abs()));
        // v_00 has vector_bits for its largest parity, the sum of up to four taxels; the rest is for the dropped low
        // products.
        let word = 4.0 * 4.0 * strongest * 2f64.powi(-(model.formats().vector_bits as i32 - 2));
        let bound = norm * lsb + coefficient * n as f64 * peak + word;
        for (a, b) in float.iter().zip(&fixed) {
            prop_assert!((a - b).abs() <= bound, "{a} {b}, bound {bound}");
        }
        // The bound is meaningful: below a thousandth of the largest force.
        prop_assert!(bound < 1e-3 * strongest, "{bound} {strongest}");
    }
}
