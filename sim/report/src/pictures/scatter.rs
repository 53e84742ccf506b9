//! Scatter plots: series of points on linear or logarithmic axes, with a legend and guide lines.

use anyhow::Result;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::super::style::{GRID, INK, LIMIT};
use super::{label, note, svg, Area, SMALL, WIDTH};

/// Height of the plot with its axes; the legend is below.
const HEIGHT: u32 = 300;
/// Edges of the plot.
const LEFT: i32 = 74;
const RIGHT: i32 = 386;
const TOP: i32 = 12;
const BOTTOM: i32 = 250;
/// Height of a line of the legend.
const LINE: i32 = 20;
/// Middle of the legend's marks from the left edge, distance of the second column's marks from them, distance of a name from
/// its mark, and half the width of a mark.
const MARGIN: i32 = 16;
const COLUMN: i32 = WIDTH as i32 / 2 - 6;
const NAME: i32 = 12;
const MARK: i32 = 8;
/// Length of a dash, and of the gap after it.
const DASH: i32 = 5;

/// A series of points.
#[derive(Clone, Debug)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Colour of its marks.
    pub colour: RGBColor,
    /// Shape of its marks: 0 disc, 1 square, 2 triangle, 3 diamond.
    pub shape: usize,
    /// Whether its marks are outlines.
    pub hollow: bool,
    /// Points as x, y and label; an empty label is not drawn.
    pub points: Vec<(f64, f64, String)>,
    /// Whether the points are joined by a line.
    pub joined: bool,
}

/// A guide line or ring.
#[derive(Clone, Debug)]
pub enum Guide {
    /// A vertical line at x, with its name.
    X(f64, String),
    /// A dashed horizontal line at y, with its name in the legend.
    Y(f64, String),
    /// A staircase through points from left to right, with its name in the legend.
    Front(Vec<(f64, f64)>, String),
    /// A ring around a point, with its name in the legend.
    Ring((f64, f64), String),
}

/// Content of a scatter plot.
#[derive(Clone, Debug)]
pub struct Scatter {
    /// Name and unit of the x axis.
    pub x: String,
    /// Name and unit of the y axis.
    pub y: String,
    /// Whether the x axis and the y axis are logarithmic.
    pub log: [bool; 2],
    /// Format the tick labels of x and y.
    pub ticks: [fn(f64) -> String; 2],
    /// Series of points.
    pub series: Vec<Series>,
    /// Guide lines and rings.
    pub guides: Vec<Guide>,
}

/// Conversion from values to pixels on one axis.
struct Axis {
    low: f64,
    high: f64,
    log: bool,
    from: i32,
    to: i32,
}

impl Axis {
    /// An axis that covers all values, with a margin.
    fn new(values: impl Iterator<Item = f64>, log: bool, from: i32, to: i32) -> Axis {
        let scale = |v: f64| if log { v.log10() } else { v };
        let values: Vec<f64> = values.map(scale).filter(|v| v.is_finite()).collect();
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (low, high) = if values.is_empty() { (0.0, 1.0) } else { (low, high) };
        let room = if high > low { 0.06 * (high - low) } else { 0.5 * low.abs().max(if log { 1.0 } else { 1e-9 }) };
        let low = if !log && low >= 0.0 { (low - room).max(0.0) } else { low - room };
        Axis { low, high: high + room, log, from, to }
    }

    fn at(&self, value: f64) -> i32 {
        let value = if self.log { value.log10() } else { value };
        let share = ((value - self.low) / (self.high - self.low)).clamp(0.0, 1.0);
        self.from + (share * f64::from(self.to - self.from)).round() as i32
    }

    /// Three to seven round tick values.
    fn ticks(&self) -> Vec<f64> {
        if self.log {
            let decades = self.high - self.low;
            let factors: &[f64] = if decades < 0.8 {
                &[1.0, 1.5, 2.0, 3.0, 5.0, 7.0]
            } else if decades < 2.5 {
                &[1.0, 3.0]
            } else {
                &[1.0]
            };
            let every = (decades / 7.0).ceil().max(1.0) as i32;
            let exponents = (self.low.floor() as i32..=self.high.ceil() as i32).filter(|e| e.rem_euclid(every) == 0);
            let all = exponents.flat_map(|e| factors.iter().map(move |factor| factor * 10f64.powi(e)));
            let all: Vec<f64> = all.filter(|v| (self.low..=self.high).contains(&v.log10())).collect();
            if all.len() > 1 {
                return all;
            }
            return linear(10f64.powf(self.low), 10f64.powf(self.high));
        }
        linear(self.low, self.high)
    }
}

/// Three to seven round values between `low` and `high`.
fn linear(low: f64, high: f64) -> Vec<f64> {
    let rough = (high - low) / 5.0;
    let decade = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|f| f * decade).find(|step| *step >= rough).unwrap_or(rough);
    let first = (low / step).ceil() as i64;
    (first..).map(|k| k as f64 * step).take_while(|v| *v <= high).collect()
}

/// Draws a scatter plot as SVG.
///
/// # Errors
/// A picture that cannot be written.
pub fn scatter(plot: &Scatter) -> Result<String> {
    let points = || plot.series.iter().flat_map(|series| &series.points);
    let at_x = plot.guides.iter().filter_map(|guide| if let Guide::X(x, _) = guide { Some(*x) } else { None });
    let x = Axis::new(points().map(|point| point.0).chain(at_x), plot.log[0], LEFT, RIGHT);
    let at_y = plot.guides.iter().filter_map(|guide| if let Guide::Y(y, _) = guide { Some(*y) } else { None });
    let y = Axis::new(points().map(|point| point.1).chain(at_y), plot.log[1], BOTTOM, TOP);
    let (entries, columns) = legend_size(plot);
    svg(HEIGHT + (LINE as u32) * entries.div_ceil(columns) as u32, |area| {
        axes(area, plot, &x, &y)?;
        for guide in &plot.guides {
            draw_guide(area, guide, &x, &y)?;
        }
        let mut names = Names::default();
        for guide in &plot.guides {
            let Guide::X(value, name) = guide else { continue };
            let (left, right) = beside(x.at(*value), name);
            names.taken.push([left, TOP, right, TOP + SMALL]);
        }
        for series in &plot.series {
            let at: Vec<(i32, i32)> = series.points.iter().map(|(px, py, _)| (x.at(*px), y.at(*py))).collect();
            if series.joined {
                line(area, at.clone(), &series.colour, 1)?;
            }
            at.iter().try_for_each(|at| mark(area, series, *at))?;
            names.taken.extend(at.iter().map(|(x, y)| [x - 5, y - 5, x + 5, y + 5]));
        }
        for series in &plot.series {
            for (px, py, name) in &series.points {
                names.draw(area, name, &series.colour, (x.at(*px), y.at(*py)))?;
            }
        }
        legend(area, plot)
    })
}

fn line(area: &Area, points: Vec<(i32, i32)>, colour: &RGBColor, width: u32) -> Result<()> {
    area.draw(&PathElement::new(points, colour.stroke_width(width)))?;
    Ok(())
}

/// Pixels and texts of an axis's ticks; of neighbouring ticks with the same text only the first.
fn named(axis: &Axis, text: fn(f64) -> String) -> Vec<(i32, String)> {
    let mut all: Vec<(i32, String)> = axis.ticks().into_iter().map(|tick| (axis.at(tick), text(tick))).collect();
    all.dedup_by(|a, b| a.1 == b.1);
    all
}

/// Largest width of a text in pixels: digits are 0.64 of the letters' 13 pixels wide in the widest of the usual fonts.
fn text_width(text: &str) -> i32 {
    8 * text.chars().count() as i32
}

fn axes(area: &Area, plot: &Scatter, x: &Axis, y: &Axis) -> Result<()> {
    for (at, text) in named(x, plot.ticks[0]) {
        line(area, vec![(at, TOP), (at, BOTTOM)], &GRID, 1)?;
        // Labels of ticks at the end of the axis are moved left, into the picture.
        let middle = at.min(WIDTH as i32 - text_width(&text) / 2);
        note(area, &text, (middle, BOTTOM + 5), HPos::Center, VPos::Top)?;
    }
    for (at, text) in named(y, plot.ticks[1]) {
        line(area, vec![(LEFT, at), (RIGHT, at)], &GRID, 1)?;
        note(area, &text, (LEFT - 5, at), HPos::Right, VPos::Center)?;
    }
    line(area, vec![(LEFT, TOP), (LEFT, BOTTOM), (RIGHT, BOTTOM)], &INK, 1)?;
    let middle = (LEFT + RIGHT) / 2;
    area.draw_text(&plot.x, &label(SMALL + 1, &INK, HPos::Center, VPos::Top), (middle, BOTTOM + 24))?;
    let upright = label(SMALL + 1, &INK, HPos::Center, VPos::Top).transform(FontTransform::Rotate270);
    area.draw_text(&plot.y, &upright, (2, (TOP + BOTTOM) / 2))?;
    Ok(())
}

/// A dashed horizontal line.
fn dashes(area: &Area, [left, right]: [i32; 2], y: i32) -> Result<()> {
    let starts = (left..right).step_by(2 * DASH as usize);
    starts.map(|x| vec![(x, y), ((x + DASH).min(right), y)]).try_for_each(|dash| line(area, dash, &LIMIT, 2))
}

/// Left and right end of the name of an upright guide, on the side of it that has room.
fn beside(at: i32, name: &str) -> (i32, i32) {
    let width = text_width(name);
    if at > (LEFT + RIGHT) / 2 {
        (at - 4 - width, at - 4)
    } else {
        (at + 4, at + 4 + width)
    }
}

fn draw_guide(area: &Area, guide: &Guide, x: &Axis, y: &Axis) -> Result<()> {
    match guide {
        Guide::X(value, name) => {
            let at = x.at(*value);
            line(area, vec![(at, TOP), (at, BOTTOM)], &LIMIT, 2)?;
            // On the side with more space.
            let (left, right) = beside(at, name);
            let (h, at) = if right < at { (HPos::Right, right) } else { (HPos::Left, left) };
            area.draw_text(name, &label(SMALL, &LIMIT, h, VPos::Top), (at, TOP))?;
        }
        Guide::Y(value, _) => dashes(area, [LEFT, RIGHT], y.at(*value))?,
        Guide::Ring((px, py), _) => {
            area.draw(&Circle::new((x.at(*px), y.at(*py)), 9, INK.stroke_width(2)))?;
        }
        Guide::Front(points, _) => {
            let mut steps: Vec<(i32, i32)> = Vec::new();
            for &(px, py) in points {
                let at = (x.at(px), y.at(py));
                steps.extend(steps.last().map(|last| (at.0, last.1)));
                steps.push(at);
            }
            steps.extend(steps.last().map(|last| (RIGHT, last.1)));
            line(area, steps, &INK, 2)?;
        }
    }
    Ok(())
}

/// Places labels beside marks; a label without free space is omitted.
#[derive(Default)]
struct Names {
    /// Left, top, right, bottom of the marks and labels drawn.
    taken: Vec<[i32; 4]>,
}

impl Names {
    fn draw(&mut self, area: &Area, name: &str, colour: &RGBColor, (x, y): (i32, i32)) -> Result<()> {
        let (width, height) = (text_width(name), 13);
        let corners = [(x + 6, y - 13), (x - 6 - width, y - 13), (x + 6, y + 1), (x - 6 - width, y + 1)];
        let free = |(left, top): &(i32, i32)| {
            let rectangle = [*left, *top, left + width, top + height];
            let apart = |other: &[i32; 4]| {
                rectangle[2] <= other[0]
                    || other[2] <= rectangle[0]
                    || rectangle[3] <= other[1]
                    || other[3] <= rectangle[1]
            };
            rectangle[0] > LEFT
                && rectangle[2] < RIGHT + 10
                && rectangle[1] > 0
                && rectangle[3] < BOTTOM
                && self.taken.iter().all(apart)
        };
        let Some((left, top)) = corners.into_iter().find(free).filter(|_| !name.is_empty()) else { return Ok(()) };
        self.taken.push([left, top, left + width, top + height]);
        area.draw_text(name, &label(SMALL - 1, colour, HPos::Left, VPos::Top), (left, top))?;
        Ok(())
    }
}

fn mark(area: &Area, series: &Series, (x, y): (i32, i32)) -> Result<()> {
    let fill = if series.hollow { series.colour.stroke_width(2) } else { series.colour.filled() };
    let polygon = |mut points: Vec<(i32, i32)>| -> Result<()> {
        if series.hollow {
            points.extend(points.first().copied());
            area.draw(&PathElement::new(points, fill))?;
        } else {
            area.draw(&Polygon::new(points, fill))?;
        }
        Ok(())
    };
    match series.shape {
        0 => area.draw(&Circle::new((x, y), 5, fill))?,
        1 => area.draw(&Rectangle::new([(x - 4, y - 4), (x + 4, y + 4)], fill))?,
        2 => polygon(vec![(x, y - 6), (x - 5, y + 4), (x + 5, y + 4)])?,
        3 => polygon(vec![(x, y - 6), (x - 6, y), (x, y + 6), (x + 6, y)])?,
        _ => polygon(vec![(x, y + 6), (x - 5, y - 4), (x + 5, y - 4)])?,
    }
    Ok(())
}

/// Guides with a name in the legend, each with its name.
fn named_guides(plot: &Scatter) -> impl Iterator<Item = (&Guide, &String)> {
    plot.guides.iter().filter_map(|guide| match guide {
        Guide::X(..) => None,
        Guide::Y(_, name) | Guide::Front(_, name) | Guide::Ring(_, name) => Some((guide, name)),
    })
}

/// Number of entries of the legend, and of its columns: one where a name is too long for two.
fn legend_size(plot: &Scatter) -> (usize, usize) {
    let names = || plot.series.iter().map(|series| &series.name).chain(named_guides(plot).map(|(_, name)| name));
    let widest = names().map(|name| text_width(name)).max().unwrap_or(0);
    (names().count(), if NAME + widest > COLUMN - MARK { 1 } else { 2 })
}

fn legend(area: &Area, plot: &Scatter) -> Result<()> {
    let (_, columns) = legend_size(plot);
    let place = |index: usize| {
        (MARGIN + (index % columns) as i32 * COLUMN, HEIGHT as i32 + LINE * (index / columns) as i32 + 4)
    };
    for (index, series) in plot.series.iter().enumerate() {
        let (x, y) = place(index);
        mark(area, series, (x, y))?;
        note(area, &series.name, (x + NAME, y), HPos::Left, VPos::Center)?;
    }
    for ((guide, name), index) in named_guides(plot).zip(plot.series.len()..) {
        let (x, y) = place(index);
        match guide {
            Guide::Ring(..) => area.draw(&Circle::new((x, y), 7, INK.stroke_width(2)))?,
            Guide::Y(..) => dashes(area, [x - MARK, x + MARK], y)?,
            _ => line(area, vec![(x - MARK, y), (x + MARK, y)], &INK, 2)?,
        }
        note(area, name, (x + NAME, y), HPos::Left, VPos::Center)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let linear = Axis::new([0.0, 93.0].into_iter(), false, 0, 100);
        assert_eq!(linear.ticks(), [0.0, 20.0, 40.0, 60.0, 80.0]);
        let log = Axis::new([1e-5, 3.0].into_iter(), true, 0, 100);
        let ticks: Vec<i32> = log.ticks().iter().map(|tick| tick.log10().round() as i32).collect();
        assert_eq!(ticks, [-5, -4, -3, -2, -1, 0]);
        assert_eq!((log.at(1e-9), log.at(1e9)), (0, 100));
        // A range below a factor of ten: round values in between, and no text twice.
        let near = Axis::new([0.0015, 0.0017].into_iter(), true, 0, 100);
        assert!(near.ticks().len() > 2);
        assert_eq!(named(&near, |tick| format!("{tick:.2}")).len(), 1);
    }

    #[test]
    fn a_tick_at_the_end_of_the_axis_keeps_its_text_inside() {
        let series = Series {
            name: "s".into(),
            colour: INK,
            shape: 0,
            hollow: false,
            points: vec![(0.0008, 1.0, String::new()), (0.08, 1.0, String::new())],
            joined: false,
        };
        let plot = Scatter {
            x: "t".into(),
            y: "e".into(),
            log: [true, false],
            ticks: [|v| format!("{:.0} ms", 1e3 * v), |v| v.to_string()],
            series: vec![series],
            guides: vec![],
        };
        let drawn = scatter(&plot).unwrap();
        let before = drawn.split("100 ms").next().unwrap().rsplit("<text x=\"").next().unwrap();
        let middle: i32 = before.split('"').next().unwrap().parse().unwrap();
        assert!(middle + text_width("100 ms") / 2 <= WIDTH as i32, "{middle}");
    }

    #[test]
    fn hollow_marks_are_outlines_and_a_horizontal_guide_is_in_sight() {
        let plot = |hollow: bool, guides: Vec<Guide>| Scatter {
            x: "t".into(),
            y: "e".into(),
            log: [true, true],
            ticks: [|v| v.to_string(); 2],
            series: (0..5)
                .map(|shape| Series {
                    name: "s".into(),
                    colour: LIMIT,
                    shape,
                    hollow,
                    points: vec![(1.0, 0.01, String::new()), (2.0, 0.02, String::new())],
                    joined: false,
                })
                .collect(),
            guides,
        };
        let filled = |drawn: &str| drawn.matches("fill=\"#050505\"").count();
        // Two marks and one in the legend, of each of five shapes.
        assert_eq!(filled(&scatter(&plot(false, vec![])).unwrap()), 15);
        assert_eq!(filled(&scatter(&plot(true, vec![])).unwrap()), 0);
        // The axis reaches the guide, which no point comes near.
        let drawn = scatter(&plot(false, vec![Guide::Y(1.0, "no shear".into())])).unwrap();
        let y = Axis::new([0.01, 0.02, 1.0].into_iter(), true, BOTTOM, TOP).at(1.0);
        let dash = format!("points=\"{LEFT},{y} {},{y} \"", LEFT + DASH);
        assert!(drawn.contains("no shear") && drawn.contains(&dash) && y > TOP, "{dash}: {drawn}");
    }

    #[test]
    fn a_long_name_has_a_line_of_the_legend_of_its_own() {
        let series = |name: &str| Series {
            name: name.into(),
            colour: INK,
            shape: 0,
            hollow: false,
            points: vec![(1.0, 1.0, String::new())],
            joined: false,
        };
        let plot = |names: [&str; 3]| Scatter {
            x: "t".into(),
            y: "e".into(),
            log: [false; 2],
            ticks: [|v| v.to_string(); 2],
            series: names.into_iter().map(series).collect(),
            guides: vec![],
        };
        let height = |lines: i32| format!("height=\"{}\"", HEIGHT as i32 + lines * LINE);
        assert!(scatter(&plot(["one", "two", "three"])).unwrap().contains(&height(2)));
        assert!(scatter(&plot(["one", "two", "hardware, modelled and not simulated"])).unwrap().contains(&height(3)));
    }

    #[test]
    fn nothing_to_show_is_an_empty_plot() {
        let plot = Scatter {
            x: "t".into(),
            y: "e".into(),
            log: [true, true],
            ticks: [|v| v.to_string(); 2],
            series: vec![],
            guides: vec![],
        };
        assert!(scatter(&plot).unwrap().contains("</svg>"));
    }
}
