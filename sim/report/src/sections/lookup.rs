//! Finds scenes, cases and frames among the measurements.

use dermis_golden::data::frame::Frame;
use dermis_golden::spec::partition::Case;

use super::super::measure::{ContactCount, Measured};

/// Names of the scenes measured, each once, in order.
pub(super) fn scenes(measured: &[Measured]) -> Vec<&str> {
    let mut names: Vec<&str> = measured.iter().map(|m| m.scene.name.as_str()).collect();
    names.dedup();
    names
}

/// The measurements of a scene in a case, if it was measured.
pub(super) fn find<'a>(measured: &'a [Measured], scene: &str, case: Case) -> Option<&'a Measured> {
    measured.iter().find(|m| m.scene.name == scene && m.scene.partition.case == case)
}

/// A case with its grid: `1 (2×2)`.
pub(super) fn case_text(case: Case) -> String {
    case.grid().map_or(case.to_string(), |grid| format!("{case} ({}×{})", grid.rows, grid.cols))
}

/// Index of the frame shown in pictures for a contact count: the Hertzian contact if there is one, else the first
/// frame.
pub(super) fn illustrated_frame(measured: &Measured, contact_count: ContactCount) -> usize {
    let selected = |(_, frame): &(usize, &Frame)| ContactCount::of(frame) == contact_count;
    let frames = || measured.frames.iter().enumerate().filter(selected);
    let hertz = frames().find(|(_, frame)| frame.id.ends_with("hertz"));
    hertz.or(frames().next()).map_or(0, |(index, _)| index)
}
