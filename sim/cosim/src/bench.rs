//! The generated Verilog module `bench`: one instance of the design, with its pins and taps packed into two vectors, so
//! that the same C++ shim serves every design.
//!
//! | vector | bits | holds |
//! |---|---|---|
//! | `in` | 31:0 | `s_axis_tdata`, two's complement |
//! | | 32, 33, 34, 35 | `rst`, `s_axis_tvalid`, `s_axis_tlast`, `m_axis_tready` |
//! | | from 40 | `s_axis_tid`, of several arrays |
//! | `out` | 0, 1, 2 | `s_axis_tready`, `m_axis_tvalid`, `m_axis_tlast` |
//! | | from 8 | `m_axis_tid`, of several arrays |
//! | | 127:32 | `m_axis_tdata` = {fz, fy, fx} |
//! | | from 128 | per tap: one 32-bit word with valid in bit 0, then the data padded to 32-bit words |
//!
//! Taps are hierarchical references into the design: the synthesised Verilog contains no logic for them.

use std::fmt::Write as _;

use dermis_hdl::device::{Inputs, Outputs, Tap, TapSignal};

/// Hierarchical name of the design's instance.
pub(crate) const INSTANCE: &str = "bench.dut";
/// Positions of the numbers of arrays in `in` and `out`.
const TID_IN: usize = 40;
const TID_OUT: usize = 8;
/// Words of `out` before the first tap.
const PIN_WORDS: usize = 4;

/// Positions of a design's pins and taps in the packed vectors.
#[derive(Clone, Debug)]
pub struct Layout {
    input_bits: u32,
    /// Width of the number of an array; 0 of one array.
    array_bits: usize,
    taps: Vec<Tap>,
    /// First 32-bit word of each tap in `out`, and the length of `out`.
    offsets: Vec<usize>,
}

impl Layout {
    /// The layout of a design with codes of `input_bits` (1..=32), numbers of arrays of `array_bits` (0..=8) and the given taps.
    pub fn new(input_bits: u32, array_bits: usize, taps: &[Tap]) -> Self {
        let mut offsets = vec![PIN_WORDS];
        let mut end = PIN_WORDS;
        for tap in taps {
            end += 1 + tap.bits().div_ceil(32);
            offsets.push(end);
        }
        Layout { input_bits, array_bits, taps: taps.to_vec(), offsets }
    }

    /// The taps, in the order of [`Outputs::taps`].
    pub fn taps(&self) -> &[Tap] {
        &self.taps
    }

    /// Length of `out` in 32-bit words.
    pub fn out_words(&self) -> usize {
        self.offsets[self.taps.len()]
    }

    /// Verilog text of `bench` around an instance `dut` of module `top`.
    pub fn verilog(&self, top: &str) -> String {
        let array = match self.array_bits {
            0 => String::new(),
            bits => format!(
                "\n    .s_axis_tid(in[{}:{TID_IN}]), .m_axis_tid(out[{}:{TID_OUT}]),",
                TID_IN + bits - 1,
                TID_OUT + bits - 1
            ),
        };
        let mut text = format!(
            "// Test bench of {top}: pins and taps packed into two vectors. Generated, do not edit.\n\
             module bench(input wire clk, input wire [63:0] in, output wire [{out}:0] out);\n  \
             wire s_ready, m_valid, m_last;\n  wire [95:0] m_data;\n  {top} dut(\n    \
             .clk(clk), .rst(in[32]),\n    \
             .s_axis_tdata(in[{data}:0]), .s_axis_tvalid(in[33]), .s_axis_tready(s_ready), .s_axis_tlast(in[34]),\n    \
             .m_axis_tdata(m_data), .m_axis_tvalid(m_valid), .m_axis_tready(in[35]),{array} .m_axis_tlast(m_last));\n  \
             assign out[127:32] = m_data;\n  assign out[2:0] = {{m_last, m_valid, s_ready}};\n{rest}",
            out = 32 * self.out_words() - 1,
            data = self.input_bits - 1,
            rest = unused(3, TID_OUT) + &unused(TID_OUT + self.array_bits, 32),
        );
        for (index, tap) in self.taps.iter().enumerate() {
            let bits = tap.bits();
            let (first, last) = (32 * self.offsets[index], 32 * self.offsets[index + 1] - 1);
            let padding = last - first + 1 - 32 - bits;
            let zeros = if padding == 0 { String::new() } else { format!("{padding}'d0, ") };
            // Writing to a String cannot fail.
            let _ = writeln!(
                text,
                "  // tap {name}: {fields} fields of {width} bits\n  \
                 wire tap{index}_valid = {valid};\n  wire [{top_bit}:0] tap{index}_data = {data};\n  \
                 assign out[{last}:{first}] = {{{zeros}tap{index}_data, 31'd0, tap{index}_valid}};",
                name = tap.name,
                fields = tap.fields.len(),
                width = tap.field_bits,
                valid = valid(tap, "dut"),
                data = word(tap, "dut"),
                top_bit = bits - 1,
            );
        }
        text.push_str("endmodule\n");
        text
    }

    /// Packs one cycle's inputs.
    pub fn pack(&self, inputs: &Inputs) -> u64 {
        let mask = u64::MAX >> (64 - self.input_bits);
        (inputs.s_data as i64 as u64 & mask)
            | u64::from(inputs.rst) << 32
            | u64::from(inputs.s_valid) << 33
            | u64::from(inputs.s_last) << 34
            | u64::from(inputs.m_ready) << 35
            | (inputs.s_array as u64) << TID_IN
    }

    /// Unpacks one cycle's outputs from [`Layout::out_words`] words.
    pub fn unpack(&self, words: &[u32]) -> Outputs {
        let taps = self.taps.iter().zip(&self.offsets).map(|(tap, &offset)| {
            (words[offset] & 1 == 1).then(|| {
                let data = &words[offset + 1..];
                (0..tap.fields.len()).map(|i| field(data, i * tap.field_bits as usize, tap.field_bits)).collect()
            })
        });
        Outputs {
            s_ready: words[0] & 1 == 1,
            m_valid: words[0] >> 1 & 1 == 1,
            m_last: words[0] >> 2 & 1 == 1,
            m_array: (words[0] >> TID_OUT) as usize & ((1 << self.array_bits) - 1),
            m_data: [words[1] as i32, words[2] as i32, words[3] as i32],
            taps: taps.collect(),
        }
    }
}

/// Verilog that drives bits `low` to below `end` of `out` low.
fn unused(low: usize, end: usize) -> String {
    format!("  assign out[{}:{low}] = {}'d0;\n", end - 1, end - low)
}

/// Verilog expression that is 1 in a cycle in which a word of `tap` passes, for an instance of the design.
pub fn valid(tap: &Tap, instance: &str) -> String {
    let signals: Vec<String> = tap.valid.iter().map(|name| format!("{instance}.{name}")).collect();
    signals.join(" && ")
}

/// Verilog expression of the word of `tap`, field 0 in the least significant bits, for an instance of the design.
pub fn word(tap: &Tap, instance: &str) -> String {
    let bits = tap.bits() / tap.word.len();
    let extended = |TapSignal { name, bits: own, signed }: &TapSignal| match (bits - *own as usize, signed) {
        (0, _) => format!("{instance}.{name}"),
        (more, false) => format!("{more}'d0, {instance}.{name}"),
        (more, true) => format!("{{{more}{{{instance}.{name}[{}]}}}}, {instance}.{name}", own - 1),
    };
    let signals: Vec<String> = tap.word.iter().rev().map(extended).collect();
    format!("{{{}}}", signals.join(", "))
}

/// The signed field of `bits` (1..=64) at bit `start` of little-endian 32-bit words.
fn field(words: &[u32], start: usize, bits: u32) -> i64 {
    let word = |index: usize| u128::from(words.get(index).copied().unwrap_or(0));
    let first = start / 32;
    // 31 bits of offset and 64 bits of field span at most three words.
    let window = word(first) | word(first + 1) << 32 | word(first + 2) << 64;
    let raw = (window >> (start % 32)) as u64;
    ((raw << (64 - bits)) as i64) >> (64 - bits)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tap(name: &'static str, fields: usize, field_bits: u32) -> Tap {
        let word = vec![TapSignal { name: "d".into(), bits: fields as u32 * field_bits, signed: true }];
        Tap { name, valid: vec!["v".into()], word, fields: vec!["f"; fields], field_bits }
    }

    #[test]
    fn signals_are_extended_to_their_fields() {
        assert_eq!(word(&tap("a", 4, 20), "dut"), "{dut.d}");
        let signal = |name: &str, bits, signed| TapSignal { name: name.into(), bits, signed };
        let word_of = vec![signal("x", 11, true), signal("y", 32, true), signal("taken", 1, false)];
        let valid_of = vec!["m__valid".into(), "l__folding".into()];
        let tap = Tap { name: "a", valid: valid_of, word: word_of, fields: vec!["x", "y", "z"], field_bits: 32 };
        assert_eq!(valid(&tap, "dut"), "dut.m__valid && dut.l__folding");
        assert_eq!(word(&tap, "dut"), "{31'd0, dut.taken, dut.y, {21{dut.x[10]}}, dut.x}");
    }

    #[test]
    fn fields_across_word_borders_are_sign_extended() {
        // Field 0 = -2 in 33 bits, field 1 = 5: bits 0..=32 hold 0x1_ffff_fffe, bits 33.. hold 5.
        let words = [0xffff_fffe, 1 | 5 << 1, 0];
        assert_eq!(field(&words, 0, 33), -2);
        assert_eq!(field(&words, 33, 33), 5);
        assert_eq!(field(&[0, 0x8000_0000], 0, 64), i64::MIN);
    }

    #[test]
    fn pins_and_taps_unpack_where_the_layout_says() {
        let layout = Layout::new(20, 0, &[tap("a", 3, 18), tap("b", 1, 64)]);
        // 54 bits need two words, 64 bits two: 4 + 3 + 3.
        assert_eq!(layout.out_words(), 10);
        let words = [0b110, 1, u32::MAX, 3, 1, 7 | 9 << 18, 0, 0, 1, 2];
        let outputs = layout.unpack(&words);
        assert_eq!((outputs.s_ready, outputs.m_valid, outputs.m_last), (false, true, true));
        assert_eq!(outputs.m_data, [1, -1, 3]);
        assert_eq!(outputs.taps, vec![Some(vec![7, 9, 0]), None]);
    }

    #[test]
    fn negative_codes_keep_to_their_bits() {
        let inputs = Inputs { s_data: -1, s_valid: true, ..Inputs::default() };
        assert_eq!(Layout::new(20, 0, &[]).pack(&inputs), 0xf_ffff | 1 << 33);
    }
}
