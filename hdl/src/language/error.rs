//! Defects of a description, found when it is built.

use thiserror::Error;

/// A defect of a block's description; names block, signal, expression.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum KernelError {
    /// Signed and unsigned operands, or a value of the other signedness than its signal.
    #[error("block {block}, signal {signal}: `{expression}` mixes signed and unsigned")]
    MixedSigns {
        /// Name of the block.
        block: String,
        /// Name of the signal or memory that takes the value.
        signal: String,
        /// The expression.
        expression: String,
    },
    /// A value is wider than its signal.
    #[error("block {block}, signal {signal}: `{expression}` has {bits} bits, the signal {room}")]
    LostBits {
        /// Name of the block.
        block: String,
        /// Name of the signal.
        signal: String,
        /// The value.
        expression: String,
        /// Its width.
        bits: usize,
        /// The signal's width.
        room: usize,
    },
    /// Operands of widths that the operator cannot take.
    #[error("block {block}, signal {signal}: `{expression}`: {reason}")]
    Width {
        /// Name of the block.
        block: String,
        /// Name of the signal or memory that takes the value.
        signal: String,
        /// The expression.
        expression: String,
        /// What is wrong with its widths.
        reason: String,
    },
    /// A declared signal has no value.
    #[error("block {block}, signal {signal}: not assigned")]
    Unassigned {
        /// Name of the block.
        block: String,
        /// Name of the signal.
        signal: String,
    },
    /// A second value in the same condition.
    #[error("block {block}, signal {signal}: assigned twice, the second time `{expression}`")]
    AssignedTwice {
        /// Name of the block.
        block: String,
        /// Name of the signal.
        signal: String,
        /// The second value.
        expression: String,
    },
    /// A wire depends on itself in the same cycle.
    #[error("block {block}, signal {signal}: combinational loop through {through}: `{expression}`")]
    Loop {
        /// Name or path of the block.
        block: String,
        /// A wire of the loop in that block.
        signal: String,
        /// All wires of the loop, separated by commas.
        through: String,
        /// Value of `signal`.
        expression: String,
    },
    /// A name that is used twice or is no Verilog identifier.
    #[error("block {block}, signal {signal}: {reason}")]
    Name {
        /// Name of the block.
        block: String,
        /// The name.
        signal: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// A seeded defect that does not apply to the block, or reads what the block does not have.
    #[error("block {block}, signal {signal}: {reason}")]
    Change {
        /// Path or name of the block.
        block: String,
        /// The signal that was to be changed or read.
        signal: String,
        /// Why not.
        reason: &'static str,
    },
    /// Outputs of instances that nothing reads and that are not said to be unused.
    #[error("block {block}: nothing reads {signals}; say `unused` if that is on purpose")]
    Unread {
        /// Name of the block.
        block: String,
        /// The outputs, each after its instance.
        signals: String,
    },
    /// A port of the block that the kernel lacks, or that has another width there.
    #[error("block {block}, port {port} of {bits} bits: {found}")]
    Port {
        /// Name of the block.
        block: String,
        /// Name of the port.
        port: String,
        /// Its width.
        bits: usize,
        /// The kernel's signal of that name.
        found: String,
    },
}
