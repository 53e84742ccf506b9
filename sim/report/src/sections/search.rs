//! The search for μ: Π over the disc of μ, and the margin of its maximum as a measure of confidence.

use anyhow::Result;
use dermis_golden::spec::partition::Case;

use super::super::document::{decimal, percent, text_cell, two_digits, Item, Picture, Section, Table};
use super::super::measure::{objective_map, ContactCount, Measured, ObjectiveMap};
use super::super::pictures::{objective, scatter, Scatter, Series};
use super::super::style::SERIES;

/// The section with objective maps and margins.
///
/// # Errors
/// A picture that cannot be written.
pub fn search(measured: &[Measured]) -> Result<Section> {
    let whole = measured.iter().filter(|m| m.scene.partition.case == Case::WHOLE);
    let maps: Vec<Vec<ObjectiveMap>> =
        whole.map(|m| (0..m.frames.len()).filter_map(|index| objective_map(m, index)).collect()).collect();
    let mut pictures = Vec::new();
    for first in maps.iter().filter_map(|maps| maps.iter().find(|map| !map.path.is_empty()).or(maps.first())) {
        let caption = format!("{}, case 0, frame {}: Π over μ", first.scene, first.frame);
        pictures.push(Picture { id: format!("plane-{}", first.scene), caption, svg: objective(first)? });
    }
    for contacts in [ContactCount::One, ContactCount::Several] {
        pictures.extend(margins(&maps, contacts)?);
    }
    let head = ["sensor", "frame", "contacts", "shear error", "margin, bits"];
    let rows = maps.iter().flatten().map(|p| {
        vec![
            text_cell(p.scene.clone()),
            text_cell(p.frame.clone()),
            text_cell(p.contacts.name()),
            percent(p.tangential),
            decimal(Some(p.margin), 2),
        ]
    });
    Ok(Section {
        id: "search",
        title: "The search for μ and its confidence".into(),
        items: vec![
            Item::Text(
                "Π is the sparse objective, in bits; it is larger the fewer taxels carry the force. The margin is \
                 the difference between Π at the μ found and the largest Π at a distance of at least mu_max/8. With \
                 a large margin no clearly different μ explains the frame as well; with a small one, shear and \
                 uneven pressure are hard to distinguish in the frame; a negative one means that the search has \
                 missed the maximum."
                    .into(),
            ),
            Item::Pictures(pictures),
            Item::Table(Table::new("margins", "Margin of Π's maximum, case 0, golden model", &head, rows.collect())),
        ],
    })
}

/// Shear error against margin, one mark per frame with this contact count; `None` without such a frame.
fn margins(maps: &[Vec<ObjectiveMap>], contacts: ContactCount) -> Result<Option<Picture>> {
    let series = maps.iter().zip(0..).filter_map(|(maps, index): (_, usize)| {
        let points = maps
            .iter()
            .filter(|p| p.margin > 0.0 && p.contacts == contacts)
            .filter_map(|p| Some((p.margin, p.tangential.filter(|error| *error > 0.0)?, String::new())));
        let points: Vec<_> = points.collect();
        (!points.is_empty()).then_some(())?;
        Some(Series {
            name: maps.first()?.scene.clone(),
            colour: SERIES[1 + index % 7],
            shape: index % 4,
            hollow: false,
            points,
            joined: false,
        })
    });
    let series: Vec<Series> = series.collect();
    if series.is_empty() {
        return Ok(None);
    }
    let plot = Scatter {
        x: "margin of Π's maximum, bits".into(),
        y: "shear error of the frame".into(),
        log: [true, true],
        ticks: [two_digits, |error| format!("{} %", two_digits(100.0 * error))],
        series,
        guides: Vec::new(),
    };
    let name = contacts.name();
    let caption = format!("Shear error against margin, one mark per frame, case 0, golden model, contacts: {name}");
    Ok(Some(Picture { id: format!("margins-{name}"), caption, svg: scatter(&plot)? }))
}
