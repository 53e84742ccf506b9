//! Requests and answers over a port, with repetition after lost or damaged packets.

use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use dermis_golden::fixed::Model;
use dermis_golden::wire::link::{codes_to_bytes, scene_hash, Counters, Decoder, Identity, Kind, Packet, VERSION};

use super::answer::BoardAnswer;
use super::board::{Board, LinkErrors, PacketCounters};
use super::error::{HostError, IdentityError};

/// Number of times a request is sent before it fails.
pub(super) const ATTEMPTS: u32 = 8;

/// A board behind a port. Reads of the port must time out after a few milliseconds.
pub struct Client<P> {
    port: P,
    name: String,
    timeout: Duration,
    decoder: Decoder,
    sequence: u8,
    link_errors: LinkErrors,
}

impl<P: Read + Write> Client<P> {
    /// A board behind `port`, named `name` in messages; requests are repeated after `timeout` without an answer.
    pub fn new(port: P, name: &str, timeout: Duration) -> Self {
        let (decoder, link_errors) = (Decoder::default(), LinkErrors::default());
        Client { port, name: name.to_owned(), timeout, decoder, sequence: 0, link_errors }
    }

    /// Sends a request, repeatedly if necessary, until it is answered.
    fn request(&mut self, kind: Kind, payload: Vec<u8>) -> Result<Vec<u8>, HostError> {
        let mut packet = Packet { kind, sequence: self.sequence, payload };
        for attempt in 0..ATTEMPTS {
            self.link_errors.repeated += u64::from(attempt > 0);
            // A new number per attempt, so that a late answer to an earlier attempt is not taken for this one's.
            self.sequence = self.sequence.wrapping_add(1);
            packet.sequence = self.sequence;
            self.send(&packet.to_wire())?;
            self.port.flush().map_err(|error| self.port_error(&error))?;
            if let Some(payload) = self.wait(kind.answer())? {
                return Ok(payload);
            }
        }
        let milliseconds = self.timeout.as_millis();
        Err(HostError::NoAnswer { port: self.name.clone(), what: kind.name(), attempts: ATTEMPTS, milliseconds })
    }

    /// Writes all bytes; a port takes no more at a time than its driver has room for.
    fn send(&mut self, mut bytes: &[u8]) -> Result<(), HostError> {
        let mut last_taken = Instant::now();
        while !bytes.is_empty() {
            match self.port.write(bytes) {
                Ok(count) if count > 0 => {
                    bytes = &bytes[count..];
                    last_taken = Instant::now();
                }
                Err(error) if !waits(&error) || last_taken.elapsed() >= self.timeout => {
                    return Err(self.port_error(&error));
                }
                Ok(_) if last_taken.elapsed() >= self.timeout => {
                    return Err(self.port_error(&ErrorKind::WriteZero.into()));
                }
                _ => (),
            }
        }
        Ok(())
    }

    /// The answer's payload; `None` after the timeout or a damaged answer.
    fn wait(&mut self, kind: Kind) -> Result<Option<Vec<u8>>, HostError> {
        let mut buffer = [0; 4096];
        let mut last_heard = Instant::now();
        while last_heard.elapsed() < self.timeout {
            let count = match self.port.read(&mut buffer) {
                Ok(count) => count,
                Err(error) if waits(&error) => 0,
                Err(error) => return Err(self.port_error(&error)),
            };
            if count > 0 {
                last_heard = Instant::now();
            }
            let mut damaged = false;
            for &byte in &buffer[..count] {
                match self.decoder.next(byte) {
                    Some(Ok(packet)) if packet.kind == kind && packet.sequence == self.sequence => {
                        return Ok(Some(packet.payload));
                    }
                    // A late answer to an earlier attempt.
                    Some(Ok(_)) | None => (),
                    Some(Err(_)) => {
                        self.link_errors.damaged += 1;
                        damaged = true;
                    }
                }
            }
            if damaged {
                return Ok(None);
            }
        }
        Ok(None)
    }

    fn port_error(&self, error: &std::io::Error) -> HostError {
        HostError::Port { port: self.name.clone(), reason: error.to_string() }
    }
}

impl<P: Read + Write> Board for Client<P> {
    fn name(&self) -> &str {
        &self.name
    }

    fn identify(&mut self, model: &Model) -> Result<Identity, HostError> {
        let bytes = self.request(Kind::Identify, Vec::new())?;
        check_identity(model, &bytes).map_err(|reason| HostError::Identity { port: self.name.clone(), reason })
    }

    fn counters(&mut self) -> Result<PacketCounters, HostError> {
        let bytes = self.request(Kind::ReadCounters, Vec::new())?;
        let wrong = HostError::Answer { port: self.name.clone(), what: "counters", bytes: bytes.len() };
        let Counters { taken, framing, crc, unknown_type, length, overrun } =
            Counters::of_bytes(&bytes).ok_or(wrong)?;
        let named = [
            ("framing", framing),
            ("CRC", crc),
            ("unknown type", unknown_type),
            ("length", length),
            ("overrun", overrun),
        ];
        let dropped = named.map(|(name, count)| (name, count.into())).to_vec();
        Ok(PacketCounters { taken: taken.into(), dropped, bits: u16::BITS })
    }

    fn frame(&mut self, model: &Model, codes: &[i32], forces: bool) -> Result<BoardAnswer, HostError> {
        let kind = if forces { Kind::FrameForForces } else { Kind::FrameForResultants };
        let bytes = self.request(kind, codes_to_bytes(codes, model.formats().code_bits))?;
        let wrong = HostError::Answer { port: self.name.clone(), what: kind.answer().name(), bytes: bytes.len() };
        BoardAnswer::of_bytes(model, &bytes, forces).ok_or(wrong)
    }

    fn write_tables(&mut self, image: &[u8]) -> Result<(), HostError> {
        self.request(Kind::Tables, image.to_vec()).map(drop)
    }

    fn link_errors(&self) -> LinkErrors {
        self.link_errors
    }
}

/// Whether a port only has nothing to read, or no room, yet.
pub(super) fn waits(error: &std::io::Error) -> bool {
    matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

/// The identity in an answer of a board, if the board was built for `model`.
///
/// # Errors
/// Another version, another scene, another number of bytes.
pub fn check_identity(model: &Model, bytes: &[u8]) -> Result<Identity, IdentityError> {
    // All versions of the packets start with the version.
    let has = bytes.first_chunk().map(|version| u16::from_le_bytes(*version));
    if let Some(has) = has.filter(|&has| has != VERSION) {
        return Err(IdentityError::Version { has, wants: VERSION });
    }
    let has = Identity::of_bytes(bytes).ok_or(IdentityError::Length { bytes: bytes.len() })?;
    check_scene(model, [has.rows, has.cols, has.input_bits.into()], has.scene)?;
    Ok(has)
}

/// Checks that the scene with this hash, of so many rows, columns and bits of a code, is that of `model`.
///
/// # Errors
/// Another scene.
pub(super) fn check_scene(model: &Model, [rows, cols, bits]: [u16; 3], hash: u32) -> Result<(), IdentityError> {
    let (sensor, wants) = (&model.scene.sensor, scene_hash(model));
    if hash == wants {
        return Ok(());
    }
    let describe = |rows: usize, cols: usize, bits: u32, hash: u32| {
        format!("{rows}×{cols} taxels, {bits} bit codes, hash {hash:08x}")
    };
    Err(IdentityError::OtherScene {
        has: describe(rows.into(), cols.into(), bits.into(), hash),
        scene: model.scene.name.clone(),
        wants: describe(sensor.rows, sensor.cols, model.formats().code_bits, wants),
    })
}
