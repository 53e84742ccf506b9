//! The report's first page: error against noise beside error against run time, for the first scene.

use anyhow::Result;
use dermis_golden::noise::ShapeRow;

use super::super::document::{percent, text_cell, two_digits, Cell, Item, Picture, Section, Table};
use super::super::measure::Measured;
use super::super::pictures::{scatter, Scatter, Series};
use super::super::style::SERIES;
use super::time::pictures as time_pictures;

/// The section; `noise` is the scene's name with its rows.
///
/// # Errors
/// A picture that cannot be written.
pub fn noise(measured: &[Measured], noise: Option<&(String, Vec<ShapeRow>)>) -> Result<Option<Section>> {
    let Some((scene, rows)) = noise else { return Ok(None) };
    let time = time_pictures(scene, measured)?.into_iter().next();
    let time = time.map(|time| Picture { id: format!("first-{}", time.id), ..time });
    let caption = format!(
        "Shear error of the resultant on {} drawn frames of {scene} (Hertz, punch, ring, rectangle and tilted pressures in \
         equal shares), noise stated in the scene; bound: Cramér–Rao for a smooth pressure on a known support; none: no \
         shear, and Σ b·area for the normal force",
        rows.first().map_or(0, |row| row.summary.draws)
    );
    let head = [
        "noise",
        "estimator",
        "shear error, median",
        "95 % interval from",
        "to",
        "nine of ten below",
        "normal error, median",
        "flagged",
        "bound, median",
    ];
    let table = Table::new("noise", caption, &head, rows.iter().map(row).collect());
    let text =
        "Left: what noise costs, with the hardware's search and the estimators of the golden model. Right: what time \
                buys, without noise. Both for contacts whose forces are known.";
    Ok(Some(Section {
        id: "noise",
        title: "Error against noise, and against run time".into(),
        items: vec![
            Item::Text(text.into()),
            Item::Pictures(std::iter::once(picture(scene, rows)?).chain(time).collect()),
            Item::Table(table),
        ],
    }))
}

fn row(row: &ShapeRow) -> Vec<Cell> {
    let spread = &row.summary.tangential;
    vec![
        percent(Some(row.noise)),
        text_cell(row.estimator.clone()),
        percent(Some(spread.median.value)),
        percent(Some(spread.median.low)),
        percent(Some(spread.median.high)),
        percent(Some(spread.ninety.value)),
        percent(Some(row.summary.normal.median.value)),
        percent(Some(row.summary.flagged.value)),
        percent(Some(row.bound.tangential[0])),
    ]
}

fn picture(scene: &str, rows: &[ShapeRow]) -> Result<Picture> {
    // A logarithmic axis has no zero.
    let noisy: Vec<&ShapeRow> = rows.iter().filter(|row| row.noise > 0.0).collect();
    let mut names: Vec<&str> = Vec::new();
    noisy.iter().for_each(|row| {
        if !names.contains(&row.estimator.as_str()) {
            names.push(&row.estimator);
        }
    });
    let own = |name: &str, error: fn(&ShapeRow) -> f64| {
        let points = noisy.iter().filter(|row| row.estimator == name).map(|row| (row.noise, error(row), String::new()));
        points.filter(|(_, error, _)| *error > 0.0).collect()
    };
    let series = |(index, name): (usize, &&str)| Series {
        name: if *name == "none" { "none: no shear".into() } else { (*name).to_owned() },
        colour: SERIES[index % SERIES.len()],
        shape: index % 4,
        hollow: false,
        points: own(name, |row| row.summary.tangential.median.value),
        joined: true,
    };
    let mut all: Vec<Series> = names.iter().enumerate().map(series).collect();
    if let Some(first) = names.first() {
        let index = names.len();
        all.push(Series {
            name: "Cramér–Rao bound".into(),
            colour: SERIES[index % SERIES.len()],
            shape: index % 4,
            hollow: false,
            points: own(first, |row| row.bound.tangential[0]),
            joined: true,
        });
    }
    let share = |value: f64| format!("{} %", two_digits(100.0 * value));
    let plot = Scatter {
        x: "noise over max |b|".into(),
        y: "shear error, median".into(),
        log: [true, true],
        ticks: [share, share],
        series: all,
        guides: vec![],
    };
    let caption = format!("{scene}: shear error against noise, contacts of any shape");
    Ok(Picture { id: format!("noise-{scene}"), caption, svg: scatter(&plot)? })
}
