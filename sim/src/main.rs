//! The `dermis` program: calls [`dermis_sim::commands`].
use std::process::ExitCode;

fn main() -> ExitCode {
    dermis_sim::commands::main()
}
