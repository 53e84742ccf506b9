//! Error against run time of all engines in all cases, with the Pareto front and the 1 ms budget.

use anyhow::Result;

use super::super::document::{
    count, empty_cell, percent, seconds, seconds_text, text_cell, Cell, Item, Picture, Section, Table,
};
use super::super::measure::{Engine, Measured, Point};
use super::super::pictures::{scatter, Guide, Scatter, Series};
use super::super::style::SERIES;
use super::super::BUDGET_US;
use super::lookup::{case_text, scenes};

/// The section with error against run time.
///
/// # Errors
/// A picture that cannot be written.
pub fn time(measured: &[Measured]) -> Result<Section> {
    let mut items = Vec::new();
    for scene in scenes(measured) {
        items.push(Item::Pictures(pictures(scene, measured)?.to_vec()));
    }
    let head = [
        "sensor",
        "case",
        "engine",
        "shear error, median",
        "normal error, median",
        "time of a frame",
        "cycles",
        "RTL = bit-true",
        "why not",
    ];
    let rows = measured.iter().flat_map(|m| Engine::ALL.into_iter().map(move |engine| row(m, engine)));
    items.insert(
        0,
        Item::Text(
            "Each mark is an engine on a sensor in the case written next to it. Errors: resultant against the true \
             force, median over the shipped frames. Times: per frame; on the CPU the median over the frames and over \
             three repeats, for the hardware its cycles divided by its clock. Lower left is better; no mark is \
             better than the Pareto front in both error and time."
                .into(),
        ),
    );
    items.push(Item::Table(Table::new(
        "time",
        "All engines in all cases; why not: reason for a missing result",
        &head,
        rows.collect(),
    )));
    Ok(Section { id: "time", title: "Error against run time".into(), items })
}

/// Shear and normal error of a scene against the time of a frame.
///
/// # Errors
/// A picture that cannot be written.
pub fn pictures(scene: &str, measured: &[Measured]) -> Result<[Picture; 2]> {
    let own = measured.iter().filter(|m| m.scene.name == scene);
    let points: Vec<Point> = own.flat_map(|m| Engine::ALL.into_iter().filter_map(|engine| m.point(engine))).collect();
    Ok([
        picture(scene, "shear", &points, |point| point.tangential)?,
        picture(scene, "normal", &points, |point| point.normal)?,
    ])
}

fn row(m: &Measured, engine: Engine) -> Vec<Cell> {
    let mut row =
        vec![text_cell(m.scene.name.clone()), text_cell(case_text(m.scene.partition.case)), text_cell(engine.name())];
    let bit_true = m.bit_true.as_ref();
    let Some(point) = m.point(engine) else {
        let reason = match engine {
            Engine::Baseline => m.baseline.as_ref().err(),
            _ => bit_true.err(),
        };
        row.extend([
            empty_cell(),
            empty_cell(),
            empty_cell(),
            empty_cell(),
            empty_cell(),
            text_cell(reason.map_or("", |reason| reason)),
        ]);
        return row;
    };
    row.extend([percent(point.tangential), percent(point.normal), seconds(Some(point.seconds))]);
    row.extend(match bit_true {
        Ok(bit_true) if engine == Engine::Hardware => {
            let equality = match bit_true.equal {
                Some(true) => "yes",
                Some(false) => "NO",
                None => "not simulated",
            };
            [count(bit_true.cycles), text_cell(equality)]
        }
        _ => [empty_cell(), empty_cell()],
    });
    row.push(text_cell(""));
    row
}

fn picture(scene: &str, what: &str, own: &[Point], error: fn(&Point) -> Option<f64>) -> Result<Picture> {
    let of = |engine: Engine| {
        let points = own.iter().filter(|point| point.engine == engine);
        // A logarithmic axis has no zero.
        let points = points
            .filter_map(|point| Some((point.seconds, error(point).filter(|e| *e > 0.0)?, point.case.to_string())));
        let index = engine as usize;
        Series {
            name: engine.name().into(),
            colour: SERIES[index],
            shape: index,
            points: points.collect(),
            joined: false,
        }
    };
    let series: Vec<Series> = Engine::ALL.into_iter().map(of).filter(|series| !series.points.is_empty()).collect();
    let all = series.iter().flat_map(|series| &series.points).map(|(x, y, _)| (*x, *y)).collect();
    let budget = 1e-6 * BUDGET_US as f64;
    let plot = Scatter {
        x: "time of a frame".into(),
        y: format!("{what} error, median"),
        log: [true, true],
        ticks: [|s| tick(&seconds_text(s)), |e| format!("{} %", two_digits(100.0 * e))],
        series,
        guides: vec![Guide::X(budget, "1 ms".into()), Guide::Front(pareto_front(all), "Pareto front".into())],
    };
    let caption = format!("{scene}: {what} error against time per frame; marks are labelled with their case");
    Ok(Picture { id: format!("time-{scene}-{what}"), caption, svg: scatter(&plot)? })
}

/// Shortens a time: `1.00 ms` to `1 ms`.
fn tick(text: &str) -> String {
    match text.split_once(' ') {
        Some((number, unit)) if number.contains('.') => {
            format!("{} {unit}", number.trim_end_matches('0').trim_end_matches('.'))
        }
        _ => text.to_owned(),
    }
}

/// A value with two significant digits, without trailing zeros.
pub(super) fn two_digits(value: f64) -> String {
    let decimals = (1.0 - value.abs().max(1e-12).log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// The Pareto front: the points that no other point dominates, from left to right.
fn pareto_front(mut points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut front: Vec<(f64, f64)> = Vec::new();
    for point in points {
        if front.last().is_none_or(|last| point.1 < last.1) {
            front.push(point);
        }
    }
    front
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pareto_front_by_hand() {
        let points = vec![(3.0, 1.0), (1.0, 5.0), (2.0, 6.0), (2.5, 3.0), (4.0, 2.0), (1.0, 7.0)];
        assert_eq!(pareto_front(points), [(1.0, 5.0), (2.5, 3.0), (3.0, 1.0)]);
        assert_eq!(pareto_front(vec![]), []);
    }

    #[test]
    fn ticks_are_short() {
        assert_eq!(["1.00 ms", "30.0 µs", "300 s", "1.50 s"].map(tick), ["1 ms", "30 µs", "300 s", "1.5 s"]);
        assert_eq!([100.0, 30.0, 3.0, 0.5, 0.015].map(two_digits), ["100", "30", "3", "0.5", "0.015"]);
    }
}
