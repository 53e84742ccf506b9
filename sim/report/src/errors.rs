//! The error table as Markdown, CSV and JSON.

use anyhow::Result;
use dermis_golden::result::errors::Errors;
use serde::Serialize;

use super::csv::quoted;
use super::table::{markdown, percent};
use super::tabulate::ErrorRow;
use super::Format;
use dermis_golden::quantile::{median, quantile};

/// The rows in one format: fractions in CSV and JSON, percent in Markdown.
///
/// # Errors
/// A number that JSON cannot represent.
pub fn errors(rows: &[ErrorRow], format: Format) -> Result<String> {
    Ok(match format {
        Format::Json => serde_json::to_string(&Document { rows, medians: medians(rows) })? + "\n",
        Format::Csv => csv(rows),
        Format::Markdown => text(rows),
    })
}

/// The JSON.
#[derive(Serialize)]
struct Document<'a> {
    #[serde(rename = "lines")]
    rows: &'a [ErrorRow],
    medians: Vec<Medians>,
}

/// Medians of one scene and case over its frames; errors of axes by magnitude, as signs would cancel.
#[derive(Serialize)]
struct Medians {
    scene: String,
    case: String,
    frames: usize,
    axes: [Option<f64>; 3],
    axes_case_0: [Option<f64>; 3],
    tangential: Option<f64>,
    tangential_ninety: Option<f64>,
    normal: Option<f64>,
    normal_ninety: Option<f64>,
    l2: Option<f64>,
    of_all: Option<f64>,
    of_all_ninety: Option<f64>,
    own: Option<f64>,
    paper: Option<[f64; 3]>,
}

fn axes(errors: Option<&Errors>) -> [Option<f64>; 3] {
    errors.map_or([None; 3], Errors::axes)
}

fn medians(rows: &[ErrorRow]) -> Vec<Medians> {
    let same = |a: &ErrorRow, b: &ErrorRow| (&a.scene, &a.case) == (&b.scene, &b.case);
    let of = |group: &[ErrorRow]| {
        let ninety = |value: &dyn Fn(&ErrorRow) -> Option<f64>| quantile(group.iter().filter_map(value).collect(), 0.9);
        let over = |value: &dyn Fn(&ErrorRow) -> Option<f64>| median(group.iter().filter_map(value).collect());
        let tangential = |row: &ErrorRow| row.error.as_ref()?.tangential;
        let normal = |row: &ErrorRow| row.error.as_ref()?.normal;
        let of_all = |row: &ErrorRow| row.shear_over_all.filter(|_| row.contacts > 1);
        Medians {
            scene: group[0].scene.clone(),
            case: group[0].case.clone(),
            frames: group.len(),
            axes: [0, 1, 2].map(|k| over(&|row| Some(axes(row.error.as_ref())[k]?.abs()))),
            axes_case_0: [0, 1, 2].map(|k| over(&|row| Some(axes(row.error_case_0.as_ref())[k]?.abs()))),
            tangential: over(&tangential),
            tangential_ninety: ninety(&tangential),
            normal: over(&normal),
            normal_ninety: ninety(&normal),
            l2: over(&|row| row.l2),
            of_all: over(&of_all),
            of_all_ninety: ninety(&of_all),
            own: median(group.iter().flat_map(|row| row.contact_shears.clone()).collect()),
            paper: group[0].paper,
        }
    };
    rows.chunk_by(same).map(of).collect()
}

/// Scene, case and frame, with which every row begins.
fn names(row: &ErrorRow) -> Vec<String> {
    let case = row.chosen_case.as_ref().map_or(row.case.clone(), |taken| format!("{}: {taken}", row.case));
    vec![row.scene.clone(), case, row.frame.clone()]
}

/// Errors of both models against the truth.
fn to_truth(rows: &[ErrorRow]) -> String {
    let head = [
        "scene",
        "case",
        "frame",
        "X1",
        "X2",
        "X3",
        "e_t",
        "e_n",
        "ℓ2",
        "e_t of Σ|t|",
        "fixed X1",
        "X2",
        "X3",
        "e_t",
        "e_n",
    ];
    let body = rows.iter().map(|row| {
        let (error, fixed) = (row.error.as_ref(), row.fixed.as_ref().and_then(|fixed| fixed.error.as_ref()));
        let mut cells = names(row);
        cells.extend(axes(error).map(percent));
        cells.extend([error.and_then(|e| e.tangential), error.and_then(|e| e.normal), row.l2].map(percent));
        cells.push(percent(row.shear_over_all));
        cells.extend(axes(fixed).map(percent));
        cells.extend([fixed.and_then(|e| e.tangential), fixed.and_then(|e| e.normal)].map(percent));
        cells
    });
    markdown(&head, body.collect())
}

/// Errors against case 0, the paper's, differences of the models, and the subarrays: of several only the largest |μ|, as
/// sixteen pairs would make the lines wider than any window.
fn to_others(rows: &[ErrorRow]) -> String {
    let head = [
        "scene",
        "case",
        "frame",
        "to case 0: X1",
        "X2",
        "X3",
        "paper X1",
        "X2",
        "X3",
        "fixed − float max",
        "RMS",
        "both signs",
        "largest |μ|",
    ];
    let body = rows.iter().map(|row| {
        let words = |lsb: f64, share: f64| format!("{lsb:.0} LSB = {}", percent(Some(share)));
        let gap = row.fixed.as_ref().map(|fixed| &fixed.difference);
        let mut cells = names(row);
        cells.extend(axes(row.error_case_0.as_ref()).map(percent));
        cells.extend((0..3).map(|k| percent(row.paper.map(|paper| paper[k]))));
        cells.push(gap.map_or("-".into(), |d| words(d.max_lsb, d.max_share)));
        cells.push(gap.map_or("-".into(), |d| words(d.rms_lsb, d.rms_share)));
        cells.push(row.subarrays.iter().map(|part| if part.both_signs { "y" } else { "n" }).collect());
        let sizes = row.subarrays.iter().map(|part| part.mu[0].hypot(part.mu[1]));
        cells.push(format!("{:.3}", sizes.fold(0.0, f64::max)));
        cells
    });
    markdown(&head, body.collect())
}

/// Medians and 90 % quantiles over the frames.
fn of_medians(medians: &[Medians]) -> String {
    let head = ["scene", "case", "frames", "|X1|", "|X2|", "|X3|", "e_t", "90 %", "e_n", "90 %", "ℓ2"];
    let body = medians.iter().map(|m| {
        let mut row = vec![m.scene.clone(), m.case.clone(), m.frames.to_string()];
        row.extend(m.axes.map(percent));
        row.extend([m.tangential, m.tangential_ninety, m.normal, m.normal_ninety, m.l2].map(percent));
        row
    });
    markdown(&head, body.collect())
}

/// Medians of frames with several contacts, and against case 0 and the paper.
fn of_other_medians(medians: &[Medians]) -> String {
    let head = [
        "scene",
        "case",
        "frames",
        "several: e_t of Σ|t|",
        "90 %",
        "own e_t",
        "to case 0: |X1|",
        "|X2|",
        "|X3|",
        "paper X1",
        "X2",
        "X3",
    ];
    let body = medians.iter().map(|m| {
        let mut row = vec![m.scene.clone(), m.case.clone(), m.frames.to_string()];
        row.extend([m.of_all, m.of_all_ninety, m.own].map(percent));
        row.extend(m.axes_case_0.map(percent));
        row.extend((0..3).map(|k| percent(m.paper.map(|paper| paper[k]))));
        row
    });
    markdown(&head, body.collect())
}

fn text(rows: &[ErrorRow]) -> String {
    let medians = medians(rows);
    format!(
        "Errors against the true force; fixed: the bit-true model.\n\n{}\nErrors against case 0, those of the paper, \
         differences of the two models, and the subarrays; --format csv and json have the μ of each.\n\n{}\n\
         Medians over the frames, and 90 % quantiles (90 %). several: frames with several contacts; own e_t: shear \
         error of each contact, case contacts only. The paper's figures of sensors 3 and 4 are relative to case 0.\n\n{}\n{}",
        to_truth(rows),
        to_others(rows),
        of_medians(&medians),
        of_other_medians(&medians),
    )
}

fn csv(rows: &[ErrorRow]) -> String {
    let mut text =
        "scene,case,taken,frame,x1,x2,x3,e_t,e_n,l2,of_all,x1_case0,x2_case0,x3_case0,fixed_x1,fixed_x2,fixed_x3,\
                    fixed_e_t,fixed_e_n,max_lsb,max_share,rms_lsb,rms_share,paper_x1,paper_x2,paper_x3,both_signs,\
                    condition,mu,own\n"
            .to_owned();
    for row in rows {
        let fixed = row.fixed.as_ref();
        let fixed_error = fixed.and_then(|fixed| fixed.error.as_ref());
        let error = row.error.as_ref();
        let gap = fixed.map(|fixed| fixed.difference);
        let mut numbers: Vec<Option<f64>> = axes(error).to_vec();
        numbers.extend([error.and_then(|e| e.tangential), error.and_then(|e| e.normal), row.l2, row.shear_over_all]);
        numbers.extend(axes(row.error_case_0.as_ref()));
        numbers.extend(axes(fixed_error));
        numbers.extend([fixed_error.and_then(|e| e.tangential), fixed_error.and_then(|e| e.normal)]);
        numbers.extend([
            gap.map(|d| d.max_lsb),
            gap.map(|d| d.max_share),
            gap.map(|d| d.rms_lsb),
            gap.map(|d| d.rms_share),
        ]);
        numbers.extend((0..3).map(|k| row.paper.map(|paper| paper[k])));
        let numbers: Vec<String> = numbers.iter().map(|n| n.map_or(String::new(), |n| n.to_string())).collect();
        let yes = |met: bool| if met { 'y' } else { 'n' };
        let both: String = row.subarrays.iter().map(|part| yes(part.both_signs)).collect();
        let condition: String = row.subarrays.iter().map(|part| yes(part.condition)).collect();
        let mus = row.subarrays.iter().map(|part| format!("{} {}", part.mu[0], part.mu[1]));
        let (scene, mus) = (quoted(&row.scene), mus.collect::<Vec<_>>().join(";"));
        let frame = quoted(&row.frame);
        let own: Vec<String> = row.contact_shears.iter().map(f64::to_string).collect();
        let (case, taken) = (&row.case, row.chosen_case.as_deref().unwrap_or_default());
        let (numbers, own) = (numbers.join(","), own.join(";"));
        text.push_str(&format!("{scene},{case},{taken},{frame},{numbers},{both},{condition},{mus},{own}\n"));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::csv_reader;
    use super::super::tabulate::{BitTrueErrors, SubarrayRow};
    use super::*;
    use dermis_cosim::compare::Difference;
    use dermis_golden::result::flags::Flag;
    use serde_json::Value;

    fn part(mu: [f64; 2], both_signs: bool) -> SubarrayRow {
        SubarrayRow { mu, both_signs, condition: true }
    }

    /// One row with every field and a name that CSV must quote, one with as few fields as possible.
    fn rows() -> Vec<ErrorRow> {
        let error =
            Errors { x1: Some(-0.1), x2: None, x3: Some(1.0 / 3.0), tangential: Some(0.25), normal: Some(1.0 / 3.0) };
        let difference = Difference { max_lsb: 12.0, rms_lsb: 3.5, max_share: 1e-4, rms_share: 2e-5 };
        let bare = ErrorRow {
            scene: "plain".into(),
            case: "1".into(),
            frame: "b".into(),
            error: None,
            error_case_0: None,
            l2: None,
            contacts: 0,
            shear_over_all: None,
            contact_shears: Vec::new(),
            chosen_case: None,
            subarrays: vec![part([0.0, 0.0], false)],
            fixed: None,
            paper: None,
            flags: Vec::new(),
        };
        let full = ErrorRow {
            scene: "odd, \"quoted\"\nname".into(),
            case: "0".into(),
            frame: "a,b".into(),
            error: Some(error),
            error_case_0: Some(Errors { x1: Some(0.5), ..error }),
            l2: Some(0.125),
            contacts: 2,
            shear_over_all: Some(0.0625),
            contact_shears: vec![0.5, 0.75],
            chosen_case: Some("3".into()),
            subarrays: vec![part([0.1, -0.2], true), part([0.3, 0.4], false)],
            fixed: Some(BitTrueErrors { error: Some(Errors { x2: Some(0.75), ..error }), difference }),
            paper: Some([0.1284, 0.1293, 0.0754]),
            flags: vec![Flag::LoadOutside],
        };
        vec![full, bare]
    }

    #[test]
    fn csv_reads_back() {
        let rows = rows();
        let (head, records) = csv_reader::csv(&errors(&rows, Format::Csv).unwrap());
        assert_eq!((head.len(), records.len()), (30, 2));
        let of = |record: usize, name: &str| csv_reader::field(&head, &records[record], name).to_owned();
        assert_eq!((of(0, "scene"), of(0, "frame")), (rows[0].scene.clone(), rows[0].frame.clone()));
        let numbers = [
            ("x1", -0.1),
            ("x3", 1.0 / 3.0),
            ("e_t", 0.25),
            ("e_n", 1.0 / 3.0),
            ("l2", 0.125),
            ("of_all", 0.0625),
            ("x1_case0", 0.5),
            ("fixed_x2", 0.75),
            ("fixed_e_t", 0.25),
            ("max_lsb", 12.0),
            ("max_share", 1e-4),
            ("rms_lsb", 3.5),
            ("rms_share", 2e-5),
            ("paper_x1", 0.1284),
            ("paper_x3", 0.0754),
        ];
        for (name, wanted) in numbers {
            // Numbers are written so that they read back exactly.
            assert_eq!(of(0, name).parse::<f64>().unwrap(), wanted, "{name}");
            assert_eq!(of(1, name), "", "{name}");
        }
        assert_eq!(of(0, "x2"), "");
        assert_eq!((of(0, "both_signs"), of(0, "condition")), ("yn".into(), "yy".into()));
        assert_eq!((of(0, "taken"), of(1, "taken")), ("3".into(), String::new()));
        assert_eq!((of(0, "own"), of(1, "own")), ("0.5;0.75".into(), String::new()));
        assert_eq!((of(0, "mu"), of(1, "mu")), ("0.1 -0.2;0.3 0.4".into(), "0 0".into()));
    }

    #[test]
    fn json_reads_back() {
        let rows = rows();
        let text = errors(&rows, Format::Json).unwrap();
        let read: Value = serde_json::from_str(&text).unwrap();
        assert!(text.ends_with("}\n"));
        let [full, bare] = [&read["lines"][0], &read["lines"][1]];
        assert_eq!(full["scene"], rows[0].scene.as_str());
        assert_eq!((&full["error"]["x1"], &full["error"]["x2"]), (&Value::from(-0.1), &Value::Null));
        assert_eq!(full["error"]["x3"], 1.0 / 3.0);
        assert_eq!(full["fixed"]["difference"]["rms_share"], 2e-5);
        assert_eq!(full["subarrays"][1]["mu"][1], 0.4);
        assert_eq!(full["flags"][0], "load-outside");
        for field in ["error", "error_case_0", "l2", "fixed", "paper"] {
            assert_eq!(bare[field], Value::Null, "{field}");
        }
        let medians = read["medians"].as_array().unwrap();
        assert_eq!(medians.len(), 2);
        // By magnitude: without the sign of X1.
        assert_eq!((&medians[0]["axes"][0], &medians[0]["frames"]), (&Value::from(0.1), &Value::from(1)));
        assert_eq!((&medians[0]["of_all_ninety"], &medians[0]["own"]), (&Value::from(0.0625), &Value::from(0.75)));
        assert_eq!(medians[1]["tangential"], Value::Null);
    }

    #[test]
    fn markdown_lines_fit_a_window() {
        // The widest of the built-in scenes: sixteen subarrays, errors of four digits.
        let wide = Errors { x1: Some(-12.3456), x2: Some(-12.3456), x3: Some(-12.3456), ..rows()[0].error.unwrap() };
        let row = ErrorRow {
            scene: "sensor-1-unipolar".into(),
            frame: "s4-plantar-two-feet".into(),
            error: Some(wide),
            error_case_0: Some(wide),
            subarrays: vec![part([0.123, -0.456], true); 16],
            ..rows().remove(0)
        };
        let text = errors(&[row], Format::Markdown).unwrap();
        let tables: Vec<&str> = text.lines().filter(|line| line.starts_with('|')).collect();
        assert_eq!(tables.len(), 4 * 3);
        for line in tables {
            assert!(line.chars().count() <= 200, "{} columns: {line}", line.chars().count());
        }
        assert!(text.contains("yyyyyyyyyyyyyyyy") && text.contains("0.472") && text.contains("e_t of Σ\\|t\\|"));
    }

    #[test]
    fn without_rows_only_the_header_remains() {
        let (head, records) = csv_reader::csv(&errors(&[], Format::Csv).unwrap());
        assert_eq!((head.len(), records.len()), (30, 0));
        assert_eq!(errors(&[], Format::Json).unwrap(), "{\"lines\":[],\"medians\":[]}\n");
    }
}
