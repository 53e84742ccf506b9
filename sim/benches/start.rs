//! Time and memory of `dermis reconstruct` from its start to the forces of one frame, with the estimator that a new scene takes.
//!
//! ```text
//! make bench, or: cargo bench --package dermis-sim --bench start
//! ```
//! The fastest of several starts, each in a folder without caches, takes at most what [`ARRAYS`] says, in [`MOST_MB`].

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{ensure, Context};

/// Rows and columns of an array, and the largest time.
const ARRAYS: [(usize, Duration); 2] = [(20, Duration::from_millis(100)), (48, Duration::from_millis(500))];
/// Most memory of the program in MB.
const MOST_MB: f64 = 500.0;
/// Starts of which the fastest counts.
const STARTS: usize = 5;

/// The program with these arguments in `folder`.
fn dermis(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dermis"));
    command.current_dir(folder).args(arguments).stdout(Stdio::null());
    command
}

/// Most memory of a running program in MB, asked until it ends; 0 where the system does not say.
fn most_memory(child: &mut Child) -> anyhow::Result<f64> {
    let status = format!("/proc/{}/status", child.id());
    let mut most = 0.0f64;
    while child.try_wait()?.is_none() {
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kilobytes = line.and_then(|own| own.split_whitespace().next()?.parse::<f64>().ok());
        most = most.max(kilobytes.unwrap_or_default() / 1e3);
    }
    Ok(most)
}

fn main() -> anyhow::Result<()> {
    for (size, most) in ARRAYS {
        let folder = tempfile::tempdir()?;
        let pad = format!(
            "name = \"pad\"\n[sensor]\nrows = {size}\ncols = {size}\npitch_x_mm = 2.0\npitch_y_mm = 2.0\nthickness_mm = 3.0\n"
        );
        std::fs::write(folder.path().join("pad.toml"), pad)?;
        let drawn =
            dermis(folder.path(), &["generate", "pad.toml", "--random", "1", "--out", "frame.json"]).status()?;
        ensure!(drawn.success(), "dermis generate: {drawn}");
        let (mut fastest, mut memory) = (Duration::MAX, 0.0f64);
        for start in 0..STARTS {
            let build = format!("build-{start}");
            let arguments = ["--build-dir", &build, "reconstruct", "pad.toml", "--frame", "frame.json", "--json"];
            let begun = Instant::now();
            let ended = dermis(folder.path(), &arguments).status()?;
            fastest = fastest.min(begun.elapsed());
            ensure!(ended.success(), "dermis reconstruct: {ended}");
            // A start of its own, because the questions take time.
            let mut child = dermis(folder.path(), &arguments).spawn().context("dermis reconstruct")?;
            memory = memory.max(most_memory(&mut child)?);
        }
        println!("start, {size}×{size}: first forces after {:.3} s, {memory:.0} MB", fastest.as_secs_f64());
        ensure!(fastest <= most, "{size}×{size}: the first forces take {fastest:?}, more than {most:?}");
        ensure!(memory <= MOST_MB, "{size}×{size}: {memory:.0} MB, more than {MOST_MB}");
    }
    Ok(())
}
