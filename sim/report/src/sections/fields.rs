//! Stress and forces of a frame: truth, golden and bit-true model, side by side on the same scale.

use anyhow::Result;
use dermis_golden::data::frame::Forces;
use dermis_golden::estimate::float::Golden;
use dermis_golden::spec::scene::EstimatorKind;

use super::super::document::{Item, Picture, Section};
use super::super::measure::Measured;
use super::super::pictures::{force_field, stress_map, Outline};
use super::choice::Choice;
use super::lookup::{case_text, illustrated_frame};

/// The section with maps of stress and forces.
///
/// # Errors
/// A picture that cannot be written.
pub fn fields(measured: &[Measured], choices: &[Choice]) -> Result<Section> {
    let mut items = vec![Item::Text(
        "Stress on the taxels with the centroids of compression (+) and tension (−) of each subarray, then forces \
         per taxel, normal as colour, tangential as arrows: truth, golden and bit-true model on the same scale, both \
         with the estimator that the hardware has. Where the golden model takes another one, its forces per contact \
         follow, with bars of one standard deviation. Row 0 is on top, x points to the right, y down. The colour scale is the square root of the value, to make \
         tension visible."
            .into(),
    )];
    for choice in choices {
        let m = &measured[choice.index];
        items.push(Item::Pictures(field_pictures(
            m,
            illustrated_frame(m, choice.contact_count),
            &format!("field-{}", choice.contact_count.name()),
        )?));
    }
    Ok(Section { id: "fields", title: "Stress and forces".into(), items })
}

/// The pictures of one frame: stress, true forces if known, golden model, bit-true model if supported, forces per contact
/// if the scene's estimator finds contacts.
pub(super) fn field_pictures(m: &Measured, index: usize, prefix: &str) -> Result<Vec<Picture>> {
    let (frame, golden) = (&m.frames[index], &m.golden[index]);
    let sensor = &m.scene.sensor;
    let fixed = m.bit_true.as_ref().ok().map(|bit_true| &bit_true.results[index].forces_N);
    let fields: Vec<(&str, &Forces)> = [
        frame.cell_forces_N.as_ref().map(|forces| ("truth", forces)),
        Some(("golden", &golden.forces_N)),
        fixed.map(|forces| ("bit-true", forces)),
    ]
    .into_iter()
    .flatten()
    .collect();
    // The scale is that of the true forces if known, so that a result with large errors does not shrink the others.
    let scale = fields[0].1;
    let peaks = [
        scale.fz.iter().fold(0.0, |peak: f64, f| peak.max(f.abs())),
        scale.fx.iter().zip(&scale.fy).fold(0.0, |peak: f64, (x, y)| peak.max(x.hypot(*y))),
    ];
    let what = format!("{}, case {}, frame {}", m.scene.name, case_text(m.scene.partition.case), frame.id);
    let id = |name: &str| format!("{prefix}-{}-case-{}-{name}", m.scene.name, m.scene.partition.case);
    let outline = Outline { subarrays: &golden.subarrays, centroids: true, contacts: &[] };
    let mut pictures = vec![Picture {
        id: id("stress"),
        caption: format!("{what}: stress, with the centroids of compression (round, +) and tension (square, −)"),
        svg: stress_map(sensor, &frame.stress_MPa, outline)?,
    }];
    let outline = Outline { centroids: false, ..outline };
    for (name, forces) in fields {
        pictures.push(Picture {
            id: id(name),
            caption: format!("{what}: forces, {name}"),
            svg: force_field(sensor, forces, peaks, outline)?,
        });
    }
    if m.scene.model_estimator() != EstimatorKind::Search {
        let golden = Golden::new(&m.scene)?;
        let result = golden.run(frame)?;
        let contacts = result.extra.contacts.as_deref().unwrap_or_default();
        let outline = Outline { subarrays: &result.subarrays, contacts, ..outline };
        let name = golden.estimator().name();
        pictures.push(Picture {
            id: id(name),
            caption: format!("{what}: force of each contact, {name}"),
            svg: force_field(sensor, &result.forces_N, peaks, outline)?,
        });
    }
    Ok(pictures)
}
