//! `dermis converters`: the converters that a scene can scan its array with.

use anyhow::Result;
use clap::Args;

use dermis_report as report;

/// Arguments of `dermis converters`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis converters                                  their interface and its times

A scene names one in [hardware.adc_scan]: `docs/architecture/scan.md`.")]
pub struct Arguments {}

/// Runs the command.
///
/// # Errors
/// None.
pub fn run(_: &Arguments) -> Result<String> {
    Ok(report::converters())
}
