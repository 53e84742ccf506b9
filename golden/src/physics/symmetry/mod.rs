//! The mirror symmetry of a regular rectangle, which the floating-point and the bit-true model share.
//!
//! | module | content |
//! |---|---|
//! | [`parity`] | the four parities of a quad: which matrix flips which, and with which sign an image counts |
//! | [`folded`] | vectors and matrices in the basis of parities |

pub mod folded;
pub mod parity;
