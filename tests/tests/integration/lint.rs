//! The generated Verilog is clean under `verilator --lint-only -Wall` with its waiver file; every waiver is needed and
//! has its reason.

use std::process::Command;

use dermis_cosim::QUICK_SCENES;
use dermis_golden::fixed::Model;
use dermis_golden::spec::adc::{AdcScan, CONVERTERS};
use dermis_golden::spec::link_kind::LinkKind;
use dermis_golden::spec::partition::Case;
use dermis_golden::spec::scene::{Condition, Medium, TableStorage};
use dermis_hdl::bus::{generate_core, Bus, CoreShape};
use dermis_hdl::link::generate_board;
use dermis_hdl::scan::generate_scan;
use dermis_hdl::{generate, Generated};
use dermis_tests::tools::folder_of;
use dermis_tests::{scene, variants};

use crate::arrays;

/// Whether Verilator has no warning, and what it says; with the design's waivers or without them.
fn verilator(generated: &Generated, with_waivers: bool) -> (bool, String) {
    let folder = folder_of(generated);
    let of = |end: &str| -> Vec<&str> {
        generated.files.iter().map(|f| f.name.as_str()).filter(|n| n.ends_with(end)).collect()
    };
    let output = Command::new("verilator")
        .current_dir(folder.path())
        .args(["--lint-only", "-Wall", "--top-module", &generated.top])
        .args(if with_waivers { of(".vlt") } else { Vec::new() })
        .args(of(".v"))
        .output()
        .expect("verilator is installed (make setup)");
    (output.status.success(), String::from_utf8_lossy(&output.stderr).into_owned())
}

fn lint(generated: &Generated) -> Result<(), String> {
    let (clean, log) = verilator(generated, true);
    clean.then_some(()).ok_or(log)
}

/// The waivers that no warning needs, and those without a reason: in a comment above a waiver or a group of them.
fn idle_waivers(waivers: &str, warnings: &str) -> Vec<String> {
    let lines: Vec<&str> = waivers.lines().collect();
    let all = lines.iter().enumerate().filter(|(_, line)| line.starts_with("lint_off"));
    let is_needed = |number: usize, line: &str| {
        let rule = line.split("-rule ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap_or_default();
        let text = line.split("-match \"").nth(1).and_then(|rest| rest.strip_suffix('"')).unwrap_or_default();
        let above = lines[..number].iter().rev().find(|line| !line.starts_with("lint_off"));
        let has_reason = above.is_some_and(|line| line.starts_with("//"));
        has_reason
            && warnings.lines().any(|warning| warning.contains(&format!("%Warning-{rule}:")) && warning.contains(text))
    };
    all.filter(|(number, line)| !is_needed(*number, line)).map(|(_, line)| (*line).to_owned()).collect()
}

#[test]
fn generated_verilog_is_clean_and_needs_each_waiver() {
    // The Verilog of a bonded layer has the constructs of the half-space's.
    let half_space = |name: &&str| scene(name).0.medium == Medium::HalfSpace;
    let own = QUICK_SCENES.into_iter().filter(half_space).map(|name| (name, None));
    for (name, board) in own.chain([("eight-by-eight", Some("icebreaker"))]) {
        let mut scene = scene(name).0;
        scene.hardware.board = board.map(str::to_owned).or(scene.hardware.board);
        let generated = generate(&Model::new(&scene).unwrap()).unwrap();
        lint(&generated).unwrap_or_else(|log| panic!("{name}: {log}"));
        let waivers = generated.files.iter().find(|f| f.name.ends_with(".vlt")).unwrap();
        let (clean, warnings) = verilator(&generated, false);
        assert!(!clean && idle_waivers(&waivers.text, &warnings).is_empty(), "{name}: {warnings}");
        // A waiver of a signal that there is not, and one without a reason.
        let idle = "lint_off -rule UNUSEDSIGNAL -file \"*.v\" -match \"Signal is not used: 'absent'\"";
        assert_eq!(idle_waivers(&format!("{}{idle}\n", waivers.text), &warnings), [idle]);
        let first = waivers.text.lines().find(|line| line.starts_with("lint_off")).unwrap();
        assert_eq!(idle_waivers(&format!("`verilator_config\n{first}\n"), &warnings), [first]);
    }
}

/// `eight-by-eight` with writable tables, for one cover or several.
fn writable(thickness_mm: Option<[f64; 2]>) -> Model {
    let mut scene = scene("eight-by-eight").0;
    scene.hardware.tables = TableStorage::Writable;
    scene.hardware.table_range.thickness_mm = thickness_mm;
    scene.input.full_scale_MPa = Some(1.0);
    Model::new(&scene).unwrap()
}

#[test]
fn writable_tables_are_clean_with_the_same_waivers() {
    let core = CoreShape { bus: Bus::AxiLite, words: 1 };
    let covers = generate(&writable(Some([2.0, 4.0]))).unwrap();
    for generated in [generate(&writable(None)).unwrap(), generate_core(&writable(None), core).unwrap(), covers] {
        lint(&generated).unwrap_or_else(|log| panic!("{log}"));
    }
}

#[test]
fn several_arrays_are_clean_with_the_same_waivers() {
    let core = CoreShape { bus: Bus::AxiLite, words: 1 };
    for (what, more) in variants(&arrays::SCENES, 2) {
        let (_folder, scene) = arrays::scene(*more);
        let model = Model::new(&scene).unwrap();
        for generated in [generate(&model).unwrap(), generate_core(&model, core).unwrap()] {
            lint(&generated).unwrap_or_else(|log| panic!("{what}: {log}"));
        }
    }
}

#[test]
fn cores_are_clean_with_the_engines_waivers() {
    let scenes = [("eight-by-eight", None), ("sensor-3-contacts", None), ("eight-by-eight", Some("icebreaker"))];
    for (name, board) in scenes {
        let mut scene = scene(name).0;
        scene.hardware.board = board.map(str::to_owned).or(scene.hardware.board);
        let model = Model::new(&scene).unwrap();
        for shape in [CoreShape { bus: Bus::AxiLite, words: 1 }, CoreShape { bus: Bus::Wishbone, words: 4 }] {
            lint(&generate_core(&model, shape).unwrap()).unwrap_or_else(|log| panic!("{name}, {shape:?}: {log}"));
        }
    }
    let mut averaged = scene("eight-by-eight").0;
    averaged.input.average = 1;
    let shape = CoreShape { bus: Bus::AxiLite, words: 1 };
    let message = generate_core(&Model::new(&averaged).unwrap(), shape).unwrap_err().to_string();
    assert_eq!(message, "input.average = 1: a core with several frames per result is not available yet");
}

#[test]
fn a_scan_is_clean_with_the_engines_waivers() {
    for (converter, converters, dead) in [(0, 1, vec![]), (1, 2, vec![[0, 3]])] {
        let mut scene = scene("eight-by-eight").0;
        (scene.input.full_scale_MPa, scene.input.dead) = (Some(1.0), dead);
        scene.hardware.adc_scan = Some(AdcScan {
            converter: CONVERTERS[converter],
            converters,
            channels: 8 / converters,
            sclk_MHz: 12.5,
            row_settling_us: 4.0,
            channel_settling_us: 0.5,
            average: 2,
            period_us: 2000.0,
        });
        lint(&generate_scan(&Model::new(&scene).unwrap()).unwrap()).unwrap_or_else(|log| panic!("{converter}: {log}"));
        // With tables, and behind both links.
        (scene.hardware.tables, scene.input.dead) = (TableStorage::Writable, vec![]);
        let model = Model::new(&scene).unwrap();
        lint(&generate_scan(&model).unwrap()).unwrap_or_else(|log| panic!("{converter}, tables: {log}"));
        scene.hardware.link = [LinkKind::Uart, LinkKind::Spi][converter];
        let model = Model::new(&scene).unwrap();
        lint(&generate_board(&model).unwrap()).unwrap_or_else(|log| panic!("{converter}, a board: {log}"));
    }
}

#[test]
fn dead_taxels_are_clean_with_the_same_waivers() {
    let (mut scene, _) = scene("eight-by-eight");
    scene.input.dead = vec![[0, 0], [3, 4]];
    let generated = generate(&Model::new(&scene).unwrap()).unwrap();
    lint(&generated).unwrap_or_else(|log| panic!("{log}"));
}

#[test]
fn a_narrower_search_is_clean_with_the_same_waivers() {
    for width in [2, 1] {
        let (mut scene, _) = scene("eight-by-eight");
        scene.hardware.search_width = Some(width);
        let generated = generate(&Model::new(&scene).unwrap()).unwrap();
        lint(&generated).unwrap_or_else(|log| panic!("{width}: {log}"));
    }
}

#[test]
fn a_choice_of_cases_is_clean_with_the_engines_waivers() {
    // A network reads the whole array.
    for name in variants(&["eight-by-eight", "sensor-1"], 1) {
        let mut scene = scene(name).0;
        for condition in [Condition::Loaded, Condition::BothSigns] {
            scene.partition.case = Case::Adaptive;
            scene.partition.condition = condition;
            let generated = generate(&Model::new(&scene).unwrap()).unwrap();
            lint(&generated).unwrap_or_else(|log| panic!("{name}: {log}"));
        }
    }
}

#[test]
fn a_board_is_clean_with_the_engines_waivers() {
    for name in variants(&QUICK_SCENES, 2) {
        for (_, link) in LinkKind::NAMES {
            let mut scene = scene(name).0;
            scene.hardware.link = link;
            let generated = generate_board(&Model::new(&scene).unwrap()).unwrap();
            lint(&generated).unwrap_or_else(|log| panic!("{name}, {link:?}: {log}"));
        }
    }
}
