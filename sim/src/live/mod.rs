//! `dermis live`: a page in the browser that shows the newest result.
//!
//! ```text
//! lines of a stream ── Engine ──┐
//! finger ── generator ── Engine ┴─ Newest ── server ── page: draws, then asks for the next newer one
//!    ^                                          |
//!    └───────── place and forces of the mouse ──┘
//! ```
//! Only the newest picture is kept and the page asks again when it has drawn, so that a slow page leaves pictures out
//! instead of falling behind, and memory is bounded.
//!
//! | module | does |
//! |---|---|
//! | [`newest`] | the newest picture, and waiting for it |
//! | [`picture`] | a result as the page gets it |
//! | [`finger`] | frames of the contact that the page's mouse describes |
//! | [`connections`] | how many connections there are, and which one ends for a new one |
//! | [`request`] | requests of bounded size; which of them are refused |
//! | [`server`] | the connections, and what is served |

pub mod connections;
pub mod finger;
pub mod newest;
pub mod picture;
pub mod request;
pub mod server;

pub use finger::{Finger, Hand};
pub use newest::Newest;
pub use picture::{Picture, Show};
pub use server::Server;
