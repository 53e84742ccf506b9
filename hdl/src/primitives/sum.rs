//! The sum of all taxels' polynomials, kept beside them.

use rust_hdl::prelude::*;

use super::counter::count_bits;
use super::polynomial_word::{resize, PolynomialWord};
use crate::wire::{Wire, Word};

/// Adds up the counted lanes of each `fill` into buffer 0 (quad 0 starts a coefficient anew); `read` holds a buffer's sum on
/// `word`; `write` replaces a buffer's sum.
#[derive(LogicBlock)]
pub struct Sum {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Add `fill_quad` to coefficient `fill_index`.
    pub fill: Signal<In, Bit>,
    /// Which quad; the first starts the coefficient's sum.
    pub fill_address: Wire<In>,
    /// Which coefficient.
    pub fill_index: Wire<In>,
    /// Lanes that count.
    pub fill_mask: Wire<In>,
    /// Four taxels' coefficient.
    pub fill_quad: Wire<In>,
    /// Put the sum of `read_buffer` on `word`.
    pub read: Signal<In, Bit>,
    /// Buffer to read.
    pub read_buffer: Signal<In, Bit>,
    /// The sum read last.
    pub word: Wire<Out>,
    /// Replace the sum of `write_buffer`.
    pub write: Signal<In, Bit>,
    /// Buffer to write.
    pub write_buffer: Signal<In, Bit>,
    /// The new sum.
    pub write_data: Wire<In>,
    _layout: PolynomialWord,
    _buffers: [Word; 2],
}

impl Sum {
    /// Sums in `layout` (one lane) over `quads` quads, of coefficients of `fill_bits` bits.
    pub fn new(layout: PolynomialWord, quads: usize, fill_bits: usize) -> Self {
        Sum {
            clk: Default::default(),
            fill: Default::default(),
            fill_address: Wire::new(count_bits(quads)),
            fill_index: Wire::new(count_bits(layout.widths.len())),
            fill_mask: Wire::new(4),
            fill_quad: Wire::new(4 * fill_bits),
            read: Default::default(),
            read_buffer: Default::default(),
            word: Wire::new(layout.bits()),
            write: Default::default(),
            write_buffer: Default::default(),
            write_data: Wire::new(layout.bits()),
            _layout: layout,
            _buffers: [Word::default(); 2],
        }
    }
}

impl Logic for Sum {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            if self.read.val() {
                self.word.next = self._buffers[usize::from(self.read_buffer.val())];
            }
            let k = self.fill_index.val().number() as usize;
            if self.fill.val() {
                if let Some(&width) = self._layout.widths.get(k) {
                    let bits = self.fill_quad.width() / 4;
                    let counted = |lane: &usize| self.fill_mask.val().field(*lane, 1) == 1;
                    let added: i64 = (0..4).filter(counted).map(|lane| self.fill_quad.val().signed(lane, bits)).sum();
                    let mut sum = self._layout.get(&self._buffers[0], 0);
                    sum[k] = added + if self.fill_address.val().number() == 0 { 0 } else { sum[k] };
                    self._buffers[0].set(self._layout.offset(k), width, sum[k] as u64);
                }
            } else if self.write.val() {
                self._buffers[usize::from(self.write_buffer.val())] = self.write_data.val();
            }
        }
    }

    fn connect(&mut self) {
        self.word.connect();
    }

    fn hdl(&self) -> Verilog {
        let bits = self.fill_quad.width() / 4;
        let wide = bits + 2;
        let index_bits = self.fill_index.width();
        let terms: Vec<String> = (0..4)
            .map(|lane| {
                let field = format!("t{lane}");
                format!("(fill_mask[{lane}] ? {} : {wide}'d0)", resize(&field, bits, wide))
            })
            .collect();
        let lanes: String = (0..4)
            .map(|lane| format!("wire [{}:0] t{lane} = fill_quad[{} +: {bits}];\n", bits - 1, lane * bits))
            .collect();
        let sums: String = self
            ._layout
            .widths
            .iter()
            .enumerate()
            .map(|(k, &width)| {
                let low = self._layout.offset(k);
                format!(
                    "\
  if (fill && fill_index == {index_bits}'d{k})
    buffer0[{low} +: {width}] <= {added} + (first ? {width}'d0 : buffer0[{low} +: {width}]);
",
                    added = resize("added", wide, width),
                )
            })
            .collect();
        Verilog::Custom(format!(
            "\
{lanes}wire first = fill_address == {address_bits}'d0;
wire [{wide_end}:0] added = {terms};
reg [{end}:0] buffer0, buffer1;
always @(posedge clk) begin
  if (read) word <= read_buffer ? buffer1 : buffer0;
  if (!fill && write && write_buffer) buffer1 <= write_data;
  if (!fill && write && !write_buffer) buffer0 <= write_data;
{sums}end",
            wide_end = wide - 1,
            end = self._layout.bits() - 1,
            address_bits = self.fill_address.width(),
            terms = terms.join(" + "),
        ))
    }
}
