//! Register slice of a stream.

use crate::block;
use crate::language::{Block, Builder, Inside};
use crate::primitives::stream::beats::Stream;

block! {
    /// ```text
    /// s_axis --> register --> m_axis
    /// ```
    /// Data and handshake pass through registers in both directions, which lets sender and receiver be placed far apart, at
    /// the cost of one beat every two cycles.
    pub struct RegisterSlice {
        /// Width of a beat in bits.
        bits: usize,
    }
    ports RegisterSlicePorts {
        clock;
        reset;
        /// Data of the beat; valid with `s_axis_tvalid`.
        sink<Stream> s_axis: bits;
        /// Data of the beat; valid with `m_axis_tvalid`.
        source<Stream> m_axis: bits;
    }
}

impl RegisterSlice {
    /// For beats of `bits` bits.
    pub fn new(bits: usize) -> Self {
        RegisterSlice { bits }
    }
}

impl Block for RegisterSlice {
    fn build<'k>(&self, k: &'k Builder, io: RegisterSlicePorts<Inside<'k>>) {
        let tdata = io.m_axis.data.register();
        let valid = io.m_axis.valid.state(io.rst, 0);
        let tlast = io.m_axis.last.register();
        io.s_axis.ready.set(!*valid);
        k.when(!*valid, || {
            tdata.set(io.s_axis.data);
            tlast.set(io.s_axis.last);
        });
        valid.set(valid.mux(!io.m_axis.ready, io.s_axis.valid));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_words, Reference};
    use crate::wire::Word;

    /// The beat in the register; undefined before the first reset.
    struct Slice(Option<Option<(Word, Word)>>);

    impl Reference for Slice {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let (beat, bit) = (self.0.flatten(), |bit: bool| self.0.map(|_| Word::from(bit)));
            // In the order of the kernel's signals.
            vec![beat.map(|beat| beat.0), bit(beat.is_some()), beat.map(|beat| beat.1), bit(beat.is_none())]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, valid, ready] = [0, 2, 4].map(|k| inputs[k].number() == 1);
            self.0 = match self.0 {
                _ if rst => Some(None),
                Some(Some(_)) if ready => Some(None),
                Some(None) => Some(valid.then_some((inputs[1], inputs[3]))),
                same => same,
            };
        }
    }

    #[test]
    fn beats_pass_one_at_a_time() {
        let mut stimulus = random_words(4000, &[1, 33, 1, 1, 1]);
        stimulus.iter_mut().enumerate().for_each(|(cycle, inputs)| inputs[0] = (cycle % 101 == 0).into());
        check(&kernel_of(&RegisterSlice::new(33)), &stimulus, &mut Slice(None));
    }
}
