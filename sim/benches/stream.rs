//! Rate of `dermis reconstruct --stream`: lines of CSV in, lines of JSON out, in memory, all arithmetic on one core.
//!
//! ```text
//! make bench, or: cargo bench --package dermis-sim --bench stream
//! ```
//! Without a cross-check the estimator `search` must answer at least [`LEAST`] frames of 10×10 taxels per second; the scene's own takes longer.

use std::io::{Cursor, Read};
use std::path::Path;
use std::time::Instant;

use anyhow::ensure;
use dermis_golden::data::frame::Frame;
use dermis_golden::data::text::Stated;
use dermis_golden::engine::CheckPace;
use dermis_golden::spec::scene::{EstimatorKind, Scene};
use dermis_host::engine::EngineName;
use dermis_host::stream::{as_lines, run, Estimators, Policy, StreamOptions};

/// Least rate of the search, in frames per second.
const LEAST: f64 = 2000.0;

fn rate(scene: &Scene, name: EngineName, frames: usize) -> anyhow::Result<f64> {
    let engine = name.engine(scene, None, Path::new(""))?;
    let shipped = Frame::shipped(scene);
    let line = |frame: &Frame| frame.stress_MPa.iter().map(f64::to_string).collect::<Vec<_>>().join(",") + "\n";
    let text: String = shipped.iter().cycle().take(frames).map(line).collect();
    let input: Box<dyn Read + Send> = Box::new(Cursor::new(text.into_bytes()));
    let options = StreamOptions { queue: 64, policy: Policy::All, live: false, layout: Stated::default() };
    let begin = Instant::now();
    let counts = run(
        Estimators::only(&*engine, CheckPace::Never),
        (input, "memory"),
        options,
        &mut as_lines(&mut std::io::sink(), false),
    )?;
    ensure!(counts.answered == frames as u64, "{counts:?}");
    Ok(frames as f64 / begin.elapsed().as_secs_f64())
}

fn main() -> anyhow::Result<()> {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global()?;
    let scene = Scene::builtin("sensor-1")?;
    let searching = scene.estimated_by(EstimatorKind::Search);
    let search = rate(&searching, EngineName::Golden, 4000)?;
    println!("sensor-1, stream: golden search {search:.0} frames/s");
    println!("sensor-1, stream: fixed search {:.0} frames/s", rate(&searching, EngineName::Fixed, 400)?);
    println!(
        "sensor-1, stream: golden {} {:.0} frames/s",
        scene.model_estimator().name(),
        rate(&scene, EngineName::Golden, 100)?
    );
    ensure!(search >= LEAST, "the search answers {search:.0} frames/s, less than {LEAST}");
    Ok(())
}
