//! Markdown tables, aligned for reading in a terminal, and the tables of `dermis cosim` and `dermis table --cosim`.

use dermis_golden::result::reconstruct::Reconstruction;

use super::{CosimReport, BUDGET_US};
use dermis_cosim::verify::{FrameResult, Verified};
use dermis_cosim::Findings;
use dermis_golden::quantile::median;

/// Number of mismatches printed; `--json` contains more.
const PRINTED: usize = 16;

/// One co-simulation: a row per frame, the runs, the result with mismatches.
pub fn cosim(verified: &Verified) -> String {
    let head = [
        "frame",
        "full scale MPa",
        "e_t golden",
        "e_t fixed",
        "e_n golden",
        "e_n fixed",
        "fixed − golden max",
        "RMS",
        "RTL = fixed",
        "latency",
        "total",
        "µs",
    ];
    let rows = verified.rows.iter().map(|row| {
        let d = &row.difference;
        vec![
            row.frame.clone(),
            significant_digits(row.full_scale_MPa, row.full_scale_MPa),
            percent(tangential(&row.golden)),
            percent(tangential(&row.fixed)),
            percent(normal(&row.golden)),
            percent(normal(&row.fixed)),
            format!("{:.0} LSB = {}", d.max_lsb, percent(Some(d.max_share))),
            format!("{:.0} LSB = {}", d.rms_lsb, percent(Some(d.rms_share))),
            equality_cell(verified, row.equal),
            count(row.times.latency()),
            count(row.times.total()),
            row.times.total().map_or("-".into(), |c| format!("{:.2}", verified.board.microseconds(c))),
        ]
    });
    let mut text = markdown(&head, rows.collect());
    text.push_str(&format!("\nruns: {}\n", verified.runs.join("; ")));
    text.push_str(&summary(verified));
    text
}

/// Equality, mismatches and margin.
fn summary(verified: &Verified) -> String {
    let findings = &verified.findings;
    let mut text = String::new();
    if findings.is_equal() {
        text.push_str("equal to the bit-true model to the bit: every stage, every beat, every cycle count\n");
    } else {
        text.push_str(&differences(findings));
    }
    let report = CosimReport::new(verified);
    if let (Some(cycles), Some(time)) = (report.total_cycles.max, report.time_us.max) {
        text.push_str(&format!(
            "at most {cycles} cycles = {time:.2} µs at {} MHz ({}, design target), {:.2} µs below the budget of \
             {BUDGET_US} µs\n",
            report.clock_MHz,
            verified.board.name,
            BUDGET_US as f64 - time,
        ));
    }
    if let Some(interval) = verified.frame_interval {
        let clock = verified.board.clock_MHz;
        text.push_str(&format!(
            "frames back to back: at most {interval} cycles from one to the next (planned {}), {:.0} frames per second\n",
            verified.planned_interval,
            clock * 1e6 / interval as f64,
        ));
    }
    text
}

/// Number of mismatches, and the first of them.
pub(super) fn differences(findings: &Findings) -> String {
    let shown = &findings.kept[..findings.kept.len().min(PRINTED)];
    let mut text = format!("NOT EQUAL: {} mismatches, the first {}:\n", findings.count, shown.len());
    shown.iter().for_each(|mismatch| text.push_str(&format!("  {mismatch}\n")));
    text
}

/// The table of `dermis table --cosim`: one row per scene.
pub fn scenes(all: &[Verified]) -> String {
    let head = [
        "scene",
        "frames",
        "e_t golden",
        "e_t fixed",
        "e_n golden",
        "e_n fixed",
        "RTL = fixed",
        "latency, shipped frames",
        "cycles, shipped frames",
        "frame interval, cycles",
        "MHz",
        "µs",
        "margin to 1 ms",
    ];
    let rows = all.iter().map(|verified| {
        let report = CosimReport::new(verified);
        let of =
            |value: fn(&FrameResult) -> Option<f64>| percent(median(verified.rows.iter().filter_map(value).collect()));
        let time = report.time_us.max;
        vec![
            report.scene,
            report.frames.to_string(),
            of(|row| tangential(&row.golden)),
            of(|row| tangential(&row.fixed)),
            of(|row| normal(&row.golden)),
            of(|row| normal(&row.fixed)),
            equality_cell(verified, report.equal),
            count(report.cycles.max),
            count(report.total_cycles.max),
            count(report.frame_interval),
            report.clock_MHz.to_string(),
            time.map_or("-".into(), |t| format!("{t:.2}")),
            time.map_or("-".into(), |t| format!("{:.2} µs", BUDGET_US as f64 - t)),
        ]
    });
    let mut text = markdown(&head, rows.collect());
    text.push_str(
        "\ne_t, e_n: tangential and normal error of the resultant, median over the frames; latency and \
         cycles: of the slowest of these frames; frame interval: frames back to back\n",
    );
    text
}

fn tangential(result: &Reconstruction) -> Option<f64> {
    result.error.as_ref()?.tangential
}

fn normal(result: &Reconstruction) -> Option<f64> {
    result.error.as_ref()?.normal
}

/// A fraction in percent with two decimals, `-` for none.
pub fn percent(fraction: Option<f64>) -> String {
    fraction.map_or("-".into(), |f| format!("{:.2} %", 100.0 * f))
}

fn count(cycles: Option<u64>) -> String {
    cycles.map_or("-".into(), |c| c.to_string())
}

/// Whether the Verilog equals the model; `-` if only kernel simulation was run.
fn equality_cell(verified: &Verified, equal: bool) -> String {
    match (verified.verilog, equal) {
        (false, _) => "-",
        (true, true) => "yes",
        (true, false) => "NO",
    }
    .into()
}

/// Formats `value` with as many decimals as give `largest` (of the values shown together) five significant digits; in
/// scientific notation if that takes too many zeros.
pub(super) fn significant_digits(value: f64, largest: f64) -> String {
    const DIGITS: i32 = 5;
    let magnitude = if largest == 0.0 { 0 } else { largest.abs().log10().floor() as i32 };
    if (-4..=6).contains(&magnitude) {
        // Never negative: cast to a count of decimals.
        format!("{value:.*}", (DIGITS - 1 - magnitude).max(0) as usize)
    } else {
        format!("{value:.*e}", (DIGITS - 1) as usize)
    }
}

/// A Markdown table with padded columns; the first one is left-aligned, the others right-aligned. A | in a cell is escaped.
pub(super) fn markdown(head: &[&str], rows: Vec<Vec<String>>) -> String {
    aligned(1, head, rows)
}

/// The same with the first `texts` columns left-aligned.
pub fn aligned(texts: usize, head: &[&str], rows: Vec<Vec<String>>) -> String {
    let escaped = |cell: &str| cell.replace('|', "\\|");
    let head: Vec<String> = head.iter().map(|head| escaped(head)).collect();
    let rows: Vec<Vec<String>> = rows.iter().map(|row| row.iter().map(|cell| escaped(cell)).collect()).collect();
    let width = |column: usize| {
        let cells = rows.iter().chain([&head]).map(|row| row[column].chars().count());
        cells.max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..head.len()).map(width).collect();
    let line = |row: &Vec<String>| {
        let cells = row.iter().zip(&widths).enumerate().map(|(column, (cell, &width))| {
            let pad = " ".repeat(width - cell.chars().count());
            if column < texts {
                format!("{cell}{pad}")
            } else {
                format!("{pad}{cell}")
            }
        });
        format!("| {} |\n", cells.collect::<Vec<_>>().join(" | "))
    };
    let rule = widths.iter().enumerate().map(|(column, &width)| {
        if column < texts {
            "-".repeat(width + 2)
        } else {
            format!("{}:", "-".repeat(width + 1))
        }
    });
    let rule = format!("|{}|\n", rule.collect::<Vec<_>>().join("|"));
    let body: String = rows.iter().map(line).collect();
    format!("{}{rule}{body}", line(&head))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_keep_five_digits_of_the_largest() {
        let cases = [
            (0.25, 0.25, "0.25000"),
            (4.123_456, 4.2, "4.1235"),
            (-0.001, 12.5, "-0.001"),
            (123_456.7, 123_456.7, "123457"),
            (3.2e-4, 3.2e-4, "0.00032000"),
            (2.5e-9, 2.5e-9, "2.5000e-9"),
            (1.5e12, 1.5e12, "1.5000e12"),
            (0.0, 0.0, "0.0000"),
        ];
        for (value, largest, text) in cases {
            assert_eq!(significant_digits(value, largest), text);
        }
    }

    #[test]
    fn columns_are_padded_by_characters_not_bytes() {
        let table = markdown(&["frame", "µs"], vec![vec!["a".into(), "12.50".into()]]);
        assert_eq!(table, "| frame |    µs |\n|-------|------:|\n| a     | 12.50 |\n");
    }

    #[test]
    fn a_bar_does_not_end_a_cell() {
        let table = markdown(&["frame", "|X1|"], vec![vec!["a|b".into(), "1".into()]]);
        assert_eq!(table, "| frame | \\|X1\\| |\n|-------|-------:|\n| a\\|b  |      1 |\n");
    }
}
