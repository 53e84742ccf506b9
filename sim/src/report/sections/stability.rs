//! Where it holds: condition against error, and extreme frames.

use anyhow::{anyhow, Result};
use dermis_golden::scene::InverseKind;
use dermis_golden::stability::{extreme, FormatErrors, Row};

use super::super::document::{Item, Picture, Section};
use super::super::extremes::extremes_table;
use super::super::pictures::{scatter, Scatter, Series};
use super::super::stability::{refusals, stability_table};
use super::super::style::{standalone, SERIES};

const CAPTION: &str = "Forward error and normal error of the resultant against the condition of Cz";
const LEGEND: &str = "A mark for each scene and number format, double, single and fixed point.";
/// Errors below and above stand on the plot's edges.
const SHOWN: [f64; 2] = [1e-16, 1e3];

/// Condition against error, as table and picture.
///
/// # Errors
/// A picture that cannot be written.
pub fn stability(rows: &[Row]) -> Result<Section> {
    let text = "Known forces without noise, their stress in extended precision: what is lost is the inverse's and the \
                arithmetic's. By default singular values that input, noise and coefficients cannot tell are left out; \
                `exact` keeps them all. The lines called 50 digits take stress that was computed elsewhere with as \
                many.";
    let picture = Picture { id: "stability".into(), caption: CAPTION.into(), svg: picture(rows)? };
    let mut items = vec![Item::Text(text.into()), Item::Pictures(vec![picture]), Item::Table(stability_table(rows))];
    items.extend(refusals(rows).into_iter().map(|reason| Item::Text(format!("Refused: {reason}"))));
    Ok(Section { id: "stability", title: "Where it holds: condition against error".into(), items })
}

/// Frames at the ends of what a sensor can give, of scenes by name.
pub fn extremes(all: &[(String, Vec<extreme::Row>)]) -> Section {
    let text =
        "Each frame has a defined result in both models; the tests hold the hardware equal to the bit-true one on \
                them, to the bit and the cycle.";
    let mut items = vec![Item::Text(text.into())];
    items.extend(all.iter().map(|(scene, rows)| Item::Table(extremes_table(scene, rows))));
    Section { id: "extremes", title: "Extreme frames".into(), items }
}

type Format = (&'static str, fn(&Row) -> Option<FormatErrors>);
const FORMATS: [Format; 3] = [("f64", |row| row.double), ("f32", |row| row.single), ("fixed", |row| row.fixed)];
type Error = (&'static str, fn(&FormatErrors) -> Option<f64>);
const ERRORS: [Error; 2] = [("forward", |figures| Some(figures.forward)), ("e_n", |figures| figures.normal)];

/// The picture as a file of its own.
///
/// # Errors
/// No row has a condition, or the picture cannot be written.
pub fn stability_picture(rows: &[Row]) -> Result<String> {
    if rows.iter().all(|row| row.spectrum.is_none()) {
        return Err(anyhow!("--plot: no scene has a condition to draw"));
    }
    Ok(standalone(&picture(rows)?, CAPTION, LEGEND))
}

/// Condition against forward and normal error, one mark per scene and number format.
fn picture(rows: &[Row]) -> Result<String> {
    let exact = InverseKind::Exact.name();
    let series = FORMATS.into_iter().zip(1..).flat_map(|((format, figures), colour)| {
        ERRORS.into_iter().zip([0, 2]).map(move |((what, error), shape)| {
            let point = |row: &Row| {
                let error = error(&figures(row)?)?.clamp(SHOWN[0], SHOWN[1]);
                let name = if row.inverse == exact { exact } else { "" };
                Some((row.spectrum?.condition, error, name.to_owned())).filter(|point| point.0.is_finite())
            };
            let points = rows.iter().filter_map(point).collect();
            Series { name: format!("{what}, {format}"), colour: SERIES[colour], shape, points, joined: false }
        })
    });
    scatter(&Scatter {
        x: "condition of Cz".into(),
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
    use dermis_golden::scene::Scene;
    use dermis_golden::stability::{measure, Setting};

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
