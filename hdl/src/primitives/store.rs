//! Search memory: every taxel's polynomial, about up to three centres.

use rust_hdl::prelude::*;

use super::counter::count_bits;
use super::polynomial_word::{resize, PolynomialWord};
use super::sweep::{BUFFERS, BUFFER_BITS, START};
use crate::wire::{Wire, Word};

/// Buffers of quads of polynomials. `fill` writes one coefficient of a quad into buffer `START`; `write` writes a whole
/// quad into one of the others. Both take effect one cycle later, through registers beside the memory. `read_data`
/// follows its address by two cycles: the read register of the memory and an output register.
///
/// Where one subarray is filled while another is searched, `START` is a memory of its own; otherwise it is another name
/// of buffer 0, and `fill` and `write` never coincide.
///
/// Read-during-write data is undefined and unused: a sweep writes quads that it read several cycles earlier, or a
/// buffer that is not being read. So block RAM needs no bypass. In simulation such a read returns the complement of the
/// old content, so that using it would show as an error.
#[derive(LogicBlock)]
pub struct Store {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Write coefficient `fill_index` of quad `fill_address` of buffer `START`.
    pub fill: Signal<In, Bit>,
    /// Index of the coefficient; valid with `fill`.
    pub fill_index: Wire<In>,
    /// Address of the quad; valid with `fill`.
    pub fill_address: Wire<In>,
    /// The coefficient of four taxels, signed; valid with `fill`.
    pub fill_quad: Wire<In>,
    /// Write `write_data` to quad `write_address`.
    pub write: Signal<In, Bit>,
    /// Buffer to write; valid one cycle before `write`.
    pub write_buffer: Wire<In>,
    /// Address of the quad; valid with `write`.
    pub write_address: Wire<In>,
    /// A quad of polynomials; valid with `write`.
    pub write_data: Wire<In>,
    /// Buffer to read; valid with `read_address`.
    pub read_buffer: Wire<In>,
    /// Address of the quad to read: 0 in the cycle after `begins`, then one more after each cycle with `counts`.
    pub read_address: Wire<In>,
    /// A buffer is read from the next cycle on; loads `next_base` into the read addresses.
    pub begins: Signal<In, Bit>,
    /// The read addresses step to the next quad.
    pub counts: Signal<In, Bit>,
    /// First address of that buffer in the memory (`base`); valid with `begins`.
    pub next_base: Wire<In>,
    /// A quad of polynomials, [`LATENCY`] cycles after `read_address`.
    pub read_data: Wire<Out>,
    _layout: PolynomialWord,
    _quads: usize,
    _apart: bool,
    _memory: Vec<Vec<Word>>,
    _read: Word,
    _write_buffer: Word,
    _asked: [Option<Write>; 2],
}

/// A pending write: one coefficient of four taxels, or all of them.
#[derive(Clone, Copy, Debug)]
struct Write {
    /// Index of the memory, address of the quad.
    place: (usize, usize),
    coefficient: Option<usize>,
    data: Word,
}

/// Cycles from `read_address` to `read_data`.
pub const LATENCY: usize = 2;

/// First address of `buffer` in the memory, where buffers of `quads` quads follow each other without gaps.
pub fn base(buffer: usize, quads: usize) -> usize {
    (buffer % BUFFERS) * quads
}

/// Verilog expression of [`base`], where signal `buffer` holds the number of the buffer.
pub fn base_of(buffer: &str, quads: usize) -> String {
    let bits = base_bits(quads);
    let choices: String = (1..BUFFERS).map(|b| format!("{buffer} == 2'd{b} ? {bits}'d{} : ", base(b, quads))).collect();
    format!("{choices}{bits}'d0")
}

/// Width of an address in that memory, in bits.
pub fn base_bits(quads: usize) -> usize {
    count_bits(BUFFERS * quads)
}

impl Store {
    /// `quads` quads of polynomials in `layout`, filled with coefficients of `fill_bits` bits; `apart` says whether
    /// one subarray is filled while another is searched.
    pub fn new(layout: PolynomialWord, quads: usize, fill_bits: usize, apart: bool) -> Self {
        let address = count_bits(quads);
        Store {
            clk: Default::default(),
            fill: Default::default(),
            fill_index: Wire::new(count_bits(layout.widths.len())),
            fill_address: Wire::new(address),
            fill_quad: Wire::new(4 * fill_bits),
            write: Default::default(),
            write_buffer: Wire::new(BUFFER_BITS),
            write_address: Wire::new(address),
            write_data: Wire::new(layout.bits()),
            read_buffer: Wire::new(BUFFER_BITS),
            read_address: Wire::new(address),
            begins: Default::default(),
            counts: Default::default(),
            next_base: Wire::new(base_bits(quads)),
            read_data: Wire::new(layout.bits()),
            _quads: quads,
            _apart: apart,
            _memory: vec![vec![Word::default(); quads]; BUFFERS + usize::from(apart)],
            _read: Word::default(),
            _write_buffer: Word::default(),
            _asked: [None; 2],
            _layout: layout,
        }
    }

    /// Index of the memory that holds `buffer`.
    fn memory(&self, buffer: Word) -> usize {
        let buffer = buffer.number() as usize;
        if buffer == START && !self._apart {
            0
        } else {
            buffer
        }
    }

    fn put(&mut self, Write { place, coefficient, data }: Write) {
        let Some(word) = self._memory[place.0].get_mut(place.1) else { return };
        let Some(k) = coefficient else {
            *word = data;
            return;
        };
        let bits = self.fill_quad.width() / 4;
        if let Some(&width) = self._layout.widths.get(k) {
            for lane in 0..4 {
                word.set(self._layout.offset(k) + lane * width, width, data.signed(lane, bits) as u64);
            }
        }
    }
}

impl Logic for Store {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let (read_buffer, read_address) = (self.memory(self.read_buffer.val()), self.read_address.val());
            let place = (read_buffer, read_address.number() as usize);
            let read = self._memory[place.0].get(place.1).copied().unwrap_or_default();
            let asked = std::mem::take(&mut self._asked);
            let collides = asked.iter().flatten().any(|write| write.place == place);
            self.read_data.next = self._read;
            self._read = if collides { read.complement(self._layout.bits()) } else { read };
            asked.into_iter().flatten().for_each(|write| self.put(write));
            if self.write.val() {
                let place = (self.memory(self._write_buffer), self.write_address.val().number() as usize);
                self._asked[0] = Some(Write { place, coefficient: None, data: self.write_data.val() });
            }
            self._write_buffer = self.write_buffer.val();
            if self.fill.val() {
                let place = (self.memory(Word::from(START as u64)), self.fill_address.val().number() as usize);
                let coefficient = Some(self.fill_index.val().number() as usize);
                self._asked[1] = Some(Write { place, coefficient, data: self.fill_quad.val() });
            }
        }
    }

    fn connect(&mut self) {
        self.read_data.connect();
    }

    fn hdl(&self) -> Verilog {
        let bits = self.fill_quad.width() / 4;
        let index_bits = self.fill_index.width();
        let lanes: String = (0..4)
            .map(|lane| format!("wire [{}:0] t{lane} = fill_quad[{} +: {bits}];\n", bits - 1, lane * bits))
            .collect();
        let depth = BUFFERS * self._quads;
        let address_bits = base_bits(self._quads);
        let pad = match address_bits - self.read_address.width() {
            0 => String::new(),
            more => format!("{more}'d0, "),
        };
        let end = address_bits - 1;
        let to_buffer = format!(
            "\
reg [{end}:0] write_base;
always @(posedge clk) write_base <= {write_base};
wire [{end}:0] to_buffer = write_base + {{{pad}write_address}};
",
            write_base = base_of("write_buffer", self._quads),
        );
        let write_to = match self._apart {
            true => "to_buffer".to_string(),
            false => format!("fill ? {{{pad}fill_address}} : to_buffer"),
        };
        let memories: String = (0..self._layout.widths.len())
            .map(|k| {
                let (width, low) = (self._layout.widths[k], self._layout.offset(k));
                let all = 4 * width;
                let filled: Vec<String> = (0..4).rev().map(|lane| resize(&format!("t{lane}"), bits, width)).collect();
                let filled = filled.join(", ");
                let declare = format!(
                    "\
reg [{all_end}:0] memory{k} [0:{depth_end}];
reg [{end}:0] from{k};
(* keep *) always @(posedge clk) begin
  if (begins) from{k} <= next_base;
  else if (counts) from{k} <= from{k} + {address_bits}'d1;
end
",
                    all_end = all - 1,
                    depth_end = depth - 1,
                );
                let fills = format!("fill_index == {index_bits}'d{k}");
                let whole = format!("write_data[{low} +: {all}]");
                let (asks, data, start, read) = match self._apart {
                    true => {
                        let fill = [&format!("fill && {fills}"), "fill_address", &format!("{{{filled}}}")];
                        let start = format!(
                            "\
reg [{end}:0] start{k} [0:{last}];
reg [{end}:0] read_start{k};
{port}always @(posedge clk) read_start{k} <= start{k}[read_address];
",
                            end = all - 1,
                            last = self._quads - 1,
                            port = write_port(&format!("start{k}"), fill, [self.fill_address.width(), all]),
                        );
                        ("write".to_string(), whole, start, format!("from_start ? read_start{k} : read{k}"))
                    }
                    false => (
                        format!("fill ? {fills} : write"),
                        format!("fill ? {{{filled}}} : {whole}"),
                        String::new(),
                        format!("read{k}"),
                    ),
                };
                let port = write_port(&format!("memory{k}"), [&asks, "write_to", &data], [address_bits, all]);
                format!(
                    "\
{declare}{start}{port}reg [{end}:0] read{k};
always @(posedge clk) begin
  read{k} <= memory{k}[from{k}];
  read_data[{low} +: {all}] <= {read};
end
",
                    end = all - 1,
                )
            })
            .collect();
        let from_start = match self._apart {
            true => format!("reg from_start;\nalways @(posedge clk) from_start <= read_buffer == 2'd{START};\n"),
            false => "wire unused_read = &{1'b0, read_buffer, read_address};\n".to_string(),
        };
        Verilog::Custom(format!(
            "{lanes}{to_buffer}wire [{end}:0] write_to = {write_to};
// Read and write addresses are registers of each coefficient, because the memories are placed far apart; the attribute
// keeps synthesis from merging them.
{from_start}{memories}",
        ))
    }
}

/// Verilog of a registered write port: `data` goes to address `to` of `memory` one cycle after `asks`. The last
/// argument gives the widths of `to` and `data`.
fn write_port(memory: &str, [asks, to, data]: [&str; 3], [to_bits, data_bits]: [usize; 2]) -> String {
    format!(
        "\
reg {memory}_writes;
reg [{to_end}:0] {memory}_to;
reg [{data_end}:0] {memory}_data;
(* keep *) always @(posedge clk) begin
  {memory}_writes <= {asks};
  {memory}_to <= {to};
end
always @(posedge clk) begin
  {memory}_data <= {data};
  if ({memory}_writes) {memory}[{memory}_to] <= {memory}_data;
end
",
        to_end = to_bits - 1,
        data_end = data_bits - 1,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::settles;

    const BITS: usize = 5;

    fn store() -> Store {
        let mut store = Store::new(PolynomialWord { lanes: 4, widths: vec![BITS] }, 3, BITS, false);
        store.connect_all();
        store
    }

    fn clock(store: &mut Store) {
        for level in [false, true] {
            store.clk.next = level.into();
            assert!(settles(store));
        }
    }

    /// Writes `data` to quad 1 of buffer 0 and reads quad `at`, `late` cycles after `write`.
    fn read(store: &mut Store, data: u64, at: u64, late: usize) -> u64 {
        store.write_data.next = Word::from(data);
        store.write_address.next = Word::from(1);
        for cycle in 0..late + LATENCY {
            store.write.next = cycle == 0;
            // Reads another quad in all cycles but the tested one.
            store.read_address.next = Word::from(if cycle == late { at } else { 2 });
            clock(store);
        }
        store.read_data.val().field(0, 4 * BITS)
    }

    #[test]
    fn what_is_read_where_and_when_it_is_written_is_the_complement() {
        let mut store = store();
        assert_eq!(read(&mut store, 0x12345, 1, 2), 0x12345);
        // The write takes effect one cycle after `write`.
        assert_eq!(read(&mut store, 0xabcde, 1, 1), !0x12345 & 0xfffff);
        assert_eq!(read(&mut store, 0x00001, 1, 0), 0xabcde);
        assert_eq!(read(&mut store, 0x00002, 0, 1), 0);
    }
}
