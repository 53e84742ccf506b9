//! Table between the two orders of the taxels: row-major on the streams, quad by quad in the engine.

use dermis_golden::fixed::quads::Quads;
use rust_hdl::prelude::*;

use crate::primitives::count_bits;
use crate::wire::{Wire, Word};

/// `place` follows `index` by one cycle: with `back` the place (4·quad + lane) of a row-major taxel, otherwise the
/// row-major taxel at a place.
#[derive(LogicBlock)]
pub struct Order {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// From row-major to place; if low, from place to row-major.
    pub back: Signal<In, Bit>,
    /// Row-major index, or place.
    pub index: Wire<In>,
    /// Place, or row-major index; one cycle later.
    pub place: Wire<Out>,
    _places: Vec<u64>,
}

impl Order {
    /// For an array of `layout`, whose row and column counts are even.
    pub fn new(layout: Quads) -> Self {
        let count = 4 * layout.len();
        let bits = count_bits(count);
        let mut places = vec![0; 2 << bits];
        for place in 0..count {
            let taxel = layout.taxel(place / 4, place % 4);
            places[place] = taxel as u64;
            places[(1 << bits) + taxel] = place as u64;
        }
        Order {
            clk: Default::default(),
            back: Default::default(),
            index: Wire::new(bits),
            place: Wire::new(bits),
            _places: places,
        }
    }
}

impl Logic for Order {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let half = if self.back.val() { self._places.len() / 2 } else { 0 };
            self.place.next = Word::from(self._places[half + self.index.val().number() as usize]);
        }
    }

    fn connect(&mut self) {
        self.place.connect();
    }

    fn hdl(&self) -> Verilog {
        let bits = self.place.width();
        let words: String =
            self._places.iter().enumerate().map(|(at, place)| format!("  places[{at}] = {bits}'d{place};\n")).collect();
        Verilog::Custom(format!(
            "\
reg [{end}:0] places [0:{last}];
initial begin
{words}end
always @(posedge clk) place <= places[{{back, index}}];",
            end = bits - 1,
            last = self._places.len() - 1,
        ))
    }
}
