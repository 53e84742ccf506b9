//! The matrix passes: their program, their operands, the sum of their limbs and how long it is.

pub(crate) mod limb_sum;
pub(crate) mod operand_scale;
pub(crate) mod operand_select;
pub(crate) mod operand_source;
pub(crate) mod operand_writer;
pub(crate) mod pass_program;
pub(crate) mod raw_length;
