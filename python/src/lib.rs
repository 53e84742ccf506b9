//! The Python package `dermis`: scenes, reconstructions and boards on NumPy arrays.
//!
//! ```text
//! array [rows, cols] or [time, rows, cols] ── frame ── Golden, Model ── reconstruction ── arrays, contacts, flags
//! ```
//! Everything is computed by the crates of this workspace; here values are only converted. What a result or error says
//! is what the program `dermis` says of the same input.
//!
//! | module | does |
//! |---|---|
//! | [`arrays`] | arrays of numbers to and from Python |
//! | [`errors`] | errors of the crates as Python exceptions; relative errors of a force |
//! | [`frame`] | frames with known forces, and frames from arrays |
//! | [`contact`] | contacts as dictionaries |
//! | [`engine`] | the two models of a scene, built when they are first needed |
//! | [`reconstruction`] | results |
//! | [`scene`] | scenes, and what is computed of them |
//!
//! The interpreter is released while a model computes. `python/dermis/_dermis.pyi` has the types, which a test compares with
//! this module.
#![deny(missing_docs)]
// Names carry their unit as SI writes it, here and in Python: `stress_MPa`, `resultant_N`.
#![allow(non_snake_case)]

pub mod arrays;
pub mod contact;
pub mod engine;
pub mod errors;
pub mod frame;
pub mod reconstruction;
pub mod scene;

/// What Python imports as `dermis._dermis`; the package `dermis` hands it on.
#[pyo3::pymodule]
mod _dermis {
    #[pymodule_export]
    use crate::errors::{errors, Errors, InputError};
    #[pymodule_export]
    use crate::frame::Frame;
    #[pymodule_export]
    use crate::reconstruction::{Contact, Reconstruction, Reconstructions};
    #[pymodule_export]
    use crate::scene::Scene;
}
