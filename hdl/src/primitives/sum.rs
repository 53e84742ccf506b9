//! Sum of all taxels' polynomials of a subarray, one per search buffer.

use rust_hdl::prelude::*;

use super::counter::count_bits;
use super::polynomial_word::{resize, PolynomialWord};
use super::sweep::{BUFFERS, BUFFER_BITS, START};
use crate::wire::{Wire, Word};

/// Adds the counted lanes of each `fill` to the sum of buffer `START`, three cycles later; quad 0 restarts a
/// coefficient. `read` puts a buffer's sum on `word` after the same two cycles as the search memory, where it is held;
/// `write` replaces a buffer's sum by the `write_data` of the next cycle. As in the search memory, `START` is buffer 0
/// unless one subarray is filled while another is searched.
#[derive(LogicBlock)]
pub struct Sum {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Add `fill_quad` to coefficient `fill_index`.
    pub fill: Signal<In, Bit>,
    /// Address of the quad; 0 restarts the coefficient. Valid with `fill`.
    pub fill_address: Wire<In>,
    /// Index of the coefficient; valid with `fill`.
    pub fill_index: Wire<In>,
    /// Counted lanes, one bit each; valid with `fill`.
    pub fill_mask: Wire<In>,
    /// The coefficient of four taxels, signed; valid with `fill`.
    pub fill_quad: Wire<In>,
    /// Put the sum of `read_buffer` on `word`.
    pub read: Signal<In, Bit>,
    /// Buffer to read; valid with `read`.
    pub read_buffer: Wire<In>,
    /// The sum read last, in the layout of the sums; two cycles after `read`.
    pub word: Wire<Out>,
    /// Replace the sum of `write_buffer`.
    pub write: Signal<In, Bit>,
    /// Buffer to write; valid with `write`.
    pub write_buffer: Wire<In>,
    /// The new sum; valid one cycle after `write`.
    pub write_data: Wire<In>,
    _layout: PolynomialWord,
    _apart: bool,
    _buffers: [Word; BUFFERS + 1],
    _filled: Option<Added>,
    _added: Option<Added>,
    _reads: Option<usize>,
    _writes: Option<usize>,
}

/// A pending addition to a coefficient.
#[derive(Clone, Copy, Debug)]
struct Added {
    index: usize,
    first: bool,
    sum: i64,
}

impl Sum {
    /// Sums in `layout` (one lane) over `quads` quads, of coefficients of `fill_bits` bits; `apart` says whether one
    /// subarray is filled while another is searched.
    pub fn new(layout: PolynomialWord, quads: usize, fill_bits: usize, apart: bool) -> Self {
        Sum {
            clk: Default::default(),
            fill: Default::default(),
            fill_address: Wire::new(count_bits(quads)),
            fill_index: Wire::new(count_bits(layout.widths.len())),
            fill_mask: Wire::new(4),
            fill_quad: Wire::new(4 * fill_bits),
            read: Default::default(),
            read_buffer: Wire::new(BUFFER_BITS),
            word: Wire::new(layout.bits()),
            write: Default::default(),
            write_buffer: Wire::new(BUFFER_BITS),
            write_data: Wire::new(layout.bits()),
            _layout: layout,
            _apart: apart,
            _buffers: Default::default(),
            _filled: None,
            _added: None,
            _reads: None,
            _writes: None,
        }
    }
}

impl Sum {
    /// Index of the register that holds the sum of `buffer`.
    fn buffer(&self, buffer: usize) -> usize {
        if buffer == START && !self._apart {
            0
        } else {
            buffer
        }
    }
}

impl Logic for Sum {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            if let Some(buffer) = self._reads.take() {
                self.word.next = self._buffers[buffer];
            }
            if let Some(buffer) = self._writes.take() {
                self._buffers[buffer] = self.write_data.val();
            }
            let named = |wire: &Wire<In>| self.buffer(wire.val().number() as usize);
            let (reads, writes) = (named(&self.read_buffer), named(&self.write_buffer));
            self._reads = self.read.val().then_some(reads);
            self._writes = self.write.val().then_some(writes);
            let filled = self._filled.take();
            if let Some(Added { index, first, sum: added }) = std::mem::replace(&mut self._added, filled) {
                if let Some(&width) = self._layout.widths.get(index) {
                    let start = self.buffer(START);
                    let before = self._layout.get(&self._buffers[start], 0)[index];
                    let sum = added + if first { 0 } else { before };
                    self._buffers[start].set(self._layout.offset(index), width, sum as u64);
                }
            }
            if self.fill.val() {
                let bits = self.fill_quad.width() / 4;
                let counted = |lane: &usize| self.fill_mask.val().field(*lane, 1) == 1;
                let sum = (0..4).filter(counted).map(|lane| self.fill_quad.val().signed(lane, bits)).sum();
                let index = self.fill_index.val().number() as usize;
                self._filled = Some(Added { index, first: self.fill_address.val().number() == 0, sum });
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
        let terms: Vec<String> = (0..4).map(|lane| resize(&format!("t{lane}"), bits, wide)).collect();
        let lanes: String = (0..4)
            .map(|lane| {
                format!(
                    "\
reg [{end}:0] t{lane};
always @(posedge clk) t{lane} <= fill_mask[{lane}] ? fill_quad[{low} +: {bits}] : {bits}'d0;
",
                    end = bits - 1,
                    low = lane * bits,
                )
            })
            .collect();
        let buffers = BUFFERS + usize::from(self._apart);
        let names: Vec<String> = (0..buffers).map(|b| format!("buffer{b}")).collect();
        let decoded: Vec<String> = (0..BUFFERS).rev().map(|b| format!("write && write_buffer == 2'd{b}")).collect();
        let decoded = decoded.join(", ");
        let coefficients: String = self
            ._layout
            .widths
            .iter()
            .enumerate()
            .map(|(k, &width)| {
                let field = format!("[{} +: {width}]", self._layout.offset(k));
                let choices: String =
                    (1..buffers).map(|b| format!("      2'd{b}: word{field} <= buffer{b}{field};\n")).collect();
                let writes: String = (0..BUFFERS)
                    .map(|b| format!("  if (writes{k}[{b}]) buffer{b}{field} <= write_data{field};\n"))
                    .collect();
                format!(
                    "\
reg reads{k};
reg [1:0] from{k};
reg [{last}:0] writes{k};
(* keep *) always @(posedge clk) begin
  reads{k} <= read;
  from{k} <= read_buffer;
  writes{k} <= {{{decoded}}};
end
always @(posedge clk) begin
  if (reads{k}) begin
    case (from{k})
{choices}      default: word{field} <= buffer0{field};
    endcase
  end
{writes}  if (adds && index == {index_bits}'d{k})
    buffer{start}{field} <= {added} + (first ? {width}'d0 : buffer{start}{field});
end
",
                    last = BUFFERS - 1,
                    start = self.buffer(START),
                    added = resize("added", wide, width),
                )
            })
            .collect();
        Verilog::Custom(format!(
            "\
{lanes}reg filled, adds, first1, first;
reg [{index_end}:0] index1, index;
reg [{wide_end}:0] added;
reg [{end}:0] {names};
always @(posedge clk) begin
  filled <= fill;
  adds <= filled;
  index1 <= fill_index;
  index <= index1;
  first1 <= fill_address == {address_bits}'d0;
  first <= first1;
  added <= {terms};
end
// Each coefficient has its own control registers, to limit fan-out; the attribute keeps synthesis from merging them.
{coefficients}",
            wide_end = wide - 1,
            index_end = index_bits - 1,
            end = self._layout.bits() - 1,
            address_bits = self.fill_address.width(),
            terms = terms.join(" + "),
            names = names.join(", "),
        ))
    }
}
