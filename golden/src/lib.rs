//! Golden models of Dermis: from one frame of normal stress under a tactile array to a force vector per taxel.
//!
//! ```text
//! scene ─┬─ sensor ── influence ── matrices ───────────┐
//!        └─ partition ─┐                               │
//! frame ── quantise ── float::receive                  │
//!    └──── gather ──── float::pass ── float::search ── float::force ── reconstruct
//!                      v_ij           μ               fx, fy, fz      resultant, errors, flags
//! ```
//!
//! [`generator`] makes frames with known forces; [`bonded`] is the influence of a layer on a rigid base.
//!
//! The method: forces x = (μ1 p, μ2 p, p), shear and pressure alike in distribution, meet the measured stress b exactly
//! when (μ1 Cx + μ2 Cy + Cz) p = b. That leaves two unknowns per subarray, found by a search over μ.
//!
//! Units are mm, N and MPa; compression is positive; a taxel's index is row·cols + col, x runs along the columns, y
//! along the rows, from the array's centre; fx and fy act on the elastic body.
#![deny(missing_docs)]
// Names carry their unit as SI writes it: `stress_MPa`, `resultant_N`.
#![allow(non_snake_case)]

pub mod baseline;
pub mod board;
pub mod bonded;
pub mod errors;
pub mod fixed;
pub mod flags;
pub mod float;
pub mod folded;
pub mod frame;
pub mod gauss;
pub mod generator;
pub mod influence;
pub mod input;
pub mod link;
pub mod matrices;
pub mod noise;
pub mod paper;
pub mod partition;
pub mod quantise;
pub mod reconstruct;
pub mod scene;
pub mod sensor;
pub mod stability;
pub mod write;

mod random;
#[cfg(test)]
mod reference;
