//! Data flow of the hardware: its stages with the words between them, from a model's formats.
//!
//! ```text
//! frame ─> receive ─> normalise ─> fold ─┐
//! ┌──────────────────────────────────────┘
//! └─> pass ─> rescale ─> unfold ─> search ─┐
//!      ^─────────┘  v_ij                   │
//! ┌────────────────────────────────────────┘
//! └─> force ─> send ─> forces
//! ```

use anyhow::Result;
use dermis_golden::fixed::stages::search::COARSE_CENTRES;
use dermis_golden::fixed::words::formats::{FORCE_BITS, HALVINGS};
use dermis_golden::fixed::{Cycles, Model};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::super::style::{INK, SERIES};
use super::{label, note, sized, Area};

/// The scene whose picture is in the README.
pub const FLOW_SCENE: &str = "sensor-1";
/// Wide enough for four stages with letters of 13 pixels; a page shows it at its own size.
const WIDTH: u32 = 720;
const HEIGHT: u32 = 462;
/// A stage's box and the room between two.
const BOX: (i32, i32) = (138, 78);
const GAP: (i32, i32) = (49, 56);
/// Upper left corner of the first box.
const CORNER: (i32, i32) = (10, 12);
/// Of stages that work on one subarray at a time, and of the others.
const OF_SUBARRAY: RGBColor = SERIES[1];
const OF_FRAME: RGBColor = SERIES[0];

/// A stage with what it does, in two or three lines.
struct Stage {
    name: &'static str,
    lines: Vec<String>,
    colour: RGBColor,
}

/// Where a box is: row and column.
type Place = (i32, i32);

/// Draws the stages of a model that searches.
///
/// # Errors
/// A picture that cannot be written.
pub fn data_flow(model: &Model) -> Result<String> {
    sized(WIDTH, HEIGHT, |area| {
        for (place, stage) in stages(model) {
            draw(area, place, &stage)?;
        }
        let formats = model.formats();
        let bits = |bits: u32| format!("{bits} bits");
        for (row, col, words) in [
            (0, 0, bits(formats.code_bits)),
            (0, 1, bits(formats.input_bits)),
            (0, 2, bits(formats.input_bits)),
            (1, 0, bits(formats.lane_bits)),
            (1, 1, bits(formats.vector_bits)),
            (1, 2, bits(formats.search_bits[0])),
            (2, 0, format!("3 × {FORCE_BITS}")),
            (2, 1, format!("{} bits", 3 * FORCE_BITS)),
        ] {
            let (left, top) = corner((row, col));
            let y = top + BOX.1 / 2;
            arrow(area, &[(left + BOX.0 + 2, y), (left + BOX.0 + GAP.0 - 2, y)], &INK)?;
            note(area, &words, (left + BOX.0 + GAP.0 / 2, y - 10), HPos::Center, VPos::Center)?;
        }
        carry(area, 0, &format!("four parities of {} bits", formats.fold_bits))?;
        carry(area, 1, &format!("p(μ*) of {} bits, μ of 18 bits", formats.search_bits[0]))?;
        // Vectors of one degree are operands of the next.
        let ((pass, bottom), (rescale, _)) = (corner((1, 0)), corner((1, 1)));
        let (from, to, y) = (rescale + BOX.0 / 2, pass + BOX.0 / 2, bottom + BOX.1);
        arrow(area, &[(from, y + 2), (from, y + 20), (to, y + 20), (to, y + 2)], &OF_SUBARRAY)?;
        let text = format!("v_ij of {} bits", formats.data_bits);
        area.draw_text(&text, &label(16, &OF_SUBARRAY, HPos::Center, VPos::Center), ((from + to) / 2, y + 10))?;
        legend(area, model)
    })
}

/// The stages in order.
fn stages(model: &Model) -> Vec<(Place, Stage)> {
    let (formats, sensor) = (model.formats(), &model.scene.sensor);
    let (taxels, quads) = (sensor.taxels(), formats.quads);
    let sweeps = format!("{} coarse sweeps,", COARSE_CENTRES.len());
    let stage = |name, colour, lines: &[String]| Stage { name, lines: lines.to_vec(), colour };
    let frame = |name, lines: &[String]| stage(name, OF_FRAME, lines);
    let subarray = |name, lines: &[String]| stage(name, OF_SUBARRAY, lines);
    let text = str::to_owned;
    vec![
        ((0, 0), frame("frame", &[format!("{} × {} taxels", sensor.rows, sensor.cols), text("normal stress b")])),
        ((0, 1), frame("receive", &[text("frame buffer,"), format!("{taxels} words"), text("both signs?")])),
        ((0, 2), subarray("normalise", &[text("shift to full word,"), text("exponent s")])),
        ((0, 3), subarray("fold", &[text("sums of mirror"), format!("images, {quads} quads")])),
        (
            (1, 0),
            subarray(
                "pass",
                &[
                    format!("{} MAC lanes", 4 * formats.lanes_per_parity),
                    format!("Cz⁺: {} bits", formats.inverse_bits),
                    format!("Ax, Ay: {} bits", formats.coef_bits),
                ],
            ),
        ),
        ((1, 1), subarray("rescale", &[text("round, saturate,"), text("exponent r")])),
        ((1, 2), subarray("unfold", &[text("parities back"), text("to taxels")])),
        (
            (1, 3),
            subarray("search", &[format!("p(μ) of degree {}", formats.degree), sweeps, format!("{HALVINGS} halvings")]),
        ),
        ((2, 0), frame("forces", &[text("fx = μ1 p, fy = μ2 p"), text("fz = p, threshold")])),
        (
            (2, 1),
            frame(
                "send",
                &[format!("{} force beats,", model.force_beats()), format!("{} status beats", model.status_beats())],
            ),
        ),
        ((2, 2), frame("output", &[text("fx fy fz per taxel,"), text("flags per subarray")])),
    ]
}

fn corner((row, col): Place) -> (i32, i32) {
    (CORNER.0 + col * (BOX.0 + GAP.0), CORNER.1 + row * (BOX.1 + GAP.1))
}

fn draw(area: &Area, place: Place, stage: &Stage) -> Result<()> {
    let (left, top) = corner(place);
    area.draw(&Rectangle::new([(left, top), (left + BOX.0, top + BOX.1)], stage.colour.stroke_width(2)))?;
    let middle = left + BOX.0 / 2;
    area.draw_text(stage.name, &label(19, &INK, HPos::Center, VPos::Center), (middle, top + 14))?;
    for (line, y) in stage.lines.iter().zip((top + 33..).step_by(16)) {
        note(area, line, (middle, y), HPos::Center, VPos::Center)?;
    }
    Ok(())
}

/// From the last box of a row to the first one of the next, with the words' name.
fn carry(area: &Area, row: i32, words: &str) -> Result<()> {
    let (last, top) = corner((row, 3));
    let (from, to, y) = (last + BOX.0 / 2, CORNER.0 + BOX.0 / 2, top + BOX.1);
    let middle = y + GAP.1 - 14;
    arrow(area, &[(from, y + 2), (from, middle), (to, middle), (to, y + GAP.1 - 2)], &INK)?;
    note(area, words, ((from + to) / 2 + 60, middle - 9), HPos::Center, VPos::Center)
}

/// A line through points with a head at its end.
fn arrow(area: &Area, points: &[(i32, i32)], colour: &RGBColor) -> Result<()> {
    area.draw(&PathElement::new(points.to_vec(), colour.stroke_width(1)))?;
    if let [.., (x0, y0), (x, y)] = *points {
        let (dx, dy) = ((x - x0).signum(), (y - y0).signum());
        let side = |sign: i32| (x - 6 * dx + sign * 3 * dy, y - 6 * dy + sign * 3 * dx);
        area.draw(&Polygon::new(vec![(x, y), side(1), side(-1)], colour.filled()))?;
    }
    Ok(())
}

/// What the colours are, and how long it takes.
fn legend(area: &Area, model: &Model) -> Result<()> {
    let top = corner((3, 0)).1 - 12;
    let parts = model.parts().len();
    let subarrays = match parts {
        1 => "of the subarray, here the whole array (case 0)".to_owned(),
        more => format!("of one of {more} subarrays: while it is searched, the next one's products are made"),
    };
    for (colour, text, y) in
        [(OF_FRAME, "stage of the whole frame".to_owned(), top), (OF_SUBARRAY, format!("stage {subarrays}"), top + 20)]
    {
        area.draw(&Rectangle::new([(CORNER.0 + 1, y - 6), (CORNER.0 + 13, y + 6)], colour.stroke_width(2)))?;
        note(area, &text, (CORNER.0 + 22, y), HPos::Left, VPos::Center)?;
    }
    let Cycles { latency, total, .. } = Cycles::longest(model);
    let text = format!(
        "{}: {total} cycles from the first sample to the last beat, {latency} of them after the last sample",
        model.scene.name
    );
    note(area, &text, (CORNER.0, top + 42), HPos::Left, VPos::Center)
}
