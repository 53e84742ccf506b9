//! Testbench of the generated engine, for an integrator to read and to run in any simulator of SystemVerilog.
//!
//! ```text
//! <top>_tb_codes.hex ──> <top> ──> compared with <top>_tb_beats.hex, from the bit-true model
//! ```
//! One reconstruction at full speed; the status beats hold the cycle count, which is then equal too. Before it the sums of the core's
//! own memory files are compared: a frame does not read all of them, and simulators go on without one that is missing.

use dermis_golden::fixed::{Model, Plan};

use crate::language::memory_file;
use crate::manifest::GeneratedFile;
use crate::primitives::Arrays;

/// Cycles per cycle of the model after which the testbench gives up.
const PATIENCE: u64 = 4;
/// Cycles that the testbench waits at least, beside the beats of the input.
const LEAST_CYCLES: u64 = 10_000;

/// Ending of the testbench's module and files, behind the top module's name.
pub(crate) const SUFFIX: &str = "_tb";

/// What a testbench sends and expects.
pub(crate) struct Reconstruction {
    /// Codes of one reconstruction, frame after frame, row-major.
    pub codes: Vec<i32>,
    /// Beats of the engine: forces, then status.
    pub beats: Vec<[i32; 3]>,
    /// Cycles after which the testbench gives up.
    pub patience: u64,
}

/// The reconstruction of the testbenches of `model`, of array `array`.
pub(crate) fn reconstruction(model: &Model, array: usize) -> Reconstruction {
    let codes = codes(model);
    let own = Plan::of_array(model, array);
    let trace = model.variant(own).run(&codes);
    let beats = trace.beats.iter().chain(&trace.status).copied().collect();
    let patience = LEAST_CYCLES + PATIENCE * (codes.len() as u64 + trace.cycles.total);
    Reconstruction { codes, beats, patience }
}

/// The testbench and its two memory files; `files` are those of the hardware.
pub(crate) fn testbench(model: &Model, top: &str, files: &[GeneratedFile]) -> Vec<GeneratedFile> {
    let Arrays { bits: array_bits } = Arrays::of_model(model);
    // The last array, so that a memory without the tables of the others is found.
    let array = Arrays::of_model(model).count() - 1;
    let Reconstruction { codes, beats, patience } = reconstruction(model, array);
    let bits = model.stream_bits();
    let mask = (1i64 << bits) - 1;
    let digits = bits.div_ceil(4) as usize;
    let code_lines: String = codes.iter().map(|&code| format!("{:0digits$x}\n", i64::from(code) & mask)).collect();
    let beat_lines: String = beats.iter().map(|[fx, fy, fz]| format!("{fz:08x}{fy:08x}{fx:08x}\n")).collect();
    let file = |ending: &str, text: String| GeneratedFile { name: format!("{top}{SUFFIX}{ending}"), text };
    let opening = Opening {
        command: format!("dermis build {}", model.scene.name),
        does: "Sends the codes of one reconstruction at full speed and compares every beat with the bit-true model.",
        unit: "beats",
        widths: [bits as usize, 96],
        counts: [codes.len(), beats.len()],
        patience,
    };
    let text = opening.text(model, top, files) + &text(top, (array_bits > 0).then(|| format!("{array_bits}'d{array}")));
    vec![file(".sv", text), file("_codes.hex", code_lines), file("_beats.hex", beat_lines)]
}

/// The codes of one reconstruction: a paraboloid over the array, half of the full scale at its top.
fn codes(model: &Model) -> Vec<i32> {
    let sensor = &model.scene.sensor;
    let half = i64::from(i32::MAX >> (32 - model.formats().code_bits)) / 2;
    let over = |at: usize, count: usize| {
        let (from_middle, count) = (2 * at as i64 + 1 - count as i64, count as i64);
        // At most count², 0 beyond the edge.
        count * count - from_middle * from_middle
    };
    let scale = (sensor.rows * sensor.rows * sensor.cols * sensor.cols) as i64;
    let frame: Vec<i32> = (0..sensor.taxels())
        .map(|taxel| {
            let (row, col) = (taxel / sensor.cols, taxel % sensor.cols);
            (half * over(row, sensor.rows) * over(col, sensor.cols) / scale) as i32
        })
        .collect();
    frame.repeat(model.scene.input.frames_per_result())
}

/// How a testbench begins: its memories and counters.
pub(crate) struct Opening {
    /// The command that generates it.
    pub command: String,
    /// What it does, a sentence.
    pub does: &'static str,
    /// Name of what is compared, in the plural.
    pub unit: &'static str,
    /// Bits of a code, and of what is compared.
    pub widths: [usize; 2],
    /// How many codes are sent, and how many units compared.
    pub counts: [usize; 2],
    /// Cycles after which it gives up.
    pub patience: u64,
}

impl Opening {
    /// The beginning of the testbench of `top`, whose files are `files`, up to its counters.
    pub fn text(&self, model: &Model, top: &str, files: &[GeneratedFile]) -> String {
        let Opening { command, does, unit, widths: [code_bits, bits], counts: [codes, units], patience } = self;
        format!(
            "\
// {top}{SUFFIX}: testbench of {top}.
//
// Generated by `{command}`; do not edit, build it again.
//
// {does}
// Prints PASS, or ends with an error. The memory files are read from the folder in which the simulator runs.
`timescale 1ns / 1ps
module {top}{SUFFIX};
  localparam CODES = {codes};
  localparam TAXELS = {taxels};
  localparam {upper} = {units};
  localparam PATIENCE = {patience};

  reg clk = 1'b0;
  always #5 clk = !clk;

  reg [{code_end}:0] codes [0:CODES-1];
  reg [{end}:0] expected [0:{upper}-1];
  initial begin
    $readmemh(\"{top}{SUFFIX}_codes.hex\", codes);
    $readmemh(\"{top}{SUFFIX}_{unit}.hex\", expected);
  end
{memories}

  integer cycle = 0;
  integer sent = 0;
  integer received = 0;
",
            taxels = model.scene.sensor.taxels(),
            memories = memory_checks(top, files),
            upper = unit.to_uppercase(),
            code_end = code_bits - 1,
            end = bits - 1,
        )
    }
}

/// Prime of the hash FNV-1a of 32 bits.
const FNV_PRIME: u32 = 16_777_619;
/// Bits of the part of a word that is hashed at once, and its hexadecimal digits.
const PART_BITS: usize = 32;
const PART_DIGITS: usize = PART_BITS / 4;

/// Parts of a word of so many hexadecimal digits.
fn parts(digits: usize) -> usize {
    digits.div_ceil(PART_DIGITS)
}

/// Hash of the words of a memory file: FNV-1a over their parts, the lowest of a word first, from 0.
fn memory_sum(text: &str) -> u32 {
    let part =
        |digits: &[u8]| digits.iter().fold(0, |all, digit| all << 4 | (*digit as char).to_digit(16).unwrap_or(0));
    let of_line = |line: &'_ str| line.as_bytes().rchunks(PART_DIGITS).map(part).collect::<Vec<u32>>();
    text.lines().flat_map(of_line).fold(0, |sum: u32, part| (sum ^ part).wrapping_mul(FNV_PRIME))
}

/// Processes that compare the hash of each memory file of `top` with that of the file that was generated; a word that is missing is
/// undefined or zero.
fn memory_checks(top: &str, files: &[GeneratedFile]) -> String {
    let memories = files.iter().filter(|file| file.name.starts_with(&memory_file(top, "")));
    let check = |(index, GeneratedFile { name, text }): (usize, &GeneratedFile)| {
        let words = text.lines().count();
        let bits = PART_BITS * parts(text.lines().next().map_or(1, str::len));
        format!(
            "\
  initial begin : memory_{index}
    reg [{end}:0] words [0:{last}];
    reg [31:0] sum;
    integer word, low;
    $readmemh(\"{name}\", words);
    sum = 32'd0;
    for (word = 0; word < {words}; word = word + 1)
      for (low = 0; low < {bits}; low = low + {PART_BITS}) sum = (sum ^ words[word][low +: {PART_BITS}]) * 32'd{FNV_PRIME};
    if (sum !== 32'h{sum:08x}) $fatal(1, \"{name}: missing, or not the file of this core\");
  end
",
            end = bits - 1,
            last = words - 1,
            sum = memory_sum(text),
        )
    };
    memories.enumerate().map(check).collect()
}

/// The module after its opening; `array` is the number of the array whose codes are sent, where there are several.
fn text(top: &str, array: Option<String>) -> String {
    let port = |port: &str| array.as_ref().map_or(String::new(), |array| port.replace("ARRAY", array));
    let [wire, input, output, check] = [
        "  wire [$bits(ARRAY)-1:0] m_array;\n",
        "    .s_axis_tid(ARRAY),\n",
        "    .m_axis_tid(m_array),\n",
        "      if (m_array !== ARRAY) $fatal(1, \"beat %0d: m_axis_tid is %0d\", received, m_array);\n",
    ]
    .map(port);
    format!(
        "
  wire rst = cycle < 2;
  wire s_valid = !rst && sent < CODES;
  wire s_ready;
  wire m_valid, m_last;
  wire [95:0] m_data;
{wire}
  {top} engine (
    .clk(clk),
    .rst(rst),
    .s_axis_tdata(codes[s_valid ? sent : 0]),
{input}    .s_axis_tvalid(s_valid),
    .s_axis_tready(s_ready),
    .s_axis_tlast(s_valid && sent % TAXELS == TAXELS - 1),
    .m_axis_tdata(m_data),
{output}    .m_axis_tvalid(m_valid),
    .m_axis_tready(1'b1),
    .m_axis_tlast(m_last)
  );

  always @(posedge clk) begin
    cycle <= cycle + 1;
    if (s_valid && s_ready) sent <= sent + 1;
    if (!rst && m_valid) begin
      if (m_data !== expected[received]) $fatal(1, \"beat %0d is %h, expected %h\", received, m_data, expected[received]);
      if (m_last !== (received == BEATS - 1)) $fatal(1, \"beat %0d: m_axis_tlast is %b\", received, m_last);
{check}      received <= received + 1;
      if (received == BEATS - 1) begin
        $display(\"PASS: %0d codes, %0d beats, %0d cycles\", CODES, BEATS, cycle);
        $finish;
      end
    end
    if (cycle > PATIENCE) $fatal(1, \"%0d of %0d beats after %0d cycles\", received, BEATS, cycle);
  end
endmodule
"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use dermis_golden::spec::scene::Scene;

    #[test]
    fn the_codes_are_those_of_whole_frames_within_their_width() {
        let mut scene = Scene::builtin("eight-by-eight").unwrap();
        (scene.input.average, scene.input.full_scale_MPa) = (1, Some(1.0));
        let model = Model::new(&scene).unwrap();
        let codes = codes(&model);
        assert_eq!((codes.len(), codes[..64] == codes[64..]), (128, true));
        let largest = 1 << (model.formats().code_bits - 2);
        assert!(codes.iter().all(|&code| (1..largest).contains(&code)), "{codes:?}");
        let files = testbench(&model, "dermis_a", &[]);
        assert_eq!(files[1].text.lines().count(), 128);
        assert_eq!(files[2].text.lines().next().map(str::len), Some(24));
    }

    #[test]
    fn the_sum_of_a_memory_file_is_that_of_its_words() {
        // A word of 36 bits has two parts, the lower first.
        let of = |parts: &[u32]| parts.iter().fold(0, |sum: u32, part| (sum ^ part).wrapping_mul(FNV_PRIME));
        assert_eq!(memory_sum("f12345678\n000000001\n"), of(&[0x1234_5678, 0xf, 1, 0]));
        assert_ne!(memory_sum("1\n2\n"), memory_sum("2\n1\n"));
    }
}
