//! CRC-32, two bits per cycle: bytes on a link are further apart, and this takes few logic cells.

use dermis_golden::wire::link::{CRC_POLYNOMIAL, CRC_RESIDUE};

use crate::block;
use crate::language::{Block, Builder, Inside, Type};

/// Initial value of the CRC register.
const START: u32 = u32::MAX;
/// The reflected polynomial shifted by one, for the first of two bits; its lowest bit is 0, so that it does not change
/// the second.
const BEFORE: u32 = CRC_POLYNOMIAL >> 1;
/// Cycles that a byte takes after the one with `load`.
pub const CYCLES: u32 = 4;

block! {
    /// CRC of the received or of the sent bytes of a packet.
    ///
    /// `load` XORs a byte into the low end of the register; the next four cycles process it. To send the CRC, the
    /// register's own low byte is loaded for each byte sent: the XOR clears it, which leaves only the shift to the next
    /// byte.
    #[derive(Default)]
    pub struct Crc {}
    ports CrcPorts {
        clock;
        /// A packet starts: resets the CRC, with priority over `load`.
        in restart;
        /// A byte of the packet; valid with `load`.
        in octet: 8;
        /// Take `octet` in this cycle; not while `busy`.
        in load;
        /// Lowest byte of the inverted CRC register; valid while not `busy`.
        out low: 8;
        /// The bytes so far end with their correct CRC; valid while not `busy`.
        out right;
        /// A byte is being processed.
        out busy;
    }
}

impl Block for Crc {
    fn build<'k>(&self, k: &'k Builder, io: CrcPorts<Inside<'k>>) {
        let crc = k.state("crc", Type::unsigned(32), io.restart, START.into());
        let left = k.state("left", Type::unsigned(3), io.restart, 0);
        let busy = io.busy.set(left.any());
        io.low.set(!crc.low(8));
        io.right.set(crc.is(CRC_RESIDUE.into()));
        let feedback =
            |bit: usize, polynomial: u32| crc.at(bit).mux(k.constant(32, polynomial.into()), k.constant(32, 0));
        k.when(busy, || {
            crc.set(crc.slice(2, 30).extend(32) ^ feedback(0, BEFORE) ^ feedback(1, CRC_POLYNOMIAL));
            left.set(left.minus(1));
        });
        k.when(io.load, || {
            crc.set(crc.slice(8, 24).concat(crc.low(8) ^ io.octet));
            left.set(k.constant(3, CYCLES.into()));
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference, Subject};
    use crate::wire::Word;

    /// The CRC of the bytes so far, inverted, bit by bit as in its definition.
    fn crc_32(bytes: &[u8]) -> u32 {
        let bit = |crc: u32, _| crc >> 1 ^ if crc & 1 == 1 { CRC_POLYNOMIAL } else { 0 };
        bytes.iter().fold(START, |crc, &byte| (0..8).fold(crc ^ u32::from(byte), bit))
    }

    /// The bytes of the packet, the cycles that the last one still takes.
    #[derive(Default)]
    struct Bytes {
        bytes: Vec<u8>,
        left: u32,
        started: bool,
    }

    impl Reference for Bytes {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let crc = (self.started && self.left == 0).then(|| crc_32(&self.bytes));
            vec![
                self.started.then(|| Word::from(self.left > 0)),
                crc.map(|crc| Word::from(u64::from(!crc & 0xff))),
                crc.map(|crc| Word::from(crc == CRC_RESIDUE)),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [restart, octet, load] = [0, 1, 2].map(|k| inputs[k].number());
            self.left = if load == 1 { CYCLES } else { self.left.saturating_sub(1) };
            if load == 1 {
                self.bytes.push(octet as u8);
            }
            if restart == 1 {
                *self = Bytes { started: true, ..Bytes::default() };
            }
        }
    }

    /// Packets of random bytes, some with their CRC appended, with pauses and restarts at any time.
    fn stimulus(cycles: usize) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(6);
        let mut bytes = Bytes::default();
        let mut all = Vec::new();
        for cycle in 0..cycles {
            let restart = cycle < 2 || random.u8(..120) == 0;
            let load = bytes.left == 0 && random.u8(..4) > 0;
            // The bytes of the CRC take the register to its residue.
            let octet = match bytes.bytes.len() {
                4..=7 => (!crc_32(&bytes.bytes[..4]) >> (8 * (bytes.bytes.len() - 4))) as u8,
                _ => random.u8(..),
            };
            let inputs = vec![Word::from(restart), Word::from(u64::from(octet)), Word::from(load)];
            bytes.clock(&inputs);
            all.push(inputs);
        }
        all
    }

    #[test]
    fn bytes_at_any_distance_give_the_crc_of_its_definition() {
        // CRC-32/ISO-HDLC of "123456789".
        assert_eq!(!crc_32(b"123456789"), 0xcbf4_3926);
        let (block, all) = (Crc::default(), stimulus(6000));
        check(&kernel_of(&block), &all, &mut Bytes::default());
        let right =
            Subject::from(&kernel_of(&block)).simulated(&all).iter().filter(|outputs| outputs[2].number() == 1).count();
        assert!(right > 20, "{right} cycles with a correct CRC");
    }

    #[test]
    fn loading_its_own_low_byte_sends_the_crc() {
        let load = |octet: u8| {
            let inputs = move |at| vec![Word::from(false), Word::from(u64::from(octet)), Word::from(at == 0)];
            (0..=CYCLES).map(inputs)
        };
        let crc = 0xcbf4_3926u32.to_le_bytes();
        let mut all = vec![vec![Word::from(true), Word::default(), Word::default()]];
        all.extend(b"123456789".iter().copied().chain(crc.map(|octet| !octet)).flat_map(load));
        let outputs = Subject::from(&kernel_of(&Crc::default())).simulated(&all);
        // The low byte before each byte of the CRC is that byte; its inverse clears the register.
        for (at, &octet) in crc.iter().enumerate() {
            let cycle = 1 + (9 + at) * (CYCLES as usize + 1);
            assert_eq!(outputs[cycle][1].number(), u64::from(octet), "byte {at}");
        }
    }
}
