//! Errors of the bit-true model.

use std::fmt;

use thiserror::Error;

use crate::data::frame::FrameError;
use crate::data::input::InputError;
use crate::estimate::deviations::DeviationsError;
use crate::estimate::learned::LearnedError;
use crate::physics::matrices::MatricesError;
use crate::spec::adc::timing::TimingError;
use crate::spec::board::BoardError;
use crate::spec::partition::{Case, PartitionError};
use crate::spec::scene::SceneError;

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
    #[error("case {case} has subarrays of {quads} quads; several cases in one hardware need at least {least}")]
    SmallCase {
        /// The case.
        case: Case,
        /// Quads of a subarray.
        quads: usize,
        /// Fewest quads that a search shared by several cases takes.
        least: u64,
    },
    /// The design needs resources that the board lacks.
    #[error("{0}")]
    DoesNotFit(Box<Shortage>),
    /// The scene's board is unknown or its file invalid.
    #[error(transparent)]
    Board(#[from] BoardError),
    /// The scan that the scene asks for is impossible with its converter, its clock or its period.
    #[error("scene {scene}: {error}")]
    Scan {
        /// The scene's name.
        scene: String,
        /// The field and what it must be.
        error: TimingError,
    },
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
    /// The gain of a taxel is outside the range for which the hardware is built.
    #[error("input.calibration: the gain of taxel {taxel:?} is {gain}; hardware.table_range.gain allows {} to {}", allowed[0], allowed[1])]
    TableRange {
        /// Row and column.
        taxel: [usize; 2],
        /// Its gain, MPa per unit of the readings.
        gain: f64,
        /// Least and largest |gain|.
        allowed: [f64; 2],
    },
    /// A specimen is outside the range for which the hardware is built.
    #[error("{field}: {value} is not possible with these tables: {allowed}")]
    OutsideRange {
        /// The scene's field.
        field: &'static str,
        /// Its value.
        value: String,
        /// What is possible.
        allowed: String,
    },
    /// A scene asks of the hardware of another what is not in the tables that can be written.
    #[error("{part}: differs from that of the hardware's scene, and is in no table that can be written (input.calibration, input.tare, search.noise_floor_MPa, threshold.min_force_N; sensor.thickness_mm and input.dead with hardware.table_range)")]
    NoTable {
        /// The table or field of the scene.
        part: &'static str,
    },
    /// Tables for hardware that holds them in the bitstream, or a version that is none.
    #[error("{field}: {value} is not possible; expected {expected}")]
    Tables {
        /// The field.
        field: &'static str,
        /// Its value.
        value: String,
        /// What is possible.
        expected: &'static str,
    },
    /// A file named by the input options cannot be used, or the frames do not fit them.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The network that the scene names cannot be used.
    #[error(transparent)]
    Learned(#[from] LearnedError),
    /// The table of standard deviations that the scene names cannot be used.
    #[error(transparent)]
    Deviations(#[from] DeviationsError),
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

/// A change to a scene, and the resources of the changed scene.
#[derive(Clone, Debug, PartialEq)]
pub struct FitSuggestion {
    /// The change as written in a scene file.
    pub change: String,
    /// Degree of the polynomial with the change.
    pub degree: usize,
    /// Matrix lanes with the change.
    pub lanes: usize,
    /// Block RAMs with the change.
    pub block_rams: usize,
    /// Multipliers with the change.
    pub multipliers: usize,
    /// Cycles from the last input beat to the last output beat with the change, all subarrays searched.
    pub cycles: u64,
}

/// The resources by which a scene exceeds its board, and changes that make it fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Shortage {
    /// The scene's name.
    pub scene: String,
    /// The board's name.
    pub board: String,
    /// Resources the board lacks: (name, required, available).
    pub lacking: Vec<(&'static str, usize, usize)>,
    /// Changes of which each alone makes the scene fit; empty if none was found.
    pub suggestions: Vec<FitSuggestion>,
}

impl fmt::Display for Shortage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let lacking = self.lacking.iter().map(|(what, needs, has)| format!("{needs} {what}, there are {has}"));
        write!(f, "scene {} does not fit {}: it needs ", self.scene, self.board)?;
        write!(f, "{}", lacking.collect::<Vec<_>>().join("; "))?;
        if self.suggestions.is_empty() {
            return write!(f, "; no finer partition, lower degree, pruning or number of lanes makes it fit");
        }
        write!(f, "; it fits with any one of:")?;
        for FitSuggestion { change, degree, lanes, block_rams, multipliers, cycles } in &self.suggestions {
            write!(f, "\n  {change}: {block_rams} block RAMs, {multipliers} multipliers, ")?;
            write!(f, "{lanes} lanes, degree {degree}, {cycles} cycles")?;
        }
        Ok(())
    }
}
