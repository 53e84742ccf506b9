//! What a built design takes of its board, as text.

use std::collections::BTreeMap;

use dermis_golden::fixed::cycles::lanes_busy;
use dermis_golden::fixed::{Cycles, Model};
use dermis_hdl::explain::Explained;
use dermis_hdl::usage::{total, Usage};

/// The stages in the order of the pipeline, by their names in the hardware.
const STAGES: [&str; 12] = [
    "prepare",
    "receive",
    "normalise",
    "fold",
    "pass",
    "rescale",
    "unfold",
    "search",
    "forces",
    "send",
    "resultants",
    "engine",
];

/// A table of the stages, the board's share, lanes and cycles.
pub fn resources(model: &Model, usage: &BTreeMap<String, Usage>) -> String {
    let board = &model.board;
    let row = |name: &str, cells: [String; 4]| format!("| {name:10} | {} |\n", cells.join(" | "));
    let line = |name: &str, u: &Usage| {
        let counts = [u.block_rams, u.multipliers, u.flip_flops, u.luts];
        row(name, std::array::from_fn(|k| format!("{:>w$}", counts[k], w = WIDTHS[k])))
    };
    const HEADS: [&str; 4] = ["block RAMs", "multipliers", "flip-flops*", "LUTs*"];
    const WIDTHS: [usize; 4] = [10, 11, 11, 6];
    let mut text = row("stage", std::array::from_fn(|k| format!("{:>w$}", HEADS[k], w = WIDTHS[k])));
    text.push_str(&format!("|------------|{}|\n", WIDTHS.map(|w| "-".repeat(w + 1) + ":").join("|")));
    let present = STAGES.iter().filter_map(|stage| usage.get(*stage).map(|usage| (stage, usage)));
    present.for_each(|(stage, usage)| text.push_str(&line(stage, usage)));
    let all = total(usage);
    text.push_str(&line("all", &all));
    let share = |needs: usize, has: u32| format!("{:.0} %", 100.0 * needs as f64 / f64::from(has));
    let shares = [
        share(all.block_rams, board.block_rams),
        share(all.multipliers, board.multipliers),
        share(all.flip_flops, board.flip_flops),
        share(all.luts, board.luts),
    ];
    text.push_str(&row("of board", std::array::from_fn(|k| format!("{:>w$}", shares[k], w = WIDTHS[k]))));
    let latency = Cycles::of(model, &vec![true; model.parts.len()]).latency;
    text.push_str(&format!(
        "* estimated\n{}: {} lanes, {:.0} % busy during the passes; {latency} cycles from last input to last output \
         beat\n",
        board.name,
        4 * model.formats.lanes_per_parity,
        100.0 * lanes_busy(model),
    ));
    text
}

/// What the scene has, then a table of what it leaves out.
pub fn features(explained: &[Explained]) -> String {
    let mut text = "\nthe scene needs:\n".to_string();
    let present = explained.iter().filter(|feature| feature.present);
    present.for_each(|feature| text.push_str(&format!("  {}: {}\n", feature.feature, feature.setting)));
    if explained.iter().all(|feature| !feature.present) {
        text.push_str("  none of the features that hardware can do without\n");
    }
    text.push_str("\nleft out, and what that saves against the scene with it put back:\n");
    let mut rows =
        vec![["left out", "put back as", "block RAMs", "multipliers", "flip-flops*", "LUTs*", "cycles"]
            .map(str::to_string)];
    rows.extend(explained.iter().filter_map(|feature| {
        let saved = feature.saved?;
        let numbers = [saved.block_rams, saved.multipliers, saved.flip_flops, saved.luts, saved.cycles];
        let [rams, multipliers, flip_flops, luts, cycles] = numbers.map(|n| n.to_string());
        let [name, setting] = [feature.feature.to_string(), feature.setting.clone()];
        Some([name, setting, rams, multipliers, flip_flops, luts, cycles])
    }));
    let widths: [usize; 7] =
        std::array::from_fn(|k| rows.iter().map(|row| row[k].chars().count()).max().unwrap_or_default());
    for (index, row) in rows.iter().enumerate() {
        let cells: [String; 7] = std::array::from_fn(|k| match k {
            0 | 1 => format!("{:w$}", row[k], w = widths[k]),
            _ => format!("{:>w$}", row[k], w = widths[k]),
        });
        text.push_str(&format!("| {} |\n", cells.join(" | ")));
        if index == 0 {
            let rule: [String; 7] = std::array::from_fn(|k| match k {
                0 | 1 => "-".repeat(widths[k] + 2),
                _ => "-".repeat(widths[k] + 1) + ":",
            });
            text.push_str(&format!("|{}|\n", rule.join("|")));
        }
    }
    for feature in explained {
        if let Some(reason) = &feature.impossible {
            text.push_str(&format!("{} ({}) cannot be put back: {reason}\n", feature.feature, feature.setting));
        }
    }
    text
}
