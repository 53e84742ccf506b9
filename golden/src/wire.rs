//! Wire: how an engine exchanges frames and forces with a computer.
//!
//! | module | content |
//! |---|---|
//! | [`link`] | packets between a host and a board |
//! | [`registers`] | the register map of an engine on a bus |

pub mod link;
pub mod registers;
