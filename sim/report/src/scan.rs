//! What `dermis cosim` says of a scan by the hardware.

use dermis_golden::result::flags::Flag;
use serde::Serialize;

use super::table::{differences, markdown};
use super::BUDGET_US;
use dermis_cosim::scan::{ScannedFrame, VerifiedScan};
use dermis_cosim::Mismatch;

/// A scanned frame as JSON.
#[derive(Serialize)]
struct ScanRow {
    frame: String,
    resultant_N: [f64; 3],
    flags: Vec<Flag>,
    equal: bool,
    scan_us: f64,
    engine_us: f64,
    end_to_end_us: f64,
}

/// The co-simulation of a scan as JSON.
#[derive(Serialize)]
pub struct ScanReport {
    scene: String,
    converter: &'static str,
    equal: bool,
    runs: Vec<String>,
    scan_cycles: u64,
    period_cycles: u64,
    frames: Vec<ScanRow>,
    mismatches: usize,
    first_mismatches: Vec<Mismatch>,
}

impl ScanReport {
    /// The report of a co-simulation; `None` where codes come as a stream.
    pub fn new(verified: &VerifiedScan) -> Option<ScanReport> {
        let (model, findings) = (&verified.model, &verified.findings);
        let timing = model.scan_timing()?;
        let us = |cycles: u64| cycles as f64 / model.board.clock_MHz;
        let row = |row: &ScannedFrame| ScanRow {
            frame: row.frame.clone(),
            resultant_N: row.result.resultant_N,
            flags: row.result.flags.clone(),
            equal: row.equal,
            scan_us: us(row.times.last_code.saturating_sub(row.times.begins)),
            engine_us: us(row.times.last_beat.saturating_sub(row.times.last_code)),
            end_to_end_us: us(row.times.last_beat.saturating_sub(row.times.begins)),
        };
        Some(ScanReport {
            scene: model.scene.name.clone(),
            converter: model.scene.hardware.adc_scan?.converter.name,
            equal: findings.is_equal(),
            runs: verified.runs.clone(),
            scan_cycles: timing.scan,
            period_cycles: timing.period,
            frames: verified.rows.iter().map(row).collect(),
            mismatches: findings.count,
            first_mismatches: findings.kept.clone(),
        })
    }
}

/// A row per frame, then times and equality.
pub fn scan(verified: &VerifiedScan) -> String {
    let Some(report) = ScanReport::new(verified) else { return String::new() };
    let head = [
        "frame",
        "fx N",
        "fy N",
        "fz N",
        "flags",
        "hardware = model",
        "scan µs",
        "engine µs",
        "first sample to last beat µs",
    ];
    let rows = report.frames.iter().map(|row| {
        let flags: Vec<&str> = row.flags.iter().map(|flag| flag.name()).collect();
        let forces = row.resultant_N.map(|force| format!("{force:.3}"));
        let times = [row.scan_us, row.engine_us, row.end_to_end_us].map(|us| format!("{us:.2}"));
        let equal = if row.equal { "yes" } else { "NO" }.to_owned();
        [vec![row.frame.clone()], forces.to_vec(), vec![flags.join(" "), equal], times.to_vec()].concat()
    });
    let mut text = markdown(&head, rows.collect());
    let us = |cycles: u64| cycles as f64 / verified.model.board.clock_MHz;
    let longest = report.frames.iter().map(|row| row.end_to_end_us).fold(0.0, f64::max);
    text.push_str(&format!("\nruns: {}\n", report.runs.join("; ")));
    text.push_str(&format!(
        "scan of {} cycles, {:.2} µs, every {:.2} µs: {:.0} frames/s\n",
        report.scan_cycles,
        us(report.scan_cycles),
        us(report.period_cycles),
        1e6 / us(report.period_cycles)
    ));
    text.push_str(&format!(
        "first sample to last beat at most {longest:.2} µs: {:.2} µs to {BUDGET_US} µs\n",
        BUDGET_US as f64 - longest
    ));
    text.push_str(&match report.equal {
        true => "equal to the bit-true model to the bit: every code, every beat; no time of the converter is broken\n"
            .to_owned(),
        false => differences(&verified.findings),
    });
    text
}
