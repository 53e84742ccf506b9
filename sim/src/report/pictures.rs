//! Pictures: SVG by `plotters`, in the colours of [`super::style`], all of one size that reads on a phone.

mod bars;
mod field;
mod objective_map;
mod scatter;

pub use bars::{bars, Bars};
pub use field::{force_field, stress_map, Outline};
pub use objective_map::objective;
pub use scatter::{scatter, Guide, Scatter, Series};

use anyhow::Result;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::style::INK;

/// Where pictures are drawn.
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Width of every picture in its own units, which are pixels of a phone held upright.
const WIDTH: u32 = 400;
/// Size of small print, which `plotters` takes for a line's height: letters of 13 units, 10 pixels on a phone.
const SMALL: i32 = 16;

/// A picture of the common width.
fn svg(height: u32, draw: impl FnOnce(&Area) -> Result<()>) -> Result<String> {
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, (WIDTH, height)).into_drawing_area();
        draw(&area)?;
        area.present()?;
    }
    Ok(text)
}

/// Text of a size in a colour, held at a point.
fn label(size: i32, colour: &RGBColor, h: HPos, v: VPos) -> TextStyle<'static> {
    // The stylesheet of the page, or the viewer of the file, has the last word on the family.
    ("sans-serif", size).into_font().color(colour).pos(Pos::new(h, v))
}

/// Small print about a point.
fn note(area: &Area, text: &str, at: (i32, i32), h: HPos, v: VPos) -> Result<()> {
    area.draw_text(text, &label(SMALL, &INK, h, v), at)?;
    Ok(())
}
