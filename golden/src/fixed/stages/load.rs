//! Stage `load`, before `prepare`: tables of a specimen, which come on the input stream in the place of frames.
//!
//! An image is a list of words of [`WORD_BYTES`] bytes, the lowest first. Its last four bytes are the CRC-32 of all others.
//!
//! | word | lower bits | upper bits |
//! |---|---|---|
//! | 0 | layout, 32 bits: [`Plan::table_layout`](crate::fixed::Plan::table_layout) | [`MAGIC`], 16 bits |
//! | 1 | threshold in force LSBs, 32 bits | version, 15 bits |
//! | 2 | noise floor in codes, unsigned, `input_bits` − 1 | 0 |
//! | 3 … | zero of a taxel, `code_bits` signed | its gain, 18 bits signed ([`prepare`](super::prepare)); 0 for a dead one |
//! | then … | coefficient of a lane, 18 bits signed | that of the next lane, 18 bits signed |
//! | last | 0, 16 bits | CRC-32 |
//!
//! Coefficients are there if [`TableRange`](crate::spec::scene::TableRange) has some: word after word of their memory, in each two
//! lanes at a time.
//!
//! One byte is a beat, which is no code: its top bit differs from the next ([`beats`]). The image's last has `tlast`.
//! The stage takes an image when all frames before it have been sent. Word 0 is compared before anything is written. From then
//! on until the CRC the tables are not whole: every stress is 0, and the status says why. An image that is refused leaves
//! what was there, if its word 0 is wrong or it comes between the codes of a frame, else tables that are not whole. After an image the engine is as after a reset.

use super::prepare::GAIN_BITS;
use crate::fixed::words::formats::MULTIPLIER_BITS;

/// Bytes of a word.
pub const WORD_BYTES: usize = 6;
/// In word 0: the letters DT, the first in the low byte.
pub const MAGIC: u16 = u16::from_le_bytes(*b"DT");
/// Width of a version: 0 is that of the tables in the bitstream.
pub const VERSION_BITS: u32 = 15;
/// Words before those of the taxels.
pub const HEAD_WORDS: usize = 3;
/// Coefficients in a word.
pub const COEFFICIENTS_PER_WORD: usize = 2;
/// Cycles after the last code, and without a frame in the engine, after which an image begins: none is in the first or last registers
/// either.
pub const REST: u64 = 31;
/// Bytes of the CRC.
const CRC_BYTES: usize = 4;

/// What an image holds, or the bitstream.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tables {
    /// Version, [`VERSION_BITS`] bits; 0 is that of the bitstream.
    pub version: u16,
    /// Forces with a smaller |fz| are zero, in force LSBs.
    pub threshold: u32,
    /// Noise floor in LSBs of a frame buffer word, ≥ 0.
    pub noise_floor: i32,
    /// Zero of each taxel, `code_bits` signed.
    pub zero: Vec<i32>,
    /// Gain of each taxel, 18 bits signed, 2^−16 per LSB.
    pub gain: Vec<i32>,
    /// Coefficients, 18 bits signed, an even number: the words of their memory one after the other, lane 0 first. None if they
    /// are not written.
    pub coefficients: Vec<i64>,
}

/// Whether tables are whole, and whether the last image was refused.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Outcome {
    /// Whole.
    #[default]
    Whole,
    /// The image was refused at its word 0: the tables are as before.
    Refused,
    /// The image was refused later: the tables are not whole.
    Broken,
}

impl Tables {
    /// The image, for hardware of this layout and codes of `code_bits` bits.
    pub fn image(&self, layout: u32, code_bits: u32) -> Vec<u8> {
        let mask = (1u64 << code_bits) - 1;
        let entry =
            |(&zero, &gain): (&i32, &i32)| (i64::from(gain) as u64) << code_bits | i64::from(zero) as u64 & mask;
        let head = [
            u64::from(MAGIC) << 32 | u64::from(layout),
            u64::from(self.version) << 32 | u64::from(self.threshold),
            self.noise_floor as u64,
        ];
        let pair = |pair: &[i64]| {
            let one = |c: i64| c as u64 & ((1 << MULTIPLIER_BITS) - 1);
            pair.iter().rev().fold(0, |word, &c| word << MULTIPLIER_BITS | one(c))
        };
        let taxels = self.zero.iter().zip(&self.gain).map(entry);
        let coefficients = self.coefficients.chunks(COEFFICIENTS_PER_WORD).map(pair);
        let words = head.into_iter().chain(taxels).chain(coefficients).chain([0]);
        let mut bytes: Vec<u8> = words.flat_map(|word| word.to_le_bytes().into_iter().take(WORD_BYTES)).collect();
        bytes.truncate(bytes.len() - CRC_BYTES);
        bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
        bytes
    }

    /// What hardware that holds these tables does with the bytes of an image.
    pub fn load(&mut self, image: &[u8], layout: u32, code_bits: u32) -> Outcome {
        let word = |index: usize| {
            let mut bytes = [0; 8];
            let own = image.get(index * WORD_BYTES..(index + 1) * WORD_BYTES)?;
            bytes[..WORD_BYTES].copy_from_slice(own);
            Some(u64::from_le_bytes(bytes))
        };
        if word(0) != Some(u64::from(MAGIC) << 32 | u64::from(layout)) {
            return Outcome::Refused;
        }
        let whole = image.len() == self.image_bytes()
            && image.split_last_chunk().is_some_and(|(all, crc)| crc32fast::hash(all) == u32::from_le_bytes(*crc));
        if !whole {
            return Outcome::Broken;
        }
        let signed = |word: u64, low: u32, bits: u32| (word << (64 - low - bits)) as i64 >> (64 - bits);
        let words = |index| word(index).unwrap_or_default();
        let taxels = self.zero.len();
        let entries: Vec<u64> = (0..taxels).map(|taxel| words(HEAD_WORDS + taxel)).collect();
        let coefficient = |index: usize| {
            let (word, at) = (index / COEFFICIENTS_PER_WORD, index % COEFFICIENTS_PER_WORD);
            signed(words(HEAD_WORDS + taxels + word), at as u32 * MULTIPLIER_BITS, MULTIPLIER_BITS)
        };
        *self = Tables {
            version: (words(1) >> 32) as u16 & ((1 << VERSION_BITS) - 1),
            threshold: words(1) as u32,
            noise_floor: words(2) as u32 as i32,
            zero: entries.iter().map(|&entry| signed(entry, 0, code_bits) as i32).collect(),
            gain: entries.iter().map(|&entry| signed(entry, code_bits, GAIN_BITS) as i32).collect(),
            coefficients: (0..self.coefficients.len()).map(coefficient).collect(),
        };
        Outcome::Whole
    }

    /// Bytes of the image.
    pub fn image_bytes(&self) -> usize {
        (HEAD_WORDS + self.zero.len() + self.coefficients.len() / COEFFICIENTS_PER_WORD + 1) * WORD_BYTES
    }
}

/// The beats of an image on the input stream, as codes: just beyond the largest of `code_bits` bits, of which there are
/// [`TABLE_CODE_BITS`](crate::spec::scene::TABLE_CODE_BITS) or more.
pub fn beats(image: &[u8], code_bits: u32) -> Vec<i32> {
    image.iter().map(|&byte| 1 << (code_bits - 1) | i32::from(byte)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const BITS: u32 = 20;

    fn tables(version: u16) -> Tables {
        let zero = vec![-(1 << 19), 5, -1, (1 << 19) - 1];
        let (gain, coefficients) = (vec![1 << 16, -(1 << 17), 0, -1], vec![-(1 << 17), (1 << 17) - 1, -1, 7]);
        Tables { version, threshold: 4_000_000_000, noise_floor: 900, zero, gain, coefficients }
    }

    #[test]
    fn an_image_is_read_back_and_a_damaged_one_is_not_whole() {
        let (own, layout) = (tables(77), 0xdead_beef);
        let image = own.image(layout, BITS);
        assert_eq!(image.len(), own.image_bytes());
        let empty = Tables { zero: vec![0; 4], gain: vec![0; 4], coefficients: vec![0; 4], ..tables(1) };
        let mut read = empty.clone();
        assert_eq!(read.load(&image, layout, BITS), Outcome::Whole);
        assert_eq!(read, own);
        for at in 0..image.len() {
            for bit in 0..8 {
                let mut damaged = image.clone();
                damaged[at] ^= 1 << bit;
                let mut read = empty.clone();
                let expected = if at < WORD_BYTES { Outcome::Refused } else { Outcome::Broken };
                assert_eq!((read.load(&damaged, layout, BITS), &read), (expected, &empty));
            }
        }
        assert_eq!(read.load(&image[..image.len() - 1], layout, BITS), Outcome::Broken);
        assert_eq!(read.load(&image[..4], layout, BITS), Outcome::Refused);
    }

    #[test]
    fn a_byte_is_no_code() {
        for bits in [crate::spec::scene::TABLE_CODE_BITS, BITS] {
            let all: Vec<u8> = (0..=255).collect();
            for (beat, byte) in beats(&all, bits).into_iter().zip(all) {
                let [top, next] = [bits, bits - 1].map(|bit| beat >> bit & 1);
                assert!(top != next && beat & 255 == i32::from(byte));
            }
        }
    }
}
