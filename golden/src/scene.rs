//! Scene: everything a run needs to know about sensor, method, number formats and hardware, from a TOML file.
//!
//! Every table but `[sensor]` has defaults; an unknown field, a value out of range or a wrong type is an error that
//! names the file, the field and what is allowed. Sizes are checked here, before anything of their size is allocated.
//!
//! | table | fields (default) |
//! |---|---|
//! | top | `name` (file name; 1 … 64 letters, digits, `-`, `_`, `.`, inner spaces) |
//! | `[sensor]` | `rows`, `cols` (2 … 256), `pitch_x_mm`, `pitch_y_mm`, `thickness_mm` (0 … 10⁶] |
//! | `[medium]` | `kind` ("half-space"; "bonded-layer" with `poisson`, 0.48) |
//! | `[partition]` | `case` (0; 1 … 3, "adaptive", "contacts") or `rows`, `cols` |
//! | | `cases` (of "adaptive": 0 and others of 1 … 3, what hardware builds; without it all that fit together) |
//! | | `condition` ("loaded"; "both-signs") |
//! | `[search]` | `objective` ("sparse"; …), `mu_max` (0.6; 0, or 0.001 … 2), `noise_floor_MPa` (0) |
//! | | `form` ("oblique"; "orthogonal") |
//! | `[inverse]` | `kind` ("tsvd"; "tikhonov", "exact"), `level` (floor of format and noise; 0 … 1, both excluded) |
//! | `[threshold]` | `min_force_N` (0) |
//! | `[fixed]` | `input_bits` (20; 8 … 24), `data_bits` (18; 12 … 18), `coef_bits` (18; 8 … 18) |
//! | | `inverse_bits` (24; `coef_bits` … 32), `prune_bits` (20; 8 … 31), `lanes` (what the board allows; 4, 8 … 1024) |
//! | `[hardware]` | `board` ("ulx3s-85f"), `link` ("uart"; "spi"), `coefficient_check` ("none"; "signature") |
//! | `[input]` | `full_scale_MPa` (the frame's peak), `average` (0 … 12), `calibration`, `tare` (files), `dead` |
//! | | (\[row, col\] each), `unipolar` (false) |
//! | `[output]` | `forces` ("taxels"; "resultants") |

mod error;
pub mod inverse;
mod load;
mod parse;
mod reader;
mod supported;
#[cfg(test)]
mod tests;

pub use error::SceneError;
pub use inverse::{InverseKind, InverseSpec, Inversion};

use crate::frame::Frame;
use crate::link::LinkKind;
use crate::partition::{subarrays, Case};
use crate::sensor::Sensor;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::PathBuf;

/// One complete set of choices.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Name in reports.
    pub name: String,
    /// The taxel array.
    pub sensor: Sensor,
    /// What lies between surface and taxels.
    pub medium: Medium,
    /// How the array is cut and when a subarray is searched.
    pub partition: PartitionSpec,
    /// Objective and range of the μ search.
    pub search: SearchSpec,
    /// Which singular values are inverted.
    pub inverse: InverseSpec,
    /// Forces too small to report.
    pub threshold: ThresholdSpec,
    /// Widths of the fixed-point pipeline.
    pub fixed: FixedSpec,
    /// Target of the generated hardware.
    pub hardware: HardwareSpec,
    /// Meaning of the input codes.
    pub input: InputSpec,
    /// What a result holds.
    pub output: OutputSpec,
}

/// Elastic body over the taxels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Medium {
    /// Infinitely deep; the stress holds for any Poisson ratio.
    #[default]
    HalfSpace,
    /// A layer of the sensor's thickness on a rigid base.
    BondedLayer {
        /// Poisson ratio, at least 0 and below 0.5.
        poisson: f64,
    },
}

impl Medium {
    /// What [`Medium::allows_poisson`] accepts, for messages.
    pub const POISSON_ALLOWED: &'static str = "a number above 0 and below 0.5";

    /// Whether a bonded layer may have this Poisson ratio, in scenes and frames alike.
    pub fn allows_poisson(poisson: f64) -> bool {
        poisson > 0.0 && poisson < 0.5
    }
}

impl fmt::Display for Medium {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Medium::HalfSpace => write!(f, "half-space"),
            Medium::BondedLayer { poisson } => write!(f, "bonded-layer, poisson {poisson}"),
        }
    }
}

/// When a subarray's μ is searched.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Condition {
    /// Wherever the load exceeds the noise floor.
    #[default]
    Loaded,
    /// The paper's centroid condition: compression and tension both exceed it.
    BothSigns,
}

/// What the μ search maximises.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ObjectiveKind {
    /// Forces on few taxels.
    #[default]
    Sparse,
    /// No tensile forces.
    Compressive,
    /// Pressure symmetric about its centre.
    Symmetric,
    /// One elliptic contact.
    Patch,
    /// Chosen from the noise floor and the pitch.
    Auto,
}

/// How Eq. 1 is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Form {
    /// p = Cz⁺ b and its series in μ, a quarter of the storage.
    #[default]
    Oblique,
    /// C†b + (I − C†C) w, as printed.
    Orthogonal,
}

/// Table `[partition]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartitionSpec {
    /// Which subarrays.
    pub case: Case,
    /// Of [`Case::Adaptive`], the paper's cases to choose from, 0 among them; `None` where the scene lists none.
    pub listed: Option<[bool; 4]>,
    /// When a subarray is searched.
    pub condition: Condition,
}

/// Table `[search]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchSpec {
    /// What is maximised.
    pub objective: ObjectiveKind,
    /// Largest ratio of shear to normal force, 0.001 to 2; or 0, which asks for no shear and for no search.
    pub mu_max: f64,
    /// Stress in MPa that counts as none.
    pub noise_floor_MPa: f64,
    /// How Eq. 1 is computed.
    pub form: Form,
}

/// Table `[threshold]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThresholdSpec {
    /// Smallest normal force in N that is reported.
    pub min_force_N: f64,
}

/// Table `[fixed]`: widths in bits, signs included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FixedSpec {
    /// Converter codes.
    pub input_bits: u32,
    /// Vectors between the stages.
    pub data_bits: u32,
    /// Coefficients of Ax and Ay.
    pub coef_bits: u32,
    /// Coefficients of Cz⁺, taken in limbs.
    pub inverse_bits: u32,
    /// Columns whose coefficients all stay below 2^−`prune_bits` are not stored; 8 to 31.
    pub prune_bits: u32,
    /// Matrix lanes, a multiple of 4; `None` takes as many as the board's multipliers and block RAMs allow.
    pub lanes: Option<u32>,
}

/// Whether the hardware watches its coefficient memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CoefficientCheck {
    /// It does not.
    #[default]
    None,
    /// Each subarray's status tells when a word that was read is not what it was, see [`crate::fixed::check`].
    Signature,
}

/// Table `[hardware]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HardwareSpec {
    /// One of [`crate::board::Board::names`].
    pub board: String,
    /// What stands between the board and its host.
    pub link: LinkKind,
    /// Whether the coefficient memory is watched.
    pub coefficient_check: CoefficientCheck,
}

/// Table `[input]`; its meaning is in [`crate::input`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InputSpec {
    /// Stress in MPa of the largest code; `None` takes each frame's peak.
    pub full_scale_MPa: Option<f64>,
    /// 2^average frames are averaged, 0 to 12.
    pub average: u32,
    /// Table of offsets and gains, found from the working folder.
    pub calibration: Option<PathBuf>,
    /// Frame read without contact, found from the working folder.
    pub tare: Option<PathBuf>,
    /// Taxels left out of the inverse, [row, col], sorted, each once, fewer than all.
    pub dead: Vec<[usize; 2]>,
    /// The sensor reads tension as zero.
    pub unipolar: bool,
}

/// Forces in a result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ForceOutput {
    /// One vector per taxel.
    #[default]
    Taxels,
    /// One per subarray or contact, with its centre of pressure.
    Resultants,
}

/// Table `[output]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OutputSpec {
    /// Taxels or resultants.
    pub forces: ForceOutput,
}

impl PartitionSpec {
    /// The paper's cases that [`Case::Adaptive`] chooses from, where they divide `sensor`.
    pub fn choices(&self, sensor: &Sensor) -> Vec<Case> {
        let listed = |number: &i64| self.listed.is_none_or(|listed| listed[*number as usize]);
        let divides = |case: &Case| subarrays(*case, sensor).is_ok();
        (0..4).filter(listed).filter_map(Case::numbered).filter(divides).collect()
    }
}

impl InputSpec {
    /// Noise of the mean of 2^average frames over that of a single one, 2^(−average/2).
    pub fn noise_share(&self) -> f64 {
        2f64.powf(-f64::from(self.average) / 2.0)
    }

    /// The frame with 0 for what its dead taxels read: neither the peak nor the condition is to see it.
    pub fn mask_dead(&self, mut frame: Frame) -> Frame {
        let cols = frame.sensor.cols;
        for [row, col] in &self.dead {
            // A frame of another sensor may lack the taxel; it is refused where it is used.
            frame.stress_MPa.get_mut(row * cols + col).into_iter().for_each(|b| *b = 0.0);
        }
        frame
    }
}

impl Default for PartitionSpec {
    fn default() -> Self {
        let condition = Condition::default();
        PartitionSpec { case: Case::WHOLE, listed: None, condition }
    }
}

impl Default for SearchSpec {
    fn default() -> Self {
        SearchSpec { objective: ObjectiveKind::default(), mu_max: 0.6, noise_floor_MPa: 0.0, form: Form::default() }
    }
}

impl Default for ThresholdSpec {
    fn default() -> Self {
        ThresholdSpec { min_force_N: 0.0 }
    }
}

impl Default for FixedSpec {
    fn default() -> Self {
        FixedSpec { input_bits: 20, data_bits: 18, coef_bits: 18, inverse_bits: 24, prune_bits: 20, lanes: None }
    }
}

impl Default for HardwareSpec {
    fn default() -> Self {
        HardwareSpec { board: "ulx3s-85f".to_string(), link: LinkKind::Uart, coefficient_check: CoefficientCheck::None }
    }
}

impl ObjectiveKind {
    /// Every objective with its name in a scene file.
    pub const NAMES: [(&'static str, ObjectiveKind); 5] = [
        ("sparse", ObjectiveKind::Sparse),
        ("compressive", ObjectiveKind::Compressive),
        ("symmetric", ObjectiveKind::Symmetric),
        ("patch", ObjectiveKind::Patch),
        ("auto", ObjectiveKind::Auto),
    ];

    /// Name in a scene file.
    pub fn name(self) -> &'static str {
        let named = Self::NAMES.iter().find(|(_, kind)| *kind == self);
        named.map_or("", |(name, _)| name)
    }
}

impl Scene {
    /// The default choices for a sensor.
    pub fn of_sensor(sensor: &Sensor, name: &str) -> Scene {
        Scene {
            name: name.to_string(),
            sensor: sensor.clone(),
            medium: Medium::default(),
            partition: PartitionSpec::default(),
            search: SearchSpec::default(),
            inverse: InverseSpec::default(),
            threshold: ThresholdSpec::default(),
            fixed: FixedSpec::default(),
            hardware: HardwareSpec::default(),
            input: InputSpec::default(),
            output: OutputSpec::default(),
        }
    }
}
