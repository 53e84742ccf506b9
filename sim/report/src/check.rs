//! What `dermis check` finds, as JSON and as text.

use dermis_golden::fixed::plan::interval::{longest_wait, longest_wait_with_image};
use dermis_golden::fixed::{Cycles, Model};
use dermis_golden::result::checks::pull::TareLoad;
use dermis_golden::spec::sensor::Sensor;
use dermis_hdl::usage::{total, StageUsage, Usage};
use dermis_study::noise::expected::StatedNoise;
use dermis_study::noise::outcome::Summary;
use dermis_study::noise::{SensitivityRow, ShapeRow};
use serde::Serialize;

use super::document::percent_text;
use super::microcontroller::microcontroller_needs;
use super::table::markdown;
use super::BUDGET_US;
use dermis_flow::microcontroller::Needs;

/// Warning of a search in hardware whose noise is not stated.
pub const NOISE_NOT_STATED: &str =
    "the noise is not stated: every result of the hardware's search carries noise-not-stated; \
                                    `dermis check SCENE --stream` measures it";

/// A generated folder.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BuildCheck {
    /// As given.
    pub target: String,
    /// `build`.
    pub checked_as: &'static str,
    /// Number of files of the build, as `dermis build` lists them: manifest.json and those that it lists.
    pub files: usize,
}

/// A scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SceneCheck {
    /// As given.
    pub target: String,
    /// `scene`.
    pub checked_as: &'static str,
    /// The scene's name.
    pub scene: String,
    /// The array.
    pub sensor: Sensor,
    /// The medium, in words.
    pub medium: String,
    /// The floating-point model's estimator, by its name in scenes.
    pub estimator: &'static str,
    /// Degree of a search's series in μ; `None` if no degree is enough, or the array is too large for it.
    pub degree: Option<usize>,
    /// r, which tells how fast the series converges.
    pub spectral_radius: Option<f64>,
    /// Largest ratio of shear to normal force.
    pub mu_max: f64,
    /// Taxels that are left out, [row, col].
    pub dead: Vec<[usize; 2]>,
    /// Name of the board.
    pub board: String,
    /// The hardware; `None` if it is refused.
    pub hardware: Option<HardwareCheck>,
    /// Why the hardware is refused.
    pub hardware_refused: Option<String>,
    /// What the same arithmetic needs in C; `None` if it is refused, or the hardware is.
    pub microcontroller: Option<Needs>,
    /// Why C is refused where the hardware is not.
    pub microcontroller_refused: Option<String>,
    /// Noise, and the stress that it is compared with.
    #[serde(flatten)]
    pub noise: StatedNoise,
    /// Whether every result of the hardware carries `noise-not-stated`.
    pub noise_not_stated: bool,
    /// Which network the hardware may have in place of none, or of one for many sensors, where its frames are of a sensor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub network: Option<String>,
    /// The rates of the estimators on this machine, where they were measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rates: Option<Vec<RateRow>>,
    /// Why they were not, though that was wanted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub not_measured: Option<String>,
    /// What seems to have pressed while the tare was taken.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tare_load: Option<TareLoad>,
    /// Errors on drawn frames.
    pub errors: Vec<ShapeRow>,
    /// Errors on drawn frames of the other medium, at the first level of noise.
    pub other_medium: Vec<SensitivityRow>,
    /// Why there are none.
    pub not_drawn: Option<String>,
}

/// The rate that a machine holds with an estimator.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RateRow {
    /// Name of the estimator.
    pub estimator: &'static str,
    /// Number of frames that were measured.
    pub frames: usize,
    /// Frames per second, on one core.
    pub frames_per_s: f64,
    /// Time of the slowest frame in ms.
    pub slowest_ms: f64,
    /// Why the estimator is refused.
    pub refused: Option<String>,
}

/// A scene's hardware on its board.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HardwareCheck {
    /// Degree of the series in μ.
    pub degree: usize,
    /// The hardware's estimator where it is not that of the floating-point model, by its name in scenes.
    pub estimator_instead: Option<&'static str>,
    /// Optional features that the scene does not use.
    pub left_out: Vec<&'static str>,
    /// Resources.
    #[serde(flatten)]
    pub usage: Usage,
    /// The same as shares of the board, in %: block RAMs, multipliers, flip-flops, LUTs.
    pub of_board_percent: [f64; 4],
    /// Cycles from the first input beat to the last output beat.
    pub cycles: u64,
    /// The engine's clock in MHz.
    pub clock_MHz: f64,
    /// Time of the cycles in µs.
    pub time_us: f64,
    /// Of an engine that serves several arrays.
    pub arrays: Option<ArraysCheck>,
}

/// Frames of all arrays that come at once, one of each.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ArraysCheck {
    /// Number of arrays.
    pub count: usize,
    /// Cycles from the first input beat of all to the last output beat of the last, at most.
    pub cycles: u64,
    /// Time of the cycles in µs.
    pub time_us: f64,
    /// Cycles where an image of tables comes meanwhile; only with tables that are written.
    pub cycles_with_image: Option<u64>,
}

impl HardwareCheck {
    /// The hardware of a model.
    pub fn new(
        model: &Model,
        usage: &StageUsage,
        estimator_instead: Option<&'static str>,
        left_out: Vec<&'static str>,
    ) -> Self {
        let (board, usage, cycles) = (&model.board, total(usage), Cycles::longest(model).total);
        let (count, wait) = (model.scene.hardware.arrays, longest_wait(model));
        let cycles_with_image = longest_wait_with_image(model);
        let arrays = ArraysCheck { count, cycles: wait, time_us: board.microseconds(wait), cycles_with_image };
        HardwareCheck {
            arrays: (count > 1).then_some(arrays),
            degree: model.formats().degree,
            estimator_instead,
            left_out,
            of_board_percent: usage.shares(board),
            usage,
            cycles,
            clock_MHz: board.clock_MHz,
            time_us: board.microseconds(cycles),
        }
    }

    fn text(&self, board: &str) -> String {
        let HardwareCheck { cycles, clock_MHz, time_us, .. } = self;
        let names = ["block RAMs", "multipliers", "flip-flops*", "LUTs*"];
        let counts: Vec<String> = (names.iter().zip(self.usage.counts()).zip(self.of_board_percent))
            .map(|((name, count), share)| format!("{count} {name} ({share:.0} %)"))
            .collect();
        let verdict = if self.of_board_percent.iter().all(|share| *share <= 100.0) { "fits" } else { "may not fit" };
        let mut text = format!("board       {verdict} {board}: {}; * estimated\n", counts.join(", "));
        let margin = if *time_us <= BUDGET_US as f64 { "within" } else { "over" };
        text += &format!(
            "time        at most {cycles} cycles = {time_us:.2} µs at {clock_MHz} MHz, {margin} the budget of {BUDGET_US} µs\n"
        );
        if let Some(ArraysCheck { count, cycles, time_us, cycles_with_image }) = &self.arrays {
            text += &format!(
                "arrays      {count}; of frames that come at once the last result is there after at most {cycles} cycles = {time_us:.2} µs"
            );
            let beside =
                cycles_with_image.map(|cycles| format!(", with an image of tables among them {cycles} cycles"));
            text += &format!("{}\n", beside.unwrap_or_default());
        }
        if let Some(instead) = self.estimator_instead {
            text += &format!("left out    by the hardware: the model's estimator; it computes {instead}\n");
        }
        if !self.left_out.is_empty() {
            text +=
                &format!("left out    of the hardware, as the scene does not use it: {}\n", self.left_out.join(", "));
        }
        text
    }
}

/// One line on a folder that is intact.
pub fn build_check(build: &BuildCheck) -> String {
    let BuildCheck { target, files, .. } = build;
    format!(
        "{target}: {files} files are as built: manifest.json matches its checksum, the others match manifest.json\n"
    )
}

/// What was found of a scene.
pub fn scene_check(check: &SceneCheck) -> String {
    let SceneCheck { scene, sensor, estimator, degree, mu_max, board, .. } = check;
    let mut text = format!("scene       {scene}: {sensor}, {}\n", check.medium);
    let series = degree.zip(check.spectral_radius);
    let series = series.map(|(degree, r)| format!(", degree {degree} (r = {r:.3} at mu_max = {mu_max})"));
    text += &format!("model       estimator {estimator}{}\n", series.unwrap_or_default());
    if !check.dead.is_empty() {
        let dead: Vec<String> = check.dead.iter().map(|[row, col]| format!("{row},{col}")).collect();
        text += &format!("left out    dead taxels {}\n", dead.join(" "));
    }
    match (&check.hardware, &check.hardware_refused) {
        (Some(hardware), _) => {
            if degree.is_none_or(|degree| degree != hardware.degree) {
                text += &format!("hardware    degree {}\n", hardware.degree);
            }
            text += &hardware.text(board);
        }
        (None, reason) => text += &format!("hardware    none: {}\n", reason.as_deref().unwrap_or_default()),
    }
    match (&check.microcontroller, &check.microcontroller_refused) {
        (Some(needs), _) => text += &format!("in C        {}\n", microcontroller_needs(needs)),
        (None, Some(reason)) => text += &format!("in C        none: {reason}\n"),
        (None, None) => {}
    }
    if let Some(TareLoad { row, col, stress_MPa }) = check.tare_load {
        text += &format!(
            "tare        something pressed: {stress_MPa:.4} MPa above the table's offset at row {row}, column {col}; take it again\n"
        );
    }
    text += &rates(check);
    text += &noise(&check.noise);
    if check.noise_not_stated {
        text += &format!("            {NOISE_NOT_STATED}\n");
    }
    if let Some(advice) = &check.network {
        text += &format!("network     {advice}\n");
    }
    match &check.not_drawn {
        Some(reason) => text += &format!("errors      none: {reason}\n"),
        None => text += &errors(&check.errors),
    }
    text += &other_medium(check);
    text
}

/// The rates on this machine, where they were measured.
fn rates(check: &SceneCheck) -> String {
    let row = |row: &RateRow| match &row.refused {
        Some(reason) => format!("{:17} none: {reason}", row.estimator),
        None => format!("{:17} {:.1} frames/s, slowest {:.1} ms", row.estimator, row.frames_per_s, row.slowest_ms),
    };
    match (&check.rates, &check.not_measured) {
        (Some(rows), _) => {
            let rows: Vec<String> = rows.iter().map(|own| format!("            {}\n", row(own))).collect();
            format!("rate        of a moving contact, on this machine, one core:\n{}", rows.concat())
        }
        (None, Some(reason)) => format!("rate        none: {reason}\n"),
        (None, None) => String::new(),
    }
}

/// What it costs if the cover is held otherwise; nothing where no frames could be drawn.
fn other_medium(check: &SceneCheck) -> String {
    let (Some(first), Some(level)) = (check.other_medium.first(), check.errors.first()) else { return String::new() };
    let rows = check.other_medium.iter().map(|row| (level.noise, &row.estimator, &row.summary));
    format!(
        "\nmedium      if the cover is no {} as the scene states but a {}:\n\n{}",
        check.medium,
        first.medium,
        table(rows)
    )
}

fn noise(noise: &StatedNoise) -> String {
    let missing = "errors at several levels below";
    match (noise.noise_MPa, noise.peak_MPa, noise.share()) {
        (Some(noise), Some(peak), Some(share)) => {
            format!("noise       {noise} MPa = {} of {peak} MPa\n", percent_text(share))
        }
        (Some(noise), _, _) => {
            format!("noise       {noise} MPa; of what press is unknown (input.full_scale_MPa, --peak): {missing}\n")
        }
        (None, _, _) => {
            format!("noise       not stated (search.noise_floor_MPa, or frames of input.tare): {missing}\n")
        }
    }
}

/// Errors of drawn frames.
fn errors(rows: &[ShapeRow]) -> String {
    let draws = rows.first().map_or(0, |row| row.summary.draws);
    let table = table(rows.iter().map(|row| (row.noise, &row.estimator, &row.summary)));
    format!("errors      of {draws} drawn contacts of any shape; none: no shear, Σ b·area\n\n{table}")
}

/// Errors by noise and estimator: median and 90 % quantile.
fn table<'a>(rows: impl Iterator<Item = (f64, &'a String, &'a Summary)>) -> String {
    let head = ["noise", "estimator", "e_t median", "e_t 90 %", "e_n median", "e_n 90 %", "flagged"];
    let cells = rows.map(|(noise, estimator, of)| {
        let spreads = [of.tangential.median, of.tangential.ninety, of.normal.median, of.normal.ninety, of.flagged];
        let numbers = spreads.map(|interval| percent_text(interval.value));
        [vec![percent_text(noise), estimator.clone()], numbers.to_vec()].concat()
    });
    markdown(&head, cells.collect())
}
