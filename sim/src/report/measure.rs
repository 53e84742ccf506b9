//! Measurements of the report: all engines on the same frames of each scene and case, their errors and times.
//!
//! ```text
//! scene × case ─┬─ literal baseline, CPU ─┐
//!               ├─ golden, CPU ───────────┼─> errors, forces, time of a frame
//!               ├─ bit-true, CPU ─────────┤
//!               └─ hardware: co-simulation ── cycles / clock
//! ```
//!
//! First all results are computed and compared, several cases in parallel; then the CPU engines are timed one after the
//! other, with no other work in parallel.

mod clock;
mod formats;
mod machine;
mod noise;
mod objective_map;
mod recordings;
mod stability;
mod stages;
mod sweep;
mod timing;

pub use clock::{clock, Clock};
pub use formats::{formats, FormatRow};
pub use machine::machine;
pub use noise::noise;
pub use objective_map::{objective_map, ObjectiveMap};
pub use recordings::{recorded, Recorded, MOST_FRAMES};
pub use stability::{conditions, extremes};
pub use stages::{stages, StageRow};
pub use sweep::{sweep, SweepPoint};
pub use timing::Timing;

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::{anyhow, Result};
use dermis_golden::baseline::Baseline;
use dermis_golden::errors::Errors;
use dermis_golden::fixed::{FixedError, Model, Trace};
use dermis_golden::float::Golden;
use dermis_golden::frame::{Forces, Frame};
use dermis_golden::partition::{subarrays, Case};
use dermis_golden::reconstruct::Reconstruction;
use dermis_golden::scene::{Condition, Scene};
use dermis_hdl::generate;
use dermis_hdl::usage::Usage;

use crate::compare::median;
use crate::hardware::Simulator;
use crate::jobs::{parallel, Interrupt};
use crate::progress::Progress;
use crate::verify::verify;

/// Largest subarray, in taxels, of the cases measured by the quick variant.
const QUICK_TAXELS: usize = 1200;
/// Largest subarray, in taxels, for which the quick variant runs the literal baseline, which takes seconds per frame
/// beyond.
const QUICK_LITERAL: usize = 200;

/// Options of a measurement.
#[derive(Clone, Debug)]
pub struct Options {
    /// Quick variant: two co-simulations, fewer drawn frames and sweeps, subarrays of at most 1200 taxels, literal
    /// baseline up to 200 taxels.
    pub quick: bool,
    /// Number of cases prepared in parallel.
    pub jobs: usize,
    /// Folder for build products and caches.
    pub build: PathBuf,
    /// Condition under which a subarray is searched.
    pub condition: Condition,
    /// Whether hardware is co-simulated; otherwise the bit-true model's cycle counts are used.
    pub simulate: bool,
    /// Set by SIGINT or SIGTERM.
    pub interrupt: Interrupt,
}

/// An implementation of the reconstruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Engine {
    /// Eq. 1 with dense matrices and a simplex search, on the CPU.
    Baseline,
    /// Floating point, on the CPU.
    Golden,
    /// The bit-true model, on the CPU.
    Fixed,
    /// The generated hardware.
    Hardware,
}

impl Engine {
    /// All engines, in the order of tables.
    pub const ALL: [Engine; 4] = [Engine::Baseline, Engine::Golden, Engine::Fixed, Engine::Hardware];

    /// Name in tables and legends.
    pub fn name(self) -> &'static str {
        match self {
            Engine::Baseline => "literal Eq. 1, CPU",
            Engine::Golden => "golden, CPU",
            Engine::Fixed => "bit-true, CPU",
            Engine::Hardware => "hardware",
        }
    }
}

/// Results of the bit-true model, and of the hardware, for a case.
#[derive(Debug)]
pub struct BitTrue {
    /// The model.
    pub model: Model,
    /// Its result for every frame.
    pub results: Vec<Reconstruction>,
    /// The outputs of its stages, for every frame.
    pub traces: Vec<Trace>,
    /// Whether the verilated hardware equalled it in every bit and cycle; `None` if not simulated.
    pub equal: Option<bool>,
    /// Cycles from the first input beat to the last output beat of the slowest frame, co-simulated if possible, else
    /// from the model.
    pub cycles: u64,
    /// Resources of each stage.
    pub usage: BTreeMap<String, Usage>,
}

/// Measurements of a scene in one case.
pub struct Measured {
    /// The scene, with the case in its fields.
    pub scene: Scene,
    /// The frames, at least one.
    pub frames: Vec<Frame>,
    /// The floating-point model.
    pub engine: Golden,
    /// Its result for every frame.
    pub golden: Vec<Reconstruction>,
    /// Results of the bit-true model and the hardware, or the reason why there is no hardware.
    pub bit_true: Result<BitTrue, String>,
    /// The literal baseline's forces for every frame, or the reason why it was not run.
    pub baseline: Result<Vec<Forces>, String>,
    /// Times per frame on the CPU.
    pub times: BTreeMap<Engine, Timing>,
    literal: Option<Baseline>,
}

/// Whether a frame has one contact or several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactCount {
    /// One contact, or none described.
    One,
    /// Several contacts, whose shears may differ.
    Several,
}

impl ContactCount {
    /// The contact count of a frame.
    pub fn of(frame: &Frame) -> ContactCount {
        if frame.contacts.len() > 1 {
            ContactCount::Several
        } else {
            ContactCount::One
        }
    }

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            ContactCount::One => "one",
            ContactCount::Several => "several",
        }
    }
}

/// Errors and time of an engine on one scene and case.
#[derive(Clone, Debug)]
pub struct Point {
    /// The case.
    pub case: Case,
    /// The engine.
    pub engine: Engine,
    /// Tangential error of the resultant, median over the frames.
    pub tangential: Option<f64>,
    /// Normal error of the resultant, median over the frames.
    pub normal: Option<f64>,
    /// Time per frame in s.
    pub seconds: f64,
}

impl Measured {
    /// Errors of an engine's resultants, one per frame.
    pub fn errors(&self, engine: Engine) -> Vec<Option<Errors>> {
        let own = |forces: &Vec<Forces>| {
            let pairs = self.frames.iter().zip(forces);
            pairs.map(|(frame, forces)| Some(Errors::new(frame.resultant_N?, forces.resultant()))).collect()
        };
        let of = |results: &[Reconstruction]| results.iter().map(|result| result.error).collect();
        match engine {
            Engine::Baseline => self.baseline.as_ref().map(own).unwrap_or_default(),
            Engine::Golden => of(&self.golden),
            Engine::Fixed | Engine::Hardware => self.bit_true.as_ref().map(|i| of(&i.results)).unwrap_or_default(),
        }
    }

    /// Errors and time of an engine; `None` if it does not support the case.
    pub fn point(&self, engine: Engine) -> Option<Point> {
        self.point_over(engine, |_| true)
    }

    /// The same over the frames selected by `keep`.
    pub fn point_over(&self, engine: Engine, keep: impl Fn(&Frame) -> bool) -> Option<Point> {
        let seconds = match engine {
            Engine::Hardware => {
                let bit_true = self.bit_true.as_ref().ok()?;
                clock(&bit_true.model.board, &self.scene).seconds(bit_true.cycles)
            }
            cpu => self.times.get(&cpu)?.seconds(),
        };
        let kept = self.frames.iter().zip(self.errors(engine)).filter(|(frame, _)| keep(frame));
        let errors: Vec<Option<Errors>> = kept.map(|(_, errors)| errors).collect();
        let over = |value: fn(&Errors) -> Option<f64>| median(errors.iter().flatten().filter_map(value).collect());
        Some(Point {
            case: self.scene.partition.case,
            engine,
            tangential: over(|e| e.tangential),
            normal: over(|e| e.normal),
            seconds,
        })
    }

    /// Index of the frame with the id `id`, else 0.
    pub fn frame(&self, id: &str) -> usize {
        self.frames.iter().position(|frame| frame.id == id).unwrap_or(0)
    }
}

/// Measures scenes in cases on their shipped frames, in the order given; cases that do not divide an array are skipped.
///
/// # Errors
/// A scene that the golden model refuses or that has no shipped frames, no Verilator, an interruption.
pub fn measure(scenes: &[Scene], cases: &[Case], options: &Options) -> Result<Vec<Measured>> {
    let mut tasks = Vec::new();
    for scene in scenes {
        let frames = Frame::shipped(scene);
        if frames.is_empty() {
            return Err(anyhow!("scene {}: no frame is shipped for {}", scene.name, scene.sensor));
        }
        for &case in cases {
            let mut scene = scene.clone();
            (scene.partition.case, scene.partition.condition) = (case, options.condition);
            let largest = match case {
                // One μ per contact over the whole array; equal to case 0 for a single contact.
                Case::Contacts if !frames.iter().any(|frame| ContactCount::of(frame) == ContactCount::Several) => None,
                Case::Contacts | Case::Adaptive => Some(scene.sensor.taxels()),
                Case::Grid(_) => subarrays(case, &scene.sensor).ok().map(|parts| parts[0].rows * parts[0].cols),
            };
            if largest.is_some_and(|taxels| !(options.quick && taxels > QUICK_TAXELS)) {
                tasks.push((scene, frames.clone()));
            }
        }
    }
    let mut all =
        parallel("engines and co-simulations", tasks, options.jobs, &options.interrupt, |(scene, frames)| {
            prepare(scene, frames, options)
        })?;
    let bar = Progress::steps("timing", all.len() as u64);
    for (done, measured) in all.iter_mut().enumerate() {
        options.interrupt.check()?;
        measured.times = timing::time(measured)?;
        bar.set(done as u64 + 1);
    }
    Ok(all)
}

fn prepare(scene: Scene, frames: Vec<Frame>, options: &Options) -> Result<Measured> {
    let engine = Golden::new(&scene.for_hardware())?;
    let golden = frames.iter().map(|frame| engine.run(frame)).collect::<Result<Vec<_>, _>>()?;
    let bit_true = match Model::for_frames(&scene, &frames) {
        Ok(model) => Ok(bit_true(model, &frames, options)?),
        Err(error @ (FixedError::DoesNotFit(_) | FixedError::Scene(_) | FixedError::Format { .. })) => {
            Err(error.to_string().lines().next().unwrap_or_default().to_owned())
        }
        Err(error) => return Err(error.into()),
    };
    let too_slow = options.quick && engine.matrices().sensor.taxels() > QUICK_LITERAL;
    let literal = match too_slow {
        true => Err("left out of the quick variant".to_owned()),
        false => Baseline::new(&scene).map_err(|error| error.to_string()),
    };
    let (literal, baseline) = match literal {
        Err(reason) => (None, Err(reason)),
        Ok(literal) => {
            let forces = frames.iter().map(|frame| literal.run(frame)).collect::<Result<Vec<_>, _>>()?;
            (Some(literal), Ok(forces))
        }
    };
    Ok(Measured { scene, frames, engine, golden, bit_true, baseline, times: BTreeMap::new(), literal })
}

fn bit_true(model: Model, frames: &[Frame], options: &Options) -> Result<BitTrue> {
    let traces = frames.iter().map(|frame| Ok(model.run(&model.readings(std::slice::from_ref(frame))?)));
    let traces: Vec<Trace> = traces.collect::<Result<_, FixedError>>()?;
    let decoded = frames
        .iter()
        .zip(&traces)
        .map(|(frame, t)| model.decode(std::slice::from_ref(frame), "fixed", &t.beats, &t.status));
    let results = decoded.collect::<Result<Vec<_>, _>>()?;
    let usage = generate(&model)?.usage;
    let slowest = traces.iter().map(|trace| trace.cycles.total).max().unwrap_or(0);
    let mut bit_true = BitTrue { results, traces, equal: None, cycles: slowest, usage, model };
    if is_simulated(&bit_true.model.scene, options) {
        let verified = verify(&bit_true.model.scene, frames, &[Simulator::Verilator], &options.build)?;
        bit_true.equal = Some(verified.findings.is_equal());
        bit_true.cycles = verified.rows.iter().filter_map(|row| row.times.total()).max().unwrap_or(slowest);
    }
    Ok(bit_true)
}

/// The quick variant co-simulates the two scenes of `make run`.
fn is_simulated(scene: &Scene, options: &Options) -> bool {
    let first = scene.partition.case == Case::WHOLE && ["sensor-1", "eight-by-eight"].contains(&scene.name.as_str());
    options.simulate && (!options.quick || first)
}
