//! Resources of a generated design and its optional features, as text.

use dermis_golden::fixed::plan::cycles::lane_utilisation;
use dermis_golden::fixed::plan::program::listing;
use dermis_golden::fixed::{Cycles, Model};
use dermis_hdl::explain::{Explained, Saved};
use dermis_hdl::usage::{total, StageUsage, Usage};

use super::table::{aligned, markdown};

/// A table of the resources of each stage and their share of the board, with lanes and cycles.
pub fn resources(model: &Model, usage: &StageUsage) -> String {
    let board = &model.board;
    let row = |name: &str, cells: [String; 4]| [vec![name.to_string()], cells.to_vec()].concat();
    let line = |name: &str, u: &Usage| row(name, u.counts().map(|count| count.to_string()));
    let all = total(usage);
    let mut rows: Vec<Vec<String>> = usage.iter().map(|(stage, usage)| line(stage, usage)).collect();
    rows.push(line("all", &all));
    rows.push(row("of board", all.shares(board).map(|share| format!("{share:.0} %"))));
    let mut text = markdown(&["stage", "block RAMs", "multipliers", "flip-flops*", "LUTs*"], rows);
    let latency = Cycles::longest(model).latency;
    text.push_str(&format!(
        "* estimated\n{}: {} lanes, {:.0} % busy during the passes; {latency} cycles from last input to last output \
         beat\n",
        board.name,
        4 * model.formats().lanes_per_parity,
        100.0 * lane_utilisation(model),
    ));
    text
}

/// The program of the passes as a table; none for the serial engine, which has no lanes.
pub fn program(model: &Model) -> String {
    let program = listing(model);
    if program.is_empty() {
        return String::new();
    }
    let several = model.chooses();
    let rows = program.into_iter().map(|run| {
        let section = if several { format!("case {}, {}", run.case, run.section) } else { run.section.to_owned() };
        let [step, group, flip] = [run.step, run.group, run.flip].map(|number| number.to_string());
        let [coefficients, cycles] = [run.coefficients, run.cycles].map(|number| number.to_string());
        vec![section, run.matrix, run.operand, run.result, step, group, flip, coefficients, cycles]
    });
    let head = ["runs", "matrix", "operand", "result", "step", "row group", "flip", "first word", "cycles"];
    format!("\nprogram of the passes:\n{}", aligned(4, &head, rows.collect()))
}

/// The optional features that the scene uses, then a table of those left out.
pub fn features(explained: &[Explained]) -> String {
    let mut text = "\nfeatures of the scene:\n".to_string();
    let present = explained.iter().filter(|feature| feature.present);
    for feature in present {
        text.push_str(&format!("  {}: {}\n", feature.feature, feature.setting));
        if let Some(Saved { block_rams, multipliers, flip_flops, luts, cycles }) = feature.costs {
            text.push_str(&format!(
                "    cost: {block_rams} block RAMs, {multipliers} multipliers, {flip_flops} flip-flops*, \
                 {luts} LUTs*, {cycles} cycles\n"
            ));
        }
    }
    if explained.iter().all(|feature| !feature.present) {
        text.push_str("  no optional feature\n");
    }
    text.push_str("\nfeatures left out, and what each would cost:\n");
    let rows = explained.iter().filter_map(|feature| {
        let saved = feature.saved?;
        let numbers = [saved.block_rams, saved.multipliers, saved.flip_flops, saved.luts, saved.cycles];
        let names = vec![feature.feature.to_string(), feature.setting.clone()];
        Some([names, numbers.map(|n| n.to_string()).to_vec()].concat())
    });
    let head = ["feature", "setting", "block RAMs", "multipliers", "flip-flops*", "LUTs*", "cycles"];
    text.push_str(&aligned(2, &head, rows.collect()));
    for feature in explained {
        if let Some(reason) = &feature.impossible {
            text.push_str(&format!("{} ({}) cannot be added: {reason}\n", feature.feature, feature.setting));
        }
    }
    text
}
