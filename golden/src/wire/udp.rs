//! UDP: the packets between a host and a core behind Ethernet, `DermisUDP` of `python/litex`.
//!
//! The format is told in `python/litex/dermis_litex/packets.py`; its numbers are in `udp/packets.json`, which both sides read.
//!
//! ```text
//! host: frame, question, tables ── packets ──> core
//! host: Answers, whole ones     <── packets ── core
//! ```
//!
//! | | | |
//! |---|---|---|
//! | in: codes, image of tables | row-major; bytes | integers |
//! | out: result | words of forces and status, the core's cycle | signed words |

use std::collections::BTreeMap;
use std::sync::LazyLock;

use serde::Deserialize;
use thiserror::Error;

/// Arrays of a core, the number of which has four bits.
pub const MOST_ARRAYS: usize = 16;
/// Bytes of a word.
pub const WORD_BYTES: usize = 4;
/// Bit of a result's flags: a code was clipped.
const CLIPPED: u8 = 1;
/// Bit of a short result's flags: the last mantissa is none.
const PADDED: u8 = 2;
/// Place of the exponent in a short result's flags.
const EXPONENT_AT: u32 = 3;
/// Most packets of a payload.
const MOST: usize = u8::MAX as usize;
/// Most results of which parts are kept: a core has two frames at a time.
const MOST_OPEN: usize = 8;
/// Bits of a mantissa.
const MANTISSA_BITS: u32 = 16;

/// The numbers of the format.
#[derive(Debug, Deserialize)]
pub struct Layout {
    /// Version of the format.
    pub version: u32,
    /// The port of a core.
    pub udp_port: u16,
    kind_frame: u8,
    kind_result: u8,
    kind_short_result: u8,
    kind_identify: u8,
    kind_identity: u8,
    kind_tables: u8,
    kind_tables_taken: u8,
    /// Words before the payload of a packet of the host, and of one of a core that is no result.
    pub header_words: usize,
    /// Words before the payload of a result's packet.
    pub result_header_words: usize,
    /// Words behind the payload.
    pub check_words: usize,
    /// Most words of a payload, of a core that is not built with another number.
    pub fragment_words: usize,
    /// A sequence number so much older than the newest is late.
    pub late: u32,
    /// Place of the number of an array in the flags of a frame and of tables; above it there is nothing.
    array_at: u32,
    /// Names of the words of an identity.
    identity: Vec<String>,
}

/// The format.
pub static LAYOUT: LazyLock<Layout> = LazyLock::new(|| {
    let text = include_str!("udp/packets.json");
    serde_json::from_str(text).unwrap_or_else(|error| unreachable!("packets.json: {error}"))
});

/// What a packet is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Codes.
    Frame,
    /// Words of forces and status.
    Result,
    /// Mantissas of forces.
    ShortResult,
    /// The question for the identity.
    Identify,
    /// Its answer.
    Identity,
    /// Bytes of an image of tables.
    Tables,
    /// The fragment of tables with this index is in the core.
    TablesTaken,
}

impl Kind {
    const ALL: [Kind; 7] =
        [Kind::Frame, Kind::Result, Kind::ShortResult, Kind::Identify, Kind::Identity, Kind::Tables, Kind::TablesTaken];

    fn number(self) -> u8 {
        match self {
            Kind::Frame => LAYOUT.kind_frame,
            Kind::Result => LAYOUT.kind_result,
            Kind::ShortResult => LAYOUT.kind_short_result,
            Kind::Identify => LAYOUT.kind_identify,
            Kind::Identity => LAYOUT.kind_identity,
            Kind::Tables => LAYOUT.kind_tables,
            Kind::TablesTaken => LAYOUT.kind_tables_taken,
        }
    }

    fn is_result(self) -> bool {
        matches!(self, Kind::Result | Kind::ShortResult)
    }

    /// Bits of the flags that every packet of a payload has; the last one alone has the others.
    fn flags_of_all(self) -> u8 {
        match self {
            Kind::Frame | Kind::Tables => u8::MAX << LAYOUT.array_at,
            _ => 0,
        }
    }
}

/// A packet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Packet {
    /// What it is.
    pub kind: Kind,
    /// Flags of its kind.
    pub flags: u8,
    /// Index of the fragment.
    pub index: u8,
    /// Number of fragments.
    pub count: u8,
    /// Chosen by the host; an answer has that of what it answers.
    pub sequence: u32,
    /// Of a result the core's cycle in which the first code of its frame entered it, else 0.
    pub cycles: u64,
    /// The payload.
    pub words: Vec<u32>,
}

impl Packet {
    /// A question for the identity, with the counters of the first array.
    pub fn question(sequence: u32) -> Packet {
        Packet { kind: Kind::Identify, flags: 0, index: 0, count: 1, sequence, cycles: 0, words: Vec::new() }
    }

    /// The bytes of the packet, with its CRC-32.
    pub fn to_bytes(&self) -> Vec<u8> {
        let head = u32::from_le_bytes([self.kind.number(), self.flags, self.index, self.count]);
        let time = [self.cycles as u32, (self.cycles >> 32) as u32];
        let time = if self.kind.is_result() { &time[..] } else { &[] };
        let words = [&[head, self.sequence], time, &self.words].concat();
        let mut bytes: Vec<u8> = words.into_iter().flat_map(u32::to_le_bytes).collect();
        bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
        bytes
    }

    /// Reads a packet; `None` for one that is damaged, or of no known kind.
    pub fn of_bytes(bytes: &[u8]) -> Option<Packet> {
        let (body, check) = bytes.split_last_chunk()?;
        if u32::from_le_bytes(*check) != crc32fast::hash(body) || !body.len().is_multiple_of(WORD_BYTES) {
            return None;
        }
        let words = words_of_bytes(body);
        let (&[head, sequence], words) = words.split_first_chunk()?;
        let [number, flags, index, count] = head.to_le_bytes();
        let kind = Kind::ALL.into_iter().find(|kind| kind.number() == number)?;
        let (cycles, words) = match kind.is_result() {
            true => {
                let (&[low, high], words) = words.split_first_chunk()?;
                (u64::from(high) << 32 | u64::from(low), words)
            }
            false => (0, words),
        };
        (index < count && words.len() <= LAYOUT.fragment_words).then(|| Packet {
            kind,
            flags,
            index,
            count,
            sequence,
            cycles,
            words: words.to_vec(),
        })
    }

    /// The packet without flags but the number of array `array`, below [`MOST_ARRAYS`].
    pub fn of_array(self, array: u8) -> Packet {
        Packet { flags: array << LAYOUT.array_at, ..self }
    }

    /// The number of the array that a question, a frame or tables are of.
    pub fn array(&self) -> usize {
        usize::from(self.flags >> LAYOUT.array_at)
    }

    /// The packets of `words` with the head of this one, at most `fragment_words` in each; its flags are those of the last, the number of
    /// an array that of all.
    ///
    /// # Errors
    /// More words than 255 packets hold.
    pub fn split(&self, words: &[u32], fragment_words: usize) -> Result<Vec<Packet>, TooLong> {
        let fragments = words.chunks(fragment_words);
        let bytes = words.len() * WORD_BYTES;
        let count =
            u8::try_from(fragments.len()).map_err(|_| TooLong { bytes, most: MOST * WORD_BYTES * fragment_words })?;
        let packet = |(index, words): (u8, &[u32])| {
            let flags = if index + 1 == count { self.flags } else { self.flags & self.kind.flags_of_all() };
            Packet { flags, index, count, words: words.to_vec(), ..*self }
        };
        Ok(std::iter::zip(0.., fragments).map(packet).collect())
    }

    /// The packets of a frame of codes of array `array`, below [`MOST_ARRAYS`], each of `code_bytes` bytes, whose lower `shift` bits are not sent.
    ///
    /// # Errors
    /// More codes than 255 packets hold.
    pub fn frame(
        sequence: u32,
        array: u8,
        codes: &[i32],
        (code_bytes, shift): (usize, u32),
        fragment_words: usize,
    ) -> Result<Vec<Packet>, TooLong> {
        let bytes = codes.iter().flat_map(|code| (code >> shift).to_le_bytes().into_iter().take(code_bytes));
        let words = words_of_bytes(&bytes.collect::<Vec<u8>>());
        Packet { kind: Kind::Frame, ..Packet::question(sequence).of_array(array) }.split(&words, fragment_words)
    }

    /// The packets of an image of tables of array `array`, below [`MOST_ARRAYS`].
    ///
    /// # Errors
    /// More bytes than 255 packets hold.
    pub fn tables(sequence: u32, array: u8, image: &[u8], fragment_words: usize) -> Result<Vec<Packet>, TooLong> {
        let none = image.len().next_multiple_of(WORD_BYTES) - image.len();
        let of_array = Packet::question(sequence).of_array(array);
        let head = Packet { kind: Kind::Tables, flags: of_array.flags | none as u8, ..of_array };
        head.split(&words_of_bytes(image), fragment_words)
    }

    /// The words of its payload; of mantissas, the forces that they are.
    fn payload(&self) -> Vec<u32> {
        if self.kind != Kind::ShortResult {
            return self.words.clone();
        }
        let exponent = u32::from(self.flags >> EXPONENT_AT);
        let halves = self.words.iter().flat_map(|word| [*word as i16, (word >> MANTISSA_BITS) as i16]);
        let forces = halves.map(|mantissa| force_of(i32::from(mantissa), exponent) as u32);
        let mut forces: Vec<u32> = forces.collect();
        forces.truncate(forces.len().saturating_sub(usize::from(self.flags & PADDED != 0)));
        forces
    }
}

/// A force of a mantissa; one near 2³¹ that was rounded up is the largest, and so is what no core sends.
fn force_of(mantissa: i32, exponent: u32) -> i32 {
    (i64::from(mantissa) << exponent).clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
}

/// Forces as a host has them of a core that sends mantissas of 16 bits, two in each of the `fragment_words` of a packet.
///
/// ```
/// use dermis_golden::wire::udp::shortened;
///
/// assert_eq!(shortened(&[5, -3, 32_766], 360), [5, -3, 32_766]);
/// // The largest force of a packet decides how many of the low bits are none.
/// assert_eq!(shortened(&[5, -3, 131_000], 360), [4, -4, 131_000]);
/// ```
pub fn shortened(forces: &[i32], fragment_words: usize) -> Vec<i32> {
    let block = |forces: &[i32]| {
        // What is added when a force is rounded up is in its size already.
        let sizes =
            forces.iter().map(|force| (force ^ force >> 31) as u32).map(|size| size + (size >> (MANTISSA_BITS - 1)));
        let bits = u32::BITS - sizes.fold(0, |all, size| all | size).leading_zeros();
        let exponent = bits.saturating_sub(MANTISSA_BITS - 1);
        let rounded = move |force: &i32| (i64::from(*force) + i64::from(1u32 << exponent >> 1)) >> exponent;
        forces.iter().map(move |force| force_of(rounded(force) as i32, exponent)).collect::<Vec<i32>>()
    };
    forces.chunks(2 * fragment_words).flat_map(block).collect()
}

/// Words of bytes, the last one filled up with 0.
fn words_of_bytes(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks(WORD_BYTES).map(|word| word.iter().rev().fold(0, |all, byte| all << 8 | u32::from(*byte))).collect()
}

/// A payload is longer than its packets can be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("{bytes} bytes, of which 255 packets hold {most}")]
pub struct TooLong {
    /// Its bytes.
    pub bytes: usize,
    /// Most bytes.
    pub most: usize,
}

/// What a core is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CoreIdentity(BTreeMap<&'static str, u32>);

impl CoreIdentity {
    /// Of the words that `word` gives for the name of each.
    pub fn of_names(word: impl Fn(&str) -> u32) -> CoreIdentity {
        CoreIdentity(LAYOUT.identity.iter().map(|name| (name.as_str(), word(name))).collect())
    }

    /// Of the words in a packet; `None` for another number of words.
    pub fn of_words(words: &[u32]) -> Option<CoreIdentity> {
        let names = LAYOUT.identity.iter().map(String::as_str);
        (words.len() == LAYOUT.identity.len())
            .then(|| CoreIdentity(std::iter::zip(names, words.iter().copied()).collect()))
    }

    /// The words of the packet.
    pub fn words(&self) -> Vec<u32> {
        LAYOUT.identity.iter().map(|name| self.word(name)).collect()
    }

    /// The word of that name; 0 for an unknown one.
    pub fn word(&self, name: &str) -> u32 {
        self.0.get(name).copied().unwrap_or_default()
    }

    /// The core's cycle in which it was asked.
    pub fn cycles(&self) -> u64 {
        u64::from(self.word("time_high")) << 32 | u64::from(self.word("time_low"))
    }
}

/// What a core answers, once it is whole.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CoreAnswer {
    /// To a question.
    Identity {
        /// That of the question.
        sequence: u32,
        /// What the core is.
        identity: CoreIdentity,
    },
    /// To a fragment of tables.
    TablesTaken {
        /// That of the image.
        sequence: u32,
        /// Index of the fragment.
        index: u8,
    },
    /// To a frame.
    Result {
        /// That of the frame.
        sequence: u32,
        /// The core's cycle in which the first code of the frame entered it.
        cycles: u64,
        /// Words of forces and status.
        words: Vec<u32>,
        /// Whether a code was clipped.
        clipped: bool,
    },
}

/// Puts answers together from their packets, in any order.
#[derive(Clone, Debug, Default)]
pub struct Answers {
    /// Fragments of each result that is not whole, by sequence number and index.
    fragments: BTreeMap<u32, BTreeMap<u8, Vec<u32>>>,
    /// Packets that were damaged, or no packets of a core.
    pub damaged: u64,
}

impl Answers {
    /// Takes a packet; the answer that is whole with it.
    pub fn add(&mut self, bytes: &[u8]) -> Option<CoreAnswer> {
        let Some(packet) = Packet::of_bytes(bytes) else {
            self.damaged += 1;
            return None;
        };
        let Packet { kind, flags, index, count, sequence, cycles, .. } = packet;
        match kind {
            Kind::Identity => {
                let identity = CoreIdentity::of_words(&packet.words)?;
                Some(CoreAnswer::Identity { sequence, identity })
            }
            Kind::TablesTaken => Some(CoreAnswer::TablesTaken { sequence, index }),
            Kind::Result | Kind::ShortResult => {
                // A result that lacks a packet is given up once it is old.
                self.fragments.retain(|own, _| sequence.wrapping_sub(*own) <= LAYOUT.late);
                if self.fragments.len() >= MOST_OPEN && !self.fragments.contains_key(&sequence) {
                    self.fragments.pop_first();
                }
                let own = self.fragments.entry(sequence).or_default();
                own.insert(index, packet.payload());
                if own.len() < usize::from(count) {
                    return None;
                }
                let words = self.fragments.remove(&sequence)?.into_values().flatten().collect();
                Some(CoreAnswer::Result { sequence, cycles, words, clipped: flags & CLIPPED != 0 })
            }
            Kind::Frame | Kind::Identify | Kind::Tables => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packets_are_read_as_they_were_written_and_damaged_ones_are_none() {
        let words: Vec<u32> = (0..800u32).map(|k| k.wrapping_mul(0x0101_0101)).collect();
        for kind in Kind::ALL {
            let cycles = if kind.is_result() { 0x0123_4567_89ab_cdef } else { 0 };
            let packets = Packet { kind, flags: 1, cycles, ..Packet::question(7) }.split(&words, 360).unwrap();
            assert_eq!(packets.iter().map(|packet| packet.words.len()).collect::<Vec<_>>(), [360, 360, 80]);
            for packet in packets {
                let mut bytes = packet.to_bytes();
                assert_eq!(Packet::of_bytes(&bytes), Some(packet));
                for at in [0, 5, 40, bytes.len() - 1] {
                    bytes[at] ^= 8;
                    assert_eq!(Packet::of_bytes(&bytes), None);
                    bytes[at] ^= 8;
                }
                assert_eq!(Packet::of_bytes(&bytes[..bytes.len() - 4]), None);
            }
        }
        assert_eq!(Packet::of_bytes(&[]), None);
        let too_long = Packet::tables(1, 0, &vec![0; 255 * 1440 + 1], 360).unwrap_err();
        assert_eq!(too_long.to_string(), "367204 bytes, of which 255 packets hold 367200");
    }

    #[test]
    fn every_packet_of_a_frame_and_of_tables_names_its_array() {
        let codes: Vec<i32> = (0..9).collect();
        let frame = Packet::frame(1, 13, &codes, (2, 4), 2).unwrap();
        assert_eq!(frame.iter().map(|packet| (packet.array(), packet.flags)).collect::<Vec<_>>(), [(13, 0xd0); 3]);
        let tables = Packet::tables(1, 3, &[0; 13], 2).unwrap();
        assert_eq!(
            tables.iter().map(|packet| (packet.array(), packet.flags)).collect::<Vec<_>>(),
            [(3, 0x30), (3, 0x33)]
        );
    }

    /// By another implementation: `python/litex` and zlib.
    #[test]
    fn a_question_by_hand() {
        let bytes = Packet::question(0x0403_0201).to_bytes();
        let own = [0xd4, 0, 0, 1, 1, 2, 3, 4];
        assert_eq!(bytes[..8], own);
        assert_eq!(bytes[8..], crc32fast::hash(&own).to_le_bytes());
    }

    #[test]
    fn results_are_whole_in_any_order_and_old_parts_are_given_up() {
        let words: Vec<u32> = (0..720).collect();
        let of = |sequence| {
            let head = Packet { kind: Kind::Result, flags: CLIPPED, cycles: 9, ..Packet::question(sequence) };
            head.split(&words, 360).unwrap()
        };
        let mut answers = Answers::default();
        let whole = |sequence| CoreAnswer::Result { sequence, cycles: 9, words: words.clone(), clipped: true };
        let [first, second] = [of(1), of(2)];
        // The flags of the last packet count.
        assert_eq!(answers.add(&first[0].to_bytes()), None);
        assert_eq!(answers.add(&second[0].to_bytes()), None);
        assert_eq!(answers.add(&second[1].to_bytes()), Some(whole(2)));
        assert_eq!(answers.add(&first[1].to_bytes()), Some(whole(1)));
        assert_eq!(answers.add(&of(3)[0].to_bytes()), None);
        assert_eq!(answers.add(&of(3 + LAYOUT.late + 1)[0].to_bytes()), None);
        assert_eq!(answers.fragments.len(), 1);
        assert_eq!((answers.add(b"rubbish"), answers.damaged), (None, 1));
        // What is not whole is bounded, whatever comes.
        (0..100).for_each(|k| drop(answers.add(&of(1000 + k)[0].to_bytes())));
        assert_eq!(answers.fragments.len(), MOST_OPEN);
    }

    #[test]
    fn an_identity_has_its_words_by_name() {
        let identity = CoreIdentity::of_names(|name| name.len() as u32);
        assert_eq!(CoreIdentity::of_words(&identity.words()), Some(identity.clone()));
        assert_eq!((identity.word("scene"), identity.word("no such word")), (5, 0));
        assert_eq!(identity.cycles(), 9 << 32 | 8);
        assert_eq!(CoreIdentity::of_words(&[1, 2]), None);
    }

    #[test]
    fn short_forces_are_read_as_the_core_rounds_them() {
        // Exponent 3, an odd number of forces.
        let words = vec![0x0001_fffe, 0x0000_7fff];
        let flags = 3 << EXPONENT_AT | PADDED;
        let packet = Packet { kind: Kind::ShortResult, flags, words, ..Packet::question(1) };
        assert_eq!(packet.payload(), [-16i32 as u32, 8, 0x7fff * 8]);
        for forces in [vec![i32::MAX, i32::MIN, 77, -1], (-900..900).map(|k| k * 12_345).collect()] {
            let own = shortened(&forces, 360);
            for (block, short) in std::iter::zip(forces.chunks(720), own.chunks(720)) {
                let most = block.iter().map(|force| force.unsigned_abs()).max().unwrap();
                let bound = f64::from(most) * (2f64.powi(-15) + 2f64.powi(-29));
                let error = |(a, b): (&i32, &i32)| (f64::from(*a) - f64::from(*b)).abs();
                assert!(std::iter::zip(block, short).map(error).all(|error| error < bound));
            }
        }
    }
}
