//! Equality to the bit, from the first word of the first stage to the last status beat: the generated
//! Verilog (full speed, back to back, and with stalls after an interrupted frame) and kernel simulation
//! against the bit-true model, on every shipped frame, with exact cycle counts, none above those of the committed table.

use dermis_cosim::simulator::Simulator;
use dermis_cosim::verify::{verify, Verified};
use dermis_cosim::QUICK_SCENES;
use dermis_golden::data::frame::Frame;
use dermis_golden::result::flags::Flag;
use dermis_golden::spec::scene::Scene;
use dermis_report as report;
use dermis_tests::{assert_equal, build_dir, check_cycles, scene};

fn check(scene: &Scene, frames: &[Frame]) -> Verified {
    let verified = verify(scene, frames, &[Simulator::Verilator, Simulator::Kernel], &build_dir()).unwrap();
    assert_equal(&verified.findings, &scene.name);
    verified
}

#[test]
fn every_shipped_frame_is_equal_and_within_its_cycles() {
    for name in QUICK_SCENES {
        let (scene, frames) = scene(name);
        let verified = check(&scene, &frames);
        assert_eq!(verified.frame_interval, Some(verified.planned_interval), "{name}");
        check_cycles(name, verified.rows.iter().map(|row| row.times.latency()));
    }
}

#[test]
fn degenerate_frames_are_equal() {
    let (scene, frames) = scene("eight-by-eight");
    let with = |id: &str, stress: Vec<f64>| Frame { id: id.into(), stress_MPa: stress, ..frames[0].clone() };
    let one = |taxel: usize, value: f64| {
        let mut stress = vec![0.0; scene.sensor.taxels()];
        stress[taxel] = value;
        stress
    };
    let checks: Vec<f64> = (0..scene.sensor.taxels()).map(|i| if (i / 8 + i) % 2 == 0 { 0.2 } else { -0.2 }).collect();
    let tension = frames[0].stress_MPa.iter().map(|b| -b).collect();
    let frames = [
        with("zeros", vec![0.0; scene.sensor.taxels()]),
        with("one taxel", one(27, 0.1)),
        with("one corner in tension", one(0, -0.1)),
        with("all at full scale", vec![0.3; scene.sensor.taxels()]),
        with("checkerboard", checks),
        with("all in tension", tension),
        Frame::eq2(&scene.sensor),
    ];
    let verified = check(&scene, &frames);
    let raised = |id: &str| {
        let row = std::iter::zip(&frames, &verified.rows).find(|(frame, _)| frame.id == id).unwrap().1;
        row.fixed.flags.contains(&Flag::NegativePressure)
    };
    assert_eq!(["zeros", "one corner in tension", "all in tension"].map(raised), [false, true, true]);
}

#[test]
fn clipped_codes_are_equal() {
    let (mut scene, frames) = scene("eight-by-eight");
    // Full scale is a tenth of the peak: most of the contact is clipped.
    scene.input.full_scale_MPa = Some(frames[0].peak_MPa() / 10.0);
    check(&scene, &frames[..2]);
}

#[test]
fn golden_judges_the_codes_that_the_hardware_gets() {
    let (mut scene, mut frames) = scene("eight-by-eight");
    // With a noise floor all frames have the full scale of the strongest, too coarse for a frame of a 200th of it.
    scene.search.noise_floor_MPa = Some(1e-9);
    frames.truncate(2);
    let peak = frames[0].peak_MPa();
    let share = peak / frames[1].peak_MPa() / 200.0;
    frames[1].stress_MPa.iter_mut().for_each(|b| *b *= share);
    let verified = verify(&scene, &frames, &[Simulator::Kernel], &build_dir()).unwrap();
    let unreliable = |flags: &[Flag]| flags.contains(&Flag::ShearUnreliable);
    let rows: Vec<[bool; 2]> =
        verified.rows.iter().map(|row| [unreliable(&row.golden.flags), unreliable(&row.fixed.flags)]).collect();
    assert_eq!(rows, [[false; 2], [true; 2]]);
    // If no Verilog has run, the table does not claim equality.
    let (cosim, scenes) = (report::cosim(&verified), report::scenes(&[verified]));
    for table in [cosim, scenes] {
        let cells = |line: usize| table.lines().nth(line).unwrap().split('|').map(str::trim).collect::<Vec<_>>();
        let column = cells(0).iter().position(|head| *head == "RTL = fixed").unwrap();
        assert_eq!(cells(2)[column], "-", "{table}");
    }
}
