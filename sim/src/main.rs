//! The `dermis` program: calls [`dermis_sim::cli`].
use std::process::ExitCode;

fn main() -> ExitCode {
    dermis_sim::cli::main()
}
