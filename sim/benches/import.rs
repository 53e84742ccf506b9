//! Time of `dermis import`: 20 000 frames of 16×16 taxels, a line each, into one recording.
//!
//! ```text
//! make bench, or: cargo bench --package dermis-sim --bench import
//! ```
//! It takes at most [`MOST`].

use std::fmt::Write;
use std::process::Command;
use std::time::{Duration, Instant};

use anyhow::ensure;

/// Lines of the file.
const FRAMES: usize = 20_000;
/// Rows and columns.
const SIZE: usize = 16;
/// Largest time.
const MOST: Duration = Duration::from_secs(3);

/// A press that grows and moves along the columns, in kPa.
fn text() -> String {
    let mut text = String::new();
    for frame in 0..FRAMES {
        let along = SIZE as f64 * frame as f64 / FRAMES as f64;
        for taxel in 0..SIZE * SIZE {
            let [y, x] = [taxel / SIZE, taxel % SIZE].map(|at| at as f64);
            let stress = 90.0 * (-((x - along).powi(2) + (y - 7.0).powi(2)) / 6.0).exp();
            let end = if taxel + 1 == SIZE * SIZE { "\n" } else { "," };
            // Writing to a String cannot fail.
            let _ = write!(text, "{stress:.2}{end}");
        }
    }
    text
}

fn main() -> anyhow::Result<()> {
    let folder = tempfile::tempdir()?;
    std::fs::write(folder.path().join("log.csv"), text())?;
    let options = ["import", "log.csv", "--size", "16x16", "--units", "kPa", "--pitch", "5,5"];
    let begun = Instant::now();
    let output = Command::new(env!("CARGO_BIN_EXE_dermis")).current_dir(folder.path()).args(options).output()?;
    let took = begun.elapsed();
    ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let printed = String::from_utf8_lossy(&output.stdout);
    ensure!(printed.contains(&format!("frames          {FRAMES} of {FRAMES}")), "{printed}");
    println!("import of {FRAMES} frames of {SIZE}×{SIZE} taxels: {:.2} s", took.as_secs_f64());
    ensure!(took <= MOST, "the import takes {took:?}, more than {MOST:?}");
    Ok(())
}
