//! The observed streams between the stages. One declaration per stream: the names of its signals in the Verilog and the
//! reading of the same signals in rust-hdl's simulation both follow from it, all widths from the built engine.

use rust_hdl::prelude::*;

use crate::device::{Tap, TapSignal};
use crate::language::SEPARATOR;
use crate::wire::{Wire, Word};
use crate::{engine, serial};

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

/// A signal whose width and value can be read.
pub(crate) trait Signalled: Atom {
    /// The current value, zero beyond the width.
    fn word(&self) -> Word;
}

impl<D: Direction> Signalled for Wire<D> {
    fn word(&self) -> Word {
        self.val().word()
    }
}

impl Signalled for Signal<Out, Bit> {
    fn word(&self) -> Word {
        self.val().into()
    }
}

/// Names that lead to a signal from the engine: the block's instance, the port; or one of the engine's own signals.
type Path = [&'static str];

/// The name of the signal at `path` in the top module.
fn name(path: &Path) -> String {
    path.join(SEPARATOR)
}

/// A signal of a stream's word.
pub(crate) struct Part<'a> {
    path: &'a Path,
    signed: bool,
    signal: &'a dyn Signalled,
}

/// A stream in the current cycle.
pub(crate) struct Stream<'a> {
    name: &'static str,
    /// Signals that are all 1 in a cycle in which a word passes: path, value.
    valid: &'a [(&'a Path, bool)],
    /// Signals of the word, the first fields first.
    parts: &'a [Part<'a>],
    /// Names of the fields in each of `parts`; none if each is one field of the signal's own name.
    fields: &'a [&'static str],
    /// Width of a field in bits, if not that of the signal's fields.
    field_bits: Option<u32>,
}

impl Stream<'_> {
    /// Names and widths.
    fn tap(&self) -> Tap {
        let signal = |part: &Part| {
            let Part { path, signed, signal } = *part;
            TapSignal { name: name(path), bits: signal.bits() as u32, signed }
        };
        let word: Vec<TapSignal> = self.parts.iter().map(signal).collect();
        let own = self.parts.iter().filter_map(|part| part.path.last().copied());
        let fields: Vec<&str> = if self.fields.is_empty() { own.collect() } else { self.fields.to_vec() };
        Tap {
            name: self.name,
            valid: self.valid.iter().map(|(path, _)| name(path)).collect(),
            field_bits: self.field_bits.unwrap_or(word[0].bits / self.count() as u32),
            fields,
            word,
        }
    }

    /// Fields in each signal of the word.
    fn count(&self) -> usize {
        self.fields.len().max(1)
    }

    /// The fields of the word that passes in this cycle.
    fn sample(&self) -> Option<Vec<i64>> {
        let fields = |part: &Part| {
            let (word, bits, signed) = (part.signal.word(), part.signal.bits() / self.count(), part.signed);
            let field = move |index| match signed {
                true => word.signed(index, bits),
                false => word.field(index * bits, bits) as i64,
            };
            (0..self.count()).map(field)
        };
        self.valid.iter().all(|(_, high)| *high).then(|| self.parts.iter().flat_map(fields).collect())
    }
}

/// A design with observed streams.
pub(crate) trait Observed {
    /// Calls `visit` with each stream in pipeline order; the same streams in every cycle.
    fn streams(&self, visit: &mut dyn FnMut(&Stream));
}

/// The taps of `design`, in pipeline order.
pub(crate) fn taps(design: &dyn Observed) -> Vec<Tap> {
    let mut taps = Vec::new();
    design.streams(&mut |stream| taps.push(stream.tap()));
    taps
}

/// The words that pass in the current cycle, one entry per tap, in the order of [`taps`].
pub(crate) fn words(design: &dyn Observed) -> Vec<Option<Vec<i64>>> {
    let mut words = Vec::new();
    design.streams(&mut |stream| words.push(stream.sample()));
    words
}

/// Declares the streams of an engine, one a line: `name: valid signals => [signals of the word; names of the fields in
/// each]`. `as` gives the fields a width other than that of their signals; `if` names the method that says whether the
/// engine has the stream, and `by` the method that says how many of the fields there are.
macro_rules! streams {
    ($engine:ty {$(
        $name:ident $(if $($chosen:ident).+)?: $($($valid:ident).+)&+
            => [$($sign:ident $($part:ident).+),+ $(; $fields:ident $(by $($counted:ident).+)?)?] $(as $bits:ident)?,
    )+}) => {
        impl Observed for $engine {
            fn streams(&self, visit: &mut dyn FnMut(&Stream)) {
                $($(if self.$($chosen).+())? {
                    visit(&Stream {
                        name: stringify!($name),
                        valid: &[$((&[$(stringify!($valid)),+], self.$($valid).+.val())),+],
                        parts: &[$(Part {
                            path: &[$(stringify!($part)),+],
                            signed: is_signed!($sign),
                            signal: &self.$($part).+,
                        }),+],
                        fields: fields!(self $($fields $($($counted).+)?)?),
                        field_bits: [$($bits)?].first().copied(),
                    });
                })+
            }
        }
    };
}

/// Names of the fields in each signal of a word.
macro_rules! fields {
    ($engine:ident) => {
        &[]
    };
    ($engine:ident $fields:ident) => {
        &$fields
    };
    ($engine:ident $fields:ident $($counted:ident).+) => {
        &$fields[..$engine.$($counted).+()]
    };
}

/// Whether the fields of a signal are two's complement.
macro_rules! is_signed {
    (signed) => {
        true
    };
    (unsigned) => {
        false
    };
}

streams!(engine::Engine {
    receive: receive.accept => [signed receive.taken_word],
    choose if chooses: begin_frame => [unsigned receive.which] as CHOICE_FIELD,
    normalise: fold.normalised_valid => [signed normalise.shifted; TAXELS],
    fold: fold.folded_valid => [signed fold.folded; PARITIES],
    instruction: pass.issued => [unsigned pass.which, unsigned pass.step] as INSTRUCTION_FIELD,
    pass: pass.quad_valid => [signed pass.quad; PARITIES],
    segment if has_contacts: segment.labelled => [signed segment.labelled_quad; TAXELS],
    window if has_contacts: operand_source.of_window => [signed operand_source.quad; PARITIES],
    estimate if has_network: estimate.operands_valid => [signed estimate.operands; PARITIES],
    shear if has_contacts: shear.sheared_valid => [signed shear.sheared; PARITIES],
    rescale: rescale.words_valid => [signed rescale.words; PARITIES],
    relax if has_network: relax.sums_valid => [signed relax.sums; PARITIES],
    unfold: unfold.taxels_valid => [signed unfold.taxels; TAXELS],
    search: search.compared
        => [signed search.best_x, signed search.best_y, signed search.score, unsigned search.taken] as SEARCH_FIELD,
    forces: search.values_valid => [signed search.values; TAXELS by width],
});

streams!(serial::Engine {
    receive: receive.accept => [signed receive.s_axis_tdata],
    normalise: pass_sequencer.normalised_valid => [signed rounder.rounded],
    fold: butterfly.quad_valid & pass_sequencer.folding => [signed butterfly.quad; PARITIES],
    pass: pass.quad_valid => [signed pass.quad; PARITIES],
    rescale: pass_sequencer.rescaled_valid => [signed rounder.rounded],
    unfold: unfold.taxel_valid => [signed unfold.taxel],
    search: search_sequencer.compared
        => [signed search_sequencer.best_x, signed search_sequencer.best_y, signed search_sequencer.score, unsigned search_sequencer.taken] as SEARCH_FIELD,
    forces: search_sequencer.value_valid => [signed coefficient_shift.value],
});

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::Model;
    use dermis_golden::spec::board::EngineKind;
    use dermis_golden::spec::partition::Case;
    use dermis_golden::spec::scene::Scene;

    use super::*;
    use crate::language::Hierarchy;
    use crate::simulate::design;

    fn model(change: impl Fn(&mut Scene)) -> Model {
        let mut scene = Scene::builtin("eight-by-eight").unwrap();
        change(&mut scene);
        Model::new(&scene).unwrap()
    }

    /// The taps of the engine of `model`, after a check that their signals are in the top module, with their widths.
    fn checked(model: &Model) -> Vec<Tap> {
        let engine = design(model).unwrap();
        let (hierarchy, taps) = (Hierarchy::of(&*engine), taps(&*engine));
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
        assert_eq!(words(&*engine).len(), taps.len());
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
        let serial = model(|scene| scene.hardware.board = "icebreaker".into());
        assert_eq!(serial.board.engine, EngineKind::Serial);
        let serial = checked(&serial);
        assert_eq!(names(&serial), STAGES.into_iter().filter(|name| *name != "instruction").collect::<Vec<_>>());
        assert_eq!(serial[2].valid, ["butterfly__quad_valid", "pass_sequencer__folding"]);
        let choosing = checked(&model(|scene| scene.partition.case = Case::Adaptive));
        assert_eq!(names(&choosing)[1], "choose");
        assert_eq!(choosing.len(), 1 + STAGES.len());
    }
}
