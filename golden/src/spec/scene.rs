//! Scene: sensor, method, number formats and hardware of a run, read from a TOML file.
//!
//! Every table except `[sensor]` has defaults. An unknown field, a value out of range or a wrong type is an error that
//! names the file, the field and what is allowed. Sizes are checked here, before anything of their size is allocated.
//!
//! Each field is declared once, as a member of the struct of its table: [`Scene::fields`] lists them with the allowed values,
//! the default and the meaning, [`Scene::json_schema`] gives them to editors, and the guide's page "your sensor" has the table.

mod adc_scan;
mod declared;
mod difference;
mod error;
mod estimator;
mod estimator_choice;
mod field;
mod identifier;
pub mod inverse;
mod inversion;
mod kinds;
mod load;
mod parse;
mod reader;
mod schema;
mod supported;
#[cfg(test)]
mod tests;
mod zero;

pub use declared::Declared;
pub use error::SceneError;
pub use estimator::EstimatorKind;
pub use identifier::identifier;
pub use inverse::{InverseKind, InverseSpec, Inversion};
pub use zero::{RunningZero, Zero};

use crate::spec::adc::AdcScan;
use crate::spec::board::SEARCH_WIDTHS;
use crate::spec::link_kind::LinkKind;
use crate::spec::partition::{subarrays, Case};
use crate::spec::sensor::{Sensor, MAX_SIDE};
use crate::spec::sliding;
use adc_scan::ScanFields;
use estimator::FORMER_NAMES;
use field::{choice, nested, table, whole, File, Flag, Kind as _, Limits, Listed, Number};
pub(crate) use kinds::rise;
use kinds::{BoardName, DeadTaxels, Knots, OfEachArray};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::PathBuf;
use zero::ZeroFields;

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
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
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
    const POISSON: Number = Number::Between(0.0, 0.5);

    /// Whether a bonded layer may have this Poisson ratio, in scenes and in frames.
    pub fn allows_poisson(poisson: f64) -> bool {
        Medium::POISSON.contains(poisson)
    }

    /// The allowed Poisson ratios in words, for messages.
    pub fn allowed_poisson() -> String {
        Medium::POISSON.allowed()
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

table! {
    /// Table `[search]`.
    #[derive(Clone, Debug, PartialEq)]
    pub struct SearchSpec in "search" with defaults {
        /// Estimator of the floating-point model; left out, [`Scene::model_estimator`] takes one.
        estimator: Option<EstimatorKind> = choice(&EstimatorKind::NAMES)
            .formerly(&FORMER_NAMES)
            .optional("chosen")
            .hardware("any: see `hardware.estimator`")
            .page("method");
        /// Objective that the search maximises.
        objective: ObjectiveKind = choice(&ObjectiveKind::NAMES)
            .or(ObjectiveKind::Sparse)
            .hardware("`\"sparse\"`")
            .page("accuracy");
        /// Largest ratio of shear to normal force; 0: no shear, no search.
        mu_max: f64 = Number::ZeroOr(LEAST_MU_MAX, LARGEST_MU_MAX).or(0.6);
        /// Standard deviation of the noise of one reading in MPa, up to which a stress counts as none; 0 for a simulation without
        /// noise.
        noise_floor_MPa: Option<f64> = Number::NotNegative.optional("not stated");
        /// How Eq. 1 is computed: the series in μ, or as the paper prints it.
        form: Form = choice(&[("oblique", Form::Oblique), ("orthogonal", Form::Orthogonal)])
            .or(Form::Oblique)
            .hardware("`\"oblique\"`");
        /// Degree of the series in μ; left out, [`crate::estimate::degree`] takes one.
        degree: Option<usize> = whole::<usize>(1, MAX_FLOAT_DEGREE as u32)
            .optional("what the sensor needs")
            .hardware("up to 3")
            .page("method");
        /// Trained network: a file of `dermis train`, relative to the scene, or `dermis:NAME`, one of the program.
        network: Option<PathBuf> = File.optional("none").hardware("that of `\"network\"`");
        /// Table of standard deviations of what a search finds: a file of `dermis deviations`, relative to the scene.
        deviations: Option<PathBuf> = File
            .optional("that of the program for the same sensor and partition, if any")
            .page("accuracy");
    }
}

table! {
    /// Table `[threshold]`.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct ThresholdSpec in "threshold" with defaults {
        /// Smallest normal force in N that is reported; smaller ones are reported as zero.
        min_force_N: f64 = Number::NotNegative.or(0.0);
    }
}

table! {
    /// Table `[fixed]`: widths in bits, signs included.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct FixedSpec in "fixed" with defaults {
        /// Width of the converter's codes.
        input_bits: u32 = whole::<u32>(8, 24).or(20).page("formats");
        /// Width of the vectors between the stages.
        data_bits: u32 = whole::<u32>(12, 18).or(18).page("formats");
        /// Width of the coefficients of Ax and Ay.
        coef_bits: u32 = whole::<u32>(8, 18).or(18).page("formats");
        /// Width of the coefficients of Cz⁺, at least `coef_bits`; multiplied in two limbs.
        inverse_bits: u32 = whole::<u32>(8, 32).or(24).page("formats");
        /// Columns whose coefficients are all below 2^−`prune_bits` of the largest are not stored.
        prune_bits: u32 = whole::<u32>(8, 31).or(20).page("formats");
        /// Multiply-accumulate lanes of the matrix products.
        lanes: Option<u32> = whole::<u32>(4, 1024).multiple_of(4).optional("as many as the board's multipliers and block RAMs allow");
    }
}

/// Smallest mu_max above 0: with a smaller one, the powers of μ vanish in the hardware's words.
const LEAST_MU_MAX: f64 = 0.001;
/// Largest mu_max, above the friction of any elastic cover.
const LARGEST_MU_MAX: f64 = 2.0;

/// Highest degree of the hardware and its bit-true model.
pub const MAX_DEGREE: usize = 3;
/// Highest degree of the floating-point model: enough for square taxels with a pitch of half their depth.
pub const MAX_FLOAT_DEGREE: usize = 8;

/// Largest code of `bits` bits: 2^(bits − 1) − 1; `bits` 2 to 32.
pub fn largest_code(bits: u32) -> i32 {
    ((1i64 << (bits - 1)) - 1) as i32
}

/// Whether the hardware checks the codes of its frames, see [`Scene::checks_codes`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CodeCheck {
    /// Where it can.
    #[default]
    On,
    /// It does not.
    Off,
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

table! {
    /// Table `[hardware.table_range]`: what the tables that are written may hold.
    #[derive(Clone, Debug, PartialEq)]
    pub struct TableRange in "hardware.table_range" with defaults {
        /// Least and largest |gain| in MPa per unit of the readings; the largest fixes what a code means.
        gain: Option<[f64; 2]> = Limits.optional("those of the scene's table, without one 1");
        /// Least and largest thickness of the cover in mm; coefficients are written too.
        thickness_mm: Option<[f64; 2]> = Limits.optional("that of the sensor alone");
        /// Most dead taxels, fewer than all; coefficients are written too. 0 leaves those of the scene as they are.
        dead_taxels: usize = whole::<usize>(0, MOST_DEAD as u32).or(0).hardware("with one subarray");
    }
}

/// Most dead taxels of the largest array.
const MOST_DEAD: usize = MAX_SIDE * MAX_SIDE - 1;

impl TableRange {
    /// Whether the coefficients differ between specimens: they are for another thickness, or for other dead taxels.
    pub fn has_coefficients(&self) -> bool {
        self.thickness_mm.is_some() || self.dead_taxels > 0
    }
}

table! {
    /// Table `[hardware]`.
    #[derive(Clone, Debug, PartialEq)]
    pub struct HardwareSpec in "hardware" with defaults {
        /// Board: one of [`crate::spec::board::Board::names`], or a board's file, relative to the scene. Of an engine or a core
        /// without one, the Verilog says nothing about the kinds of RAM that the device has.
        board: Option<String> = BoardName.optional(DEFAULT_BOARD).page("boards");
        /// Link between the board and its host.
        link: LinkKind = choice(&LinkKind::NAMES).or(LinkKind::Uart).page("boards");
        /// Whether damaged coefficients are reported.
        coefficient_check: CoefficientCheck =
            choice(&[("none", CoefficientCheck::None), ("signature", CoefficientCheck::Signature)])
                .or(CoefficientCheck::None)
                .page("robustness");
        /// Whether the hardware itself finds clipped codes, and rows and columns that repeat the one before.
        code_check: CodeCheck = choice(&[("on", CodeCheck::On), ("off", CodeCheck::Off)])
            .or(CodeCheck::On)
            .hardware("parallel engine, from 4 × 4 taxels on, no writable tables")
            .page("architecture/prepare");
        /// Estimator of the hardware and its bit-true model; left out, [`Scene::choose_for_hardware`] takes one. A network takes up to
        /// 144 taxels in one subarray, or `"contacts"`.
        estimator: Option<EstimatorKind> = choice(&EstimatorKind::HARDWARE_NAMES)
            .formerly(&FORMER_NAMES)
            .optional("chosen")
            .page("method");
        /// Taxels that the search computes per cycle: fewer take fewer LUTs and more cycles, `dermis build --explain` says how many.
        search_width: Option<usize> = Listed(SEARCH_WIDTHS).optional("that of the board").hardware("4 with `\"adaptive\"`");
        /// Arrays of the same geometry and cover that one engine serves; each frame names its own by `tid`, and `{array}` in the names of
        /// `input.calibration` and `input.tare` stands for its number, from 0.
        arrays: usize = Listed(ARRAYS)
            .or(1)
            .hardware("parallel engine; no link, no blocks of frames")
            .page("in-your-soc");
        /// Noise floor of each array in MPa, in place of `search.noise_floor_MPa`.
        array_noise_floors_MPa: Vec<f64> = OfEachArray(Number::NotNegative)
            .or(Vec::new())
            .hardware("not with `\"adaptive\"`")
            .page("in-your-soc");
        /// Smallest normal force of each array in N, in place of `threshold.min_force_N`.
        array_min_forces_N: Vec<f64> = OfEachArray(Number::NotNegative).or(Vec::new()).page("in-your-soc");
        /// Where the tables of a specimen stand: in the bitstream, or written while the engine rests.
        tables: TableStorage = choice(&[("rom", TableStorage::Rom), ("writable", TableStorage::Writable)])
            .or(TableStorage::Rom)
            .page("in-your-soc");
        /// What tables that are written may hold.
        table_range: TableRange = nested::<TableRange>();
        /// How the hardware scans the array by itself; none where codes come as a stream.
        adc_scan: Option<AdcScan> = ScanFields;
    }
}

/// Numbers of arrays that an engine serves: powers of two, so that every `tid` of their width names one of them.
const ARRAYS: [usize; 5] = [1, 2, 4, 8, 16];

/// The board of a scene that names none.
const DEFAULT_BOARD: &str = "ulx3s-85f";

impl HardwareSpec {
    /// The board, that of a scene without one too.
    pub fn board_name(&self) -> &str {
        self.board.as_deref().unwrap_or(DEFAULT_BOARD)
    }

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

    /// Whether arrays have noise floors or thresholds of their own.
    pub fn states_limits_of_each_array(&self) -> bool {
        !(self.array_noise_floors_MPa.is_empty() && self.array_min_forces_N.is_empty())
    }

    /// Width of the number of an array: 0 where there is one.
    pub fn array_bits(&self) -> usize {
        self.arrays.trailing_zeros() as usize
    }

    /// Takes frames of stress, which need neither calibration nor converters and are of any array: the tables are in the bitstream,
    /// codes come as a stream. The formats remain those of [`TableRange`]'s coefficients, so that a frame has the same forces.
    pub fn take_stress(&mut self) {
        self.tables = TableStorage::Rom;
        self.array_noise_floors_MPa.clear();
        self.array_min_forces_N.clear();
        self.table_range.gain = None;
        self.adc_scan = None;
    }
}

/// k of the shortest mean of an adaptive one: with fewer frames the shear is mostly noise.
pub(crate) const SHORTEST_AVERAGE: u32 = 2;
/// k of its longest one, unless a scene states it: 127 frames, an eighth of a second at 1 kHz. A status holds the index of one of the
/// eight windows that it makes.
pub(crate) const LONGEST_AVERAGE: u32 = 6;

/// How frames are averaged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MeanKind {
    /// 2^average frames give one result.
    #[default]
    Block,
    /// Every frame gives a result, of the frames so far, of which older ones count less: [`crate::spec::sliding`].
    Sliding,
    /// The same, of fewer frames the faster readings change: [`crate::data::input::adaptive`].
    Adaptive,
}

impl MeanKind {
    /// Every kind with its name in scene files.
    pub const NAMES: [(&'static str, MeanKind); 3] =
        [("block", MeanKind::Block), ("sliding", MeanKind::Sliding), ("adaptive", MeanKind::Adaptive)];

    /// The name in scene files.
    pub fn name(self) -> &'static str {
        MeanKind::NAMES.iter().find(|(_, kind)| *kind == self).map_or("", |(name, _)| *name)
    }
}

table! {
    /// Table `[input]`; its meaning is in [`crate::data::input`].
    #[derive(Clone, Debug, PartialEq)]
    pub struct InputSpec in "input" with defaults {
        /// Stress in MPa of the largest code; hardware needs it beside a calibration, tare, threshold or noise floor.
        full_scale_MPa: Option<f64> = Number::Positive.optional("each frame's peak");
        /// 2^average frames are averaged; give `--frame` as often. With an adaptive mean, 0 is 6.
        average: u32 = whole::<u32>(0, 12).or(0);
        /// One result of 2^average frames, or one with every frame, of 1/√(2^(average+1) − 1) of the noise; of fewer frames the faster
        /// readings change, where it is adaptive. Give all frames since the start.
        mean: MeanKind = choice(&MeanKind::NAMES)
            .or(MeanKind::Block)
            .page("over-time");
        /// Whether the pressure of contacts that stay in place is remembered, with an adaptive mean: their forces follow the newest frames.
        template: bool = Flag.or(true).hardware("`false`, with an adaptive mean").page("over-time");
        /// Table of the taxels' offsets and gains: a file, relative to the scene.
        calibration: Option<PathBuf> = File.optional("none").page("files");
        /// Characteristic common to all taxels, behind the table, where it is curved: \[MPa by the table, MPa\] each, both rising,
        /// \[0, 0\] among them; between them a monotone cubic.
        curve: Vec<[f64; 2]> = Knots.or(Vec::new()).hardware("none").page("files");
        /// Frames without contact, a file or folder, relative to the scene: their mean is the zero, the spread of 8 or more the noise
        /// of each taxel.
        tare: Option<PathBuf> = File.optional("none").page("files");
        /// Dead taxels, left out of the inverse: \[row, col\] each, from 0, fewer than all.
        dead: Vec<[usize; 2]> = DeadTaxels.or(Vec::new()).hardware("with one subarray");
        /// Whether the sensor reads tension as zero.
        unipolar: bool = Flag.or(false).hardware("with `\"network\"`");
        /// Standard deviation of the taxels' gains about their calibration, as a fraction.
        gain_spread: f64 = Number::Within(0.0, 1.0).or(0.0).page("accuracy");
        /// Stress in MPa above which a result is flagged `implausible-stress`, for example counts taken for MPa.
        // Soft elastomers tear at about 10 MPa; feet, hands and grippers stay below 2.
        plausible_MPa: f64 = Number::Positive.or(10.0);
        /// Largest share of the live taxels whose readings may be missing in a frame.
        // A row and a column of a 10 × 10 array.
        missing_share: f64 = Number::Within(0.0, 0.5).or(0.2).page("files");
        /// What the zero of each taxel is.
        zero: Zero = ZeroFields;
    }
}

/// The forces that a result holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ForceOutput {
    /// One force vector per taxel.
    #[default]
    Taxels,
    /// One force vector per subarray or contact, with its centre of pressure.
    Resultants,
}

table! {
    /// Table `[output]`.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct OutputSpec in "output" with defaults {
        /// A force per taxel, or one with its centre of pressure per subarray or contact.
        forces: ForceOutput = choice(&[("taxels", ForceOutput::Taxels), ("resultants", ForceOutput::Resultants)])
            .or(ForceOutput::Taxels);
    }
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
        self.settled_variance().sqrt()
    }

    /// Variance of a mean relative to that of a single frame: of a block, or of the longest mean that slides, of many frames.
    pub(crate) fn settled_variance(&self) -> f64 {
        match self.mean {
            MeanKind::Block => 0.5f64.powi(self.average as i32),
            MeanKind::Sliding | MeanKind::Adaptive => 1.0 / sliding::most_frames(self.longest_average()) as f64,
        }
    }

    /// k of each mean that slides, ascending; none of a block.
    pub(crate) fn averages(&self) -> Vec<u32> {
        match self.mean {
            MeanKind::Block => Vec::new(),
            MeanKind::Sliding => vec![self.average],
            MeanKind::Adaptive => (SHORTEST_AVERAGE..=self.longest_average()).collect(),
        }
    }

    /// k: that of the scene, or of the longest mean of an adaptive one.
    pub fn longest_average(&self) -> u32 {
        if self.mean == MeanKind::Adaptive && self.average == 0 {
            LONGEST_AVERAGE
        } else {
            self.average
        }
    }

    /// Number of frames that arrive for each result.
    pub fn frames_per_result(&self) -> usize {
        match self.mean {
            MeanKind::Block => 1 << self.average,
            MeanKind::Sliding | MeanKind::Adaptive => 1,
        }
    }

    /// Whether every frame gives a result, with those before it.
    pub fn slides(&self) -> bool {
        self.mean != MeanKind::Block
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

    /// Of frames since a reset, those that arrived for the last result.
    pub fn newest<'a, T>(&self, frames: &'a [T]) -> &'a [T] {
        &frames[frames.len().saturating_sub(self.frames_per_result())..]
    }

    /// Number of frames that a sliding mean of `frames` frames holds, by its noise; `None` where the mean does not slide.
    pub fn frames_held(&self, frames: usize) -> Option<usize> {
        self.slides().then(|| frames.min(sliding::most_frames(self.longest_average())))
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

/// What stands for the number of an array in the name of a file.
const ARRAY_PLACE: &str = "{array}";

/// Fewest rows and columns of which the hardware checks codes: with fewer no line has others on both sides.
const LEAST_LINES: usize = 4;

impl Scene {
    /// The scene after a change.
    pub(crate) fn changed(&self, change: impl FnOnce(&mut Scene)) -> Scene {
        let mut scene = self.clone();
        change(&mut scene);
        scene
    }

    /// The scene of array `array` of those that an engine serves, alone with its own files and limits; the same scene where there
    /// is one.
    pub fn of_array(&self, array: usize) -> Scene {
        let mut own = self.clone();
        if self.hardware.arrays > 1 {
            own.hardware.arrays = 1;
            let number = array.to_string();
            let of_each = |list: &mut Vec<f64>| std::mem::take(list).get(array).copied();
            if let Some(floor) = of_each(&mut own.hardware.array_noise_floors_MPa) {
                own.search.noise_floor_MPa = Some(floor);
            }
            if let Some(least) = of_each(&mut own.hardware.array_min_forces_N) {
                own.threshold.min_force_N = least;
            }
            for path in [&mut own.input.calibration, &mut own.input.tare].into_iter().flatten() {
                *path = path.to_string_lossy().replace(ARRAY_PLACE, &number).into();
            }
        }
        own
    }

    /// Whether the hardware checks the codes of its frames for plateaus and repeated lines: not with the serial engine, whose plan
    /// says so in `hardware.code_check`, nor where tables are written, as signs of gains and dead taxels are not known before.
    pub fn checks_codes(&self) -> bool {
        let large = self.sensor.rows >= LEAST_LINES && self.sensor.cols >= LEAST_LINES;
        self.hardware.code_check == CodeCheck::On && large && !self.hardware.has_writable_tables()
    }

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
