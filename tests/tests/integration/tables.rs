//! Tables that are written at run time: the hardware equals the model before an image, after it, and while its tables are not
//! whole; without a reset in between, at full speed, back to back and with stalls.

use std::fs;

use dermis_cosim::drive::Stimulus;
use dermis_cosim::hardware::Hardware;
use dermis_cosim::simulator::Simulator;
use dermis_cosim::Vector;
use dermis_golden::data::input::calibration::Calibration;
use dermis_golden::fixed::stages::load::{beats, Outcome};
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::{Scene, TableStorage};
use dermis_hdl::generate_changed;
use dermis_hdl::language::Change;
use dermis_tests::{assert_equal, build_dir, compare, variants, with_network};
use tempfile::TempDir;

pub const SCENE: &str = "name = \"writable\"\n[sensor]\nrows = 4\ncols = 6\npitch_x_mm = 2.0\npitch_y_mm = 2.0\n\
                     thickness_mm = 2.0\n[hardware]\ntables = \"writable\"\n[hardware.table_range]\ngain = [0.5, 2.0]\n";

/// Coefficients are written.
pub const COVERS: &str = "thickness_mm = [1.5, 2.5]\ndead_taxels = 3\n[input]\nfull_scale_MPa = 1.0\n";
/// The same with two subarrays, which share them.
const PARTS: &str = "thickness_mm = [2.0, 2.5]\n[partition]\nrows = 2\ncols = 1\n[input]\nfull_scale_MPa = 1.0\n";

/// A specimen of the array of `scene`: another zero and gain for each taxel, a noise floor, a threshold; another cover and dead
/// taxels if its hardware has them.
pub fn specimen(scene: &Scene) -> (TempDir, Scene) {
    let folder = tempfile::tempdir().unwrap();
    let mut random = fastrand::Rng::with_seed(5);
    let mut table = Calibration::identity(scene.sensor.taxels());
    table.gain.iter_mut().for_each(|gain| *gain = 0.5 + 1.5 * random.f64());
    table.offset.iter_mut().for_each(|offset| *offset = 0.002 * random.f64() - 0.001);
    let path = folder.path().join("table.csv");
    fs::write(&path, table.to_csv(&scene.sensor)).unwrap();
    let mut specimen = scene.clone();
    specimen.input.calibration = Some(path);
    (specimen.search.noise_floor_MPa, specimen.threshold.min_force_N) = (Some(0.01), 0.02);
    if let Some([_, most]) = scene.hardware.table_range.thickness_mm {
        specimen.sensor.thickness_mm = most;
    }
    if scene.hardware.table_range.dead_taxels > 0 {
        specimen.input.dead = vec![[0, 0], [1, 2]];
    }
    (folder, specimen)
}

/// A frame of noise alone.
const NOISE: u64 = 6;

/// The last of frames of a press and noise, as codes, and what `model` makes of all since a reset.
fn frame(model: &Model, numbers: &[u64]) -> Vector {
    let taxels = model.scene.sensor.taxels();
    let codes: Vec<i32> = numbers.iter().flat_map(|&number| codes(model, number)).collect();
    let last = codes[codes.len() - taxels..].to_vec();
    Vector::new(model, format!("frame {numbers:?}"), last, model.run(&codes))
}

fn codes(model: &Model, number: u64) -> Vec<i32> {
    let mut random = fastrand::Rng::with_seed(number);
    let sensor = &model.scene.sensor;
    let press = if number == NOISE { 0 } else { 1i32 << 17 };
    let [row, col] = [random.usize(..sensor.rows), random.usize(..sensor.cols)];
    let code = |taxel: usize| {
        let away = (taxel / sensor.cols).abs_diff(row) + (taxel % sensor.cols).abs_diff(col);
        (press >> (2 * away).min(17)) + random.i32(-2000..2000)
    };
    (0..sensor.taxels()).map(code).collect()
}

/// Hardware of `scene`, and its frames around images: of a specimen, damaged, for other hardware.
fn sequence(scene: &Scene) -> (Hardware, Vec<Vector>) {
    let (_folder, own) = specimen(scene);
    let built = Model::new(scene).unwrap();
    let own = built.with_tables(&own, 1234).unwrap();
    let damaged = |at: usize| {
        let mut vector = Vector::of_image(&own);
        let mut image = own.image();
        image[at] ^= 16;
        vector.codes = beats(&image, own.formats().code_bits);
        (vector, image)
    };
    let [(other, other_image), (broken, broken_image)] = [1, own.image().len() - 20].map(damaged);
    let mut refused = built.clone();
    assert_eq!(refused.load(&other_image), Outcome::Refused);
    let mut spoiled = own.clone();
    assert_eq!(spoiled.load(&broken_image), Outcome::Broken);
    // Only a refused image leaves a sliding mean and a running zero as they were.
    let [second, last] = if scene.input.has_memory() { [&[NOISE, 2][..], &[NOISE, 5]] } else { [&[2][..], &[5]] };
    let vectors = vec![
        frame(&built, &[NOISE]),
        other,
        frame(&refused, second),
        Vector::of_image(&own),
        frame(&own, &[3]),
        broken,
        frame(&spoiled, &[4]),
        Vector::of_image(&own),
        frame(&own, &[NOISE]),
        frame(&own, last),
    ];
    assert!(frame(&own, &[3]).expected.beats != frame(&built, &[3]).expected.beats, "the tables matter");
    assert!(frame(&spoiled, &[4]).expected.beats.iter().all(|force| *force == [0; 3]));
    (Hardware::new(built, &build_dir()).unwrap(), vectors)
}

fn is_equal(scene: &Scene, what: &str) {
    let (hardware, vectors) = sequence(scene);
    for stimulus in [Stimulus::FullSpeed, Stimulus::BackToBack, Stimulus::Stalls { seed: 3 }] {
        assert_equal(&compare(&hardware, Simulator::Verilator, &vectors, stimulus), format!("{what}, {stimulus}"));
    }
    assert_equal(&compare(&hardware, Simulator::Kernel, &vectors, Stimulus::FullSpeed), format!("{what}, kernel"));
}

#[test]
fn hardware_with_loaded_tables_is_the_specimen_s() {
    let full_scale = "[input]\nfull_scale_MPa = 1.0\n";
    let sliding = "[partition]\nrows = 2\ncols = 1\n[input]\nfull_scale_MPa = 1.0\naverage = 2\nmean = \"sliding\"\n";
    let adaptive = "[input]\nfull_scale_MPa = 1.0\naverage = 3\nmean = \"adaptive\"\ntemplate = false\n";
    let running = "[input]\nfull_scale_MPa = 1.0\nzero = \"running\"\nzero_average = 1\nzero_limit_MPa = 0.05\n";
    let scenes = [
        (COVERS, "another cover, dead taxels"),
        (sliding, "two subarrays, sliding mean"),
        (adaptive, "an adaptive mean"),
        (running, "a running zero"),
        (PARTS, "another cover, two subarrays"),
        (full_scale, "whole array"),
    ];
    for (more, what) in variants(&scenes, 1) {
        is_equal(&Scene::parse(&format!("{SCENE}{more}"), "writable.toml").unwrap(), what);
    }
    let contacts = "[search]\nmu_max = 0.3\n[partition]\ncase = \"contacts\"\n[input]\nfull_scale_MPa = 1.0\n";
    let (scene, _network) = with_network(&format!("{SCENE}{contacts}"), &[7]);
    assert_eq!(scene.hardware.tables, TableStorage::Writable);
    is_equal(&scene, "contacts");
}

#[test]
fn a_defect_is_found() {
    let scene = Scene::parse(&format!("{SCENE}{COVERS}"), "writable.toml").unwrap();
    let (mut hardware, vectors) = sequence(&scene);
    let defects = [
        // A damaged image counts as whole.
        Change::value("prepare__load", "wrong_crc", |k| k.constant(1, 0)),
        // An image begins while a frame is computed.
        Change::value("prepare", "load__idle", |k| k.constant(1, 1)),
        // The noise floor stays that of the bitstream.
        Change::value("", "receive__floor", |k| k.constant(19, 0)),
        // The threshold stays that of the bitstream.
        Change::value("", "forces__threshold", |k| k.constant(32, 0)),
        // The coefficients stay those of the bitstream.
        Change::value("pass", "lanes__coefficient_write", |k| k.constant(1, 0)),
        // The upper of two coefficients is that of the lower.
        Change::value("pass", "lanes__coefficient_data", |k| k.named("coefficient_data").low(18).repeat(2)),
    ];
    for defect in variants(&defects, 1) {
        hardware.generated = generate_changed(&hardware.model, std::slice::from_ref(defect)).unwrap();
        let found = compare(&hardware, Simulator::Verilator, &vectors, Stimulus::BackToBack);
        assert!(!found.is_equal(), "not found: {defect}");
    }
}
