//! Sums, products, shifts and roundings of words.

pub(crate) mod butterfly;
pub(crate) mod half_up;
pub(crate) mod lanes;
pub(crate) mod leading_one;
pub(crate) mod logarithm;
pub(crate) mod operand_select;
pub(crate) mod operand_writer;
pub(crate) mod pass_program;
pub(crate) mod raw_length;
pub(crate) mod rescaler;
pub(crate) mod unfolder;
