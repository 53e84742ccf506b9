//! A core behind Ethernet: requests and answers in UDP packets, with repetition after lost ones.

use std::io::ErrorKind;
use std::net::UdpSocket;
use std::time::{Duration, Instant, SystemTime};

use dermis_golden::fixed::Model;
use dermis_golden::wire::link::{require_one_answer, Identity, Kind};
use dermis_golden::wire::udp::{Answers, CoreAnswer, CoreIdentity, Packet, TooLong, LAYOUT, MOST_ARRAYS};

use super::answer::BoardAnswer;
use super::board::{Board, LinkErrors, PacketCounters};
use super::client::{check_scene, waits, ATTEMPTS};
use super::core_clock::{CoreClock, Drift, HostClock};
use super::error::{HostError, IdentityError};
use crate::stream::DATAGRAM;

/// Longest wait of a read of the socket, so that a timeout is noticed.
const READ_TIMEOUT: Duration = Duration::from_millis(10);
/// Questions for the identity before the first frame: with the quickest answer the core's time is known best.
const QUESTIONS: usize = 8;
/// Bits of a mantissa, of a core that sends short forces.
const SHORT_BITS: u32 = 16;

/// A core behind Ethernet.
pub struct NetworkClient {
    socket: UdpSocket,
    name: String,
    /// The array of a core that serves several; `None`: none was named.
    array: Option<u8>,
    timeout: Duration,
    answers: Answers,
    sequence: u32,
    repeated: u64,
    host_clock: HostClock,
    clock: CoreClock,
    /// Bytes of a code.
    code_bytes: usize,
    bits_left_out: u32,
    /// Most words of a payload.
    fragment_words: usize,
    short_forces: bool,
}

impl NetworkClient {
    /// The core at `HOST` or `HOST:PORT`, of one that serves several arrays that of the number in `HOST#3` or `HOST:PORT#3`; requests
    /// are repeated after `timeout` without an answer.
    ///
    /// # Errors
    /// An address that cannot be reached, no number of an array.
    pub fn open(address: &str, timeout: Duration) -> Result<Self, HostError> {
        let name = format!("udp:{address}");
        let refused = |reason: String| HostError::Port { port: name.clone(), reason };
        let failed = |error: std::io::Error| refused(error.to_string());
        let (address, array) = match address.split_once('#') {
            None => (address, None),
            Some((address, number)) => match number.parse().ok().filter(|array| usize::from(*array) < MOST_ARRAYS) {
                Some(array) => (address, Some(array)),
                None => return Err(refused(format!("#{number}: a number from 0 to {} is wanted", MOST_ARRAYS - 1))),
            },
        };
        let has_port = address.rsplit_once(':').is_some_and(|(_, port)| port.parse::<u16>().is_ok());
        let full = if has_port { address.to_owned() } else { format!("{address}:{}", LAYOUT.udp_port) };
        let to = std::net::ToSocketAddrs::to_socket_addrs(&full).map_err(failed)?.next();
        let to = to.ok_or_else(|| failed(ErrorKind::NotFound.into()))?;
        let any: std::net::IpAddr = match to.is_ipv4() {
            true => std::net::Ipv4Addr::UNSPECIFIED.into(),
            false => std::net::Ipv6Addr::UNSPECIFIED.into(),
        };
        let socket = UdpSocket::bind((any, 0)).map_err(failed)?;
        // Only packets of this address are read.
        socket.connect(to).map_err(failed)?;
        socket.set_read_timeout(Some(READ_TIMEOUT)).map_err(failed)?;
        // Numbers near those of an earlier host would be late to the core.
        let sequence = std::hash::BuildHasher::hash_one(&std::hash::RandomState::new(), SystemTime::now()) as u32;
        Ok(NetworkClient {
            socket,
            name,
            array,
            timeout,
            answers: Answers::default(),
            sequence,
            repeated: 0,
            host_clock: HostClock::new(),
            clock: CoreClock::new(1),
            code_bytes: 0,
            bits_left_out: 0,
            fragment_words: LAYOUT.fragment_words,
            short_forces: false,
        })
    }

    /// How the core's rate differs from the one that it states; `None` before two answers.
    pub fn drift(&self) -> Option<Drift> {
        self.clock.drift()
    }

    /// Sends packets, repeatedly with another sequence number if `renews`, until `wanted` finds its answer; with the answer the times
    /// at which the packets were sent and the answer was whole.
    fn request<T>(
        &mut self,
        what: &'static str,
        renews: bool,
        packets: &dyn Fn(u32) -> Result<Vec<Packet>, TooLong>,
        wanted: &dyn Fn(CoreAnswer, u32) -> Option<T>,
    ) -> Result<(T, [i64; 2]), HostError> {
        for attempt in 0..ATTEMPTS {
            self.repeated += u64::from(attempt > 0);
            self.sequence = self.sequence.wrapping_add(u32::from(renews));
            let own = packets(self.sequence).map_err(|error| self.failed(&error))?;
            let sent_ns = self.host_clock.now_ns();
            for packet in own {
                // What the network refuses now, such as a core that is not there yet, is repeated.
                let _ = self.socket.send(&packet.to_bytes());
            }
            if let Some(answer) = self.wait(wanted)? {
                return Ok((answer, [sent_ns, self.host_clock.now_ns()]));
            }
        }
        let milliseconds = self.timeout.as_millis();
        Err(HostError::NoCore { port: self.name.clone(), what, attempts: ATTEMPTS, milliseconds })
    }

    /// The answer that is wanted; `None` after the timeout.
    fn wait<T>(&mut self, wanted: &dyn Fn(CoreAnswer, u32) -> Option<T>) -> Result<Option<T>, HostError> {
        let begun = Instant::now();
        let mut bytes = vec![0; DATAGRAM];
        while begun.elapsed() < self.timeout {
            let count = match self.socket.recv(&mut bytes) {
                Ok(count) => count,
                // Nothing answers at the port: perhaps not yet.
                Err(error) if error.kind() == ErrorKind::ConnectionRefused => {
                    std::thread::sleep(READ_TIMEOUT);
                    continue;
                }
                Err(error) if waits(&error) => continue,
                Err(error) => return Err(self.failed(&error)),
            };
            let answer = self.answers.add(&bytes[..count]);
            if let Some(found) = answer.and_then(|answer| wanted(answer, self.sequence)) {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    /// Asks what the core is, and for the counters of its array.
    fn request_identity(&mut self) -> Result<(CoreIdentity, [i64; 2]), HostError> {
        let own = |answer, wanted| match answer {
            CoreAnswer::Identity { sequence, identity } if sequence == wanted => Some(identity),
            _ => None,
        };
        let array = self.number();
        self.request("identify", true, &|sequence| Ok(vec![Packet::question(sequence).of_array(array)]), &own)
    }

    /// The number of the array in packets.
    fn number(&self) -> u8 {
        self.array.unwrap_or_default()
    }

    fn failed(&self, reason: &dyn std::fmt::Display) -> HostError {
        HostError::Port { port: self.name.clone(), reason: reason.to_string() }
    }
}

/// Checks that a core was built for `model`.
fn check(model: &Model, core: &CoreIdentity) -> Result<(), IdentityError> {
    if core.word("version") != LAYOUT.version {
        let version = |version: u32| version.try_into().unwrap_or(u16::MAX);
        return Err(IdentityError::Version { has: version(core.word("version")), wants: version(LAYOUT.version) });
    }
    let [rows, cols, bits, _] = core.word("array").to_le_bytes().map(u16::from);
    check_scene(model, [rows, cols, bits], core.word("scene"))
}

impl Board for NetworkClient {
    fn name(&self) -> &str {
        &self.name
    }

    fn identify(&mut self, model: &Model) -> Result<Identity, HostError> {
        require_one_answer(model).map_err(|error| self.failed(&error))?;
        if model.code_beats() > 0 {
            return Err(
                self.failed(&"hardware.source = adc-scan: a core behind Ethernet takes frames and scans no array")
            );
        }
        let (core, _) = self.request_identity()?;
        check(model, &core).map_err(|reason| HostError::Identity { port: self.name.clone(), reason })?;
        match (core.word("arrays") as usize, self.array) {
            (arrays, None) if arrays > 1 => {
                return Err(self.failed(&format!("the core serves {arrays} arrays: name one, as {}#0", self.name)));
            }
            (arrays, Some(array)) if usize::from(array) >= arrays => {
                return Err(self.failed(&format!("the core serves {arrays} arrays, the first of which is 0")));
            }
            _ => (),
        }
        let code_bits = model.formats().code_bits;
        self.clock = CoreClock::new(core.word("clock_Hz"));
        self.code_bytes = core.word("code_bytes") as usize;
        self.bits_left_out = code_bits.saturating_sub(u8::BITS * core.word("code_bytes"));
        self.fragment_words = (core.word("fragment_words") as usize).clamp(1, LAYOUT.fragment_words);
        self.short_forces = core.word("force_bits") == SHORT_BITS;
        for _ in 0..QUESTIONS {
            let (core, [sent_ns, answered_ns]) = self.request_identity()?;
            self.clock.add(sent_ns, core.cycles(), answered_ns);
        }
        let sensor = &model.scene.sensor;
        let identity = Identity {
            version: LAYOUT.version as u16,
            rows: sensor.rows as u16,
            cols: sensor.cols as u16,
            input_bits: code_bits as u8,
            scene: core.word("scene"),
            clock_hz: core.word("clock_Hz"),
            ..Identity::default()
        };
        let writable = core.word("writable_tables") != 0;
        // A core sends its words as they are: forces, or records in their place, which both requests are answered with.
        Ok(identity.with_requests(|kind| match kind {
            Kind::FrameForResultants => model.sends_resultants(),
            Kind::FrameForForces => !model.sends_resultants(),
            Kind::Tables => writable,
            _ => true,
        }))
    }

    fn counters(&mut self) -> Result<PacketCounters, HostError> {
        let (core, [sent_ns, answered_ns]) = self.request_identity()?;
        self.clock.add(sent_ns, core.cycles(), answered_ns);
        let dropped = ["ignored", "refused", "damaged", "overrun", "cut"].map(|name| (name, core.word(name))).to_vec();
        Ok(PacketCounters { taken: core.word("taken"), dropped, bits: u32::BITS })
    }

    fn frame(&mut self, model: &Model, codes: &[i32], forces: bool) -> Result<BoardAnswer, HostError> {
        let (form, fragment_words) = ((self.code_bytes, self.bits_left_out), self.fragment_words);
        let array = self.number();
        let packets = |sequence| Packet::frame(sequence, array, codes, form, fragment_words);
        let result = |answer, wanted| match answer {
            CoreAnswer::Result { sequence, cycles, words, .. } if sequence == wanted => Some((cycles, words)),
            _ => None,
        };
        let kind = if forces { Kind::FrameForForces } else { Kind::FrameForResultants };
        let ((cycles, words), [sent_ns, answered_ns]) = self.request(kind.name(), true, &packets, &result)?;
        self.clock.add(sent_ns, cycles, answered_ns);
        let bytes: Vec<u8> = words.into_iter().flat_map(u32::to_le_bytes).collect();
        let answer = BoardAnswer::of_bytes(model, &bytes, true);
        let answer = answer.ok_or(HostError::Answer {
            port: self.name.clone(),
            what: kind.answer().name(),
            bytes: bytes.len(),
        })?;
        let short_forces = self.short_forces.then_some(fragment_words);
        Ok(BoardAnswer { short_forces, acquired: self.clock.at(cycles), ..answer })
    }

    fn write_tables(&mut self, image: &[u8]) -> Result<(), HostError> {
        self.sequence = self.sequence.wrapping_add(1);
        let all = Packet::tables(self.sequence, self.number(), image, self.fragment_words);
        let all = all.map_err(|error| self.failed(&error))?;
        for packet in all {
            // The same number again: the core has taken a fragment whose answer was lost.
            let taken = |answer, wanted| match answer {
                CoreAnswer::TablesTaken { sequence, index } => {
                    (sequence == wanted && index == packet.index).then_some(())
                }
                _ => None,
            };
            self.request("tables", false, &|_| Ok(vec![packet.clone()]), &taken)?;
        }
        Ok(())
    }

    fn array(&self) -> usize {
        self.number().into()
    }

    fn link_errors(&self) -> LinkErrors {
        LinkErrors { repeated: self.repeated, damaged: self.answers.damaged }
    }

    fn bits_left_out(&self) -> u32 {
        self.bits_left_out
    }
}
