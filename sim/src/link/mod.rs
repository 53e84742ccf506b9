//! The host end of a board's link: of a real board on a serial port, and of simulated ones.
//!
//! ```text
//! frame file, or a line of JSON -> tare -> codes -> packet -> port -> board
//!                     report, or a line of JSON <- forces, status <- packet <-'
//!
//! host --- pseudo-terminal --- NoisyChannel --- HostUart --- BoardDevice (board top: UART, packets, engine)
//!                              loses, flips, delays bytes
//! bytes ---------------------------- SpiController --- BoardDevice (board top: SPI slave, packets, engine)
//! ```
//! A board must first identify itself. A request without answer, or with a damaged answer, is sent again with a new
//! sequence number; the number of repetitions is reported.

mod answer;
mod client;
mod controller;
mod error;
mod host_uart;
mod noisy_channel;
mod session;
pub(crate) mod stream;
mod terminal;

pub use answer::{Answer, PhysicalAnswer};
pub use client::{check_identity, Client, LinkErrors};
pub use controller::SpiController;
pub use error::{HostError, IdentityError};
pub use host_uart::{require_uart, HostUart, UartSymbol};
pub use noisy_channel::{ChannelFaults, NoisyChannel};
pub(crate) use session::open_board;
pub use session::{open, BoardEngine, Session};
pub use terminal::PseudoTerminal;
