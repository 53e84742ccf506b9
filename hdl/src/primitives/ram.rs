//! Simple dual-port memory: one write port with an enable per field, one read port with one or two registers.

use rust_hdl::prelude::*;

use super::counter::count_bits;
use crate::wire::{Wire, Word};

/// ```text
/// write (one bit per field), write_address, write_data --> memory --> read_data one or two cycles after read_address
/// ```
/// The read registers change only while `read` is high. Reading a word in the cycle that writes it returns the old one;
/// the content is undefined until written.
#[derive(LogicBlock)]
pub struct Ram {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Write enable, one bit per field.
    pub write: Wire<In>,
    /// Address of the word to write; valid with `write`.
    pub write_address: Wire<In>,
    /// Fields to write; valid with `write`.
    pub write_data: Wire<In>,
    /// Enable of the read registers.
    pub read: Signal<In, Bit>,
    /// Address of the word to read.
    pub read_address: Wire<In>,
    /// The word read, one cycle after `read_address`, or two if [`registered`](Ram::registered).
    pub read_data: Wire<Out>,
    _memory: Vec<Word>,
    /// There is an output register behind the read register of the memory.
    _behind: bool,
    _read: Word,
}

impl Ram {
    /// A memory of `depth` words of `fields` fields of `bits` bits.
    pub fn new(depth: usize, fields: usize, bits: usize) -> Self {
        Ram {
            clk: Default::default(),
            write: Wire::new(fields),
            write_address: Wire::new(count_bits(depth)),
            write_data: Wire::new(fields * bits),
            read: Default::default(),
            read_address: Wire::new(count_bits(depth)),
            read_data: Wire::new(fields * bits),
            _memory: vec![Word::default(); depth],
            _behind: false,
            _read: Word::default(),
        }
    }

    /// Adds an output register: `read_data` follows two cycles after `read_address`. The clock-to-output time of a
    /// block RAM leaves no room for logic behind it.
    pub fn registered(mut self) -> Self {
        self._behind = true;
        self
    }

    /// Omits the memory, for scenes that do not need it: `read_data` is zero.
    pub fn left_out(mut self) -> Self {
        self._memory.clear();
        self
    }
}

impl Logic for Ram {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            if self.read.val() {
                let address = self.read_address.val().number() as usize;
                let read = self._memory.get(address).copied().unwrap_or_default();
                self.read_data.next = if self._behind { self._read } else { read };
                self._read = read;
            }
            let bits = self.write_data.width() / self.write.width();
            if let Some(word) = self._memory.get_mut(self.write_address.val().number() as usize) {
                for field in 0..self.write.width() {
                    if self.write.val().field(field, 1) == 1 {
                        for at in (0..bits).step_by(64) {
                            let part = (bits - at).min(64);
                            let value = self.write_data.val().field(field * bits + at, part);
                            word.set(field * bits + at, part, value);
                        }
                    }
                }
            }
        }
    }

    fn connect(&mut self) {
        self.read_data.connect();
    }

    fn hdl(&self) -> Verilog {
        let fields = self.write.width();
        let bits = self.write_data.width() / fields;
        if self._memory.is_empty() {
            return Verilog::Custom(format!(
                "always @(*) read_data = {}'d0;\n\
                 wire unused = &{{1'b0, clk, write, write_address, write_data, read, read_address}};",
                self.read_data.width()
            ));
        }
        // One array per field: every synthesiser maps it to plain memories.
        Verilog::Custom(
            (0..fields)
                .map(|field| {
                    let enable = if fields == 1 { "write".to_string() } else { format!("write[{field}]") };
                    let place = format!("read_data[{field} * {bits} +: {bits}]");
                    let (declared, read) = match self._behind {
                        true => (
                            format!("reg [{}:0] read{field};\n", bits - 1),
                            format!("begin\n    read{field} <= field{field}[read_address];\n    {place} <= read{field};\n  end"),
                        ),
                        false => (String::new(), format!("{place} <= field{field}[read_address];")),
                    };
                    format!(
                        "\
reg [{end}:0] field{field} [0:{depth}];
{declared}always @(posedge clk) begin
  if ({enable}) field{field}[write_address] <= write_data[{field} * {bits} +: {bits}];
  if (read) {read}
end
",
                        end = bits - 1,
                        depth = self._memory.len() - 1,
                    )
                })
                .collect(),
        )
    }
}
