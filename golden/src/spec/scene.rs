//! Scene: sensor, method, number formats and hardware of a run, read from a TOML file.
//!
//! Every table except `[sensor]` has defaults. An unknown field, a value out of range or a wrong type is an error that
//! names the file, the field and what is allowed. Sizes are checked here, before anything of their size is allocated.
//!
//! | table | fields (default) |
//! |---|---|
//! | top | `name` (file name; 1 … 64 letters, digits, `-`, `_`, `.`, inner spaces) |
//! | `[sensor]` | `rows`, `cols` (2 … 256), `pitch_x_mm`, `pitch_y_mm`, `thickness_mm` (0 … 10⁶] |
//! | `[medium]` | `kind` ("half-space"; "bonded-layer" with `poisson`, 0.48) |
//! | `[partition]` | `case` (0; 1 … 3, "adaptive", "contacts") or `rows`, `cols` |
//! | | `cases` (for "adaptive": 0 and others of 1 … 3 for the hardware; without it as many as fit together) |
//! | | `condition` ("loaded"; "both-signs"), `max_contacts` (for "contacts" with a network: 8; 1 … 8) |
//! | `[search]` | `objective` ("sparse"; …), `mu_max` (0.6; 0, or 0.001 … 2), `noise_floor_MPa` (not stated) |
//! | | `form` ("oblique"; "orthogonal"), `estimator` (chosen: [`Scene::model_estimator`]; "search", "evidence", "network", |
//! | | "evidence+network", "combined"), `degree` (none; 1 … 8) |
//! | | `network` (none; a file, or one of the program: "dermis:sensor-1", …), `deviations` (none; a file) |
//! | `[inverse]` | `kind` ("tsvd"; "tikhonov", "exact"), `level` (floor of format and noise; 0 … 1, both excluded) |
//! | `[threshold]` | `min_force_N` (0) |
//! | `[fixed]` | `input_bits` (20; 8 … 24), `data_bits` (18; 12 … 18), `coef_bits` (18; 8 … 18) |
//! | | `inverse_bits` (24; `coef_bits` … 32), `prune_bits` (20; 8 … 31), `lanes` (as many as fit; 4, 8 … 1024) |
//! | `[hardware]` | `board` ("ulx3s-85f"), `link` ("uart"; "spi"), `coefficient_check` ("none"; "signature") |
//! | | `search_width` (the board's; 4, 2, 1), `tables` ("rom"; "writable") |
//! | | `estimator` (chosen: [`Scene::choose_for_hardware`]; "search", "network") |
//! | | `source` ("stream"; "adc-scan"): whether codes come as a stream or the hardware scans the array |
//! | `[hardware.table_range]` | `gain` (that of the scene's table; \[least, largest\]), `thickness_mm` (the sensor's; \[least, largest\]) |
//! | | `dead_taxels` (0; fewer than all): what writable tables may hold |
//! | `[hardware.adc_scan]` | `converter` ("max11125", "ads8688"), `converters` (1), `channels` (cols / converters), `sclk_MHz` |
//! | | `row_settling_us` (0), `channel_settling_us` (0), `samples` (1; 2, 4 … 256), `period_us` |
//! | `[input]` | `full_scale_MPa` (the frame's peak), `average` (0 … 12), `mean` ("block"; "sliding") |
//! | | `calibration`, `tare` (files), `dead` (\[row, col\] each), `unipolar` (false), `gain_spread` (0; 0 … 1) |
//! | | `plausible_MPa` (10), `missing_share` (0.2; 0 … 0.5) |
//! | | `zero` ("fixed"; "running" with `zero_average`, 10; 1 … 16, and `zero_limit_MPa`, 1/64 of the full scale) |
//! | `[output]` | `forces` ("taxels"; "resultants") |

mod adc_scan;
mod error;
mod estimator;
mod estimator_choice;
pub mod inverse;
mod inversion;
mod load;
mod parse;
mod reader;
mod supported;
#[cfg(test)]
mod tests;

pub use error::SceneError;
pub use estimator::EstimatorKind;
pub use inverse::{InverseKind, InverseSpec, Inversion};

use crate::spec::adc::AdcScan;
use crate::spec::link_kind::LinkKind;
use crate::spec::partition::{subarrays, Case};
use crate::spec::sensor::Sensor;
use crate::spec::sliding;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::PathBuf;

/// One scene, all fields checked and defaults filled in.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Name in reports.
    pub name: String,
    /// The taxel array.
    pub sensor: Sensor,
    /// The elastic body between surface and taxels.
    pub medium: Medium,
    /// Partition of the array, and the condition under which a subarray is searched.
    pub partition: PartitionSpec,
    /// Objective and range of the μ search.
    pub search: SearchSpec,
    /// Kind and level of the pseudo-inverse.
    pub inverse: InverseSpec,
    /// Threshold below which forces are reported as zero.
    pub threshold: ThresholdSpec,
    /// Widths of the fixed-point pipeline.
    pub fixed: FixedSpec,
    /// Target of the generated hardware.
    pub hardware: HardwareSpec,
    /// Scale, calibration and averaging of the input.
    pub input: InputSpec,
    /// Contents of a result.
    pub output: OutputSpec,
}

/// Elastic body over the taxels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Medium {
    /// Infinitely deep; the normal stress does not depend on the Poisson ratio.
    #[default]
    HalfSpace,
    /// A layer of the sensor's thickness on a rigid base.
    BondedLayer {
        /// Poisson ratio, above 0 and below 0.5.
        poisson: f64,
    },
}

impl Medium {
    /// Poisson ratio of a bonded layer for which none is stated: that of silicone and polyurethane.
    pub const ELASTOMER: f64 = 0.48;
    /// The range of [`Medium::allows_poisson`] in words, for messages.
    pub const POISSON_ALLOWED: &'static str = "a number above 0 and below 0.5";

    /// Whether a bonded layer may have this Poisson ratio, in scenes and in frames.
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

/// The condition under which a subarray's μ is searched.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Condition {
    /// Some |stress| exceeds the noise floor.
    #[default]
    Loaded,
    /// The paper's centroid condition: compression and tension both exceed the noise floor.
    BothSigns,
}

/// The objective that the μ search maximises; see [`crate::estimate::float::objective`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ObjectiveKind {
    /// Force on few taxels.
    #[default]
    Sparse,
    /// No tensile forces.
    Compressive,
    /// Pressure symmetric about its centre.
    Symmetric,
    /// One elliptic contact.
    Patch,
    /// Chosen per frame by the misfits of the others and the noise floor.
    Auto,
}

/// How Eq. 1 is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Form {
    /// p = Cz⁺ b and its series in μ, with a quarter of the storage.
    #[default]
    Oblique,
    /// C†b + (I − C†C) w, as the paper prints it.
    Orthogonal,
}

/// Table `[partition]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartitionSpec {
    /// The partition into subarrays.
    pub case: Case,
    /// For [`Case::Adaptive`]: which of the paper's cases 0 to 3 may be chosen, 0 among them; `None` if the scene lists
    /// none.
    pub listed: Option<[bool; 4]>,
    /// The condition under which a subarray is searched.
    pub condition: Condition,
    /// For [`Case::Contacts`] with a network: how many contacts get a μ, 1 to [`MAX_CONTACTS`]; of more those with the
    /// largest loads.
    pub max_contacts: usize,
}

/// Largest and default number of contacts that get a μ of their own.
pub const MAX_CONTACTS: usize = 8;

/// Table `[search]`.
#[derive(Clone, Debug, PartialEq)]
pub struct SearchSpec {
    /// The estimator of the floating-point model; `None` takes [`Scene::model_estimator`].
    pub estimator: Option<EstimatorKind>,
    /// The objective that is maximised.
    pub objective: ObjectiveKind,
    /// Largest ratio of shear to normal force, 0.001 to 2; 0 means no shear and no search.
    pub mu_max: f64,
    /// Standard deviation of the noise of one reading in MPa, and the stress up to which a reading counts as noise, ≥ 0; 0 for
    /// a simulation without noise. `None`: not stated.
    pub noise_floor_MPa: Option<f64>,
    /// How Eq. 1 is computed.
    pub form: Form,
    /// Degree of the series in μ, 1 to 8; `None` takes what the sensor needs, see [`crate::estimate::degree`].
    pub degree: Option<usize>,
    /// Path of a trained network, relative to the working folder, or ending in `dermis:NAME`: one of the program's own.
    pub network: Option<PathBuf>,
    /// Path of a table of standard deviations, relative to the working folder, see [`crate::estimate::deviations`].
    pub deviations: Option<PathBuf>,
}

/// Table `[threshold]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThresholdSpec {
    /// Smallest normal force in N that is reported, ≥ 0.
    pub min_force_N: f64,
}

/// Table `[fixed]`: widths in bits, signs included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FixedSpec {
    /// Width of the converter's codes, 8 to 24.
    pub input_bits: u32,
    /// Width of the vectors between the stages, 12 to 18.
    pub data_bits: u32,
    /// Width of the coefficients of Ax and Ay, 8 to 18.
    pub coef_bits: u32,
    /// Width of the coefficients of Cz⁺, `coef_bits` to 32; multiplied in two limbs.
    pub inverse_bits: u32,
    /// Columns whose coefficients are all below 2^−`prune_bits` of the largest are not stored; 8 to 31.
    pub prune_bits: u32,
    /// Matrix lanes, a multiple of 4 from 4 to 1024; `None` takes as many as the board's multipliers and block RAMs
    /// allow.
    pub lanes: Option<u32>,
}

/// Highest degree of the hardware and its bit-true model.
pub const MAX_DEGREE: usize = 3;
/// Highest degree of the floating-point model: enough for square taxels with a pitch of half their depth.
pub const MAX_FLOAT_DEGREE: usize = 8;

/// Largest code of `bits` bits: 2^(bits − 1) − 1; `bits` 2 to 32.
pub fn largest_code(bits: u32) -> i32 {
    ((1i64 << (bits - 1)) - 1) as i32
}

/// Whether the hardware checks its coefficient memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CoefficientCheck {
    /// No check.
    #[default]
    None,
    /// The status of each subarray flags a changed coefficient word, see [`crate::fixed::plan::check`].
    Signature,
}

/// Fewest bits of a code with writable tables, whose bytes are numbers beyond the codes.
pub const TABLE_CODE_BITS: u32 = 9;

/// Where the tables of a specimen of the array stand: zero and gain of each taxel, threshold, noise floor, and coefficients if
/// [`TableRange`] has some.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TableStorage {
    /// In the bitstream, which then serves one specimen.
    #[default]
    Rom,
    /// Written while the engine rests ([`load`](crate::fixed::stages::load)); the bitstream holds those of its scene.
    Writable,
}

/// Table `[hardware.table_range]`: what the tables that are written may hold.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TableRange {
    /// Least and largest |gain|, above 0, in MPa per unit of the readings; `None` takes those of the scene's table, without one 1.
    pub gain: Option<[f64; 2]>,
    /// Least and largest thickness of the cover in mm, above 0; `None` is that of the sensor alone.
    pub thickness_mm: Option<[f64; 2]>,
    /// Most dead taxels; 0 leaves those of the scene as they are.
    pub dead_taxels: usize,
}

impl TableRange {
    /// Whether the coefficients differ between specimens: they are for another thickness, or for other dead taxels.
    pub fn has_coefficients(&self) -> bool {
        self.thickness_mm.is_some() || self.dead_taxels > 0
    }
}

/// Table `[hardware]`.
#[derive(Clone, Debug, PartialEq)]
pub struct HardwareSpec {
    /// One of [`crate::spec::board::Board::names`], or the path of a board's file, relative to the working folder.
    pub board: String,
    /// The link between the board and its host.
    pub link: LinkKind,
    /// Whether the coefficient memory is checked.
    pub coefficient_check: CoefficientCheck,
    /// The estimator of the hardware, `search` or `network`; `None` takes [`Scene::choose_for_hardware`].
    pub estimator: Option<EstimatorKind>,
    /// Taxels that the search computes per cycle: 4, 2 or 1; `None` takes the board's.
    pub search_width: Option<usize>,
    /// Where the tables of a specimen stand.
    pub tables: TableStorage,
    /// What tables that are written may hold.
    pub table_range: TableRange,
    /// How the hardware scans the array by itself (`source = "adc-scan"`); `None` where codes come as a stream.
    pub adc_scan: Option<AdcScan>,
}

impl HardwareSpec {
    /// Whether tables are written.
    pub fn has_writable_tables(&self) -> bool {
        self.tables == TableStorage::Writable
    }

    /// Whether the coefficients of the passes are among the tables that are written.
    pub fn has_writable_coefficients(&self) -> bool {
        self.has_writable_tables() && self.table_range.has_coefficients()
    }

    /// Whether the dead taxels are those of the tables that are written.
    pub fn has_writable_dead_taxels(&self) -> bool {
        self.has_writable_tables() && self.table_range.dead_taxels > 0
    }

    /// The largest |gain|, which gives a code its meaning: that of `gains`, the scene's table, or 1; where tables are written
    /// that of [`TableRange`].
    pub fn largest_gain(&self, gains: Option<&[f64]>) -> f64 {
        match self.table_range.gain {
            Some([_, most]) if self.has_writable_tables() => most,
            _ => gains.map_or(1.0, |gains| gains.iter().fold(0.0, |most, gain| gain.abs().max(most))),
        }
    }

    /// Takes frames of stress, which need neither calibration nor converters: the tables are in the bitstream, codes come as a
    /// stream. The formats remain those of [`TableRange`]'s coefficients, so that a frame has the same forces.
    pub fn take_stress(&mut self) {
        self.tables = TableStorage::Rom;
        self.table_range.gain = None;
        self.adc_scan = None;
    }
}

/// How frames are averaged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum MeanKind {
    /// 2^average frames give one result.
    #[default]
    Block,
    /// Every frame gives a result, of the frames so far, of which older ones count less: [`crate::spec::sliding`].
    Sliding,
}

/// What the zero of each taxel is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Zero {
    /// The stored one: the mean of the tare frames, else the table's offset, else 0.
    #[default]
    Fixed,
    /// It starts as the stored one and follows the readings while nothing presses: [`crate::data::input::running_zero`].
    Running(RunningZero),
}

/// How the zero of each taxel follows its readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunningZero {
    /// The zero takes 2^−average of what a reading is off; 1 to 16.
    pub average: u32,
    /// Largest distance from the stored zero in MPa, and largest stress in MPa that is no touch; above 0, at most the full
    /// scale.
    pub limit_MPa: f64,
}

impl RunningZero {
    /// Default of `input.zero_average`: a second at 1 kHz.
    pub const AVERAGE: u32 = 10;
    /// Default of `input.zero_limit_MPa` over the full scale.
    pub const LIMIT_SHARE: f64 = 1.0 / 64.0;
    /// Least limit over the noise of a frame, so that noise on any of 256 × 256 taxels is no touch.
    pub const LEAST_OVER_NOISE: f64 = 5.0;
}

/// Table `[input]`; its meaning is in [`crate::data::input`].
#[derive(Clone, Debug, PartialEq)]
pub struct InputSpec {
    /// Stress in MPa of the largest code, above 0; `None` takes each frame's peak.
    pub full_scale_MPa: Option<f64>,
    /// 2^average frames are averaged; 0 to 12.
    pub average: u32,
    /// How they are averaged.
    pub mean: MeanKind,
    /// Path of the table of offsets and gains, relative to the working folder.
    pub calibration: Option<PathBuf>,
    /// Path of a frame read without contact, relative to the working folder.
    pub tare: Option<PathBuf>,
    /// Dead taxels, left out of the inverse: [row, col], sorted, without duplicates, fewer than all.
    pub dead: Vec<[usize; 2]>,
    /// Whether the sensor reads tension as zero.
    pub unipolar: bool,
    /// Standard deviation of the taxels' gains about their calibration, a fraction from 0 to 1.
    pub gain_spread: f64,
    /// Stress in MPa above which a result is flagged `implausible-stress`, above 0.
    pub plausible_MPa: f64,
    /// Largest share of the live taxels whose readings may be missing in a frame, 0 to 0.5.
    pub missing_share: f64,
    /// What the zero of each taxel is.
    pub zero: Zero,
}

/// Default of `input.plausible_MPa`: soft elastomers tear at about 10 MPa, and feet, hands and grippers stay below 2.
pub const PLAUSIBLE_MPA: f64 = 10.0;

/// Default of `input.missing_share`: a row and a column of a 10 × 10 array.
pub const MISSING_SHARE: f64 = 0.2;

/// The forces that a result holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ForceOutput {
    /// One force vector per taxel.
    #[default]
    Taxels,
    /// One force vector per subarray or contact, with its centre of pressure.
    Resultants,
}

/// Table `[output]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OutputSpec {
    /// Forces per taxel or resultants.
    pub forces: ForceOutput,
}

impl PartitionSpec {
    /// The paper's cases that [`Case::Adaptive`] may choose: those listed, or all, that divide `sensor`.
    pub fn choices(&self, sensor: &Sensor) -> Vec<Case> {
        let listed = |number: &i64| self.listed.is_none_or(|listed| listed[*number as usize]);
        let divides = |case: &Case| subarrays(*case, sensor).is_ok();
        (0..4).filter(listed).filter_map(Case::numbered).filter(divides).collect()
    }
}

impl InputSpec {
    /// Noise of a mean relative to that of a single frame: 2^(−average/2) of a block, 1/√(2^(average+1) − 1) of a sliding
    /// mean of many frames.
    pub fn noise_share(&self) -> f64 {
        self.variance_share(usize::MAX).sqrt()
    }

    /// Variance of a mean relative to that of a single frame: of a block, or of a sliding mean of `frames` frames.
    pub(crate) fn variance_share(&self, frames: usize) -> f64 {
        match self.mean {
            MeanKind::Block => 0.5f64.powi(self.average as i32),
            MeanKind::Sliding => sliding::variance(frames, self.average),
        }
    }

    /// Number of frames that arrive for each result.
    pub fn frames_per_result(&self) -> usize {
        match self.mean {
            MeanKind::Block => 1 << self.average,
            MeanKind::Sliding => 1,
        }
    }

    /// Whether the mean slides.
    pub fn slides(&self) -> bool {
        self.mean == MeanKind::Sliding
    }

    /// How the zero follows the readings; `None` where it is fixed.
    pub fn running_zero(&self) -> Option<RunningZero> {
        match self.zero {
            Zero::Fixed => None,
            Zero::Running(running) => Some(running),
        }
    }

    /// Whether a result depends on frames before its own: on all since a reset.
    pub fn has_memory(&self) -> bool {
        self.slides() || self.running_zero().is_some()
    }

    /// Of frames since a reset, those that the mean of the last result is of.
    pub fn newest<'a, T>(&self, frames: &'a [T]) -> &'a [T] {
        match self.mean {
            MeanKind::Block => &frames[frames.len().saturating_sub(self.frames_per_result())..],
            MeanKind::Sliding => frames,
        }
    }

    /// Number of frames that a sliding mean of `frames` frames holds, by its noise; `None` where the mean does not slide.
    pub fn frames_held(&self, frames: usize) -> Option<usize> {
        self.slides().then(|| frames.min(sliding::most_frames(self.average)))
    }

    /// The frames of each result, where `frames` arrive after a reset: blocks of 2^average of them, or all up to each where
    /// a result depends on those before.
    pub fn frames_of_results<'a, T>(&self, frames: &'a [T]) -> Vec<&'a [T]> {
        let each = self.frames_per_result();
        match self.has_memory() {
            false => frames.chunks(each).collect(),
            true => (1..=frames.len().div_ceil(each)).map(|k| &frames[..frames.len().min(k * each)]).collect(),
        }
    }

    /// For each taxel of `sensor`, row-major, whether it is not dead.
    pub fn alive(&self, sensor: &Sensor) -> Vec<bool> {
        (0..sensor.taxels()).map(|taxel| !self.is_dead([taxel / sensor.cols, taxel % sensor.cols])).collect()
    }

    /// Largest number of live taxels of `sensor` whose readings may be missing in a frame.
    pub fn most_missing(&self, sensor: &Sensor) -> usize {
        // A share such as 0.29 of 100 taxels is 28.999….
        (self.missing_share * (sensor.taxels() - self.dead.len()) as f64 + 1e-9) as usize
    }

    /// Whether a taxel, [row, col], is dead.
    pub fn is_dead(&self, taxel: [usize; 2]) -> bool {
        self.dead.binary_search(&taxel).is_ok()
    }
}

impl Default for InputSpec {
    fn default() -> Self {
        InputSpec {
            full_scale_MPa: None,
            average: 0,
            mean: MeanKind::default(),
            calibration: None,
            tare: None,
            dead: Vec::new(),
            unipolar: false,
            gain_spread: 0.0,
            plausible_MPa: PLAUSIBLE_MPA,
            missing_share: MISSING_SHARE,
            zero: Zero::default(),
        }
    }
}

impl Default for PartitionSpec {
    fn default() -> Self {
        let condition = Condition::default();
        PartitionSpec { case: Case::WHOLE, listed: None, condition, max_contacts: MAX_CONTACTS }
    }
}

impl SearchSpec {
    /// The noise floor in MPa; 0 where it is not stated.
    pub fn noise_floor_MPa(&self) -> f64 {
        self.noise_floor_MPa.unwrap_or(0.0)
    }
}

impl Default for SearchSpec {
    fn default() -> Self {
        SearchSpec {
            estimator: None,
            objective: ObjectiveKind::default(),
            mu_max: 0.6,
            noise_floor_MPa: None,
            form: Form::default(),
            degree: None,
            network: None,
            deviations: None,
        }
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
        HardwareSpec {
            board: "ulx3s-85f".to_string(),
            link: LinkKind::Uart,
            coefficient_check: CoefficientCheck::None,
            estimator: None,
            search_width: None,
            tables: TableStorage::Rom,
            table_range: TableRange::default(),
            adc_scan: None,
        }
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
    /// The cases in which the scene can be compared: `all`, or with a network the scene's own, for which it was trained.
    pub fn cases_of(&self, all: &[Case]) -> Vec<Case> {
        match self.hardware_estimator() {
            EstimatorKind::Network => vec![self.partition.case],
            _ => all.to_vec(),
        }
    }

    /// The scene of a sensor with defaults for everything else; `name` is used in reports.
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
