//! Codes and beats as bytes of a payload.

use super::payload::Beat;

/// Bytes of a beat.
pub const BEAT_BYTES: usize = Beat::BYTES;

/// Bytes of a code of `bits` bits, rounded up.
pub fn code_bytes(bits: u32) -> usize {
    bits.div_ceil(8) as usize
}

/// The payload of a frame: codes of `bits` bits, little-endian two's complement.
pub fn codes_to_bytes(codes: &[i32], bits: u32) -> Vec<u8> {
    codes.iter().flat_map(|code| code.to_le_bytes().into_iter().take(code_bytes(bits))).collect()
}

/// Reads codes of `bits` bits as the board does, ignoring higher bits; `None` if the last code is incomplete.
pub fn codes_of_bytes(bytes: &[u8], bits: u32) -> Option<Vec<i32>> {
    let chunks = bytes.chunks_exact(code_bytes(bits));
    let code = |chunk: &[u8]| {
        let raw = chunk.iter().rev().fold(0u32, |raw, &byte| raw << 8 | u32::from(byte));
        (raw << (32 - bits)) as i32 >> (32 - bits)
    };
    chunks.remainder().is_empty().then(|| chunks.map(code).collect())
}

/// Reads beats `[fx, fy, fz]`; `None` if the last one is incomplete.
pub fn beats_of_bytes(bytes: &[u8]) -> Option<Vec<[i32; 3]>> {
    bytes.chunks(BEAT_BYTES).map(|chunk| Beat::of_bytes(chunk).map(|beat| [beat.fx, beat.fy, beat.fz])).collect()
}
