//! The C interface: scenes, reconstructions and the packets of a board's link, as functions for C.
//!
//! ```text
//! stress, doubles ── dermis_reconstruct ── dermis_result ── forces, contacts, flags
//!        ├── dermis_reconstruct_many ── arrays of the caller
//!        ├── dermis_stream_push, frame by frame ──────────────────────────┤
//!        ├── dermis_board_frame ── serial port, or core behind Ethernet ──┤
//!        └── dermis_link_frame ── bytes ── port, board ── bytes ── dermis_link_receive ──┘
//! ```
//! Everything is computed by the crates of this workspace; here values are only converted. What a result or error says is
//! what the program `dermis` says of the same input. `sim/c/dermis.h` is written from this source by cbindgen, which a test
//! compares; the guide's page on C shows its use.
//!
//! | module | does |
//! |---|---|
//! | [`guard`] | no panic reaches C: status codes, texts of errors, checks of pointers |
//! | [`scene`] | scenes, and reconstruction of their frames |
//! | [`result`] | results: forces, contacts with error bars, flags |
//! | [`batch`] | frames that do not depend on each other |
//! | [`stress`] | the stress that forces on the surface cause |
//! | [`mod@stream`] | frames in the order of time |
//! | [`board`] | a board, or a core behind Ethernet, that answers |
//! | [`mod@link`] | requests to a board as bytes, and its answers |
#![allow(
    unsafe_code,
    reason = "the boundary to C: pointers are checked for null, their targets are the caller's promise"
)]
// Types have the names that C gives them.
#![allow(non_camel_case_types)]
// The text of a function is also that of the header; what holds for all pointers stands at the header's top.
#![allow(clippy::missing_safety_doc)]

pub mod batch;
pub mod board;
pub mod guard;
pub mod link;
pub mod result;
pub mod scene;
pub mod stream;
pub mod stress;
