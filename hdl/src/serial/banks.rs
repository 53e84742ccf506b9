//! Memories of the polynomials: two single-port banks, one read while the other is written.

use dermis_golden::fixed::formats::Formats;
use dermis_golden::fixed::serial::{polynomials, word_bits};
use rust_hdl::prelude::*;

use crate::primitives::count_bits;
use crate::wire::{Wire, Word};

/// `odd` selects the bank that is read; writes go to the other one. An address is `{region, polynomial, coefficient}`,
/// of 1, n and 4 bits.
#[derive(LogicBlock)]
pub struct Banks {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Read the odd bank and write the even one; if low, the other way round.
    pub odd: Signal<In, Bit>,
    /// Address to read.
    pub read_address: Wire<In>,
    /// The word read, one cycle after `read_address`.
    pub word: Wire<Out>,
    /// Write `data` in this cycle.
    pub write: Signal<In, Bit>,
    /// Address to write; valid with `write`.
    pub write_address: Wire<In>,
    /// Word to write; valid with `write`.
    pub data: Wire<In>,
    _banks: [Vec<Word>; 2],
    _words: [Word; 2],
    _odd: bool,
}

impl Banks {
    /// With the word width and the number of polynomials of `formats`.
    pub fn new(formats: &Formats) -> Self {
        let address = 1 + count_bits(polynomials(formats)) + 4;
        let bits = word_bits(formats);
        let bank = || vec![Word::default(); 1 << address];
        Banks {
            clk: Default::default(),
            odd: Default::default(),
            read_address: Wire::new(address),
            word: Wire::new(bits),
            write: Default::default(),
            write_address: Wire::new(address),
            data: Wire::new(bits),
            _banks: [bank(), bank()],
            _words: [Word::default(); 2],
            _odd: false,
        }
    }
}

impl Logic for Banks {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            for bank in 0..2 {
                if (bank == 1) == self.odd.val() {
                    self._words[bank] = self._banks[bank][self.read_address.val().number() as usize];
                } else if self.write.val() {
                    self._banks[bank][self.write_address.val().number() as usize] = self.data.val();
                }
            }
            self._odd = self.odd.val();
        }
        self.word.next = self._words[usize::from(self._odd)];
    }

    fn connect(&mut self) {
        self.word.connect();
    }

    fn hdl(&self) -> Verilog {
        let end = self.word.width() - 1;
        let address_end = self.read_address.width() - 1;
        let last = self._banks[0].len() - 1;
        let bank = |name: &str, reads: &str| {
            format!(
                "\
reg [{end}:0] {name} [0:{last}];
reg [{end}:0] {name}_word;
wire {name}_reads = {reads};
wire [{address_end}:0] {name}_address = {name}_reads ? read_address : write_address;
always @(posedge clk) begin
  if ({name}_reads) {name}_word <= {name}[{name}_address];
  else if (write) {name}[{name}_address] <= data;
end
"
            )
        };
        Verilog::Custom(format!(
            "\
{}{}reg odd_then;
always @(posedge clk) odd_then <= odd;
always @(*) word = odd_then ? odd_bank_word : even_word;",
            bank("even", "!odd"),
            bank("odd_bank", "odd"),
        ))
    }
}
