//! Recommended partition and number format for each sensor, with errors and resources: derived from the measurements,
//! for frames with one contact and with several.
//!
//! Case: the fastest one whose median shear error is at most 1.1 e + 0.2 %, where e is the smallest error among the
//! cases whose hardware fits the board and takes at most 1 ms. Format: the one with the fewest block RAMs in that case
//! whose median shear error is at most 1.25 e + 0.5 %, where e is the smallest error of the candidates.

use anyhow::Result;
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Scene;
use dermis_hdl::generate;
use dermis_hdl::usage::{total, Usage};

use super::super::document::{
    count, decimal, empty_cell, percent, percent_text, seconds, text_cell, Cell, Item, Section, Table,
};
use super::super::measure::{
    clock, formats, BitTrue, Clock, ContactCount, FormatRow, Implementation, Measured, Options, Point,
};
use super::super::BUDGET_US;
use super::lookup::{case_text, scenes};
use crate::drawn_frames::{DrawnFrames, Shapes};
use dermis_flow::jobs::parallel;

/// Allowed error of a faster case: factor on the smallest error, plus an absolute error.
const NEAR_CASE: [f64; 2] = [1.1, 0.002];
/// Allowed error of a cheaper format: factor on the smallest error, plus an absolute error.
const NEAR_FORMAT: [f64; 2] = [1.25, 0.005];
/// Number of random frames on which formats are compared, in addition to the shipped ones: quick, full variant.
const DRAWN: [u32; 2] = [4, 32];

/// The recommendation for one scene and contact count.
#[derive(Clone, Debug)]
pub struct Choice {
    /// Index of the scene in the recommended case among the measurements.
    pub index: usize,
    /// Contact count of the frames that it applies to.
    pub contact_count: ContactCount,
    /// The recommended format.
    pub format: FormatRow,
    /// All formats tried.
    pub formats: Vec<FormatRow>,
    /// Resources of the design in the recommended format.
    pub usage: Usage,
    /// The clock.
    pub clock: Clock,
    /// Whether this design was co-simulated, with cycles equal to the model's.
    pub simulated: bool,
}

/// The recommended designs, with their hardware; a scene can have one for each contact count.
pub(super) fn designs<'a>(
    measured: &'a [Measured],
    choices: &'a [Choice],
) -> impl Iterator<Item = (&'a Measured, &'a BitTrue)> {
    choices.iter().filter_map(|choice| {
        let m = &measured[choice.index];
        Some((m, m.bit_true.as_ref().ok()?))
    })
}

/// Chooses case and format for every scene and contact count for which hardware fits.
///
/// # Errors
/// An interruption; a frame of another sensor.
pub fn choose(measured: &[Measured], options: &Options) -> Result<Vec<Choice>> {
    let contact_counts = |scene| [ContactCount::One, ContactCount::Several].map(|contact_count| (scene, contact_count));
    let best = scenes(measured).into_iter().flat_map(contact_counts);
    let best = best
        .filter_map(|(scene, contact_count)| Some((best_case(measured, scene, contact_count)?, contact_count)))
        .collect();
    parallel("formats", best, options.jobs, &options.interrupt, |(index, contact_count)| {
        choose_format(measured, index, contact_count, options)
    })
}

/// Index of the recommended case of a scene among the measurements.
fn best_case(measured: &[Measured], scene: &str, contact_count: ContactCount) -> Option<usize> {
    let own = measured.iter().enumerate().filter(|(_, m)| m.scene.name == scene);
    let point = |(index, m): (usize, &Measured)| {
        let point = m.point_over(Implementation::Hardware, |frame| ContactCount::of(frame) == contact_count)?;
        (point.seconds <= 1e-6 * BUDGET_US as f64).then_some((index, point.tangential?, point.seconds))
    };
    let all: Vec<(usize, f64, f64)> = own.filter_map(point).collect();
    let least = all.iter().map(|(_, error, _)| *error).fold(f64::INFINITY, f64::min);
    let near = all.into_iter().filter(|(_, error, _)| *error <= NEAR_CASE[0] * least + NEAR_CASE[1]);
    near.min_by(|a, b| a.2.total_cmp(&b.2)).map(|(index, _, _)| index)
}

fn choose_format(
    measured: &[Measured],
    index: usize,
    contact_count: ContactCount,
    options: &Options,
) -> Result<Choice> {
    let own = &measured[index];
    let formats = formats(&own.scene, &frames(&own.scene, contact_count, DRAWN[usize::from(!options.quick)])?)?;
    let format = cheapest(&formats).cloned();
    let format = format.ok_or_else(|| anyhow::anyhow!("scene {}: no format fits its board", own.scene.name))?;
    let model = Model::new(&with_format(&own.scene, format.bits))?;
    let usage = total(&generate(&model)?.usage);
    let simulated = model.scene == own.scene.clone().with_chosen_hardware()
        && own.bit_true.as_ref().is_ok_and(|i| i.equal == Some(true) && i.cycles == format.cycles);
    Ok(Choice { index, contact_count, clock: clock(&model.board, &model.scene), usage, formats, format, simulated })
}

/// The cheapest format within the allowed error.
fn cheapest(formats: &[FormatRow]) -> Option<&FormatRow> {
    let error = |row: &FormatRow| row.tangential.unwrap_or(f64::INFINITY);
    let least = formats.iter().map(error).fold(f64::INFINITY, f64::min);
    let near = formats.iter().filter(|row| error(row) <= NEAR_FORMAT[0] * least + NEAR_FORMAT[1]);
    // Of formats with equally many block RAMs the finer one, which is later in the list.
    near.rev().min_by_key(|row| row.block_rams)
}

/// The shipped frames with a contact count, and `drawn` random ones; no random ones on sensors whose pitch exceeds two
/// thicknesses, as their contacts would be no wider than a taxel.
///
/// # Errors
/// A stress that is not finite.
pub fn frames(scene: &Scene, contact_count: ContactCount, drawn: u32) -> Result<Vec<Frame>> {
    let mut frames = Frame::shipped(scene);
    frames.retain(|frame| ContactCount::of(frame) == contact_count);
    let sensor = &scene.sensor;
    if sensor.pitch_x_mm.max(sensor.pitch_y_mm) <= 2.0 * sensor.thickness_mm {
        let contacts = if contact_count == ContactCount::One { vec![1] } else { vec![2, 3] };
        let draw = DrawnFrames { frames: drawn, contacts, shapes: Shapes::Elliptic, touching: false, seed: 1 };
        frames.extend(draw.draw(scene)?);
    }
    Ok(frames)
}

fn with_format(scene: &Scene, bits: [u32; 4]) -> Scene {
    let mut scene = scene.clone();
    let fixed = &mut scene.fixed;
    [fixed.input_bits, fixed.inverse_bits, fixed.data_bits, fixed.coef_bits] = bits;
    scene
}

/// The section with recommendations, comparison of cases and formats tried.
pub fn choice(measured: &[Measured], choices: &[Choice]) -> Section {
    let head = [
        "sensor",
        "contacts",
        "take case",
        "shear error",
        "nine of ten below",
        "normal error",
        "frames",
        "array",
        "bits: input / Cz⁺ / data / A",
        "cycles",
        "µs",
        "block RAMs",
        "multipliers",
        "LUTs, est.",
        "cycles from",
    ];
    let mut rows: Vec<Vec<Cell>> = choices.iter().map(|choice| row(measured, choice)).collect();
    let chosen = |name: &&str| choices.iter().any(|choice| measured[choice.index].scene.name == *name);
    for name in scenes(measured).into_iter().filter(|name| !chosen(name)) {
        let mut row = vec![text_cell(name), empty_cell(), text_cell("no hardware fits")];
        row.resize(head.len(), empty_cell());
        rows.push(row);
    }
    let origin = choices.first().map_or("design clock", |choice| choice.clock.origin);
    let caption = format!(
        "Recommended case and format with errors, time and resources (in brackets: share of the board). Errors of the \
         resultant: median over shipped and random frames, nine of ten below: 90 % quantile of the shear error; time: cycles divided by the clock ({origin})"
    );
    let rule = "Case: among the cases whose hardware fits the board and takes at most 1 ms, e is the smallest median \
                shear error on the shipped frames; the fastest case with an error up to 1.1 e + 0.2 % is taken. \
                Format: the candidate with the fewest block RAMs and an error up to 1.25 times the best candidate's \
                + 0.5 %. In the scene file set [partition] case, and the bits in [fixed] input_bits, inverse_bits, \
                data_bits, coef_bits. Contacts with different shears cannot be separated by rectangular subarrays: \
                in software, [partition] case = \"contacts\" finds a μ for each contact; its error and time on a CPU \
                are listed below where measured.";
    let formats = choices
        .iter()
        .flat_map(|choice| choice.formats.iter().map(|row| format_row(choice.contact_count, row, &choice.format)));
    let format_head = [
        "sensor",
        "contacts",
        "case",
        "shear error, median",
        "nine of ten below",
        "normal error, median",
        "frames",
        "input bits",
        "Cz⁺ bits",
        "data bits",
        "A bits",
        "cycles",
        "block RAMs",
        "multipliers",
        "taken",
    ];
    let formats = Table::new(
        "formats",
        "Formats tried in the recommended case, bit-true model; nine of ten below: 90 % quantile",
        &format_head,
        formats.collect(),
    );
    Section {
        id: "choice",
        title: "Recommended partition and number format".into(),
        items: vec![
            Item::Table(Table::new("choice", caption, &head, rows)),
            Item::Text(rule.into()),
            Item::Table(compared(measured)),
            Item::Table(formats.collapsed()),
        ],
    }
}

fn row(measured: &[Measured], choice: &Choice) -> Vec<Cell> {
    let own = &measured[choice.index];
    let (sensor, format, usage) = (&own.scene.sensor, &choice.format, &choice.usage);
    let board = own.bit_true.as_ref().ok().map(|bit_true| &bit_true.model.board);
    let share = |n: usize, of: Option<u32>| {
        let share = of.map_or(String::new(), |of| format!(" ({:.0} %)", 100.0 * n as f64 / f64::from(of)));
        Cell { shown: format!("{n}{share}"), number: Some(n as f64) }
    };
    let seconds = choice.clock.seconds(format.cycles);
    let [input, inverse, data, coef] = format.bits;
    vec![
        text_cell(own.scene.name.clone()),
        text_cell(choice.contact_count.name()),
        text_cell(case_text(own.scene.partition.case)),
        percent(format.tangential),
        percent(format.ninety),
        percent(format.normal),
        count(format.frames as u64),
        text_cell(format!("{}×{}", sensor.rows, sensor.cols)),
        text_cell(format!("{input} / {inverse} / {data} / {coef}")),
        count(format.cycles),
        decimal(Some(1e6 * seconds), 2),
        share(usage.block_rams, board.map(|board| board.block_rams)),
        share(usage.multipliers, board.map(|board| board.multipliers)),
        share(usage.luts, board.map(|board| board.luts)),
        text_cell(if choice.simulated { "co-simulation" } else { "bit-true model" }),
    ]
}

/// Comparison of the cases of each sensor on the shipped frames, by contact count.
fn compared(measured: &[Measured]) -> Table {
    let cases = ["0", "1", "2", "3", "contacts"];
    let head = [
        "sensor",
        "contacts",
        "frames",
        "0: shear error",
        "time",
        "1: shear error",
        "time",
        "2: shear error",
        "time",
        "3: shear error",
        "time",
        "case contacts, CPU: shear error",
        "time",
    ];
    let mut rows = Vec::new();
    for scene in scenes(measured) {
        for contact_count in [ContactCount::One, ContactCount::Several] {
            let own = || measured.iter().filter(|m| m.scene.name == scene);
            let kept = |m: &Measured| m.frames.iter().filter(|frame| ContactCount::of(frame) == contact_count).count();
            let Some(frames) = own().map(kept).max().filter(|frames| *frames > 0) else { continue };
            let mut row = vec![text_cell(scene), text_cell(contact_count.name()), count(frames as u64)];
            for case in cases {
                let m = own().find(|m| m.scene.partition.case.to_string() == case);
                let engine = if case == "contacts" { Implementation::Golden } else { Implementation::Hardware };
                let point = m.and_then(|m| m.point_over(engine, |frame| ContactCount::of(frame) == contact_count));
                let missing = if m.is_some() { "does not fit" } else { "–" };
                row.extend(match point {
                    Some(point) => [with_ninety(&point), seconds(Some(point.seconds))],
                    None => [text_cell(missing), empty_cell()],
                });
            }
            rows.push(row);
        }
    }
    let caption =
        "Comparison of cases on the shipped frames: median shear error (in brackets: 90 % quantile) and time per frame of the hardware in cases 0 \
                   to 3, of the golden model in case contacts";
    Table::new("cases", caption, &head, rows)
}

/// The median of a point's shear error, with the 90 % quantile in brackets.
fn with_ninety(point: &Point) -> Cell {
    let median = percent(point.tangential);
    match point.ninety[0] {
        Some(ninety) => Cell { shown: format!("{} ({})", median.shown, percent_text(ninety)), ..median },
        None => median,
    }
}

fn format_row(contact_count: ContactCount, row: &FormatRow, taken: &FormatRow) -> Vec<Cell> {
    let [input, inverse, data, coef] = row.bits.map(|bits| count(u64::from(bits)));
    vec![
        text_cell(row.scene.clone()),
        text_cell(contact_count.name()),
        text_cell(row.case.clone()),
        percent(row.tangential),
        percent(row.ninety),
        percent(row.normal),
        count(row.frames as u64),
        input,
        inverse,
        data,
        coef,
        count(row.cycles),
        count(row.block_rams as u64),
        count(row.multipliers as u64),
        text_cell(if row.bits == taken.bits { "yes" } else { "" }),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cheapest_format_within_the_allowed_error() {
        let row = |input: u32, error: f64, block_rams: usize| FormatRow {
            scene: "s".into(),
            case: "0".into(),
            bits: [input, 24, 18, 18],
            tangential: Some(error),
            ninety: None,
            frames: 1,
            normal: None,
            cycles: 1,
            block_rams,
            multipliers: 1,
        };
        let taken = |rows: &[FormatRow]| cheapest(rows).map(|row| row.bits[0]);
        assert_eq!(taken(&[row(16, 0.05, 10), row(18, 0.016, 20), row(20, 0.01, 30)]), Some(18));
        assert_eq!(taken(&[row(16, 0.01, 30), row(20, 0.01, 30)]), Some(20));
        assert_eq!(taken(&[]), None);
    }
}
