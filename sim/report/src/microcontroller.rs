//! C for microcontrollers: what it needs, and what cores did with it.

use super::table::markdown;
use dermis_flow::microcontroller::target::{CoreRun, Measured};
use dermis_flow::microcontroller::{CSource, Needs};

/// One line on what the C of a scene needs, whatever the core.
pub fn microcontroller_needs(needs: &Needs) -> String {
    let kilobytes = |bytes: usize| format!("{:.1} kB", bytes as f64 / 1e3);
    format!(
        "{} multiplications a frame, {} of coefficients in flash, {} of memory",
        needs.products,
        kilobytes(needs.coefficient_bytes),
        kilobytes(needs.memory_bytes()),
    )
}

/// A table of the cores that ran a source, equal to the bit-true model.
pub fn microcontrollers(source: &CSource, measured: &Measured) -> String {
    let needs = microcontroller_needs(&source.needs);
    let runs = match measured {
        Measured::Runs(runs) => runs,
        Measured::Not(reason) => return format!("{needs}\nnot measured: {reason}\n"),
    };
    let row = |run: &CoreRun| {
        let clock = run.core.clock_MHz;
        vec![
            run.core.name.to_owned(),
            run.instructions.to_string(),
            format!("{:.2} at {clock} MHz", run.instructions as f64 / clock / 1e3),
            run.flash_bytes.to_string(),
            source.needs.memory_bytes().to_string(),
            run.stack_bytes.to_string(),
        ]
    };
    let head = ["core", "instructions a frame", "ms, one a cycle", "flash bytes", "memory bytes", "stack bytes"];
    let table = markdown(&head, runs.iter().map(row).collect());
    let frames = source.readings.len();
    format!("{needs}\n\n{table}\nevery word of {frames} frames is that of the bit-true model\n")
}
