//! Time of a frame in the Python package against the same call in Rust, on one core each.
//!
//! ```text
//! make bench, which installs the package into an environment and names its interpreter in DERMIS_PYTHON
//! ```
//! A call from Python must take at most [`MOST`] times as long.

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use anyhow::{anyhow, ensure, Context, Result};
use dermis_golden::data::frame::Frame;
use dermis_golden::estimate::float::Golden;
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Scene;

/// Largest time of a call from Python over that of the same call in Rust.
const MOST: f64 = 1.2;
/// Rounds of both, one after the other, so that a change of the processor's clock meets both.
const ROUNDS: usize = 5;
/// Calls in a round.
const CALLS: u32 = 40;
/// Prints the shortest time of a call in Python.
const SCRIPT: &str = "benches/time_of_a_frame.py";

/// The scene of sensor 1 with an estimator.
fn text(estimator: &str) -> String {
    format!(
        "name = \"sensor-1\"\n[sensor]\nrows = 10\ncols = 10\npitch_x_mm = 2.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n\
         [search]\nestimator = \"{estimator}\"\n"
    )
}

/// Seconds of the fastest call.
fn fastest(mut call: impl FnMut() -> Result<()>) -> Result<f64> {
    let mut best = f64::INFINITY;
    for _ in 0..CALLS {
        let begin = Instant::now();
        call()?;
        best = best.min(begin.elapsed().as_secs_f64());
    }
    Ok(best)
}

/// Seconds of the fastest call in Python.
fn in_python(python: &str, scene: &str, engine: &str) -> Result<f64> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join(SCRIPT);
    let mut command = Command::new(python);
    command.arg(script).args([scene, engine, &CALLS.to_string()]).env("RAYON_NUM_THREADS", "1");
    let output = command.output().with_context(|| format!("DERMIS_PYTHON={python}"))?;
    ensure!(output.status.success(), "{python}: {}", String::from_utf8_lossy(&output.stderr));
    Ok(String::from_utf8(output.stdout)?.trim().parse()?)
}

fn main() -> Result<()> {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global()?;
    let python =
        std::env::var("DERMIS_PYTHON").map_err(|_| anyhow!("DERMIS_PYTHON: run `make bench`, which sets it"))?;
    let mut slow = Vec::new();
    for (estimator, engine) in [("search", "golden"), ("evidence", "golden"), ("search", "fixed")] {
        let text = text(estimator);
        let scene = Scene::parse(&text, "sensor-1")?;
        let shipped = Frame::shipped(&scene).remove(0);
        // As from an array: without known forces.
        let frame = Frame::from_stress("frame", &scene.sensor, shipped.stress_MPa)?;
        let (golden, model) = (Golden::new(&scene)?, Model::new(&scene)?);
        let (mut rust, mut from_python) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..ROUNDS {
            let call = || match engine {
                "golden" => Ok(golden.run(&frame).map(drop)?),
                _ => Ok(model.reconstruct(&frame).map(drop)?),
            };
            rust = rust.min(fastest(call)?);
            from_python = from_python.min(in_python(&python, &text, engine)?);
        }
        let ratio = from_python / rust;
        let [rust, from_python] = [rust, from_python].map(|seconds| 1e6 * seconds);
        println!(
            "sensor-1, Python: {engine} {estimator} {from_python:.0} µs a frame, in Rust {rust:.0} µs, ratio {ratio:.2}"
        );
        if ratio > MOST {
            slow.push(format!("{engine} {estimator}: {ratio:.2}"));
        }
    }
    ensure!(slow.is_empty(), "a call from Python takes more than {MOST} times as long: {}", slow.join(", "));
    Ok(())
}
