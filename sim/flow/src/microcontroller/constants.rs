//! Constants: widths, shifts and options of a scene as `engine.c` takes them, from the bit-true model's own.

use std::fmt::{Display, Write};

use dermis_golden::fixed::stages::estimate::{ln_sigma_range, OUTPUTS, REDUCTIONS, REDUCTION_SHIFT};
use dermis_golden::fixed::stages::pass::POSITION_SHIFT;
use dermis_golden::fixed::stages::prepare::{code_check, Prepared, GAIN_FRACTION};
use dermis_golden::fixed::stages::search::{log_table, COARSE_CENTRES};
use dermis_golden::fixed::stages::send::{status_fields, CYCLES, LN_SIGMA_BITS, STATUS_BEATS};
use dermis_golden::fixed::words::formats::{
    EPSILON_SHIFT, FORCE_BITS, FORCE_SHIFT_MAX, HALVINGS, LOG_FRACTION, LOG_TABLE_BITS, MU_ROUND, MU_STEPS,
    SEARCH_EXTRA_BITS,
};
use dermis_golden::fixed::words::network::{LAST_SHIFT, ONE, OUTPUT_BITS, POSITION_BITS};
use dermis_golden::fixed::words::schedule::EXPONENTS;
use dermis_golden::fixed::Model;
use dermis_golden::result::flags::StatusField;
use dermis_golden::spec::quads::Quads;
use dermis_golden::spec::scene::{largest_code, Condition};

use super::tables::{table, Layout};

/// Words of a beat.
const BEAT_WORDS: usize = 3;
/// Words of a status.
pub(super) const STATUS_WORDS: usize = BEAT_WORDS * STATUS_BEATS;

/// The word of a status that holds a field.
pub(super) fn status_word(field: &StatusField) -> usize {
    BEAT_WORDS * field.beat + field.word
}

/// Definitions of C constants.
#[derive(Default)]
struct Definitions(String);

impl Definitions {
    /// A `name` that stands for `value`.
    fn add(&mut self, name: &str, value: impl Display) {
        let _ = writeln!(self.0, "#define {name} {value}");
    }

    /// A number without sign.
    fn unsigned(&mut self, name: &str, value: impl Display) {
        self.add(name, format!("{value}U"));
    }

    /// A number of 64 bits.
    fn long(&mut self, name: &str, value: i64) {
        self.add(name, format!("INT64_C({value})"));
    }

    /// What the preprocessor asks for.
    fn option(&mut self, name: &str, present: bool) {
        self.add(name, u8::from(present));
    }
}

/// The constants and small tables of a scene, in C.
pub(super) fn constants(model: &Model, layout: &Layout) -> String {
    let mut definitions = Definitions::default();
    add_input(&mut definitions, model, layout);
    add_passes(&mut definitions, model);
    add_forces(&mut definitions, model);
    add_status(&mut definitions, model);
    let mut text = definitions.0 + "\n" + &quads_table(model.layout()) + &input_tables(model);
    if model.has_network() {
        text += &table("uint32_t", "OUTPUT_PARITY", &OUTPUTS.map(|(parity, _)| parity));
        text += &table("uint32_t", "OUTPUT_ROW", &OUTPUTS.map(|(_, row)| row));
    }
    if model.searches() {
        text += &table("int32_t", "CENTRE_X", &COARSE_CENTRES.map(|[x, _]| x));
        text += &table("int32_t", "CENTRE_Y", &COARSE_CENTRES.map(|[_, y]| y));
        text += &table("uint32_t", "DEGREE_OF", &EXPONENTS.map(|(i, j)| i + j));
        text += &table("int32_t", "LOG_TABLE", log_table());
    }
    text
}

fn add_input(definitions: &mut Definitions, model: &Model, layout: &Layout) {
    let (formats, scene) = (model.formats(), &model.scene);
    definitions.unsigned("TAXELS", scene.sensor.taxels());
    definitions.unsigned("COLUMNS", scene.sensor.cols);
    definitions.unsigned("QUADS", formats.quads);
    definitions.unsigned("QUAD_COLUMNS", model.layout().quad_cols());
    definitions.unsigned("CODE_BITS", formats.code_bits);
    definitions.option("HAS_ZERO", model.prepare.zero.is_some());
    definitions.option("HAS_GAIN", model.prepare.gain.is_some());
    definitions.unsigned("GAIN_FRACTION", GAIN_FRACTION);
    definitions.option("HAS_FULL_SCALE", scene.input.full_scale_MPa.is_some());
    definitions.option("UNIPOLAR", scene.input.unipolar);
    definitions.add("DEAD_TAXELS", model.dead.len());
    definitions.add("NOISE_FLOOR", model.noise_floor());
    definitions.add("CONDITION_BOTH_SIGNS", u8::from(scene.partition.condition == Condition::BothSigns));
    definitions.add("INPUT_LOW_BITS", formats.input_low_bits);
    definitions.add("LIMB_ALIGN", formats.limb_align);
    definitions.unsigned("INPUT_HIGH", layout.input_high);
    definitions.unsigned("INPUT_LOW", layout.input_low);
    definitions.unsigned("BIAS", layout.bias);
    definitions.add("BIAS_WORD", ONE);
    definitions.option("HAS_CODE_CHECK", model.prepare.check.is_some());
    if let Some(check) = &model.prepare.check {
        definitions.option("CODES_FALL", check.falls);
        definitions.unsigned("CHECK_MIRROR", code_check::MIRROR);
        definitions.unsigned("CHECK_PLATEAU_CODES", code_check::PLATEAU_CODES);
        definitions.unsigned("CHECK_PLATEAU_GAP", code_check::PLATEAU_GAP);
        definitions.unsigned("CHECK_FINE", code_check::FINE);
        definitions.unsigned("CHECK_LOADED", code_check::LOADED);
    }
}

fn add_passes(definitions: &mut Definitions, model: &Model) {
    let formats = model.formats();
    definitions.option("HAS_NETWORK", model.has_network());
    definitions.option("HAS_SEARCH", model.searches());
    definitions.option("SHARES_A", formats.shared_a);
    definitions.unsigned("VECTOR_COUNT", formats.vectors());
    definitions.unsigned("VECTOR_BITS", formats.vector_bits);
    definitions.unsigned("FULL_LENGTH", formats.full_length());
    definitions.unsigned("A_SHIFT", formats.a_shift);
    definitions.unsigned("EXTRA_BITS", SEARCH_EXTRA_BITS);
    definitions.unsigned("DATA_BITS", formats.data_bits);
    if let Some(network) = &model.quantised().network {
        let [least, most] = ln_sigma_range();
        definitions.unsigned("LAYER_COUNT", network.layers.len());
        definitions.unsigned("LAYER_SHIFT", network.shift);
        definitions.unsigned("LAST_SHIFT", LAST_SHIFT);
        definitions.add("LARGEST_IMAGE", (1i64 << formats.image_bits()) - 1);
        definitions.unsigned("POSITION_BITS", POSITION_BITS);
        definitions.unsigned("OUTPUT_BITS", OUTPUT_BITS);
        definitions.add("LN_SIGMA_LEAST", format!("({least})"));
        definitions.add("LN_SIGMA_MOST", most);
        definitions.unsigned("LN_SIGMA_BITS", LN_SIGMA_BITS);
        definitions.unsigned("REDUCTIONS", REDUCTIONS);
        definitions.unsigned("REDUCTION_SHIFT", REDUCTION_SHIFT);
        definitions.add("MU_STEPS", MU_STEPS);
        definitions.unsigned("POSITION_SHIFT", POSITION_SHIFT);
    }
    if model.searches() {
        definitions.unsigned("OPERAND_VECTORS", formats.operand_vectors());
        definitions.unsigned("COARSE_CENTRES", COARSE_CENTRES.len());
        definitions.unsigned("HALVINGS", HALVINGS);
        definitions.unsigned("EPSILON_SHIFT", EPSILON_SHIFT);
        definitions.unsigned("LOG_FRACTION", LOG_FRACTION);
        definitions.unsigned("LOG_TABLE_BITS", LOG_TABLE_BITS);
    }
}

fn add_forces(definitions: &mut Definitions, model: &Model) {
    let formats = model.formats();
    let rescale_most = formats.raw_length_max.saturating_sub(formats.full_length());
    definitions.long("MU_STEP", formats.mu_step);
    definitions.unsigned("MU_ROUND", MU_ROUND);
    definitions.unsigned("MU_FRACTION", formats.mu_fraction);
    definitions.unsigned("FORCE_SHIFT", formats.mu_fraction + rescale_most);
    definitions.unsigned("FORCE_HEADROOM", FORCE_BITS - formats.search_bits[0]);
    definitions.unsigned("FORCE_SHIFT_MOST", FORCE_SHIFT_MAX);
    definitions.unsigned("FORCE_BITS", FORCE_BITS);
    definitions.long("THRESHOLD", model.threshold());
}

/// Word and lowest bit of each field of the status, and the words that are constant.
fn add_status(definitions: &mut Definitions, model: &Model) {
    definitions.unsigned("STATUS_WORDS", STATUS_WORDS);
    for field in status_fields().into_iter().filter(|field| field.feature.is_in(&model.scene)) {
        let name = format!("STATUS_{}", field.name.to_uppercase());
        definitions.add(&name, format!("{}U, {}U", status_word(&field), field.low));
    }
    definitions.option("HAS_SCORE_LIMIT", model.score_limit.is_some());
    definitions.add("SCORE_LIMIT", format!("({})", model.score_limit.unwrap_or_default()));
    definitions.option("HAS_PUSH_LIMIT", model.push_limit.is_some());
    definitions.long("PUSH_LIMIT", i64::from(model.push_limit.unwrap_or_default()));
    let cycles = |words: Vec<i32>| CYCLES.get(&model.run_prepared(&Prepared { words, ..model.prepare.empty() }).status);
    definitions.unsigned("CYCLES_SEARCHED", cycles(loaded(model)));
    definitions.unsigned("CYCLES_NOT_SEARCHED", cycles(vec![0; model.scene.sensor.taxels()]));
}

/// Words of the frame buffer that meet any condition.
fn loaded(model: &Model) -> Vec<i32> {
    let most = largest_code(model.formats().code_bits);
    (0..model.scene.sensor.taxels()).map(|taxel| if taxel % 2 == 0 { most } else { -most }).collect()
}

/// The taxel of each lane of each quad.
fn quads_table(quads: Quads) -> String {
    let of = |quad| (0..Quads::LANES).map(move |lane| quads.taxel(quad, lane));
    table("uint16_t", "TAXEL_OF", &(0..quads.len()).flat_map(of).collect::<Vec<_>>())
}

/// Zero, gain, dead taxels, where there are any.
fn input_tables(model: &Model) -> String {
    let of = |kind, name, values: &Option<Vec<i32>>| values.as_ref().map(|values| table(kind, name, values));
    let zero = of("int32_t", "ZERO", &model.prepare.zero);
    let gain = of("int32_t", "GAIN", &model.prepare.gain);
    let dead = Some(&model.dead).filter(|dead| !dead.is_empty()).map(|dead| table("uint16_t", "DEAD", dead));
    [zero, gain, dead].into_iter().flatten().collect()
}
