//! The noise table as Markdown, CSV and JSON.

use anyhow::Result;
use dermis_golden::noise::{Row, Spread};

use super::table::{markdown, percent};
use super::Format;

/// A study's rows in one form. Fractions in CSV and JSON, percent in Markdown.
///
/// # Errors
/// A number JSON cannot hold.
pub fn noise(rows: &[Row], format: Format) -> Result<String> {
    Ok(match format {
        Format::Json => serde_json::to_string(rows)? + "\n",
        Format::Csv => csv(rows),
        Format::Markdown => text(rows),
    })
}

fn text(rows: &[Row]) -> String {
    let head = [
        "noise",
        "frames",
        "objective",
        "e_t median",
        "90 %",
        "RMS",
        "bound, 6 unknowns: median",
        "90 %",
        "bound, 9: median",
        "median / bound 6",
        "median / bound 9",
    ];
    let ratio = |ratio: Option<f64>| ratio.map_or("-".into(), |ratio| format!("{ratio:.2}"));
    let of = |value: f64| percent(Some(value));
    let lines = rows.iter().map(|row| {
        vec![
            of(row.noise),
            row.frames.to_string(),
            row.objective.to_owned(),
            of(row.found.median),
            of(row.found.ninety),
            of(row.found.rms),
            of(row.bound_6.median),
            of(row.bound_6.ninety),
            of(row.bound_9.median),
            ratio(row.ratio_6),
            ratio(row.ratio_9),
        ]
    });
    let mut text = markdown(&head, lines.collect());
    text.push_str(
        "\nnoise: of max |b|, per taxel and frame; e_t: tangential error of the resultant; bound: Cramér–Rao\n",
    );
    text
}

fn csv(rows: &[Row]) -> String {
    let mut text = "noise,frames,objective,median,ninety,rms,bound6_median,bound6_ninety,bound6_rms,\
                    bound9_median,bound9_ninety,bound9_rms,ratio6,ratio9\n"
        .to_owned();
    let spread = |s: &Spread| format!("{},{},{}", s.median, s.ninety, s.rms);
    let ratio = |ratio: Option<f64>| ratio.map_or(String::new(), |ratio| ratio.to_string());
    for row in rows {
        text.push_str(&format!(
            "{},{},{},{},{},{},{},{}\n",
            row.noise,
            row.frames,
            row.objective,
            spread(&row.found),
            spread(&row.bound_6),
            spread(&row.bound_9),
            ratio(row.ratio_6),
            ratio(row.ratio_9)
        ));
    }
    text
}
