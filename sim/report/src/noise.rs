//! The noise table as Markdown, CSV and JSON.

use anyhow::Result;
use dermis_study::noise::{NoiseRow, Spread};

use super::table::{aligned, markdown, percent};
use super::Format;

/// The rows of a noise study in one format: fractions in CSV and JSON, percent in Markdown.
///
/// # Errors
/// A number that JSON cannot represent.
pub fn noise(rows: &[NoiseRow], format: Format) -> Result<String> {
    Ok(match format {
        Format::Json => serde_json::to_string(rows)? + "\n",
        Format::Csv => csv(rows),
        Format::Markdown => text(rows),
    })
}

fn text(rows: &[NoiseRow]) -> String {
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
        "\nnoise: standard deviation over max |b|, per taxel and frame; e_t: tangential error of the resultant; \
         90 %: quantile; bound: Cramér–Rao, for 6 or 9 unknowns\n",
    );
    text
}

/// Median errors: a line per noise level and number of averaged frames, a column per objective, then the bound of the six
/// unknowns.
pub fn noise_medians(rows: &[NoiseRow]) -> String {
    let lines: Vec<&[NoiseRow]> = rows.chunk_by(|a, b| (a.noise, a.frames) == (b.noise, b.frames)).collect();
    let objectives = lines.first().into_iter().flat_map(|line| line.iter()).map(|row| format!("`{}`", row.objective));
    let head: Vec<String> = ["noise", "frames"]
        .map(str::to_owned)
        .into_iter()
        .chain(objectives)
        .chain(["Cramér–Rao bound".into()])
        .collect();
    let line = |rows: &[NoiseRow]| {
        let mut cells = vec![percent(Some(rows[0].noise)), rows[0].frames.to_string()];
        cells.extend(rows.iter().map(|row| percent(Some(row.found.median))));
        cells.push(percent(Some(rows[0].bound_6.median)));
        cells
    };
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    aligned(2, &head, lines.into_iter().map(line).collect())
}

fn csv(rows: &[NoiseRow]) -> String {
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

#[cfg(test)]
mod tests {
    use super::super::csv_reader;
    use super::*;
    use serde_json::Value;

    fn rows() -> Vec<NoiseRow> {
        let spread = |by: f64| Spread { median: by / 3.0, ninety: 2.0 * by, rms: 0.1 * by };
        let noisy = NoiseRow {
            noise: 1e-4,
            frames: 64,
            objective: "patch",
            found: spread(1.0),
            bound_6: spread(0.5),
            bound_9: spread(0.25),
            ratio_6: Some(2.0),
            ratio_9: Some(4.0),
        };
        let silent =
            NoiseRow { noise: 0.0, frames: 1, bound_6: spread(0.0), ratio_6: None, ratio_9: None, ..noisy.clone() };
        vec![noisy, silent]
    }

    /// Every number of a row with its CSV column and its JSON pointer.
    fn numbers(row: &NoiseRow) -> [(&'static str, &'static str, Option<f64>); 12] {
        [
            ("noise", "/noise", Some(row.noise)),
            ("median", "/found/median", Some(row.found.median)),
            ("ninety", "/found/ninety", Some(row.found.ninety)),
            ("rms", "/found/rms", Some(row.found.rms)),
            ("bound6_median", "/bound_6/median", Some(row.bound_6.median)),
            ("bound6_ninety", "/bound_6/ninety", Some(row.bound_6.ninety)),
            ("bound6_rms", "/bound_6/rms", Some(row.bound_6.rms)),
            ("bound9_median", "/bound_9/median", Some(row.bound_9.median)),
            ("bound9_ninety", "/bound_9/ninety", Some(row.bound_9.ninety)),
            ("bound9_rms", "/bound_9/rms", Some(row.bound_9.rms)),
            ("ratio6", "/ratio_6", row.ratio_6),
            ("ratio9", "/ratio_9", row.ratio_9),
        ]
    }

    #[test]
    fn csv_reads_back() {
        let rows = rows();
        let (head, records) = csv_reader::csv(&noise(&rows, Format::Csv).unwrap());
        assert_eq!((head.len(), records.len()), (14, 2));
        for (row, record) in rows.iter().zip(&records) {
            let of = |name: &str| csv_reader::field(&head, record, name);
            assert_eq!((of("frames"), of("objective")), (row.frames.to_string().as_str(), row.objective));
            for (name, _, wanted) in numbers(row) {
                // Numbers are written so that they read back exactly; missing ones are empty.
                assert_eq!(of(name).parse::<f64>().ok(), wanted, "{name}");
            }
        }
    }

    #[test]
    fn json_reads_back() {
        let rows = rows();
        let read: Value = serde_json::from_str(&noise(&rows, Format::Json).unwrap()).unwrap();
        assert_eq!(read.as_array().map(Vec::len), Some(2));
        for (index, row) in rows.iter().enumerate() {
            let of = &read[index];
            assert_eq!((&of["frames"], &of["objective"]), (&Value::from(row.frames), &Value::from(row.objective)));
            for (_, place, wanted) in numbers(row) {
                assert_eq!(of.pointer(place).unwrap().as_f64(), wanted, "{place}");
            }
        }
    }

    #[test]
    fn medians_stand_by_level_and_objective() {
        let [noisy, silent] = &rows()[..] else { panic!("two rows") };
        let other = NoiseRow { objective: "auto", found: silent.bound_6, ..noisy.clone() };
        let text = noise_medians(&[noisy.clone(), other, silent.clone(), silent.clone()]);
        let wanted = [
            "| noise  | frames | `patch` | `auto` | Cramér–Rao bound |",
            "|--------|--------|--------:|-------:|-----------------:|",
            "| 0.01 % | 64     | 33.33 % | 0.00 % |          16.67 % |",
            "| 0.00 % | 1      | 33.33 % | 33.33 % |           0.00 % |",
        ];
        let same = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(same(text.lines().next().unwrap()), same(wanted[0]));
        assert_eq!(
            text.lines().skip(2).map(same).collect::<Vec<_>>(),
            wanted[2..].iter().map(|l| same(l)).collect::<Vec<_>>()
        );
        assert_eq!(noise_medians(&[]).lines().count(), 2);
    }

    #[test]
    fn without_rows_only_the_header_remains() {
        assert_eq!(csv_reader::csv(&noise(&[], Format::Csv).unwrap()).1.len(), 0);
        assert_eq!(noise(&[], Format::Json).unwrap(), "[]\n");
    }
}
