//! The matrix passes: their program, their operands, how long their rows are.

pub(crate) mod operand_select;
pub(crate) mod operand_writer;
pub(crate) mod pass_program;
pub(crate) mod raw_length;
