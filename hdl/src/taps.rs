//! The observed streams between the stages. One declaration per stream: the names of its signals in the top module, from
//! which its signals in the Verilog and in the kernel simulation both follow; all widths from the built engine.

use dermis_golden::fixed::Model;
use dermis_golden::spec::board::EngineKind;
use dermis_golden::spec::quads::Quads;

use crate::device::{Tap, TapSignal};
use crate::language::{Builder, Hierarchy, Run, Slot};

/// Field width of the tap of `search`, in bits: at least that of each of its signals.
const SEARCH_FIELD: u32 = 32;

/// Field width of the tap of `instruction`, in bits: an index below 2¹⁵, and a sign bit.
const INSTRUCTION_FIELD: u32 = 16;

/// Field width of the tap of `choose`, in bits: the index of a case, and a sign bit.
const CHOICE_FIELD: u32 = 3;

/// Fields of a quad of taxels, by the quadrant of the subarray they lie in.
const TAXELS: [&str; 4] = ["upper_left", "upper_right", "lower_left", "lower_right"];

/// Fields of a quad of parities, along the rows and along the columns.
const PARITIES: [&str; 4] = ["even_even", "even_odd", "odd_even", "odd_odd"];

/// A signal of a stream's word: its name in the top module, whether its fields are two's complement.
#[derive(Clone, Copy, Debug)]
struct Part {
    name: &'static str,
    signed: bool,
}

fn signed(name: &'static str) -> Part {
    Part { name, signed: true }
}

fn unsigned(name: &'static str) -> Part {
    Part { name, signed: false }
}

/// An observed stream.
#[derive(Clone, Debug)]
pub(crate) struct Stream {
    name: &'static str,
    /// Signals that are all 1 in a cycle in which a word passes.
    valid: &'static [&'static str],
    /// Signals of the word, the first fields first.
    parts: Vec<Part>,
    /// Names of the fields in each of `parts`; none if each is one field, called after its signal.
    fields: &'static [&'static str],
    /// Width of a field in bits, if not that of the signal's fields.
    field_bits: Option<u32>,
}

impl Stream {
    fn of(name: &'static str, valid: &'static [&'static str], parts: &[Part]) -> Self {
        Stream { name, valid, parts: parts.to_vec(), fields: &[], field_bits: None }
    }

    fn fields(self, fields: &'static [&'static str]) -> Self {
        Stream { fields, ..self }
    }

    fn field_bits(self, bits: u32) -> Self {
        Stream { field_bits: Some(bits), ..self }
    }

    /// Names of its signals in the top module.
    pub(crate) fn signals(&self) -> impl Iterator<Item = &'static str> + '_ {
        self.valid.iter().copied().chain(self.parts.iter().map(|part| part.name))
    }

    /// Fields in each signal of the word.
    fn count(&self) -> usize {
        self.fields.len().max(1)
    }

    /// Names and widths; `bits` gives the width of a signal.
    fn tap(&self, bits: impl Fn(&str) -> usize) -> Tap {
        let signal =
            |part: &Part| TapSignal { name: part.name.to_owned(), bits: bits(part.name) as u32, signed: part.signed };
        let word: Vec<TapSignal> = self.parts.iter().map(signal).collect();
        let port = |part: &Part| part.name.rsplit("__").next().unwrap_or(part.name);
        let fields = match self.fields {
            [] => self.parts.iter().map(port).collect(),
            fields => fields.to_vec(),
        };
        Tap {
            name: self.name,
            valid: self.valid.iter().map(|&name| name.to_owned()).collect(),
            field_bits: self.field_bits.unwrap_or(word[0].bits / self.count() as u32),
            fields,
            word,
        }
    }
}

/// The streams of the engine of `model`, in pipeline order.
pub(crate) fn streams(model: &Model) -> Vec<Stream> {
    match model.board.engine {
        EngineKind::Parallel => parallel(model),
        EngineKind::Serial => serial(),
    }
}

fn parallel(model: &Model) -> Vec<Stream> {
    let (network, contacts) = (model.formats().has_network(), model.contacts() > 0);
    let width = if model.searches() { model.formats().search_width } else { Quads::LANES };
    let of = Stream::of;
    let all = [
        (true, of("receive", &["receive__accept"], &[signed("receive__taken_word")])),
        (model.chooses(), of("choose", &["begin_frame"], &[unsigned("receive__case_index")]).field_bits(CHOICE_FIELD)),
        (true, of("normalise", &["fold__normalised_valid"], &[signed("normalise__shifted")]).fields(&TAXELS)),
        (true, of("fold", &["fold__folded_valid"], &[signed("fold__folded")]).fields(&PARITIES)),
        (
            true,
            of("instruction", &["pass__issued"], &[unsigned("pass__section"), unsigned("pass__step")])
                .field_bits(INSTRUCTION_FIELD),
        ),
        (true, of("pass", &["pass__quad_valid"], &[signed("pass__quad")]).fields(&PARITIES)),
        (contacts, of("segment", &["segment__labelled"], &[signed("segment__labelled_quad")]).fields(&TAXELS)),
        (contacts, of("window", &["operand_source__of_window"], &[signed("operand_source__quad")]).fields(&PARITIES)),
        (network, of("estimate", &["estimate__operands_valid"], &[signed("estimate__operands")]).fields(&PARITIES)),
        (contacts, of("shear", &["shear__sheared_valid"], &[signed("shear__sheared")]).fields(&PARITIES)),
        (true, of("rescale", &["rescale__words_valid"], &[signed("rescale__words")]).fields(&PARITIES)),
        (network, of("relax", &["relax__sums_valid"], &[signed("relax__sums")]).fields(&PARITIES)),
        (true, of("unfold", &["unfold__taxels_valid"], &[signed("unfold__taxels")]).fields(&TAXELS)),
        (
            model.searches(),
            of(
                "search",
                &["search__compared"],
                &[
                    signed("search__best_x"),
                    signed("search__best_y"),
                    signed("search__score"),
                    unsigned("search__taken"),
                ],
            )
            .field_bits(SEARCH_FIELD),
        ),
        (true, of("forces", &["values_valid"], &[signed("values")]).fields(&TAXELS[..width])),
    ];
    all.into_iter().filter(|(present, _)| *present).map(|(_, stream)| stream).collect()
}

fn serial() -> Vec<Stream> {
    let of = Stream::of;
    vec![
        of("receive", &["receive__accept"], &[signed("receive__s_axis_tdata")]),
        of("normalise", &["pass_sequencer__normalised_valid"], &[signed("rounder__rounded")]),
        of("fold", &["butterfly__quad_valid", "pass_sequencer__folding"], &[signed("butterfly__quad")])
            .fields(&PARITIES),
        of("pass", &["pass__quad_valid"], &[signed("pass__quad")]).fields(&PARITIES),
        of("rescale", &["pass_sequencer__rescaled_valid"], &[signed("rounder__rounded")]),
        of("unfold", &["unfold__taxel_valid"], &[signed("unfold__taxel")]),
        of(
            "search",
            &["search_sequencer__compared"],
            &[
                signed("search_sequencer__best_x"),
                signed("search_sequencer__best_y"),
                signed("search_sequencer__score"),
                unsigned("search_sequencer__taken"),
            ],
        )
        .field_bits(SEARCH_FIELD),
        of("forces", &["search_sequencer__value_valid"], &[signed("coefficient_shift__value")]),
    ]
}

/// The test bench reads the signals of these streams in the engine of `model`, and perhaps nothing else does.
pub(crate) fn observe(k: &Builder, model: &Model) {
    let streams = streams(model);
    k.unused(streams.iter().flat_map(|stream| stream.signals()).map(|name| k.named(name)));
}

/// The taps of the engine of `model`, in pipeline order; `hierarchy` is its blocks.
pub(crate) fn taps(model: &Model, hierarchy: &Hierarchy) -> Vec<Tap> {
    let top = hierarchy.top();
    let bits = |name: &str| top.and_then(|top| top.width_of(name)).unwrap_or(1);
    streams(model).iter().map(|stream| stream.tap(bits)).collect()
}

/// A stream of a running engine.
pub(crate) struct Tapped {
    valid: Vec<Slot>,
    parts: Vec<(Slot, bool)>,
    count: usize,
}

impl Tapped {
    /// `stream` in `run`, which observes its signals.
    pub(crate) fn new(stream: &Stream, run: &Run) -> Self {
        Tapped {
            valid: stream.valid.iter().map(|name| run.slot("", name)).collect(),
            parts: stream.parts.iter().map(|part| (run.slot("", part.name), part.signed)).collect(),
            count: stream.count(),
        }
    }

    /// The fields of the word that passes in this cycle.
    pub(crate) fn word(&self, run: &Run) -> Option<Vec<i64>> {
        let fields = |&(slot, signed): &(Slot, bool)| {
            let (word, bits) = (run.get(slot), slot.bits() / self.count);
            let field = move |index| match signed {
                true => word.signed(index, bits),
                false => word.field(index * bits, bits) as i64,
            };
            (0..self.count).map(field)
        };
        self.valid.iter().all(|&slot| run.is_high(slot)).then(|| self.parts.iter().flat_map(fields).collect())
    }
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::Model;
    use dermis_golden::spec::board::EngineKind;
    use dermis_golden::spec::partition::Case;
    use dermis_golden::spec::scene::Scene;

    use super::*;
    use crate::simulate::design;

    fn model(change: impl Fn(&mut Scene)) -> Model {
        let mut scene = Scene::builtin("eight-by-eight").unwrap();
        change(&mut scene);
        Model::new(&scene).unwrap()
    }

    /// The taps of the engine of `model`, after a check that their signals are in the top module, with their widths.
    fn checked(model: &Model) -> Vec<Tap> {
        let hierarchy = design(model).unwrap();
        let taps = taps(model, &hierarchy);
        let (_, top) = hierarchy.kernels().find(|(path, _)| path.is_empty()).unwrap();
        let bits = |name: &str| top.signal_of(name).map(|id| top.signals[id].ty.bits as u32);
        for tap in &taps {
            let each = (tap.fields.len() / tap.word.len()) as u32;
            assert!(tap.valid.iter().all(|name| bits(name) == Some(1)), "{tap:?}");
            for signal in &tap.word {
                assert_eq!(bits(&signal.name), Some(signal.bits), "{}", signal.name);
                // Fields are two's complement: an unsigned signal needs a bit for the sign.
                let needed = signal.bits + u32::from(!signal.signed);
                assert!(needed == each * tap.field_bits || each == 1 && needed < tap.field_bits, "{tap:?}");
            }
        }
        taps
    }

    fn names(taps: &[Tap]) -> Vec<&'static str> {
        taps.iter().map(|tap| tap.name).collect()
    }

    #[test]
    fn signals_are_in_the_top_module() {
        const STAGES: [&str; 9] =
            ["receive", "normalise", "fold", "instruction", "pass", "rescale", "unfold", "search", "forces"];
        let parallel = checked(&model(|_| {}));
        assert_eq!(names(&parallel), STAGES);
        assert_eq!(parallel[0].valid, ["receive__accept"]);
        assert_eq!((&parallel[0].fields[..], &parallel[2].fields[..]), (&["taken_word"][..], &PARITIES[..]));
        assert_eq!(parallel[3].word[1].name, "pass__step");
        assert_eq!(parallel[7].fields, ["best_x", "best_y", "score", "taken"]);
        let serial = model(|scene| scene.hardware.board = Some("icebreaker".into()));
        assert_eq!(serial.board.engine, EngineKind::Serial);
        let serial = checked(&serial);
        assert_eq!(names(&serial), STAGES.into_iter().filter(|name| *name != "instruction").collect::<Vec<_>>());
        assert_eq!(serial[2].valid, ["butterfly__quad_valid", "pass_sequencer__folding"]);
        let choosing = checked(&model(|scene| scene.partition.case = Case::Adaptive));
        assert_eq!(names(&choosing)[1], "choose");
        assert_eq!(choosing.len(), 1 + STAGES.len());
    }
}
