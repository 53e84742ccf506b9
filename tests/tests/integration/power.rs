//! The estimate of power: what changes in the simulated Verilog, times the energies of the device.

use dermis_cosim::hardware::Hardware;
use dermis_cosim::power::{count_toggles, energies, estimate_power, Toggles};
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Scene;
use dermis_hdl::state::StorageClass;
use dermis_tests::build_dir;

/// Few taxels and no search, so that the library with access to every signal is built quickly; the same as that of the faults.
fn hardware() -> Hardware {
    let text =
        "name = \"faults\"\n[sensor]\nrows = 4\ncols = 4\npitch_x_mm = 3.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n\
         [search]\nmu_max = 0.0\n[input]\nfull_scale_MPa = 0.1\n";
    Hardware::new(Model::new(&Scene::parse(text, "faults").unwrap()).unwrap(), &build_dir()).unwrap()
}

fn frame(hardware: &Hardware, stress: impl Fn(usize) -> f64) -> Frame {
    let sensor = &hardware.model.scene.sensor;
    Frame { stress_MPa: (0..sensor.taxels()).map(stress).collect(), ..Frame::eq2(sensor) }
}

#[test]
fn a_pressed_frame_changes_more_bits_than_an_empty_one() {
    let hardware = hardware();
    let toggles = |stress: fn(usize) -> f64| count_toggles(&hardware, &[frame(&hardware, stress)]).unwrap();
    let (empty, pressed) = (toggles(|_| 0.0), toggles(|taxel| [0.02, 0.05, 0.03][taxel % 3]));
    assert_eq!(empty.interval, pressed.interval);
    let of = |toggles: &Toggles, stage: &str| toggles.stages.iter().find(|own| own.stage == stage).unwrap().toggles;
    assert!(of(&pressed, "pass") > 2.0 * of(&empty, "pass"), "{empty:?} {pressed:?}");
    // The counters of send run in both.
    assert_eq!(of(&pressed, "send"), of(&empty, "send"));
    // The stages have all registers that bits can be flipped in.
    let registers = hardware.generated.state.iter();
    let registers = registers.filter(|own| own.class == StorageClass::Register);
    let bits: usize = registers.map(|own| own.words * own.bits).sum();
    assert_eq!(pressed.stages.iter().map(|own| own.register_bits).sum::<usize>(), bits);
}

#[test]
fn the_estimate_adds_up() {
    let hardware = hardware();
    let estimate = estimate_power(&hardware, &[frame(&hardware, |_| 0.04)]).unwrap();
    let power = hardware.model.board.power().unwrap().unwrap();
    let bits: usize = estimate.toggles.stages.iter().map(|own| own.register_bits).sum();
    for k in 0..2 {
        let frame: f64 = estimate.stages_nJ.iter().map(|own| own[k]).sum();
        let toggles: f64 = estimate.toggles.stages.iter().map(|own| own.toggles).sum();
        assert!(frame > toggles * power.toggle_pJ[k] / 1e3, "multipliers and block RAMs take energy too");
        assert!((estimate.clock_mW[k] / (bits as f64 * power.clock_pJ[k] * 0.1) - 1.0).abs() < 1e-9);
        let [at_rest, flat_out] = [&estimate.rates[0], &estimate.rates[1]];
        assert_eq!([at_rest.name, flat_out.name], ["1 kHz", "back to back"]);
        assert!((flat_out.frames_per_second * estimate.toggles.interval / 100e6 - 1.0).abs() < 1e-9);
        for rate in [at_rest, flat_out] {
            let sum = estimate.static_mW[k] + estimate.clock_mW[k] + frame * rate.frames_per_second * 1e-6;
            assert!((rate.power_mW[k] / sum - 1.0).abs() < 1e-9);
            assert!((rate.frame_uJ[k] * rate.frames_per_second / (1e3 * sum) - 1.0).abs() < 1e-9);
        }
        assert!(flat_out.power_mW[k] > at_rest.power_mW[k] && flat_out.frame_uJ[k] < at_rest.frame_uJ[k]);
    }
    assert!(estimate.rates.iter().all(|rate| rate.power_mW[1] >= 2.0 * rate.power_mW[0]), "a range of two at least");
}

#[test]
fn a_board_without_a_device_has_no_estimate() {
    let mut board = hardware().model.board.clone();
    board.device = None;
    let message = energies(&board).unwrap_err().to_string();
    assert_eq!(
        message,
        "constraints/ulx3s-85f.toml: no device: no energies of its resources are known, which an estimate of power needs"
    );
}
