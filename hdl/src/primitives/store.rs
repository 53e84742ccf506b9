//! The search memory: every taxel's polynomial, twice.

use rust_hdl::prelude::*;

use super::counter::count_bits;
use super::polynomial_word::{resize, PolynomialWord};
use crate::wire::{Wire, Word};

/// Two buffers of quads of polynomials. `fill` writes one coefficient of a quad into buffer 0; `write` a whole quad; the
/// read register follows the address by one cycle. `fill` and `write` never coincide.
#[derive(LogicBlock)]
pub struct Store {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Write coefficient `fill_index` of quad `fill_address`.
    pub fill: Signal<In, Bit>,
    /// Which coefficient.
    pub fill_index: Wire<In>,
    /// Which quad.
    pub fill_address: Wire<In>,
    /// Four taxels' coefficient.
    pub fill_quad: Wire<In>,
    /// Write `write_data`.
    pub write: Signal<In, Bit>,
    /// Buffer to write.
    pub write_buffer: Signal<In, Bit>,
    /// Which quad.
    pub write_address: Wire<In>,
    /// A quad of polynomials.
    pub write_data: Wire<In>,
    /// Buffer to read.
    pub read_buffer: Signal<In, Bit>,
    /// Which quad.
    pub read_address: Wire<In>,
    /// A quad of polynomials, one cycle later.
    pub read_data: Wire<Out>,
    _layout: PolynomialWord,
    _memory: [Vec<Word>; 2],
}

impl Store {
    /// `quads` quads of polynomials in `layout`, filled with coefficients of `fill_bits` bits.
    pub fn new(layout: PolynomialWord, quads: usize, fill_bits: usize) -> Self {
        let address = count_bits(quads);
        Store {
            clk: Default::default(),
            fill: Default::default(),
            fill_index: Wire::new(count_bits(layout.widths.len())),
            fill_address: Wire::new(address),
            fill_quad: Wire::new(4 * fill_bits),
            write: Default::default(),
            write_buffer: Default::default(),
            write_address: Wire::new(address),
            write_data: Wire::new(layout.bits()),
            read_buffer: Default::default(),
            read_address: Wire::new(address),
            read_data: Wire::new(layout.bits()),
            _layout: layout,
            _memory: [vec![Word::default(); quads], vec![Word::default(); quads]],
        }
    }
}

impl Logic for Store {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let read = self._memory[usize::from(self.read_buffer.val())].get(self.read_address.val().number() as usize);
            self.read_data.next = read.copied().unwrap_or_default();
            if self.fill.val() {
                let k = self.fill_index.val().number() as usize;
                let bits = self.fill_quad.width() / 4;
                let word = self._memory[0].get_mut(self.fill_address.val().number() as usize);
                if let (Some(word), Some(&width)) = (word, self._layout.widths.get(k)) {
                    for lane in 0..4 {
                        let value = self.fill_quad.val().signed(lane, bits);
                        word.set(self._layout.offset(k) + lane * width, width, value as u64);
                    }
                }
            } else if self.write.val() {
                let buffer = &mut self._memory[usize::from(self.write_buffer.val())];
                if let Some(word) = buffer.get_mut(self.write_address.val().number() as usize) {
                    *word = self.write_data.val();
                }
            }
        }
    }

    fn connect(&mut self) {
        self.read_data.connect();
    }

    fn hdl(&self) -> Verilog {
        let bits = self.fill_quad.width() / 4;
        let index_bits = self.fill_index.width();
        let address_bits = self.fill_address.width();
        let lanes: String = (0..4)
            .map(|lane| format!("wire [{}:0] t{lane} = fill_quad[{} +: {bits}];\n", bits - 1, lane * bits))
            .collect();
        let memories: String = self
            ._layout
            .widths
            .iter()
            .enumerate()
            .map(|(k, &width)| {
                let (low, all) = (self._layout.offset(k), 4 * width);
                let filled: Vec<String> = (0..4).rev().map(|lane| resize(&format!("t{lane}"), bits, width)).collect();
                format!(
                    "\
reg [{end}:0] memory{k} [0:{depth}];
wire write{k} = fill ? fill_index == {index_bits}'d{k} : write;
wire [{end}:0] data{k} = fill ? {{{filled}}} : write_data[{low} +: {all}];
always @(posedge clk) begin
  if (write{k}) memory{k}[write_to] <= data{k};
  read_data[{low} +: {all}] <= memory{k}[read_from];
end
",
                    end = all - 1,
                    depth = (2usize << address_bits) - 1,
                    filled = filled.join(", "),
                )
            })
            .collect();
        Verilog::Custom(format!(
            "\
{lanes}wire [{address_bits}:0] write_to = fill ? {{1'b0, fill_address}} : {{write_buffer, write_address}};
wire [{address_bits}:0] read_from = {{read_buffer, read_address}};
{memories}"
        ))
    }
}
