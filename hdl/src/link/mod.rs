//! The engine behind a link: what a host on the other end of a wire talks to.
//!
//! ```text
//!                        .------------------------- packet_link ---------------------------.
//! pins ---> line: uart, -> slip_decoder -> parser -> feeder ----------------------> s_axis |
//!           or spi_slave |                     '-> requests                            engine
//! pins <--- of the link <- slip_encoder <- packer <- sources <- resultants, ledger <- m_axis
//! ```
//! The packets are those of [`dermis_golden::link`]. Whatever carries bytes both ways can stand where the UART and the SPI
//! slave stand; a board has one of them.

mod board_top;
mod crc;
mod feeder;
mod generate;
mod lamps;
mod ledger;
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

pub use board_top::{BoardTop, SerialBoardTop, SerialSpiBoardTop, SpiBoardTop};
pub use crc::Crc;
pub use feeder::Feeder;
pub use generate::generate_board;
pub use lamps::Lamps;
pub use ledger::Ledger;
pub use packer::Packer;
pub use packet_link::PacketLink;
pub use parser::Parser;
pub use power_on::PowerOn;
pub use requests::Requests;
pub use resultants::Resultants;
pub use simulate::{board_simulator, Board, BoardDevice, BoardOutputs};
pub use slip_decoder::SlipDecoder;
pub use slip_encoder::SlipEncoder;
pub use sources::Sources;
pub use spi_slave::SpiSlave;
pub use uart::Uart;
pub use uart_receiver::UartReceiver;
pub use uart_transmitter::UartTransmitter;

use dermis_golden::board::EngineKind;
use dermis_golden::fixed::Model;
use dermis_golden::link::{supports, Counters, Identity, Kind, Sums, BEAT_BYTES};

/// What the packets of a scene need to know of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Rows of the array.
    pub rows: usize,
    /// Columns of the array.
    pub cols: usize,
    /// Bits of a code.
    pub input_bits: u32,
    /// Status beats of a frame.
    pub status_beats: usize,
    /// Resultants are answered, too.
    pub resultants: bool,
    /// Frames that wait for their answers at most, or more: a power of two.
    pub frames: usize,
}

impl Shape {
    /// The shape of a scene.
    pub fn of(model: &Model) -> Self {
        let sensor = &model.scene.sensor;
        let (input_bits, status_beats) = (model.formats.code_bits, model.status_beats());
        let resultants = supports(model.board.engine, Kind::FrameForResultants);
        let frames = match model.board.engine {
            EngineKind::Parallel => 4,
            EngineKind::Serial => 2,
        };
        Shape { rows: sensor.rows, cols: sensor.cols, input_bits, status_beats, resultants, frames }
    }

    /// Bytes of an answer's payload, by source.
    fn payloads(&self) -> [usize; 4] {
        let status = self.status_beats * BEAT_BYTES;
        let mut bytes = [0; 4];
        bytes[IDENTITY] = Identity::BYTES;
        bytes[COUNTERS] = Counters::BYTES;
        bytes[RESULTANTS] = Sums::BYTES + status;
        bytes[FORCES] = self.rows * self.cols * BEAT_BYTES + status;
        bytes
    }
}

/// Source of an answer: the identity. Sources are numbered as the requests' types, from 0.
const IDENTITY: usize = 0;
/// The counters.
const COUNTERS: usize = 1;
/// The engine, summed up.
const RESULTANTS: usize = 2;
/// The engine, all forces.
const FORCES: usize = 3;
