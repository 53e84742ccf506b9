//! The report's first page: error against noise beside error against run time, for the first scene; then scenes with a network.

use anyhow::Result;
use dermis_study::noise::statistic::ErrorSpread;
use dermis_study::noise::ShapeRow;

use super::super::document::{percent, text_cell, two_digits, Cell, Item, Picture, Section, Table};
use super::super::measure::{Measured, NoiseStudy};
use super::super::pictures::{scatter, Scatter, Series};
use super::super::style::SERIES;
use super::time::pictures as time_pictures;

/// The section.
///
/// # Errors
/// A picture that cannot be written.
pub fn noise(measured: &[Measured], studies: &[NoiseStudy]) -> Result<Option<Section>> {
    let (stated, others): (Vec<&NoiseStudy>, Vec<&NoiseStudy>) = studies.iter().partition(|study| study.noise_stated);
    let mut items = Vec::new();
    for study in &stated {
        let time = time_pictures(&study.scene, measured)?.into_iter().next();
        let time = time.map(|time| Picture { id: format!("first-{}", time.id), ..time });
        items.push(Item::Text(
            "Left: what noise costs, with the hardware's search and the estimators of the golden model. Right: what time buys, \
             without noise. Both for contacts whose forces are known."
                .into(),
        ));
        items.push(Item::Pictures(std::iter::once(picture(study)?).chain(time).collect()));
        items.push(Item::Table(table(study)));
    }
    if !others.is_empty() {
        let text = "Scenes with a network, which are one design whatever the noise: the golden model with what the scene names and \
                    with the hardware's estimator, and the hardware, which is equal to its bit-true model. With several contacts the \
                    error is over the sum of all tangential forces, and the bound, which is that of the resultant, is left out.";
        items.push(Item::Text(text.into()));
        items.push(Item::Pictures(others.iter().map(|study| picture(study)).collect::<Result<_>>()?));
        items.extend(others.iter().map(|study| Item::Table(table(study))));
    }
    let title = "Error against noise, and against run time".into();
    Ok((!items.is_empty()).then_some(Section { id: "noise", title, items }))
}

fn table(study: &NoiseStudy) -> Table {
    let NoiseStudy { scene, noise_stated, rows } = study;
    let (draws, contacts) = rows.first().map_or((0, 0), |row| (row.summary.draws, row.contacts));
    let caption = format!(
        "Shear error of the resultant on {draws} drawn frames of {scene} with {contacts} {} each (Hertz, punch, ring, rectangle \
         and tilted pressures in equal shares), noise {} in the scene; bound: Cramér–Rao for a smooth pressure on a known \
         support; none: no shear, and Σ b·area for the normal force",
        if contacts == 1 { "contact" } else { "contacts" },
        if *noise_stated { "stated" } else { "not stated" },
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
    let id = if *noise_stated { "noise".to_owned() } else { format!("{scene}-noise") };
    Table::new(id, caption, &head, rows.iter().map(row).collect())
}

/// The shear error: of several contacts over the sum of their tangential forces.
fn shear(row: &ShapeRow) -> &ErrorSpread {
    row.summary.over_all.as_ref().unwrap_or(&row.summary.tangential)
}

/// The bound of that error; of several contacts there is none, because it is that of the resultant.
fn bound(row: &ShapeRow) -> Option<f64> {
    row.summary.over_all.is_none().then_some(row.bound.tangential[0])
}

fn row(row: &ShapeRow) -> Vec<Cell> {
    let spread = shear(row);
    vec![
        percent(Some(row.noise)),
        text_cell(row.estimator.clone()),
        percent(Some(spread.median.value)),
        percent(Some(spread.median.low)),
        percent(Some(spread.median.high)),
        percent(Some(spread.ninety.value)),
        percent(Some(row.summary.normal.median.value)),
        percent(Some(row.summary.flagged.value)),
        percent(bound(row)),
    ]
}

fn picture(NoiseStudy { scene, rows, .. }: &NoiseStudy) -> Result<Picture> {
    // A logarithmic axis has no zero.
    let noisy: Vec<&ShapeRow> = rows.iter().filter(|row| row.noise > 0.0).collect();
    let mut names: Vec<&str> = Vec::new();
    noisy.iter().for_each(|row| {
        if !names.contains(&row.estimator.as_str()) {
            names.push(&row.estimator);
        }
    });
    let own = |name: &str, error: fn(&ShapeRow) -> Option<f64>| -> Vec<_> {
        let of_name = noisy.iter().filter(|row| row.estimator == name);
        let points = of_name.filter_map(|row| Some((row.noise, error(row)?, String::new())));
        points.filter(|(_, error, _)| *error > 0.0).collect()
    };
    let series = |(index, name): (usize, &&str)| Series {
        name: if *name == "none" { "none: no shear".into() } else { (*name).to_owned() },
        colour: SERIES[index % SERIES.len()],
        shape: index % 4,
        hollow: false,
        points: own(name, |row| Some(shear(row).median.value)),
        joined: true,
    };
    let mut all: Vec<Series> = names.iter().enumerate().map(series).collect();
    if let Some(first) = names.first().filter(|first| !own(first, bound).is_empty()) {
        let index = names.len();
        all.push(Series {
            name: "Cramér–Rao bound".into(),
            colour: SERIES[index % SERIES.len()],
            shape: index % 4,
            hollow: false,
            points: own(first, bound),
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
