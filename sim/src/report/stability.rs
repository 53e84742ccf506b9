//! The table of `dermis stability` as Markdown, CSV and JSON.

use anyhow::Result;
use dermis_golden::scene::Medium;
use dermis_golden::stability::{Figures, Row};

use super::csv::quoted;
use super::table::{aligned, percent};
use super::Format;

/// Condition against error, one line per scene. Fractions in CSV and JSON, percent in Markdown.
///
/// # Errors
/// A number JSON cannot hold.
pub fn stability(rows: &[Row], format: Format) -> Result<String> {
    Ok(match format {
        Format::Json => serde_json::to_string(rows)? + "\n",
        Format::Csv => csv(rows),
        Format::Markdown => text(rows),
    })
}

/// A figure for people: a power of ten with two digits.
fn short(value: Option<f64>) -> String {
    value.map_or("-".into(), |value| format!("{value:.1e}"))
}

fn medium(medium: Medium) -> String {
    match medium {
        Medium::HalfSpace => "half-space".into(),
        Medium::BondedLayer { poisson } => format!("layer, ν {poisson}"),
    }
}

fn text(rows: &[Row]) -> String {
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
        "f32",
        "fixed",
        "residual f64",
        "fixed",
        "e_n f64",
        "f32",
        "fixed",
        "e_t f64",
        "fixed",
        "bits",
    ];
    let mut notes: Vec<&String> = Vec::new();
    let lines = rows.iter().map(|row| {
        for note in row.refused.iter().chain(&row.fixed_refused) {
            if !notes.contains(&note) {
                notes.push(note);
            }
        }
        let sensor = &row.sensor;
        let of = |figures: Option<Figures>, pick: fn(&Figures) -> f64| short(figures.as_ref().map(pick));
        let error =
            |figures: Option<Figures>, pick: fn(&Figures) -> Option<f64>| percent(figures.as_ref().and_then(pick));
        let spectrum = |pick: &dyn Fn(&dermis_golden::stability::Spectrum) -> String| {
            row.spectrum.as_ref().map_or("-".into(), pick)
        };
        vec![
            row.group.clone(),
            format!("{}×{}", sensor.rows, sensor.cols),
            format!("{}×{}", sensor.pitch_x_mm, sensor.pitch_y_mm),
            sensor.thickness_mm.to_string(),
            medium(row.medium),
            row.inverse.to_owned(),
            spectrum(&|s| format!("{:.1e}", s.condition)),
            spectrum(&|s| format!("{:.0}", s.rank)),
            spectrum(&|s| format!("{:.1e}", s.gain)),
            spectrum(&|s| format!("{:.3}", s.radius)),
            spectrum(&|s| s.degree.to_string()),
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
            row.bits.map_or("-".into(), |bits| bits.to_string()),
        ]
    });
    let mut text = aligned(6, &head, lines.collect());
    text.push_str(
        "\nrank: Σ λ f(λ); gain: ‖Cz⁺‖ in N/MPa; r: spectral radius at mu_max; forward: ‖Cz⁺b − p‖/‖p‖ without shear; \
         residual: ‖b − C x‖/‖b‖;\ne_n, e_t: errors of the resultant with shear; bits: least input bits for a forward \
         error within 1 % of f64's; -: refused, or none\n",
    );
    notes.iter().for_each(|note| text.push_str(&format!("- {note}\n")));
    text
}

fn csv(rows: &[Row]) -> String {
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
    use super::super::read;
    use super::*;
    use dermis_golden::scene::Scene;
    use dermis_golden::stability::{measure, Setting};

    fn rows() -> Vec<Row> {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let mut wide = scene.clone();
        wide.sensor.thickness_mm = 40.0;
        wide.search.mu_max = 2.0;
        [("a, \"b\"", scene), ("wide", wide)].map(|(group, scene)| measure(&Setting::new(group, scene)).unwrap()).to_vec()
    }

    #[test]
    fn csv_comes_back() {
        let rows = rows();
        let (head, records) = read::csv(&stability(&rows, Format::Csv).unwrap());
        let of = |record: usize, name: &str| read::field(&head, &records[record], name).to_owned();
        assert_eq!((of(0, "varied"), of(0, "inverse")), ("a, \"b\"".to_owned(), "tsvd".to_owned()));
        let fixed = rows[0].fixed.unwrap();
        assert_eq!(of(0, "forward_fixed").parse::<f64>().unwrap(), fixed.forward);
        assert_eq!(of(0, "normal_fixed").parse::<f64>().unwrap(), fixed.normal.unwrap());
        assert_eq!(of(0, "condition").parse::<f64>().unwrap(), rows[0].spectrum.unwrap().condition);
        // A scene without series has no figures, and its reason.
        assert_eq!((of(1, "condition"), of(1, "forward_f64")), (String::new(), String::new()));
        assert!(of(1, "refused").contains("needs more than degree"));
    }

    #[test]
    fn markdown_and_json_hold_figures_and_reasons() {
        let rows = rows();
        let text = stability(&rows, Format::Markdown).unwrap();
        assert!(text.contains("needs more than degree 8; search.mu_max = "), "{text}");
        assert!(text.lines().nth(2).unwrap().contains("| tsvd "), "{text}");
        let read: serde_json::Value = serde_json::from_str(&stability(&rows, Format::Json).unwrap()).unwrap();
        assert_eq!(read[0]["single"]["forward"].as_f64(), Some(rows[0].single.unwrap().forward));
        assert!(read[1]["spectrum"].is_null());
    }
}
