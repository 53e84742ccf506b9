//! What carries the packets' bytes between host and board.

use super::{LinkError, OVERHEAD};
use crate::board::Board;

/// Fewest clock cycles per bit of the UART: the receiver votes over three of them.
const MIN_CYCLES_PER_BIT: f64 = 8.0;
/// Fewest clock cycles per byte of the SPI: the CRC takes four after the one in which a byte comes. The byte's register,
/// which is read at the third clock edge at the latest, stands as long.
const MIN_CYCLES_PER_BYTE: f64 = 5.0;
/// Bits of a byte of the SPI.
const SPI_BITS: f64 = 8.0;
/// Bits of a byte of the UART, start and stop bit among them.
const UART_BITS: f64 = 10.0;

/// The link of a board, `hardware.link` in a scene. A board has the pins of its link and of no other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LinkKind {
    /// A serial port.
    #[default]
    Uart,
    /// An SPI slave, mode 0, most significant bit first.
    Spi,
}

impl LinkKind {
    /// Every link with its name in a scene file.
    pub const NAMES: [(&'static str, LinkKind); 2] = [("uart", LinkKind::Uart), ("spi", LinkKind::Spi)];

    /// Name in a scene file.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(_, kind)| *kind == self).map_or("", |(name, _)| name)
    }

    /// The board's input pins, as its top module names them.
    pub fn inputs(self) -> &'static [&'static str] {
        match self {
            LinkKind::Uart => &["uart_rx"],
            LinkKind::Spi => &["spi_sclk", "spi_cs_n", "spi_mosi"],
        }
    }

    /// The board's output pin.
    pub fn output(self) -> &'static str {
        match self {
            LinkKind::Uart => "uart_tx",
            LinkKind::Spi => "spi_miso",
        }
    }

    /// The input pin that is a clock of its own.
    pub fn clock(self) -> Option<&'static str> {
        match self {
            LinkKind::Uart => None,
            LinkKind::Spi => self.inputs().first().copied(),
        }
    }

    /// Bit rate on `board`, bit/s: the UART's, or the highest of the SPI's clock.
    ///
    /// # Errors
    /// [`LinkError::NoPins`], or [`LinkError::TooFast`] for the board's clock.
    pub fn bit_rate(self, board: &Board) -> Result<u32, LinkError> {
        let clock_hz = board.clock_MHz * 1e6;
        // Each value as the board's file has it, the most it may be, and Hz in a unit of both.
        let (field, value, most, unit) = match (self, board.spi_MHz) {
            (LinkKind::Uart, _) => ("uart_baud", f64::from(board.uart_baud), clock_hz / MIN_CYCLES_PER_BIT, 1.0),
            (LinkKind::Spi, Some(rate)) => ("spi_MHz", rate, board.clock_MHz * SPI_BITS / MIN_CYCLES_PER_BYTE, 1e6),
            (LinkKind::Spi, None) => return Err(LinkError::NoPins { board: board.name.clone() }),
        };
        if value > most {
            let most = (most * 10.0).floor() / 10.0;
            let (board, clock_MHz) = (board.name.clone(), board.clock_MHz);
            return Err(LinkError::TooFast { board, field, value, clock_MHz, most });
        }
        Ok((value * unit).round() as u32)
    }

    /// Time of a packet of `payload` bytes at `bit_rate` bit/s, in ms; every byte that needs an escape adds another.
    pub fn wire_ms(self, payload: usize, bit_rate: u32) -> f64 {
        let bits = match self {
            LinkKind::Uart => UART_BITS,
            LinkKind::Spi => SPI_BITS,
        };
        (payload + OVERHEAD + 2) as f64 * bits / f64::from(bit_rate) * 1e3
    }
}
