//! Several arrays on one engine: which array a frame is of, and a state for each array.

use dermis_golden::fixed::plan::resources::array_words;
use dermis_golden::fixed::Plan;

use crate::block;
use crate::language::{Block, Builder, Expr, Inside, Net, Type};
use crate::primitives::address::counter::count_bits;

/// The arrays whose frames a block takes in turn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Arrays {
    /// Width of the number of an array: 0 where there is one.
    pub bits: usize,
}

impl Arrays {
    /// Those of `model`.
    pub fn of_model(model: &Plan) -> Self {
        Arrays { bits: model.scene.hardware.array_bits() }
    }

    /// How many there are.
    pub fn count(self) -> usize {
        1 << self.bits
    }

    /// Words of a memory with one for each of `taxels` taxels of each array.
    pub fn words(self, taxels: usize) -> usize {
        array_words(self.count(), taxels)
    }

    /// Address in that memory of taxel `taxel` of array `array`.
    pub(super) fn address<'k>(self, k: &'k Builder, array: Expr<'k>, taxel: Expr<'k>) -> Expr<'k> {
        match self.bits {
            0 => taxel,
            _ => k.wire("place", array.concat(taxel)),
        }
    }

    /// The array of an address.
    pub(super) fn array_of<'k>(self, address: Expr<'k>) -> Expr<'k> {
        match self.bits {
            0 => address,
            bits => address.slice(address.bits() - bits, bits),
        }
    }

    /// A state named `name` for each array, `value` after a reset.
    pub(crate) fn state<'k>(
        self,
        k: &'k Builder,
        name: &str,
        ty: Type,
        resets: Resets<'k>,
        value: u64,
    ) -> PerArray<'k> {
        let named = |array| if self.bits == 0 { name.to_owned() } else { format!("{name}_of_{array}") };
        PerArray {
            states: (0..self.count()).map(|array| k.state(&named(array), ty, resets.of(array), value)).collect(),
        }
    }

    /// What resets them: `rst`, and where tables are `written` the bits of `anew`.
    pub(super) fn resets<'k>(self, rst: Expr<'k>, anew: Expr<'k>, written: bool) -> Resets<'k> {
        Resets { rst, anew: (self.anew_bits(written) > 0).then_some(anew) }
    }

    /// Width of the port by which single arrays begin anew: a bit for each of several arrays whose tables are `written`.
    pub(super) fn anew_bits(self, written: bool) -> usize {
        if self.bits > 0 && written {
            self.count()
        } else {
            0
        }
    }
}

/// What resets the states of the arrays.
#[derive(Clone, Copy)]
pub(crate) struct Resets<'k> {
    /// All of them.
    pub rst: Expr<'k>,
    /// A bit for each array that begins anew, where single arrays do.
    pub anew: Option<Expr<'k>>,
}

impl<'k> Resets<'k> {
    /// What resets array `array`.
    fn of(self, array: usize) -> Expr<'k> {
        self.anew.map_or(self.rst, |anew| self.rst | anew.at(array))
    }
}

/// A state for each array.
pub(crate) struct PerArray<'k> {
    states: Vec<Net<'k>>,
}

impl<'k> PerArray<'k> {
    /// That of array number `array`.
    pub(crate) fn number(&self, array: usize) -> Expr<'k> {
        *self.states[array]
    }

    /// That of array `array`.
    pub(crate) fn of(&self, array: Expr<'k>) -> Expr<'k> {
        let mut states: Vec<Expr<'k>> = self.states.iter().map(|state| **state).collect();
        let mut bit = 0;
        while states.len() > 1 {
            states = states.chunks(2).map(|pair| array.at(bit).mux(pair[1], pair[0])).collect();
            bit += 1;
        }
        states[0]
    }

    /// Array `array` gets `value`, where the surrounding conditions hold.
    pub(crate) fn set(&self, k: &'k Builder, array: Expr<'k>, value: Expr<'k>) {
        match self.states.as_slice() {
            [only] => only.set(value),
            states => states.iter().enumerate().for_each(|(number, state)| {
                k.when(array.is(number as u64), || state.set(value));
            }),
        }
    }
}

block! {
    /// The array of a frame is that of its first beat, whatever comes with the others. A frame begins after a `tlast` or the last
    /// taxel, as in `receive`.
    pub struct FrameArray {
        arrays: Arrays,
        /// Taxels of a frame.
        taxels: usize,
    }
    ports FrameArrayPorts {
        clock;
        reset;
        /// Array of the beat that is offered.
        in s_axis_tid: arrays.bits;
        /// The beat is accepted in this cycle.
        in taken;
        /// It is the last of its frame, as the sender says; valid with `taken`.
        in tlast;
        /// Array of its frame; valid as `s_axis_tid` is.
        out array: arrays.bits;
    }
}

impl FrameArray {
    /// For frames of `taxels` taxels; `None` where there is one array.
    pub fn new(arrays: Arrays, taxels: usize) -> Option<Self> {
        (arrays.bits > 0).then_some(FrameArray { arrays, taxels })
    }
}

impl Block for FrameArray {
    fn build<'k>(&self, k: &'k Builder, io: FrameArrayPorts<Inside<'k>>) {
        let taxel = k.state("taxel", Type::unsigned(count_bits(self.taxels)), io.rst, 0);
        let first = k.register("first", Type::unsigned(self.arrays.bits)).comment("Array of the first beat.");
        let begins = k.wire("begins", taxel.is(0));
        io.array.set(begins.mux(io.s_axis_tid, *first));
        k.when(io.taken, || {
            let ends = io.tlast | taxel.is(self.taxels as u64 - 1);
            taxel.set(ends.mux(k.constant(taxel.bits(), 0), taxel.plus(1)));
            k.when(begins, || first.set(io.s_axis_tid));
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check_with_defects, random_word, subject_of, Reference, Subject};
    use crate::language::Change;
    use crate::wire::Word;

    const ARRAYS: Arrays = Arrays { bits: 2 };
    const TAXELS: usize = 5;

    /// Taxels since the frame began, and its array once it has.
    #[derive(Default)]
    struct Frames {
        taxel: usize,
        array: u64,
        reset: bool,
    }

    impl Reference for Frames {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let array = if self.taxel == 0 { inputs[1].number() } else { self.array };
            vec![self.reset.then(|| array.into())]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [id, taken, last] = [1, 2, 3].map(|k| inputs[k].number());
            if inputs[0].number() == 1 {
                (self.taxel, self.reset) = (0, true);
            } else if taken == 1 {
                self.array = if self.taxel == 0 { id } else { self.array };
                self.taxel = if last == 1 || self.taxel + 1 == TAXELS { 0 } else { self.taxel + 1 };
            }
        }
    }

    fn subject(changes: &[Change]) -> Subject<'static> {
        subject_of!(FrameArray::new(ARRAYS, TAXELS).unwrap(), changes, inputs [rst, s_axis_tid, taken, tlast], outputs [array])
    }

    #[test]
    fn the_array_of_a_frame_is_that_of_its_first_beat() {
        let mut random = fastrand::Rng::with_seed(3);
        let stimulus: Vec<Vec<Word>> = (0..4000)
            .map(|cycle| {
                let rst = cycle < 2 || random.u16(..300) == 0;
                let id = random_word(&mut random, ARRAYS.bits);
                vec![rst.into(), id, (random.u8(..4) > 0).into(), (random.u8(..9) == 0).into()]
            })
            .collect();
        // It begins with every beat; never again after an early `tlast`.
        let defects = [
            Change::value("", "begins", |k| k.constant(1, 1)),
            Change::value("", "begins", |k| k.named("taxel").is(1)),
        ];
        check_with_defects(subject, &stimulus, Frames::default, &defects);
    }
}
