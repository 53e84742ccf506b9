//! The bit-true model of one scene, all stages in a row.

use thiserror::Error;

use super::arith::signed_bits;
use super::cycles::Cycles;
use super::formats::{derive, force_shift, Formats, Quantised, HALVINGS, LOG_FRACTION, MU_STEPS};
use super::pass::{pass, Operands};
use super::quads::Quads;
use super::schedule::{schedule, EXPONENTS};
use super::search::{search, Block};
use super::send::{Status, FLAG_CONDITION, FLAG_FOUND, FLAG_NO_CONTACT};
use super::{fold, force, normalise, receive, rescale, unfold};
use crate::flags::{frame_flags, Flag};
use crate::float::receive::receive as judge;
use crate::frame::{Forces, Frame, FrameError};
use crate::matrices::{Matrices, MatricesError};
use crate::partition::Subarray;
use crate::quantise::{full_scale, noise_floor_codes, quantise, Codes};
use crate::reconstruct::{assemble, Reconstruction, SubarrayResult};
use crate::scene::{Condition, Scene, SceneError};

/// Why a scene has no bit-true model, or a frame no result.
#[derive(Debug, Error)]
pub enum FixedError {
    /// The scene asks for something that is not there.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The frame does not belong to the scene.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The matrices of the scene cannot be computed.
    #[error(transparent)]
    Matrices(#[from] MatricesError),
    /// A word would need more bits than the hardware has.
    #[error("{what} needs {needs} bits, the hardware has {has}: lower fixed.input_bits, fixed.inverse_bits or search.mu_max")]
    Format {
        /// The word.
        what: &'static str,
        /// Bits it needs.
        needs: u32,
        /// Bits there are.
        has: u32,
    },
    /// A threshold or noise floor in physical units, but no scale for the codes.
    #[error("{field} = {value} needs input.full_scale_MPa: without it the hardware does not know what a code means")]
    NoFullScale {
        /// The scene's field.
        field: &'static str,
        /// Its value.
        value: f64,
    },
    /// A device sent another number of beats than the scene has.
    #[error("{what}: got {got} beats, expected {expected}")]
    Beats {
        /// Which beats.
        what: &'static str,
        /// How many came.
        got: usize,
        /// How many belong there.
        expected: usize,
    },
    /// A derivation contradicts itself; a defect of this crate.
    #[error("internal: {0}")]
    Internal(&'static str),
}

/// What one stage passed on in a frame, in the hardware's order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stage {
    /// The stage's name, equal to the hardware's tap.
    pub name: &'static str,
    /// Words of signed fields.
    pub words: Vec<Vec<i64>>,
}

/// Everything the hardware does with one frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Trace {
    /// Forces `[fx, fy, fz]` in LSBs, row-major.
    pub beats: Vec<[i32; 3]>,
    /// Status beats, packed alike.
    pub status: Vec<[i32; 3]>,
    /// The stages' streams.
    pub stages: Vec<Stage>,
    /// Cycle counts that the hardware keeps at full speed.
    pub cycles: Cycles,
}

/// The bit-true model of one scene.
#[derive(Clone, Debug)]
pub struct Model {
    /// The scene.
    pub scene: Scene,
    /// Widths and scales.
    pub formats: Formats,
    /// Quantised matrices.
    pub quantised: Quantised,
    /// Noise floor in codes.
    pub noise_floor: i32,
    /// Threshold in force LSBs.
    pub threshold: i64,
    layout: Quads,
}

impl Model {
    /// Computes and quantises the scene's matrices and derives its formats.
    ///
    /// # Errors
    /// What the scene asks for is not available, its matrices or formats do not exist, or a threshold or noise floor
    /// lacks its full scale.
    pub fn new(scene: &Scene) -> Result<Self, FixedError> {
        scene.require_supported()?;
        let matrices = Matrices::new(&scene.sensor, scene.search.mu_max)?;
        let (formats, quantised) = derive(scene, &matrices)?;
        let scaled = |field, value: f64, unit: &dyn Fn(f64) -> f64| match scene.input.full_scale_MPa {
            _ if value == 0.0 => Ok(0.0),
            Some(full_scale) => Ok(value / unit(full_scale)),
            None => Err(FixedError::NoFullScale { field, value }),
        };
        let code_lsb = |full_scale: f64| quantise(&[], scene.fixed.input_bits, full_scale).lsb_MPa();
        let noise_floor = scaled("search.noise_floor_MPa", scene.search.noise_floor_MPa, &code_lsb)?;
        let force_lsb = |full_scale: f64| code_lsb(full_scale) * 2f64.powi(formats.force_exponent);
        let threshold = scaled("threshold.min_force_N", scene.threshold.min_force_N, &force_lsb)?;
        Ok(Model {
            scene: scene.clone(),
            noise_floor: noise_floor.floor().min(f64::from(i32::MAX)) as i32,
            threshold: threshold.ceil().min(f64::from(u32::MAX)) as i64,
            layout: Quads { rows: scene.sensor.rows, cols: scene.sensor.cols },
            formats,
            quantised,
        })
    }

    /// The model for `frames`: a scene without full scale whose threshold or noise floor needs one takes the frames' largest |b|.
    ///
    /// # Errors
    /// As [`Model::new`].
    pub fn for_frames(scene: &Scene, frames: &[Frame]) -> Result<Self, FixedError> {
        let mut scene = scene.clone();
        let needs = scene.search.noise_floor_MPa > 0.0 || scene.threshold.min_force_N > 0.0;
        if needs && scene.input.full_scale_MPa.is_none() {
            let largest = frames.iter().map(|frame| full_scale(&scene, frame)).fold(0.0, f64::max);
            scene.input.full_scale_MPa = (largest > 0.0).then_some(largest);
        }
        Model::new(&scene)
    }

    /// The quad layout of the array.
    pub fn layout(&self) -> Quads {
        self.layout
    }

    /// Whether the hardware has a μ search.
    pub fn searches(&self) -> bool {
        self.formats.degree > 0
    }

    /// Force per LSB of the output words in N, for codes whose largest means `full_scale_MPa`.
    pub fn force_lsb_N(&self, full_scale_MPa: f64) -> f64 {
        quantise(&[], self.formats.input_bits, full_scale_MPa).lsb_MPa() * 2f64.powi(self.formats.force_exponent)
    }

    /// The codes of a frame as this scene's converter gives them.
    ///
    /// # Errors
    /// [`FrameError`] when the frame's sensor is not the scene's.
    pub fn codes(&self, frame: &Frame) -> Result<Codes, FixedError> {
        frame.check(&self.scene)?;
        Ok(quantise(&frame.stress_MPa, self.formats.input_bits, full_scale(&self.scene, frame)))
    }

    /// Runs one frame of `codes`, row-major, `input_bits` wide.
    pub fn run(&self, codes: &[i32]) -> Trace {
        let formats = &self.formats;
        let received = receive::receive(codes, self.noise_floor);
        let condition = match self.scene.partition.condition {
            Condition::Loaded => received.positive || received.negative,
            Condition::BothSigns => received.positive && received.negative,
        };
        let samples: Vec<i64> = codes.iter().map(|&code| i64::from(code)).collect();
        let left = normalise::shift(received.magnitude, formats.input_bits);
        let normalised = normalise::normalise(&self.layout.pack(&samples), left);
        let folded = fold::fold(&normalised);

        let mut operands = Operands::of_input(&folded, formats);
        let (mut passed, mut rescaled, mut unfolded) = (Vec::new(), Vec::new(), Vec::new());
        let (mut right, mut rescale_saturations) = (0, 0);
        let mut polynomials = vec![[[0i64; 10]; 4]; formats.quads];
        for (k, products) in schedule(formats).iter().enumerate() {
            let accumulators = pass(formats, &self.quantised, products, &operands);
            if k == 0 {
                right = rescale::shift(formats, rescale::raw_length(&accumulators));
            }
            let shift = if k == 0 { right } else { formats.a_shift };
            let (words, saturations) = rescale::rescale(formats, &accumulators, shift);
            rescale_saturations += saturations;
            operands.vectors.push(rescale::operand(formats, &words));
            let taxels = unfold::unfold(&words, EXPONENTS[k].0 + EXPONENTS[k].1);
            for (quad, values) in polynomials.iter_mut().zip(&taxels) {
                for (w, &value) in quad.iter_mut().zip(values) {
                    w[k] = value;
                }
            }
            passed.extend(accumulators);
            rescaled.extend(words);
            unfolded.extend(taxels);
        }

        let searching = condition && self.searches();
        let found = search(self.layout, Block::new(self.layout, polynomials), searching);
        let mu = found.position.map(|x| force::mu_word(formats, x));
        let shift = force_shift(formats, left, right);
        let forces: Vec<force::Force> = self
            .layout
            .unpack(&found.values)
            .into_iter()
            .map(|value| force::force(formats, value, mu, shift, self.threshold))
            .collect();
        let contact = forces.iter().any(|f| f.words[2] != 0);
        let cycles = Cycles::of(self, searching);
        let flag = |set: bool, bit: u32| if set { bit } else { 0 };
        let status = Status {
            position: found.position,
            flags: flag(condition, FLAG_CONDITION)
                | flag(found.score.is_some(), FLAG_FOUND)
                | flag(!contact, FLAG_NO_CONTACT),
            score: found.score.unwrap_or(0) as i32,
            rescale: right,
            normalise: left,
            rescale_saturations,
            force_saturations: forces.iter().map(|f| f.saturations).sum(),
            cycles: cycles.first_output as u32,
        };
        let quads = |words: &[[i64; 4]]| words.iter().map(|quad| quad.to_vec()).collect();
        let sweeps = found
            .sweeps
            .iter()
            .map(|best| {
                vec![i64::from(best.position[0]), i64::from(best.position[1]), best.score, i64::from(best.taken)]
            })
            .collect();
        Trace {
            beats: forces.iter().map(|f| f.words).collect(),
            status: status.beats().to_vec(),
            stages: vec![
                Stage { name: "receive", words: samples.iter().map(|&s| vec![s]).collect() },
                Stage { name: "normalise", words: quads(&normalised) },
                Stage { name: "fold", words: quads(&folded) },
                Stage { name: "pass", words: quads(&passed) },
                Stage { name: "rescale", words: quads(&rescaled) },
                Stage { name: "unfold", words: quads(&unfolded) },
                Stage { name: "search", words: sweeps },
                Stage { name: "force", words: quads(&found.values) },
            ],
            cycles,
        }
    }

    /// Reconstructs a frame with the bit-true model.
    ///
    /// # Errors
    /// As [`Model::codes`].
    pub fn reconstruct(&self, frame: &Frame) -> Result<Reconstruction, FixedError> {
        let trace = self.run(&self.codes(frame)?.codes);
        self.decode(frame, "fixed", &trace.beats, &trace.status)
    }

    /// Puts what a device sent for `frame` into physical units.
    ///
    /// # Errors
    /// [`FixedError::Beats`] when forces or status are not complete; the frame's errors as in [`Model::codes`].
    pub fn decode(
        &self,
        frame: &Frame,
        engine: &str,
        beats: &[[i32; 3]],
        status: &[[i32; 3]],
    ) -> Result<Reconstruction, FixedError> {
        let codes = self.codes(frame)?;
        let taxels = self.scene.sensor.taxels();
        if beats.len() != taxels {
            return Err(FixedError::Beats { what: "forces", got: beats.len(), expected: taxels });
        }
        let status = Status::of_beats(status).ok_or(FixedError::Beats {
            what: "status",
            got: status.len(),
            expected: super::send::STATUS_BEATS,
        })?;
        let lsb = self.force_lsb_N(codes.full_scale_MPa);
        let axis = |axis: usize| beats.iter().map(|beat| f64::from(beat[axis]) * lsb).collect();
        let forces = Forces { fx: axis(0), fy: axis(1), fz: axis(2) };

        let found = status.flags & FLAG_FOUND != 0;
        let met = status.flags & FLAG_CONDITION != 0;
        let step = self.scene.search.mu_max / MU_STEPS as f64;
        let floor = noise_floor_codes(&self.scene, &codes);
        let sensor = &self.scene.sensor;
        let part = Subarray { row0: 0, col0: 0, rows: sensor.rows, cols: sensor.cols };
        let receipt = judge(sensor, &part, &codes.codes, floor, self.scene.partition.condition);
        let subarray = SubarrayResult {
            row0: part.row0,
            col0: part.col0,
            rows: part.rows,
            cols: part.cols,
            centroid_condition: met,
            compression_centroid_mm: receipt.compression_centroid_mm,
            tension_centroid_mm: receipt.tension_centroid_mm,
            mu: status.position.map(|x| f64::from(x) * step),
            objective_value: found.then(|| -f64::from(status.score) / f64::from(1u32 << LOG_FRACTION)),
        };
        let mut flags = frame_flags(&self.scene, frame, &codes);
        if met && self.searches() && !found {
            flags.push(Flag::NoCompression);
        }
        if status.rescale_saturations + status.force_saturations > 0 {
            flags.push(Flag::Saturated);
        }
        Ok(assemble(&self.scene, frame, engine, vec![subarray], forces, flags))
    }

    /// Bits of a position word: ±(3·2^7), and one step beyond at the last level.
    pub fn position_bits(&self) -> u32 {
        signed_bits(4u64 << HALVINGS)
    }
}
