//! Quad address of a v_ij, with transposed results put back in place.

use dermis_golden::fixed::quads::Quads;
use rust_hdl::prelude::*;

use super::counter::count_bits;
use crate::wire::{Wire, Word};

/// Address and taxels of a quad; rows and columns are exchanged for the v_ij that were computed transposed.
/// Combinational.
#[derive(LogicBlock)]
pub struct Placer {
    /// Index of the v_ij.
    pub index: Wire<In>,
    /// The quad's address as computed.
    pub address: Wire<In>,
    /// Its four taxels as computed.
    pub quad: Wire<In>,
    /// The quad's address in the subarray.
    pub placed: Wire<Out>,
    /// Its four taxels in lane order.
    pub taxels: Wire<Out>,
    _layout: Quads,
    _transposed: Vec<usize>,
}

impl Placer {
    /// For subarrays of `layout`, taxels of `bits` bits and `vectors` v_ij, of which those listed in `transposed`
    /// arrive with rows and columns exchanged.
    pub fn new(layout: Quads, bits: usize, vectors: usize, transposed: Vec<usize>) -> Self {
        Placer {
            index: Wire::new(count_bits(vectors)),
            address: Wire::new(count_bits(layout.len())),
            quad: Wire::new(4 * bits),
            placed: Wire::new(count_bits(layout.len())),
            taxels: Wire::new(4 * bits),
            _layout: layout,
            _transposed: transposed,
        }
    }
}

impl Logic for Placer {
    fn update(&mut self) {
        let (bits, quad) = (self.quad.width() / 4, self.quad.val());
        let address = self.address.val().number() as usize;
        let exchange = self._transposed.contains(&(self.index.val().number() as usize)) && address < self._layout.len();
        self.placed.next = match exchange {
            true => Word::from(self._layout.transposed(address) as u64),
            false => self.address.val(),
        };
        self.taxels.next = match exchange {
            true => Word::of_fields(&[0, 2, 1, 3].map(|lane| quad.signed(lane, bits)), bits),
            false => quad,
        };
    }

    fn connect(&mut self) {
        self.placed.connect();
        self.taxels.connect();
    }

    fn hdl(&self) -> Verilog {
        if self._transposed.is_empty() {
            return Verilog::Custom(
                "// No v_ij is computed transposed.\nwire unused = &{1'b0, index};\n\
                 always @(*) placed = address;\nalways @(*) taxels = quad;"
                    .to_string(),
            );
        }
        let (index, bits, address) = (self.index.width(), self.quad.width() / 4, self.address.width());
        let is: Vec<String> = self._transposed.iter().map(|k| format!("index == {index}'d{k}")).collect();
        let cases: String = (0..self._layout.len())
            .map(|a| format!("    {address}'d{a}: across = {address}'d{};\n", self._layout.transposed(a)))
            .collect();
        Verilog::Custom(format!(
            "\
wire exchange = {is};
reg [{end}:0] across;
always @(*) begin
  case (address)
{cases}    default: across = address;
  endcase
end
always @(*) placed = exchange ? across : address;
always @(*) taxels = exchange ? {{quad[{b3} +: {bits}], quad[{b1} +: {bits}], quad[{b2} +: {bits}], quad[0 +: {bits}]}} : quad;",
            is = is.join(" || "),
            end = address - 1,
            b1 = bits,
            b2 = 2 * bits,
            b3 = 3 * bits,
        ))
    }
}
