//! Fixed point against floating point stage by stage, to show which stage costs accuracy.

use anyhow::Result;

use super::super::document::{count, percent, text_cell, two_digits, Cell, Item, Picture, Section, Table};
use super::super::measure::{stages as trace, ContactCount, Measured, StageRow};
use super::super::pictures::{bars, Bars};
use super::super::style::SERIES;
use super::choice::Choice;

/// The section with the differences of all stages.
///
/// # Errors
/// A picture that cannot be written.
pub fn stages(measured: &[Measured], choices: &[Choice]) -> Result<Section> {
    let rows: Vec<StageRow> =
        measured.iter().flat_map(|m| (0..m.frames.len()).flat_map(|index| trace(m, index))).collect();
    let mut pictures = Vec::new();
    for choice in choices {
        let m = &measured[choice.index];
        let (scene, case) = (&m.scene.name, m.scene.partition.case.to_string());
        let kept = m.frames.iter().filter(|frame| ContactCount::of(frame) == choice.contact_count);
        let kept: Vec<&str> = kept.map(|frame| frame.id.as_str()).collect();
        let own = rows.iter().filter(|row| row.scene == *scene && row.case == case && kept.contains(&&*row.frame));
        let own: Vec<&StageRow> = own.collect();
        if !own.is_empty() {
            pictures.push(picture(scene, &case, choice.contact_count, kept.len(), &own)?);
        }
    }
    let head = [
        "sensor",
        "case",
        "stage",
        "max, LSB",
        "RMS, LSB",
        "max, of the largest",
        "RMS, of the largest",
        "bits used",
        "bits there",
        "saturations",
    ];
    let one_head: Vec<&'static str> = [&head[..2], &["frame"], &head[2..]].concat();
    let all = rows.iter().map(|row| {
        let mut cells = line(std::slice::from_ref(row));
        cells.insert(2, text_cell(row.frame.clone()));
        cells
    });
    let caption =
        "Largest and RMS difference over the frames; bits used: by the largest word; bits there: width of the \
                   word";
    Ok(Section {
        id: "stages",
        title: "Fixed point against floating point, stage by stage".into(),
        items: vec![
            Item::Text(
                "Difference between each stage's words and the same stage in floating point, which starts from the \
                 unquantised stress with unrounded matrices. Stage force compares p at the bit-true model's μ: the \
                 error of the arithmetic alone. Stage search compares that μ with the golden model's (LSB: \
                 mu_max/384). Stage send compares the output: the error of arithmetic and search. Shares are \
                 relative to the frame's largest value. LSBs differ between subarrays; the difference in LSB can be \
                 large in a subarray with little load."
                    .into(),
            ),
            Item::Pictures(pictures),
            Item::Table(Table::new("stages", caption, &head, summed(&rows)).collapsed()),
            Item::Table(Table::new("stages-frames", "The same for each frame", &one_head, all.collect()).collapsed()),
        ],
    })
}

/// Combines the rows of each scene, case and stage over the frames, in order of first appearance.
fn summed(rows: &[StageRow]) -> Vec<Vec<Cell>> {
    let mut groups: Vec<Vec<StageRow>> = Vec::new();
    for row in rows {
        let same = |group: &&mut Vec<StageRow>| {
            (&group[0].scene, &group[0].case, group[0].stage) == (&row.scene, &row.case, row.stage)
        };
        match groups.iter_mut().find(same) {
            Some(group) => group.push(row.clone()),
            None => groups.push(vec![row.clone()]),
        }
    }
    groups.iter().map(|group| line(group)).collect()
}

fn largest(rows: &[StageRow], value: fn(&StageRow) -> f64) -> f64 {
    rows.iter().map(value).fold(0.0, f64::max)
}

fn rms(rows: &[StageRow], value: fn(&StageRow) -> f64) -> f64 {
    (rows.iter().map(|row| value(row).powi(2)).sum::<f64>() / rows.len() as f64).sqrt()
}

fn line(rows: &[StageRow]) -> Vec<Cell> {
    let first = &rows[0];
    vec![
        text_cell(first.scene.clone()),
        text_cell(first.case.clone()),
        text_cell(first.stage),
        lsb(largest(rows, |row| row.max_lsb)),
        lsb(rms(rows, |row| row.rms_lsb)),
        small(largest(rows, |row| row.max_share)),
        small(rms(rows, |row| row.rms_share)),
        count(rows.iter().map(|row| u64::from(row.used_bits)).max().unwrap_or(0)),
        count(u64::from(first.has_bits)),
        count(rows.iter().map(|row| u64::from(row.saturations)).sum()),
    ]
}

/// A number of LSBs, which can be far below one.
fn lsb(value: f64) -> Cell {
    Cell { shown: two_digits(value), number: Some(value) }
}

/// A share in percent, which can be far below 0.01 %.
fn small(share: f64) -> Cell {
    Cell { shown: format!("{} %", two_digits(100.0 * share)), ..percent(Some(share)) }
}

fn picture(scene: &str, case: &str, contacts: ContactCount, frames: usize, own: &[&StageRow]) -> Result<Picture> {
    let first = own.first().map_or("", |row| row.frame.as_str());
    let names = own.iter().filter(|row| row.frame == first).map(|row| row.stage);
    let groups = names.map(|stage| {
        let rows: Vec<StageRow> = own.iter().filter(|row| row.stage == stage).map(|row| (*row).clone()).collect();
        let values = [largest(&rows, |row| row.max_share), rms(&rows, |row| row.rms_share)];
        // A logarithmic axis has no zero.
        (stage.to_owned(), values.map(|value| Some(100.0 * value).filter(|value| *value > 0.0)).to_vec())
    });
    let plot = Bars {
        axis: "difference, % of the stage's largest value".into(),
        groups: groups.collect(),
        series: vec![("max over the frames".into(), SERIES[2]), ("RMS".into(), SERIES[1])],
        text: two_digits,
        limit: None,
        names_above: false,
        log: true,
    };
    let name = contacts.name();
    let caption = format!(
        "{scene}, case {case}, contacts: {name}: difference from floating point along the pipeline, {frames} frames"
    );
    Ok(Picture { id: format!("stages-{scene}-{name}"), caption, svg: bars(&plot)? })
}
