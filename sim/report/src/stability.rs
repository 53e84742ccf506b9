//! Error against condition number, for `dermis stability` (Markdown, CSV, JSON) and for the report.

use anyhow::Result;
use dermis_golden::spec::scene::Medium;
use dermis_study::stability::{FormatErrors, Spectrum, StabilityRow};

use super::csv::quoted;
use super::data::markdown;
use super::document::{decimal, empty_cell, percent, text_cell, Cell, Table};
use super::Format;

/// Error against condition number, one row per scene: fractions in CSV and JSON, percent in Markdown.
///
/// # Errors
/// A number that JSON cannot represent.
pub fn stability(rows: &[StabilityRow], format: Format) -> Result<String> {
    Ok(match format {
        Format::Json => serde_json::to_string(rows)? + "\n",
        Format::Csv => csv(rows),
        Format::Markdown => text(rows),
    })
}

/// Explanation of the columns.
const LEGEND: &str = "rank: Σ λ f(λ); gain: ‖Cz⁺‖ in N/MPa; r: spectral radius at mu_max; forward: ‖Cz⁺b − p‖/‖p‖ \
                      without shear; residual: ‖b − C x‖/‖b‖; e_n, e_t: errors of the resultant with shear; bits: \
                      smallest input width for a forward error within 1 % of f64's; –: refused or not applicable";

fn text(rows: &[StabilityRow]) -> String {
    let mut text = format!("{}\n{LEGEND}\n", markdown(&stability_table(rows)));
    refusals(rows).iter().for_each(|reason| text.push_str(&format!("- {reason}\n")));
    text
}

/// The reasons of refusals, each once.
pub(super) fn refusals(rows: &[StabilityRow]) -> Vec<&String> {
    let mut reasons: Vec<&String> = Vec::new();
    for reason in rows.iter().flat_map(|row| row.refused.iter().chain(&row.fixed_refused)) {
        if !reasons.contains(&reason) {
            reasons.push(reason);
        }
    }
    reasons
}

/// Error against condition number, one row per scene.
pub(super) fn stability_table(rows: &[StabilityRow]) -> Table {
    let head = [
        "varied",
        "taxels",
        "pitch, mm",
        "h, mm",
        "medium",
        "inverse",
        "condition",
        "rank",
        "gain",
        "r",
        "degree",
        "forward f64",
        "forward f32",
        "forward fixed",
        "residual f64",
        "residual fixed",
        "e_n f64",
        "e_n f32",
        "e_n fixed",
        "e_t f64",
        "e_t fixed",
        "bits",
    ];
    Table::new("stability", format!("All scenes. {LEGEND}"), &head, rows.iter().map(line).collect())
}

fn line(row: &StabilityRow) -> Vec<Cell> {
    let sensor = &row.sensor;
    let of = |figures: Option<FormatErrors>, pick: fn(&FormatErrors) -> f64| scientific(figures.as_ref().map(pick));
    let error = |figures: Option<FormatErrors>, pick: fn(&FormatErrors) -> Option<f64>| {
        percent(figures.as_ref().and_then(pick))
    };
    let spectrum = |pick: fn(&Spectrum) -> f64| row.spectrum.as_ref().map(pick);
    vec![
        text_cell(row.group.clone()),
        text_cell(format!("{}×{}", sensor.rows, sensor.cols)),
        text_cell(format!("{}×{}", sensor.pitch_x_mm, sensor.pitch_y_mm)),
        text_cell(sensor.thickness_mm.to_string()),
        text_cell(medium(row.medium)),
        text_cell(row.inverse),
        scientific(spectrum(|s| s.condition)),
        decimal(spectrum(|s| s.rank), 0),
        scientific(spectrum(|s| s.gain)),
        decimal(spectrum(|s| s.radius), 3),
        decimal(spectrum(|s| s.degree as f64), 0),
        of(row.double, |f| f.forward),
        of(row.single, |f| f.forward),
        of(row.fixed, |f| f.forward),
        of(row.double, |f| f.residual),
        of(row.fixed, |f| f.residual),
        error(row.double, |f| f.normal),
        error(row.single, |f| f.normal),
        error(row.fixed, |f| f.normal),
        error(row.double, |f| f.tangential),
        error(row.fixed, |f| f.tangential),
        decimal(row.bits.map(f64::from), 0),
    ]
}

/// A number in scientific notation with two digits.
fn scientific(value: Option<f64>) -> Cell {
    value.map_or_else(empty_cell, |value| Cell { shown: format!("{value:.1e}"), number: Some(value) })
}

fn medium(medium: Medium) -> String {
    match medium {
        Medium::HalfSpace => "half-space".into(),
        Medium::BondedLayer { poisson } => format!("layer, ν {poisson}"),
    }
}

fn csv(rows: &[StabilityRow]) -> String {
    let mut text = "varied,rows,cols,pitch_x_mm,pitch_y_mm,thickness_mm,medium,poisson,inverse,level,condition,rank,\
                    gain,radius,degree"
        .to_owned();
    for format in ["f64", "f32", "fixed"] {
        text.push_str(&format!(",forward_{format},residual_{format},normal_{format},tangential_{format}"));
    }
    text.push_str(",bits,refused\n");
    let optional = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
    for row in rows {
        let sensor = &row.sensor;
        let (kind, poisson) = match row.medium {
            Medium::HalfSpace => ("half-space", None),
            Medium::BondedLayer { poisson } => ("bonded-layer", Some(poisson)),
        };
        let mut fields = vec![
            quoted(&row.group),
            sensor.rows.to_string(),
            sensor.cols.to_string(),
            sensor.pitch_x_mm.to_string(),
            sensor.pitch_y_mm.to_string(),
            sensor.thickness_mm.to_string(),
            kind.to_owned(),
            optional(poisson),
            row.inverse.to_owned(),
            row.level.to_string(),
        ];
        let s = row.spectrum;
        fields
            .extend([s.map(|s| s.condition), s.map(|s| s.rank), s.map(|s| s.gain), s.map(|s| s.radius)].map(optional));
        fields.push(s.map_or(String::new(), |s| s.degree.to_string()));
        for f in [row.double, row.single, row.fixed] {
            fields.extend([f.map(|f| f.forward), f.map(|f| f.residual)].map(optional));
            fields.extend([f.and_then(|f| f.normal), f.and_then(|f| f.tangential)].map(optional));
        }
        fields.push(row.bits.map_or(String::new(), |bits| bits.to_string()));
        fields.push(row.refused.as_ref().or(row.fixed_refused.as_ref()).map_or(String::new(), |text| quoted(text)));
        text.push_str(&(fields.join(",") + "\n"));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::csv_reader;
    use super::*;
    use dermis_golden::spec::scene::Scene;
    use dermis_study::stability::{measure, Setting};

    fn rows() -> Vec<StabilityRow> {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let mut wide = scene.clone();
        wide.sensor.thickness_mm = 40.0;
        wide.search.mu_max = 2.0;
        [("a, \"b\"", scene), ("wide", wide)]
            .map(|(group, scene)| measure(&Setting::new(group, scene)).unwrap())
            .to_vec()
    }

    #[test]
    fn csv_reads_back() {
        let rows = rows();
        let (head, records) = csv_reader::csv(&stability(&rows, Format::Csv).unwrap());
        let of = |record: usize, name: &str| csv_reader::field(&head, &records[record], name).to_owned();
        assert_eq!((of(0, "varied"), of(0, "inverse")), ("a, \"b\"".to_owned(), "tsvd".to_owned()));
        let fixed = rows[0].fixed.unwrap();
        assert_eq!(of(0, "forward_fixed").parse::<f64>().unwrap(), fixed.forward);
        assert_eq!(of(0, "normal_fixed").parse::<f64>().unwrap(), fixed.normal.unwrap());
        assert_eq!(of(0, "condition").parse::<f64>().unwrap(), rows[0].spectrum.unwrap().condition);
        // A scene without convergent series has no figures, but the reason.
        assert_eq!((of(1, "condition"), of(1, "forward_f64")), (String::new(), String::new()));
        assert!(of(1, "refused").contains("needs a series of more than degree"));
    }

    #[test]
    fn markdown_and_json_hold_figures_and_reasons() {
        let rows = rows();
        let text = stability(&rows, Format::Markdown).unwrap();
        assert!(text.contains("needs a series of more than degree 8; use search.mu_max = "), "{text}");
        assert!(text.lines().nth(2).unwrap().contains("| tsvd "), "{text}");
        let read: serde_json::Value = serde_json::from_str(&stability(&rows, Format::Json).unwrap()).unwrap();
        assert_eq!(read[0]["single"]["forward"].as_f64(), Some(rows[0].single.unwrap().forward));
        assert!(read[1]["spectrum"].is_null());
    }
}
