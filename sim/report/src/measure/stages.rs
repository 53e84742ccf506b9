//! Differences between fixed and floating point at each stage, in the stage's LSB.
//!
//! The floating-point reference starts from the unquantised stress with unrounded matrices, but uses the block
//! exponents of the bit-true model, so that both have the same unit. With s the left shift of `normalise` and r the
//! right shift of `rescale` of a subarray:
//!
//! | stage | floating point | LSB |
//! |---|---|---|
//! | receive | b | full scale / largest code |
//! | normalise, fold | b, its parities | LSB of `receive` / 2^s = c |
//! | pass | parities of Cz⁺b; of v_ij (4/3 mu_max)^(i+j) | c 2^(raw_shift − inverse_exponent) = a; a 2^(r + 4 − a_exponent) |
//! | rescale | the same | a 2^r = w |
//! | relax | p after each step at the μ of the network | w |
//! | unfold | v_ij (mu_max/3)^(i+j) per taxel | w/4 |
//! | search | the golden model's μ | mu_max/384 |
//! | forces | p at the bit-true model's μ | w/4 |
//! | send | the golden model's forces | that of the force word |
//!
//! Shares are relative to the frame's largest value in physical units, so that a subarray with little load, in whose
//! small LSB rounding looks large, does not dominate.
//!
//! Stage `forces` thus shows the error of the arithmetic alone, stage `send` the error of arithmetic and search.

use anyhow::{bail, Result};
use dermis_golden::data::frame::Frame;
use dermis_golden::data::reception::full_scale;
use dermis_golden::estimate::float::pass::Polynomial;
use dermis_golden::estimate::float::Golden;
use dermis_golden::fixed::stages::pass::join_limbs;
use dermis_golden::fixed::stages::send::Status;
use dermis_golden::fixed::words::arith::bit_length;
use dermis_golden::fixed::words::formats::{Formats, MU_STEPS, SEARCH_EXTRA_BITS};
use dermis_golden::fixed::words::schedule::{by_limbs, is_transposed, schedule, vectors, EXPONENTS};
use dermis_golden::fixed::{Model, Trace};
use dermis_golden::physics::symmetry::parity::hadamard;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::board::EngineKind;
use dermis_golden::spec::scene::Scene;

use super::measured::Measured;

/// One stage of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct StageRow {
    /// Scene name.
    pub scene: String,
    /// Case, as named in scene files.
    pub case: String,
    /// Frame name.
    pub frame: String,
    /// Stage name.
    pub stage: &'static str,
    /// Largest difference, in LSB.
    pub max_lsb: f64,
    /// Root mean square difference, in LSB.
    pub rms_lsb: f64,
    /// Largest difference over the stage's largest value.
    pub max_share: f64,
    /// RMS difference over the stage's largest value.
    pub rms_share: f64,
    /// Bits needed by the largest word of the stage, sign included.
    pub used_bits: u32,
    /// Width of the word in bits.
    pub has_bits: u32,
    /// Number of saturated words.
    pub saturations: u32,
}

/// Words of a stage with their floating-point references in LSB, and the value of an LSB.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ComparedWords {
    /// The integers.
    pub words: Vec<i64>,
    /// The reference of each, in its LSB.
    pub values: Vec<f64>,
    /// What an LSB of each is worth: MPa up to `fold`, then N; of `search` the step of μ.
    pub lsb: Vec<f64>,
}

impl ComparedWords {
    /// Adds words with a common LSB.
    fn add(&mut self, words: impl IntoIterator<Item = i64>, values: impl IntoIterator<Item = f64>, lsb: f64) {
        self.words.extend(words);
        self.values.extend(values);
        self.lsb.resize(self.words.len(), lsb);
    }

    /// Adds a quad of words with a common LSB.
    fn add_quad(&mut self, words: &[i64], (values, lsb): ([f64; 4], f64)) {
        self.words.extend(words);
        self.values.extend(values);
        self.lsb.resize(self.words.len(), lsb);
    }
}

/// All stages of a frame in pipeline order; empty without bit-true model, and where each contact has a μ of its own: what
/// those stages compute depends on the contacts found, which differ between the models in ties and rounding.
pub fn stages(measured: &Measured, index: usize) -> Vec<StageRow> {
    let Ok(bit_true) = &measured.bit_true else { return Vec::new() };
    if bit_true.model.by_contact.is_some() {
        return Vec::new();
    }
    let reference = FloatReference::new(
        &bit_true.model,
        &measured.engine,
        &measured.frames[index],
        &measured.golden[index],
        &bit_true.traces[index],
    );
    let row = |(stage, has_bits, saturations)| {
        let compared = reference.compared_words(stage);
        let off = || compared.words.iter().zip(&compared.values).map(|(word, value)| (*word as f64 - value).abs());
        let worth = || off().zip(&compared.lsb).map(|(off, lsb)| off * lsb);
        let peak = compared
            .values
            .iter()
            .zip(&compared.lsb)
            .fold(0.0, |peak: f64, (value, lsb)| peak.max((value * lsb).abs()));
        let share = |value: f64| if peak > 0.0 { value / peak } else { 0.0 };
        let rms = |squares: f64| (squares / compared.words.len().max(1) as f64).sqrt();
        // Compared is the sum of both limbs; the words of the stage are those of each.
        let words = match stage {
            "pass" => reference.words(stage).concat(),
            _ => compared.words.clone(),
        };
        let used = words.iter().map(|word| bit_length((word ^ (word >> 63)) as u64) + 1).max();
        StageRow {
            scene: measured.scene.name.clone(),
            case: measured.scene.partition.case.to_string(),
            frame: measured.frames[index].id.clone(),
            stage,
            max_lsb: off().fold(0.0, f64::max),
            rms_lsb: rms(off().map(|d| d * d).sum()),
            max_share: share(worth().fold(0.0, f64::max)),
            rms_share: share(rms(worth().map(|d| d * d).sum())),
            used_bits: used.unwrap_or(0),
            has_bits,
            saturations,
        }
    };
    reference.bits().into_iter().map(row).filter(|row| row.used_bits > 0).collect()
}

/// The words of every stage of one frame beside their references: name, width in bits, words; in pipeline order.
///
/// # Errors
/// A scene without hardware, one whose frames are averaged, whose case is chosen per frame or whose contacts have a μ each, a
/// frame of another sensor.
pub fn trace(scene: &Scene, frame: &Frame) -> Result<Vec<(&'static str, u32, ComparedWords)>> {
    if scene.input.average > 0 {
        bail!("scene {}: input.average = {}: stages are compared without averaging", scene.name, scene.input.average);
    }
    let engine = Golden::reference(scene)?;
    let frames = std::slice::from_ref(frame);
    let model = Model::for_frames(scene, frames)?;
    if model.by_contact.is_some() {
        bail!("scene {}: partition.case = contacts: stages are compared with one μ", scene.name);
    }
    if model.chooses() {
        bail!("scene {}: partition.case = {}: stages are compared in one case", scene.name, scene.partition.case);
    }
    let (golden, trace) = (engine.run(frame)?, model.run(&model.readings(frames)?));
    let stress = model.stress(frames)?;
    let reference = FloatReference::new(&model, &engine, &stress, &golden, &trace);
    let compared = reference.bits().map(|(stage, bits, _)| (stage, bits, reference.compared_words(stage)));
    Ok(compared.into_iter().filter(|(_, _, compared)| !compared.words.is_empty()).collect())
}

/// Floating-point reference of a frame.
struct FloatReference<'a> {
    model: &'a Model,
    /// The frame's stress.
    frame: &'a Frame,
    golden: &'a Reconstruction,
    trace: &'a Trace,
    status: Vec<Status>,
    /// Stress of one LSB of a code.
    code_MPa: f64,
    /// The family p(μ) of each subarray.
    families: Vec<Polynomial>,
}

impl<'a> FloatReference<'a> {
    fn new(
        model: &'a Model,
        engine: &'a Golden,
        frame: &'a Frame,
        golden: &'a Reconstruction,
        trace: &'a Trace,
    ) -> Self {
        let stress =
            |part: &dermis_golden::spec::partition::Subarray| part.gather(&model.scene.sensor, &frame.stress_MPa);
        let family = |b: Vec<f64>| Some(Polynomial::of_degree(engine.matrices()?, &b, model.formats().degree));
        FloatReference {
            model,
            frame,
            golden,
            trace,
            status: Status::all(&trace.status).collect(),
            code_MPa: full_scale(&model.scene, frame) / model.prepare.largest(),
            families: model.parts().iter().filter_map(|part| family(stress(part))).collect(),
        }
    }

    fn formats(&self) -> &Formats {
        self.model.formats()
    }

    /// Stages, widths of their words, and numbers of saturated words.
    fn bits(&self) -> [(&'static str, u32, u32); 10] {
        let f = self.formats();
        let sum = |pick: fn(&Status) -> u32| self.status.iter().map(pick).sum::<u32>();
        let accumulator = match self.model.board.engine {
            EngineKind::Parallel => f.lane_bits,
            EngineKind::Serial => f.acc_bits,
        };
        [
            ("receive", f.code_bits, 0),
            ("normalise", f.input_bits, 0),
            ("fold", f.fold_bits, 0),
            ("pass", accumulator, 0),
            ("rescale", f.vector_bits, sum(|status| status.rescale_saturations)),
            ("relax", f.vector_bits, 0),
            ("unfold", f.vector_bits + 2, 0),
            ("search", bit_length(MU_STEPS as u64) + 1, 0),
            ("forces", f.search_bits[0], 0),
            ("send", 32, self.status.first().map_or(0, |status| status.force_saturations)),
        ]
    }

    /// The words of a stage, of all subarrays in order; four fields per quad.
    fn words(&self, stage: &str) -> &[Vec<i64>] {
        self.trace.stages.iter().find(|s| s.name == stage).map_or(&[], |s| &s.words)
    }

    fn compared_words(&self, stage: &str) -> ComparedWords {
        let mut compared = ComparedWords::default();
        match stage {
            "receive" => {
                let values = self.frame.stress_MPa.iter().map(|b| b / self.code_MPa);
                compared.add(self.words(stage).iter().flatten().copied(), values, self.code_MPa);
            }
            "search" => self.search(&mut compared),
            "send" => self.send(&mut compared),
            _ => {
                let words = self.words(stage);
                let own = words.len() / self.status.len().max(1);
                for (part, words) in words.chunks(own.max(1)).enumerate() {
                    let words = if stage == "pass" { self.joined(words) } else { words.to_vec() };
                    let values = self.quads(stage, part);
                    words.iter().zip(values).for_each(|(words, values)| compared.add_quad(words, values));
                }
            }
        }
        compared
    }

    /// The rows of `pass` of one subarray, those of v_00 with all their limbs.
    fn joined(&self, words: &[Vec<i64>]) -> Vec<Vec<i64>> {
        let (f, engine) = (self.formats(), self.model.board.engine);
        let limbs = if engine == EngineKind::Parallel { by_limbs(&schedule(f)[0]).len() } else { 1 };
        let quads: Vec<[i64; 4]> = words.iter().map(|word| [0, 1, 2, 3].map(|parity| word[parity])).collect();
        let (first, later) = quads.split_at(limbs * f.quads);
        let first = join_limbs(f, &first.chunks(f.quads).map(<[_]>::to_vec).collect::<Vec<_>>());
        first.iter().chain(later).map(|quad| quad.to_vec()).collect()
    }

    /// Adds μ of every subarray that was searched.
    fn search(&self, compared: &mut ComparedWords) {
        let step = self.model.scene.search.mu_max / MU_STEPS as f64;
        let golden = &self.golden.subarrays;
        for (status, golden) in self.status.iter().zip(golden).filter(|(_, golden)| golden.objective_value.is_some()) {
            compared.add(status.position().map(i64::from), golden.mu.map(|mu| mu / step), step);
        }
    }

    /// Adds the output forces.
    fn send(&self, compared: &mut ComparedWords) {
        let model = self.model;
        if model.sends_resultants() {
            return;
        }
        let lsb_N = model.force_lsb_N(self.code_MPa * model.prepare.largest());
        let forces = &self.golden.forces_N;
        let beats = &self.trace.beats;
        for (k, axis) in [&forces.fx, &forces.fy, &forces.fz].into_iter().enumerate() {
            compared.add(beats.iter().map(|beat| i64::from(beat[k])), axis.iter().map(|f| f / lsb_N), lsb_N);
        }
    }

    /// The reference values of a stage of one subarray in quads, in LSB, each with its LSB in MPa or N.
    fn quads(&self, stage: &str, part: usize) -> Vec<([f64; 4], f64)> {
        let (f, model, status) = (self.formats(), self.model, &self.status[part]);
        let layout = model.layout();
        let scene = &self.model.scene;
        let code = self.code_MPa / 2f64.powi(status.normalise as i32);
        let raw = code * 2f64.powi(f.raw_shift as i32 - f.inverse_exponent);
        let word = raw * 2f64.powi(status.rescale as i32);
        let stress = || {
            let b = model.parts()[part].gather(&scene.sensor, &self.frame.stress_MPa);
            layout.pack(&b).into_iter()
        };
        let family = &self.families[part];
        match stage {
            "normalise" => return stress().map(|quad| in_lsb(quad, code)).collect(),
            "fold" => return stress().map(|quad| in_lsb(hadamard(quad), code)).collect(),
            "forces" => {
                let step = scene.search.mu_max / MU_STEPS as f64;
                let p = family.eval(status.position().map(|position| f64::from(position) * step));
                return layout.pack(&p).into_iter().map(|quad| in_lsb(quad, word / 4.0)).collect();
            }
            _ => {}
        }
        if f.has_network() {
            return self.relaxed(stage, part, [raw, word]);
        }
        let scale = 4.0 / 3.0 * scene.search.mu_max;
        let mut all = Vec::new();
        for (k, products) in schedule(f).iter().enumerate() {
            let (i, j) = EXPONENTS[k];
            let order = (i + j) as i32;
            let v = family.v(i as usize, j as usize).iter().map(|v| v * scale.powi(order));
            let quads = layout.pack(&v.collect::<Vec<_>>());
            let swapped = is_transposed(products);
            let moved = |address: usize| if swapped { quads[layout.transposed(address)] } else { quads[address] };
            let lsb = match stage {
                "pass" if k == 0 => raw,
                "pass" => word * 2f64.powi(SEARCH_EXTRA_BITS as i32 - f.a_exponent),
                "rescale" => word,
                _ => word / 4.0 * 4f64.powi(order),
            };
            all.extend((0..quads.len()).map(moved).map(|quad| {
                let quad = match (stage, swapped) {
                    ("unfold", _) => quad,
                    (_, true) => hadamard([quad[0], quad[2], quad[1], quad[3]]),
                    (_, false) => hadamard(quad),
                };
                in_lsb(quad, lsb)
            }));
        }
        all
    }
}

impl FloatReference<'_> {
    /// The same for the steps of `relax`: v_00, then p or the products that are added to v_00; `raw` and `word` are LSBs.
    fn relaxed(&self, stage: &str, part: usize, [raw, word]: [f64; 2]) -> Vec<([f64; 4], f64)> {
        let (f, layout) = (self.formats(), self.model.layout());
        let step = self.model.scene.search.mu_max / MU_STEPS as f64;
        let mu = self.status[part].position().map(|position| f64::from(position) * step);
        // After so many steps p has the terms up to that degree.
        let after = |degree: usize| {
            let coefficients = self.families[part].coefficients[..vectors(degree)].to_vec();
            Polynomial { degree, coefficients }.eval(mu)
        };
        let first = after(0);
        let of_step = |steps: usize| {
            let product = steps > 0 && matches!(stage, "pass" | "rescale");
            let p = after(steps).into_iter().zip(&first).map(|(p, first)| if product { p - first } else { p });
            let lsb = match stage {
                "pass" if steps == 0 => raw,
                "pass" => word * 2f64.powi(SEARCH_EXTRA_BITS as i32 - f.a_exponent),
                "unfold" => word / 4.0,
                _ => word,
            };
            let quads = layout.pack(&p.collect::<Vec<_>>());
            quads.into_iter().map(move |quad| in_lsb(if stage == "unfold" { quad } else { hadamard(quad) }, lsb))
        };
        (0..=f.degree).flat_map(of_step).collect()
    }
}

/// Converts a quad to LSBs; returns it with the LSB.
fn in_lsb(quad: [f64; 4], lsb: f64) -> ([f64; 4], f64) {
    (quad.map(|value| value / lsb), lsb)
}

#[cfg(test)]
mod tests {
    use super::super::{measure, Options};
    use super::*;
    use dermis_flow::jobs::Interrupt;
    use dermis_golden::spec::partition::Case;
    use dermis_golden::spec::scene::Condition;

    #[test]
    fn every_stage_is_near_its_float_in_every_case() {
        let options = Options {
            quick: true,
            jobs: 2,
            build: "build".into(),
            condition: Condition::Loaded,
            simulate: false,
            interrupt: Interrupt::default(),
        };
        let cases = |numbers: &[i64]| numbers.iter().filter_map(|n| Case::numbered(*n)).collect::<Vec<_>>();
        let scenes = |names: &[&str]| names.iter().map(|name| Scene::builtin(name).unwrap()).collect::<Vec<_>>();
        let mut measured =
            measure(&scenes(&["sensor-1", "sensor-1-noisy", "eight-by-eight"]), &cases(&[0, 1, 3]), &options).unwrap();
        // Of contacts nothing is compared.
        let contacts = measure(&scenes(&["eight-by-eight-contacts"]), &[], &options).unwrap();
        assert!(contacts.len() == 1 && contacts[0].bit_true.is_ok() && stages(&contacts[0], 0).is_empty());
        measured.extend(measure(&scenes(&["sensor-4"]), &cases(&[1]), &options).unwrap());
        // sensor-4 fits the board in case 1, where Ay is Ax transposed.
        let rows: Vec<StageRow> = measured.iter().flat_map(|measured| stages(measured, 0)).collect();
        // With a network there is one stage more.
        assert_eq!(rows.len(), 9 * 7 + 10);
        for row in &rows {
            let (stage, what) = (row.stage, format!("{row:?}"));
            assert!(row.used_bits <= row.has_bits, "{what}");
            match stage {
                // The only error is one rounding.
                "receive" => assert!(row.max_lsb <= 0.5 + 1e-9, "{what}"),
                "search" | "send" => {}
                // 20-bit input, 18-bit operands, pruning at 2⁻¹⁷ or below: an error of 2⁻¹² would show a defect.
                _ => assert!(row.max_share < 2.4e-4, "{what}"),
            }
            // A wrong unit would give an error of at least half the value.
            assert!(stage == "search" || row.rms_share < 0.25, "{what}");
        }
        assert!(rows.iter().filter(|row| row.stage == "pass").all(|row| row.rms_lsb > 0.0));
        // The lanes' accumulators are narrower than the sum of both limbs.
        for measured in &measured {
            let formats = measured.bit_true.as_ref().unwrap().model.formats();
            let pass = stages(measured, 0).into_iter().find(|row| row.stage == "pass").unwrap();
            assert!(pass.has_bits == formats.lane_bits && pass.has_bits < formats.acc_bits, "{pass:?}");
        }
    }
}
