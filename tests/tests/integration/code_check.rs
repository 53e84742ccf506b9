//! Checks of the codes of a frame: hardware and bit-true model raise the same flags over a run of sound and faulty frames, at full
//! speed, back to back and with stalls, wherever the frames go from one stage to the next.

use dermis_cosim::drive::Stimulus;
use dermis_cosim::hardware::Hardware;
use dermis_cosim::simulator::Simulator;
use dermis_cosim::Vector;
use dermis_golden::data::input::calibration::Calibration;
use dermis_golden::fixed::stages::send::Status;
use dermis_golden::fixed::Model;
use dermis_golden::result::flags::{Flag, FlagSet};
use dermis_golden::spec::scene::Scene;
use dermis_hdl::generate_changed;
use dermis_hdl::language::Change;
use dermis_tests::{assert_equal, build_dir, compare, variants};
use tempfile::TempDir;

const ROWS: usize = 4;
const COLS: usize = 5;
const TAXELS: usize = ROWS * COLS;
/// Frames of a run.
const FRAMES: usize = 24;

/// A scene of 4 × 5 taxels and the folder of its table.
fn scene(more: &str) -> (TempDir, Scene) {
    let folder = tempfile::tempdir().unwrap();
    let text = format!(
        "name = \"code-check\"\n[sensor]\nrows = {ROWS}\ncols = {COLS}\npitch_x_mm = 3.0\npitch_y_mm = 4.0\n\
         thickness_mm = 3.0\n[fixed]\ninput_bits = 16\n{more}\nfull_scale_MPa = 1.0\n"
    );
    let scene = Scene::parse(&text, &folder.path().join("check.toml").display().to_string()).unwrap();
    let mut table = Calibration::identity(TAXELS);
    table.offset.iter_mut().enumerate().for_each(|(taxel, offset)| *offset = 0.01 * (taxel % 7) as f64);
    table.gain.iter_mut().enumerate().for_each(|(taxel, gain)| *gain = -[1.0, 0.7, 0.9][taxel % 3]);
    std::fs::write(folder.path().join("table.csv"), table.to_csv(&scene.sensor)).unwrap();
    (folder, scene)
}

/// A press at another place in each frame: one of four is clipped, one has a row twice, one a column, one is sound.
fn codes(model: &Model) -> Vec<i32> {
    let falls = model.prepare.gain.is_some();
    let mut random = fastrand::Rng::with_seed(21);
    let mut frame = |number: usize| {
        let [top, left] = [ROWS, COLS].map(|count| random.usize(1..count - 1));
        let code = |k: usize| {
            let [down, right] = [(k / COLS).abs_diff(top), (k % COLS).abs_diff(left)].map(|off| off as i32);
            9000 - 1700 * down * down - 1100 * right * right + (k * k) as i32
        };
        let mut codes: Vec<i32> = (0..TAXELS).map(code).collect();
        // The least step.
        codes[1] = codes[0] + 1;
        let mut sorted = codes.clone();
        sorted.sort_unstable();
        match number % 4 {
            1 => codes.iter_mut().for_each(|code| *code = (*code).min(sorted[TAXELS - 6])),
            2 => codes.copy_within(COLS * (top - 1)..COLS * top, COLS * top),
            3 => (0..ROWS).for_each(|row| codes[COLS * row + left + 1] = codes[COLS * row + left]),
            _ => {}
        }
        if falls {
            codes.iter_mut().for_each(|code| *code = !*code);
        }
        codes
    };
    (0..FRAMES).flat_map(&mut frame).collect()
}

fn vectors(model: &Model) -> Vec<Vector> {
    let codes = codes(model);
    let vector = |all: &[i32]| {
        let newest = model.scene.input.frames_per_result() * TAXELS;
        let last = all[all.len() - newest..].to_vec();
        Vector::new(model, format!("{} frames", all.len() / TAXELS), last, model.run(all))
    };
    let frames: Vec<&[i32]> = codes.chunks(TAXELS).collect();
    let mut taken = 0;
    let of_result = |frames: &&[&[i32]]| {
        taken = if model.scene.input.has_memory() { 0 } else { taken };
        let of_frames = &codes[TAXELS * taken..][..TAXELS * frames.len()];
        taken += frames.len();
        vector(of_frames)
    };
    model.scene.input.frames_of_results(&frames).iter().map(of_result).collect()
}

fn raised(vector: &Vector) -> FlagSet {
    Status::all(&vector.expected.status).next().unwrap().raised
}

const SCENES: [(&str, &str); 8] = [
    ("one subarray", "[search]\nmu_max = 0.05\n[input]"),
    ("blocks, of which the next begins while one waits", "[search]\nmu_max = 0.05\n[input]\naverage = 1"),
    ("two rows of subarrays", "[search]\nmu_max = 0.05\n[partition]\nrows = 2\ncols = 1\n[input]"),
    ("negative gains, a dead taxel", "[search]\nmu_max = 0.05\n[input]\ncalibration = \"table.csv\"\ndead = [[3, 4]]"),
    ("blocks, without a search", "[search]\nmu_max = 0.0\n[partition]\nrows = 2\ncols = 1\n[input]\naverage = 1"),
    (
        "short frames of resultants",
        "[search]\nmu_max = 0.0\n[partition]\nrows = 2\ncols = 1\n[output]\nforces = \"resultants\"\n[input]",
    ),
    ("a sliding mean", "[search]\nmu_max = 0.05\n[input]\naverage = 2\nmean = \"sliding\""),
    ("an adaptive mean", "[search]\nmu_max = 0.05\n[input]\naverage = 3\nmean = \"adaptive\"\ntemplate = false"),
];

#[test]
fn faults_of_codes_are_in_the_status_of_their_frame() {
    for (what, more) in variants(&SCENES, 2) {
        let (_folder, scene) = scene(more);
        let hardware = Hardware::new(Model::new(&scene).unwrap(), &build_dir()).unwrap();
        let vectors = vectors(&hardware.model);
        for stimulus in [Stimulus::FullSpeed, Stimulus::BackToBack, Stimulus::Stalls { seed: 5 }] {
            assert_equal(&compare(&hardware, Simulator::Verilator, &vectors, stimulus), format!("{what}, {stimulus}"));
        }
        assert_equal(&compare(&hardware, Simulator::Kernel, &vectors, Stimulus::BackToBack), format!("{what}, kernel"));
        // Of blocks of two either frame may have them.
        let flags: Vec<FlagSet> = vectors.iter().map(raised).collect();
        assert!(flags.iter().any(|flags| flags.contains(Flag::Clipped)), "{what}");
        assert!(flags.iter().any(|flags| flags.contains(Flag::LineFault)), "{what}");
        let sound = |flags: &&FlagSet| !flags.contains(Flag::Clipped) && !flags.contains(Flag::LineFault);
        assert!(scene.input.average == 1 || flags.iter().filter(sound).count() > 1, "{what}");
    }
}

#[test]
fn a_defect_is_found() {
    let (_folder, scene) = scene(SCENES[0].1);
    let mut hardware = Hardware::new(Model::new(&scene).unwrap(), &build_dir()).unwrap();
    let vectors = vectors(&hardware.model);
    let defects = [
        // What a frame raised is lost; that of the next one is sent; codes that are not accepted count.
        Change::value("", "sent_faults__word", |k| k.constant(2, 0)),
        Change::value("", "searched_faults__word", |k| k.named("check__faults")),
        Change::value("", "check__accept", |k| k.named("s_axis_tvalid")),
    ];
    for defect in variants(&defects, 1) {
        hardware.generated = generate_changed(&hardware.model, std::slice::from_ref(defect)).unwrap();
        let found = compare(&hardware, Simulator::Verilator, &vectors, Stimulus::BackToBack);
        assert!(!found.is_equal(), "not found: {defect}");
    }
}

/// The engines and scenes that do not have the check have no bits for it.
#[test]
fn hardware_without_the_check_raises_nothing() {
    let plain = "[search]\nmu_max = 0.05\n";
    let scenes = [
        format!("{plain}[hardware]\ncode_check = \"off\"\n[input]"),
        format!("{plain}[hardware]\ntables = \"writable\"\n[input]"),
    ];
    for more in scenes {
        let (_folder, scene) = scene(&more);
        let model = Model::new(&scene).unwrap();
        assert!(vectors(&model).iter().all(|vector| raised(vector) == FlagSet::default()), "{more}");
    }
    let serial =
        "name = \"serial\"\n[sensor]\nrows = 4\ncols = 4\npitch_x_mm = 3.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n\
                  [hardware]\nboard = \"icebreaker\"\n";
    assert_eq!(Model::new(&Scene::parse(serial, "serial.toml").unwrap()).unwrap().prepare.check, None);
}
