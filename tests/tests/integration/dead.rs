//! Dead taxels in hardware: equal to the bit-true model, independent of what they read, and close to the golden model
//! of the array without them.
//!
//! `dermis study dead-taxels` prints the table of errors.

use dermis_cosim::drive::Stimulus;
use dermis_cosim::hardware::Hardware;
use dermis_cosim::simulator::Simulator;
use dermis_cosim::verify::verify;
use dermis_golden::data::frame::Frame;
use dermis_golden::estimate::float::Golden;
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Scene;
use dermis_report::drawn_frames::{DrawnFrames, Shapes};
use dermis_report::study::dead_taxels::{self, LINES as SCENES};
use dermis_tests::{assert_equal, build_dir, compare};

/// Bound of the bit-true model's additional median tangential error at 20 bits; as for whole arrays.
const FIXED_ADDS: f64 = 0.02;

fn masked(name: &str, dead: &[[usize; 2]]) -> Scene {
    dead_taxels::masked(name, dead).unwrap()
}

/// Frames of random contacts; in every second one the dead taxels are stuck far beyond the peak.
fn frames(scene: &Scene, count: u32) -> Vec<Frame> {
    let draw = DrawnFrames { frames: count, contacts: vec![1, 2], shapes: Shapes::Elliptic, touching: false, seed: 11 };
    let mut frames = draw.draw(scene).unwrap();
    frames.iter_mut().skip(1).step_by(2).for_each(|frame| stick(scene, frame));
    frames
}

fn stick(scene: &Scene, frame: &mut Frame) {
    for (k, [row, col]) in scene.input.dead.iter().enumerate() {
        frame.stress_MPa[row * scene.sensor.cols + col] = if k % 2 == 0 { 50.0 } else { -50.0 };
    }
}

#[test]
fn drawn_frames_are_equal_on_every_simulator() {
    for (name, dead) in SCENES {
        let scene = masked(name, dead);
        // Compilation by Verilator is slow: one scene of each sensor, the one with more dead taxels.
        let simulators = [Simulator::Kernel, Simulator::Verilator];
        let simulators = if dead.len() > 1 { &simulators[..] } else { &simulators[..1] };
        let verified = verify(&scene, &frames(&scene, 4), simulators, &build_dir()).unwrap();
        assert_equal(&verified.findings, &scene.name);
    }
}

#[test]
fn unlike_scenes_are_equal() {
    let scenes = [
        // Taxels on both middle lines and where they cross; groups of rows, columns left out.
        ("odd", "rows = 7\ncols = 9", "[[3, 4], [3, 0], [6, 4]]\n[fixed]\nlanes = 24\nprune_bits = 10\n"),
        ("no-search", "rows = 6\ncols = 4", "[[1, 2]]\n[search]\nmu_max = 0\n"),
        ("averaged", "rows = 5\ncols = 4", "[[0, 0], [4, 3]]\naverage = 1\n[output]\nforces = \"resultants\"\n"),
        // Square and of degree 1: without the dead taxel Ax would be used for Ay.
        ("degree-1", "rows = 6\ncols = 6", "[[2, 3]]\n[search]\nmu_max = 0.05\ndegree = 1\n"),
    ];
    for (name, size, dead) in scenes {
        let text = format!(
            "name = \"{name}\"\n[sensor]\n{size}\npitch_x_mm = 4.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n\
             [input]\ndead = {dead}"
        );
        let scene = Scene::parse(&text, name).unwrap();
        let verified = verify(&scene, &frames(&scene, 4), &[Simulator::Kernel], &build_dir()).unwrap();
        assert_equal(&verified.findings, name);
    }
}

#[test]
fn what_a_dead_taxel_reads_changes_no_bit() {
    for (name, dead) in SCENES {
        let scene = masked(name, dead);
        let (model, golden) = (Model::new(&scene).unwrap(), Golden::reference(&scene).unwrap());
        let at = |[row, col]: [usize; 2]| row * scene.sensor.cols + col;
        let most = (1 << (scene.fixed.input_bits - 1)) - 1;
        for frame in frames(&scene, 3) {
            let codes = model.readings(std::slice::from_ref(&frame)).unwrap();
            let trace = model.run(&codes);
            for stuck in [most, -most - 1, 1] {
                let mut other = codes.clone();
                dead.iter().for_each(|taxel| other[at(*taxel)] = stuck);
                assert_eq!(model.run(&other), trace, "{}, {}", scene.name, frame.id);
            }
            // Any other taxel matters.
            let mut other = codes.clone();
            other[at([1, 1])] ^= 1;
            assert_ne!(model.run(&other), trace);
            // The same in MPa, where the scale of the codes depends on the frame's peak.
            let mut other = frame.clone();
            stick(&scene, &mut other);
            assert_eq!(model.reconstruct(&other).unwrap(), model.reconstruct(&frame).unwrap());
            assert_eq!(golden.run(&other).unwrap(), golden.run(&frame).unwrap());
        }
        // A frame in which only stuck taxels read anything has no contact.
        let mut silent = Frame::from_stress("silent", &scene.sensor, vec![0.0; scene.sensor.taxels()]).unwrap();
        let quiet = model.reconstruct(&silent).unwrap();
        stick(&scene, &mut silent);
        assert_eq!(model.reconstruct(&silent).unwrap(), quiet);
        assert!(!quiet.subarrays[0].centroid_condition);
    }
}

#[test]
fn fixed_is_near_golden() {
    for (name, dead) in SCENES {
        let scene = masked(name, dead);
        let row = dead_taxels::measure(&scene).unwrap();
        let (golden, fixed, apart) = (row.golden.unwrap(), row.fixed.unwrap(), row.apart.unwrap());
        println!("{}: {row:?}", scene.name);
        assert!(fixed <= golden + FIXED_ADDS, "{}: fixed {fixed}, golden {golden}", scene.name);
        // Wrong matrices, such as those that ignore the forces over dead taxels, cause errors of tens of per cent.
        assert!(apart < FIXED_ADDS, "{}: {apart}", scene.name);
    }
}

#[test]
fn mirrored_pairs_keep_a_symmetry() {
    let flips = |dead: &[[usize; 2]]| {
        let model = Model::new(&masked("sensor-1", dead)).unwrap();
        let flips = &model.formats().flips;
        [flips.inverse.len(), flips.ax.len(), flips.ay.len()]
    };
    assert_eq!(flips(&[[4, 6]]), [4; 3]);
    assert_eq!(flips(&[[4, 3], [4, 6]]), [2; 3]);
    assert_eq!(flips(&[[4, 3], [4, 6], [5, 3], [5, 6]]), [1; 3]);
    assert_eq!(flips(&[]), [1; 3]);
}

#[test]
fn a_flipped_coefficient_of_a_broken_symmetry_is_found() {
    let (name, dead) = SCENES[1];
    let scene = masked(name, dead);
    let mut hardware = Hardware::new(Model::new(&scene).unwrap(), &build_dir()).unwrap();
    let vectors = [hardware.vector(&frames(&scene, 1)).unwrap()];
    let found = |hardware: &Hardware| compare(hardware, Simulator::Verilator, &vectors, Stimulus::FullSpeed);
    assert!(found(&hardware).is_equal());
    // The memory has the columns of the symmetric flip of each matrix first; the next line is of another flip.
    let quads = hardware.model.formats().quads;
    let index = hardware.generated.files.iter().position(|file| file.name.ends_with("__coefficients.hex")).unwrap();
    let mut lines: Vec<String> = hardware.generated.files[index].text.lines().map(str::to_owned).collect();
    let last = lines[quads].pop().and_then(|digit| digit.to_digit(16)).unwrap();
    lines[quads].push(char::from_digit(last ^ 1, 16).unwrap());
    hardware.generated.files[index].text = lines.join("\n") + "\n";
    let findings = found(&hardware);
    assert_eq!(findings.kept.first().map(|finding| finding.stage.as_str()), Some("pass"));
}
