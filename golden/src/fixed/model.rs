//! The bit-true model of one scene: construction, run over all stages, decoding of the device's words.

use thiserror::Error;

use super::plan::cases::{shape, Dropped};
use super::plan::cycles::{Cycles, SHORTEST_SWEEP};
use super::plan::fit_suggestions::{fit_suggestions, Shortage};
use super::plan::resources::Resources;
use super::plan::storage::Storage;
use super::stages::force::Force;
use super::stages::prepare::{Prepare, Scale};
use super::stages::receive::mask_dead;
use super::stages::resultants::{self, sums};
use super::stages::search::Best;
use super::stages::send::{Status, FLAG_COEFFICIENTS, FLAG_CONDITION, FLAG_FOUND, FLAG_NO_CONTACT, STATUS_BEATS};
use super::subarray::SubarrayTrace;
use super::words::formats::{Design, Formats, Quantised, LOG_FRACTION, MU_STEPS};
use crate::board::{Board, BoardError, EngineKind};
use crate::checks::Checks;
use crate::errors::Errors;
use crate::flags::{frame_flags, Flag};
use crate::frame::{Forces, Frame, FrameError};
use crate::input::{Input, InputError};
use crate::matrices::{MatricesError, MAX_DEGREE};
use crate::partition::{subarrays, Case, Grid, PartitionError, Subarray};
use crate::quantise::{full_scale, largest_code, noise_floor_codes, quantise, Codes};
use crate::reception::{receive as receive_codes, Received};
use crate::reconstruct::{assemble, Reconstruction, Resultant, SubarrayResult};
use crate::scene::{ForceOutput, Scene, SceneError};
use crate::symmetry::quads::Quads;

/// A scene without a bit-true model, or a frame without a result.
#[derive(Debug, Error)]
pub enum FixedError {
    /// The scene asks for something this version does not build.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The frame does not belong to the scene.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The matrices of the scene cannot be computed.
    #[error(transparent)]
    Matrices(#[from] MatricesError),
    /// The partition does not fit the array.
    #[error(transparent)]
    Partition(#[from] PartitionError),
    /// A case whose subarrays are too small to share the hardware of another.
    #[error(
        "case {case} has subarrays of {quads} quads; several cases in one hardware need at least {SHORTEST_SWEEP}"
    )]
    SmallCase {
        /// The case.
        case: Case,
        /// Quads of a subarray.
        quads: usize,
    },
    /// The design needs resources that the board lacks.
    #[error("{0}")]
    DoesNotFit(Box<Shortage>),
    /// The scene's board is unknown or its file invalid.
    #[error(transparent)]
    Board(#[from] BoardError),
    /// A word would need more bits than the hardware has.
    #[error("{what} needs {needs} bits, the hardware has {has}: lower fixed.input_bits, input.average, fixed.inverse_bits or search.mu_max")]
    Format {
        /// The word, in words.
        what: &'static str,
        /// Width it needs in bits.
        needs: u32,
        /// Largest width in bits.
        has: u32,
    },
    /// A field in physical units while `input.full_scale_MPa`, which relates codes to stress, is missing.
    #[error("{field} = {value} needs input.full_scale_MPa: without it the hardware does not know what a code means")]
    NoFullScale {
        /// The scene's field.
        field: &'static str,
        /// Its value.
        value: String,
    },
    /// A file named by the input options cannot be used, or the frames do not fit them.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A device sent a wrong number of beats for the scene.
    #[error("{what}: got {got} beats, expected {expected}")]
    Beats {
        /// `forces` or `status`.
        what: &'static str,
        /// Number of beats received.
        got: usize,
        /// Number of beats the scene has.
        expected: usize,
    },
    /// The stress is so large that its forces are not finite.
    #[error("frame {frame}: peak stress {peak_MPa:e} MPa gives forces beyond the range of numbers")]
    TooStrong {
        /// The frame's id.
        frame: String,
        /// Its largest |b|.
        peak_MPa: f64,
    },
    /// A broken invariant: a defect of this crate.
    #[error("internal: {0}")]
    Internal(&'static str),
}

/// The words that one stage passed on for a frame, in the hardware's order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stage {
    /// The stage's name, that of the tap in the hardware.
    pub name: &'static str,
    /// Words, each a list of signed fields.
    pub words: Vec<Vec<i64>>,
}

/// Everything the hardware computes for one frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Trace {
    /// Forces `[fx, fy, fz]` in force LSBs, row-major; with `output.forces = "resultants"` the sums of each subarray.
    pub beats: Vec<[i32; 3]>,
    /// Status beats, three words each ([`super::stages::send`]).
    pub status: Vec<[i32; 3]>,
    /// The words of each stage, in pipeline order.
    pub stages: Vec<Stage>,
    /// Cycle counts of the frame at full speed.
    pub cycles: Cycles,
}

/// Stages that pass on single words, not quads, in the serial engine.
const SINGLE_WORDS: [&str; 4] = ["normalise", "rescale", "unfold", "force"];

/// The bit-true model of one scene.
#[derive(Clone, Debug)]
pub struct Model {
    /// The scene.
    pub scene: Scene,
    /// Widths and scales.
    pub formats: Formats,
    /// Quantised matrices.
    pub quantised: Quantised,
    /// Noise floor in LSBs of a frame buffer word, rounded down.
    pub noise_floor: i32,
    /// Calibration and averaging of the input.
    pub prepare: Prepare,
    /// `threshold.min_force_N` in force LSBs, rounded up.
    pub threshold: i64,
    /// The coefficient memory's layout.
    pub storage: Storage,
    /// Memories and multipliers.
    pub resources: Resources,
    /// The board.
    pub board: Board,
    /// The subarrays, row-major; with several cases, those of case 0, as every field that differs between cases.
    pub parts: Vec<Subarray>,
    /// Dead taxels, row-major in the array, ascending.
    pub dead: Vec<usize>,
    /// Cases that divide the array but were left out; empty if the scene lists its cases.
    pub dropped: Vec<Dropped>,
    /// One model per case, case 0 first; empty for a scene with one case.
    pub(super) built: Vec<Model>,
    pub(super) layout: Quads,
}

impl Model {
    /// Computes and quantises the scene's matrices and derives its formats.
    ///
    /// ```
    /// use dermis_golden::{fixed::{Cycles, Model}, frame::Frame, reconstruct::Golden, scene::Scene};
    ///
    /// let scene = Scene::builtin("eight-by-eight")?;
    /// let frame = Frame::shipped(&scene).remove(0);
    /// let model = Model::new(&scene)?;
    /// let fixed = model.reconstruct(&frame)?.resultant_N;
    /// // The golden model with the estimator that the hardware has.
    /// let golden = Golden::new(&scene.for_hardware())?.run(&frame)?.resultant_N;
    /// // The normal force differs from the golden model's by less than 0.1 %.
    /// assert!((fixed[2] / golden[2] - 1.0).abs() < 1e-3);
    /// // The same in words, one beat per taxel, and the duration of a frame with a search.
    /// let trace = model.run(&model.readings(&[frame])?);
    /// assert_eq!((trace.beats.len(), trace.cycles), (64, Cycles::longest(&model)));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The scene asks for something unavailable, its matrices or formats do not exist, or a threshold or noise floor
    /// lacks the full scale. [`FixedError::DoesNotFit`] lists the resources the board lacks and changes that make the
    /// scene fit.
    pub fn new(scene: &Scene) -> Result<Self, FixedError> {
        let model = Model::without_fit_check(scene)?;
        let lacking = model.resources.shortages(&model.board);
        if lacking.is_empty() {
            return Ok(model);
        }
        let (board, scene) = (model.board.name.clone(), scene.name.clone());
        Err(FixedError::DoesNotFit(Box::new(Shortage { scene, board, lacking, suggestions: fit_suggestions(&model) })))
    }

    /// The model with a polynomial of the given degree, 1 to 3, in place of the one the series needs.
    ///
    /// # Errors
    /// As [`Model::new`], but a board that is too small is no error.
    pub fn of_degree(scene: &Scene, degree: usize) -> Result<Self, FixedError> {
        Model::with_scale(scene, Scale::new(scene)?, Some(degree.clamp(1, MAX_DEGREE)))
    }

    /// The model of a scene, whether it fits its board or not.
    pub(crate) fn without_fit_check(scene: &Scene) -> Result<Self, FixedError> {
        Model::with_scale(scene, Scale::new(scene)?, None)
    }

    /// The model with the given scale of the readings and, if given, degree of the polynomial; the board may be too
    /// small.
    pub(super) fn with_scale(scene: &Scene, scale: Scale, degree: Option<usize>) -> Result<Self, FixedError> {
        scene.require_supported()?;
        let scene = &scene.for_hardware();
        let board = Board::load(&scene.hardware.board)?;
        if board.engine == EngineKind::Serial {
            scene.require_serial()?;
        }
        match scene.partition.case {
            Case::Adaptive => Model::of_choices(scene, &scale, degree, &board),
            case => Model::of_shapes(scene, &scale, &board, vec![(case, shape(scene, case, degree)?)]),
        }
    }

    /// The model of a single case.
    pub(super) fn of_design(scene: &Scene, scale: &Scale, design: Design, board: &Board) -> Result<Self, FixedError> {
        let Design { formats, quantised, storage, resources } = design;
        let parts = subarrays(scene.partition.case, &scene.sensor)?;
        let shape = parts[0].sensor(&scene.sensor);
        // Scenes with dead taxels have a single subarray.
        let dead = parts[0].local_indices(&scene.input.dead);
        let scaled = |field, value: f64, unit: &dyn Fn(f64) -> f64| match scene.input.full_scale_MPa {
            _ if value == 0.0 => Ok(0.0),
            Some(full_scale) => Ok(value / unit(full_scale)),
            None => Err(FixedError::NoFullScale { field, value: value.to_string() }),
        };
        if let (Some(field), None) = (scene.scaled_input(), scene.input.full_scale_MPa) {
            return Err(FixedError::NoFullScale { field, value: scene.field_value(field) });
        }
        let prepare = Prepare::new(scene, scale.clone(), scene.input.full_scale_MPa.unwrap_or(1.0));
        let code_lsb = |full_scale: f64| full_scale / prepare.largest();
        let noise_floor = scaled("search.noise_floor_MPa", scene.search.noise_floor_MPa, &code_lsb)?;
        let force_lsb = |full_scale: f64| code_lsb(full_scale) * 2f64.powi(formats.force_exponent);
        let threshold = scaled("threshold.min_force_N", scene.threshold.min_force_N, &force_lsb)?;
        Ok(Model {
            scene: scene.clone(),
            noise_floor: noise_floor.floor().min(f64::from(i32::MAX)) as i32,
            threshold: threshold.ceil().min(f64::from(u32::MAX)) as i64,
            prepare,
            layout: Quads { rows: shape.rows, cols: shape.cols },
            parts,
            dead,
            formats,
            quantised,
            storage,
            resources,
            board: board.clone(),
            built: Vec::new(),
            dropped: Vec::new(),
        })
    }

    /// The model for `frames`: if the scene needs a full scale and has none, it takes the frames' largest |b|, one
    /// scale for all of them.
    ///
    /// # Errors
    /// As [`Model::new`].
    pub fn for_frames(scene: &Scene, frames: &[Frame]) -> Result<Self, FixedError> {
        let mut scene = scene.clone();
        let needs = scene.search.noise_floor_MPa > 0.0
            || scene.threshold.min_force_N > 0.0
            || scene.input.average > 0
            || scene.scaled_input().is_some();
        if needs && scene.input.full_scale_MPa.is_none() {
            let gain = Scale::new(&scene)?.largest;
            let peak = |frame: &Frame| scene.input.mask_dead(frame.clone()).peak_MPa();
            let largest = gain * frames.iter().map(peak).fold(0.0, f64::max);
            let codes = f64::from(largest_code(scene.fixed.input_bits));
            // The largest reading takes the code before the last, which would count as saturated. Frames of zeros fit
            // any scale; 1 MPa is also the default of a single frame.
            scene.input.full_scale_MPa = Some(if largest > 0.0 { largest * (codes / (codes - 1.0)) } else { 1.0 });
        }
        Model::new(&scene)
    }

    /// The quad layout of a subarray.
    pub fn layout(&self) -> Quads {
        self.layout
    }

    /// Number of subarrays along the rows and along the columns.
    pub fn grid(&self) -> Grid {
        let shape = self.layout;
        Grid { rows: self.scene.sensor.rows / shape.rows, cols: self.scene.sensor.cols / shape.cols }
    }

    /// Whether the hardware has a μ search, that is `search.mu_max` is above 0.
    pub fn searches(&self) -> bool {
        self.formats.degree > 0
    }

    /// N per LSB of a force word, for codes whose largest value means `full_scale_MPa`.
    pub fn force_lsb_N(&self, full_scale_MPa: f64) -> f64 {
        full_scale_MPa / self.prepare.largest() * 2f64.powi(self.formats.force_exponent)
    }

    /// The stress that [`Model::reconstruct_averaged`] reconstructs: the calibrated mean of 2^average frames, in MPa.
    ///
    /// # Errors
    /// [`InputError`] unless there are 2^average frames, all of the scene's sensor.
    pub fn stress(&self, frames: &[Frame]) -> Result<Frame, FixedError> {
        let input = Input::new(&self.scene)?;
        Ok(input.calibrate(&input.average(&self.scene, frames)?))
    }

    /// The converter's codes for the frames of one reconstruction, frame after frame, row-major.
    ///
    /// # Errors
    /// As [`Model::stress`].
    pub fn readings(&self, frames: &[Frame]) -> Result<Vec<i32>, FixedError> {
        let full_scale = full_scale(&self.scene, &self.stress(frames)?) * self.prepare.reading_per_MPa;
        let codes = |frame: &Frame| quantise(&frame.stress_MPa, self.formats.code_bits, full_scale).codes;
        Ok(frames.iter().flat_map(codes).collect())
    }

    /// The codes of a frame of stress, from a converter without input options.
    ///
    /// # Errors
    /// [`FrameError`] if the frame's sensor is not the scene's.
    pub fn codes(&self, frame: &Frame) -> Result<Codes, FixedError> {
        frame.check(&self.scene)?;
        Ok(quantise(&frame.stress_MPa, self.formats.code_bits, full_scale(&self.scene, frame)))
    }

    /// Computes one reconstruction from its `codes`, `code_bits` wide: 2^average frames, each row-major over the array.
    pub fn run(&self, codes: &[i32]) -> Trace {
        if self.chooses() {
            return self.run_chosen(codes);
        }
        let codes = &mask_dead(&self.prepare.run(codes), &self.dead);
        let sensor = &self.scene.sensor;
        let solved: Vec<SubarrayTrace> =
            self.parts.iter().map(|part| SubarrayTrace::new(self, &part.gather(sensor, codes))).collect();
        let searched: Vec<bool> = solved.iter().map(|s| s.condition && self.searches()).collect();
        let cycles = Cycles::of(self, &searched);

        let mut forces = vec![Force::default(); sensor.taxels()];
        for (part, solved) in self.parts.iter().zip(&solved) {
            part.scatter(sensor, &solved.forces(self), &mut forces);
        }
        let contact = forces.iter().any(|f| f.words[2] != 0);
        let force_saturations = forces.iter().map(|f| f.saturations).sum();
        let flag = |set: bool, bit: u32| if set { bit } else { 0 };
        let status = solved.iter().flat_map(|s| {
            let status = Status {
                position: s.found.position,
                flags: flag(s.condition, FLAG_CONDITION)
                    | flag(s.found.score.is_some(), FLAG_FOUND)
                    | flag(!contact, FLAG_NO_CONTACT),
                score: s.found.score.unwrap_or(0) as i32,
                rescale: s.rescale,
                normalise: s.normalise,
                rescale_saturations: s.saturations,
                force_saturations,
                cycles: (cycles.first_output - self.prepare.latency() - self.resultants_delay()) as u32,
            };
            status.beats()
        });
        let status = status.collect();
        let quads = |name, stream: fn(&SubarrayTrace) -> &[[i64; 4]]| Stage {
            name,
            words: solved.iter().flat_map(stream).map(|quad| quad.to_vec()).collect(),
        };
        let sweeps = solved.iter().flat_map(|s| &s.found.sweeps);
        let candidate =
            |b: &Best| vec![i64::from(b.position[0]), i64::from(b.position[1]), b.score, i64::from(b.taken)];
        Trace {
            beats: match self.sends_resultants() {
                false => forces.iter().map(|f| f.words).collect(),
                true => self.parts.iter().flat_map(|part| resultants::beats(&sums(sensor, part, &forces))).collect(),
            },
            status,
            stages: self.as_engine_streams(vec![
                Stage { name: "receive", words: codes.iter().map(|&code| vec![i64::from(code)]).collect() },
                quads("normalise", |s| &s.normalised),
                quads("fold", |s| &s.folded),
                quads("pass", |s| &s.passed),
                quads("rescale", |s| &s.rescaled),
                quads("unfold", |s| &s.unfolded),
                Stage { name: "search", words: sweeps.map(candidate).collect() },
                quads("force", |s| &s.found.values),
            ]),
            cycles,
        }
    }

    /// The stages as the board's engine passes them on: the serial engine's single shifter passes on words, not quads.
    fn as_engine_streams(&self, mut stages: Vec<Stage>) -> Vec<Stage> {
        if self.board.engine == EngineKind::Serial {
            for stage in stages.iter_mut().filter(|stage| SINGLE_WORDS.contains(&stage.name)) {
                stage.words = stage.words.iter().flatten().map(|&word| vec![word]).collect();
            }
        }
        stages
    }

    /// Reconstructs one frame; for scenes with `input.average = 0`.
    ///
    /// # Errors
    /// As [`Model::stress`].
    pub fn reconstruct(&self, frame: &Frame) -> Result<Reconstruction, FixedError> {
        self.reconstruct_averaged(std::slice::from_ref(frame))
    }

    /// Reconstructs the mean of 2^average frames.
    ///
    /// # Errors
    /// As [`Model::stress`].
    pub fn reconstruct_averaged(&self, frames: &[Frame]) -> Result<Reconstruction, FixedError> {
        let trace = self.run(&self.readings(frames)?);
        self.decode(frames, "fixed", &trace.beats, &trace.status)
    }

    /// Converts the words that a device sent for the [`Model::readings`] of `readings`, the frames of one
    /// reconstruction, to physical units; `engine` names the device in the result.
    ///
    /// # Errors
    /// [`FixedError::Beats`] if forces or status are incomplete; errors of the frames as in [`Model::stress`].
    pub fn decode(
        &self,
        readings: &[Frame],
        engine: &str,
        beats: &[[i32; 3]],
        status: &[[i32; 3]],
    ) -> Result<Reconstruction, FixedError> {
        if self.chooses() {
            return self.decode_chosen(readings, engine, beats, status);
        }
        let input = Input::new(&self.scene)?;
        let frame = &input.calibrate(&input.average(&self.scene, readings)?);
        let codes = self.codes(frame)?;
        if beats.len() != self.force_beats() {
            return Err(FixedError::Beats { what: "forces", got: beats.len(), expected: self.force_beats() });
        }
        let expected = self.status_beats();
        if status.len() != expected {
            return Err(FixedError::Beats { what: "status", got: status.len(), expected });
        }
        let lsb = self.force_lsb_N(codes.full_scale_MPa);
        let axis = |axis: usize| beats.iter().map(|beat| f64::from(beat[axis]) * lsb).collect();
        let forces = match self.sends_resultants() {
            false => Forces { fx: axis(0), fy: axis(1), fz: axis(2) },
            true => Forces::default(),
        };
        let resultants = self.sends_resultants().then(|| self.resultants(beats, lsb));
        let sum = |all: &Vec<Resultant>| [0, 1, 2].map(|k| all.iter().map(|r| r.force_N[k]).sum::<f64>());
        let resultant_N = resultants.as_ref().map_or_else(|| forces.resultant(), sum);

        if !resultant_N.iter().all(|sum| sum.is_finite()) {
            return Err(FixedError::TooStrong { frame: frame.id.clone(), peak_MPa: frame.peak_MPa() });
        }
        let step = self.scene.search.mu_max / MU_STEPS as f64;
        let sensor = &self.scene.sensor;
        let mut flags = frame_flags(&self.scene, frame, &codes, input.noise_MPa());
        let mut subarrays = Vec::with_capacity(self.parts.len());
        for (part, beats) in self.parts.iter().zip(status.chunks(STATUS_BEATS)) {
            let Some(status) = Status::of_beats(beats) else { continue };
            let own = part.gather(sensor, &codes.codes);
            let floor = noise_floor_codes(&self.scene, &codes);
            let received = receive_codes(sensor, part, &own, floor, self.scene.partition.condition);
            let met = status.flags & FLAG_CONDITION != 0;
            let found = status.flags & FLAG_FOUND != 0;
            if met && self.searches() && !found {
                flags.push(Flag::NoCompression);
            }
            if status.rescale_saturations + status.force_saturations > 0 {
                flags.push(Flag::Saturated);
            }
            if status.flags & FLAG_COEFFICIENTS != 0 {
                flags.push(Flag::CoefficientsDamaged);
            }
            let received = Received { condition_met: met, ..received };
            let mu = status.position.map(|x| f64::from(x) * step);
            let score = found.then(|| -f64::from(status.score) / f64::from(1u32 << LOG_FRACTION));
            subarrays.push(SubarrayResult::new(part, &received, mu, score));
        }
        let mut result = assemble(&self.scene, frame, engine, subarrays, forces, flags);
        if self.sends_resultants() {
            // Without forces per taxel only the device knows whether there is a contact.
            let none = status.iter().step_by(STATUS_BEATS).all(|beat| beat[2] as u32 & FLAG_NO_CONTACT != 0);
            result.flags.retain(|flag| none || *flag != Flag::NoContact);
            result.resultant_N = resultant_N;
            result.error = frame.resultant_N.map(|truth| Errors::new(truth, resultant_N));
            result.extra.resultants = resultants;
        }
        let full_scale_share = input.full_scale_share(readings);
        let checks = Checks { full_scale_share, ..Checks::of(&self.scene, frame, &result) };
        result.add_checks(&self.scene, checks);
        Ok(result)
    }

    /// The resultants in a device's beats; one LSB of a force word is `lsb_N`.
    fn resultants(&self, beats: &[[i32; 3]], lsb_N: f64) -> Vec<Resultant> {
        let sensor = &self.scene.sensor;
        let half_pitch = [sensor.pitch_x_mm / 2.0, sensor.pitch_y_mm / 2.0];
        let resultant = |beats: &[[i32; 3]]| {
            let [fx, fy, fz, pressed, x, y] = resultants::of_beats(beats).unwrap_or_default().map(|sum| sum as f64);
            let centre = [x * half_pitch[0] / pressed, y * half_pitch[1] / pressed];
            Resultant { force_N: [fx, fy, fz].map(|f| f * lsb_N), centre_mm: (pressed > 0.0).then_some(centre) }
        };
        beats.chunks(resultants::BEATS).map(resultant).collect()
    }

    /// Whether the output is one resultant per subarray instead of a force per taxel.
    pub fn sends_resultants(&self) -> bool {
        self.scene.output.forces == ForceOutput::Resultants
    }

    /// Number of output beats of a frame before its status.
    pub fn force_beats(&self) -> usize {
        match self.sends_resultants() {
            false => self.scene.sensor.taxels(),
            true => resultants::BEATS * self.parts.len(),
        }
    }

    /// Cycles by which the first beat of resultants is later than the first beat of forces would be.
    pub(super) fn resultants_delay(&self) -> u64 {
        match self.sends_resultants() {
            false => 0,
            true => self.scene.sensor.taxels() as u64 - 1 + resultants::LATENCY,
        }
    }

    /// Number of status beats of a frame: [`STATUS_BEATS`] per subarray, in the order of the subarrays.
    pub fn status_beats(&self) -> usize {
        STATUS_BEATS * self.parts.len()
    }
}
