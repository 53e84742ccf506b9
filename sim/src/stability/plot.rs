//! Plot: condition against forward and normal error, one mark per scene and number format, both axes logarithmic.

use anyhow::{anyhow, Result};
use dermis_golden::stability::{Figures, Row};
use plotters::coord::combinators::IntoLogRange;
use plotters::prelude::*;

/// Size of the picture in pixels.
const SIZE: (u32, u32) = (900, 560);
/// Errors below are drawn on the lower edge.
const LEAST: f64 = 1e-16;

/// The picture as SVG text.
///
/// # Errors
/// No row has figures, or the picture cannot be drawn.
pub fn svg(rows: &[Row]) -> Result<String> {
    let conditions = rows.iter().filter_map(|row| Some(row.spectrum?.condition)).filter(|c| c.is_finite());
    let largest = conditions.fold(0.0, f64::max);
    if largest == 0.0 {
        return Err(anyhow!("--plot: no scene has a condition to draw"));
    }
    let mut text = String::new();
    draw(rows, largest, &mut text).map_err(|error| anyhow!("--plot: {error}"))?;
    Ok(text)
}

type Format = (&'static str, RGBColor, fn(&Row) -> Option<Figures>);

const FORMATS: [Format; 3] = [
    ("double", RGBColor(0, 90, 181), |row| row.double),
    ("single", RGBColor(220, 120, 0), |row| row.single),
    ("fixed", RGBColor(190, 20, 60), |row| row.fixed),
];

fn draw(rows: &[Row], largest: f64, text: &mut String) -> Result<(), Box<dyn std::error::Error>> {
    let root = SVGBackend::with_string(text, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .margin(16)
        .x_label_area_size(40)
        .y_label_area_size(70)
        .build_cartesian_2d((0.7..largest * 2.0).log_scale(), (LEAST..1e3).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("condition of Cz")
        .y_desc("error: circle forward, triangle normal")
        .x_label_formatter(&|value| format!("{value:.0e}"))
        .y_label_formatter(&|value| format!("{value:.0e}"))
        .draw()?;
    for (index, (name, colour, figures)) in FORMATS.into_iter().enumerate() {
        let at = |error: fn(&Figures) -> Option<f64>| {
            rows.iter().filter_map(move |row| {
                let error = error(&figures(row)?)?;
                Some((row.spectrum?.condition, error.clamp(LEAST, 1e3)))
            })
        };
        chart.draw_series(at(|figures| Some(figures.forward)).map(|place| Circle::new(place, 4, colour.filled())))?;
        chart.draw_series(at(|figures| figures.normal).map(|place| TriangleMarker::new(place, 5, colour)))?;
        let line = 24 + 18 * index as i32;
        root.draw(&Circle::new((110, line), 4, colour.filled()))?;
        root.draw(&Text::new(name, (122, line - 7), ("sans-serif", 15).into_font()))?;
    }
    root.present()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use dermis_golden::scene::Scene;
    use dermis_golden::stability::{measure, Setting};

    #[test]
    fn every_format_has_its_marks() {
        let rows = [measure(&Setting::new("s", Scene::builtin("eight-by-eight").unwrap())).unwrap()];
        let text = svg(&rows).unwrap();
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"));
        for (_, RGBColor(r, g, b), _) in FORMATS {
            // A forward mark and one in the legend.
            let marks = text.matches(&format!("#{r:02X}{g:02X}{b:02X}")).count();
            assert!(marks >= 3, "{marks}");
        }
        assert!(svg(&[]).is_err());
    }
}
