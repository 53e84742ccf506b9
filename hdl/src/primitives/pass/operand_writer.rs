//! Write address of finished vectors in the operand memory.

use crate::block;
use crate::language::{Block, Builder, Expr, Inside, Type};
use crate::primitives::address::case_counter::{expression_by_case, value_by_case};
use crate::primitives::address::counter::count_bits;

block! {
    /// Counts the quads of the v_ij as they arrive: the write address of the current quad, whether it is an operand of
    /// a later pass and has to be written, and how many vectors can be read: those that are complete, or, `streamed`,
    /// begun.
    pub struct OperandWriter {
        lengths: Vec<Vec<usize>>,
        streamed: bool,
    }
    ports OperandWriterPorts {
        clock;
        /// Index of the section; constant from the cycle after `clear` until the next.
        in section: count_bits(lengths.len());
        /// Restarts the counts for the next subarray, with priority over `valid`.
        in clear;
        /// A quad of a v_ij arrives in this cycle.
        in valid;
        /// Write address of the quad; valid with `keep`.
        out address: count_bits(words(lengths));
        /// Write enable: the quad is an operand of a later pass. Combinational from `valid`.
        out keep;
        /// Number of operand vectors of this subarray that can be read; includes a vector from the cycle after the
        /// `valid` that makes it readable.
        out finished: count_bits(most_vectors(lengths) + 1);
    }
}

impl OperandWriter {
    /// `lengths[section]` are the quads of each vector. `streamed`, only with vectors of two quads or more: a vector is
    /// read from its first quad on, one quad per cycle, while one quad per cycle is written.
    pub fn new(lengths: &[Vec<usize>], streamed: bool) -> Self {
        OperandWriter { lengths: lengths.to_vec(), streamed }
    }
}

/// Number of words of the operand memory.
fn words(lengths: &[Vec<usize>]) -> usize {
    lengths.iter().map(|case| case.iter().sum()).max().unwrap_or(0)
}

/// Number of vectors of the case that has most.
fn most_vectors(lengths: &[Vec<usize>]) -> usize {
    lengths.iter().map(Vec::len).max().unwrap_or(0)
}

impl Block for OperandWriter {
    fn build<'k>(&self, k: &'k Builder, io: OperandWriterPorts<Inside<'k>>) {
        let OperandWriter { lengths, streamed } = self;
        let (vectors, most) = (most_vectors(lengths), words(lengths));
        let longest = lengths.iter().flatten().copied().max().unwrap_or(1);
        let quad = k.state("quad", Type::unsigned(count_bits(longest)), io.clear, 0);
        let address = io.address.state(io.clear, 0);
        let finished = io.finished.state(io.clear, 0);
        let is_uniform = |lengths: &Vec<usize>| lengths.iter().all(|length| *length == lengths[0]);
        let last = if lengths.iter().all(|lengths| lengths.len() == vectors && is_uniform(lengths)) {
            let ends: Vec<usize> = lengths.iter().map(|lengths| lengths[0] - 1).collect();
            value_by_case(k, io.section, &ends, quad.bits())
        } else {
            let last_quads = |lengths: &Vec<usize>| {
                let lasts: Vec<u64> = lengths.iter().map(|length| *length as u64 - 1).collect();
                finished.table(quad.bits(), &padded(lasts, finished.bits()))
            };
            let of_cases: Vec<Expr> = lengths.iter().map(last_quads).collect();
            expression_by_case(io.section, &of_cases).unwrap_or(k.constant(quad.bits(), 0))
        };
        let last_quad = k.wire("last_quad", quad.equals(last));
        let counts: Vec<usize> = lengths.iter().map(Vec::len).collect();
        let all = finished.equals(value_by_case(k, io.section, &counts, finished.bits()));
        let full = match streamed {
            true => {
                let full = k.state("full", Type::unsigned(1), io.clear, 0);
                k.when(io.valid & last_quad & all, || full.set(k.constant(1, 1)));
                *full
            }
            false => all,
        };
        let keep = io.keep.set(io.valid & !full);
        k.when(keep, || {
            quad.set(last_quad.mux(k.constant(quad.bits(), 0), quad.plus(1)));
            k.when(!address.is(most as u64 - 1), || address.set(address.plus(1)));
            let readable = if *streamed { quad.is(0) } else { last_quad };
            k.when(readable, || finished.set(finished.plus(1)));
        });
    }
}

/// A table with zeros up to all that an index of `bits` bits reaches.
fn padded(mut table: Vec<u64>, bits: usize) -> Vec<u64> {
    table.resize(1 << bits, 0);
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    /// The number of quads written; undefined before the first `clear`.
    struct Count<'a> {
        lengths: &'a [Vec<usize>],
        quads: Option<usize>,
        streamed: bool,
    }

    impl Count<'_> {
        /// Vectors that can be read once `seen` quads have been written.
        fn finished(&self, lengths: &[usize], seen: usize) -> usize {
            let mut first = 0;
            let readable = lengths.iter().filter(|length| {
                let needed = if self.streamed { first + 1 } else { first + **length };
                first += **length;
                seen >= needed
            });
            readable.count()
        }
    }

    impl Reference for Count<'_> {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let lengths = &self.lengths[inputs[0].number() as usize];
            let keep = self.quads.map(|seen| inputs[2].number() == 1 && seen < lengths.iter().sum());
            vec![
                self.quads.filter(|_| keep == Some(true)).map(|seen| Word::from(seen as u64)),
                self.quads.map(|seen| Word::from(self.finished(lengths, seen) as u64)),
                keep.map(Word::from),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let keeps = self.outputs(inputs)[2].map(|keep| keep.number() as usize);
            self.quads = match inputs[1].number() {
                0 => self.quads.zip(keeps).map(|(seen, keep)| seen + keep),
                _ => Some(0),
            };
        }
    }

    #[test]
    fn quads_are_counted_to_the_last_vector_of_each_case() {
        let cases: [(&[Vec<usize>], &[bool]); 3] = [
            (&[vec![5; 3], vec![3; 3]], &[false, true]),
            (&[vec![5, 12, 8, 1, 5]], &[false]),
            (&[vec![], vec![4, 4, 9, 1], vec![6, 6]], &[false]),
        ];
        for (lengths, streamed) in cases {
            let mut random = fastrand::Rng::with_seed(2);
            let mut case = 0;
            let stimulus = (0..3000).map(|cycle| {
                let clear = cycle == 0 || random.u8(..60) == 0;
                let inputs = vec![Word::from(case), clear.into(), (random.u8(..3) > 0).into()];
                // The case changes after `clear` only.
                case = if clear { random.u64(..lengths.len() as u64) } else { case };
                inputs
            });
            let stimulus: Vec<_> = stimulus.collect();
            for &streamed in streamed {
                let block = OperandWriter::new(lengths, streamed);
                check(&kernel_of(&block), &stimulus, &mut Count { lengths, quads: None, streamed });
            }
        }
    }
}
