//! Run time of one frame in kernel simulation and under Verilator, and their ratio.
//!
//! ```text
//! make bench, or: cargo bench --package dermis-sim --bench simulators
//! sensor-1: kernel 149.63 ms, verilator 3.23 ms, ratio 46.32    fastest of several runs each
//! ```
//! The ratio is compared across versions, because it depends less on the machine. With every block written twice, by hand,
//! it is 17.98 for sensor-1 and 27.27 for eight-by-eight (two cores, Verilator 5.006); with one kernel per block 46.32 and
//! 46.92. At most three times the first figures is wanted.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use dermis_cosim::drive::{record, InputFrame, Stimulus};
use dermis_cosim::hardware::Hardware;
use dermis_cosim::simulator::Simulator;
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Scene;

/// Runs of each simulator, of which the fastest counts.
const RUNS: usize = 20;
/// Cycles without a transfer after which a run has failed.
const WATCHDOG: u64 = 100_000;

/// Fastest of [`RUNS`] runs of one frame at full speed, without building or starting the simulator.
fn fastest(hardware: &Hardware, simulator: Simulator, frame: &Frame) -> anyhow::Result<Duration> {
    let vector = hardware.vector(std::slice::from_ref(frame))?;
    let beats = vector.expected.beats.len() + vector.expected.status.len();
    let input = [InputFrame { codes: &vector.codes, taxels: vector.taxels, beats, array: 0 }];
    let mut device = hardware.device(simulator)?;
    let mut best = Duration::MAX;
    for _ in 0..RUNS {
        let begin = Instant::now();
        let recording = record(device.as_mut(), hardware.taps(simulator).len(), &input, Stimulus::FullSpeed, WATCHDOG);
        best = best.min(begin.elapsed());
        assert_eq!(recording.beats.len(), beats, "{}", simulator.name());
    }
    Ok(best)
}

fn main() -> anyhow::Result<()> {
    let build = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    for name in ["sensor-1", "eight-by-eight"] {
        let scene = Scene::builtin(name)?;
        let frame = &Frame::shipped(&scene)[0];
        let hardware = Hardware::new(Model::new(&scene)?, &build)?;
        let [ours, verilator] = [Simulator::Kernel, Simulator::Verilator].map(|s| fastest(&hardware, s, frame));
        let (ours, verilator) = (ours?, verilator?);
        println!(
            "{name}: kernel {:.2} ms, verilator {:.2} ms, ratio {:.2}",
            1e3 * ours.as_secs_f64(),
            1e3 * verilator.as_secs_f64(),
            ours.as_secs_f64() / verilator.as_secs_f64()
        );
    }
    Ok(())
}
