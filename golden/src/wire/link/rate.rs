//! Rate: bits per second of a link on a board, and how long a packet takes.

use super::error::LinkError;
use super::OVERHEAD;
use crate::spec::board::Board;
use crate::spec::link_kind::LinkKind;

/// Minimum clock cycles per bit of the UART: the receiver takes the majority of three samples.
const MIN_CYCLES_PER_BIT: f64 = 8.0;
/// Minimum clock cycles per byte of the SPI: the CRC takes four after the one in which a byte arrives. The byte's
/// register is read at the third clock edge at the latest and is stable until then.
const MIN_CYCLES_PER_BYTE: f64 = 5.0;
/// Bits per byte of the SPI.
const SPI_BITS: f64 = 8.0;
/// Bits per byte of the UART, with start and stop bit.
const UART_BITS: f64 = 10.0;

impl LinkKind {
    /// Bit rate on `board` in bit/s: that of the UART, or the highest clock of the SPI.
    ///
    /// # Errors
    /// [`LinkError::NoPins`], or [`LinkError::TooFast`] if the board's clock is too slow.
    pub fn bit_rate(self, board: &Board) -> Result<u32, LinkError> {
        let clock_MHz = board.clock_MHz;
        // The field, the largest allowed value, and Hz per unit of both.
        let (field, most, unit) = match self {
            LinkKind::Uart => ("uart_baud", clock_MHz * 1e6 / MIN_CYCLES_PER_BIT, 1.0),
            LinkKind::Spi => ("spi_MHz", clock_MHz * SPI_BITS / MIN_CYCLES_PER_BYTE, 1e6),
        };
        let file = board.file().to_owned();
        let Some(value) = self.rate(board) else {
            let others = Self::NAMES.iter().filter(|(_, kind)| kind.rate(board).is_some());
            let others: Vec<_> = others.map(|(name, _)| format!("{name:?}")).collect();
            let others = if others.is_empty() { "no link".to_owned() } else { others.join(", ") };
            return Err(LinkError::NoPins { link: self.name(), board: board.name.clone(), file, field, others });
        };
        if value > most {
            let most = (most * 10.0).floor() / 10.0;
            return Err(LinkError::TooFast { file, field, value, clock_MHz, most });
        }
        Ok((value * unit).round() as u32)
    }

    /// The rate that the board's file states, in the unit of its field.
    fn rate(self, board: &Board) -> Option<f64> {
        match self {
            LinkKind::Uart => board.uart_baud.map(f64::from),
            LinkKind::Spi => board.spi_MHz,
        }
    }

    /// Duration in ms of a packet of `payload` bytes at `bit_rate` bit/s; each byte that must be escaped adds one more.
    pub fn wire_ms(self, payload: usize, bit_rate: u32) -> f64 {
        let bits = match self {
            LinkKind::Uart => UART_BITS,
            LinkKind::Spi => SPI_BITS,
        };
        (payload + OVERHEAD + 2) as f64 * bits / f64::from(bit_rate) * 1e3
    }
}
