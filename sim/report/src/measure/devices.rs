//! Time and energy of a frame, by estimator and by what computes it: a core of this machine, a microcontroller, an FPGA.
//!
//! ```text
//! scene ─┬─ literal Eq. 1, NumPy and SciPy, floating point, bit-true ── this CPU, idle and under load ─┐
//!        ├─ C of the bit-true engine ── instructions on Cortex-M7 and M4 ──────────────────────────────┼─> time, jitter, energy
//!        └─ hardware ── cycles over the clock of place and route, power of the simulated registers ────┘
//! ```
//!
//! | figure | CPU | microcontroller | FPGA |
//! |---|---|---|---|
//! | median | of the frames, nothing else running that this program knows of | most instructions of a frame, one per cycle | of the frames |
//! | most | 99.9 % of the frames are below, while a thread per core computes something else | none: waits for the flash are not counted | longest frame that there is |
//! | jitter | most less median | none | longest less shortest of the frames |
//! | energy | [`CORE_W`] times the median | [`Core::power_W`] times the median, asleep for the rest | [`estimate_power`], with static and clock |

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::thread::{available_parallelism, JoinHandle};
use std::time::Instant;

use anyhow::{ensure, Context, Result};
use dermis_golden::data::frame::Frame;
use dermis_golden::data::generator::converter::Converter;
use dermis_golden::data::generator::draws::{DrawOptions, Draws};
use dermis_golden::data::generator::presses::{Motion, Press};
use dermis_golden::engine::{Engine, State};
use dermis_golden::estimate::float::objective::EPSILON;
use dermis_golden::estimate::float::Golden;
use dermis_golden::fixed::plan::interval::frame_interval;
use dermis_golden::fixed::{Cycles, Model};
use dermis_golden::physics::matrices::Matrices;
use dermis_golden::spec::partition::Case;
use dermis_golden::spec::scene::{EstimatorKind, Scene};
use dermis_study::baseline::Baseline;
use serde::{Deserialize, Serialize};

use super::clock::clock;
use dermis_cosim::hardware::Hardware;
use dermis_cosim::power::{energies, estimate_power};
use dermis_flow::microcontroller;
use dermis_flow::microcontroller::target::{measure_all, Core, CoreRun, Measured};
use dermis_flow::progress::Progress;
use dermis_golden::quantile::{median, quantile};

/// Power of a core of a desktop computer that computes, W: no source measured the machine at hand, whose core may take less or more.
pub const CORE_W: [f64; 2] = [5.0, 20.0];
/// Noise of the frames over their largest stress, which no scene states.
const NOISE: f64 = 2e-3;
/// Unrelated frames; more of them are these again.
const DRAWN: usize = 200;
/// Frames of which the power of an FPGA and the instructions of a microcontroller are counted.
const COUNTED: usize = 2;
/// Share of the frames that are below the second time.
const MOST: f64 = 0.999;
/// Time between the frames of a tactile array, s.
const PERIOD_S: f64 = 1e-3;
/// The program that solves frames with NumPy and SciPy.
const SCIPY: &str = include_str!("scipy_frame.py");

/// Frames of each row of a CPU where nothing else is asked for.
pub const DEVICE_FRAMES: u32 = 1000;

/// Options of the measurement.
#[derive(Clone, Debug)]
pub struct DeviceOptions {
    /// Frames of each row of a CPU, at least one.
    pub frames: usize,
    /// Interpreter with NumPy and SciPy; `None`: no row of them.
    pub python: Option<PathBuf>,
    /// Whether the hardware is simulated for its power.
    pub power: bool,
    /// Folder for build products and caches.
    pub build: PathBuf,
}

/// One estimator on one device.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DeviceRow {
    /// Name of the scene.
    pub scene: String,
    /// What computes: literal Eq. 1, or the name of the estimator.
    pub estimator: String,
    /// Where, and in which numbers.
    pub device: String,
    /// Frames that were measured.
    pub frames: usize,
    /// Median time of a frame, s.
    pub median_s: f64,
    /// Time that most frames do not exceed, s.
    pub most_s: Option<f64>,
    /// What the time of a frame varies by, s.
    pub jitter_s: Option<f64>,
    /// Median over that of the search in floating point, or of the scene's own estimator, in the same run.
    pub ratio: Option<f64>,
    /// Arrays of 1000 frames per second that there is time for.
    pub arrays: u64,
    /// Energy of a frame of one array of 1000 frames per second, µJ: lower and upper estimate.
    pub one_array_uJ: Option<[f64; 2]>,
    /// The same of as many arrays as there is time for.
    pub all_arrays_uJ: Option<[f64; 2]>,
}

/// What is measured of a scene, and what could not be.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Devices {
    /// A row for each estimator and device.
    pub rows: Vec<DeviceRow>,
    /// Why a row or an energy is missing.
    pub notes: Vec<String>,
}

/// Measures scenes, one after the other.
///
/// # Errors
/// A scene that cannot be drawn on or is refused, an interpreter that fails, a simulation that fails.
pub fn devices(scenes: &[Scene], options: &DeviceOptions) -> Result<Devices> {
    let mut all = Devices::default();
    for scene in scenes {
        let mut of_scene = Devices::default();
        let model = Model::new(scene)?;
        let frames = unrelated(scene)?;
        on_cpu(&model, &frames, options, &mut of_scene)?;
        let base =
            of_scene.rows.iter().find(|row| row.device == FLOAT && row.estimator == scene.hardware_estimator().name());
        if let Some(base) = base.map(|row| row.median_s) {
            of_scene.rows.iter_mut().for_each(|row| row.ratio = Some(row.median_s / base));
        }
        on_microcontrollers(&model, &frames[..COUNTED], &mut of_scene)?;
        on_fpga(&model, &frames[..COUNTED], options, &mut of_scene)?;
        all.rows.extend(of_scene.rows);
        all.notes.extend(of_scene.notes);
    }
    Ok(all)
}

/// What the rows of floating point say of their device.
const FLOAT: &str = "CPU, floating point";

/// Frames of drawn contacts that have nothing in common.
fn unrelated(scene: &Scene) -> Result<Vec<Frame>> {
    let draws = Draws::new(scene, DrawOptions::default())?;
    let draw = |number: u64| -> Result<Frame> {
        Ok(draws.frame(number)?.read(&Converter { noise: NOISE, seed: number, ..Converter::default() })?)
    };
    (0..DRAWN as u64).map(draw).collect()
}

/// The rows of this CPU.
fn on_cpu(model: &Model, frames: &[Frame], options: &DeviceOptions, to: &mut Devices) -> Result<()> {
    let scene = &model.scene;
    let ordered = Press::new(Motion::Slide).of_frames(options.frames, NOISE).frames(scene, 1)?;
    let mut row = |estimator: String, device: &str, run: &mut dyn FnMut(usize) -> Result<()>| -> Result<()> {
        let _progress = Progress::start(&format!("{}: {estimator}, {device}", scene.name));
        to.rows.push(cpu_row(scene, estimator, device, options.frames, run)?);
        Ok(())
    };
    let hardware = scene.hardware_estimator();
    // Eq. 1 as printed is of one subarray.
    let is_literal = hardware == EstimatorKind::Search && scene.partition.case == Case::WHOLE;
    let literal = is_literal.then(|| Baseline::new(scene)).transpose()?;
    if let Some(literal) = &literal {
        row("Eq. 1, literal".into(), FLOAT, &mut |k| Ok(literal.run(&frames[k % DRAWN]).map(drop)?))?;
    }
    let golden = Golden::reference(scene)?;
    row(hardware.name().into(), FLOAT, &mut |k| Ok(golden.run(&frames[k % DRAWN]).map(drop)?))?;
    let own = match hardware {
        EstimatorKind::Search => Golden::with(scene, EstimatorKind::Evidence)?,
        _ => Golden::new(scene)?,
    };
    let name = Engine::estimator(&own).name();
    row(format!("{name}, unrelated frames"), FLOAT, &mut |k| Ok(own.run(&frames[k % DRAWN]).map(drop)?))?;
    let mut state = State::default();
    row(format!("{name}, frames in order"), FLOAT, &mut |k| {
        if k == 0 {
            state = State::default();
        }
        Ok(own.reconstruct_after(&mut state, &ordered[k..=k]).map(drop)?)
    })?;
    row(hardware.name().into(), "CPU, bit-true integers", &mut |k| {
        Ok(model.reconstruct(&frames[k % DRAWN]).map(drop)?)
    })?;
    if let (Some(python), Some(literal), Some(matrices)) = (&options.python, &literal, golden.matrices()) {
        to.rows.push(with_scipy(scene, &frames[..options.frames.min(DRAWN)], literal, matrices, python)?);
    }
    Ok(())
}

/// Times of a frame on this CPU, alone and then under load.
fn cpu_row(
    scene: &Scene,
    estimator: String,
    device: &str,
    frames: usize,
    run: &mut dyn FnMut(usize) -> Result<()>,
) -> Result<DeviceRow> {
    let mut times = || -> Result<Vec<f64>> {
        let one = |k| {
            let begin = Instant::now();
            run(k)?;
            Ok(begin.elapsed().as_secs_f64())
        };
        (0..frames).map(one).collect()
    };
    let idle = median(times()?).unwrap_or(f64::NAN);
    let load = Load::start();
    let loaded = times();
    drop(load);
    Ok(on_this_cpu(scene, estimator, device, frames, idle, quantile(loaded?, MOST)))
}

fn on_this_cpu(
    scene: &Scene,
    estimator: String,
    device: &str,
    frames: usize,
    median_s: f64,
    most_s: Option<f64>,
) -> DeviceRow {
    let row = DeviceRow::of_core(scene, estimator, device.to_owned(), frames, median_s, CORE_W);
    DeviceRow { most_s, jitter_s: most_s.map(|most| (most - median_s).max(0.0)), ..row }
}

impl DeviceRow {
    /// The row of a core that takes power while it computes: the energy of a frame does not depend on the number of arrays.
    fn of_core(
        scene: &Scene,
        estimator: String,
        device: String,
        frames: usize,
        median_s: f64,
        power_W: [f64; 2],
    ) -> DeviceRow {
        let energy = Some(power_W.map(|power| 1e6 * power * median_s));
        DeviceRow {
            scene: scene.name.clone(),
            estimator,
            device,
            frames,
            median_s,
            most_s: None,
            jitter_s: None,
            ratio: None,
            arrays: arrays(median_s),
            one_array_uJ: energy,
            all_arrays_uJ: energy,
        }
    }
}

/// Arrays of 1000 frames per second for which there is time.
fn arrays(seconds: f64) -> u64 {
    (PERIOD_S / seconds).floor() as u64
}

/// A thread per core that computes until this is dropped.
struct Load {
    ends: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Load {
    fn start() -> Load {
        let ends = Arc::new(AtomicBool::new(false));
        let thread = |_| {
            let ends = Arc::clone(&ends);
            std::thread::spawn(move || {
                while !ends.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            })
        };
        let threads = (0..available_parallelism().map_or(1, usize::from)).map(thread).collect();
        Load { ends, threads }
    }
}

impl Drop for Load {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            // A thread that only waits does not panic.
            let _ = thread.join();
        }
    }
}

/// A frame as the program with SciPy solved it.
#[derive(Deserialize)]
struct Solved {
    seconds: f64,
    resultant_N: [f64; 3],
}

/// The row of NumPy and SciPy. Their forces are compared with those of the literal Eq. 1, so that the times are of the same problem.
fn with_scipy(
    scene: &Scene,
    frames: &[Frame],
    literal: &Baseline,
    matrices: &Matrices,
    python: &Path,
) -> Result<DeviceRow> {
    let _progress = Progress::start(&format!("{}: NumPy and SciPy", scene.name));
    let n = matrices.cz.nrows();
    let columns = [&matrices.cx, &matrices.cy, &matrices.cz];
    let row =
        |i: usize| columns.iter().flat_map(move |column| (0..n).map(move |j| column[(i, j)])).collect::<Vec<f64>>();
    let stress: Vec<&Vec<f64>> = frames.iter().map(|frame| &frame.stress_MPa).collect();
    let input = serde_json::json!({ "C": (0..n).map(row).collect::<Vec<_>>(), "frames": stress }).to_string();
    let solve = || {
        let mut command = Command::new(python);
        command.arg("-c").arg(SCIPY).args([scene.search.mu_max.to_string(), EPSILON.to_string()]);
        // As every row: one core.
        command.env("OPENBLAS_NUM_THREADS", "1").env("OMP_NUM_THREADS", "1");
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().with_context(|| python.display().to_string())?;
        // It reads all of it before it prints. One that cannot begin says why; that it did not read is then no error of its own.
        let written = child.stdin.take().map_or(Ok(()), |mut pipe| pipe.write_all(input.as_bytes()));
        let output = child.wait_with_output()?;
        let error = String::from_utf8_lossy(&output.stderr);
        ensure!(output.status.success(), "{}: {}", python.display(), error.trim());
        written.with_context(|| python.display().to_string())?;
        let solved: Vec<Solved> =
            serde_json::from_slice(&output.stdout).with_context(|| python.display().to_string())?;
        let count = solved.len();
        ensure!(count == frames.len(), "{}: {count} of {} frames", python.display(), frames.len());
        Ok(solved)
    };
    let idle = solve()?;
    let mut apart = Vec::with_capacity(frames.len());
    for (frame, solved) in frames.iter().zip(&idle) {
        let (ours, theirs) = (literal.run(frame)?.resultant(), solved.resultant_N);
        let length = |of: [f64; 3]| of.iter().map(|f| f * f).sum::<f64>().sqrt();
        apart.push(length(std::array::from_fn(|k| ours[k] - theirs[k])) / length(ours));
    }
    let apart = median(apart).unwrap_or_default();
    ensure!(apart <= SAME, "{}: the forces of SciPy are {apart:.3} of their size off those of Eq. 1", python.display());
    let load = Load::start();
    let loaded = solve();
    drop(load);
    let times = |solved: Vec<Solved>| solved.into_iter().map(|solved| solved.seconds).collect::<Vec<f64>>();
    let median_s = median(times(idle)).unwrap_or(f64::NAN);
    let estimator = "Eq. 1, NumPy and SciPy".to_owned();
    Ok(on_this_cpu(scene, estimator, FLOAT, frames.len(), median_s, quantile(times(loaded?), MOST)))
}

/// Most that the resultants of two simplex searches of the same problem may differ by, over their size, median of the frames: with
/// noise Π has several maxima, and one of them may be found in place of another.
const SAME: f64 = 0.01;

/// The rows of the microcontrollers.
fn on_microcontrollers(model: &Model, frames: &[Frame], to: &mut Devices) -> Result<()> {
    let scene = &model.scene;
    let _progress = Progress::start(&format!("{}: microcontrollers", scene.name));
    let source = match microcontroller::generate(model, frames) {
        Ok(source) => source,
        Err(error) => {
            to.notes.push(format!("{}: no C: {error}", scene.name));
            return Ok(());
        }
    };
    let runs = match measure_all(model, &source)? {
        Measured::Runs(runs) => runs,
        Measured::Not(reason) => {
            to.notes.push(format!("{}: no microcontroller: {reason}", scene.name));
            return Ok(());
        }
    };
    let row = |CoreRun { core, instructions, .. }: CoreRun| {
        let Core { name, clock_MHz, power_W, .. } = core;
        let median_s = instructions as f64 / (1e6 * clock_MHz);
        let (estimator, device) = (model.estimator().name().to_owned(), format!("{name}, {clock_MHz} MHz, C"));
        DeviceRow::of_core(scene, estimator, device, frames.len(), median_s, power_W)
    };
    to.rows.extend(runs.into_iter().map(row));
    Ok(())
}

/// The row of the hardware.
fn on_fpga(model: &Model, frames: &[Frame], options: &DeviceOptions, to: &mut Devices) -> Result<()> {
    let (scene, board) = (&model.scene, &model.board);
    let clock = clock(board, scene);
    let cycles = frames.iter().map(|frame| Ok(model.run(&model.readings(std::slice::from_ref(frame))?).cycles.total));
    let cycles = cycles.collect::<Result<Vec<u64>>>()?;
    let longest = Cycles::longest(model).total;
    let shortest = cycles.iter().copied().min().unwrap_or(longest);
    let interval = model.cases().iter().map(|case| frame_interval(model, case)).max().unwrap_or(longest);
    let mut energy = [None; 2];
    match energies(board) {
        _ if !options.power => (),
        Err(error) => to.notes.push(format!("{}: no energy: {error}", scene.name)),
        Ok(_) => {
            let _progress = Progress::start(&format!("{}: power", scene.name));
            let rates = estimate_power(&Hardware::new(model.clone(), &options.build)?, frames)?.rates;
            energy = [rates.first(), rates.last()].map(|rate| rate.map(|rate| rate.frame_uJ));
        }
    }
    to.rows.push(DeviceRow {
        scene: scene.name.clone(),
        estimator: model.estimator().name().to_owned(),
        device: format!("{}, {} MHz", board.device.as_deref().unwrap_or(&board.name), clock.MHz),
        frames: frames.len(),
        median_s: clock
            .seconds(median(cycles.iter().map(|&own| own as f64).collect()).map_or(longest, |own| own as u64)),
        most_s: Some(clock.seconds(longest)),
        jitter_s: Some(clock.seconds(longest - shortest.min(longest))),
        ratio: None,
        arrays: arrays(clock.seconds(interval)),
        one_array_uJ: energy[0],
        all_arrays_uJ: energy[1],
    });
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    #[test]
    fn every_device_has_a_row() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let options = DeviceOptions { frames: 3, python: None, power: false, build: PathBuf::new() };
        let Devices { rows, notes } = devices(std::slice::from_ref(&scene), &options).unwrap();
        assert_eq!(notes, [""; 0]);
        let names: Vec<String> = rows.iter().map(|row| format!("{} / {}", row.estimator, row.device)).collect();
        let expected = [
            "Eq. 1, literal / CPU, floating point",
            "search / CPU, floating point",
            "evidence, unrelated frames / CPU, floating point",
            "evidence, frames in order / CPU, floating point",
            "search / CPU, bit-true integers",
            "search / Cortex-M7, 480 MHz, C",
            "search / Cortex-M4, 168 MHz, C",
        ];
        assert_eq!(names[..7], expected);
        let hardware = &rows[7];
        let model = Model::new(&scene).unwrap();
        let clock = clock(&model.board, &scene);
        assert_eq!(hardware.most_s, Some(clock.seconds(Cycles::longest(&model).total)));
        // A search takes the same cycles for every frame, and frames overlap.
        assert_eq!((hardware.jitter_s, Some(hardware.median_s)), (Some(0.0), hardware.most_s));
        assert!(hardware.arrays as f64 > PERIOD_S / hardware.median_s, "{hardware:?}");
        assert_eq!(rows[1].ratio, Some(1.0));
        for row in &rows[..7] {
            let [lower, upper] = row.one_array_uJ.unwrap();
            assert!(
                row.median_s > 0.0 && 0.0 < lower && lower < upper && row.arrays == arrays(row.median_s),
                "{row:?}"
            );
        }
    }

    /// A program in place of Python that prints `text`.
    fn interpreter(folder: &Path, text: &str) -> PathBuf {
        let path = folder.join("python");
        fs::write(&path, format!("#!/bin/sh\ncat >/dev/null\n{text}\n")).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
        path
    }

    #[test]
    fn forces_of_another_problem_are_refused() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let folder = tempfile::tempdir().unwrap();
        let frames = &unrelated(&scene).unwrap()[..1];
        let (literal, golden) = (Baseline::new(&scene).unwrap(), Golden::reference(&scene).unwrap());
        let result = |text: &str| {
            let python = interpreter(folder.path(), text);
            with_scipy(&scene, frames, &literal, golden.matrices().unwrap(), &python)
                .map_err(|error| format!("{error:#}"))
        };
        let [x, y, z] = literal.run(&frames[0]).unwrap().resultant();
        let own = |share: f64| {
            format!("echo '[{{\"seconds\": 0.5, \"resultant_N\": [{}, {}, {}]}}]'", share * x, share * y, share * z)
        };
        assert_eq!(result(&own(1.0)).unwrap().median_s, 0.5);
        let error = result(&own(1.1)).unwrap_err();
        assert!(error.contains("0.100 of their size off"), "{error}");
        let error = result("echo no scipy >&2; exit 3").unwrap_err();
        assert!(error.ends_with("python: no scipy"), "{error}");
        let error = result("echo '[]'").unwrap_err();
        assert!(error.contains("python: 0 of 1 frames"), "{error}");
    }
}
