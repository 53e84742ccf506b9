//! The study: draws presses, spoils them, runs the engines, and judges their results.

use super::faults::{Fault, Kind, Moments, Readings, FAULTS};
use crate::noise::StudyError;
use crate::steps::steps;
use dermis_golden::data::frame::Frame;
use dermis_golden::data::generator::draws::{DrawOptions, Draws};
use dermis_golden::data::generator::GeneratorError;
use dermis_golden::engine::{CheckedEngine, EngineError};
use dermis_golden::estimate::float::{Golden, GoldenError};
use dermis_golden::fixed::{FixedError, Model};
use dermis_golden::random::Random;
use dermis_golden::result::checks::history::History;
use dermis_golden::result::errors::Errors;
use dermis_golden::result::flags::Flag;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::scene::{EstimatorKind, Scene};
use dermis_golden::spec::sensor::Sensor;
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeSet;

/// Largest e_t and e_n of a result that is right, and share of Σ|b|·area below which a force counts as none.
const RIGHT: (f64, f64, f64) = (0.2, 0.1, 0.01);
/// Noise over the peak of the engine that states it, where the study names none.
const STATED: f64 = 5e-4;
/// Moments of a stream.
pub(super) const MOMENTS: usize = 12;
/// Largest number of presses.
const MOST_FRAMES: usize = 100_000;
/// Frames per scene of a fault without contact, which differ little.
const NO_CONTACT_FRAMES: usize = 2;
/// Multiplier of the seed: neighbouring seeds have no random numbers in common.
const SPREAD: u64 = 0x9e37_79b9_7f4a_7c15;

/// What computes, and how it receives a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Path {
    engine: StudyEngine,
    stream: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum StudyEngine {
    Golden,
    Stated,
    Fixed,
    Network,
}

/// The engines, each as `dermis reconstruct --frame` and `--stream` run it.
pub const ENGINES: [Path; 8] = [
    Path { engine: StudyEngine::Golden, stream: false },
    Path { engine: StudyEngine::Golden, stream: true },
    Path { engine: StudyEngine::Stated, stream: false },
    Path { engine: StudyEngine::Stated, stream: true },
    Path { engine: StudyEngine::Fixed, stream: false },
    Path { engine: StudyEngine::Fixed, stream: true },
    Path { engine: StudyEngine::Network, stream: false },
    Path { engine: StudyEngine::Network, stream: true },
];

impl Path {
    /// Name in tables.
    pub fn name(self) -> &'static str {
        match (self.engine, self.stream) {
            (StudyEngine::Golden, false) => "golden, frame",
            (StudyEngine::Golden, true) => "golden, stream",
            (StudyEngine::Stated, false) => "golden, noise stated, frame",
            (StudyEngine::Stated, true) => "golden, noise stated, stream",
            (StudyEngine::Fixed, false) => "fixed, frame",
            (StudyEngine::Fixed, true) => "fixed, stream",
            (StudyEngine::Network, false) => "fixed with network, frame",
            (StudyEngine::Network, true) => "fixed with network, stream",
        }
    }
}

/// What to draw.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorFaults {
    /// Presses of each scene, 1 to 100 000.
    pub frames: usize,
    /// Seed of presses, noise and faults.
    pub seed: u64,
    /// Standard deviation of the noise over the largest stress; 0: none, but for the engine that states its noise.
    pub noise: f64,
    /// Names of faults; empty: all.
    pub only: Vec<String>,
    /// One size of each fault.
    pub quick: bool,
}

impl Default for SensorFaults {
    fn default() -> Self {
        SensorFaults { frames: 6, seed: 1, noise: 0.0, only: Vec::new(), quick: false }
    }
}

/// Frames of one engine by verdict.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Counts {
    /// All.
    pub frames: usize,
    /// With a flag that a clean frame does not have, or refused.
    pub flagged: usize,
    /// Without one, and wrong.
    pub silent: usize,
    /// Without one, and right.
    pub right: usize,
    /// Largest error of a force over its standard deviation, of the frames without a flag; `None` without any.
    pub worst_z: Option<f64>,
}

impl Counts {
    /// The counts of both.
    pub fn plus(self, other: Counts) -> Counts {
        Counts {
            frames: self.frames + other.frames,
            flagged: self.flagged + other.flagged,
            silent: self.silent + other.silent,
            right: self.right + other.right,
            worst_z: [self.worst_z, other.worst_z].into_iter().flatten().reduce(f64::max),
        }
    }

    /// Share of frames that are silently wrong; 0 without frames.
    pub fn silent_share(&self) -> f64 {
        self.silent as f64 / self.frames.max(1) as f64
    }

    /// Share of frames with a flag; 0 without frames.
    pub fn flagged_share(&self) -> f64 {
        self.flagged as f64 / self.frames.max(1) as f64
    }
}

/// One line of the table: a fault of one size on all scenes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FaultRow {
    /// Name of the fault.
    pub fault: &'static str,
    /// Its size in words; empty where there is one.
    pub size: String,
    /// Whether a frame or its stream shows it.
    pub kind: Kind,
    /// The counts of each of [`ENGINES`].
    pub engines: [Counts; ENGINES.len()],
}

impl Serialize for Kind {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(match self {
            Kind::Clean => "clean",
            Kind::Shown => "shown",
            Kind::Hidden => "hidden",
            Kind::NoContact => "no-contact",
        })
    }
}

/// A drawn press.
pub(super) struct Press {
    pub exact_MPa: Vec<f64>,
    /// Stress of another press.
    other_MPa: Vec<f64>,
    total_N: [f64; 3],
    peak_MPa: f64,
    peak_taxel: usize,
    seed: u64,
}

impl Press {
    fn random(&self, stream: u64) -> Random {
        Random::new((self.seed ^ stream << 40).wrapping_mul(SPREAD))
    }

    /// Stress of a moment without noise: the load grows evenly, and at last as the fault has it.
    fn stress_MPa(&self, moment: usize, moments: Moments, size: f64) -> Vec<f64> {
        let grown = (moment + 1) as f64 / MOMENTS as f64;
        let last = moment + 1 == MOMENTS;
        let times = |b: &[f64], load: f64| b.iter().map(|b| load * b).collect();
        match moments {
            _ if last => self.exact_MPa.clone(),
            Moments::All | Moments::Last => times(&self.exact_MPa, grown),
            Moments::LastStep => times(&self.exact_MPa, (1.0 - size) * grown * MOMENTS as f64 / (MOMENTS - 1) as f64),
            Moments::LastOther => times(&self.other_MPa, grown),
        }
    }

    /// The stream with its fault; `noise` as a share of the peak.
    pub fn spoiled(&self, sensor: &Sensor, fault: &Fault, size: f64, noise: f64) -> Vec<Vec<f64>> {
        let (mut read, mut before) = (Vec::new(), Vec::new());
        for moment in 0..MOMENTS {
            let mut random = self.random(1 + moment as u64);
            let normal: Vec<f64> = self.exact_MPa.iter().map(|_| random.normal()).collect();
            let stress = self.stress_MPa(moment, fault.moments, size);
            let now: Vec<f64> = std::iter::zip(stress, &normal).map(|(b, n)| b + noise * self.peak_MPa * n).collect();
            let Press { peak_MPa, peak_taxel, .. } = *self;
            let readings = Readings { sensor, now: &now, before: &before, noise: &normal, peak_MPa, peak_taxel };
            let spoils = fault.moments == Moments::All || moment + 1 == MOMENTS;
            read.push(if spoils { (fault.apply)(&readings, size, &mut self.random(0)) } else { now.clone() });
            before = now;
        }
        read
    }
}

/// What an engine says of a frame.
struct EngineAnswer {
    flags: BTreeSet<Flag>,
    force_N: [f64; 3],
    sigma_N: Option<[f64; 3]>,
}

impl EngineAnswer {
    fn of(result: &Reconstruction) -> EngineAnswer {
        let flags = result.flags.iter().copied().collect();
        EngineAnswer { flags, force_N: result.resultant_N, sigma_N: result.sigma_N() }
    }
}

/// The engines of a scene.
struct Engines<'a> {
    scene: &'a Scene,
    golden: Golden,
    fixed: CheckedEngine<Model>,
    /// The bit-true model with the scene's network, as `sensor-1-noisy` has that of `sensor-1`; `None` where it names none.
    network: Option<CheckedEngine<Model>>,
}

impl Engines<'_> {
    fn new(scene: &Scene) -> Result<Engines<'_>, StudyError> {
        let bit_true = |scene: &Scene| Ok::<_, StudyError>(CheckedEngine::new(Box::new(Model::new(scene)?)));
        let network = scene.search.network.is_some().then(|| {
            let mut scene = scene.clone();
            scene.hardware.estimator = Some(EstimatorKind::Network);
            bit_true(&scene)
        });
        Ok(Engines { scene, golden: Golden::new(scene)?, fixed: bit_true(scene)?, network: network.transpose()? })
    }

    /// The answers as a frame and as the last one of a stream; `None` where the engine refuses it, or the scene has it not.
    fn answers(
        &self,
        engine: StudyEngine,
        stream: &[Vec<f64>],
        noise_MPa: f64,
    ) -> Result<[Option<EngineAnswer>; 2], StudyError> {
        let frames = stream.iter().map(|stress| Frame::from_stress("spoiled", &self.scene.sensor, stress.clone()));
        let frames: Vec<Frame> = frames.collect::<Result<_, _>>()?;
        let Some(last) = frames.last() else { return Ok([None, None]) };
        let result = match engine {
            StudyEngine::Golden => self.golden.run(last).map_err(StudyError::from),
            StudyEngine::Stated => self.golden.run_with_noise(last, noise_MPa).map_err(StudyError::from),
            StudyEngine::Fixed => self.fixed.result(std::slice::from_ref(last), true).map_err(StudyError::from),
            StudyEngine::Network => match &self.network {
                Some(network) => network.result(std::slice::from_ref(last), true).map_err(StudyError::from),
                None => return Ok([None, None]),
            },
        };
        let result = match result {
            Err(
                StudyError::Golden(GoldenError::TooStrong { .. })
                | StudyError::Engine(EngineError::Fixed(FixedError::TooStrong { .. })),
            ) => {
                return Ok([None, None]);
            }
            other => other?,
        };
        // The cross-check of each result of a stream is that of the frame alone.
        let (mut in_stream, mut history) = (result.clone(), History::new(self.scene));
        for frame in &frames {
            let checks = history.add(std::slice::from_ref(frame), in_stream.checks);
            in_stream.diagnostics().add_checks(self.scene, checks);
        }
        Ok([result, in_stream].map(|result| Some(EngineAnswer::of(&result))))
    }

    /// The verdicts of all [`ENGINES`] on a press with a fault; a clean press has the noise of its size.
    fn judge(&self, press: &Press, fault: &Fault, size: f64, noise: f64) -> Result<Vec<Judged>, StudyError> {
        let mut all = Vec::with_capacity(ENGINES.len());
        for engine in [StudyEngine::Golden, StudyEngine::Stated, StudyEngine::Fixed, StudyEngine::Network] {
            let noise = if fault.kind == Kind::Clean { size } else { noise_of(engine, noise) };
            let stream = press.spoiled(&self.scene.sensor, fault, size, noise);
            let last = stream.last().map_or(&[][..], |last| last);
            let truth_N = (fault.kind != Kind::NoContact).then_some(press.total_N);
            let answers = self.answers(engine, &stream, noise * press.peak_MPa)?;
            let absent = engine == StudyEngine::Network && self.network.is_none();
            all.extend(answers.map(|answer| match answer {
                Some(answer) => Judged::Result(answer.judged(&self.scene.sensor, last, truth_N)),
                None if absent => Judged::Absent,
                None => Judged::Refused,
            }));
        }
        Ok(all)
    }
}

/// Noise over the peak of the frames that an engine gets.
fn noise_of(engine: StudyEngine, noise: f64) -> f64 {
    match engine {
        StudyEngine::Stated if noise == 0.0 => STATED,
        _ => noise,
    }
}

/// What an engine makes of a frame.
enum Judged {
    /// A result, compared with the truth.
    Result(Verdict),
    /// The engine refuses the frame.
    Refused,
    /// The scene does not have the engine.
    Absent,
}

/// Flags and errors of a result.
struct Verdict {
    flags: BTreeSet<Flag>,
    wrong: bool,
    /// Largest error over its standard deviation, where the engine states one.
    z: Option<f64>,
}

impl EngineAnswer {
    /// Compared with the true force; `None` where nothing presses.
    fn judged(self, sensor: &Sensor, last: &[f64], truth_N: Option<[f64; 3]>) -> Verdict {
        let (tangential, normal, none) = RIGHT;
        let wrong = match truth_N {
            Some(truth_N) => {
                let errors = Errors::new(truth_N, self.force_N);
                errors.tangential.is_some_and(|e| e > tangential) || errors.normal.is_some_and(|e| e > normal)
            }
            None => {
                let sizes: Vec<f64> = last.iter().map(|b| b.abs()).collect();
                let [x, y, z] = self.force_N;
                x.hypot(y).hypot(z) > none * sensor.sum_of_stress_N(&sizes)
            }
        };
        let truth_N = truth_N.unwrap_or_default();
        let z = |sigma: [f64; 3]| {
            let all = (0..3).map(|axis| (self.force_N[axis] - truth_N[axis]).abs() / sigma[axis]);
            all.filter(|z| z.is_finite()).reduce(f64::max)
        };
        Verdict { z: self.sigma_N.and_then(z), flags: self.flags, wrong }
    }
}

/// One frame of the study.
struct Task<'a> {
    scene: usize,
    fault: &'a Fault,
    size: f64,
    press: usize,
}

/// The flags that every one of the clean `judged` has; those of frames that are refused are none.
fn always(judged: &[&Judged]) -> BTreeSet<Flag> {
    let mut all = judged.iter().filter_map(|judged| match judged {
        Judged::Result(verdict) => Some(verdict.flags.clone()),
        Judged::Refused | Judged::Absent => None,
    });
    let first = all.next().unwrap_or_default();
    all.fold(first, |both, own| both.intersection(&own).copied().collect())
}

/// The counts of one frame, where `carried` flags say nothing.
fn counted(judged: &Judged, carried: &BTreeSet<Flag>) -> Counts {
    let one = Counts { frames: 1, ..Counts::default() };
    match judged {
        Judged::Absent => Counts::default(),
        Judged::Result(verdict) if verdict.flags.is_subset(carried) => {
            Counts { silent: verdict.wrong.into(), right: (!verdict.wrong).into(), worst_z: verdict.z, ..one }
        }
        _ => Counts { flagged: 1, ..one },
    }
}

/// Spoils drawn presses of `scenes` and counts the verdicts of all engines; `progress` is called after every frame with the
/// number of frames done and of all.
///
/// ```
/// use dermis_golden::spec::scene::Scene;
/// use dermis_study::sensor_faults::{sensor_faults, SensorFaults};
///
/// let small = SensorFaults { frames: 1, quick: true, only: vec!["sign reversed".to_owned()], ..Default::default() };
/// let rows = sensor_faults(&[Scene::builtin("eight-by-eight")?], &small, &|_, _| ())?;
/// // A press that pulls is flagged by every engine that the scene has; it names no network.
/// assert!(rows.len() == 1 && rows[0].engines.iter().all(|counts| counts.flagged == counts.frames));
/// assert!(rows[0].engines[5].frames == 1 && rows[0].engines[7].frames == 0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`StudyError`]: no frames, a fault that does not exist, a scene that one of the models refuses or on which no contact
/// fits.
pub fn sensor_faults(
    scenes: &[Scene],
    study: &SensorFaults,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<FaultRow>, StudyError> {
    let lines = lines(study)?;
    let engines = scenes.iter().map(Engines::new).collect::<Result<Vec<_>, _>>()?;
    let presses = scenes.iter().map(|scene| presses(scene, study)).collect::<Result<Vec<_>, _>>()?;
    let tasks_of = |fault: &'static Fault, size: f64| {
        let most = if fault.kind == Kind::NoContact { NO_CONTACT_FRAMES } else { study.frames };
        let all = (0..scenes.len()).flat_map(move |scene| (0..most.min(study.frames)).map(move |press| (scene, press)));
        all.map(move |(scene, press)| Task { scene, fault, size, press })
    };
    // Clean frames with the noise of each engine, whose flags say nothing of a fault.
    let clean = &FAULTS[0];
    let noises = if study.noise == 0.0 { vec![0.0, STATED] } else { vec![study.noise] };
    let controls: Vec<Task> = noises.into_iter().flat_map(|noise| tasks_of(clean, noise)).collect();
    let tasks: Vec<Task> = lines.iter().flat_map(|(fault, size)| tasks_of(fault, *size)).collect();
    let step = steps(progress, controls.len() + tasks.len());
    let judge = |task: &Task| {
        let judged = engines[task.scene].judge(&presses[task.scene][task.press], task.fault, task.size, study.noise);
        step();
        judged
    };
    let judged = |tasks: &[Task]| tasks.par_iter().map(judge).collect::<Result<Vec<Vec<Judged>>, StudyError>>();
    let (control, spoiled) = (judged(&controls)?, judged(&tasks)?);
    let carried = |scene: usize, path: usize| {
        let noise = noise_of(ENGINES[path].engine, study.noise);
        let own = std::iter::zip(&controls, &control).filter(|(task, _)| task.scene == scene && task.size == noise);
        always(&own.map(|(_, judged)| &judged[path]).collect::<Vec<_>>())
    };
    let carried: Vec<Vec<BTreeSet<Flag>>> =
        (0..scenes.len()).map(|scene| (0..ENGINES.len()).map(|path| carried(scene, path)).collect()).collect();
    let row = |(fault, size): &(&'static Fault, f64)| {
        let own =
            std::iter::zip(&tasks, &spoiled).filter(|(task, _)| std::ptr::eq(task.fault, *fault) && task.size == *size);
        let mut counts = [Counts::default(); ENGINES.len()];
        for (task, judged) in own {
            for (path, count) in counts.iter_mut().enumerate() {
                *count = count.plus(counted(&judged[path], &carried[task.scene][path]));
            }
        }
        FaultRow { fault: fault.name, size: fault.unit.text(*size), kind: fault.kind, engines: counts }
    };
    Ok(lines.iter().map(row).collect())
}

/// A spoiled frame: the fault, its size in words, the readings.
pub type Spoiled = (&'static str, String, Frame);

/// The last frame of every press, spoiled by every fault of every size that `study` names, as the engines without stated noise get it.
///
/// # Errors
/// As [`sensor_faults`].
pub fn spoiled_frames(scene: &Scene, study: &SensorFaults) -> Result<Vec<Spoiled>, StudyError> {
    let (lines, presses) = (lines(study)?, presses(scene, study)?);
    let all = lines.iter().flat_map(|line| presses.iter().map(move |press| (*line, press)));
    let spoiled = |((fault, size), press): ((&'static Fault, f64), &Press)| {
        let noise = if fault.kind == Kind::Clean { size } else { study.noise };
        let last = press.spoiled(&scene.sensor, fault, size, noise).pop().unwrap_or_default();
        Ok((fault.name, fault.unit.text(size), Frame::from_stress("spoiled", &scene.sensor, last)?))
    };
    all.map(spoiled).collect()
}

/// The faults that are asked for, with the sizes that are measured.
fn lines(study: &SensorFaults) -> Result<Vec<(&'static Fault, f64)>, StudyError> {
    let sizes = |fault: &'static Fault| match study.quick {
        true => &fault.sizes[fault.sizes.len() / 2..][..1],
        false => fault.sizes,
    };
    let with_sizes = |fault: &'static Fault| sizes(fault).iter().map(move |size| (fault, *size));
    Ok(chosen(study)?.into_iter().flat_map(with_sizes).collect())
}

/// The faults that are asked for.
fn chosen(study: &SensorFaults) -> Result<Vec<&'static Fault>, StudyError> {
    let fail = |field, value: String, allowed| Err(StudyError::Parameter { field, value, allowed });
    if !(1..=MOST_FRAMES).contains(&study.frames) {
        return fail("frames", study.frames.to_string(), "a whole number from 1 to 100000");
    }
    if !(study.noise >= 0.0 && study.noise <= 1.0) {
        return fail("noise", study.noise.to_string(), "a number from 0 to 1");
    }
    if let Some(unknown) = study.only.iter().find(|name| FAULTS.iter().all(|fault| fault.name != **name)) {
        return fail("fault", format!("{unknown:?}"), "the name of a fault, as the table has it");
    }
    let wanted = |fault: &&Fault| study.only.is_empty() || study.only.iter().any(|name| name == fault.name);
    Ok(FAULTS.iter().filter(wanted).collect())
}

/// The presses of a scene.
pub(super) fn presses(scene: &Scene, study: &SensorFaults) -> Result<Vec<Press>, StudyError> {
    let draws = Draws::new(scene, DrawOptions { seed: study.seed, ..DrawOptions::default() })?;
    let press = |number: u64| -> Result<Press, GeneratorError> {
        let (own, other) = (draws.frame(number)?, draws.frame(number + 1)?);
        let peak_MPa = own.exact_MPa.iter().fold(0.0f64, |peak, b| b.max(peak));
        let peak_taxel = own.exact_MPa.iter().position(|b| *b == peak_MPa).unwrap_or(0);
        let seed = study.seed.wrapping_mul(SPREAD) ^ number;
        let (exact_MPa, other_MPa, total_N) = (own.exact_MPa, other.exact_MPa, own.total_N);
        Ok(Press { exact_MPa, other_MPa, total_N, peak_MPa, peak_taxel, seed })
    };
    Ok((0..study.frames as u64).map(press).collect::<Result<_, _>>()?)
}
