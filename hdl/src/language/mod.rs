//! A small hardware language: blocks whose widths a scene decides, written once.
//!
//! rust-hdl's `Bits<N>` takes its width from the Rust compiler and its signed products stop at 16×16. A [`Kernel`] is the
//! behaviour of a block as a graph of typed expressions, built by ordinary Rust when the scene is known:
//!
//! ```text
//! Builder -- expressions, signals, registers, memories --> Kernel --+--> Simulation   inside rust-hdl's `update`
//!   (Rust loops and functions repeat)                     checked   +--> Verilog      the body of the block's module
//!                                                                   +--> LUTs, flip-flops, memories
//! ```
//! A block is a rust-hdl `Block` whose ports are the struct's fields, with a field `kernel` of type [`Body`]; the
//! macro [`kernel_block!`](crate::kernel_block) writes `update` and `connect`; [`Hierarchy`] prints the modules. No node holds text or a function.
//!
//! | checked when a kernel is built | error |
//! |---|---|
//! | signed with unsigned | [`KernelError::MixedSigns`] |
//! | a value wider than its signal | [`KernelError::LostBits`] |
//! | operands of unequal or impossible width | [`KernelError::Width`] |
//! | a signal without value, or with two | [`KernelError::Unassigned`], [`KernelError::AssignedTwice`] |
//! | a wire that depends on itself | [`KernelError::Loop`] |
//! | more than connections in a block that connects others | [`KernelError::Wiring`] |
//! | a port that the kernel lacks | [`KernelError::Port`] |
//! | a name used twice, or none of Verilog | [`KernelError::Name`] |

mod build;
mod change;
mod check;
mod compile;
mod error;
mod expression;
mod flat;
mod hierarchy;
mod kernel;
mod keywords;
mod ports;
mod resources;
mod run;
mod rust_hdl;
mod simulate;
mod text;
mod verilog;

#[cfg(test)]
pub(crate) mod testbench;
#[cfg(test)]
mod tests;

pub use build::{Builder, MemoryPort, Net};
pub use change::Change;
pub use error::KernelError;
pub use expression::{concat, Expr, ARITHMETIC_BITS};
pub use hierarchy::{Attributes, Hierarchy, SEPARATOR};
pub use kernel::{Contents, Kernel, Memory, Type};
pub use ports::{kernel_of, Block, Inside, Interface, Make, Output, Outside, View, Width, Widths};
pub(crate) use resources::distributed_luts;
pub use run::{Run, Slot};
pub use rust_hdl::{RustHdl, SignalPort, Signals};
pub use simulate::Simulation;
