//! CRC-32, one byte a cycle: the same step for what comes and for what goes.

/// Start of a CRC.
pub const START: u32 = u32::MAX;

/// The CRC register after one more byte; the CRC itself is its inverse.
pub fn step(crc: u32, data: u8) -> u32 {
    let shift = |crc: u32, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 };
    (0..8).fold(crc ^ u32::from(data), shift)
}

/// The same as a Verilog function `step`.
pub const FUNCTION: &str = "\
function [31:0] step(input [31:0] crc, input [7:0] octet);
  integer i;
  begin
    step = crc ^ {24'd0, octet};
    for (i = 0; i < 8; i = i + 1) step = step[0] ? {1'b0, step[31:1]} ^ 32'hedb88320 : {1'b0, step[31:1]};
  end
endfunction
";

#[cfg(test)]
mod tests {
    use super::*;
    use dermis_golden::link::CRC_RESIDUE;

    #[test]
    fn the_published_check_value_and_the_residue() {
        // CRC-32/ISO-HDLC of "123456789".
        let crc = !b"123456789".iter().fold(START, |crc, &data| step(crc, data));
        assert_eq!(crc, 0xcbf4_3926);
        let all = [b"123456789".as_slice(), &crc.to_le_bytes()].concat();
        assert_eq!(all.iter().fold(START, |crc, &data| step(crc, data)), CRC_RESIDUE);
    }
}
