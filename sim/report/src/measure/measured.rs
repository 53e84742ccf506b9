//! What is measured of a scene in one case.

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::Result;
use dermis_golden::data::frame::{Forces, Frame};
use dermis_golden::estimate::float::Golden;
use dermis_golden::fixed::{Model, Trace};
use dermis_golden::result::errors::Errors;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::partition::Case;
use dermis_golden::spec::scene::{Condition, EstimatorKind, Scene};
use dermis_hdl::usage::StageUsage;
use dermis_study::baseline::Baseline;

use super::clock::clock;
use super::timing::Timing;
use dermis_flow::jobs::Interrupt;
use dermis_golden::quantile::{median, quantile};

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
pub enum Implementation {
    /// Eq. 1 with dense matrices and a simplex search, on the CPU.
    Baseline,
    /// The estimator of the hardware in floating point, on the CPU.
    Golden,
    /// The estimator `evidence`, which the floating-point model takes where a scene states none, on the CPU.
    Evidence,
    /// The bit-true model, on the CPU.
    Fixed,
    /// The generated hardware.
    Hardware,
}

impl Implementation {
    /// All engines, in the order of tables.
    pub const ALL: [Implementation; 5] = [
        Implementation::Baseline,
        Implementation::Golden,
        Implementation::Evidence,
        Implementation::Fixed,
        Implementation::Hardware,
    ];

    /// Whether it has results of its own in a case: evidence takes the array as a whole, as in case 0.
    pub fn is_of(self, case: Case) -> bool {
        self != Implementation::Evidence || case == Case::WHOLE
    }

    /// Name in tables and legends, with that of the estimator that it computes for a scene.
    pub fn name(self, scene: &Scene) -> String {
        let of_hardware = scene.hardware_estimator().name();
        match self {
            Implementation::Baseline => "literal Eq. 1, CPU".to_owned(),
            Implementation::Golden => format!("golden {of_hardware}, CPU"),
            Implementation::Evidence => format!("golden {}, CPU", EstimatorKind::Evidence.name()),
            Implementation::Fixed => format!("bit-true {of_hardware}, CPU"),
            Implementation::Hardware => format!("hardware, {of_hardware}"),
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
    pub usage: StageUsage,
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
    /// The estimator `evidence` with its result for every frame, or the reason why there is none.
    pub evidence: Result<(Golden, Vec<Reconstruction>), String>,
    /// Results of the bit-true model and the hardware, or the reason why there is no hardware.
    pub bit_true: Result<BitTrue, String>,
    /// The literal baseline's forces for every frame, or the reason why it was not run.
    pub baseline: Result<Vec<Forces>, String>,
    /// Times per frame on the CPU.
    pub times: BTreeMap<Implementation, Timing>,
    pub(super) literal: Option<Baseline>,
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

    /// Those of some frames, each once.
    pub fn all_of(frames: &[Frame]) -> Vec<ContactCount> {
        let present = |count: &ContactCount| frames.iter().any(|frame| ContactCount::of(frame) == *count);
        [ContactCount::One, ContactCount::Several].into_iter().filter(present).collect()
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
    pub engine: Implementation,
    /// Its name with that of its estimator.
    pub name: String,
    /// Tangential error of the resultant, median over the frames.
    pub tangential: Option<f64>,
    /// Normal error of the resultant, median over the frames.
    pub normal: Option<f64>,
    /// 90 % quantiles of the tangential and the normal error.
    pub ninety: [Option<f64>; 2],
    /// Number of frames.
    pub frames: usize,
    /// Whether it is the hardware's, and its cycles are the model's, not those of a co-simulation.
    pub only_modelled: bool,
    /// Time per frame in s.
    pub seconds: f64,
}

impl Measured {
    /// Errors of an engine's resultants, one per frame.
    pub fn errors(&self, engine: Implementation) -> Vec<Option<Errors>> {
        let own = |forces: &Vec<Forces>| {
            let pairs = self.frames.iter().zip(forces);
            pairs.map(|(frame, forces)| Some(Errors::new(frame.resultant_N?, forces.resultant()))).collect()
        };
        let of = |results: &[Reconstruction]| results.iter().map(|result| result.error).collect();
        match engine {
            Implementation::Baseline => self.baseline.as_ref().map(own).unwrap_or_default(),
            Implementation::Golden => of(&self.golden),
            Implementation::Evidence => self.evidence.as_ref().map(|(_, results)| of(results)).unwrap_or_default(),
            Implementation::Fixed | Implementation::Hardware => {
                self.bit_true.as_ref().map(|i| of(&i.results)).unwrap_or_default()
            }
        }
    }

    /// Errors and time of an engine; `None` if it does not support the case.
    pub fn point(&self, engine: Implementation) -> Option<Point> {
        self.point_over(engine, |_| true)
    }

    /// The same over the frames selected by `keep`.
    pub fn point_over(&self, engine: Implementation, keep: impl Fn(&Frame) -> bool) -> Option<Point> {
        let seconds = match engine {
            Implementation::Hardware => {
                let bit_true = self.bit_true.as_ref().ok()?;
                clock(&bit_true.model.board, &self.scene).seconds(bit_true.cycles)
            }
            cpu => self.times.get(&cpu)?.seconds(),
        };
        let kept = self.frames.iter().zip(self.errors(engine)).filter(|(frame, _)| keep(frame));
        let errors: Vec<Option<Errors>> = kept.map(|(_, errors)| errors).collect();
        let of = |value: fn(&Errors) -> Option<f64>| errors.iter().flatten().filter_map(value).collect::<Vec<_>>();
        let simulated = self.bit_true.as_ref().is_ok_and(|bit_true| bit_true.equal.is_some());
        Some(Point {
            case: self.scene.partition.case,
            engine,
            name: engine.name(&self.scene),
            tangential: median(of(|e| e.tangential)),
            normal: median(of(|e| e.normal)),
            ninety: [quantile(of(|e| e.tangential), 0.9), quantile(of(|e| e.normal), 0.9)],
            frames: errors.len(),
            only_modelled: engine == Implementation::Hardware && !simulated,
            seconds,
        })
    }

    /// Normal error of Σ b·area, which needs no estimator, median over the frames with a contact count.
    pub fn error_of_sum(&self, contact_count: ContactCount) -> Option<f64> {
        let kept = self.frames.iter().filter(|frame| ContactCount::of(frame) == contact_count);
        let sum = |frame: &Frame| [0.0, 0.0, self.scene.sensor.sum_of_stress_N(&frame.stress_MPa)];
        median(kept.filter_map(|frame| Errors::new(frame.resultant_N?, sum(frame)).normal).collect())
    }

    /// Index of the frame with the id `id`, else 0.
    pub fn frame(&self, id: &str) -> usize {
        self.frames.iter().position(|frame| frame.id == id).unwrap_or(0)
    }
}
