//! The host end of a board's link: of a real board on a serial port, and of simulated ones.
//!
//! ```text
//! frame file, or a line of JSON -> tare -> codes -> packet -> port -> board
//!                     report, or a line of JSON <- forces, status <- packet <-'
//!
//! host --- pseudo-terminal --- NoisyChannel --- HostUart --- BoardDevice (board top: UART, packets, engine)
//!                              loses, flips, delays bytes
//! bytes ---------------------------- SpiController --- BoardDevice (board top: SPI slave, packets, engine)
//! host --- UDP, lost and doubled packets --- core behind Ethernet, or NetworkCore, the bit-true model in its place
//! ```
//! A board must first identify itself. A request without answer, or with a damaged answer, is sent again with a new
//! sequence number; the number of repetitions is reported.

mod answer;
mod board;
mod client;
mod controller;
mod core_clock;
mod error;
mod host_uart;
mod network;
mod network_core;
mod noisy_channel;
mod session;
pub mod stream;
mod terminal;

pub use answer::{BoardAnswer, PhysicalAnswer};
pub use board::{Board, LinkErrors, PacketCounters};
pub use client::{check_identity, Client};
pub use controller::SpiController;
pub use core_clock::{Acquired, CoreClock, Drift};
pub use error::{HostError, IdentityError};
pub use host_uart::{require_uart, HostUart, UartSymbol};
pub use network::NetworkClient;
pub use network_core::NetworkCore;
pub use noisy_channel::{ChannelFaults, NoisyChannel};
pub use session::{open, open_board, BoardEngine, Session};
pub use terminal::PseudoTerminal;
