//! Waveforms of a block's ports.
//!
//! ```text
//! cycle          0   1   2   3  ⋯  24  25
//! valid        __/^^^^^^^^^^^^  ⋯  ^^^\___
//! word         ==X 1 X 2 X 3 X  ⋯  X==
//! ```

use anyhow::Result;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::super::style::{GRID, INK, SERIES};
use super::{label, note, sized, Area};
use dermis_cosim::block_timing::{Lane, Timing};

const WIDTH: u32 = 720;
/// Width of the names.
const NAMES: i32 = 138;
/// Height of a port, and of its two levels in it.
const ROW: i32 = 24;
const LEVELS: [i32; 2] = [19, 5];
/// Height of the cycles' line.
const TOP: i32 = 26;
/// Widest cycle.
const CYCLE: i32 = 40;
/// Width of a digit of small text.
const DIGIT: i32 = 8;

/// A run of cycles without a gap: index of its first, one behind its last.
type Run = (usize, usize);

/// Draws the ports in the cycles shown; inputs and outputs in different colours, numbers hexadecimal.
///
/// # Errors
/// A picture that cannot be written.
pub fn waveform(timing: &Timing) -> Result<String> {
    let height = TOP + ROW * timing.lanes.len() as i32 + 26;
    let runs = runs(&timing.cycles);
    let columns = (timing.cycles.len() + runs.len()).max(2) as i32 - 1;
    let cycle = ((WIDTH as i32 - NAMES - 8) / columns).min(CYCLE);
    // Each gap takes the room of a cycle.
    let left = |run: usize, index: usize| NAMES + cycle * (index + run) as i32;
    sized(WIDTH, height as u32, |area| {
        let bottom = TOP + ROW * timing.lanes.len() as i32;
        note(area, "cycle", (6, TOP / 2), HPos::Left, VPos::Center)?;
        for (run, &(begin, end)) in runs.iter().enumerate() {
            for index in begin..end {
                let x = left(run, index);
                area.draw(&PathElement::new(vec![(x, TOP), (x, bottom)], GRID.stroke_width(1)))?;
                let text = timing.cycles[index].to_string();
                let fits = text.len() as i32 * DIGIT <= cycle;
                // Numbers that do not fit stand at the begin of their run only.
                if fits || index == begin {
                    note(area, &text, (x + 2, TOP / 2), HPos::Left, VPos::Center)?;
                }
            }
            let x = left(run, end);
            area.draw(&PathElement::new(vec![(x, TOP), (x, bottom)], GRID.stroke_width(1)))?;
        }
        for (row, lane) in timing.lanes.iter().enumerate() {
            let top = TOP + ROW * row as i32;
            let colour = if lane.output { &SERIES[2] } else { &SERIES[1] };
            area.draw_text(&lane.name, &label(16, colour, HPos::Left, VPos::Center), (6, top + ROW / 2))?;
            for (run, &(begin, end)) in runs.iter().enumerate() {
                let x = |index: usize| left(run, index);
                match lane.bits {
                    1 => bit(area, lane, (begin, end), x, top, colour)?,
                    _ => word(area, lane, (begin, end), x, top, colour)?,
                }
                if run > 0 {
                    let x = left(run, begin) - cycle / 2;
                    note(area, "…", (x, top + ROW / 2), HPos::Center, VPos::Center)?;
                }
            }
        }
        let legend = [(SERIES[1], "input", NAMES), (SERIES[2], "output", NAMES + 60)];
        for (colour, text, x) in legend {
            area.draw_text(text, &label(16, &colour, HPos::Left, VPos::Center), (x, bottom + 14))?;
        }
        let text = "numbers hexadecimal; … leaves cycles out";
        note(area, text, (NAMES + 130, bottom + 14), HPos::Left, VPos::Center)
    })
}

/// Where the cycles follow one another.
fn runs(cycles: &[usize]) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for index in 0..cycles.len() {
        match runs.last_mut() {
            Some((_, end)) if cycles[index] == cycles[index - 1] + 1 => *end = index + 1,
            _ => runs.push((index, index + 1)),
        }
    }
    runs
}

/// A line that is high or low.
fn bit(area: &Area, lane: &Lane, run: Run, x: impl Fn(usize) -> i32, top: i32, colour: &RGBColor) -> Result<()> {
    let mut points = Vec::new();
    for index in run.0..run.1 {
        let y = top + LEVELS[lane.values[index].number() as usize & 1];
        points.extend([(x(index), y), (x(index + 1), y)]);
    }
    area.draw(&PathElement::new(points, colour.stroke_width(2)))?;
    Ok(())
}

/// A box for each value.
fn word(area: &Area, lane: &Lane, run: Run, x: impl Fn(usize) -> i32, top: i32, colour: &RGBColor) -> Result<()> {
    let mut begin = run.0;
    for end in run.0 + 1..=run.1 {
        if end < run.1 && lane.values[end] == lane.values[begin] {
            continue;
        }
        let (left, right) = (x(begin) + 1, x(end) - 1);
        let corners = [(left, top + LEVELS[1]), (right, top + LEVELS[0])];
        area.draw(&Rectangle::new(corners, colour.stroke_width(1)))?;
        let text = format!("{:?}", lane.values[begin]).trim_start_matches("0x").to_owned();
        if text.len() as i32 * DIGIT <= right - left {
            let middle = ((left + right) / 2, top + ROW / 2);
            area.draw_text(&text, &label(16, &INK, HPos::Center, VPos::Center), middle)?;
        }
        begin = end;
    }
    Ok(())
}
