//! Sums, products, shifts and roundings of words.

pub(crate) mod butterfly;
pub(crate) mod half_up;
pub(crate) mod lanes;
pub(crate) mod leading_one;
pub(crate) mod logarithm;
pub(crate) mod rescaler;
pub(crate) mod saturated;
pub(crate) mod unfolder;
