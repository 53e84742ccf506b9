//! Co-simulation at scale, under Verilator, with all stages compared: the largest array with a foot on it, and hundreds of
//! random frames of small sensors with random gaps and back-pressure on both streams.

use dermis_cosim::drive::Stimulus;
use dermis_cosim::hardware::Hardware;
use dermis_cosim::simulator::Simulator;
use dermis_cosim::verify::verify;
use dermis_cosim::{run, DeviceUnderTest, Vector};
use dermis_golden::fixed::Model;
use dermis_golden::spec::partition::Case;
use dermis_golden::spec::scene::Scene;
use dermis_tests::{assert_equal, build_dir, check_cycles, nightly, scene};

/// Number of frames of one run; all their traces are in memory.
const CHUNK: u64 = 50;

#[test]
fn a_foot_on_the_largest_array_is_equal() {
    let (scene, mut frames) = scene("sensor-4");
    frames.retain(|frame| frame.id.contains("plantar"));
    let verified = verify(&scene, &frames[..1], &[Simulator::Verilator], &build_dir()).unwrap();
    assert_equal(&verified.findings, "a foot");
    check_cycles("sensor-4 with a foot", verified.rows.iter().map(|row| row.times.latency()));
}

/// Random codes as from a converter: noise, sparse spikes, a bump or saturated patches.
fn codes(random: &mut fastrand::Rng, scene: &Scene) -> Vec<i32> {
    let most = (1i32 << (scene.fixed.input_bits - 1)) - 1;
    let taxels = scene.sensor.taxels();
    let size = most >> random.u32(..scene.fixed.input_bits - 1);
    let kind = random.u8(..4);
    let (centre, width) = (random.usize(..taxels), 1.0 + 3.0 * random.f64());
    (0..taxels)
        .map(|taxel| match kind {
            0 => random.i32(-size..=size),
            1 if random.u8(..8) == 0 => random.i32(-size..=size),
            1 => 0,
            2 => {
                let cols = scene.sensor.cols;
                let dx = (taxel % cols) as f64 - (centre % cols) as f64;
                let dy = (taxel / cols) as f64 - (centre / cols) as f64;
                (f64::from(size) * (1.0 + 0.3 * dx) * (-(dx * dx + dy * dy) / width).exp()) as i32
            }
            _ => *[most, -most - 1, 0].get(random.usize(..3)).unwrap_or(&0),
        })
        .collect()
}

fn random_frames_are_equal(scene: &Scene) {
    let frames = if nightly() { 500 } else { 150 };
    let hardware = Hardware::new(Model::new(scene).unwrap(), &build_dir()).unwrap();
    let taps = hardware.tap_names();
    let mut device = hardware.device(Simulator::Verilator).unwrap();
    let mut random = fastrand::Rng::with_seed(4);
    for seed in 0..frames / CHUNK {
        let vectors: Vec<Vector> = (0..CHUNK)
            .map(|k| {
                let codes = codes(&mut random, scene);
                let expected = hardware.model.run(&codes);
                Vector::new(&hardware.model, format!("random {}", CHUNK * seed + k), codes, expected)
            })
            .collect();
        let dut = DeviceUnderTest { name: "verilator", device: device.as_mut(), taps: &taps };
        let (findings, _) = run(dut, &vectors, Stimulus::Stalls { seed });
        assert_equal(&findings, &scene.name);
    }
}

#[test]
fn random_frames_of_a_whole_array_are_equal() {
    random_frames_are_equal(&scene("eight-by-eight").0);
}

#[test]
fn random_frames_of_a_partitioned_array_are_equal() {
    let (mut scene, _) = scene("sensor-1");
    scene.partition.case = Case::numbered(1).unwrap();
    random_frames_are_equal(&scene);
}
