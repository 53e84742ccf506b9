//! The Python package `dermis`: scenes, reconstructions and boards on NumPy arrays.
//!
//! ```text
//! array (rows, cols) or (time, rows, cols) ── frame ── Golden, Model ── reconstruction ── arrays, contacts, flags
//!             frame by frame ── tracker ───────────────────┘
//! ```
//! Everything is computed by the crates of this workspace; here values are only converted. What a result or error says
//! is what the program `dermis` says of the same input.
//!
//! | module | does |
//! |---|---|
//! | [`arrays`] | arrays of numbers to and from Python |
//! | [`errors`] | relative errors of a force |
//! | [`exceptions`] | errors of the crates as Python exceptions |
//! | [`frame`] | frames with known forces, and frames from arrays |
//! | [`contact`] | contacts as dictionaries |
//! | [`datasets`] | results and frames as datasets of xarray |
//! | [`reconstruction`] | results |
//! | [`scene`] | scenes, and what is computed of them |
//! | [`tracker`] | frames in the order of time, one by one |
//! | [`stress`] | stress of forces on the surface |
//! | [`trace`] | the stages of a frame, integers beside floating point |
//! | [`noise`] | errors under noise |
//! | [`board`] | a board on a serial port |
//!
//! The interpreter is released while a model computes. `python/dermis/_dermis.pyi` has the types, which a test compares with
//! this module.

pub mod arrays;
pub mod board;
pub mod contact;
pub mod datasets;
pub mod errors;
pub mod exceptions;
pub mod frame;
pub mod noise;
pub mod reconstruction;
pub mod scene;
pub mod stress;
pub mod trace;
pub mod tracker;

/// What Python imports as `dermis._dermis`; the package `dermis` hands it on.
#[pyo3::pymodule]
mod _dermis {
    use dermis_golden::result::flags::Flag;
    use pyo3::prelude::*;
    use pyo3::types::PyTuple;

    /// `FLAGS`: the names of all flags, in the order of their numbers.
    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("FLAGS", PyTuple::new(module.py(), Flag::ALL.map(Flag::name))?)
    }

    #[pymodule_export]
    use crate::board::{Answers, Board, BoardError};
    #[pymodule_export]
    use crate::errors::{errors, Errors};
    #[pymodule_export]
    use crate::exceptions::InputError;
    #[pymodule_export]
    use crate::frame::{frames_to_xarray, Frame};
    #[pymodule_export]
    use crate::reconstruction::{Contact, Reconstruction, Reconstructions};
    #[pymodule_export]
    use crate::scene::Scene;
    #[pymodule_export]
    use crate::trace::Stage;
    #[pymodule_export]
    use crate::tracker::Tracker;
}
