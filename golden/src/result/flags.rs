//! Flags: limitations of a result that a user must know before trusting it.
//!
//! [`Flag`] lists them. Each is one row of `flags!`, from which follow the type, its name in JSON, the texts of `dermis flags`
//! and of the guide, the figure behind it, the rule that raises it from a figure, and its bit in a status: the masks of
//! `manifest.json`, the positions that the hardware and its readers take, and the enumeration of the C header.
//!
//! # A new flag
//!
//! 1. A row at the end of `flags!` with the next number. The numbers are the bits of the C interface and the order in
//!    results: they stay as they are.
//! 2. What raises it: the `rule` of its row over a figure of [`Checks`]; [`frame_flags`] from the frame alone; an engine; or, of
//!    a row with a `bit`, the bit-true model (`fixed/run.rs`) and the hardware (`hdl`).
//!
//! `make guide` and `DERMIS_ACCEPT=1 make c` then write the pages and `dermis.h`.

mod set;
mod status_field;

pub use set::FlagSet;
pub use status_field::{Feature, StatusField, STATUS_BEATS};

use crate::data::frame::Frame;
use crate::data::input::missing;
use crate::data::quantise::Codes;
use crate::result::checks::{Checks, CONSTANT, LINE, LOAD_MISMATCH, MU_AT_BOUND, NOT_RESOLVED, PLATEAU, PULL, TORN};
use crate::spec::scene::{largest_code, EstimatorKind, ObjectiveKind, Scene};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt::Write;

/// What is known of a flag.
struct FlagRow {
    name: &'static str,
    raised_when: &'static str,
    remedy: &'static str,
    raised_by: &'static str,
    /// Raises it from the figures of a result.
    rule: Option<fn(&Checks, &Scene) -> bool>,
    /// The figure behind it, in words; none where it was not computed.
    figure: Option<fn(&Checks) -> Option<String>>,
    bit: Option<StatusField>,
}

/// An expression, if there is one.
macro_rules! optional {
    () => {
        None
    };
    ($value:expr) => {
        Some($value)
    };
}

/// Defines the flags, a row each: number, name in JSON, when it is raised, what a user does about it, and by what it is raised;
/// then, where there is one, the rule over the figures of a result, the figure in words, and the bit of a status as a constant.
macro_rules! flags {
    ($($flag:ident = $number:literal $name:literal {
        raised_when: $raised_when:literal,
        remedy: $remedy:literal,
        raised_by: $raised_by:literal,
        $(rule: $rule:expr,)?
        $(figure: $figure:expr,)?
        $(bit: $bit:ident = $field:expr,)?
    })*) => {
        /// A limitation of a result.
        ///
        /// | flag | raised when | what to do | by |
        /// |---|---|---|---|
        $(#[doc = concat!("| `", $name, "` | ", $raised_when, " | ", $remedy, " | ", $raised_by, " |")])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
        pub enum Flag {
            $(
                #[doc = concat!("`", $name, "`: ", $raised_when, ".")]
                #[serde(rename = $name)]
                $flag = $number,
            )*
        }

        impl Flag {
            /// All flags, in the order of their numbers.
            pub const ALL: [Flag; [$($number),*].len()] = [$(Flag::$flag),*];
        }

        $($(
            #[doc = concat!("The bit of a status for `", $name, "`.")]
            pub const $bit: StatusField = $field;
        )?)*

        static ROWS: [FlagRow; Flag::ALL.len()] = [$(FlagRow {
            name: $name,
            raised_when: $raised_when,
            remedy: $remedy,
            raised_by: $raised_by,
            rule: optional!($($rule)?),
            figure: optional!($($figure)?),
            bit: optional!($($bit)?),
        }),*];
    };
}

flags! {
    NoContact = 0 "no-contact" {
        raised_when: "no taxel carries a force, or none above `threshold.min_force_N`",
        remedy: "nothing to do",
        raised_by: "all engines",
        bit: NO_CONTACT = StatusField::flag("no_contact", 2, Feature::Always, "no force reaches the threshold"),
    }
    NoCompression = 1 "no-compression" {
        raised_when: "no candidate μ leaves Σp > 0",
        remedy: "check the sign of the readings: compression is positive",
        raised_by: "all engines, with a search",
    }
    ConditionUnmet = 2 "condition-unmet" {
        raised_when: "a subarray does not meet `partition.condition` and is not searched: its shear is 0",
        remedy: "expected on subarrays without load",
        raised_by: "all engines",
    }
    Saturated = 3 "saturated" {
        raised_when: "a reading, zero or calibrated reading is at the end of the stated full scale (`full_scale_share`), the stress beyond it, a sample at the end of its converter's range, or the arithmetic saturated",
        remedy: "raise `input.full_scale_MPa`",
        raised_by: "all engines",
        rule: |checks, scene| {
            let last_code = 1.0 - 0.5 / f64::from(largest_code(scene.fixed.input_bits));
            checks.full_scale_share.is_some_and(|share| share >= last_code)
        },
        figure: |checks| checks.full_scale_share.map(|share| format!("{share:.3} of full scale")),
        bit: RAIL = StatusField::flag("rail", 7, Feature::Scan, "a sample was at an end of the converter's range"),
    }
    LoadOutside = 4 "load-outside" {
        raised_when: "part of the contact lies over the array's edge; `border_share` is the share of the normal load in the outermost rows and columns",
        remedy: "the forces are those on the array alone",
        raised_by: "all engines",
        figure: |checks| checks.border_share.map(|share| format!("{:.1} % of the load at the border", 1e2 * share)),
    }
    MediumMismatch = 5 "medium-mismatch" {
        raised_when: "the frame names another medium than the scene",
        remedy: "set `medium` in the scene",
        raised_by: "all engines",
    }
    ShearUnreliable = 6 "shear-unreliable" {
        raised_when: "stated noise, rounding of the codes, or the error of what is taken for missing readings, above 5·10⁻⁵ of the peak, with `sparse`; where no noise is stated, noise found by `dermis reconstruct` above 1.25·10⁻⁴ (`noise_MPa`). With every estimator: a quarter of the readings are one value to the bit, and the next is 0.4 % of the largest away from it (`coarse_share`)",
        remedy: "average, another objective, more bits, no deadband",
        raised_by: "all engines",
        rule: |checks, scene| scene.search.mu_max > 0.0 && checks.is_coarse(),
        figure: |checks| checks.rounding_figure(),
    }
    CoefficientsDamaged = 7 "coefficients-damaged" {
        raised_when: "the signature of the hardware's coefficient memory is wrong",
        remedy: "reset, configure again",
        raised_by: "hardware",
        bit: COEFFICIENTS =
            StatusField::flag("coefficients", 4, Feature::CoefficientCheck, "the coefficient memory is damaged"),
    }
    MuAtBound = 8 "mu-at-bound" {
        raised_when: "the size of μ of a subarray or contact with 5 % of the load is at least 0.95 of `search.mu_max` (`mu_share`)",
        remedy: "raise `search.mu_max`; the true ratio may be any larger one",
        raised_by: "all engines",
        rule: |checks, _| checks.mu_share.is_some_and(|share| share >= MU_AT_BOUND),
        figure: |checks| checks.mu_share.map(|share| format!("{share:.3} of mu_max")),
    }
    ImplausibleStress = 9 "implausible-stress" {
        raised_when: "the largest stress (`peak_MPa`) is above `input.plausible_MPa`",
        remedy: "check the unit of the readings, the calibration",
        raised_by: "all engines",
        rule: |checks, scene| checks.peak_MPa > scene.input.plausible_MPa,
        figure: |checks| Some(format!("{:.3} MPa", checks.peak_MPa)),
    }
    LoadMismatch = 10 "load-mismatch" {
        raised_when: "the normal force is more than 10 % off the one of the same stress without shear (`load_ratio`), or may be by missing readings (`missing_load`)",
        remedy: "another objective or partition; repair the taxels that are missing",
        raised_by: "golden model; with missing readings all engines",
        rule: |checks, _| {
            checks.load_ratio.is_some_and(|ratio| (ratio - 1.0).abs() > LOAD_MISMATCH)
                || checks.missing_load.is_some_and(|error| error > LOAD_MISMATCH)
        },
        figure: |checks| match checks.missing_load {
            Some(error) if error > LOAD_MISMATCH => Some(format!("missing readings leave {:.0} % open", 1e2 * error)),
            _ => checks.load_ratio.map(|ratio| format!("{ratio:.3} of the load without shear")),
        },
    }
    ShapeMismatch = 11 "shape-mismatch" {
        raised_when: "the contact that `patch` or `symmetric` fits leaves more of the stress than the stated noise explains (`shape_misfit` above 1)",
        remedy: "state the noise; if it is stated, use `sparse` or `auto`",
        raised_by: "golden model",
        rule: |checks, _| checks.shape_misfit.is_some_and(|misfit| misfit > 1.0),
        figure: |checks| checks.shape_misfit.map(|misfit| format!("misfit {misfit:.3} times the allowed")),
    }
    ShearNotResolved = 12 "shear-not-resolved" {
        raised_when: "the shear of a contact, or with `search` and stated noise of a subarray, has a standard deviation above a third of it (`shear_spread`), or missing readings leave as much open (`missing_shear`)",
        remedy: "average; the normal force still holds",
        raised_by: "all engines",
        rule: |checks, _| checks.shear_error().is_some_and(|error| error > NOT_RESOLVED),
        figure: |checks| {
            checks.shear_error().map(|error| format!("standard deviation {:.0} % of the shear", 1e2 * error))
        },
    }
    Misfit = 13 "misfit" {
        raised_when: "with an estimator that has evidence, noise of the stated size leaves as much of the stress unexplained in less than one frame of a thousand (`misfit_probability`), or noise found from the frame is above a tenth of its peak; or a reading is more than 5 standard deviations off what the others say (`residual_outlier`), or neighbours leave alike (`residual_correlation` above 2.5), whatever the noise; with a network also a frame unlike those of its training (`network_misfit` above 1)",
        remedy: "check medium, thickness, calibration, faulty taxels, the stated noise, and whether the noise is below 2 % of the peak",
        raised_by: "golden model; with a network all engines",
        rule: |checks, _| checks.misfits(),
        figure: |checks| checks.misfit_figure(),
    }
    TooManyContacts = 14 "too-many-contacts" {
        raised_when: "with a network for each contact, more contacts than `partition.max_contacts` or than the segmentation holds",
        remedy: "raise `partition.max_contacts`; the smallest contacts have their normal force, but no shear",
        raised_by: "all engines",
        bit: MORE_CONTACTS = StatusField::flag("more_contacts", 5, Feature::Contacts, "more contacts than get a μ"),
    }
    TablesIncomplete = 15 "tables-incomplete" {
        raised_when: "an image of tables was broken off or damaged: every stress is taken as 0",
        remedy: "load it again",
        raised_by: "hardware",
        bit: TABLES = StatusField::flag(
            "tables", 6, Feature::WritableTables, "the tables are not whole, and every stress is taken as 0"
        ),
    }
    TablesRefused = 16 "tables-refused" {
        raised_when: "the last image was damaged, cut short, or is for other hardware",
        remedy: "`dermis load` with the scene of this hardware; `tables_version` says which tables are used",
        raised_by: "hardware",
        bit: TABLES_REFUSED = StatusField::new(
            "tables_refused", [1, 2], [31, 1], Feature::WritableTables, "the last image of tables was refused"
        ),
    }
    WrongChannel = 17 "wrong-channel" {
        raised_when: "with `hardware.source = \"adc-scan\"`, a converter named another channel than that asked for",
        remedy: "check wires and type of the converter",
        raised_by: "hardware",
        bit: WRONG_CHANNEL = StatusField::flag("wrong_channel", 10, Feature::Scan, "a sample named another channel"),
    }
    Clipped = 18 "clipped" {
        raised_when: "several readings are the largest to the bit, and the others are far below (`plateau` above 7, the logarithm of a probability); hardware by itself: more than four codes, and the next one 8 steps below",
        remedy: "find what clips below full scale: an amplifier, a table, a unit",
        raised_by: "all engines",
        rule: |checks, _| checks.plateau.is_some_and(|plateau| plateau > PLATEAU),
        figure: |checks| checks.plateau.map(|plateau| format!("by chance in e^-{plateau:.0} of the frames")),
        bit: CLIPPED = StatusField::flag("clipped", 13, Feature::CodeCheck, "more than four codes are the largest, far above the next one"),
    }
    LineFault = 19 "line-fault" {
        raised_when: "a row or column repeats the next one to the bit, or has one reading beside loaded ones (`line_share` above 0.2 of the frame's range); hardware by itself: the former, where the line changes by a quarter of what the frame does",
        remedy: "check the multiplexer, the connector, the transfer of the frame",
        raised_by: "all engines",
        rule: |checks, _| checks.line_share.is_some_and(|share| share > LINE),
        figure: |checks| checks.line_share.map(|share| format!("beside {:.0} % of the range", 1e2 * share)),
        bit: LINE_FAULT = StatusField::flag("line_fault", 14, Feature::CodeCheck, "a loaded row or column repeats the one before"),
    }
    TaxelConstant = 20 "taxel-constant" {
        raised_when: "in a stream, a taxel has had one reading for 8 frames while all beside it rose or fell by 6 % of the range (`constant_share`)",
        remedy: "list it in `input.dead`",
        raised_by: "streams of all engines",
        rule: |checks, _| checks.constant_share.is_some_and(|share| share > CONSTANT),
        figure: |checks| {
            checks.constant_share.map(|share| format!("beside a change of {:.0} % of the range", 1e2 * share))
        },
    }
    TornFrame = 21 "torn-frame" {
        raised_when: "in a stream, a part of the frame is that of the frame before to the bit, and the rest has changed (`torn_share` above 0.08 of the range); or a line at most 100 away has lost characters, and a digit that this frame's numbers lose does not show; or one reading has changed by far more than all others, and with one more character its number would be nearly that before",
        remedy: "give frames that are whole: read them between two scans; write numbers with a fixed number of decimals (`%.4f`) or filled with zeros (`%04d`), so that what is lost shows, and lower the bit rate",
        raised_by: "streams of all engines",
        rule: |checks, _| checks.torn_share.is_some_and(|share| share > TORN),
        figure: |checks| checks.torn_share.map(|share| format!("{:.0} % of the range", 1e2 * share)),
    }
    EstimateFailed = 22 "estimate-failed" {
        raised_when: "no fit explains half of Σ b·area, or the stress is implausible: the normal force is Σ b·area, its standard deviation half of the area times the sum of the sizes of b, the shear is 0 and not resolved",
        remedy: "check zero, unit and wiring of the readings",
        raised_by: "golden model, with evidence; others by the cross-check",
    }
    TaxelSuspect = 23 "taxel-suspect" {
        raised_when: "a taxel reads what no force explains beside its neighbours: the other readings give it a density below e^-7 per peak, or a fit without it predicts a load there that is more than 4.8 standard deviations off, and at least 1 % of the peak. `suspects` names it with row, column, reading and expected stress; the estimate takes it as missing",
        remedy: "repair the taxel, or list it in `input.dead`",
        raised_by: "golden model, with evidence; others by the cross-check",
    }
    EstimatesDiffer = 24 "estimates-differ" {
        raised_when: "the estimator `evidence`, run beside another one, reads a shear or normal force that differs by more than 12 or 8 % and its standard deviation (`tangential_difference`, `normal_difference`); in a stream of a result `cross_check_age` results ago",
        remedy: "trust neither: check zero, noise and taxels, and compare with `--engine golden`",
        raised_by: "all engines without evidence",
        rule: |checks, _| checks.differs(),
        figure: |checks| {
            let percent = |size: Option<f64>| size.map_or("–".to_owned(), |size| format!("{:.0} %", 1e2 * size));
            let [shear, normal] = [checks.tangential_difference, checks.normal_difference].map(percent);
            Some(format!("shear {shear}, normal force {normal}"))
        },
    }
    NoiseNotStated = 25 "noise-not-stated" {
        raised_when: "the search gives the shear, and neither `search.noise_floor_MPa` nor frames of `input.tare` tell the noise, which can hide it",
        remedy: "`dermis check SCENE --stream` measures the noise of a device and writes it into the scene; state 0 for simulations without noise",
        raised_by: "all engines, with a search",
    }
    ScoreLow = 26 "score-low" {
        raised_when: "the maximum of the objective of a searched subarray with 5 % of the load is below that of every drawn frame whose noise hides no shear (`score_margin` below 0), where there is a table of standard deviations",
        remedy: "check zero, noise and taxels, and whether several contacts share the subarray",
        raised_by: "all engines, with a search",
        rule: |checks, _| checks.score_margin.is_some_and(|margin| margin < 0.0),
        figure: |checks| checks.score_margin.map(|margin| format!("{margin:.0} bits above the least")),
        bit: SCORE_LOW = StatusField::flag(
            "score_low", 11, Feature::WholeSearch, "the score is below that of frames without noise, where the scene has a table of deviations"
        ),
    }
    TaxelMissing = 27 "taxel-missing" {
        raised_when: "a live taxel has no reading in a frame: NaN, `null`, an empty field, a masked value (`missing_share` of the taxels). `missing` names it with row, column, number of frames and the stress that is taken for it",
        remedy: "nothing for single readings; repair a taxel that is missing in most frames, or list it in `input.dead`",
        raised_by: "all engines",
        rule: |checks, _| checks.missing_share.is_some(),
        figure: |checks| checks.missing_share.map(|share| format!("{:.1} % of the taxels", 1e2 * share)),
    }
    ZeroLimit = 28 "zero-limit" {
        raised_when: "with `input.zero = \"running\"`, the zero of a taxel is at its limit (`zero_share` of 1): what its reading has drifted beyond stays in the forces, or a touch below the limit was taken for drift",
        remedy: "take the tare again; if the taxel drifts, raise `input.zero_limit_MPa`",
        raised_by: "all engines",
        rule: |checks, _| checks.zero_share.is_some_and(|share| share >= 1.0),
        figure: |checks| checks.zero_share.map(|share| format!("{:.0} % of the limit", 1e2 * share)),
        bit: ZERO_LIMIT = StatusField::flag("zero_limit", 12, Feature::RunningZero, "a running zero is at its limit"),
    }
    TareSuspect = 29 "tare-suspect" {
        raised_when: "the stress is significantly below zero somewhere, by more than a ninth of what presses most (`pull_share` above 0.1): the tare was taken under load, or zeros have drifted up",
        remedy: "take the tare again with nothing on the array; `input.zero = \"running\"` follows within its limit",
        raised_by: "all engines",
        rule: |checks, _| checks.pull_share.is_some_and(|share| share > PULL),
        figure: |checks| checks.pull_share.map(|share| format!("{:.0} % of push and pull", 1e2 * share)),
    }
    NegativePressure = 30 "negative-pressure" {
        raised_when: "the normal forces below zero are a larger share than in any drawn frame whose noise hides no shear (`negative_pressure` above 1), where there is a table of standard deviations",
        remedy: "check zero, noise and taxels: nothing pulls on a cover",
        raised_by: "all engines, with a search",
        rule: |checks, _| checks.negative_pressure.is_some_and(|share| share > 1.0),
        figure: |checks| checks.negative_pressure.map(|share| format!("{share:.2} times that of clean frames")),
        bit: NEGATIVE_PRESSURE = StatusField::flag(
            "negative_pressure", 15, Feature::WholeSearch, "forces below zero are a larger share than in frames without noise, where the scene has a table of deviations"
        ),
    }
}

// Rows stand in the order of their numbers, and C has as many bits.
const _: () = {
    let mut at = 0;
    while at < Flag::ALL.len() {
        assert!(Flag::ALL[at] as usize == at);
        at += 1;
    }
    assert!(at <= u32::BITS as usize);
};

impl Flag {
    fn row(self) -> &'static FlagRow {
        &ROWS[self as usize]
    }

    /// Name, as in JSON.
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// When it is raised, in words of the guide.
    pub fn raised_when(self) -> &'static str {
        self.row().raised_when
    }

    /// What a user does about it.
    pub fn remedy(self) -> &'static str {
        self.row().remedy
    }

    /// The engines that raise it.
    pub fn raised_by(self) -> &'static str {
        self.row().raised_by
    }

    /// Its bit in the status of the hardware; `None` where the status has none of its own.
    pub fn status_bit(self) -> Option<StatusField> {
        self.row().bit
    }

    /// Its bit in a number of flags, as the C interface gives them: 2 to the power of its number.
    pub fn bit(self) -> u32 {
        1 << self as u32
    }
}

impl Checks {
    /// The figure behind a flag, in words; `None` for flags without one.
    pub fn figure(&self, flag: Flag) -> Option<String> {
        flag.row().figure.and_then(|figure| figure(self))
    }

    /// The flags that the figures raise.
    pub fn flags(&self, scene: &Scene) -> impl Iterator<Item = Flag> {
        let raised = |flag: Flag| (flag, flag.row().rule.is_some_and(|rule| rule(self, scene)));
        only_raised(Flag::ALL.map(raised))
    }
}

/// The flags that are marked as raised.
fn only_raised<const N: usize>(all: [(Flag, bool); N]) -> impl Iterator<Item = Flag> {
    all.into_iter().filter_map(|(flag, raised)| raised.then_some(flag))
}

/// The flags as a C enumeration `dermis_flag` of single bits.
pub fn c_enum() -> String {
    let mut text = String::from(
        "/**\n * A limitation of a result, one bit of dermis_result_flags; the guide's page on robustness says when each is raised.\n \
         */\ntypedef enum {\n",
    );
    for flag in Flag::ALL {
        let (name, number) = (flag.name(), flag as u32);
        let constant = name.to_uppercase().replace('-', "_");
        let _ = writeln!(text, "  /**\n   * `{name}`\n   */\n  DERMIS_FLAG_{constant} = (1 << {number}),");
    }
    text + "} dermis_flag;\n"
}

/// Fraction of the true normal load that the cells must carry for it to count as inside.
pub const SHARE_INSIDE: f64 = 0.995;
/// Noise relative to the peak above which the sparse objective cannot determine the shear.
pub const SPARSE_NOISE_LIMIT: f64 = 5e-5;

/// The flags that depend on the estimator, the frame and its codes alone, in the order of [`Flag`]; `noise_MPa` is the standard deviation
/// of a taxel of the averaged frame, 0 if it is not known, see [`crate::data::input::Input::noise_MPa`].
pub fn frame_flags(scene: &Scene, estimator: EstimatorKind, frame: &Frame, codes: &Codes, noise_MPa: f64) -> Vec<Flag> {
    let medium_differs = frame.medium.is_some_and(|medium| medium != scene.medium);
    let all = [
        (Flag::Saturated, codes.clipped.contains(&true)),
        (Flag::LoadOutside, load_outside(frame)),
        (Flag::MediumMismatch, medium_differs),
        (Flag::ShearUnreliable, estimator == EstimatorKind::Search && shear_unreliable(scene, frame, codes, noise_MPa)),
        (Flag::NoiseNotStated, noise_not_stated(scene, estimator, noise_MPa)),
    ];
    only_raised(all).collect()
}

/// Whether the search of a scene gives the shear while its noise is not known; `noise_MPa` is that of the scene or its tare
/// frames, 0 if neither gives it. A scene that states 0 has known noise.
pub fn noise_not_stated(scene: &Scene, estimator: EstimatorKind, noise_MPa: f64) -> bool {
    let searched = estimator == EstimatorKind::Search && scene.search.mu_max > 0.0;
    searched && scene.search.noise_floor_MPa.is_none() && noise_MPa == 0.0
}

/// With known forces: the cells carry less than the load. Without: the largest |b| is in the outermost rows or columns
/// of an array that has an interior.
fn load_outside(frame: &Frame) -> bool {
    if let (Some(cells), Some(resultant)) = (&frame.cell_forces_N, frame.resultant_N) {
        return cells.fz.iter().sum::<f64>().abs() < SHARE_INSIDE * resultant[2].abs();
    }
    let (rows, cols) = (frame.sensor.rows, frame.sensor.cols);
    if rows < 3 || cols < 3 {
        // Without an interior the position of the peak tells nothing.
        return false;
    }
    let ring = frame.stress_MPa.iter().enumerate().filter(|(index, _)| frame.sensor.is_border(*index));
    let ring_peak = ring.fold(0.0f64, |peak, (_, b)| b.abs().max(peak));
    ring_peak > 0.0 && ring_peak >= frame.peak_MPa()
}

/// Of a search: compares the noise, the standard deviation LSB/√12 of rounding, or that of predicted readings, with the peak.
fn shear_unreliable(scene: &Scene, frame: &Frame, codes: &Codes, noise_MPa: f64) -> bool {
    let search = &scene.search;
    let searched = search.objective == ObjectiveKind::Sparse && search.mu_max > 0.0;
    let noise = noise_MPa.max(codes.lsb_MPa() / 12f64.sqrt()).max(missing::noise_MPa(&scene.input, frame));
    let peak = frame.peak_MPa();
    searched && peak > 0.0 && noise > SPARSE_NOISE_LIMIT * peak
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::quantise::quantise;
    use crate::spec::scene::Medium;

    fn setting() -> (Scene, Frame) {
        let scene = Scene::builtin("sensor-1").unwrap();
        let frame = Frame::shipped(&scene).remove(1);
        (scene, frame)
    }

    fn flags(scene: &Scene, frame: &Frame, bits: u32, share: f64) -> Vec<Flag> {
        let peak = frame.peak_MPa();
        let full_scale = if peak > 0.0 { share * peak } else { 1.0 };
        let noise_MPa = scene.search.noise_floor_MPa() * scene.input.noise_share();
        frame_flags(scene, EstimatorKind::Search, frame, &quantise(&frame.stress_MPa, bits, full_scale), noise_MPa)
    }

    /// Order and names of released flags, on which C and stored results rely.
    #[test]
    fn released_flags_stay_as_they_are() {
        let released = "no-contact no-compression condition-unmet saturated load-outside medium-mismatch shear-unreliable \
                        coefficients-damaged mu-at-bound implausible-stress load-mismatch shape-mismatch shear-not-resolved \
                        misfit too-many-contacts tables-incomplete tables-refused wrong-channel";
        for (number, name) in released.split(' ').enumerate() {
            assert_eq!((Flag::ALL[number].name(), Flag::ALL[number] as usize), (name, number));
        }
    }

    #[test]
    fn each_row_has_what_its_readers_need() {
        let header = c_enum();
        for flag in Flag::ALL {
            let name = flag.name();
            assert_eq!(serde_json::to_value(flag).unwrap(), name);
            assert_eq!(serde_json::from_value::<Flag>(name.into()).unwrap(), flag);
            assert!(name.chars().all(|c| c.is_ascii_lowercase() || c == '-'), "{name}");
            let texts = [flag.raised_when(), flag.remedy(), flag.raised_by()];
            // One cell of a table each.
            assert!(texts.iter().all(|text| !text.is_empty() && !text.contains(['|', '\n'])), "{texts:?}");
            let constant = format!("DERMIS_FLAG_{} = (1 << {}),", name.to_uppercase().replace('-', "_"), flag as u32);
            assert!(header.contains(&constant), "{constant}");
            let others = Flag::ALL.into_iter().filter(|other| *other != flag);
            for other in others {
                assert!(other.name() != name && other.bit() != flag.bit());
                let shared = flag.status_bit().filter(|_| flag.status_bit() == other.status_bit());
                assert_eq!(shared, None, "{flag:?}, {other:?}");
            }
            let set: FlagSet = [flag].into_iter().collect();
            assert!(set.iter().eq([flag]) && set.bits() == flag.bit(), "{flag:?}");
        }
    }

    #[test]
    fn a_flag_raised_by_a_figure_has_its_figure() {
        let (scene, frame) = setting();
        let checks = Checks {
            full_scale_share: Some(2.0),
            peak_MPa: 100.0,
            mu_share: Some(1.0),
            load_ratio: Some(2.0),
            shape_misfit: Some(2.0),
            noise_MPa: Some(50.0),
            shear_spread: Some(1.0),
            plateau: Some(20.0),
            line_share: Some(1.0),
            constant_share: Some(1.0),
            torn_share: Some(1.0),
            tangential_difference: Some(1.0),
            score_margin: Some(-1.0),
            coarse_share: Some(0.1),
            negative_pressure: Some(1.1),
            missing_share: Some(0.1),
            zero_share: Some(1.0),
            pull_share: Some(1.0),
            ..Checks::default()
        };
        let raised: Vec<Flag> = checks.flags(&scene).collect();
        let by_rule = |flag: &Flag| flag.row().rule.is_some();
        assert_eq!(raised, Flag::ALL.into_iter().filter(by_rule).collect::<Vec<_>>());
        assert!(raised.iter().all(|flag| checks.figure(*flag).is_some()));
        // And none of a good frame.
        let good = Checks { peak_MPa: frame.peak_MPa(), ..Checks::default() };
        assert_eq!(good.flags(&scene).count(), 0);
    }

    #[test]
    fn a_good_frame_has_none() {
        let (scene, mut frame) = setting();
        assert_eq!(flags(&scene, &frame, 20, 1.0), []);
        frame.stress_MPa.fill(0.0);
        frame.cell_forces_N = None;
        assert_eq!(flags(&scene, &frame, 20, 1.0), []);
    }

    #[test]
    fn clipping_and_medium() {
        let (mut scene, frame) = setting();
        assert_eq!(flags(&scene, &frame, 20, 0.99), [Flag::Saturated]);
        scene.medium = Medium::BondedLayer { poisson: 0.48 };
        assert_eq!(flags(&scene, &frame, 20, 1.0), [Flag::MediumMismatch]);
    }

    #[test]
    fn load_outside_by_truth_and_by_the_ring() {
        let (scene, mut frame) = setting();
        frame.resultant_N = frame.resultant_N.map(|[x, y, z]| [x, y, z / 0.99]);
        assert_eq!(flags(&scene, &frame, 20, 1.0), [Flag::LoadOutside]);
        frame.cell_forces_N = None;
        assert_eq!(flags(&scene, &frame, 20, 1.0), []);
        frame.stress_MPa[9] = -frame.peak_MPa();
        assert_eq!(flags(&scene, &frame, 20, 1.0), [Flag::LoadOutside]);
    }

    #[test]
    fn without_an_interior_the_ring_says_nothing() {
        let (scene, frame) = setting();
        let outside = |rows: usize, cols: usize| {
            let sensor = crate::spec::sensor::Sensor { rows, cols, ..scene.sensor.clone() };
            let mut frame = Frame { sensor, cell_forces_N: None, ..frame.clone() };
            frame.stress_MPa = vec![0.0; rows * cols];
            frame.stress_MPa[1] = 1.0;
            flags(&Scene::of_sensor(&frame.sensor, "small"), &frame, 20, 1.0).contains(&Flag::LoadOutside)
        };
        assert_eq!([outside(2, 2), outside(2, 9), outside(9, 2), outside(3, 3)], [false, false, false, true]);
    }

    #[test]
    fn shear_needs_bits_and_quiet() {
        // LSB/√12 of the peak: 3.5e-5 with 14 bits, 7.0e-5 with 13.
        let (mut scene, frame) = setting();
        assert_eq!(flags(&scene, &frame, 14, 1.0), []);
        assert_eq!(flags(&scene, &frame, 13, 1.0), [Flag::ShearUnreliable]);
        scene.search.noise_floor_MPa = Some(6e-5 * frame.peak_MPa());
        assert_eq!(flags(&scene, &frame, 20, 1.0), [Flag::ShearUnreliable]);
        // The mean of two frames has less noise.
        scene.input.average = 1;
        assert_eq!(flags(&scene, &frame, 20, 1.0), []);
        scene.input.average = 0;
        scene.search.mu_max = 0.0;
        assert_eq!(flags(&scene, &frame, 20, 1.0), []);
    }
}
