//! `dermis registers`: the register map of a core.

use anyhow::Result;
use clap::{Args, ValueEnum};
use dermis_golden::wire::registers::{c_header, system_rdl, REGISTERS};

use dermis_report as report;

/// Arguments of `dermis registers`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis registers                                   the registers and their fields
  dermis registers --format c >dermis_registers.h

`dermis build SCENE --bus axi` writes header, JSON and SystemRDL beside the Verilog.")]
pub struct Arguments {
    /// Format of the map.
    #[arg(long, value_enum, default_value = "markdown")]
    format: Format,
}

#[derive(ValueEnum, Clone, Copy, Debug)]
enum Format {
    /// Aligned Markdown table.
    Markdown,
    /// JSON.
    Json,
    /// C header.
    C,
    /// SystemRDL 2.0.
    Rdl,
}

/// Runs the command.
///
/// # Errors
/// None.
pub fn run(arguments: &Arguments) -> Result<String> {
    Ok(match arguments.format {
        Format::Markdown => report::registers(),
        Format::Json => serde_json::to_string(&REGISTERS)? + "\n",
        Format::C => c_header(),
        Format::Rdl => system_rdl(),
    })
}
