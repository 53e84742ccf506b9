//! Operands of the MAC lanes: a limb of the input or a v_ij, its parities permuted as the matrix needs them.

use dermis_golden::fixed::formats::{Formats, MULTIPLIER_BITS};
use rust_hdl::prelude::*;

use super::polynomial_word::resize;
use super::steps::SOURCE_BITS;
use crate::wire::{Wire, Word};

/// Words of the input memory and of a v_ij in, four multiplier operands out one cycle later.
#[derive(LogicBlock)]
pub struct OperandSelect {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Four parities of the folded input, `fold_bits` each, signed.
    pub input_quad: Wire<In>,
    /// Four parities of a v_ij, `data_bits` each, signed.
    pub vector_quad: Wire<In>,
    /// Selection, valid with the quads. Bits 1:0, kind: 0 = v_ij, 1 = high limb of the input, 2 = low limb. Bits 3:2,
    /// flip: lane group t gets parity t XOR flip. Bit 4: parities 1 and 2 (x and y) are exchanged first.
    pub source: Wire<In>,
    /// Operand of each lane group, four times 18 bits, signed; one cycle later.
    pub operands: Wire<Out>,
    _low: usize,
    _align: usize,
}

const M: usize = MULTIPLIER_BITS as usize;

impl OperandSelect {
    /// Widths of `formats`.
    pub fn new(formats: &Formats) -> Self {
        OperandSelect {
            clk: Default::default(),
            input_quad: Wire::new(4 * formats.fold_bits as usize),
            vector_quad: Wire::new(4 * formats.data_bits as usize),
            source: Wire::new(SOURCE_BITS),
            operands: Wire::new(4 * M),
            _low: formats.input_low_bits as usize,
            _align: formats.limb_align as usize,
        }
    }
}

impl Logic for OperandSelect {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let control = self.source.val().number();
            let flip = (control >> 2 & 3) as usize;
            let fields: [i64; 4] = std::array::from_fn(|target| {
                let source = if control >> 4 == 1 { [0, 2, 1, 3][target ^ flip] } else { target ^ flip };
                let folded = self.input_quad.val().signed(source, self.input_quad.width() / 4);
                match control & 3 {
                    1 => folded >> self._low,
                    2 => (folded & ((1 << self._low) - 1)) << (self._align - self._low),
                    _ => self.vector_quad.val().signed(source, self.vector_quad.width() / 4),
                }
            });
            self.operands.next = Word::of_fields(&fields, M);
        }
    }

    fn connect(&mut self) {
        self.operands.connect();
    }

    fn hdl(&self) -> Verilog {
        let (fold, data) = (self.input_quad.width() / 4, self.vector_quad.width() / 4);
        let (low, align) = (self._low, self._align);
        let wires: String = (0..4)
            .map(|p| {
                let low_limb = if low == 0 {
                    format!("{M}'d0")
                } else {
                    let zeros = if align > low { format!(", {}'d0", align - low) } else { String::new() };
                    format!("{{{}'d0, input_quad[{} +: {low}]{zeros}}}", M - align, p * fold)
                };
                format!(
                    "wire [{high_end}:0] high{p} = input_quad[{high_low} +: {high_bits}];\n\
                     wire [{data_end}:0] vector{p} = vector_quad[{data_low} +: {data}];\n\
                     wire [{m_end}:0] q{p} = source[1:0] == 2'd1 ? {high} : source[1:0] == 2'd2 ? {low_limb} : {vector};\n",
                    high_bits = fold - low,
                    high_end = fold - low - 1,
                    high_low = p * fold + low,
                    data_end = data - 1,
                    data_low = p * data,
                    m_end = M - 1,
                    high = resize(&format!("high{p}"), fold - low, M),
                    vector = resize(&format!("vector{p}"), data, M),
                )
            })
            .collect();
        // Exchange parities 1 and 2 if source[4]; then parity t XOR flip, bit 0 (s to r), then bit 1.
        Verilog::Custom(format!(
            "\
{wires}wire [{end}:0] s1 = source[4] ? q2 : q1;
wire [{end}:0] s2 = source[4] ? q1 : q2;
wire [{end}:0] r0 = source[2] ? s1 : q0;
wire [{end}:0] r1 = source[2] ? q0 : s1;
wire [{end}:0] r2 = source[2] ? q3 : s2;
wire [{end}:0] r3 = source[2] ? s2 : q3;
always @(posedge clk) operands <= source[3] ? {{r1, r0, r3, r2}} : {{r3, r2, r1, r0}};",
            end = M - 1,
        ))
    }
}
