//! Parameter sweeps: error against cycles and against block RAMs, with one field of a scene changed at a time.

use anyhow::Result;

use super::super::document::{count, percent, text_cell, two_digits, Cell, Item, Picture, Section, Table};
use super::super::measure::{ContactCount, SweepPoint};
use super::super::pictures::{scatter, Guide, Scatter, Series};
use super::super::style::SERIES;

/// The section from the sweeps of each scene, given with contact count and number of frames.
///
/// # Errors
/// A picture that cannot be written.
pub fn sweeps(all: &[(Vec<SweepPoint>, ContactCount, usize)]) -> Result<Section> {
    let mut pictures = Vec::new();
    for (points, contact_count, frames) in all {
        let Some((scene, case)) = points.first().map(|point| (&point.scene, &point.case)) else { continue };
        for (what, x) in
            [("cycles", (|p| p.cycles as f64) as fn(&SweepPoint) -> f64), ("block RAMs", |p| p.block_rams as f64)]
        {
            pictures.push(Picture {
                id: format!("sweep-{scene}-{}-{}", contact_count.name(), what.replace(' ', "-")),
                caption: format!(
                    "{scene} from case {case}, contacts: {}: shear error of the bit-true model against {what}, median \
                     of {frames} frames",
                    contact_count.name()
                ),
                svg: scatter(&plot(points, what, x))?,
            });
        }
    }
    let head = [
        "sensor",
        "case",
        "field",
        "value",
        "contacts",
        "shear error, median",
        "nine of ten below",
        "normal error, median",
        "frames",
        "cycles, total",
        "block RAMs",
        "multipliers",
        "fits the board",
        "the scene's own",
    ];
    let rows =
        all.iter().flat_map(|(points, contacts, frames)| points.iter().map(|point| row(point, *contacts, *frames)));
    let caption =
        "All settings; nine of ten below: 90 % quantile of the shear error; the scene's own: the value in its \
                   file";
    Ok(Section {
        id: "sweeps",
        title: "What each setting costs".into(),
        items: vec![
            Item::Text(
                "One field of each scene is changed at a time. Settings that do not fit the board are omitted, \
                 except for degree. Cycles are the bit-true model's with every subarray searched; co-simulation \
                 checks that the hardware's are equal."
                    .into(),
            ),
            Item::Pictures(pictures),
            Item::Table(Table::new("sweeps", caption, &head, rows.collect()).collapsed()),
        ],
    })
}

fn row(p: &SweepPoint, contacts: ContactCount, frames: usize) -> Vec<Cell> {
    let yes = |is: bool| text_cell(if is { "yes" } else { "" });
    vec![
        text_cell(p.scene.clone()),
        text_cell(p.case.clone()),
        text_cell(p.field),
        text_cell(p.value.clone()),
        text_cell(contacts.name()),
        percent(p.tangential),
        percent(p.ninety),
        percent(p.normal),
        count(frames as u64),
        count(p.cycles),
        count(p.block_rams as u64),
        count(p.multipliers as u64),
        yes(p.fits),
        yes(p.own),
    ]
}

fn plot(points: &[SweepPoint], what: &str, x: fn(&SweepPoint) -> f64) -> Scatter {
    let own = points.chunk_by(|a, b| a.field == b.field);
    let series = own.zip(0..).map(|(group, index): (_, usize)| Series {
        name: group[0].field.into(),
        colour: SERIES[index % 8],
        shape: index % 4,
        hollow: false,
        points: group
            .iter()
            .filter_map(|p| Some((x(p), p.tangential.filter(|error| *error > 0.0)?, p.value.clone())))
            .collect(),
        // Numeric settings are joined by a line, cases are not.
        joined: group[0].field != "case",
    });
    Scatter {
        x: what.into(),
        y: "shear error, median".into(),
        log: [false, true],
        ticks: [|x| format!("{x:.0}"), |error| format!("{} %", two_digits(100.0 * error))],
        series: series.collect(),
        guides: points
            .iter()
            .find_map(|p| Some(Guide::Ring((x(p), p.tangential.filter(|_| p.own)?), "unchanged scene".into())))
            .into_iter()
            .collect(),
    }
}
