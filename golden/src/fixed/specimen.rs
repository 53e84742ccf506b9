//! Tables of a specimen for hardware that is built with writable tables: from a scene to an image, and the model of the
//! hardware that has taken it.

use serde_json::json;

use super::error::FixedError;
use super::model::Model;
use super::plan::cases::{limits, requantised, Limits};
use super::plan::contents::{CasePlan, OwnTables, Plan};
use super::stages::load::{self, Outcome, Tables, VERSION_BITS, WORD_BYTES};
use super::stages::prepare::{Prepare, Scale};
use super::words::quantised::Quantised;
use crate::spec::scene::Scene;

impl Plan {
    /// The tables that the hardware holds, of several arrays those of the first; `None` unless they are writable.
    pub fn tables(&self) -> Option<Tables> {
        let Prepare { zero: Some(zero), gain: Some(gain), .. } = self.prepare.of_array(0) else { return None };
        self.has_writable_tables().then(|| Tables {
            version: self.own().version,
            threshold: self.own().threshold_word(),
            noise_floor: self.own().floor_word(self.floor_bits()),
            zero,
            gain,
            coefficients: match self.scene.hardware.has_writable_coefficients() {
                true => self.cases().iter().flat_map(CasePlan::memory).flatten().collect(),
                false => Vec::new(),
            },
        })
    }

    /// CRC-32 over what the words of an image depend on: this program's version, array, formats, what a code means. Hardware
    /// refuses an image of another layout.
    pub fn table_layout(&self) -> u32 {
        let Scene { sensor, input, hardware, .. } = &self.scene;
        let cover = || json!([sensor.thickness_mm, input.dead]);
        let text = json!({
            "version": env!("CARGO_PKG_VERSION"),
            "array": [sensor.rows, sensor.cols],
            "medium": self.scene.medium,
            "formats": self.formats(),
            "cover": (!hardware.has_writable_coefficients()).then(cover),
            "full_scale_MPa": input.full_scale_MPa,
            "reading_per_MPa": self.prepare.reading_per_MPa,
        });
        crc32fast::hash(text.to_string().as_bytes())
    }

    /// The image of the tables; empty unless they are writable.
    pub fn image(&self) -> Vec<u8> {
        self.tables().map(|tables| tables.image(self.table_layout(), self.formats().code_bits)).unwrap_or_default()
    }

    /// What the hardware does with the bytes of an image: what becomes of it. Tables that are not whole stay so after an image
    /// that is refused.
    pub fn load(&mut self, image: &[u8]) -> Outcome {
        let (layout, code_bits) = (self.table_layout(), self.formats().code_bits);
        let Some(mut tables) = self.tables() else { return Outcome::Refused };
        let outcome = tables.load(image, layout, code_bits);
        match outcome {
            Outcome::Refused => self.refuse(),
            Outcome::Broken => (self.own_mut().version, self.own_mut().outcome) = (0, Outcome::Broken),
            Outcome::Whole => {
                let version = tables.version;
                // The bits that the hardware has of it.
                let noise_floor = tables.noise_floor & ((1 << self.floor_bits()) - 1);
                let threshold = tables.threshold.into();
                *self.own_mut() = OwnTables { noise_floor, threshold, version, outcome: Outcome::Whole };
                (self.prepare.zero, self.prepare.gain) = (Some(tables.zero), Some(tables.gain));
                self.take(&tables.coefficients);
            }
        }
        outcome
    }

    /// Takes coefficients for the matrices, as [`Tables`] has them.
    fn take(&mut self, coefficients: &[i64]) {
        let lanes = 4 * self.formats().lanes_per_parity;
        let words: Vec<Vec<i64>> = coefficients.chunks(lanes).map(<[i64]>::to_vec).collect();
        if !words.is_empty() {
            // Writable coefficients have one case.
            let CasePlan { storage, formats, quantised, .. } = self.first_mut();
            storage.restore(formats, quantised, &words);
        }
    }

    fn refuse(&mut self) {
        if self.own().outcome == Outcome::Whole {
            self.own_mut().outcome = Outcome::Refused;
        }
    }
}

/// The input stream as the hardware takes it, beat by beat: where an image begins and ends.
#[derive(Clone, Debug, Default)]
pub struct Intake {
    /// The bytes of an image that has begun.
    image: Vec<u8>,
    /// The rest of a refused image follows.
    skipping: bool,
    /// Array of the image.
    array: usize,
}

impl Intake {
    /// Whether an image, or the rest of one, is expected.
    pub fn is_busy(&self) -> bool {
        self.skipping || !self.image.is_empty()
    }

    /// Whether the rest of a refused image follows.
    pub fn is_skipping(&self) -> bool {
        self.skipping
    }

    /// Array of the image that has begun; of several arrays the model is that of this one.
    pub fn array(&self) -> usize {
        self.array
    }

    /// Array of the image of the next byte, which comes with `array`: that of the first byte.
    pub fn array_of_byte(&mut self, array: usize) -> usize {
        if !self.is_busy() {
            self.array = array;
        }
        self.array
    }

    /// The bytes of an image that has begun; from the last of its first word on, tables are written.
    pub fn image(&self) -> &[u8] {
        &self.image
    }

    /// A byte, the last of its image or not, between the codes of a frame or not: what becomes of the image if it is over.
    pub fn byte(&mut self, model: &mut Model, byte: u8, last: bool, in_frame: bool) -> Option<Outcome> {
        if self.skipping {
            self.skipping = !last;
            return None;
        }
        if self.image.is_empty() && in_frame {
            self.skipping = !last;
            model.plan_mut().refuse();
            return Some(Outcome::Refused);
        }
        self.image.push(byte);
        let count = self.image.len();
        let full = model.tables().is_some_and(|tables| count == tables.image_bytes());
        let wrong_head = count == WORD_BYTES && !model.image().starts_with(&self.image);
        if !(last || full || wrong_head) {
            return None;
        }
        if full && !last {
            // It is longer than it may be.
            self.image.push(0);
        }
        let outcome = self.ends(model);
        self.skipping = outcome != Outcome::Whole && !last;
        Some(outcome)
    }

    /// A code: the rest of an image that has begun will not come.
    pub fn code(&mut self, model: &mut Model) -> Option<Outcome> {
        self.skipping = false;
        (!self.image.is_empty()).then(|| self.ends(model))
    }

    /// A reset: an image ends whose first word was right. The tables stay as they are, and it is forgotten that one was
    /// refused, of other arrays by [`Model::forget_refusal`]. The last `unused` bytes do not count: a byte that is taken in the
    /// cycle before a reset is not used.
    pub fn reset(&mut self, model: &mut Model, unused: usize) -> Option<Outcome> {
        self.image.truncate(self.image.len().saturating_sub(unused));
        let begun = self.image.len() >= WORD_BYTES;
        let outcome = begun.then(|| self.ends(model));
        model.forget_refusal();
        *self = Intake::default();
        outcome
    }

    fn ends(&mut self, model: &mut Model) -> Outcome {
        model.load(&std::mem::take(&mut self.image))
    }
}

impl Model {
    /// A reset: that an image was refused is forgotten; tables that are not whole stay so.
    pub fn forget_refusal(&mut self) {
        let own = self.plan_mut().own_mut();
        if own.outcome == Outcome::Refused {
            own.outcome = Outcome::Whole;
        }
    }

    /// What the hardware does with the bytes of an image, see [`Plan::load`].
    pub fn load(&mut self, image: &[u8]) -> Outcome {
        self.plan_mut().load(image)
    }

    /// The model of this hardware with the tables of the specimen that `scene` describes; frames report `version`, 1 to 32767. Of
    /// several arrays it is that of one alone: which it becomes, the image does not say.
    ///
    /// # Errors
    /// [`FixedError::Tables`]: the hardware's tables are not writable, or such a version is not possible.
    /// [`FixedError::NoTable`]: the scene differs from the hardware's in more than zero, gain, noise floor, threshold, and
    /// thickness and dead taxels where `hardware.table_range` has them.
    /// [`FixedError::TableRange`], [`FixedError::OutsideRange`], and what is wrong with the files that it names.
    pub fn with_tables(&self, scene: &Scene, version: u16) -> Result<Model, FixedError> {
        let wrong = |field, value, expected| Err(FixedError::Tables { field, value, expected });
        if !self.has_writable_tables() {
            return wrong("hardware.tables", "rom".into(), "\"writable\" in the scene of the hardware");
        }
        if version == 0 || version >> VERSION_BITS != 0 {
            return wrong("version", version.to_string(), "1 to 32767");
        }
        if self.scene.hardware.arrays > 1 {
            return self.of_array(0)?.with_tables(scene, version);
        }
        let mut written = self.scene.clone();
        let specimen = scene.of_array(0).with_chosen_hardware();
        if let Some(part) = differs(&written, &specimen) {
            return Err(FixedError::NoTable { part });
        }
        written.name = specimen.name;
        (written.input.calibration, written.input.tare) = (specimen.input.calibration, specimen.input.tare);
        written.search.noise_floor_MPa = specimen.search.noise_floor_MPa;
        written.threshold = specimen.threshold;
        (written.sensor.thickness_mm, written.input.dead) = (specimen.sensor.thickness_mm, specimen.input.dead);
        let quantised = self.quantised_for(&written)?;
        let scale = Scale::new(&written)?;
        let Limits { prepare, own: limits } = limits(&written, scale, self.formats().force_exponent)?;
        if prepare.reading_per_MPa != self.prepare.reading_per_MPa {
            return Err(FixedError::NoTable { part: "the largest gain, without hardware.table_range.gain," });
        }
        let mut plan = Plan::clone(self);
        (plan.prepare, plan.own) = (prepare, limits);
        if let Some(quantised) = quantised {
            plan.first_mut().quantised = quantised;
        }
        plan.own_mut().version = version;
        plan.scene = written;
        Model::of_plan(plan)
    }

    /// The matrices of a specimen in this hardware's words; `None` where they are not written.
    fn quantised_for(&self, specimen: &Scene) -> Result<Option<Quantised>, FixedError> {
        let range = &self.scene.hardware.table_range;
        if !self.scene.hardware.has_writable_coefficients() {
            return Ok(None);
        }
        let outside = |field, value, allowed| Err(FixedError::OutsideRange { field, value, allowed });
        let (thickness, dead) = (specimen.sensor.thickness_mm, &specimen.input.dead);
        if let Some([least, most]) = range.thickness_mm.filter(|[least, most]| !(least..=most).contains(&&thickness)) {
            let allowed = format!("hardware.table_range.thickness_mm allows {least} to {most}");
            return outside("sensor.thickness_mm", thickness.to_string(), allowed);
        }
        if range.dead_taxels > 0 && dead.len() > range.dead_taxels {
            let allowed = format!("hardware.table_range.dead_taxels allows {}", range.dead_taxels);
            return outside("input.dead", format!("{} taxels", dead.len()), allowed);
        }
        match requantised(self, specimen)? {
            Some(quantised) => Ok(Some(quantised)),
            None => {
                let allowed = format!(
                    "with sensor.thickness_mm = {thickness} the coefficients need wider words than this hardware has; build it for a \
                     wider hardware.table_range"
                );
                outside("input.dead", format!("{dead:?}"), allowed)
            }
        }
    }

    /// The beats of this model's image on the input stream, as codes.
    pub fn image_beats(&self) -> Vec<i32> {
        load::beats(&self.image(), self.formats().code_bits)
    }
}

/// The first field of a specimen's scene that differs from the hardware's and is in no table that can be written.
fn differs(built: &Scene, specimen: &Scene) -> Option<&'static str> {
    let mut other = specimen.clone();
    (other.input.calibration, other.input.tare) = (built.input.calibration.clone(), built.input.tare.clone());
    other.search.noise_floor_MPa = built.search.noise_floor_MPa;
    // That of the floating-point model.
    other.search.estimator = built.search.estimator;
    let range = &built.hardware.table_range;
    if range.thickness_mm.is_some() {
        other.sensor.thickness_mm = built.sensor.thickness_mm;
    }
    if range.dead_taxels > 0 {
        other.input.dead.clone_from(&built.input.dead);
    }
    if range.has_coefficients() {
        // That of the specimen that needs most.
        other.search.degree = other.search.degree.or(built.search.degree);
    }
    // The hardware's scale may have been taken from its frames.
    other.input.full_scale_MPa = other.input.full_scale_MPa.or(built.input.full_scale_MPa);
    other.threshold = built.threshold;
    if other.hardware.board_name() == built.hardware.board_name() {
        // It is the same whether a scene names it or not.
        other.hardware.board.clone_from(&built.hardware.board);
    }
    built.differing_field(&other)
}

#[cfg(test)]
mod tests;
