//! Operands of the MAC lanes: a limb of the input or a v_ij, its parities permuted as the matrix needs them.

use dermis_golden::fixed::words::formats::{Formats, MULTIPLIER_BITS};
use dermis_golden::fixed::words::network::ONE;
use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{concat, Body, Builder, Expr, Kernel};
use crate::primitives::pass::pass_program::SOURCE_BITS;
use crate::wire::Wire;

/// Words of the input memory and of a v_ij in, four multiplier operands out one cycle later.
#[derive(dermis_hdl_derive::Block)]
pub struct OperandSelect {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Four parities of the folded input, `fold_bits` each, signed; taken in every cycle.
    pub input_quad: Wire<In>,
    /// Four parities of a v_ij, `operand_bits` each, signed; taken in every cycle.
    pub vector_quad: Wire<In>,
    /// Selection: bits 1:0 kind, 0 = v_ij, 1 = high limb of the input, 2 = low limb, 3 = one, with a network, bits 3:2 flip, lane group t gets
    /// parity t XOR flip, bit 4 parities 1 and 2 (x and y) are exchanged first; valid with the quads.
    pub source: Wire<In>,
    /// Operand of each lane group, four times 18 bits, signed; one cycle after the quads.
    pub operands: Wire<Out>,
    kernel: Body,
}

kernel_block!(OperandSelect, clock clk, inputs [input_quad, vector_quad, source], outputs [operands]);

const M: usize = MULTIPLIER_BITS as usize;

/// Widths of the words.
#[derive(Clone, Copy)]
struct Shape {
    fold: usize,
    data: usize,
    /// Bits of the low limb; 0 without limbs.
    low: usize,
    /// Position of the low limb's top in the multiplier's operand.
    align: usize,
    /// Whether an operand may be one.
    one: bool,
}

impl OperandSelect {
    /// Widths of `formats`.
    pub fn new(formats: &Formats) -> Self {
        let shape = Shape {
            fold: formats.fold_bits as usize,
            data: formats.operand_bits() as usize,
            low: formats.input_low_bits as usize,
            align: formats.limb_align as usize,
            one: formats.has_network(),
        };
        OperandSelect::of(shape)
    }

    fn of(shape: Shape) -> Self {
        let block = OperandSelect {
            clk: Default::default(),
            input_quad: Wire::new(4 * shape.fold),
            vector_quad: Wire::new(4 * shape.data),
            source: Wire::new(SOURCE_BITS),
            operands: Wire::new(4 * M),
            kernel: Body::default(),
        };
        block.bind(shape.kernel())
    }
}

impl Shape {
    fn kernel(self) -> Kernel {
        let k = Builder::new("operand_select");
        let (input, vectors) = (k.input("input_quad", 4 * self.fold), k.input("vector_quad", 4 * self.data));
        let source = k.input("source", SOURCE_BITS);
        let parity = |p: usize| {
            let high = input.slice(p * self.fold + self.low, self.fold - self.low).signed().resize(M).unsigned();
            let vector = vectors.slice(p * self.data, self.data).signed().resize(M).unsigned();
            let low = match self.low {
                0 => k.constant(M, 0),
                bits => input.slice(p * self.fold, bits).shift_left(self.align - bits).resize(M),
            };
            let one = self.one.then(|| (3, k.constant(M, ONE as u64)));
            let others: Vec<(u64, Expr)> = [(1, high), (2, low)].into_iter().chain(one).collect();
            k.wire(&format!("q{p}"), source.low(2).case(&others, vector))
        };
        let [q0, q1, q2, q3] = [0, 1, 2, 3].map(parity);
        k.comment("Parities 1 and 2 exchanged if source[4]; then parity t XOR flip, bit 0 (s to r), then bit 1.");
        let choose = |name: &str, bit: usize, a, b| k.wire(name, source.at(bit).mux(a, b));
        let (s1, s2) = (choose("s1", 4, q2, q1), choose("s2", 4, q1, q2));
        let (r0, r1) = (choose("r0", 2, s1, q0), choose("r1", 2, q0, s1));
        let (r2, r3) = (choose("r2", 2, q3, s2), choose("r3", 2, s2, q3));
        k.delay("operands", source.at(3).mux(concat(&[r1, r0, r3, r2]), concat(&[r3, r2, r1, r0])));
        k.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, random_words, Pipeline};
    use crate::wire::Word;

    #[test]
    fn each_lane_group_gets_its_limb_of_its_parity() {
        let wide = Shape { fold: 26, data: 18, low: 9, align: 17, one: false };
        for shape in [wide, Shape { fold: 14, data: 16, low: 0, align: 0, one: false }, Shape { one: true, ..wide }] {
            let of = |inputs: &[Word]| {
                let control = inputs[2].number();
                let flip = (control >> 2 & 3) as usize;
                let fields: [i64; 4] = std::array::from_fn(|target| {
                    let source = if control >> 4 == 1 { [0, 2, 1, 3][target ^ flip] } else { target ^ flip };
                    let folded = inputs[0].signed(source, shape.fold);
                    match control & 3 {
                        1 => folded >> shape.low,
                        2 => (folded & ((1 << shape.low) - 1)) << (shape.align - shape.low),
                        3 if shape.one => ONE,
                        _ => inputs[1].signed(source, shape.data),
                    }
                });
                vec![Some(Word::of_fields(&fields, M))]
            };
            let stimulus = random_words(3000, &[4 * shape.fold, 4 * shape.data, SOURCE_BITS]);
            let block = OperandSelect::of(shape);
            check(block.kernel.kernel(), &stimulus, &mut Pipeline::new(1, 1, of));
        }
    }
}
