//! The generated Verilog is clean under `verilator --lint-only -Wall` with its waiver file; every waiver is needed and
//! has its reason.

use std::process::Command;

use dermis_golden::fixed::Model;
use dermis_golden::link::LinkKind;
use dermis_golden::partition::Case;
use dermis_golden::scene::Condition;
use dermis_hdl::link::generate_board;
use dermis_hdl::{generate, Generated};
use dermis_tests::tools::folder_of;
use dermis_tests::{scene, SCENES};

fn lint(generated: &Generated) -> Result<(), String> {
    let folder = folder_of(generated);
    let of = |end: &str| -> Vec<&str> {
        generated.files.iter().map(|f| f.name.as_str()).filter(|n| n.ends_with(end)).collect()
    };
    let output = Command::new("verilator")
        .current_dir(folder.path())
        .args(["--lint-only", "-Wall", "--top-module", &generated.top])
        .args(of(".vlt"))
        .args(of(".v"))
        .output()
        .expect("verilator is installed (make setup)");
    output.status.success().then_some(()).ok_or_else(|| String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn generated_verilog_is_clean_and_needs_each_waiver() {
    let own = SCENES.map(|name| (name, None));
    for (name, board) in own.into_iter().chain([("eight-by-eight", Some("icebreaker"))]) {
        let mut scene = scene(name).0;
        scene.hardware.board = board.map_or(scene.hardware.board, str::to_string);
        let mut generated = generate(&Model::new(&scene).unwrap()).unwrap();
        lint(&generated).unwrap_or_else(|log| panic!("{name}: {log}"));
        let Some(index) = generated.files.iter().position(|f| f.name.ends_with(".vlt")) else {
            continue;
        };
        let waivers = generated.files[index].text.clone();
        let lines: Vec<&str> = waivers.lines().collect();
        for (number, line) in lines.iter().enumerate().filter(|(_, l)| l.starts_with("lint_off")) {
            // The reason is in a comment above a waiver or a group of them.
            let above = lines[..number].iter().rev().find(|l| !l.starts_with("lint_off"));
            assert!(above.is_some_and(|l| l.starts_with("//")), "{name}: no reason above: {line}");
            let without = lines.iter().enumerate().filter(|(n, _)| *n != number).map(|(_, l)| *l);
            generated.files[index].text = without.collect::<Vec<_>>().join("\n") + "\n";
            assert!(lint(&generated).is_err(), "{name}: nothing needs: {line}");
        }
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
    for name in ["sensor-1", "eight-by-eight"] {
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
    for name in SCENES {
        for (_, link) in LinkKind::NAMES {
            let mut scene = scene(name).0;
            scene.hardware.link = link;
            let generated = generate_board(&Model::new(&scene).unwrap()).unwrap();
            lint(&generated).unwrap_or_else(|log| panic!("{name}, {link:?}: {log}"));
        }
    }
}
