//! Numerical stability: error against condition number, and extreme frames.

use anyhow::{anyhow, Result};
use dermis_golden::spec::scene::InverseKind;
use dermis_study::stability::{extreme, FormatErrors, StabilityRow};

use super::super::document::{Item, Picture, Section};
use super::super::extremes::extremes_table;
use super::super::pictures::{scatter, Scatter, Series};
use super::super::stability::{refusals, stability_table};
use super::super::style::{standalone, SERIES};

const CAPTION: &str = "Forward error, and normal error of the resultant, against the condition number of Cz";
const LEGEND: &str = "One mark per scene and number format: double, single and fixed point.";
/// Range of errors in the plot; others are drawn at its edges.
const SHOWN: [f64; 2] = [1e-16, 1e3];

/// The section with error against condition number, as table and picture.
///
/// # Errors
/// A picture that cannot be written.
pub fn stability(rows: &[StabilityRow]) -> Result<Section> {
    let text =
        "The stress of known forces is computed in extended precision and without noise, so that all errors come from \
                 the inverse and the arithmetic. By default singular values below the resolution of input, noise and \
                 coefficients are truncated; `exact` keeps them all. The rows called 50 digits use stress computed \
                 separately with 50 decimal digits.";
    let picture = Picture { id: "stability".into(), caption: CAPTION.into(), svg: picture(rows)? };
    let mut items = vec![Item::Text(text.into()), Item::Pictures(vec![picture]), Item::Table(stability_table(rows))];
    items.extend(refusals(rows).into_iter().map(|reason| Item::Text(format!("Refused: {reason}"))));
    Ok(Section { id: "stability", title: "Numerical stability: error against condition number".into(), items })
}

/// The section with results on extreme frames, by scene name.
pub fn extremes(all: &[(String, Vec<extreme::ExtremeRow>)]) -> Section {
    let text =
        "Each of these frames has a defined result in both models; the tests check that the hardware equals the \
                bit-true model on them in every bit and cycle.";
    let mut items = vec![Item::Text(text.into())];
    items.extend(all.iter().map(|(scene, rows)| Item::Table(extremes_table(scene, rows))));
    Section { id: "extremes", title: "Extreme frames".into(), items }
}

type Format = (&'static str, fn(&StabilityRow) -> Option<FormatErrors>);
const FORMATS: [Format; 3] = [("f64", |row| row.double), ("f32", |row| row.single), ("fixed", |row| row.fixed)];
type Error = (&'static str, fn(&FormatErrors) -> Option<f64>);
const ERRORS: [Error; 2] = [("forward", |figures| Some(figures.forward)), ("e_n", |figures| figures.normal)];

/// The picture as an SVG file.
///
/// # Errors
/// No row has a condition number, or the picture cannot be written.
pub fn stability_picture(rows: &[StabilityRow]) -> Result<String> {
    if rows.iter().all(|row| row.spectrum.is_none()) {
        return Err(anyhow!("--plot: no scene has a condition number to plot"));
    }
    Ok(standalone(&picture(rows)?, CAPTION, LEGEND))
}

/// Forward and normal error against condition number, one mark per scene and number format.
fn picture(rows: &[StabilityRow]) -> Result<String> {
    let exact = InverseKind::Exact.name();
    let series = FORMATS.into_iter().zip(1..).flat_map(|((format, figures), colour)| {
        ERRORS.into_iter().zip([0, 2]).map(move |((what, error), shape)| {
            let point = |row: &StabilityRow| {
                let error = error(&figures(row)?)?.clamp(SHOWN[0], SHOWN[1]);
                let name = if row.inverse == exact { exact } else { "" };
                Some((row.spectrum?.condition, error, name.to_owned())).filter(|point| point.0.is_finite())
            };
            let points = rows.iter().filter_map(point).collect();
            Series {
                name: format!("{what}, {format}"),
                colour: SERIES[colour],
                shape,
                hollow: false,
                points,
                joined: false,
            }
        })
    });
    scatter(&Scatter {
        x: "condition number of Cz".into(),
        y: "error".into(),
        log: [true, true],
        ticks: [|condition| format!("{condition:.0e}"), |error| format!("{error:.0e}")],
        series: series.collect(),
        guides: vec![],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use dermis_golden::spec::scene::Scene;
    use dermis_study::stability::{measure, Setting};

    #[test]
    fn every_format_has_its_marks() {
        let rows = [measure(&Setting::new("s", Scene::builtin("eight-by-eight").unwrap())).unwrap()];
        let section = stability(&rows).unwrap();
        let Item::Pictures(pictures) = &section.items[1] else { panic!("{section:?}") };
        // A mark of each format for each error, and one more in the legend.
        let marks = |shape: &str, colour: usize| {
            let fill = format!("fill=\"#{:02X}{:02X}{:02X}\"", SERIES[colour].0, SERIES[colour].1, SERIES[colour].2);
            pictures[0].svg.lines().filter(|line| line.starts_with(shape) && line.contains(&fill)).count()
        };
        for colour in 1..=3 {
            assert_eq!((marks("<circle", colour), marks("<polygon", colour)), (2, 2), "{}", pictures[0].svg);
        }
        assert!(stability_picture(&rows).unwrap().trim_end().ends_with("</svg>"));
        assert!(stability_picture(&[]).is_err());
    }
}
