//! Operands of the MAC lanes: a limb of the input or a v_ij, its parities permuted as the matrix needs them.

use dermis_golden::fixed::words::formats::{Formats, MULTIPLIER_BITS};
use dermis_golden::fixed::words::network::ONE;

use crate::block;
use crate::language::{concat, Block, Builder, Expr, Inside};
use crate::primitives::pass::pass_program::SOURCE_BITS;

block! {
    /// Words of the input memory and of a v_ij in, four multiplier operands out one cycle later.
    #[derive(Clone, Copy)]
    pub struct OperandSelect {
        fold: usize,
        data: usize,
        /// Bits of the low limb; 0 without limbs.
        low: usize,
        /// Position of the low limb's top in the multiplier's operand.
        align: usize,
        /// Whether an operand may be one.
        one: bool,
    }
    ports OperandSelectPorts {
        clock;
        /// Four parities of the folded input, `fold_bits` each, signed; taken in every cycle.
        in input_quad: 4 * fold;
        /// Four parities of a v_ij, `operand_bits` each, signed; taken in every cycle.
        in vector_quad: 4 * data;
        /// Selection: bits 1:0 kind, 0 = v_ij, 1 = high limb of the input, 2 = low limb, 3 = one, with a network, bits
        /// 3:2 flip, lane group t gets parity t XOR flip, bit 4 parities 1 and 2 (x and y) are exchanged first; valid
        /// with the quads.
        in source: SOURCE_BITS;
        /// Operand of each lane group, four times 18 bits, signed; one cycle after the quads.
        out operands: 4 * M;
    }
}

const M: usize = MULTIPLIER_BITS as usize;

impl OperandSelect {
    /// Widths of `formats`.
    pub fn new(formats: &Formats) -> Self {
        OperandSelect {
            fold: formats.fold_bits as usize,
            data: formats.operand_bits() as usize,
            low: formats.input_low_bits as usize,
            align: formats.limb_align as usize,
            one: formats.has_network(),
        }
    }
}

impl Block for OperandSelect {
    fn build<'k>(&self, k: &'k Builder, io: OperandSelectPorts<Inside<'k>>) {
        let (input, vectors, source) = (io.input_quad, io.vector_quad, io.source);
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
        io.operands.delay(source.at(3).mux(concat(&[r1, r0, r3, r2]), concat(&[r3, r2, r1, r0])));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_words, Pipeline};
    use crate::wire::Word;

    #[test]
    fn each_lane_group_gets_its_limb_of_its_parity() {
        let wide = OperandSelect { fold: 26, data: 18, low: 9, align: 17, one: false };
        for shape in [
            wide,
            OperandSelect { fold: 14, data: 16, low: 0, align: 0, one: false },
            OperandSelect { one: true, ..wide },
        ] {
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
            check(&kernel_of(&shape), &stimulus, &mut Pipeline::new(1, 1, of));
        }
    }
}
