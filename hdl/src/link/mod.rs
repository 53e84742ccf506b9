//! The engine behind a link, as a host on the other end of a wire uses it.
//!
//! ```text
//!                        .------------------------- packet_link ---------------------------.
//! pins ---> line: uart, -> slip_decoder -> parser -> frame_ingress ---------------> s_axis |
//!           or spi_slave |                     '-> requests                            engine
//! pins <--- of the link <- slip_encoder <- packer <- sources <- resultants, counter_ram <- m_axis
//! ```
//! Of an engine that scans its array itself, `s_axis` has images of tables only, and a `frame_gate` before `m_axis` passes the
//! frames that are asked for.
//!
//! The packets are those of [`dermis_golden::wire::link`]. Any block that carries bytes both ways can replace the UART or the
//! SPI slave; a board has one of them.
//!
//! `board_top` connects them, with an engine or a scan.

mod board;
mod board_top;
mod counter_ram;
mod crc;
mod frame_gate;
mod frame_ingress;
mod generate;
mod lamps;
mod packer;
mod packet_link;
mod parser;
mod phase;
mod power_on;
mod requests;
mod resultants;
mod simulate;
mod slip_decoder;
mod slip_encoder;
mod sources;
mod spi_slave;
mod uart;
mod uart_receiver;
mod uart_transmitter;

pub use board::{BoardDevice, BoardOutputs};
pub use board_top::BoardTop;
pub use counter_ram::CounterRam;
pub use crc::Crc;
pub use frame_gate::FrameGate;
pub use frame_ingress::FrameIngress;
pub use generate::{generate_board, generate_board_changed};
pub use lamps::Lamps;
pub use packer::Packer;
pub use packet_link::PacketLink;
pub use parser::Parser;
pub use power_on::PowerOn;
pub use requests::Requests;
pub use resultants::Resultants;
pub use simulate::board_simulator;
pub use slip_decoder::SlipDecoder;
pub use slip_encoder::SlipEncoder;
pub use sources::Sources;
pub use spi_slave::SpiSlave;
pub use uart::Uart;
pub use uart_receiver::UartReceiver;
pub use uart_transmitter::UartTransmitter;

use dermis_golden::fixed::Model;
use dermis_golden::spec::board::EngineKind;
use dermis_golden::wire::link::{image_bytes, payloads, supports, Counters, Identity, Kind};

/// Properties of a scene on which its packets depend.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PacketParams {
    /// Rows of the array.
    pub rows: usize,
    /// Columns of the array.
    pub cols: usize,
    /// Width of a code, in bits.
    pub input_bits: u32,
    /// Bytes of the payload of an answer with resultants, and of one with forces.
    pub answer_bytes: [usize; 2],
    /// Bytes of an image of tables; none where they are in the bitstream.
    pub image_bytes: Option<usize>,
    /// What the board answers a frame with.
    pub answers: Answers,
    /// The hardware scans its array: a request for a frame has no payload.
    pub scans: bool,
    /// Depth of the queue of frames that wait for their answer: a power of two, at least the most that can wait.
    pub frames: usize,
}

/// What a board answers a frame with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answers {
    /// Forces: the engine is a serial one.
    Forces,
    /// Forces, or their sums.
    Both,
    /// Records of subarrays or contacts, which the engine sends in the place of forces.
    Records,
}

impl Answers {
    /// Whether the engine is a fast one, whose streams are registered.
    fn are_fast(self) -> bool {
        self != Answers::Forces
    }

    /// Types of the requests with a frame.
    fn requests(self) -> &'static [Kind] {
        match self {
            Answers::Forces => &[Kind::FrameForForces],
            Answers::Both => &[Kind::FrameForResultants, Kind::FrameForForces],
            Answers::Records => &[Kind::FrameForResultants],
        }
    }
}

impl PacketParams {
    /// The packets of the scene of `model`.
    pub fn of(model: &Model) -> Self {
        let sensor = &model.scene.sensor;
        let input_bits = model.formats().code_bits;
        let [_, resultants, forces] = payloads(model).map(|(_, bytes)| bytes);
        let answers = match [Kind::FrameForResultants, Kind::FrameForForces].map(|kind| supports(model, kind)) {
            [true, true] => Answers::Both,
            [true, false] => Answers::Records,
            [false, _] => Answers::Forces,
        };
        let frames = match model.board.engine {
            EngineKind::Parallel => 4,
            EngineKind::Serial => 2,
        };
        PacketParams {
            rows: sensor.rows,
            cols: sensor.cols,
            input_bits,
            answer_bytes: [resultants, forces],
            image_bytes: image_bytes(model),
            answers,
            scans: model.scene.hardware.adc_scan.is_some(),
            frames,
        }
    }

    /// Codes in a request for a frame.
    fn codes(&self) -> usize {
        match self.scans {
            true => 0,
            false => self.rows * self.cols,
        }
    }

    /// Types of the requests for frames that the hardware scans.
    fn scanned(&self) -> &'static [Kind] {
        match self.scans {
            true => self.answers.requests(),
            false => &[],
        }
    }

    /// Width of a beat to the engine: a code, or a byte of an image.
    pub fn stream_bits(&self) -> usize {
        self.input_bits as usize + usize::from(self.image_bytes.is_some())
    }

    /// Bytes of the payload of an answer, by source.
    fn payloads(&self) -> [usize; 4] {
        let mut bytes = [0; 4];
        bytes[IDENTITY] = Identity::BYTES;
        bytes[COUNTERS] = Counters::BYTES;
        [bytes[RESULTANTS], bytes[FORCES]] = self.answer_bytes;
        bytes
    }
}

/// Source of an answer: the identity. Sources have the order of the request types, from 0.
const IDENTITY: usize = 0;
/// Source of an answer: the counters.
const COUNTERS: usize = 1;
/// Source of an answer: sums over the forces of the engine, or its records.
const RESULTANTS: usize = 2;
/// Source of an answer: all forces of the engine.
const FORCES: usize = 3;
