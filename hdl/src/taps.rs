//! The observed streams between the stages: names, Verilog expressions and word formats.

use dermis_golden::board::EngineKind;
use dermis_golden::fixed::words::formats::FORCE_BITS;
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
    let block = if serial { "search_sequencer" } else { "search" };
    let f = model.formats();
    let tap = |name, valid: &str, data: &str, fields, field_bits| Tap {
        name,
        valid: format!("{{}}{valid}"),
        data: format!("{{}}{data}"),
        fields,
        field_bits,
    };
    let extended = |signal: &str, bits: u32| {
        format!("{{{}{{{{}}{block}__{signal}[{}]}}}}, {{}}{block}__{signal}", SEARCH_FIELD - bits, bits - 1)
    };
    let position = position_bits() as u32;
    let search = format!(
        "{{{}'d0, {{}}{block}__taken, {{{score}}}, {{{y}}}, {{{x}}}}}",
        SEARCH_FIELD - 1,
        score = extended("score", f.score_bits),
        y = extended("best_y", position),
        x = extended("best_x", position),
    );
    let search = Tap {
        name: "search",
        valid: format!("{{}}{block}__compared"),
        data: search,
        fields: 4,
        field_bits: SEARCH_FIELD,
    };
    if serial {
        let mixed = f.input_bits.max(f.vector_bits) + 2;
        return vec![
            tap("receive", "receive__accept", "receive__s_axis_tdata", 1, f.input_bits),
            tap("normalise", "pass_sequencer__normalised_valid", "rounder__rounded", 1, FORCE_BITS),
            Tap {
                valid: "({}butterfly__quad_valid && {}pass_sequencer__folding)".into(),
                ..tap("fold", "", "butterfly__quad", 4, mixed)
            },
            tap("pass", "pass__quad_valid", "pass__quad", 4, f.acc_bits),
            tap("rescale", "pass_sequencer__rescaled_valid", "rounder__rounded", 1, FORCE_BITS),
            tap("unfold", "unfold__taxel_valid", "unfold__taxel", 1, f.vector_bits + 2),
            search,
            tap("force", "search_sequencer__value_valid", "coefficient_shift__value", 1, f.search_bits[0]),
        ];
    }
    let mut all = vec![
        tap("receive", "receive__accept", "receive__taken_word", 1, f.input_bits),
        tap("normalise", "fold__normalised_valid", "normalise__shifted", 4, f.input_bits),
        tap("fold", "fold__folded_valid", "fold__folded", 4, f.fold_bits),
        tap("pass", "pass__quad_valid", "pass__quad", 4, f.acc_bits),
        tap("rescale", "rescale__words_valid", "rescale__words", 4, f.vector_bits),
        tap("unfold", "unfold__taxels_valid", "unfold__taxels", 4, f.vector_bits + 2),
        search,
        tap("force", "search__values_valid", "search__values", 4, f.search_bits[0]),
    ];
    if model.chooses() {
        let zeros = CHOICE_FIELD - count_bits(model.cases().len()) as u32;
        let data = format!("{{{zeros}'d0, {{}}receive__which}}");
        all.insert(1, Tap { name: "choose", valid: "{}begin_frame".into(), data, fields: 1, field_bits: CHOICE_FIELD });
    }
    all
}
