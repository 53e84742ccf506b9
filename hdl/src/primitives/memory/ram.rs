//! Simple dual-port memory: one write port with an enable per field, one read port with one or two registers.

use dermis_golden::fixed::plan::resources::Holds;

use crate::block;
use crate::language::{concat, Block, Builder, Contents, Expr, Inside, Type};
use crate::primitives::address::counter::count_bits;

block! {
    /// ```text
    /// write (one bit per field), write_address, write_data --> memory --> read_data one or two cycles after read_address
    /// ```
    /// The read registers change only while `read` is high. The content is undefined until written, and so is what is read
    /// in the cycle that writes the word: then block RAM needs no logic that defines it. In simulation such a read returns
    /// the complement of the old content, so that using it would show as an error.
    #[derive(Clone, Debug)]
    pub struct Ram {
        depth: usize,
        fields: usize,
        /// Width of a field.
        bits: usize,
        /// There is an output register behind the read register of the memory.
        behind: bool,
        /// What the memory of each field holds, as far as the plan of the memories says it.
        holds: Vec<Holds>,
    }
    ports RamPorts {
        clock;
        /// Write enable, one bit per field; taken in every cycle.
        in write: fields;
        /// Address of the word to write; valid with `write`.
        in write_address: count_bits(*depth);
        /// Fields to write; valid with `write`.
        in write_data: fields * bits;
        /// Enable of the read registers.
        in read;
        /// Address of the word to read; taken while `read` is high.
        in read_address: count_bits(*depth);
        /// The word read; one cycle after `read_address`, or two if [`registered`](Ram::registered).
        out read_data: fields * bits;
    }
}

impl Ram {
    /// A memory of `depth` words of `fields` fields of `bits` bits.
    pub fn new(depth: usize, fields: usize, bits: usize) -> Self {
        Ram { depth, fields, bits, behind: false, holds: Vec::new() }
    }

    /// Adds an output register: `read_data` follows two cycles after `read_address`. The clock-to-output time of a
    /// block RAM leaves no room for logic behind it.
    pub fn registered(self) -> Self {
        Ram { behind: true, ..self }
    }

    /// With what the memory of each field holds.
    pub fn holding(self, holds: impl IntoIterator<Item = Holds>) -> Self {
        Ram { holds: holds.into_iter().collect(), ..self }
    }
}

impl Block for Ram {
    fn build<'k>(&self, k: &'k Builder, io: RamPorts<Inside<'k>>) {
        // One array per field: every synthesiser maps it to plain memories.
        let field = |number: usize| {
            let memory = k.memory(&format!("field{number}"), self.depth, self.bits, Contents::Undefined).unchecked();
            let memory = self.holds.get(number).map_or(memory, |holds| memory.holds(holds));
            let word = io.write_data.slice(number * self.bits, self.bits);
            memory.write(io.write.at(number), io.write_address, word);
            let held = k.register(&format!("read{number}"), Type::unsigned(self.bits));
            k.when(io.read, || held.set(memory.read(io.read_address)));
            if !self.behind {
                return *held;
            }
            let behind = k.register(&format!("behind{number}"), Type::unsigned(self.bits));
            k.when(io.read, || behind.set(*held));
            *behind
        };
        let fields: Vec<Expr> = (0..self.fields).map(field).collect();
        io.read_data.set(concat(&fields.into_iter().rev().collect::<Vec<_>>()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_words, MemoryReference, Reference, Subject};
    use crate::wire::Word;

    const RAM: Ram = Ram { depth: 11, fields: 3, bits: 30, behind: false, holds: Vec::new() };

    /// Each field is a memory of its own.
    struct Fields([MemoryReference<u64>; 3]);

    impl Reference for Fields {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let mut word = Some(Word::default());
            for (index, field) in self.0.iter().enumerate() {
                word = word.zip(field.shown()).map(|(mut word, field)| {
                    word.set(index * RAM.bits, RAM.bits, field);
                    word
                });
            }
            vec![word]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [to, from] = [1, 4].map(|address| inputs[address].number() as usize);
            for (index, field) in self.0.iter_mut().enumerate() {
                let word = (to, inputs[2].field(index * RAM.bits, RAM.bits));
                let read = (inputs[3].number() == 1).then_some(from);
                field.clock(read, (inputs[0].field(index, 1) == 1).then_some(word));
            }
        }
    }

    #[test]
    fn fields_are_written_alone() {
        let mut stimulus = random_words(4000, &[3, 4, 90, 1, 4]);
        for inputs in &mut stimulus {
            [1, 4].iter().for_each(|&address| inputs[address] = Word::from(inputs[address].number() % 11));
        }
        for behind in [false, true] {
            let mut fields = Fields([0, 1, 2].map(|_| MemoryReference::new(RAM.depth, 1 + usize::from(behind))));
            let block = Ram { behind, ..RAM };
            check(&kernel_of(&block), &stimulus, &mut fields);
        }
    }

    #[test]
    fn what_is_read_where_and_when_it_is_written_is_the_complement() {
        let kernel = kernel_of(&Ram::new(4, 1, 8));
        let mut ram = Subject::from(&kernel);
        // A clock edge with this word written to `to`, read from `from` if `read`: the word read in the cycle before.
        let mut edge = |word: u64, to: u64, from: u64, read: bool| {
            ram.cycle(&[1, to, word, read.into(), from].map(Word::from))[0].number()
        };
        edge(0x12, 1, 0, true);
        edge(0x34, 1, 1, true);
        assert_eq!(edge(0x56, 2, 1, true), 0xed);
        assert_eq!(edge(0x78, 1, 1, false), 0x34);
        assert_eq!(edge(0x9a, 2, 1, true), 0x34);
        assert_eq!(edge(0, 0, 0, true), 0x78);
    }
}
