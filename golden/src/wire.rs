//! Wire: how an engine exchanges frames and forces with a computer.
//!
//! | module | content |
//! |---|---|
//! | [`link`] | packets between a host and a board |
//! | [`udp`] | packets between a host and a core behind Ethernet |
//! | [`registers`] | the register map of an engine on a bus |

pub mod link;
pub mod registers;
pub mod udp;
