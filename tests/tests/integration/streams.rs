//! The engine's streams under stress, on the Verilated engine: gaps, back-pressure, wrong `tlast`, resets. Nothing is
//! lost or invented, and the frame after any disturbance is correct. Longer with `DERMIS_STRESS_CYCLES` (`make
//! stress`).

use dermis_cosim::hardware::Hardware;
use dermis_cosim::stress::{stress, Outcome};
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Scene;
use dermis_hdl::generate_changed;
use dermis_hdl::language::Change;
use dermis_report as report;
use dermis_tests::{build_dir, nightly, scene, variants, wanted};

/// A running zero under blocks of frames.
const RUNNING: &str =
    "[search]\nmu_max = 0.0\n[input]\naverage = 1\nfull_scale_MPa = 1.0\nzero = \"running\"\nzero_average = 1\n";

/// A few taxels, so that a reset at every cycle of a frame takes a second.
fn small(rows: usize, cols: usize, more: &str) -> Scene {
    let text = format!(
        "name = \"streams\"\n[sensor]\nrows = {rows}\ncols = {cols}\npitch_x_mm = 3.0\npitch_y_mm = 4.0\n\
         thickness_mm = 3.0\n{more}"
    );
    Scene::parse(&text, "streams").unwrap()
}

fn hardware(scene: &Scene) -> Hardware {
    Hardware::new(Model::new(scene).unwrap(), &build_dir()).unwrap()
}

fn check(scene: &Scene, frames: &[Frame], short: u64) -> Vec<Outcome> {
    let outcomes = stress(&hardware(scene), frames, wanted("DERMIS_STRESS_CYCLES", short), 1).unwrap();
    println!("{}", report::stress(&outcomes));
    for outcome in &outcomes {
        assert_eq!(outcome.violations, 0, "{:?}: {outcome:#?}", scene.partition);
        assert_eq!(outcome.frames_in, outcome.frames_out, "{:?}: {outcome:#?}", scene.partition);
        // With a pipeline before it, `receive` need not keep a frame waiting that is alone after a reset.
        let may_not_stall = scene.hardware.has_writable_tables() && outcome.experiment == "reset";
        assert!(outcome.frames_out > 20 && (outcome.stalled > 0 || may_not_stall), "{outcome:#?}");
        match outcome.experiment {
            "stalls" => assert!(outcome.timed > 0 && outcome.flagged == 0, "{outcome:#?}"),
            "tables" => {
                assert!(outcome.images.min(outcome.images_refused).min(outcome.images_broken) > 10, "{outcome:#?}")
            }
            "tlast" => assert!(outcome.cut.min(outcome.flagged) > 10, "{outcome:#?}"),
            _ => assert!(outcome.resets == outcome.timed && outcome.flagged == 0, "{outcome:#?}"),
        }
    }
    outcomes
}

#[test]
fn the_shipped_scenes_lose_and_invent_nothing() {
    for name in variants(&["eight-by-eight", "sensor-1"], 1) {
        let (scene, frames) = scene(name);
        check(&scene, &frames, 250_000);
    }
}

#[test]
fn several_subarrays_recover_from_a_reset_at_every_cycle() {
    let outcomes = check(&small(4, 6, "[partition]\ncase = 3\n[search]\nmu_max = 0.05\n"), &[], 1_000_000);
    let resets = outcomes.last().unwrap();
    assert_eq!((resets.resets, resets.experiment), (resets.possible_reset_cycles, "reset"));
}

#[test]
fn a_choice_of_cases_recovers() {
    let (eight, frames) = scene("eight-by-eight");
    let sensor = &eight.sensor;
    let lengths = [sensor.pitch_x_mm, sensor.pitch_y_mm, sensor.thickness_mm];
    let [x, y, h] = lengths;
    // The same text as in choice.rs, so that the library is shared.
    let text = format!(
        "name = \"choosing-eight-by-eight\"\n[sensor]\nrows = 8\ncols = 8\npitch_x_mm = {x}\npitch_y_mm = {y}\n\
         thickness_mm = {h}\n[partition]\ncase = \"adaptive\"\n"
    );
    check(&Scene::parse(&text, "choosing").unwrap(), &frames, 150_000);
}

#[test]
fn sums_without_a_search_and_averaged_frames_recover() {
    let averaged = "[search]\nmu_max = 0.0\n[input]\naverage = 1\n";
    check(&small(4, 4, averaged), &[], 100_000);
    // The mean starts again after a reset and after a frame cut short.
    let sliding = "[search]\nmu_max = 0.0\n[input]\naverage = 2\nmean = \"sliding\"\n";
    check(&small(4, 4, sliding), &[], 100_000);
    let adaptive = "[search]\nmu_max = 0.0\n[input]\naverage = 4\nmean = \"adaptive\"\ntemplate = false\n";
    check(&small(4, 4, adaptive), &[], 200_000);
    // A running zero goes on after a frame cut short, and starts again after a reset.
    check(&small(2, 2, RUNNING), &[], 100_000);
    let sums = check(&unsearched(), &[], 200_000);
    assert_eq!(sums[2].resets, sums[2].possible_reset_cycles);
}

#[test]
fn images_of_tables_are_taken_or_refused() {
    // An image with coefficients is longer.
    let covers = "[hardware.table_range]\nthickness_mm = [2.0, 4.0]\n";
    let running = "zero = \"running\"\nzero_average = 3\n";
    let sliding = "average = 2\nmean = \"sliding\"\n";
    let adaptive = "average = 3\nmean = \"adaptive\"\ntemplate = false\n";
    let scenes = [(running, 200_000), (adaptive, 400_000), ("", 200_000), (sliding, 200_000), (covers, 800_000)];
    for (more, cycles) in variants(&scenes, 1) {
        let written = format!("[hardware]\ntables = \"writable\"\n[input]\nfull_scale_MPa = 1.0\n{more}");
        check(&small(4, 3, &format!("[search]\nmu_max = 0.05\n{written}")), &[], *cycles);
    }
}

fn unsearched() -> Scene {
    small(4, 4, "[search]\nmu_max = 0.0\n[output]\nforces = \"resultants\"\n")
}

/// Each experiment finds the defect it is designed for.
#[test]
fn a_defect_is_found() {
    let defects = [
        // A frame is accepted while the last one has not been read; an early tlast does not restart; a reset leaves a
        // frame in the buffer.
        ("stalls", Change::within("receive", "s_axis_tready", |k| [!k.named("whole__q"), k.constant(1, 1)])),
        ("tlast", Change::value("receive", "scan__clear", |k| k.named("rst"))),
        ("reset", Change::within("receive", "whole__d", |k| [!k.named("rst"), k.constant(1, 1)])),
    ];
    are_found(&unsearched(), &defects);
    let written = "[search]\nmu_max = 0.0\n[hardware]\ntables = \"writable\"\n[input]\nfull_scale_MPa = 1.0\n";
    let defects = [
        // An image begins while frames are under way; one that ends early goes on; a damaged one counts.
        ("tables", Change::value("prepare", "load__idle", |k| k.constant(1, 1))),
        ("tables", Change::value("prepare__load", "wrong_length", |k| k.constant(1, 0))),
        ("tables", Change::value("prepare__load", "wrong_crc", |k| k.constant(1, 0))),
    ];
    are_found(&small(4, 3, written), &defects);
    // Of several rows of subarrays: passes of a frame that is dropped afterwards are handed over; a first subarray does not
    // wait for the rest of its frame.
    let defects = [
        ("tlast", Change::value("arrival", "lost", |k| k.constant(1, 0))),
        ("tlast", Change::value("arrival", "waits", |k| k.constant(1, 0))),
    ];
    are_found(&small(4, 6, "[partition]\ncase = 3\n[search]\nmu_max = 0.05\n"), &defects);
    if nightly() {
        // A frame that is dropped leaves its steps; the next one comes before they are written; a reset leaves drifts.
        let defects = [
            ("tlast", Change::value("prepare__calibrate", "early", |k| k.constant(1, 0))),
            ("tlast", Change::within("prepare__calibrate", "s_axis_tready", |k| [k.named("takes"), k.named("moves")])),
            ("reset", Change::value("prepare__calibrate", "stored", |k| k.named("word"))),
        ];
        are_found(&small(2, 2, RUNNING), &defects);
    }
}

/// The first of these defects is found by its experiment, in `make nightly` all.
fn are_found(scene: &Scene, defects: &[(&str, Change)]) {
    let mut hardware = hardware(scene);
    for (experiment, defect) in variants(defects, 1) {
        hardware.generated = generate_changed(&hardware.model, std::slice::from_ref(defect)).unwrap();
        let outcomes = stress(&hardware, &[], 100_000, 1).unwrap();
        let found = outcomes.iter().find(|outcome| outcome.experiment == *experiment).unwrap();
        assert!(found.violations > 0, "the defect in {defect} went unnoticed: {outcomes:#?}");
    }
}
