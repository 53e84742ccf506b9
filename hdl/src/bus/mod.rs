//! The engine on a bus, as a core of a SoC: registers behind AXI4-Lite or Wishbone, streams of whole words.
//!
//! ```text
//!  s_axis, 32 bits -> stream_in -> engine -> stream_out -> m_axis, 32, 64 or 128 bits
//!                         |  labels: a queue  ^   |
//!                         '-------------------'   |
//!  s_axil or wb <-> axi_lite or wishbone <-> registers <- events of both
//! ```
//! The map of the registers is [`dermis_golden::wire::registers`]. `labels` has the identifier of each frame that is under way. A reset by
//! register resets all but `registers` and `stream_out`, which ends the frame that has begun to leave.
//! `arbiter` is a module of its own before `s_axis`, where each of several arrays has a stream of its own.

mod arbiter;
mod axi_lite;
mod bundles;
mod core;
mod generate;
mod interfaces;
mod ip_xact;
mod package;
mod registers;
mod stream_in;
mod stream_out;
mod tables_in;
mod testbench;
mod wishbone;

pub use arbiter::FrameArbiter;
pub use axi_lite::AxiLite;
pub use bundles::{Accesses, AxiLitePins, CoreStream, WishbonePins, ID_BITS};
pub use core::Core;
pub use generate::{generate_core, generate_core_changed};
pub use registers::Registers;
pub use stream_in::StreamIn;
pub use stream_out::{StreamOut, WIDTHS};
pub use tables_in::TablesIn;
pub use wishbone::Wishbone;

/// The bus of the registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bus {
    /// AXI4-Lite.
    AxiLite,
    /// Wishbone B4, classic.
    Wishbone,
}

/// What a core has around its engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CoreShape {
    /// The bus of the registers.
    pub bus: Bus,
    /// Words of 32 bits in a beat of the output, one of [`WIDTHS`].
    pub words: usize,
}
