//! Scenes of other shapes, degrees, formats and options than the built-in ones are equal to the bit as well.
//!
//! A few go through Verilator and the kernel simulation; many random ones through kernel simulation alone, which
//! needs no compiler.

use dermis_cosim::drive::Stimulus;
use dermis_cosim::hardware::Hardware;
use dermis_cosim::simulator::Simulator;
use dermis_cosim::verify::verify;
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Scene;
use dermis_tests::{assert_equal, build_dir, compare, variants, with_network};
use proptest::prelude::*;

/// Name, and the difference from a default scene of 6×6 taxels; those behind the first eight run in `make nightly`.
const SCENES: [(&str, &str); 18] = [
    // One quad: a longer pause between accumulations.
    ("2x2", "[sensor]\nrows = 2\ncols = 2\npitch_x_mm = 4.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n"),
    // Six subarrays in turn, odd rows, under a bonded layer.
    (
        "partition",
        "[sensor]\nrows = 10\ncols = 12\npitch_x_mm = 2.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n\
         [medium]\nkind = \"bonded-layer\"\n[partition]\nrows = 2\ncols = 3\n",
    ),
    // Ax is used for Ay, and columns are left out.
    ("thin", "[sensor]\nrows = 12\ncols = 12\npitch_x_mm = 8.0\npitch_y_mm = 8.0\nthickness_mm = 0.91\n[fixed]\nprune_bits = 12\n"),
    // A sliding mean, resultants in the status of several subarrays, under an almost incompressible layer.
    (
        "sliding-resultants",
        "[medium]\nkind = \"bonded-layer\"\npoisson = 0.499\n[input]\naverage = 1\nmean = \"sliding\"\n[output]\nforces = \"resultants\"\n[partition]\nrows = 3\ncols = 2\n",
    ),
    // No limbs, the smallest words.
    ("narrow", "[fixed]\ninput_bits = 8\ndata_bits = 12\ncoef_bits = 8\ninverse_bits = 8\n"),
    // One taxel per cycle, among them copies on middle lines, under a compressible layer.
    ("one-taxel", "[sensor]\nrows = 5\ncols = 7\npitch_x_mm = 2.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n[medium]\nkind = \"bonded-layer\"\npoisson = 0.3\n[hardware]\nsearch_width = 1\n"),
    (
        "thresholds",
        "[partition]\ncondition = \"both-signs\"\n[threshold]\nmin_force_N = 0.05\n[search]\nnoise_floor_MPa = 0.001\n\
         [input]\nfull_scale_MPa = 0.05\n",
    ),
    // The network for many sensors, whose window is larger than the array.
    (
        "many-sensors",
        "[sensor]\nrows = 6\ncols = 8\npitch_x_mm = 4.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n\
         [medium]\nkind = \"bonded-layer\"\n[search]\nnetwork = \"dermis:bonded\"\n[hardware]\nestimator = \"network\"\n",
    ),
    // Two quads: sweeps shorter than the pipeline that follows them.
    ("2x3", "[sensor]\nrows = 2\ncols = 3\npitch_x_mm = 4.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n"),
    // Middle lines: quads whose lanes coincide.
    ("odd", "[sensor]\nrows = 5\ncols = 7\npitch_x_mm = 2.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n"),
    // Degree 1: with a small r, seven of ten coefficients are absent.
    ("degree-1", "[search]\nmu_max = 0.05\n"),
    // No search, in two subarrays.
    ("no-search", "[search]\nmu_max = 0\n[partition]\ncase = 2\n"),
    // Resultants per subarray instead of forces.
    ("resultants", "[output]\nforces = \"resultants\"\n[partition]\nrows = 3\ncols = 2\n"),
    // Sums of two frames, which overflow no word.
    ("averaged", "[input]\naverage = 1\n"),
    // A sliding mean of as few taxels as there can be: a word is read again soon after it was written.
    (
        "sliding",
        "[sensor]\nrows = 2\ncols = 2\npitch_x_mm = 4.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n[input]\naverage = 2\n\
         mean = \"sliding\"\n",
    ),
    // An adaptive mean of a frame, which has its window from the third frame on.
    (
        "adaptive",
        "[sensor]\nrows = 3\ncols = 2\npitch_x_mm = 4.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n[input]\n\
         mean = \"adaptive\"\ntemplate = false\n",
    ),
    // A low limb of Cz⁺ and none of the input.
    ("16-bit", "[fixed]\ninput_bits = 16\ndata_bits = 16\ncoef_bits = 16\ninverse_bits = 24\n"),
    // Two taxels per cycle in the search, in two subarrays.
    ("two-taxels", "[hardware]\nsearch_width = 2\n[partition]\ncase = 2\n"),
];

fn parse(name: &str, text: &str) -> Scene {
    let sensor = "[sensor]\nrows = 6\ncols = 6\npitch_x_mm = 3.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n";
    let sensor = if text.contains("[sensor]") { "" } else { sensor };
    Scene::parse(&format!("name = \"{name}\"\n{sensor}{text}"), name).unwrap()
}

/// The stress of a reproducible pressure with shear at some position on the array.
fn frames(scene: &Scene) -> Vec<Frame> {
    let sensor = &scene.sensor;
    let at = |centre: [f64; 2], shear: f64| {
        let stress = (0..sensor.taxels()).map(|t| {
            let [x, y] = sensor.position_mm(t / sensor.cols, t % sensor.cols);
            let (dx, dy) = ((x - centre[0]) / 4.0, (y - centre[1]) / 4.0);
            0.05 * (-dx * dx - dy * dy).exp() * (1.0 + shear * dx)
        });
        Frame::from_stress(&format!("{centre:?}"), sensor, stress.collect()).unwrap()
    };
    vec![Frame::eq2(sensor), at([1.0, -2.0], 0.4), at([-4.0, 3.0], -2.0), at([2.0, 2.0], 0.0)]
}

#[test]
fn the_scenes_have_the_limbs_they_are_here_for() {
    for (name, limbs) in [("narrow", [false, false]), ("16-bit", [false, true]), ("odd", [true, true])] {
        let (_, text) = SCENES.iter().find(|(n, _)| *n == name).unwrap();
        let formats = Model::new(&parse(name, text)).unwrap().formats().clone();
        assert_eq!([formats.input_low_bits > 0, formats.inverse_low_bits > 0], limbs, "{name}");
    }
}

#[test]
fn unlike_scenes_are_equal() {
    let mut intervals = 0;
    let scenes = variants(&SCENES, 8);
    for (name, text) in scenes {
        let scene = parse(name, text);
        let simulators = [Simulator::Verilator, Simulator::Kernel];
        // As many averaged frames as others: the interval is measured from the second one on.
        let frames = vec![frames(&scene); 1 << scene.input.average].concat();
        let verified = verify(&scene, &frames, &simulators, &build_dir()).unwrap();
        assert_equal(&verified.findings, name);
        // Planned for frames of which every subarray is searched.
        if verified.rows.iter().all(|row| row.fixed.subarrays.iter().all(|part| part.centroid_condition)) {
            assert_eq!(verified.frame_interval, Some(verified.planned_interval), "{name}");
            intervals += 1;
        }
    }
    assert_eq!(intervals, scenes.len() - 1, "all but the one with thresholds");
}

/// Tension reads as zero, in the model and in the hardware, also beside a dead taxel.
#[test]
fn a_unipolar_array_is_equal() {
    let text = "name = \"unipolar\"\n[sensor]\nrows = 4\ncols = 5\npitch_x_mm = 2.0\npitch_y_mm = 2.0\n\
                thickness_mm = 2.0\n[input]\nunipolar = true\ndead = [[1, 2]]\n";
    let (scene, _file) = with_network(text, &[9]);
    let frames = frames(&scene);
    let simulators = [Simulator::Verilator, Simulator::Kernel];
    assert_equal(&verify(&scene, &frames, &simulators, &build_dir()).unwrap().findings, text);
    let model = Model::for_frames(&scene, &frames).unwrap();
    let mut clipped = 0;
    for frame in &frames {
        let codes = model.readings(std::slice::from_ref(frame)).unwrap();
        let none: Vec<i32> = codes.iter().map(|&code| code.max(0)).collect();
        clipped += usize::from(none != codes);
        assert_eq!(model.run(&codes), model.run(&none));
    }
    assert!(clipped > 0, "no frame has tension");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn random_scenes_and_codes_are_equal(
        (rows, cols) in (2usize..9, 2usize..9),
        mu_max in 0.02f64..0.6,
        (input_bits, data_bits, coef_bits, inverse_bits) in (8u32..=20, 12u32..=18, 8u32..=18, 18u32..=26),
        search_width in prop::sample::select(vec![4, 2, 1]),
        seed in any::<u64>(),
    ) {
        let sensor = format!(
            "[sensor]\nrows = {rows}\ncols = {cols}\npitch_x_mm = 4.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n"
        );
        let fixed = format!(
            "[fixed]\ninput_bits = {input_bits}\ndata_bits = {data_bits}\ncoef_bits = {coef_bits}\n\
             inverse_bits = {inverse_bits}\n[search]\nmu_max = {mu_max}\n[hardware]\nsearch_width = {search_width}\n"
        );
        let model = Model::new(&parse("random", &(sensor + &fixed))).unwrap();
        let hardware = Hardware::new(model, &build_dir()).unwrap();
        // Codes from a small generator: values, extremes and zeros in turn.
        let most = (1i64 << (input_bits - 1)) - 1;
        let mut state = seed;
        let codes: Vec<i32> = (0..rows * cols)
            .map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (match state >> 61 {
                    0 => most,
                    1 => -most - 1,
                    2 => 0,
                    _ => (state >> 20) as i64 % (2 * most) - most,
                }) as i32
            })
            .collect();
        let expected = hardware.model.run(&codes);
        let vectors = [dermis_cosim::Vector::new(&hardware.model, "random".into(), codes, expected)];
        let findings = compare(&hardware, Simulator::Kernel, &vectors, Stimulus::FullSpeed);
        prop_assert!(findings.is_equal(), "{:?}", findings.kept.first().map(ToString::to_string));
    }
}

/// Readings of a sensor with a zero and a gain per taxel, and its table and tare frame.
#[test]
fn calibrated_readings_are_equal_and_give_the_forces_of_the_stress() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    // Without a search the forces are linear in the stress, so rounding errors stay small.
    let plain = parse("plain", "[search]\nmu_max = 0\n");
    let stress = frames(&plain);
    let sensor = &plain.sensor;
    let zero = |t: usize| 0.004 * ((t * 7 % 11) as f64 - 5.0);
    let gain = |t: usize| if t == 3 { -0.8 } else { 0.5 + 0.1 * (t * 5 % 9) as f64 };
    let line = |t: usize| format!("{},{},{},{}\n", t / sensor.cols, t % sensor.cols, zero(t), gain(t));
    let table: String = (0..sensor.taxels()).map(line).collect();
    std::fs::write(folder.path().join("table.csv"), format!("row,col,offset,gain\n{table}")).unwrap();
    let row = |r: usize| {
        let zeros = (0..sensor.cols).map(|c| (2.0 * zero(r * sensor.cols + c)).to_string());
        zeros.collect::<Vec<_>>().join(",") + "\n"
    };
    std::fs::write(folder.path().join("tare.csv"), (0..sensor.rows).map(row).collect::<String>()).unwrap();

    let reading = |frame: &Frame, zeros: f64, gains: bool| {
        let of = |(t, b): (usize, &f64)| b / if gains { gain(t) } else { 1.0 } + zeros * zero(t);
        let readings = frame.stress_MPa.iter().enumerate().map(of).collect();
        Frame::from_stress(&frame.id, sensor, readings).unwrap()
    };
    let tests = [
        ("table", "calibration = \"table.csv\"\n", 1.0, true),
        ("tare", "tare = \"tare.csv\"\n", 2.0, false),
        ("both", "calibration = \"table.csv\"\ntare = \"tare.csv\"\naverage = 1\n", 2.0, true),
    ];
    let exact = Model::for_frames(&plain, &stress).unwrap();
    for (name, options, zeros, gains) in tests {
        let text = format!(
            "name = \"{name}\"\n[sensor]\nrows = 6\ncols = 6\npitch_x_mm = 3.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n\
             [search]\nmu_max = 0\n[input]\n{options}"
        );
        let scene = Scene::parse(&text, path.to_str().unwrap()).unwrap();
        let mut readings: Vec<Frame> = stress.iter().map(|frame| reading(frame, zeros, gains)).collect();
        if scene.input.average > 0 {
            readings = readings.into_iter().flat_map(|frame| [frame.clone(), frame]).collect();
        }
        let simulators = [Simulator::Verilator, Simulator::Kernel];
        let verified = verify(&scene, &readings, &simulators, &build_dir()).unwrap();
        assert_equal(&verified.findings, name);
        // Rounding to codes with a scale up to a few times coarser, through an inverse of condition 10².
        for (row, frame) in verified.rows.iter().zip(&stress) {
            let (own, wanted) = (&row.fixed.resultant_N, &exact.reconstruct(frame).unwrap().resultant_N);
            assert!((own[2] - wanted[2]).abs() <= 1e-3 * wanted[2].abs().max(1e-3), "{name}: {own:?} {wanted:?}");
        }
    }
}
