//! Disabled features are not in the Verilog, and the reported saving is the difference of two builds.

use dermis_golden::fixed::{Cycles, Model};
use dermis_golden::spec::scene::Scene;
use dermis_hdl::explain::explain;
use dermis_hdl::generate;
use dermis_hdl::usage::total;
use dermis_tests::verilog_code;

fn model(more: &str) -> Model {
    let sensor = "[sensor]\nrows = 6\ncols = 6\npitch_x_mm = 3.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n";
    Model::new(&Scene::parse(&format!("name = \"explained\"\n{sensor}{more}"), "explained").unwrap()).unwrap()
}

fn saved(more: &str, feature: &str) -> [i64; 3] {
    let all = explain(&model(more)).unwrap();
    let saved = all.iter().find(|e| e.feature == feature).unwrap().saved.unwrap();
    [saved.block_rams, saved.multipliers, saved.flip_flops]
}

#[test]
fn an_omission_saves_what_two_builds_differ_by() {
    let bare = "[search]\nmu_max = 0\n[fixed]\nlanes = 36\n";
    let usage = |more: &str| total(&generate(&model(more)).unwrap().usage);
    let (without, with) = (usage(bare), usage("[search]\nmu_max = 0.6\n[fixed]\nlanes = 36\n"));
    let less = |with: usize, without: usize| with as i64 - without as i64;
    let difference = [
        less(with.block_rams, without.block_rams),
        less(with.multipliers, without.multipliers),
        less(with.flip_flops, without.flip_flops),
    ];
    assert_eq!(saved(bare, "search"), difference);
    assert!(difference[1] > 0 && difference[2] > 1000);
    // Two products of 21 by 18 bits, one ROM: known independently of the model.
    assert_eq!(saved(bare, "calibration table")[..2], [2, 2]);
}

#[test]
fn dead_taxels_cost_what_two_builds_differ_by() {
    let (alive, dead) = (model("[fixed]\nlanes = 36\n"), model("[fixed]\nlanes = 36\n[input]\ndead = [[1, 4]]\n"));
    let explained = explain(&dead).unwrap();
    let costs = explained.iter().find(|e| e.feature == "dead taxels").unwrap().costs.unwrap();
    let [with, without] = [&dead, &alive].map(|model| total(&generate(model).unwrap().usage));
    assert_eq!(costs.block_rams, with.block_rams as i64 - without.block_rams as i64);
    assert_eq!(costs.flip_flops, with.flip_flops as i64 - without.flip_flops as i64);
    let cycles = |model: &Model| Cycles::of(model, &[true]).latency as i64;
    assert_eq!(costs.cycles, cycles(&dead) - cycles(&alive));
    assert_eq!(dead.storage().words(), 4 * alive.storage().words());
    assert!(saved("[fixed]\nlanes = 36\n", "dead taxels")[2] > 0);
}

/// The check of codes states its cost where it is, and what it would cost where it is left out.
#[test]
fn the_code_check_costs_what_two_builds_differ_by() {
    let lanes = "[fixed]\nlanes = 36\n";
    let (on, off) = (model(lanes), model(&format!("{lanes}[hardware]\ncode_check = \"off\"\n")));
    let [with, without] = [&on, &off].map(|model| total(&generate(model).unwrap().usage));
    let of = |model: &Model| explain(model).unwrap().into_iter().find(|e| e.feature == "code check").unwrap();
    assert!(of(&on).present && !of(&off).present);
    for costs in [of(&on).costs.unwrap(), of(&off).saved.unwrap()] {
        assert_eq!(costs.luts, with.luts as i64 - without.luts as i64);
        assert_eq!((costs.block_rams, costs.multipliers, costs.cycles), (0, 0, 0));
        assert!((300..900).contains(&costs.luts) && costs.flip_flops < 600, "{costs:?}");
    }
    let has = |model: &Model| verilog_code(&model.scene).contains("check__faults");
    assert!(has(&on) && !has(&off));
}

/// The sum of the forces that tells whether they pull: an adder, a register, no multiplier and no cycle.
#[test]
fn negative_pressure_costs_what_two_builds_differ_by() {
    let on = Model::new(&Scene::builtin("eight-by-eight").unwrap()).unwrap();
    let off = Model::new(&on.scene).unwrap().with_changed_plan(|plan| plan.push_limit = None).unwrap();
    let [with, without] = [&on, &off].map(|model| total(&generate(model).unwrap().usage));
    let of = |model: &Model| explain(model).unwrap().into_iter().find(|e| e.feature == "negative pressure");
    let costs = of(&on).unwrap().costs.unwrap();
    assert_eq!(costs.luts, with.luts as i64 - without.luts as i64);
    assert_eq!((costs.block_rams, costs.multipliers, costs.cycles), (0, 0, 0));
    assert!((30..200).contains(&costs.luts) && costs.flip_flops < 120, "{costs:?}");
    assert!(of(&off).is_none());
}

/// The width in use states its cost over the narrowest; a narrower one what the widest would cost.
#[test]
fn the_search_width_costs_what_two_builds_differ_by() {
    let lanes = "[fixed]\nlanes = 36\n";
    let (wide, narrow) = (model(lanes), model(&format!("{lanes}[hardware]\nsearch_width = 1\n")));
    let [with, without] = [&wide, &narrow].map(|model| total(&generate(model).unwrap().usage));
    let own = explain(&wide).unwrap().into_iter().find(|e| e.feature == "search width").unwrap();
    let other = explain(&narrow).unwrap().into_iter().find(|e| e.feature == "search width").unwrap();
    assert!(own.present && !other.present);
    for costs in [own.costs.unwrap(), other.saved.unwrap()] {
        assert_eq!(costs.luts, with.luts as i64 - without.luts as i64);
        assert_eq!(costs.cycles, Cycles::longest(&wide).latency as i64 - Cycles::longest(&narrow).latency as i64);
        assert!(costs.luts > 5000 && costs.cycles < 0, "{costs:?}");
    }
}

/// Against a block of as many frames; without any averaging, what the shortest sliding mean would cost.
#[test]
fn a_sliding_mean_costs_what_two_builds_differ_by() {
    let input = |mean: &str| model(&format!("[fixed]\nlanes = 36\n[input]\naverage = 3\nmean = \"{mean}\"\n"));
    let (sliding, block) = (input("sliding"), input("block"));
    let [with, without] = [&sliding, &block].map(|model| total(&generate(model).unwrap().usage));
    let of = |model: &Model| explain(model).unwrap().into_iter().find(|e| e.feature == "sliding mean").unwrap();
    assert!(of(&sliding).present && !of(&block).present);
    for costs in [of(&sliding).costs.unwrap(), of(&block).saved.unwrap()] {
        assert_eq!(costs.luts, with.luts as i64 - without.luts as i64);
        assert_eq!((costs.block_rams, costs.cycles), (0, 1));
        assert!((50..400).contains(&costs.luts), "{costs:?}");
    }
    assert!(saved("[fixed]\nlanes = 36\n", "sliding mean")[0] > 0);
}

/// Against a sliding mean as long as the longest; without any averaging, what the default would cost.
#[test]
fn an_adaptive_mean_costs_what_two_builds_differ_by() {
    let input = |mean: &str| model(&format!("[fixed]\nlanes = 36\n[input]\naverage = 3\n{mean}\n"));
    let (adaptive, sliding) = (input("mean = \"adaptive\"\ntemplate = false"), input("mean = \"sliding\""));
    let [with, without] = [&adaptive, &sliding].map(|model| total(&generate(model).unwrap().usage));
    let of = |model: &Model| explain(model).unwrap().into_iter().find(|e| e.feature == "adaptive mean").unwrap();
    assert!(of(&adaptive).present && !of(&sliding).present);
    let costs = of(&adaptive).costs.unwrap();
    let latency = |model: &Model| model.prepare.latency() as i64;
    assert_eq!(costs.luts, with.luts as i64 - without.luts as i64);
    assert_eq!(costs.cycles, latency(&adaptive) - latency(&sliding));
    assert!((200..3000).contains(&costs.luts) && costs.multipliers > 0, "{costs:?}");
    assert!(saved("[fixed]\nlanes = 36\n", "adaptive mean")[0] > 0);
}

/// With it and without it.
#[test]
fn a_running_zero_costs_what_two_builds_differ_by() {
    let input = |zero: &str| model(&format!("[fixed]\nlanes = 36\n[input]\nfull_scale_MPa = 1.0\nzero = \"{zero}\"\n"));
    let (running, fixed) = (input("running"), input("fixed"));
    let [with, without] = [&running, &fixed].map(|model| total(&generate(model).unwrap().usage));
    let of = |model: &Model| explain(model).unwrap().into_iter().find(|e| e.feature == "running zero").unwrap();
    assert!(of(&running).present && !of(&fixed).present);
    for costs in [of(&running).costs.unwrap(), of(&fixed).saved.unwrap()] {
        assert_eq!(costs.luts, with.luts as i64 - without.luts as i64);
        assert_eq!(costs.cycles, 4);
        assert!((100..1500).contains(&costs.luts), "{costs:?}");
    }
}

#[test]
fn what_the_scene_has_is_not_left_out() {
    let all = explain(&model("[input]\naverage = 2\nfull_scale_MPa = 1.0\n[threshold]\nmin_force_N = 0.1\n")).unwrap();
    let present: Vec<&str> = all.iter().filter(|e| e.present).map(|e| e.feature).collect();
    assert_eq!(present, ["code check", "averaging", "search", "polynomial of degree 3", "search width", "threshold"]);
}

#[test]
fn absent_stages_leave_no_logic() {
    let verilog = |more: &str| verilog_code(&model(more).scene);
    let bare = verilog("[search]\nmu_max = 0\n");
    for word in
        ["taylor", "candidates", "sums [", "drifts [", "means [", "frames_held [", "entries [", "x__mu [", "below <="]
    {
        assert!(!bare.contains(word), "{word}");
    }
    let sliding = verilog("[search]\nmu_max = 0\n[input]\naverage = 2\nmean = \"sliding\"\n");
    assert!(sliding.contains("means [") && sliding.contains("frames_held ["));
    let full = verilog("[input]\naverage = 2\nfull_scale_MPa = 1.0\n[threshold]\nmin_force_N = 0.1\n");
    for word in ["taylor", "candidates", "sums [", "x__mu [", "below <="] {
        assert!(full.contains(word), "{word}");
    }
}

#[test]
fn a_scene_that_does_not_fit_is_told_what_does() {
    let text =
        "name = \"wide\"\n[sensor]\nrows = 16\ncols = 16\npitch_x_mm = 2.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n\
                [hardware]\nboard = \"colorlight-i5\"\n";
    let error = Model::new(&Scene::parse(text, "wide").unwrap()).unwrap_err().to_string();
    assert!(error.contains("there are 56; it fits with any one of:"), "{error}");
    // The suggested change works.
    let suggestion = error.lines().find_map(|line| line.trim().strip_prefix("partition.case = ")).unwrap();
    let (case, needs) = suggestion.split_once(": ").unwrap();
    let model = Model::new(&Scene::parse(&format!("{text}[partition]\ncase = {case}\n"), "wide").unwrap()).unwrap();
    assert!(needs.starts_with(&format!("{} block RAMs", model.resources.block_rams())), "{error}");
}
