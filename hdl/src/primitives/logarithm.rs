//! Verilog of the table logarithm, shared by the two blocks that need one.

use dermis_golden::fixed::formats::{LOG_FRACTION, LOG_TABLE_BITS};
use dermis_golden::fixed::search::log_table;

/// Bits of the integer part of a logarithm of an argument below 2^64.
pub const LENGTH_BITS: usize = 6;
/// Bits of a logarithm.
pub const LOG_BITS: usize = LENGTH_BITS + LOG_FRACTION as usize;

/// A function `name` from a vector of `bits` bits to {length − 1, slot}: the position of its leading one and the bits behind it.
/// Zero gives zero, as one does.
pub fn locate(name: &str, bits: usize) -> String {
    let slot = LOG_TABLE_BITS as usize;
    let cases: String = (0..bits)
        .map(|top| {
            // The slot's bits stand right below the leading one; short arguments are filled with zeros.
            let behind = match top.checked_sub(slot) {
                Some(low) => format!("x[{}:{low}]", top - 1),
                None if top == 0 => format!("{slot}'d0"),
                None => format!("{{x[{}:0], {}'d0}}", top - 1, slot - top),
            };
            format!("    if (x[{top}]) {name} = {{{LENGTH_BITS}'d{top}, {behind}}};\n")
        })
        .collect();
    format!(
        "\
function [{end}:0] {name};
  input [{x_end}:0] x;
  begin
    {name} = {all}'d0;
{cases}  end
endfunction
",
        end = LENGTH_BITS + slot - 1,
        all = LENGTH_BITS + slot,
        x_end = bits - 1,
    )
}

/// A function `name` from a slot to the fraction of the logarithm.
pub fn table(name: &str) -> String {
    let (slot, fraction) = (LOG_TABLE_BITS, LOG_FRACTION);
    let cases: String = log_table()
        .iter()
        .enumerate()
        .map(|(m, value)| format!("      {slot}'d{m}: {name} = {fraction}'d{value};\n"))
        .collect();
    format!(
        "\
function [{end}:0] {name};
  input [{slot_end}:0] slot;
  begin
    case (slot)
{cases}    endcase
  end
endfunction
",
        end = fraction - 1,
        slot_end = slot - 1,
    )
}
