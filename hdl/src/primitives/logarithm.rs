//! Verilog of the table logarithm, shared by the two blocks that need one.
//!
//! A binary search finds the leading one: if the upper half of the word is zero, the lower half is moved up. Each
//! decision is a bit of the leading one's position, and the remaining bits start with the leading one. The search is
//! split into two functions with a register between them, because up to 64 bits need too many steps for one cycle. The
//! first function computes which nibbles are non-zero before it moves any, so that a decision does not wait for the
//! previous move.

use dermis_golden::fixed::formats::{LOG_FRACTION, LOG_TABLE_BITS};
use dermis_golden::fixed::search::log_table;

/// Bits of the integer part of a logarithm of an argument below 2^64.
pub const LENGTH_BITS: usize = 6;
/// Bits of a logarithm, [`LOG_FRACTION`] of them the fraction.
pub const LOG_BITS: usize = LENGTH_BITS + LOG_FRACTION as usize;
/// Halves that the second function tests, in bits.
const LAST: [usize; 2] = [2, 1];
/// Bits of a nibble, the unit that the first function tests for zero.
const NIBBLE: usize = 2 * LAST[0];
/// Bits that the second function needs: a nibble that holds the leading one, and the table index below it.
const REST_BITS: usize = NIBBLE + LOG_TABLE_BITS as usize;

/// Halves that the first function tests, in bits, for arguments of `bits` bits.
fn first_halves(bits: usize) -> Vec<usize> {
    let width = bits.next_power_of_two().max(2 * NIBBLE);
    (LAST.len()..LENGTH_BITS).rev().map(|k| 1 << k).filter(|half| 2 * half <= width).collect()
}

/// Bits of the register between the two functions, for arguments of `bits` bits.
pub fn located_bits(bits: usize) -> usize {
    first_halves(bits).len() + REST_BITS
}

/// Verilog functions `locate`, from an argument of `bits` bits to the word of [`located_bits`] in between, and
/// `logarithm`, from that word to the logarithm of [`LOG_BITS`]. The logarithm of 0 is that of 1.
pub fn functions(bits: usize) -> String {
    let halves = first_halves(bits);
    let width = 2 * halves[0];
    let located = located_bits(bits);
    let nibbles = width / NIBBLE;
    let used: String =
        (0..nibbles).map(|n| format!("    used[{n}] = |y[{}:{}];\n", (n + 1) * NIBBLE - 1, n * NIBBLE)).collect();
    // One step: store whether the upper `half` of the `bits` bits of `asked` is non-zero; if it is zero, move the lower
    // half up.
    let step = |name: &str, bit: usize, asked: &str, bits: usize, half: usize, moves: String| {
        let (high, low) = (bits - 1, bits - half);
        format!("    {name}[{bit}] = |{asked}[{high}:{low}];\n    if (!{name}[{bit}]) {moves}\n")
    };
    let head = halves.iter().enumerate().map(|(k, &half)| {
        let moved = half / NIBBLE;
        let moves = format!("begin\n      used = used << {moved};\n      y = y << {half};\n    end");
        step("locate", located - 1 - k, "used", nibbles, moved, moves)
    });
    let tail = LAST
        .iter()
        .enumerate()
        .map(|(k, &half)| step("place", LAST.len() - 1 - k, "y", REST_BITS, half, format!("y = y << {half};")));
    let (head, tail): (String, String) = (head.collect(), tail.collect());
    let cases: String = log_table()
        .iter()
        .enumerate()
        .map(|(m, value)| {
            format!(
                "      {LOG_TABLE_BITS}'d{m}: logarithm = {{{{{above}position}}, {LOG_FRACTION}'d{value}}};\n",
                above = match LENGTH_BITS - halves.len() - LAST.len() {
                    0 => String::new(),
                    more => format!("{more}'d0, "),
                }
            )
        })
        .collect();
    format!(
        "\
function [{located_end}:0] locate;
  input [{x_end}:0] x;
  reg [{y_end}:0] y;
  reg [{used_end}:0] used;
  begin
    y = {padded};
{used}{head}    locate[{rest_end}:0] = y[{y_end}:{y_rest}];
  end
endfunction
function [{log_end}:0] logarithm;
  input [{located_end}:0] located;
  reg [{rest_end}:0] y;
  reg [{place_end}:0] place;
  reg [{position_end}:0] position;
  begin
    y = located[{rest_end}:0];
{tail}    position = {{located[{located_end}:{rest}], place}};
    case (y[{slot_high}:{slot_low}])
{cases}    endcase
  end
endfunction
",
        located_end = located - 1,
        x_end = bits - 1,
        y_end = width - 1,
        used_end = nibbles - 1,
        place_end = LAST.len() - 1,
        padded = match width - bits {
            0 => "x".to_string(),
            more => format!("{{{more}'d0, x}}"),
        },
        rest = REST_BITS,
        rest_end = REST_BITS - 1,
        y_rest = width - REST_BITS,
        log_end = LOG_BITS - 1,
        position_end = halves.len() + LAST.len() - 1,
        slot_high = REST_BITS - 2,
        slot_low = REST_BITS - 1 - LOG_TABLE_BITS as usize,
    )
}
