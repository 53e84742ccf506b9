//! Results on extreme frames, for `dermis stability --extreme` (Markdown, CSV, JSON) and for the report.

use anyhow::Result;
use dermis_golden::result::flags::Flag;
use dermis_study::stability::extreme::{ExtremeRow, Outcome};
use serde_json::json;

use super::csv::quoted;
use super::data::markdown;
use super::document::{percent, text_cell, Table};
use super::Format;

/// Header of the CSV.
const HEAD: &str = "scene,frame,golden_x,golden_y,golden_n,golden_flags,fixed_x,fixed_y,fixed_n,fixed_flags,status,\
                    refused\n";

/// Explanation of the columns.
const LEGEND: &str =
    "Resultants in N: x, y, normal; e_t, e_n: errors relative to the total load; status: flags of the status beats";

/// The extreme frames of several scenes, one table per scene.
///
/// # Errors
/// A number that JSON cannot represent.
pub fn extremes(all: &[(String, Vec<ExtremeRow>)], format: Format) -> Result<String> {
    let mut text = String::new();
    match format {
        Format::Json => {
            let scenes: Vec<_> = all.iter().map(|(scene, rows)| json!({ "scene": scene, "frames": rows })).collect();
            return Ok(serde_json::to_string(&scenes)? + "\n");
        }
        Format::Csv => {
            text.push_str(HEAD);
            let of = |outcome: Option<&Outcome>| match outcome {
                None => ",,,".to_owned(),
                Some(Outcome { resultant_N: [x, y, n], flags, .. }) => format!("{x},{y},{n},{}", quoted(&names(flags))),
            };
            for (scene, row) in all.iter().flat_map(|(scene, rows)| rows.iter().map(move |row| (scene, row))) {
                let (golden, fixed) = (of(Some(&row.golden)), of(row.fixed.as_ref()));
                let [frame, status] = [&row.frame, &row.status].map(|text| quoted(text));
                let refused = row.refused.as_ref().map_or(String::new(), |text| quoted(text));
                text.push_str(&format!("{},{frame},{golden},{fixed},{status},{refused}\n", quoted(scene)));
            }
        }
        Format::Markdown => {
            for (scene, rows) in all {
                text.push_str(&format!("{scene}\n\n{}", markdown(&extremes_table(scene, rows))));
            }
            text.push_str(&format!("\n{LEGEND}\n"));
        }
    }
    Ok(text)
}

/// The extreme frames of one scene.
pub(super) fn extremes_table(scene: &str, rows: &[ExtremeRow]) -> Table {
    let head = [
        "frame",
        "golden, N",
        "flags",
        "fixed, N",
        "flags",
        "status",
        "e_t golden",
        "e_t fixed",
        "e_n golden",
        "e_n fixed",
    ];
    let force = |o: &Outcome| text_cell(o.resultant_N.map(|f| format!("{f:.3e}")).join(", "));
    let lines = rows.iter().map(|row| {
        let fixed = row.fixed.as_ref();
        let error = |outcome: Option<&Outcome>, k: usize| percent(outcome.and_then(|outcome| outcome.errors[k]));
        let golden = Some(&row.golden);
        vec![
            text_cell(row.frame.clone()),
            force(&row.golden),
            text_cell(names(&row.golden.flags)),
            fixed.map_or_else(|| text_cell("refused"), force),
            text_cell(fixed.map_or_else(|| row.refused.clone().unwrap_or_default(), |fixed| names(&fixed.flags))),
            text_cell(row.status.clone()),
            error(golden, 0),
            error(fixed, 0),
            error(golden, 1),
            error(fixed, 1),
        ]
    });
    Table::new(format!("extremes-{scene}"), format!("{scene}. {LEGEND}"), &head, lines.collect())
}

/// Flags as in JSON, separated by commas.
fn names(flags: &[Flag]) -> String {
    flags.iter().map(|flag| flag.name()).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::super::csv_reader;
    use super::*;
    use dermis_golden::spec::scene::Scene;
    use dermis_study::stability::extreme::{frames, outcome};

    #[test]
    fn extremes_in_every_format() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let rows: Vec<_> = frames(&scene).unwrap().iter().take(2).map(|e| outcome(e).unwrap()).collect();
        let all = vec![("eight-by-eight".to_owned(), rows)];
        let (head, records) = csv_reader::csv(&extremes(&all, Format::Csv).unwrap());
        assert_eq!(records.len(), 2);
        assert_eq!(csv_reader::field(&head, &records[0], "golden_flags"), "no-contact, condition-unmet");
        assert!(extremes(&all, Format::Markdown).unwrap().contains("no-contact, condition-unmet"));
        let read: serde_json::Value = serde_json::from_str(&extremes(&all, Format::Json).unwrap()).unwrap();
        assert_eq!(read[0]["frames"][0]["golden"]["resultant_N"][2].as_f64(), Some(0.0));
    }
}
