//! A small hardware language: blocks whose widths a scene decides, written once.
//!
//! A [`Kernel`] is the behaviour of a block as a graph of typed expressions, built by ordinary Rust when the scene is known; it
//! has the blocks inside it as instances:
//!
//! ```text
//! block!, Block::build --> Kernel --> Hierarchy --+--> Run          all kernels as one, simulated
//!   ports, logic, instances  checked              +--> Verilog      a module for each block
//!                                                 +--> LUTs, flip-flops, memories
//! ```
//! [`block!`](crate::block) declares the parameters and the ports of a block; [`Block::build`] describes what is between them with a
//! [`Builder`]. Signals between two blocks that belong together are declared once, by [`bundle!`](crate::bundle), and connected as
//! one; [`states!`](crate::states) names the states of a machine. No node holds text or a function. [`RustHdl`] makes any block one of
//! rust-hdl.
//!
//! | checked when a kernel is built | error |
//! |---|---|
//! | signed with unsigned | [`KernelError::MixedSigns`] |
//! | a value wider than its signal | [`KernelError::LostBits`] |
//! | operands of unequal or impossible width | [`KernelError::Width`] |
//! | a signal without value, or with two | [`KernelError::Unassigned`], [`KernelError::AssignedTwice`] |
//! | a wire that depends on itself | [`KernelError::Loop`] |
//! | an output of an instance that nothing reads | [`KernelError::Unread`] |
//! | a port that the kernel lacks | [`KernelError::Port`] |
//! | a name used twice, or none of Verilog | [`KernelError::Name`] |

mod block;
mod build;
mod bundle;
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
mod states;
mod text;
mod verilog;

#[cfg(test)]
pub(crate) mod testbench;
#[cfg(test)]
mod tests;

pub use build::{Builder, MemoryPort, Net};
pub use bundle::{comment, Bundle, Drive, Flip};
pub use change::Change;
pub use error::KernelError;
pub use expression::{concat, Expr, ARITHMETIC_BITS};
pub(crate) use hierarchy::memory_file;
pub use hierarchy::{Hierarchy, RamStyles};
pub use kernel::{Contents, Kernel, Memory, Type, SEPARATOR};
pub use ports::{
    kernel_of, Block, Inside, Instantiate, Interface, Make, Output, Outside, View, Visit, VisitMut, Width, Widths,
};
pub(crate) use resources::distributed_luts;
pub use run::{Run, Slot};
pub use rust_hdl::{RustHdl, Signals};
pub use simulate::Simulation;
pub use states::{Machine, States};
