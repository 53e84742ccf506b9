//! Simple dual-port memory: one write port with an enable per field, one read port with one or two registers.

use dermis_golden::fixed::plan::resources::Holds;
use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{concat, Body, Builder, Contents, Expr, Kernel, Type};
use crate::primitives::address::counter::count_bits;
use crate::wire::Wire;

/// ```text
/// write (one bit per field), write_address, write_data --> memory --> read_data one or two cycles after read_address
/// ```
/// The read registers change only while `read` is high. The content is undefined until written, and so is what is read
/// in the cycle that writes the word: then block RAM needs no logic that defines it. In simulation such a read returns
/// the complement of the old content, so that using it would show as an error.
#[derive(dermis_hdl_derive::Block)]
pub struct Ram {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Write enable, one bit per field; taken in every cycle.
    pub write: Wire<In>,
    /// Address of the word to write; valid with `write`.
    pub write_address: Wire<In>,
    /// Fields to write; valid with `write`.
    pub write_data: Wire<In>,
    /// Enable of the read registers.
    pub read: Signal<In, Bit>,
    /// Address of the word to read; taken while `read` is high.
    pub read_address: Wire<In>,
    /// The word read; one cycle after `read_address`, or two if [`registered`](Ram::registered).
    pub read_data: Wire<Out>,
    kernel: Body,
    _shape: Shape,
}

kernel_block!(
    Ram,
    clock clk,
    inputs [write, write_address, write_data, read, read_address],
    outputs [read_data]
);

#[derive(Clone, Debug)]
struct Shape {
    depth: usize,
    fields: usize,
    /// Width of a field.
    bits: usize,
    /// There is an output register behind the read register of the memory.
    behind: bool,
    left_out: bool,
    /// What the memory of each field holds, as far as the plan of the memories says it.
    holds: Vec<Holds>,
}

impl Ram {
    /// A memory of `depth` words of `fields` fields of `bits` bits.
    pub fn new(depth: usize, fields: usize, bits: usize) -> Self {
        Ram::of(Shape { depth, fields, bits, behind: false, left_out: false, holds: Vec::new() })
    }

    /// Adds an output register: `read_data` follows two cycles after `read_address`. The clock-to-output time of a
    /// block RAM leaves no room for logic behind it.
    pub fn registered(self) -> Self {
        Ram::of(Shape { behind: true, ..self._shape })
    }

    /// Omits the memory, for scenes that do not need it: `read_data` is zero.
    pub fn left_out(self) -> Self {
        Ram::of(Shape { left_out: true, ..self._shape })
    }

    /// With what the memory of each field holds.
    pub fn holding(self, holds: impl IntoIterator<Item = Holds>) -> Self {
        Ram::of(Shape { holds: holds.into_iter().collect(), ..self._shape })
    }

    fn of(shape: Shape) -> Self {
        let word = shape.fields * shape.bits;
        let block = Ram {
            clk: Default::default(),
            write: Wire::new(shape.fields),
            write_address: Wire::new(count_bits(shape.depth)),
            write_data: Wire::new(word),
            read: Default::default(),
            read_address: Wire::new(count_bits(shape.depth)),
            read_data: Wire::new(word),
            kernel: Body::default(),
            _shape: shape.clone(),
        };
        block.bind(shape.kernel())
    }
}

impl Shape {
    fn kernel(self) -> Kernel {
        let k = Builder::new("ram");
        let (word, address) = (self.fields * self.bits, count_bits(self.depth));
        let write = k.input("write", self.fields);
        let (write_address, data) = (k.input("write_address", address), k.input("write_data", word));
        let (read, read_address) = (k.input("read", 1), k.input("read_address", address));
        if self.left_out {
            k.wire("read_data", k.constant(word, 0));
            return k.finish();
        }
        // One array per field: every synthesiser maps it to plain memories.
        let field = |number: usize| {
            let memory = k.memory(&format!("field{number}"), self.depth, self.bits, Contents::Undefined).unchecked();
            let memory = self.holds.get(number).map_or(memory, |holds| memory.holds(holds));
            memory.write(write.at(number), write_address, data.slice(number * self.bits, self.bits));
            let held = k.register(&format!("read{number}"), Type::unsigned(self.bits));
            k.when(read, || held.set(memory.read(read_address)));
            if !self.behind {
                return *held;
            }
            let behind = k.register(&format!("behind{number}"), Type::unsigned(self.bits));
            k.when(read, || behind.set(*held));
            *behind
        };
        let fields: Vec<Expr> = (0..self.fields).map(field).collect();
        k.wire("read_data", concat(&fields.into_iter().rev().collect::<Vec<_>>()));
        k.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, random_words, MemoryReference, Reference};
    use crate::simulate::settles;
    use crate::wire::Word;

    const SHAPE: Shape = Shape { depth: 11, fields: 3, bits: 30, behind: false, left_out: false, holds: Vec::new() };

    /// Each field is a memory of its own.
    struct Fields([MemoryReference<u64>; 3]);

    impl Reference for Fields {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let mut word = Some(Word::default());
            for (index, field) in self.0.iter().enumerate() {
                word = word.zip(field.shown()).map(|(mut word, field)| {
                    word.set(index * SHAPE.bits, SHAPE.bits, field);
                    word
                });
            }
            vec![word]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [to, from] = [1, 4].map(|address| inputs[address].number() as usize);
            for (index, field) in self.0.iter_mut().enumerate() {
                let word = (to, inputs[2].field(index * SHAPE.bits, SHAPE.bits));
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
            let mut fields = Fields([0, 1, 2].map(|_| MemoryReference::new(SHAPE.depth, 1 + usize::from(behind))));
            let block = Ram::of(Shape { behind, ..SHAPE });
            check(block.kernel.kernel(), &stimulus, &mut fields);
        }
    }

    #[test]
    fn what_is_read_where_and_when_it_is_written_is_the_complement() {
        let mut ram = Ram::new(4, 1, 8);
        ram.connect_all();
        // A clock edge with this word written to `to`, read from `from` if `read`.
        let mut edge = |word: u64, to: u64, from: u64, read: bool| {
            ram.write.next = 1.into();
            (ram.write_address.next, ram.write_data.next) = (to.into(), word.into());
            (ram.read_address.next, ram.read.next) = (from.into(), read);
            for level in [false, true] {
                ram.clk.next = level.into();
                assert!(settles(&mut ram));
            }
            ram.read_data.val().word().number()
        };
        edge(0x12, 1, 0, true);
        assert_eq!(edge(0x34, 1, 1, true), 0xed);
        assert_eq!(edge(0x56, 2, 1, true), 0x34);
        assert_eq!(edge(0x78, 1, 1, false), 0x34);
        assert_eq!(edge(0x9a, 2, 1, true), 0x78);
    }
}
