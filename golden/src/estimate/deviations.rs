//! Deviations: the standard deviations of forces that a search found, from a table of the errors on drawn frames.
//!
//! A search gives the best μ, not how far it may be off. The physics is linear, so that the relative error of a frame depends
//! on its noise over its peak and on the shape of its contact, not on the size of its load. The table has the error that 68 %
//! of drawn frames do not exceed, per level of noise and class of sizes; `dermis deviations` makes it. A
//! subarray is looked up by
//!
//! ```text
//! noise = √(σ² + LSB² / 12) / peak          peak = max |b| of the subarray, LSB that of the converter's codes
//! size  = F / (peak · area of a taxel)      F the normal force
//! ```
//!
//! Between two levels the logarithm of the deviation is linear in that of the noise. Below the first it is that of the first;
//! above the last that of μ is that of the last, since |μ| is bounded, and that of the normal force grows with the noise. Where
//! neither scene nor tare frames state the noise there are no deviations: that of a real array is far above its LSB.
//! The maximum of the objective itself tells whether a frame is one of a contact without noise: a baseline, noise or a faulty
//! taxel leaves forces where none can be, and lowers it. The table has the least one of the drawn frames whose noise hides no
//! shear; a subarray with a lower one has the flag `score-low`. A faulty taxel leaves forces below zero, too, of which a press has
//! few: the table has the least ratio of the forces that press to those that pull, rounded down; a result with a lower one has the
//! flag `negative-pressure`.
//!
//! [`Subject`] has the fields of a scene that must be those of the table. A threshold takes forces away: with one there is no
//! deviation of the normal force.
//!
//! The tables of the built-in scenes are part of the program and serve every scene of the same [`Subject`]. For others
//! `dermis deviations` writes a file that `search.deviations` names.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: result of a search, calibrated stress, noise | –, taxels, scalar | –, MPa, MPa |
//! | out: standard deviation of μ, shear and normal force | 2, 2, 1 per searched subarray | –, N, N |

#[cfg(test)]
mod tests;

use crate::data::frame::Frame;
use crate::plain_words::JsonError;
use crate::read::text_up_to;
use crate::result::checks::{largest_spread, relative_spread, Checks, COUNTS_FROM};
use crate::result::reconstruct::{shear_sigma_N, Reconstruction};
use crate::spec::partition::Case;
use crate::spec::scene::largest_code;
use crate::spec::scene::{EstimatorKind, Form, ObjectiveKind, Scene};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Debug;
use std::sync::LazyLock;
use thiserror::Error;

/// Version of the file.
const VERSION: u32 = 1;
/// Largest [`Deviations::least_push`]: four bits.
pub const MOST_PUSH: u32 = 15;
/// Largest file in bytes.
const LARGEST_FILE: u64 = 1 << 20;
/// Largest size of a score in bits: some 20 bits for each of 65536 taxels, as a status word holds it.
const LARGEST_SCORE: f64 = (1 << 24) as f64;

/// Tables that are part of the program, in JSON.
const SHIPPED: [(&str, &str); 7] = [
    ("sensor-1", include_str!("../../scenes/sensor-1.deviations")),
    ("sensor-1-bonded", include_str!("../../scenes/sensor-1-bonded.deviations")),
    ("sensor-2", include_str!("../../scenes/sensor-2.deviations")),
    ("sensor-3", include_str!("../../scenes/sensor-3.deviations")),
    ("sensor-4", include_str!("../../scenes/sensor-4.deviations")),
    ("eight-by-eight", include_str!("../../scenes/eight-by-eight.deviations")),
    ("eight-by-eight-bonded", include_str!("../../scenes/eight-by-eight-bonded.deviations")),
];

/// The same, read once: models are built by the thousand.
static TABLES: LazyLock<Vec<Deviations>> =
    LazyLock::new(|| SHIPPED.iter().filter_map(|(name, text)| Deviations::parse(text, name).ok()).collect());

/// What a table was measured for: fields of a scene, with their values as texts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Subject(BTreeMap<String, String>);

/// The table of one subject.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Deviations {
    /// Version of the file.
    pub version: u32,
    /// What it was measured for.
    pub subject: Subject,
    /// Number of frames per level.
    pub draws: usize,
    /// Seed of the frames.
    pub seed: u64,
    /// Noise over peak of each level, rising.
    pub levels: Vec<f64>,
    /// Sizes, in taxels, that separate the classes, rising: one less than there are classes.
    pub sizes: Vec<f64>,
    /// Least maximum of the objective, in bits, of the subarrays of frames whose noise hides no shear, a multiple of 1/64; `None`
    /// in tables of earlier versions.
    #[serde(default)]
    pub least_score: Option<f64>,
    /// Least sum of the normal forces above zero over that of those below, of the same frames, rounded down, 1 to [`MOST_PUSH`]; `None`
    /// in tables of earlier versions, and where frames without noise pull as much as they press.
    #[serde(default)]
    pub least_push: Option<u32>,
    /// Per level and class: standard deviation of μ, [x, y], and that of the normal force over the force.
    pub sigma: Vec<Vec<[f64; 3]>>,
}

/// A table cannot be read or used.
#[derive(Debug, Error)]
pub enum DeviationsError {
    /// The file cannot be read.
    #[error("{file}: search.deviations cannot be read: {source}; dermis deviations makes it")]
    Unreadable {
        /// Its path.
        file: String,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file is no table, or damaged.
    #[error("{file}: not a table of standard deviations of this version: {reason}")]
    Damaged {
        /// Its path.
        file: String,
        /// What is wrong.
        reason: String,
    },
    /// The table was measured for something else.
    #[error(
        "{file}: measured for {field} = {measured}, the scene has {scene}; measure it anew with dermis deviations"
    )]
    Mismatch {
        /// Its path.
        file: String,
        /// The scene's field.
        field: String,
        /// The value it was measured for.
        measured: String,
        /// The scene's value.
        scene: String,
    },
}

impl Subject {
    /// The subject of an estimator of a scene; `None` unless it is the search with the objective `sparse`, shear and one μ
    /// per subarray.
    pub fn of(scene: &Scene, estimator: EstimatorKind) -> Option<Subject> {
        let Scene { sensor, search, inverse, fixed, input, partition, .. } = scene;
        let searched = search.objective == ObjectiveKind::Sparse && search.form == Form::Oblique && search.mu_max > 0.0;
        let by_search = estimator == EstimatorKind::Search && partition.case != Case::Contacts;
        let fields: [(&str, &dyn Debug); 19] = [
            ("sensor.rows", &sensor.rows),
            ("sensor.cols", &sensor.cols),
            ("sensor.pitch_x_mm", &sensor.pitch_x_mm),
            ("sensor.pitch_y_mm", &sensor.pitch_y_mm),
            ("sensor.thickness_mm", &sensor.thickness_mm),
            ("medium", &scene.medium),
            ("search.mu_max", &search.mu_max),
            ("search.degree", &search.degree),
            ("inverse.kind", &inverse.kind.name()),
            ("inverse.level", &inverse.level),
            ("fixed.input_bits", &fixed.input_bits),
            ("fixed.data_bits", &fixed.data_bits),
            ("fixed.coef_bits", &fixed.coef_bits),
            ("fixed.inverse_bits", &fixed.inverse_bits),
            ("fixed.prune_bits", &fixed.prune_bits),
            ("partition.case", &partition.case.to_string()),
            ("partition.cases", &partition.listed),
            ("partition.condition", &partition.condition),
            ("input.dead", &input.dead),
        ];
        let texts = || fields.map(|(field, value)| (field.to_owned(), format!("{value:?}"))).into();
        (searched && by_search && !input.unipolar).then(|| Subject(texts()))
    }

    /// The first field in which another subject differs: its name, this value, the other.
    fn differs(&self, other: &Subject) -> Option<(String, String, String)> {
        let names: BTreeSet<&String> = self.0.keys().chain(other.0.keys()).collect();
        let value = |subject: &Subject, name: &String| subject.0.get(name).cloned().unwrap_or_default();
        let pairs = names.into_iter().map(|name| (name.clone(), value(self, name), value(other, name)));
        pairs.into_iter().find(|(_, own, other)| own != other)
    }
}

impl Deviations {
    /// The table of an estimator of a scene: of the file that `search.deviations` names, else the program's own of the same
    /// subject. `None` for one without a [`Subject`], or where neither is there.
    ///
    /// # Errors
    /// [`DeviationsError`] of the named file.
    pub fn of_scene(scene: &Scene, estimator: EstimatorKind) -> Result<Option<Deviations>, DeviationsError> {
        let Some(subject) = Subject::of(scene, estimator) else { return Ok(None) };
        let Some(path) = &scene.search.deviations else {
            return Ok(TABLES.iter().find(|table| table.subject == subject).cloned());
        };
        let file = path.display().to_string();
        let text = match text_up_to(LARGEST_FILE, path) {
            Err(source) => return Err(DeviationsError::Unreadable { file, source }),
            Ok(None) => return Err(DeviationsError::Damaged { file, reason: "it is too large".to_owned() }),
            Ok(Some(text)) => text,
        };
        let table = Deviations::parse(&text, &file)?;
        match table.subject.differs(&subject) {
            None => Ok(Some(table)),
            Some((field, measured, scene)) => Err(DeviationsError::Mismatch { file, field, measured, scene }),
        }
    }

    /// Reads a table; `file` names it in errors.
    ///
    /// # Errors
    /// [`DeviationsError::Damaged`].
    pub fn parse(text: &str, file: &str) -> Result<Deviations, DeviationsError> {
        let damaged = |reason: String| DeviationsError::Damaged { file: file.to_owned(), reason };
        let table: Deviations =
            serde_json::from_str(text).map_err(|error| damaged(JsonError::new(&error).to_string()))?;
        let rising = |all: &[f64]| all.windows(2).all(|pair| pair[0] < pair[1]) && all.iter().all(|x| *x > 0.0);
        let positive = |sigma: &[f64; 3]| sigma.iter().all(|sigma| *sigma > 0.0 && sigma.is_finite());
        let whole = |row: &Vec<[f64; 3]>| row.len() == table.sizes.len() + 1 && row.iter().all(positive);
        let faults = [
            (table.version != VERSION, "its version is another"),
            (table.levels.is_empty() || !rising(&table.levels), "its levels do not rise from above 0"),
            (!rising(&table.sizes), "its sizes do not rise from above 0"),
            (table.sigma.len() != table.levels.len(), "it has not a row per level"),
            (!table.sigma.iter().all(whole), "a row has not a deviation above 0 per class"),
            (table.least_score.is_some_and(|score| score.abs() > LARGEST_SCORE), "its least score is out of range"),
            (table.least_push.is_some_and(|push| !(1..=MOST_PUSH).contains(&push)), "its least push is out of range"),
        ];
        match faults.into_iter().find(|(fault, _)| *fault) {
            None => Ok(table),
            Some((_, reason)) => Err(damaged(reason.to_owned())),
        }
    }

    /// A table of these levels, sizes and deviations.
    pub fn new(
        subject: Subject,
        [draws, seed]: [u64; 2],
        levels: Vec<f64>,
        sizes: Vec<f64>,
        sigma: Vec<Vec<[f64; 3]>>,
        (least_score, least_push): (Option<f64>, Option<u32>),
    ) -> Deviations {
        Deviations {
            version: VERSION,
            subject,
            draws: draws as usize,
            seed,
            levels,
            sizes,
            sigma,
            least_score,
            least_push,
        }
    }

    /// The file, JSON with a line per level.
    pub fn to_text(&self) -> String {
        let line = |row: &Vec<[f64; 3]>| serde_json::json!(row).to_string();
        let rows: Vec<String> = self.sigma.iter().map(line).collect();
        format!(
            "{{\"version\": {}, \"subject\": {},\n\"draws\": {}, \"seed\": {},\n\"levels\": {},\n\"sizes\": {},\n\"least_score\": {},\n\"least_push\": {},\n\"sigma\": [\n{}\n]}}\n",
            self.version,
            serde_json::json!(self.subject),
            self.draws,
            self.seed,
            serde_json::json!(self.levels),
            serde_json::json!(self.sizes),
            serde_json::json!(self.least_score),
            serde_json::json!(self.least_push),
            rows.join(",\n")
        )
    }

    /// Standard deviation of μ, [x, y], and that of the normal force over the force, at a noise over peak and a size in taxels.
    pub fn at(&self, noise: f64, size: f64) -> [f64; 3] {
        let class = self.sizes.partition_point(|edge| *edge <= size);
        let above = self.levels.partition_point(|level| *level <= noise);
        let row = |level: usize| self.sigma[level][class];
        if above == 0 {
            return row(0);
        }
        let low = self.levels[above - 1];
        let [x, y, normal] = row(above - 1);
        let Some(high) = self.levels.get(above) else {
            return [x, y, normal * noise / low];
        };
        let (share, next) = ((noise / low).ln() / (high / low).ln(), row(above));
        let between = |a: f64, b: f64| a.powf(1.0 - share) * b.powf(share);
        [between(x, next[0]), between(y, next[1]), between(normal, next[2])]
    }

    /// Adds the margin of the score and the share of negative pressure to a result, and where `noise_MPa`, the standard deviation of
    /// a taxel of the calibrated `stress`, is finite and above 0, standard deviations to the searched subarrays and the figure of the
    /// shear's spread; with the flags of all.
    pub fn add(&self, result: &mut Reconstruction, scene: &Scene, stress: &Frame, noise_MPa: f64) {
        let score_margin = self.score_margin(result, scene, stress);
        let most = self.least_push.map(|push| 1.0 / (1.0 + f64::from(push)));
        let negative_pressure = result.negative_share().zip(most).map(|(share, most)| share / most);
        let checks = Checks { score_margin, negative_pressure, ..result.checks };
        result.add_checks(scene, checks);
        if !(noise_MPa > 0.0 && noise_MPa.is_finite()) {
            return;
        }
        let mut spreads = Vec::new();
        for index in 0..result.subarrays.len() {
            let Some(load) = Load::of(result, scene, stress, index, noise_MPa) else { continue };
            let own = &mut result.subarrays[index];
            let [x, y, normal] = self.at(load.noise, load.size);
            own.mu_sigma = Some([x, y]);
            own.shear_sigma_N = shear_sigma_N(own.mu_sigma, load.normal_N);
            own.normal_sigma_N = (scene.threshold.min_force_N == 0.0).then_some(normal * load.normal_N);
            spreads.push((load.normal_N, Some(relative_spread(own.mu, [x, y], 1.0))));
        }
        let checks = Checks { shear_spread: largest_spread(&spreads), ..result.checks };
        result.add_checks(scene, checks);
    }
}

impl Deviations {
    /// The least of what the objectives of the subarrays with a share of the load are above [`Deviations::least_score`].
    fn score_margin(&self, result: &Reconstruction, scene: &Scene, stress: &Frame) -> Option<f64> {
        let least = self.least_score?;
        let own = |index: usize| {
            let load = Load::of(result, scene, stress, index, 0.0)?;
            Some((load.normal_N, result.subarrays[index].objective_value? - least))
        };
        let all: Vec<(f64, f64)> = (0..result.subarrays.len()).filter_map(own).collect();
        let total_N: f64 = all.iter().map(|(normal_N, _)| normal_N).sum();
        all.iter()
            .filter(|(normal_N, _)| *normal_N >= COUNTS_FROM * total_N)
            .map(|(_, margin)| *margin)
            .reduce(f64::min)
    }
}

/// What is looked up of a subarray.
pub struct Load {
    /// Normal force in N, above 0.
    pub normal_N: f64,
    /// Standard deviation of noise and rounding over max |b|.
    pub noise: f64,
    /// Normal force over that of the peak on one taxel.
    pub size: f64,
}

impl Load {
    /// Of a subarray of a result of this calibrated `stress`; `None` unless it was searched and presses.
    pub fn of(result: &Reconstruction, scene: &Scene, stress: &Frame, index: usize, noise_MPa: f64) -> Option<Load> {
        let Scene { sensor, input, fixed, .. } = scene;
        let own = result.subarrays.get(index).filter(|own| own.objective_value.is_some())?;
        let part = own.part();
        let normal_N: f64 = match &result.extra.resultants {
            Some(resultants) => resultants.get(index)?.force_N[2],
            None => part.indices(sensor).map(|k| result.forces_N.fz[k]).sum(),
        };
        let peak_MPa = part.indices(sensor).map(|k| stress.stress_MPa[k].abs()).fold(0.0, f64::max);
        let full_scale_MPa = input.full_scale_MPa.unwrap_or_else(|| stress.peak_MPa());
        let rounding_MPa = full_scale_MPa / f64::from(largest_code(fixed.input_bits)) / 12f64.sqrt();
        let noise = noise_MPa.hypot(rounding_MPa) / peak_MPa;
        let size = normal_N / (peak_MPa * sensor.pitch_x_mm * sensor.pitch_y_mm);
        let finite = noise.is_finite() && size.is_finite();
        (normal_N > 0.0 && peak_MPa > 0.0 && finite).then_some(Load { normal_N, noise, size })
    }
}
