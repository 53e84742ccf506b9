//! Error against run time of all engines in all cases, with the Pareto front and the 1 ms budget.

use anyhow::Result;
use dermis_golden::data::frame::Frame;

use super::super::document::{
    count, empty_cell, percent, seconds, seconds_text, text_cell, two_digits, Cell, Item, Picture, Section, Table,
};
use super::super::measure::{ContactCount, Implementation, Measured, Point};
use super::super::pictures::{scatter, Guide, Scatter, Series};
use super::super::style::SERIES;
use super::super::BUDGET_US;
use super::lookup::{case_text, scenes};

/// Name of the hollow marks in the legend, and what the caption says of them.
const MODELLED: [&str; 2] = ["hardware, modelled", "; hollow marks: not co-simulated"];

/// The section with error against run time.
///
/// # Errors
/// A picture that cannot be written.
pub fn time(measured: &[Measured]) -> Result<Section> {
    let mut items = Vec::new();
    for scene in scenes(measured) {
        // Shear and normal error of a contact count side by side.
        items.extend(pictures(scene, measured)?.chunks(2).map(|pair| Item::Pictures(pair.to_vec())));
    }
    let head = [
        "sensor",
        "case",
        "contacts",
        "engine",
        "shear error, median",
        "nine of ten below",
        "normal error, median",
        "nine of ten below",
        "frames",
        "time of a frame",
        "cycles",
        "RTL = bit-true",
        "why not",
    ];
    let rows = measured.iter().flat_map(|m| {
        let counts = ContactCount::all_of(&m.frames);
        let engines = Implementation::ALL.into_iter().filter(|engine| engine.is_of(m.scene.partition.case));
        counts.into_iter().flat_map(move |contacts| engines.clone().map(move |engine| row(m, engine, contacts)))
    });
    items.insert(
        0,
        Item::Text(
            "Each mark is an engine on a sensor in the case written next to it. Errors: resultant against the true \
             force, median over the shipped frames. Times: per frame; on the CPU the median over the frames and over \
             three repeats, for the hardware its cycles divided by its clock. Lower left is better; no mark is \
             better than the Pareto front in both error and time. Hollow marks: hardware that was not co-simulated in \
             this run; its errors and cycles are the bit-true model's. Dashed lines need no estimator: no shear at \
             all, and Σ b·area, the sum of the stress times the area of a taxel, for the normal force. Frames with one \
             contact and with several stand in pictures and rows of their own. A frame without true shear has a normal error only."
                .into(),
        ),
    );
    items.push(Item::Table(Table::new(
        "time",
        "All engines in all cases; nine of ten below: 90 % quantile of the error before it; why not: reason for a \
         missing result",
        &head,
        rows.collect(),
    )));
    Ok(Section { id: "time", title: "Error against run time".into(), items })
}

/// Shear and normal error of a scene against the time of a frame, for frames with one contact and for those with several.
///
/// # Errors
/// A picture that cannot be written.
pub fn pictures(scene: &str, measured: &[Measured]) -> Result<Vec<Picture>> {
    let own: Vec<&Measured> = measured.iter().filter(|m| m.scene.name == scene).collect();
    let mut pictures = Vec::new();
    for contacts in own.first().map(|m| ContactCount::all_of(&m.frames)).unwrap_or_default() {
        let keep = |frame: &Frame| ContactCount::of(frame) == contacts;
        let all = own
            .iter()
            .flat_map(|m| Implementation::ALL.into_iter().filter_map(move |engine| m.point_over(engine, keep)));
        let points: Vec<Point> = all.collect();
        let sum = own.iter().find_map(|m| m.error_of_sum(contacts));
        let shear = ("shear", "no shear", Some(1.0));
        pictures.push(picture(scene, contacts, shear, &points, |point| point.tangential)?);
        pictures.push(picture(scene, contacts, ("normal", "Σ b·area", sum), &points, |point| point.normal)?);
    }
    Ok(pictures)
}

fn row(m: &Measured, engine: Implementation, contacts: ContactCount) -> Vec<Cell> {
    let mut row = vec![
        text_cell(m.scene.name.clone()),
        text_cell(case_text(m.scene.partition.case)),
        text_cell(contacts.name()),
        text_cell(engine.name(&m.scene)),
    ];
    let bit_true = m.bit_true.as_ref();
    let Some(point) = m.point_over(engine, |frame| ContactCount::of(frame) == contacts) else {
        let reason = match engine {
            Implementation::Baseline => m.baseline.as_ref().err(),
            Implementation::Evidence => m.evidence.as_ref().err(),
            _ => bit_true.err(),
        };
        row.extend(std::iter::repeat_with(empty_cell).take(8));
        row.push(text_cell(reason.map_or("", |reason| reason)));
        return row;
    };
    let [shear, normal] = point.ninety.map(percent);
    row.extend([percent(point.tangential), shear, percent(point.normal), normal]);
    row.extend([count(point.frames as u64), seconds(Some(point.seconds))]);
    row.extend(match bit_true {
        Ok(bit_true) if engine == Implementation::Hardware => {
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

/// Error against time; `baseline` is the error that needs no estimator, with the names of error and baseline.
fn picture(
    scene: &str,
    contacts: ContactCount,
    (what, baseline, at): (&str, &str, Option<f64>),
    own: &[Point],
    error: fn(&Point) -> Option<f64>,
) -> Result<Picture> {
    let of = |(engine, hollow): (Implementation, bool)| {
        let points = own.iter().filter(|point| point.engine == engine && point.only_modelled == hollow);
        // A logarithmic axis has no zero.
        let points = points
            .filter_map(|point| Some((point.seconds, error(point).filter(|e| *e > 0.0)?, point.case.to_string())));
        let index = engine as usize;
        Series {
            name: match own.iter().find(|point| point.engine == engine) {
                Some(point) if !hollow => point.name.clone(),
                _ => MODELLED[0].into(),
            },
            colour: SERIES[index],
            shape: index,
            hollow,
            points: points.collect(),
            joined: false,
        }
    };
    let kinds = Implementation::ALL.map(|engine| (engine, false)).into_iter().chain([(Implementation::Hardware, true)]);
    let series: Vec<Series> = kinds.map(of).filter(|series| !series.points.is_empty()).collect();
    let all = series.iter().flat_map(|series| &series.points).map(|(x, y, _)| (*x, *y)).collect();
    let budget = 1e-6 * BUDGET_US as f64;
    let mut guides = vec![Guide::X(budget, "1 ms".into()), Guide::Front(pareto_front(all), "Pareto front".into())];
    guides.extend(at.filter(|error| *error > 0.0).map(|error| Guide::Y(error, baseline.into())));
    let plot = Scatter {
        x: "time of a frame".into(),
        y: format!("{what} error, median"),
        log: [true, true],
        ticks: [|s| tick(&seconds_text(s)), |e| format!("{} %", two_digits(100.0 * e))],
        series,
        guides,
    };
    let frames = own.iter().map(|point| point.frames).max().unwrap_or(0);
    let (id, frames) = match contacts {
        ContactCount::One => (format!("time-{scene}-{what}"), format!("{frames} frames with one contact")),
        ContactCount::Several => {
            (format!("time-{scene}-several-{what}"), format!("{frames} frames with several contacts"))
        }
    };
    let hollow = if own.iter().any(|point| point.only_modelled) { MODELLED[1] } else { "" };
    let caption = format!(
        "{scene}: {what} error, median of {frames}, against time per frame; marks are labelled with their case{hollow}"
    );
    Ok(Picture { id, caption, svg: scatter(&plot)? })
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
    }
}
