//! Several arrays on one engine: hardware and bit-true models of the arrays, each alone, are equal over a run in which their frames
//! come in any order. Stalls, resets and frames cut short meanwhile are those of `streams.rs`, here with arrays.

use dermis_cosim::drive::Stimulus;
use dermis_cosim::hardware::Hardware;
use dermis_cosim::simulator::Simulator;
use dermis_cosim::stress::stress;
use dermis_cosim::{run, DeviceUnderTest, Vector};
use dermis_golden::data::input::calibration::Calibration;
use dermis_golden::fixed::plan::interval::{frame_interval, longest_wait, longest_wait_with_image};
use dermis_golden::fixed::plan::resources::{Holds, Memory};
use dermis_golden::fixed::stages::load::{beats, Outcome, WORD_BYTES};
use dermis_golden::fixed::{Cycles, Model};
use dermis_golden::spec::scene::{MeanKind, RunningZero, Scene, Zero};
use dermis_hdl::generate_changed;
use dermis_hdl::language::Change;
use dermis_tests::{assert_equal, build_dir, compare, variants, wanted};
use tempfile::TempDir;

const ARRAYS: usize = 4;
const TAXELS: usize = 12;
/// Word of an image of tables that holds the noise floor.
const NOISE_FLOOR_WORD: usize = 2;
/// Frames of a run.
const FRAMES: usize = 100;

/// A scene of `ARRAYS` arrays of 4 × 3 taxels, with more of its hardware and else, and the folder of their tables, which differ in
/// zeros and gains.
pub(crate) fn scene([hardware, more]: [&str; 2]) -> (TempDir, Scene) {
    let folder = tempfile::tempdir().unwrap();
    let text = format!(
        "name = \"arrays\"\n[sensor]\nrows = 4\ncols = 3\npitch_x_mm = 3.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n\
         [hardware]\narrays = {ARRAYS}\n{hardware}[search]\nmu_max = 0.05\n[fixed]\ninput_bits = 16\n{more}"
    );
    let scene = Scene::parse(&text, &folder.path().join("arrays.toml").display().to_string()).unwrap();
    for array in 0..ARRAYS {
        let mut table = Calibration::identity(TAXELS);
        let own = |taxel: usize| (3 * taxel + 5 * array) % 7;
        table.offset.iter_mut().enumerate().for_each(|(taxel, offset)| *offset = 0.01 * own(taxel) as f64 - 0.03);
        table.gain.iter_mut().enumerate().for_each(|(taxel, gain)| *gain = 1.0 - 0.1 * own(taxel) as f64);
        let file = folder.path().join(format!("table-{array}.csv"));
        std::fs::write(file, table.to_csv(&scene.sensor)).unwrap();
    }
    (folder, scene)
}

/// Frames of all arrays in any order: noise on the zero of each, a level of each array that drifts, presses. The array alone says what
/// comes of its frames.
pub(crate) fn vectors(model: &Model) -> Vec<Vector> {
    let mut random = fastrand::Rng::with_seed(5);
    let models: Vec<Model> = (0..ARRAYS).map(|array| model.of_array(array).unwrap()).collect();
    let mut prepared: Vec<_> = models.iter().map(|model| model.prepare.empty()).collect();
    let mut frame = |number: usize| {
        let array = random.usize(..ARRAYS);
        let (model, pressed) = (&models[array], random.u8(..3) == 0);
        let level = ((number as f64 / 20.0 + array as f64).sin() * 900.0) as i32;
        let codes: Vec<i32> = (0..TAXELS)
            .map(|taxel| {
                let zero = model.prepare.zero.as_ref().map_or(0, |zero| zero[taxel]);
                let press = if pressed { 9000 / (1 + taxel as i32) } else { 0 };
                zero + level + press + random.i32(-40..=40)
            })
            .collect();
        model.add(&mut prepared[array], &codes);
        let expected = model.run_prepared(&prepared[array]);
        Vector { array, ..Vector::new(model, format!("{number}, of array {array}"), codes, expected) }
    };
    (0..FRAMES).map(&mut frame).collect()
}

/// Limits of which each array has its own.
const LIMITS: &str =
    "array_noise_floors_MPa = [0.0, 0.001, 0.002, 0.004]\narray_min_forces_N = [0.02, 0.0, 0.05, 0.1]\n";

/// What each array has of its own: more of the hardware, and else.
pub(crate) const SCENES: [(&str, [&str; 2]); 9] = [
    (
        "tables, limits, running zeros and sliding means",
        [
            LIMITS,
            "[input]\naverage = 2\nmean = \"sliding\"\ncalibration = \"table-{array}.csv\"\nfull_scale_MPa = 1.0\n\
         zero = \"running\"\nzero_average = 2\nzero_limit_MPa = 0.02\n",
        ],
    ),
    (
        "tables that are written, running zeros and sliding means",
        [
            "tables = \"writable\"\n",
            "[input]\naverage = 2\nmean = \"sliding\"\ncalibration = \"table-{array}.csv\"\n\
          full_scale_MPa = 1.0\nzero = \"running\"\nzero_average = 2\nzero_limit_MPa = 0.02\n",
        ],
    ),
    ("tables", ["", "[input]\ncalibration = \"table-{array}.csv\"\nfull_scale_MPa = 1.0\n"]),
    (
        "limits, running zeros, two subarrays",
        [
            LIMITS,
            "[partition]\nrows = 2\ncols = 1\n[input]\nfull_scale_MPa = 1.0\nzero = \"running\"\nzero_average = 2\n\
         zero_limit_MPa = 0.02\n",
        ],
    ),
    // Of the shortest frames, several of which wait in the output.
    ("nothing but their number", ["", "[output]\nforces = \"resultants\"\n"]),
    ("sliding means", ["", "[input]\naverage = 3\nmean = \"sliding\"\n"]),
    ("adaptive means", ["", "[input]\naverage = 3\nmean = \"adaptive\"\ntemplate = false\n"]),
    (
        "tables that are written, adaptive means",
        [
            "tables = \"writable\"\n",
            "[input]\naverage = 3\nmean = \"adaptive\"\ntemplate = false\nfull_scale_MPa = 1.0\n",
        ],
    ),
    (
        "tables that are written",
        ["tables = \"writable\"\n", "[output]\nforces = \"resultants\"\n[input]\nfull_scale_MPa = 1.0\n"],
    ),
];

fn hardware(scene: &Scene) -> Hardware {
    Hardware::new(Model::new(scene).unwrap(), &build_dir()).unwrap()
}

#[test]
fn every_array_is_as_if_alone() {
    for (what, more) in variants(&SCENES, 3) {
        let (_folder, scene) = scene(*more);
        let hardware = hardware(&scene);
        let vectors = vectors(&hardware.model);
        for stimulus in [Stimulus::FullSpeed, Stimulus::BackToBack, Stimulus::Stalls { seed: 3 }] {
            assert_equal(&compare(&hardware, Simulator::Verilator, &vectors, stimulus), format!("{what}, {stimulus}"));
        }
        assert_equal(&compare(&hardware, Simulator::Kernel, &vectors, Stimulus::FullSpeed), format!("{what}, kernel"));
        // Another array would have given other forces, where it has something of its own.
        if scene.input.calibration.is_some() || scene.hardware.states_limits_of_each_array() {
            let other =
                |vector: &Vector| hardware.model.of_array((vector.array + 1) % ARRAYS).unwrap().run(&vector.codes);
            let first = &vectors[0];
            assert_ne!(first.expected.beats, other(first).beats, "{what}");
        }
    }
}

/// A frame of each array, loaded above the noise floor of any.
fn one_of_each(model: &Model) -> Vec<Vector> {
    let mut frames = vectors(model);
    frames.truncate(ARRAYS);
    frames.iter_mut().for_each(|vector| vector.codes.fill(12_000));
    frames
}

/// Cycles from the first input beat to the last output beat of `vectors`, back to back, on an idle engine.
fn taken(hardware: &Hardware, vectors: &[Vector]) -> u64 {
    let mut device = hardware.device_for(Simulator::Verilator, vectors, 1).unwrap();
    let (taps, vectors) = hardware.observable(Simulator::Verilator, vectors);
    let dut = DeviceUnderTest { name: "verilator", device: device.as_mut(), taps: &taps };
    let (_, times) = run(dut, &vectors, Stimulus::BackToBack);
    times[times.len() - 1].last_out.unwrap() - times[0].first_in.unwrap() + 1
}

/// What was taken is within the bound, and no more than an interval away.
fn is_near(what: &str, model: &Model, taken: u64, bound: u64) {
    let interval = frame_interval(model, model.first());
    assert!(taken <= bound && taken + interval >= bound, "{what}: {taken} of {bound}, interval {interval}");
}

/// The bound that `dermis check` prints.
#[test]
fn frames_that_come_at_once_are_answered_within_the_bound() {
    for (what, more) in variants(&SCENES, 1) {
        let (_folder, scene) = scene(*more);
        let hardware = hardware(&scene);
        let model = &hardware.model;
        is_near(what, model, taken(&hardware, &one_of_each(model)), longest_wait(model));
    }
}

/// The same with an image of tables at each place among the frames.
#[test]
fn an_image_among_frames_delays_them_by_no_more_than_the_bound() {
    let written: Vec<_> = SCENES.iter().filter(|(_, [hardware, _])| hardware.contains("writable")).collect();
    for (what, more) in variants(&written, 1) {
        let (_folder, scene) = scene(*more);
        let hardware = hardware(&scene);
        let model = &hardware.model;
        let image = Vector { array: 1, ..Vector::of_image(&model.of_array(1).unwrap()) };
        let at = |place: usize| {
            let mut vectors = one_of_each(model);
            vectors.insert(place, image.clone());
            taken(&hardware, &vectors)
        };
        let most = (0..ARRAYS).map(at).max().unwrap();
        is_near(what, model, most, longest_wait_with_image(model).unwrap());
    }
}

/// A damaged image leaves its noise floor in the hardware, while every stress of its array is 0. The bit above the largest floor is
/// not a sign: above a negative floor a stress of 0 is, and its frame would be searched, which the model does not do.
#[test]
fn a_damaged_noise_floor_starts_no_search() {
    let (_folder, scene) = scene(SCENES[1].1);
    let hardware = hardware(&scene);
    let [mut spoiled, other] = [1, 2].map(|array| hardware.model.of_array(array).unwrap());
    let mut image = Vector { array: 1, ..Vector::of_image(&spoiled) };
    let bit = 8 * NOISE_FLOOR_WORD * WORD_BYTES + spoiled.formats().input_bits as usize - 1;
    let mut bytes = spoiled.image();
    bytes[bit / 8] ^= 1 << (bit % 8);
    image.codes = beats(&bytes, spoiled.formats().code_bits);
    assert_eq!(spoiled.load(&bytes), Outcome::Broken);
    let codes = || (0..TAXELS as i32).map(|taxel| 9000 / (1 + taxel)).collect::<Vec<_>>();
    let frame = |model: &Model, array: usize| {
        let expected = model.run(&codes());
        Vector { array, ..Vector::new(model, format!("a frame of array {array}"), codes(), expected) }
    };
    let vectors = [image, frame(&spoiled, 1), frame(&other, 2)];
    let [_, unsearched, searched] = vectors.each_ref().map(|vector| vector.expected.cycles.total);
    assert!(unsearched < searched && searched == Cycles::longest(&hardware.model).total);
    for stimulus in [Stimulus::FullSpeed, Stimulus::BackToBack] {
        assert_equal(&compare(&hardware, Simulator::Verilator, &vectors, stimulus), stimulus);
    }
}

/// Frames of arrays in any order, 10⁴ of them in `make stress`: gaps, back-pressure, damaged frames, resets at every cycle.
#[test]
fn an_array_that_is_damaged_harms_no_other() {
    for (what, more) in variants(&SCENES, 2) {
        let (_folder, scene) = scene(*more);
        let outcomes = stress(&hardware(&scene), &[], wanted("DERMIS_STRESS_CYCLES", 150_000), 1).unwrap();
        for outcome in &outcomes {
            assert!(outcome.violations == 0 && outcome.frames_out > 100, "{what}: {outcome:#?}");
            assert!(
                outcome.experiment != "tables" || outcome.images.min(outcome.images_broken) > 10,
                "{what}: {outcome:#?}"
            );
            assert!(outcome.experiment != "tlast" || outcome.cut.min(outcome.flagged) > 10, "{what}: {outcome:#?}");
        }
    }
}

#[test]
fn a_defect_is_found() {
    let (_folder, scene) = scene(SCENES[0].1);
    let mut hardware = hardware(&scene);
    let vectors = vectors(&hardware.model);
    let [calibrate, average] = ["prepare__calibrate", "prepare__average"];
    let defects = [
        // All arrays have the table and the drift of the first, or its mean; the array is that of the last beat; the number of a
        // frame is that of the one in the passes; so are its noise floor and its threshold.
        Change::value(calibrate, "place", |k| k.named("taxel").extend(6)),
        Change::value(average, "place", |k| k.named("taxel").extend(6)),
        Change::value("prepare__frame_array", "begins", |k| k.constant(1, 1)),
        Change::value("", "sent_arrays__word", |k| k.named("frame_array__held")),
        Change::value("", "received_floor__enable", |k| k.constant(1, 0)),
        Change::value("", "sent_array__enable", |k| k.constant(1, 0)),
    ];
    for defect in variants(&defects, 2) {
        hardware.generated = generate_changed(&hardware.model, std::slice::from_ref(defect)).unwrap();
        let found = compare(&hardware, Simulator::Verilator, &vectors, Stimulus::BackToBack);
        assert!(!found.is_equal(), "not found: {defect}");
    }
}

/// Formats, products and cycles are those of one array; only memories that have a word for each taxel are longer.
#[test]
fn arrays_take_memory_alone() {
    let of = |arrays: usize| {
        let mut scene = Scene::builtin("sensor-1-noisy").unwrap();
        scene.hardware.arrays = arrays;
        (scene.input.average, scene.input.mean, scene.input.full_scale_MPa) = (4, MeanKind::Sliding, Some(1.0));
        scene.input.zero = Zero::Running(RunningZero { average: 8, limit_MPa: 0.01 });
        Model::new(&scene).unwrap()
    };
    let [one, sixteen] = [1, 16].map(of);
    assert_eq!((one.formats(), Cycles::longest(&one)), (sixteen.formats(), Cycles::longest(&sixteen)));
    assert_eq!(one.resources.multipliers, sixteen.resources.multipliers);
    let own = |memory: &&Memory| matches!(memory.holds, Holds::Calibration | Holds::Drift | Holds::Average);
    let [small, large] = [&one, &sixteen].map(|model| model.resources.memories.iter().filter(own).collect::<Vec<_>>());
    assert_eq!(small.len(), 2);
    assert!(small.iter().zip(&large).all(|(one, all)| one.words == 100 && all.words == 15 * 128 + 100));
    let others =
        |model: &Model| model.resources.memories.iter().filter(|memory| !own(memory)).cloned().collect::<Vec<_>>();
    assert_eq!(others(&one), others(&sixteen));
}
