//! Maps of the array: stress as colour, normal forces as colour, tangential forces as arrows, with the subarrays'
//! outlines; or an arrow per contact with the standard deviation of its force.

use anyhow::Result;
use dermis_golden::data::frame::Forces;
use dermis_golden::result::reconstruct::ContactEstimate;
use dermis_golden::result::reconstruct::SubarrayResult;
use dermis_golden::spec::sensor::Sensor;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::super::style::{GRID, INK, MINUS, PLUS, SERIES};
use super::{label, note, svg, Area, WIDTH};

/// Longest side of the map.
const SIDE: f64 = 290.0;
/// Upper left corner of the map.
const CORNER: (f64, f64) = (38.0, 24.0);
/// Share of the largest value below which a cell is left blank.
const BLANK: f64 = 0.004;
/// Largest number of arrows along a side; on larger arrays an arrow shows the sum over a group of taxels.
const ARROWS: usize = 24;
/// Share of the longest arrow below which no arrow is drawn.
const LEAST_ARROW: f64 = 0.02;
/// Length of the longest arrow of a contact.
const CONTACT_ARROW: f64 = 60.0;
/// Half the cap of an error bar.
const CAP: i32 = 3;
/// Radius of the mark of a centroid of compression, and half the side of that of tension: both show where they coincide.
const ROUND: i32 = 9;
const SQUARE: i32 = 5;
/// Number of shades in the colour bar.
const SHADES: i32 = 24;

/// Overlay of a map: outlines and centroids of the subarrays.
#[derive(Clone, Copy, Debug, Default)]
pub struct Outline<'a> {
    /// The subarrays.
    pub subarrays: &'a [SubarrayResult],
    /// Whether to draw the centroids of compression and tension.
    pub centroids: bool,
    /// Contacts whose forces are drawn as arrows, in place of those of the taxels.
    pub contacts: &'a [ContactEstimate],
}

/// Conversion from array positions to pixels; row 0 is on top.
struct Map {
    cell: (f64, f64),
    size: (f64, f64),
    /// Pixels per mm.
    scale: f64,
}

impl Map {
    fn new(sensor: &Sensor) -> Map {
        let mm = (sensor.cols as f64 * sensor.pitch_x_mm, sensor.rows as f64 * sensor.pitch_y_mm);
        let scale = SIDE / mm.0.max(mm.1);
        Map { cell: (sensor.pitch_x_mm * scale, sensor.pitch_y_mm * scale), size: (mm.0 * scale, mm.1 * scale), scale }
    }

    /// Pixel of a position given in taxels from the upper left corner.
    fn at(&self, row: f64, col: f64) -> (i32, i32) {
        ((CORNER.0 + col * self.cell.0).round() as i32, (CORNER.1 + row * self.cell.1).round() as i32)
    }

    /// Pixel of a position given in mm from the centre.
    fn of_mm(&self, [x, y]: [f64; 2]) -> (i32, i32) {
        let at = (CORNER.0 + self.size.0 / 2.0 + x * self.scale, CORNER.1 + self.size.1 / 2.0 + y * self.scale);
        (at.0.round() as i32, at.1.round() as i32)
    }

    fn height(&self) -> u32 {
        (CORNER.1 + self.size.1 + 46.0) as u32
    }
}

/// Map of stress in MPa: compression and tension as colours, with the centroids of both.
///
/// # Errors
/// A picture that cannot be written.
pub fn stress_map(sensor: &Sensor, stress_MPa: &[f64], outline: Outline) -> Result<String> {
    let map = Map::new(sensor);
    let peak = stress_MPa.iter().fold(0.0, |peak: f64, b| peak.max(b.abs()));
    svg(map.height(), |area| {
        cells(area, &map, sensor, stress_MPa, peak)?;
        frame(area, &map, sensor, outline)?;
        bar(area, &map, ["tension", "compression"], "kPa", &three_digits(1e3 * peak))
    })
}

/// Map of forces in N: normal forces as colour on a scale up to `peaks[0]`, tangential forces as arrows, the longest
/// for `peaks[1]`. With the same peaks several maps can be compared.
///
/// # Errors
/// A picture that cannot be written.
pub fn force_field(sensor: &Sensor, forces: &Forces, peaks: [f64; 2], outline: Outline) -> Result<String> {
    let map = Map::new(sensor);
    svg(map.height(), |area| {
        cells(area, &map, sensor, &forces.fz, peaks[0])?;
        frame(area, &map, sensor, outline)?;
        let legend = if outline.contacts.is_empty() {
            arrows(area, &map, sensor, forces, peaks[1])?;
            format!("longest arrow {} mN, tangential", three_digits(1e3 * peaks[1]))
        } else {
            contact_arrows(area, &map, outline.contacts)?
        };
        let (unit, factor) = if peaks[0] >= 1.0 { ("N", 1.0) } else { ("mN", 1e3) };
        bar(area, &map, ["pull", "press"], &format!("{unit}, normal"), &three_digits(factor * peaks[0]))?;
        note(area, &legend, (CORNER.0 as i32, 8), HPos::Left, VPos::Center)
    })
}

fn cells(area: &Area, map: &Map, sensor: &Sensor, values: &[f64], peak: f64) -> Result<()> {
    for (index, value) in values.iter().enumerate() {
        let share = if peak > 0.0 { value / peak } else { 0.0 };
        if share.abs() < BLANK {
            continue;
        }
        let (row, col) = ((index / sensor.cols) as f64, (index % sensor.cols) as f64);
        area.draw(&Rectangle::new([map.at(row, col), map.at(row + 1.0, col + 1.0)], shade(share).filled()))?;
    }
    Ok(())
}

/// The colour of a relative value −1 … 1.
fn shade(share: f64) -> RGBAColor {
    // The square root makes small values visible, in particular tension.
    let shade = share.abs().min(1.0).sqrt();
    // Two decimals keep the file small.
    if share > 0.0 { PLUS } else { MINUS }.mix((100.0 * shade).round() / 100.0)
}

fn frame(area: &Area, map: &Map, sensor: &Sensor, outline: Outline) -> Result<()> {
    let (rows, cols) = (sensor.rows as f64, sensor.cols as f64);
    area.draw(&Rectangle::new([map.at(0.0, 0.0), map.at(rows, cols)], GRID.stroke_width(1)))?;
    for part in outline.subarrays {
        let (row, col) = (part.row0 as f64, part.col0 as f64);
        let corners = [map.at(row, col), map.at(row + part.rows as f64, col + part.cols as f64)];
        area.draw(&Rectangle::new(corners, INK.stroke_width(1)))?;
        if outline.centroids {
            for (centroid, sign) in [(part.compression_centroid_mm, "+"), (part.tension_centroid_mm, "−")] {
                let Some(at) = centroid.map(|mm| map.of_mm(mm)) else { continue };
                if sign == "+" {
                    area.draw(&Circle::new(at, ROUND, SERIES[3].filled()))?;
                } else {
                    let corners = [(at.0 - SQUARE, at.1 - SQUARE), (at.0 + SQUARE, at.1 + SQUARE)];
                    area.draw(&Rectangle::new(corners, SERIES[2].filled()))?;
                }
                area.draw_text(sign, &label(16, &INK, HPos::Center, VPos::Center), at)?;
            }
        }
    }
    // Ticks in mm: edges and centre.
    let half = [cols * sensor.pitch_x_mm / 2.0, rows * sensor.pitch_y_mm / 2.0];
    let bottom = map.at(rows, 0.0).1;
    // At most three digits: the margin has no room for more.
    let place = |mm: f64| {
        let decimals = usize::from(mm.abs() < 10.0);
        format!("{}{}", if mm < 0.0 { "−" } else { "" }, format!("{:.decimals$}", mm.abs()).trim_end_matches(".0"))
    };
    for share in [-1.0, 0.0, 1.0] {
        let x = map.of_mm([share * half[0], 0.0]).0;
        note(area, &place(share * half[0]), (x, bottom + 4), HPos::Center, VPos::Top)?;
        let y = map.of_mm([0.0, share * half[1]]).1;
        note(area, &place(share * half[1]), (CORNER.0 as i32 - 4, y), HPos::Right, VPos::Center)?;
    }
    let middle = map.of_mm([0.0, 0.0]).0;
    note(area, "x, y in mm", (middle, bottom + 22), HPos::Center, VPos::Top)
}

fn arrows(area: &Area, map: &Map, sensor: &Sensor, forces: &Forces, longest_N: f64) -> Result<()> {
    let group = sensor.rows.max(sensor.cols).div_ceil(ARROWS);
    let length = 1.8 * group as f64 * map.cell.0.max(map.cell.1).min(18.0);
    for row in (0..sensor.rows).step_by(group) {
        for col in (0..sensor.cols).step_by(group) {
            let (rows, cols) = (row..(row + group).min(sensor.rows), col..(col + group).min(sensor.cols));
            let all = rows.clone().flat_map(|r| cols.clone().map(move |c| r * sensor.cols + c));
            let (x, y) = all.fold((0.0, 0.0), |(x, y), k| (x + forces.fx[k], y + forces.fy[k]));
            let share = x.hypot(y) / (longest_N * (group * group) as f64);
            // NaN where `longest_N` is zero.
            if share.is_nan() || share < LEAST_ARROW {
                continue;
            }
            let half = |a: usize, b: usize| (a + b) as f64 / 2.0;
            let from = map.at(half(rows.start, rows.end), half(cols.start, cols.end));
            let (ux, uy) = (x / x.hypot(y), y / x.hypot(y));
            arrow(area, from, (ux, uy), length * share)?;
        }
    }
    Ok(())
}

/// Draws the tangential force of each contact from its centre, with a bar of one standard deviation to either side of
/// the tip along x and y; returns the legend.
fn contact_arrows(area: &Area, map: &Map, contacts: &[ContactEstimate]) -> Result<String> {
    let shear = |contact: &ContactEstimate| contact.force_N[0].hypot(contact.force_N[1]);
    let longest_N = contacts.iter().map(shear).fold(0.0, f64::max);
    let pixels = |force_N: f64| if longest_N > 0.0 { CONTACT_ARROW * force_N / longest_N } else { 0.0 };
    for contact in contacts {
        let centre = map.of_mm(contact.centre_mm);
        let ([x, y, _], [sx, sy, _]) = (contact.force_N, contact.sigma_N);
        if shear(contact) > 0.0 {
            arrow(area, centre, (x / shear(contact), y / shear(contact)), pixels(shear(contact)))?;
        }
        let tip = (centre.0 + pixels(x).round() as i32, centre.1 + pixels(y).round() as i32);
        for (sigma_N, (ux, uy)) in [(sx, (1, 0)), (sy, (0, 1))] {
            // No bar is longer than the map.
            let reach = pixels(sigma_N).min(SIDE).round() as i32;
            let end = |along: i32, aside: i32| (tip.0 + along * ux + aside * uy, tip.1 + along * uy + aside * ux);
            for line in [[(-reach, 0), (reach, 0)], [(-reach, -CAP), (-reach, CAP)], [(reach, -CAP), (reach, CAP)]] {
                let line = line.map(|(along, aside)| end(along, aside)).to_vec();
                area.draw(&PathElement::new(line, SERIES[3].stroke_width(1)))?;
            }
        }
    }
    Ok(format!("longest arrow {} N; bars: ± one standard deviation", three_digits(longest_N)))
}

/// An arrow from a point along a unit vector.
fn arrow(area: &Area, (x, y): (i32, i32), (ux, uy): (f64, f64), length: f64) -> Result<()> {
    let at = |along: f64, aside: f64| {
        (x + (along * ux - aside * uy).round() as i32, y + (along * uy + aside * ux).round() as i32)
    };
    let head = (0.4 * length).min(5.0);
    area.draw(&PathElement::new(vec![at(0.0, 0.0), at(length, 0.0)], INK.stroke_width(1)))?;
    let tip = vec![at(length - head, head / 2.0), at(length, 0.0), at(length - head, -head / 2.0)];
    area.draw(&PathElement::new(tip, INK.stroke_width(1)))?;
    Ok(())
}

/// A value with three significant digits.
fn three_digits(value: f64) -> String {
    let decimals = (2.0 - value.abs().max(1e-9).log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.decimals$}")
}

/// Draws the colour bar to the right of the map.
fn bar(area: &Area, map: &Map, [minus, plus]: [&str; 2], unit: &str, peak: &str) -> Result<()> {
    let left = (CORNER.0 + map.size.0) as i32 + 12;
    let (top, bottom) = (CORNER.1 as i32 + 16, (CORNER.1 + map.size.1) as i32 - 16);
    for k in 0..SHADES {
        let y = |k: i32| top + (bottom - top) * k / SHADES;
        let share = 1.0 - (2 * k + 1) as f64 / f64::from(SHADES);
        area.draw(&Rectangle::new([(left, y(k)), (left + 10, y(k + 1))], shade(share).filled()))?;
    }
    let right = WIDTH as i32 - left - 14;
    // Labels are beside the bar if the array is narrow enough, else above and below it.
    let beside = right > 70;
    let x = left + 14;
    note(area, peak, (x, top), HPos::Left, VPos::Center)?;
    note(area, "0", (x, (top + bottom) / 2), HPos::Left, VPos::Center)?;
    note(area, &format!("−{peak}"), (x, bottom), HPos::Left, VPos::Center)?;
    if beside {
        note(area, unit, (x, top + 16), HPos::Left, VPos::Center)?;
        note(area, plus, (x, top + 32), HPos::Left, VPos::Center)?;
        note(area, minus, (x, bottom - 16), HPos::Left, VPos::Center)
    } else {
        let edge = WIDTH as i32 - 4;
        note(area, &format!("{plus}, {unit}"), (edge, 8), HPos::Right, VPos::Center)?;
        note(area, minus, (edge, bottom + 16), HPos::Right, VPos::Center)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dermis_golden::data::frame::Frame;
    use dermis_golden::estimate::float::Golden;
    use dermis_golden::spec::scene::Scene;

    #[test]
    fn centroids_of_compression_and_tension_differ_in_shape_and_colour() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let frame = &Frame::shipped(&scene)[0];
        let result = Golden::new(&scene).unwrap().run(frame).unwrap();
        let [part] = &result.subarrays[..] else { panic!("{:?}", result.subarrays) };
        assert!(part.compression_centroid_mm.is_some() && part.tension_centroid_mm.is_some());
        let outline = Outline { subarrays: &result.subarrays, centroids: true, contacts: &[] };
        let drawn = stress_map(&scene.sensor, &frame.stress_MPa, outline).unwrap();
        let marks = |shape: &str, RGBColor(r, g, b): RGBColor| {
            let fill = format!("fill=\"#{r:02X}{g:02X}{b:02X}\"");
            drawn.lines().filter(|line| line.starts_with(shape) && line.contains(&fill)).count()
        };
        assert_eq!((marks("<circle", SERIES[3]), marks("<rect", SERIES[2])), (1, 1), "{drawn}");
    }
}
