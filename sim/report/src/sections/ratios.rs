//! μ of every subarray in every case, as in the paper's Fig. 3.

use anyhow::Result;

use super::super::document::{decimal, text_cell, Cell, Item, Picture, Section, Table};
use super::super::measure::{ContactCount, Measured};
use super::super::pictures::{bars, Bars};
use super::super::style::SERIES;
use super::lookup::{case_text, illustrated_frame, scenes};

/// The section with the friction ratios.
///
/// # Errors
/// A picture that cannot be written.
pub fn ratios(measured: &[Measured]) -> Result<Section> {
    let rectangles = || measured.iter().filter(|m| m.scene.partition.case.grid().is_some());
    let mut pictures = Vec::new();
    for scene in scenes(measured) {
        let own: Vec<&Measured> = rectangles().filter(|m| m.scene.name == scene).collect();
        let several = own.iter().any(|m| m.frames.iter().any(|frame| ContactCount::of(frame) == ContactCount::Several));
        let contact_count = if several { ContactCount::Several } else { ContactCount::One };
        pictures.push(picture(scene, &own, |m| illustrated_frame(m, contact_count), "ratios")?);
    }
    let head = ["sensor", "case", "frame", "subarray", "condition", "μ1", "μ2", "Π, bits"];
    let rows = rectangles().flat_map(|m| m.golden.iter().flat_map(move |result| rows(m, result)));
    Ok(Section {
        id: "ratios",
        title: "Friction ratios per subarray".into(),
        items: vec![
            Item::Text(
                "Subarrays SA1, SA2, … are numbered row by row. Both bars are zero where a subarray was not searched \
                 or no shear was found."
                    .into(),
            ),
            Item::Pictures(pictures),
            Item::Table(
                Table::new("ratios", "μ of the golden model in every subarray", &head, rows.collect()).collapsed(),
            ),
        ],
    })
}

fn rows(m: &Measured, result: &dermis_golden::result::reconstruct::Reconstruction) -> Vec<Vec<Cell>> {
    let row = |(k, part): (usize, &dermis_golden::result::reconstruct::SubarrayResult)| {
        vec![
            text_cell(m.scene.name.clone()),
            text_cell(case_text(m.scene.partition.case)),
            text_cell(result.frame.clone()),
            text_cell(format!("SA{}", k + 1)),
            text_cell(if part.centroid_condition { "met" } else { "not met" }),
            decimal(Some(part.mu[0]), 4),
            decimal(Some(part.mu[1]), 4),
            decimal(part.objective_value, 1),
        ]
    };
    result.subarrays.iter().enumerate().map(row).collect()
}

/// μ of the golden model on one frame, all cases of a scene.
pub(super) fn picture(
    scene: &str,
    own: &[&Measured],
    frame: impl Fn(&Measured) -> usize,
    prefix: &str,
) -> Result<Picture> {
    let groups = own.iter().flat_map(|m| {
        let case = m.scene.partition.case;
        let parts = &m.golden[frame(m)].subarrays;
        let group = move |(k, part): (usize, &dermis_golden::result::reconstruct::SubarrayResult)| {
            (format!("case {case}, SA{}", k + 1), part.mu.map(Some).to_vec())
        };
        parts.iter().enumerate().map(group)
    });
    let plot = Bars {
        axis: "μ, shear over normal load".into(),
        groups: groups.collect(),
        series: vec![("μ1, along x".into(), SERIES[1]), ("μ2, along y".into(), SERIES[2])],
        text: |mu| format!("{mu:.3}"),
        limit: None,
        names_above: false,
        log: false,
    };
    let id = own.first().map_or("", |m| m.frames[frame(m)].id.as_str());
    let caption = format!("{scene}, frame {id}: μ per subarray and case, golden model");
    Ok(Picture { id: format!("{prefix}-{scene}"), caption, svg: bars(&plot)? })
}
