//! A core behind Ethernet in software: the bit-true model answers the packets, to try a host without hardware.

use std::collections::BTreeMap;
use std::io::{self, ErrorKind};
use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use dermis_golden::fixed::{FixedError, Model};
use dermis_golden::wire::link::scene_hash;
use dermis_golden::wire::udp::{CoreIdentity, Kind, Packet, LAYOUT, WORD_BYTES};

use crate::stream::DATAGRAM;

/// Longest wait for a packet, so that a request to stop is noticed.
const WAIT: Duration = Duration::from_millis(20);
/// Bytes of a code in a packet: all its bits are sent.
const CODE_BYTES: usize = 4;
const NS_PER_S: u128 = 1_000_000_000;

/// A running core; stops when dropped.
pub struct NetworkCore {
    address: SocketAddr,
    begun: Instant,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<io::Result<()>>>,
}

impl NetworkCore {
    /// Starts a core of the hardware of `model` at an address, port 0 being a free one.
    ///
    /// # Errors
    /// An address that cannot be used, files of an array that are wrong.
    pub fn start(model: &Model, address: &str) -> anyhow::Result<Self> {
        let socket = UdpSocket::bind(address)?;
        socket.set_read_timeout(Some(WAIT))?;
        let (address, begun) = (socket.local_addr()?, Instant::now());
        let stop = Arc::new(AtomicBool::new(false));
        let ends = stop.clone();
        let mut core = Core::new(model, begun)?;
        let thread = std::thread::Builder::new().name("core".into()).spawn(move || core.serve(&socket, &ends))?;
        Ok(NetworkCore { address, begun, stop, thread: Some(thread) })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// When its clock was 0.
    pub fn begun(&self) -> Instant {
        self.begun
    }

    /// Waits for its end, which only an error brings.
    ///
    /// # Errors
    /// A socket that fails.
    pub fn wait(mut self) -> io::Result<()> {
        self.thread.take().map_or(Ok(()), |thread| thread.join().unwrap_or_else(|_| Err(ErrorKind::Other.into())))
    }
}

impl Drop for NetworkCore {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().map(JoinHandle::join);
    }
}

/// The core: packets in, packets out, as `FrameReceiver`, `Requests` and `ResultSender` of `python/litex`.
struct Core {
    /// Of each array that the engine serves.
    models: Vec<Model>,
    begun: Instant,
    /// Of the hardware, whatever tables are written later.
    scene_hash: u32,
    /// By name and array; `None`: of packets whose array is not known, or none of this core.
    counters: BTreeMap<&'static str, BTreeMap<Option<usize>, u32>>,
    /// Sequence number of the newest frame of each array.
    newest: Vec<Option<u32>>,
    /// Array and fragments of the frame that is not whole.
    collected: usize,
    fragments: BTreeMap<u8, Vec<u32>>,
    /// Array and sequence number of the image that is written, the fragments taken, and their bytes.
    image: Option<((usize, u32), u8, Vec<u8>)>,
}

impl Core {
    fn new(hardware: &Model, begun: Instant) -> Result<Self, FixedError> {
        let arrays = hardware.scene.hardware.arrays;
        Ok(Core {
            models: (0..arrays).map(|array| hardware.of_array(array)).collect::<Result<_, _>>()?,
            begun,
            scene_hash: scene_hash(hardware),
            counters: BTreeMap::new(),
            newest: vec![None; arrays],
            collected: 0,
            fragments: BTreeMap::new(),
            image: None,
        })
    }

    fn serve(&mut self, socket: &UdpSocket, stop: &AtomicBool) -> io::Result<()> {
        let mut bytes = vec![0; DATAGRAM];
        while !stop.load(Ordering::Relaxed) {
            let (count, from) = match socket.recv_from(&mut bytes) {
                Ok(received) => received,
                Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => continue,
                // A host that was answered is gone.
                Err(error) if matches!(error.kind(), ErrorKind::ConnectionRefused | ErrorKind::Interrupted) => continue,
                Err(error) => return Err(error),
            };
            for packet in self.answer(&bytes[..count]) {
                // A packet that is not sent is one that is lost.
                let _ = socket.send_to(&packet.to_bytes(), from);
            }
        }
        Ok(())
    }

    fn count(&mut self, name: &'static str, array: Option<usize>) -> Vec<Packet> {
        *self.counters.entry(name).or_default().entry(array).or_default() += 1;
        Vec::new()
    }

    /// Cycles of the core's clock.
    fn cycles(&self) -> u64 {
        let hz = u128::from(self.clock_hz());
        (self.begun.elapsed().as_nanos() * hz / NS_PER_S) as u64
    }

    fn clock_hz(&self) -> u32 {
        (self.any().board.clock_MHz * 1e6).round() as u32
    }

    /// The model of an array: all are alike but for their tables.
    fn any(&self) -> &Model {
        &self.models[0]
    }

    fn answer(&mut self, bytes: &[u8]) -> Vec<Packet> {
        let Some(packet) = Packet::of_bytes(bytes) else { return self.count("damaged", None) };
        match packet.kind {
            Kind::Identify => {
                let words = self.identity(packet.array()).words();
                vec![Packet { kind: Kind::Identity, words, ..packet }]
            }
            Kind::Tables if packet.array() < self.models.len() => self.tables(packet),
            Kind::Frame if packet.array() < self.models.len() => self.frame(packet),
            _ => self.count("refused", None),
        }
    }

    /// What the core is, with the counters of an array.
    fn identity(&self, array: usize) -> CoreIdentity {
        let cycles = self.cycles();
        let sensor = &self.any().scene.sensor;
        let shape = [sensor.rows as u8, sensor.cols as u8, self.any().formats().code_bits as u8, WORD_BYTES as u8];
        CoreIdentity::of_names(|name| match name {
            "version" => LAYOUT.version,
            "scene" => self.scene_hash,
            "array" => u32::from_le_bytes(shape),
            "arrays" => self.models.len() as u32,
            "clock_Hz" => self.clock_hz(),
            "force_triples" => self.any().force_triples() as u32,
            "status_triples" => self.any().status_triples() as u32,
            "code_bytes" => CODE_BYTES as u32,
            "force_bits" => u32::BITS,
            "fragment_words" => LAYOUT.fragment_words as u32,
            "writable_tables" => self.any().has_writable_tables().into(),
            "time_low" => cycles as u32,
            "time_high" => (cycles >> u32::BITS) as u32,
            counter => {
                let own = self.counters.get(counter);
                own.map_or(0, |own| [None, Some(array)].iter().filter_map(|of| own.get(of)).sum())
            }
        })
    }

    /// A fragment of an image: the next one, or the one before once more, or the first of another image.
    fn tables(&mut self, packet: Packet) -> Vec<Packet> {
        let Packet { sequence, index, count, flags, .. } = packet;
        let array = packet.array();
        let own = self.image.take().filter(|(image, ..)| *image == (array, sequence));
        let (image, taken, mut bytes) = own.unwrap_or(((array, sequence), 0, Vec::new()));
        let again = taken > 0 && index + 1 == taken;
        if !self.any().has_writable_tables() || packet.words.is_empty() || !(again || index == taken) {
            self.image = Some((image, taken, bytes));
            return self.count("refused", None);
        }
        if !again {
            bytes.extend(packet.words.iter().flat_map(|word| word.to_le_bytes()));
            if index + 1 == count {
                bytes.truncate(bytes.len() - usize::from(flags) % WORD_BYTES);
                self.models[array].load(&bytes);
            }
        }
        self.image = Some((image, if again { taken } else { taken + 1 }, bytes));
        vec![Packet { kind: Kind::TablesTaken, flags: 0, words: Vec::new(), ..packet }]
    }

    /// A fragment of a frame: the result, if the frame is whole with it.
    fn frame(&mut self, packet: Packet) -> Vec<Packet> {
        let (taxels, array) = (self.any().scene.sensor.taxels(), packet.array());
        let words = (CODE_BYTES * taxels).div_ceil(WORD_BYTES);
        let count = words.div_ceil(LAYOUT.fragment_words);
        let Packet { sequence, index, .. } = packet;
        let place = usize::from(index) * LAYOUT.fragment_words;
        let expected = words.saturating_sub(place).min(LAYOUT.fragment_words);
        if usize::from(packet.count) != count || packet.words.len() != expected {
            return self.count("refused", None);
        }
        let newest = self.newest[array];
        let is_collected = self.collected == array && newest == Some(sequence) && !self.fragments.is_empty();
        if !is_collected {
            if newest.is_some_and(|newest| newest.wrapping_sub(sequence) <= LAYOUT.late) {
                return self.count("ignored", Some(array));
            }
            if !self.fragments.is_empty() {
                self.count("cut", Some(self.collected));
            }
            self.newest[array] = Some(sequence);
            self.collected = array;
            self.fragments.clear();
        } else if self.fragments.contains_key(&index) {
            return self.count("ignored", Some(array));
        }
        self.count("taken", Some(array));
        self.fragments.insert(index, packet.words);
        if self.fragments.len() < count {
            return Vec::new();
        }
        let words = std::mem::take(&mut self.fragments).into_values().flatten();
        let codes: Vec<i32> = words.map(|word| word as i32).take(taxels).collect();
        self.solve(array, sequence, &codes)
    }

    fn solve(&self, array: usize, sequence: u32, codes: &[i32]) -> Vec<Packet> {
        let (cycles, model) = (self.cycles(), &self.models[array]);
        let formats = model.formats();
        let most = (1i32 << (formats.code_bits - 1)) - 1;
        let clipped = codes.iter().any(|code| *code > most || *code < -most - 1);
        let codes: Vec<i32> = codes.iter().map(|code| (*code).clamp(-most - 1, most)).collect();
        let trace = model.run(&codes);
        let beats = trace.beats.iter().chain(&trace.status);
        let words: Vec<u32> = beats.flatten().map(|word| *word as u32).collect();
        // A result of the largest array has fewer packets than can be.
        let head = Packet { kind: Kind::Result, flags: clipped.into(), cycles, ..Packet::question(sequence) };
        head.split(&words, LAYOUT.fragment_words).unwrap_or_default()
    }
}
