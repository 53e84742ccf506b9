//! Pictures: SVG drawn by `plotters` in the colours of [`super::style`], all of a width that is legible on a phone.

mod bars;
mod field;
mod flow;
mod objective_map;
mod scatter;
mod waveform;

pub use bars::{bars, Bars};
pub use field::{force_field, stress_map, Outline};
pub use flow::{data_flow, FLOW_SCENE};
pub use objective_map::objective;
pub use scatter::{scatter, Guide, Scatter, Series};
pub use waveform::waveform;

use anyhow::Result;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::style::INK;

/// Drawing area of a picture.
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Width of every picture in SVG units, about the width of a phone in CSS pixels.
const WIDTH: u32 = 400;
/// Font size of small text as line height, as `plotters` defines it: letters of 13 units, 10 pixels on a phone.
const SMALL: i32 = 16;

/// Draws a picture of the common width and the given height.
fn svg(height: u32, draw: impl FnOnce(&Area) -> Result<()>) -> Result<String> {
    sized(WIDTH, height, draw)
}

/// A picture.
fn sized(width: u32, height: u32, draw: impl FnOnce(&Area) -> Result<()>) -> Result<String> {
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, (width, height)).into_drawing_area();
        draw(&area)?;
        area.present()?;
    }
    Ok(text)
}

/// Text style with size, colour and anchor.
fn label(size: i32, colour: &RGBColor, h: HPos, v: VPos) -> TextStyle<'static> {
    // The page's stylesheet or the SVG viewer chooses the font.
    ("sans-serif", size).into_font().color(colour).pos(Pos::new(h, v))
}

/// Draws small text anchored at a point.
fn note(area: &Area, text: &str, at: (i32, i32), h: HPos, v: VPos) -> Result<()> {
    area.draw_text(text, &label(SMALL, &INK, h, v), at)?;
    Ok(())
}
