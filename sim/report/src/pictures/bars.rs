//! Bar charts: groups of horizontal bars on a common axis.

use anyhow::Result;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::super::style::{GRID, INK, LIMIT};
use super::{label, note, svg, WIDTH};

/// Left edge of the bars where their names are to the left, and where they are above.
const LEFT: [i32; 2] = [132, 26];
const RIGHT: i32 = 344;
const TOP: i32 = 10;
/// Height of a bar, and space between groups.
const BAR: i32 = 14;
const GAP: i32 = 7;
/// Height of a name above its bars.
const NAME: i32 = 17;
/// Height of the labels of a logarithmic axis, and the most of them.
const TICKS: i32 = 18;
const MOST_TICKS: f64 = 4.0;

/// Content of a bar chart; bars start at zero.
#[derive(Clone, Debug)]
pub struct Bars {
    /// Name and unit of the axis.
    pub axis: String,
    /// Name of each group, and its values in the order of `series`; `None` draws no bar.
    pub groups: Vec<(String, Vec<Option<f64>>)>,
    /// Name and colour of each series.
    pub series: Vec<(String, RGBColor)>,
    /// Formats the text beside a bar.
    pub text: fn(f64) -> String,
    /// Value at which a line is drawn, for example a budget.
    pub limit: Option<f64>,
    /// Whether a group's name is above its bars, where there is room for a long one.
    pub names_above: bool,
    /// Whether the axis is logarithmic; it then starts at a tenth of the smallest value.
    pub log: bool,
}

/// Draws a bar chart as SVG.
///
/// # Errors
/// A picture that cannot be written.
pub fn bars(plot: &Bars) -> Result<String> {
    let values = || plot.groups.iter().flat_map(|(_, values)| values.iter().flatten().copied()).chain(plot.limit);
    let scale = |v: f64| if plot.log { v.log10() } else { v };
    let (low, high) = match plot.log {
        true => (
            values().map(scale).fold(f64::INFINITY, f64::min) - 1.0,
            values().map(scale).fold(f64::NEG_INFINITY, f64::max),
        ),
        false => (values().fold(0.0, f64::min), values().fold(0.0, f64::max)),
    };
    let span = if high > low { high - low } else { 1.0 };
    let left = LEFT[usize::from(plot.names_above)];
    let at = |v: f64| left + ((scale(v) - low) / span * f64::from(RIGHT - left)).round() as i32;
    let zero = if plot.log { left } else { at(0.0) };
    let name_height = if plot.names_above { NAME } else { 0 };
    let group = name_height + BAR * plot.series.len() as i32 + GAP;
    let bottom = TOP + group * plot.groups.len() as i32;
    // A logarithmic axis has a labelled line per decade, of many every second, third, …
    let exponents = plot.log.then(|| low.ceil() as i32..=high.floor() as i32).into_iter().flatten();
    let every = ((high - low) / MOST_TICKS).ceil().max(1.0) as i32;
    let ticks: Vec<f64> = exponents.filter(|e| e.rem_euclid(every) == 0).map(|e| 10f64.powi(e)).collect();
    let below = bottom + if ticks.is_empty() { 0 } else { TICKS };
    svg((below + 30 + 20 * plot.series.len().div_ceil(2) as i32) as u32, |area| {
        area.draw(&PathElement::new(vec![(zero, TOP - 4), (zero, bottom)], GRID.stroke_width(1)))?;
        for tick in &ticks {
            let x = at(*tick);
            area.draw(&PathElement::new(vec![(x, TOP - 4), (x, bottom)], GRID.stroke_width(1)))?;
            note(area, &(plot.text)(*tick), (x, bottom + 8), HPos::Center, VPos::Center)?;
        }
        for (index, (name, values)) in plot.groups.iter().enumerate() {
            let top = TOP + group * index as i32 + name_height;
            match plot.names_above {
                true => note(area, name, (left, top - NAME / 2), HPos::Left, VPos::Center)?,
                false => note(area, name, (left - 6, top + (group - GAP) / 2), HPos::Right, VPos::Center)?,
            }
            for (k, (value, (_, colour))) in values.iter().zip(&plot.series).enumerate() {
                let Some(value) = value else { continue };
                let (y, end) = (top + BAR * k as i32, at(*value));
                let corners = [(zero.min(end), y), (zero.max(end), y + BAR - 1)];
                area.draw(&Rectangle::new(corners, colour.filled()))?;
                let (h, x) =
                    if *value < 0.0 && !plot.log { (HPos::Left, zero + 4) } else { (HPos::Left, end.max(zero) + 4) };
                // Text that would cross the limit's line is moved to its right.
                let limit = plot.limit.map(at).filter(|limit| x <= *limit && *limit < x + 36);
                let x = limit.map_or(x, |limit| limit + 4);
                area.draw_text(&(plot.text)(*value), &label(14, &INK, h, VPos::Center), (x, y + BAR / 2))?;
            }
        }
        if let Some(limit) = plot.limit {
            let x = at(limit);
            area.draw(&PathElement::new(vec![(x, TOP - 4), (x, bottom)], LIMIT.stroke_width(2)))?;
        }
        let axis = if plot.log { format!("{}, logarithmic", plot.axis) } else { plot.axis.clone() };
        note(area, &axis, (WIDTH as i32 / 2, below + 10), HPos::Center, VPos::Center)?;
        for (index, (name, colour)) in plot.series.iter().enumerate() {
            let x = 16 + (index % 2) as i32 * (WIDTH as i32 / 2 - 6);
            let y = below + 32 + 20 * (index / 2) as i32;
            area.draw(&Rectangle::new([(x - 5, y - 5), (x + 5, y + 5)], colour.filled()))?;
            note(area, name, (x + 12, y), HPos::Left, VPos::Center)?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_logarithmic_axis_has_labelled_decades() {
        let plot = |log: bool| Bars {
            axis: "difference".into(),
            groups: vec![("a".into(), vec![Some(0.002)]), ("b".into(), vec![Some(0.5)])],
            series: vec![("max".into(), INK)],
            text: |value| format!("<{value}>"),
            limit: None,
            names_above: false,
            log,
        };
        let texts = |log: bool| {
            let drawn = bars(&plot(log)).unwrap();
            let texts = drawn.lines().filter(|line| line.starts_with("&lt;") || line.starts_with("difference"));
            texts.map(str::to_owned).collect::<Vec<_>>()
        };
        let ticks = ["&lt;0.001&gt;", "&lt;0.01&gt;", "&lt;0.1&gt;"].map(str::to_owned);
        let values = ["&lt;0.002&gt;", "&lt;0.5&gt;"].map(str::to_owned);
        assert_eq!(texts(true), [&ticks[..], &values, &["difference, logarithmic".to_owned()]].concat());
        assert_eq!(texts(false), [&values[..], &["difference".to_owned()]].concat());
    }
}
