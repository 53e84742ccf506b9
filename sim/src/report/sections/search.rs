//! The search: Π over the disc of μ, and the margin of its maximum as a confidence in μ.

use anyhow::Result;
use dermis_golden::partition::Case;

use super::super::document::{decimal, percent, words, Item, Picture, Section, Table};
use super::super::measure::{plane, Measured, Plane};
use super::super::pictures::{objective, scatter, Scatter, Series};
use super::super::style::SERIES;
use super::time::short;

/// The section.
///
/// # Errors
/// A picture that cannot be written.
pub fn search(measured: &[Measured]) -> Result<Section> {
    let whole = measured.iter().filter(|m| m.scene.partition.case == Case::WHOLE);
    let planes: Vec<Vec<Plane>> =
        whole.map(|m| (0..m.frames.len()).filter_map(|index| plane(m, index)).collect()).collect();
    let mut pictures = Vec::new();
    for first in
        planes.iter().filter_map(|planes| planes.iter().find(|plane| !plane.path.is_empty()).or(planes.first()))
    {
        let caption = format!("{}, case 0, frame {}: Π over μ", first.scene, first.frame);
        pictures.push(Picture { id: format!("plane-{}", first.scene), caption, svg: objective(first)? });
    }
    pictures.push(margins(&planes)?);
    let head = ["sensor", "frame", "margin, bits", "shear error"];
    let rows = planes.iter().flatten().map(|p| {
        vec![words(p.scene.clone()), words(p.frame.clone()), decimal(Some(p.margin), 2), percent(p.tangential)]
    });
    Ok(Section {
        id: "search",
        title: "The search for μ and how sure it is".into(),
        items: vec![
            Item::Text(
                "Π is the sparse objective: how few taxels carry the force, in bits. The margin is what its maximum \
                 is above the best μ at least mu_max/8 away: a large margin means that no other answer fits the \
                 frame as well, a small one that shear and an uneven pressure look alike in it, one below zero that \
                 the search has missed the maximum."
                    .into(),
            ),
            Item::Pictures(pictures),
            Item::Table(Table::new("margins", "Margin of Π's maximum, case 0, golden model", &head, rows.collect())),
        ],
    })
}

/// Margin against error, one mark per frame.
fn margins(planes: &[Vec<Plane>]) -> Result<Picture> {
    let series = planes.iter().zip(0..).filter_map(|(planes, index): (_, usize)| {
        let points = planes
            .iter()
            .filter(|p| p.margin > 0.0)
            .filter_map(|p| Some((p.margin, p.tangential.filter(|error| *error > 0.0)?, String::new())));
        Some(Series {
            name: planes.first()?.scene.clone(),
            colour: SERIES[1 + index % 7],
            shape: index % 4,
            points: points.collect(),
            joined: false,
        })
    });
    let plot = Scatter {
        x: "margin of Π's maximum, bits".into(),
        y: "shear error of the frame".into(),
        log: [true, true],
        ticks: [short, |error| format!("{} %", short(100.0 * error))],
        series: series.collect(),
        guides: Vec::new(),
    };
    let caption = "Shear error against the margin, a mark per frame, case 0, golden model".into();
    Ok(Picture { id: "margins".into(), caption, svg: scatter(&plot)? })
}
