//! Codes and beats as bytes.

use super::payload::Beat;

/// Bytes of a beat.
pub const BEAT_BYTES: usize = Beat::BYTES;

/// Bytes of a code of `bits` bits: the smallest whole number.
pub fn code_bytes(bits: u32) -> usize {
    bits.div_ceil(8) as usize
}

/// A frame's payload: codes of `bits` bits, little-endian two's complement.
pub fn codes_to_bytes(codes: &[i32], bits: u32) -> Vec<u8> {
    codes.iter().flat_map(|code| code.to_le_bytes().into_iter().take(code_bytes(bits))).collect()
}

/// Reads codes of `bits` bits back as the board does: what is above them is ignored. `None` where a code is cut off.
pub fn codes_of_bytes(bytes: &[u8], bits: u32) -> Option<Vec<i32>> {
    let chunks = bytes.chunks_exact(code_bytes(bits));
    let code = |chunk: &[u8]| {
        let raw = chunk.iter().rev().fold(0u32, |raw, &byte| raw << 8 | u32::from(byte));
        (raw << (32 - bits)) as i32 >> (32 - bits)
    };
    chunks.remainder().is_empty().then(|| chunks.map(code).collect())
}

/// Reads beats; `None` where one is cut off.
pub fn beats_of_bytes(bytes: &[u8]) -> Option<Vec<[i32; 3]>> {
    bytes.chunks(BEAT_BYTES).map(|chunk| Beat::of_bytes(chunk).map(|beat| [beat.fx, beat.fy, beat.fz])).collect()
}
