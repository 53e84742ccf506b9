//! Several cases in one design, chosen per frame: equality on frames for each case, in mixed order, at full speed and
//! with stalls; defects that the comparison finds; benefit of the choice.

use std::collections::BTreeSet;

use dermis_cosim::drive::Stimulus;
use dermis_cosim::hardware::Hardware;
use dermis_cosim::simulator::Simulator;
use dermis_cosim::{run, DeviceUnderTest, Findings, Vector};
use dermis_golden::data::frame::Frame;
use dermis_golden::data::quantise::quantise;
use dermis_golden::estimate::float::Golden;
use dermis_golden::fixed::stages::choose::{FrameStats, CUT_SHIFT};
use dermis_golden::fixed::Model;
use dermis_golden::quantile::median;
use dermis_golden::spec::partition::{Case, Grid};
use dermis_golden::spec::scene::Scene;
use dermis_hdl::generate_changed;
use dermis_hdl::language::Change;
use dermis_report::drawn_frames::{DrawnFrames, Shapes};
use dermis_tests::{assert_equal, build_dir, variants};

/// Number of frames of one run.
const FRAMES: usize = 24;

fn scene(sensor: &str, more: &str) -> Scene {
    let text = Scene::builtin(sensor).map(|scene| scene.sensor).unwrap();
    let text = format!(
        "name = \"choosing-{sensor}\"\n[sensor]\nrows = {}\ncols = {}\npitch_x_mm = {}\npitch_y_mm = {}\n\
         thickness_mm = {}\n{more}",
        text.rows, text.cols, text.pitch_x_mm, text.pitch_y_mm, text.thickness_mm
    );
    Scene::parse(&text, "choosing").unwrap()
}

/// A narrow bump at a taxel with a little tension around it, of peak `most` or some octaves smaller.
fn bump(scene: &Scene, random: &mut fastrand::Rng) -> Vec<i32> {
    let (rows, cols) = (scene.sensor.rows, scene.sensor.cols);
    let size = f64::from((1i32 << (scene.fixed.input_bits - 1 - random.u32(..8))) - 1);
    let (row, col) = (random.usize(..rows), random.usize(..cols));
    let tail = 0.02 * size * random.f64();
    let code = |taxel: usize| {
        let far = (taxel / cols).abs_diff(row).pow(2) + (taxel % cols).abs_diff(col).pow(2);
        (size * (-(far as f64) / 0.8).exp() - tail * (-(far as f64) / 4.0).exp()) as i32
    };
    (0..rows * cols).map(code).collect()
}

/// A sixth of the peak beside the boundary of the rows: near the threshold for a cut.
fn shared(scene: &Scene) -> Vec<i32> {
    let mut codes = vec![0; scene.sensor.taxels()];
    (codes[0], codes[scene.sensor.cols * (scene.sensor.rows / 2)]) = (60_000, 10_000);
    codes
}

fn vectors(hardware: &Hardware, seed: u64) -> Vec<Vector> {
    let (scene, mut random) = (&hardware.model.scene, fastrand::Rng::with_seed(seed));
    let vector = |k: usize| {
        let codes = match k {
            0 => vec![0; scene.sensor.taxels()],
            1 => shared(scene),
            _ => bump(scene, &mut random),
        };
        let expected = hardware.model.run(&codes);
        Vector::new(&hardware.model, format!("bump {k}"), codes, expected)
    };
    (0..FRAMES).map(vector).collect()
}

fn taken(vector: &Vector) -> i64 {
    vector.expected.stages.iter().find(|stage| stage.name == "choose").unwrap().words[0][0]
}

fn check(hardware: &Hardware, simulator: Simulator, vectors: &[Vector], stimuli: &[Stimulus]) -> Findings {
    let mut device = hardware.device(simulator).unwrap();
    let taps = hardware.tap_names();
    let mut all = Findings::default();
    for &stimulus in stimuli {
        let dut = DeviceUnderTest { name: simulator.name(), device: device.as_mut(), taps: &taps };
        all.extend(run(dut, vectors, stimulus).0);
    }
    all
}

fn hardware(scene: &Scene) -> Hardware {
    Hardware::new(Model::new(scene).unwrap(), &build_dir()).unwrap()
}

#[test]
fn every_case_is_equal_in_any_order() {
    let both_signs = "condition = \"both-signs\"\n[search]\nnoise_floor_MPa = 0.0005\n[input]\nfull_scale_MPa = 1.0\n";
    let scenes = [
        scene("eight-by-eight", "[partition]\ncase = \"adaptive\"\n"),
        // Odd subarrays, an odd number of groups, a list of columns.
        scene("sensor-1", "[partition]\ncases = [0, 1, 2, 3]\n[fixed]\nlanes = 36\nprune_bits = 10\n"),
        scene("eight-by-eight", &format!("[partition]\ncases = [0, 3]\n{both_signs}")),
    ];
    for (number, scene) in variants(&scenes, 2).iter().enumerate() {
        let hardware = hardware(scene);
        let vectors = vectors(&hardware, 1);
        let cases: BTreeSet<i64> = vectors.iter().map(taken).collect();
        assert_eq!(cases.len(), hardware.model.cases().len(), "{:?}: {cases:?}", scene.partition);
        let switches = vectors.windows(2).filter(|pair| taken(&pair[0]) != taken(&pair[1])).count();
        assert!(switches >= 4, "{:?}: {switches} changes", scene.partition);
        let stalls = [1, 2, 3].map(|seed| Stimulus::Stalls { seed });
        let verilog = [&[Stimulus::FullSpeed], &stalls[..]].concat();
        let simulators = [(Simulator::Verilator, &verilog[..]), (Simulator::Kernel, &verilog[..2])];
        // kernel simulation takes most of the time: without the others at least one scene.
        for (simulator, stimuli) in variants(&simulators, if number == 0 { 2 } else { 1 }) {
            let findings = check(&hardware, *simulator, &vectors, stimuli);
            assert_equal(&findings, format!("{:?}", scene.partition));
        }
    }
}

#[test]
fn a_frame_names_the_case_that_solved_it() {
    let model = Model::new(&scene("eight-by-eight", "[partition]\ncase = \"adaptive\"\n")).unwrap();
    let mut random = fastrand::Rng::with_seed(2);
    for _ in 0..FRAMES {
        let codes = bump(&model.scene, &mut random);
        let chosen = model.choose(&codes);
        let case = &model.cases()[chosen];
        let trace = model.run(&codes);
        assert_eq!(trace.status.len(), 3 * case.parts.len());
        assert!(trace.status.iter().step_by(3).all(|beat| beat[2] >> 8 == case.number() as i32));
        assert_eq!((trace.stages[1].name, &trace.stages[1].words), ("choose", &vec![vec![chosen as i64]]));
        let stress = codes.iter().map(|&code| f64::from(code)).collect();
        let frame = Frame::from_stress("bump", &model.scene.sensor, stress).unwrap();
        let result = model.decode(&[frame], "fixed", &trace.beats, &trace.status).unwrap();
        assert_eq!(result.extra.taken.map(|taken| taken.case), Some(case.case.to_string()));
        assert_eq!(result.case, case.grid());
    }
}

/// A change of any constant of the choice, or of anything that depends on the case, is found.
#[test]
fn a_wrong_constant_is_found() {
    let mut hardware = hardware(&scene("eight-by-eight", "[partition]\ncases = [0, 1]\n"));
    let vectors = vectors(&hardware, 1);
    assert!(check(&hardware, Simulator::Verilator, &vectors, &[Stimulus::FullSpeed]).is_equal());
    let changes = [
        // The threshold of the choice; the quads of a subarray.
        Change::within("receive__choose", "limit", |k| {
            let peak = k.named("peak");
            [CUT_SHIFT, CUT_SHIFT ^ 1].map(|by| peak.shift_right(by as usize).extend(peak.bits()))
        }),
        Change::within("fold__quads", "last", |k| [3, 2].map(|quads| k.constant(4, quads))),
    ];
    for change in variants(&changes, 1) {
        hardware.generated = generate_changed(&hardware.model, std::slice::from_ref(change)).unwrap();
        let findings = check(&hardware, Simulator::Verilator, &vectors, &[Stimulus::FullSpeed]);
        assert!(!findings.is_equal(), "the change of {change} went unnoticed");
    }
}

#[test]
fn a_board_of_several_cases_has_no_link() {
    let model = Model::new(&scene("eight-by-eight", "[partition]\ncases = [0, 1]\n")).unwrap();
    let error = dermis_hdl::link::generate_board(&model).unwrap_err().to_string();
    assert!(error.starts_with("partition.case = adaptive: a board's link does not support it"), "{error}");
}

/// Number of frames of the measurement.
const DRAWN: u32 = 60;

/// Benefit of the choice: median tangential error over random frames for each case, for the hardware's rule with
/// several thresholds and for the golden model's choice; the floating-point model solves.
#[test]
fn the_choice_is_measured() {
    let grids: Vec<Grid> = (0..4).filter_map(|number| Case::numbered(number)?.grid()).collect();
    println!("| scene | contacts | case 0 | 1 | 2 | 3 | shift 1 | 2 | 3 | 4 | 5 | 6 | 8 | golden |");
    let scenes = [
        ("eight-by-eight", &[1][..], DRAWN),
        ("sensor-1", &[2, 3], DRAWN),
        ("sensor-1", &[1], DRAWN),
        ("sensor-3", &[1], DRAWN / 3),
        ("sensor-3", &[2, 3, 4], DRAWN),
    ];
    for &(name, counts, drawn) in variants(&scenes, 2) {
        let scene = Scene::builtin(name).unwrap();
        let of = |case: Case| {
            let mut scene = scene.clone();
            scene.partition.case = case;
            Golden::reference(&scene).unwrap()
        };
        let models: Vec<Golden> = (0..4).filter_map(Case::numbered).map(of).collect();
        let adaptive = of(Case::Adaptive);
        let shifts = [1, 2, 3, 4, 5, 6, 8];
        let (mut by_case, mut by_shift, mut golden) = (vec![Vec::new(); 4], vec![Vec::new(); shifts.len()], Vec::new());
        let contacts = counts.to_vec();
        let draw = DrawnFrames { frames: drawn, contacts, shapes: Shapes::Elliptic, touching: false, seed: 1 };
        for frame in draw.draw(&scene).unwrap() {
            let error = |model: &Golden| model.run(&frame).unwrap().error.and_then(|error| error.tangential);
            let errors: Vec<f64> = models.iter().filter_map(error).collect();
            let Some(own) = error(&adaptive).filter(|_| errors.len() == 4) else { continue };
            let mut seen = FrameStats::default();
            let codes = quantise(&frame.stress_MPa, scene.fixed.input_bits, frame.peak_MPa()).codes;
            codes.iter().enumerate().for_each(|(index, &code)| seen.add(&scene.sensor, index, code, 0));
            for (all, &error) in by_case.iter_mut().zip(&errors) {
                all.push(error);
            }
            for (all, shift) in by_shift.iter_mut().zip(shifts) {
                all.push(errors[seen.choose_at(shift, &grids, scene.partition.condition, 0)]);
            }
            golden.push(own);
        }
        let chosen = median(by_shift[shifts.iter().position(|&shift| shift == CUT_SHIFT).unwrap()].clone()).unwrap();
        let whole = median(by_case[0].clone()).unwrap();
        match counts.len() {
            1 => assert!(chosen < whole + 0.01, "{name}: {chosen} against {whole} of case 0"),
            _ => assert!(chosen < whole, "{name}, several contacts: {chosen} against {whole} of case 0"),
        }
        let percent = |all: Vec<f64>| format!("{:.2} %", 100.0 * median(all).unwrap());
        let cells: Vec<String> = by_case.into_iter().chain(by_shift).chain([golden]).map(percent).collect();
        println!("| {name} | {counts:?} | {} |", cells.join(" | "));
    }
}
