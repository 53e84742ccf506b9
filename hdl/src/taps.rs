//! The observed streams between the stages: names, Verilog expressions and word formats.

use dermis_golden::board::EngineKind;
use dermis_golden::fixed::formats::FORCE_BITS;
use dermis_golden::fixed::Model;

use crate::device::Tap;
use crate::primitives::{count_bits, position_bits};

/// Field width of the search's tap, in bits: its fields have different widths in hardware and are sign-extended to
/// this.
pub const SEARCH_FIELD: u32 = 32;

/// Field width of the tap of `choose`, in bits: the index of a case, and a sign bit.
const CHOICE_FIELD: u32 = 3;

/// The taps of the engine of `model`, in pipeline order.
pub fn taps(model: &Model) -> Vec<Tap> {
    let serial = model.board.engine == EngineKind::Serial;
    let block = if serial { "walk" } else { "search" };
    let f = &model.formats;
    let tap = |name, valid: &str, data: &str, fields, field_bits| Tap {
        name,
        valid: format!("{{}}{valid}"),
        data: format!("{{}}{data}"),
        fields,
        field_bits,
    };
    let extended = |signal: &str, bits: u32| {
        format!("{{{}{{{{}}{block}${signal}[{}]}}}}, {{}}{block}${signal}", SEARCH_FIELD - bits, bits - 1)
    };
    let position = position_bits() as u32;
    let search = format!(
        "{{{}'d0, {{}}{block}$taken, {{{score}}}, {{{y}}}, {{{x}}}}}",
        SEARCH_FIELD - 1,
        score = extended("score", f.score_bits),
        y = extended("best_y", position),
        x = extended("best_x", position),
    );
    let search =
        Tap { name: "search", valid: format!("{{}}{block}$judged"), data: search, fields: 4, field_bits: SEARCH_FIELD };
    if serial {
        let mixed = f.input_bits.max(f.vector_bits) + 2;
        return vec![
            tap("receive", "receive$accept", "receive$s_axis_tdata", 1, f.input_bits),
            tap("normalise", "leader$normalised_valid", "rounder$rounded", 1, FORCE_BITS),
            Tap { valid: "({}mixer$quad_valid && {}leader$folding)".into(), ..tap("fold", "", "mixer$quad", 4, mixed) },
            tap("pass", "pass$quad_valid", "pass$quad", 4, f.acc_bits),
            tap("rescale", "leader$rescaled_valid", "rounder$rounded", 1, FORCE_BITS),
            tap("unfold", "unfold$taxel_valid", "unfold$taxel", 1, f.vector_bits + 2),
            search,
            tap("force", "walk$value_valid", "halve$value", 1, f.search_bits[0]),
        ];
    }
    let mut all = vec![
        tap("receive", "receive$accept", "receive$taken_word", 1, f.input_bits),
        tap("normalise", "fold$normalised_valid", "normalise$shifted", 4, f.input_bits),
        tap("fold", "fold$folded_valid", "fold$folded", 4, f.fold_bits),
        tap("pass", "pass$quad_valid", "pass$quad", 4, f.acc_bits),
        tap("rescale", "rescale$words_valid", "rescale$words", 4, f.vector_bits),
        tap("unfold", "unfold$taxels_valid", "unfold$taxels", 4, f.vector_bits + 2),
        search,
        tap("force", "search$values_valid", "search$values", 4, f.search_bits[0]),
    ];
    if model.chooses() {
        let zeros = CHOICE_FIELD - count_bits(model.cases().len()) as u32;
        let data = format!("{{{zeros}'d0, {{}}receive$which}}");
        all.insert(1, Tap { name: "choose", valid: "{}begin_frame".into(), data, fields: 1, field_bits: CHOICE_FIELD });
    }
    all
}
