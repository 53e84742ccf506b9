//! Resources of the recommended designs, and the optional features left out of them.

use anyhow::Result;
use dermis_hdl::explain::explain;
use dermis_hdl::usage::{total, Usage};

use super::super::document::{count, text_cell, Cell, Item, Picture, Section, Table};
use super::super::measure::{BitTrue, Measured, Options};
use super::super::pictures::{bars, Bars};
use super::super::style::SERIES;
use super::choice::{designs, Choice};
use super::lookup::case_text;
use dermis_flow::jobs::parallel;

/// The section with resources; the quick variant lists the features left out for the first scene only.
///
/// # Errors
/// A picture that cannot be written; a feature whose hardware cannot be generated; an interruption.
pub fn resources(measured: &[Measured], choices: &[Choice], options: &Options) -> Result<Section> {
    let chosen = || designs(measured, choices);
    let groups = chosen().map(|(m, bit_true)| {
        let shares = total(&bit_true.usage).shares(&bit_true.model.board);
        (format!("{}, {}", m.scene.name, m.scene.partition.case), shares.map(Some).to_vec())
    });
    let names = ["block RAMs", "multipliers", "flip-flops, estimated", "LUTs, estimated"];
    let plot = Bars {
        axis: "% of the board".into(),
        groups: groups.collect(),
        series: names.iter().zip(&SERIES[1..]).map(|(name, colour)| ((*name).to_owned(), *colour)).collect(),
        text: |value| format!("{value:.0} %"),
        limit: Some(100.0),
        names_above: false,
        log: false,
    };
    let board = chosen().next().map_or("", |(_, bit_true)| bit_true.model.board.name.as_str());
    let caption = format!(
        "Resources of each scene's hardware in the recommended case (next to its name), as share of the board ({board})"
    );
    let picture = Picture { id: "resources".into(), caption, svg: bars(&plot)? };
    let head = ["sensor", "case", "stage", "block RAMs", "multipliers", "flip-flops, est.", "LUTs, est."];
    let stages = chosen().flat_map(|(m, bit_true)| stage_rows(m, bit_true));
    Ok(Section {
        id: "resources",
        title: "Resources of the hardware, and features left out".into(),
        items: vec![
            Item::Pictures(vec![picture]),
            Item::Table(
                Table::new(
                    "resources",
                    "Resources by stage, in the number format of the scene file",
                    &head,
                    stages.collect(),
                )
                .collapsed(),
            ),
            Item::Table(left_out(chosen().collect(), options)?),
        ],
    })
}

fn stage_rows(m: &Measured, bit_true: &BitTrue) -> Vec<Vec<Cell>> {
    let row = |name: &str, usage: &Usage| {
        let mut row =
            vec![text_cell(m.scene.name.clone()), text_cell(case_text(m.scene.partition.case)), text_cell(name)];
        row.extend(usage.counts().map(|n| count(n as u64)));
        row
    };
    let stages = bit_true.usage.iter().map(|(stage, usage)| row(stage, usage));
    stages.chain([row("all", &total(&bit_true.usage))]).collect()
}

fn left_out(chosen: Vec<(&Measured, &BitTrue)>, options: &Options) -> Result<Table> {
    let kept = if options.quick { 1 } else { chosen.len() };
    let chosen = chosen.into_iter().take(kept).collect();
    let explained = parallel(
        "what was left out",
        chosen,
        options.jobs,
        &options.interrupt,
        |(m, bit_true): (&Measured, &BitTrue)| Ok((m.scene.name.clone(), explain(&bit_true.model)?)),
    )?;
    let rows = explained.iter().flat_map(|(scene, features)| {
        features.iter().filter_map(move |feature| {
            let saved = feature.saved?;
            let numbers = [saved.block_rams, saved.multipliers, saved.flip_flops, saved.luts, saved.cycles];
            let mut row =
                vec![text_cell(scene.clone()), text_cell(feature.feature), text_cell(feature.setting.clone())];
            row.extend(numbers.map(|n| Cell { shown: n.to_string(), number: Some(n as f64) }));
            Some(row)
        })
    });
    let head = [
        "sensor",
        "left out",
        "put back as",
        "block RAMs saved",
        "multipliers",
        "flip-flops, est.",
        "LUTs, est.",
        "cycles",
    ];
    let caption = "Features left out of the hardware because the scene does not use them, and the resources that this \
                   saves; put back as: the setting that adds the feature";
    Ok(Table::new("left-out", caption, &head, rows.collect()))
}
