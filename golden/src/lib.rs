//! Golden models of Dermis: from one frame of normal stress on a tactile array to the force vector on each taxel.
//!
//! A force on the elastic cover of the array causes normal stress on the taxels below it, whether it presses or shears.
//! With C = [Cx Cy Cz] the influence matrices and b the measured stress, forces proportional to one pressure
//! distribution, x = (μ1 p, μ2 p, p), cause exactly b if
//!
//! ```text
//! (μ1 Cx + μ2 Cy + Cz) p = b
//! ```
//!
//! For each μ = (μ1, μ2) this determines p, as a polynomial p(μ) = Σ v_ij μ1^i μ2^j with v_00 = Cz⁺ b. Two unknowns
//! remain per subarray; a search over |μ| ≤ mu_max takes the μ whose p looks most like a contact. [`estimate`] computes
//! this in floating point, [`fixed`] bit for bit as the generated hardware does.
//!
//! # Example
//!
//! ```
//! use dermis_golden::{data::frame::Frame, estimate::float::Golden, spec::scene::Scene};
//!
//! let scene = Scene::builtin("sensor-1")?;
//! let frame = Frame::shipped(&scene).remove(1);
//! let result = Golden::new(&scene)?.run(&frame)?;
//! // The frame was computed from a known contact: the normal force is found to 1 %.
//! let [_, _, normal] = frame.resultant_N.ok_or("no known forces")?;
//! assert!((result.resultant_N[2] / normal - 1.0).abs() < 0.01);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Data flow
//!
//! ```text
//! scene ─┬─ sensor ── influence ── matrices ───────────┐
//!        └─ partition ─┐                               │
//! frame ── quantise ── reception                        │
//!    └──── gather ──── float::pass ── float::search ── float::forces ─ reconstruct
//!                      v_ij           μ               fx, fy, fz      resultant, errors, flags
//! ```
//!
//! Each folder uses itself and those above it in this table:
//!
//! | folder | content |
//! |---|---|
//! | [`spec`] | what is stated beforehand: scene, sensor, partition, board |
//! | [`physics`] | influence of forces on stress, and its matrices |
//! | [`data`] | frames, their generator and importers, calibration, codes |
//! | [`result`] | forces, errors, flags: what all engines return |
//! | [`estimate`] | forces from stress in floating point; the golden engine |
//! | [`fixed`] | the same stages in integers, bit for bit the hardware; formats, cycles, resources |
//! | [`wire`] | packets and registers between a computer and the hardware |
//!
//! Beside them stand [`mod@write`], atomic file writing, [`plain_words`], what readers of JSON and TOML say, [`random`], seeded random
//! numbers, [`quantile`], and bounded reading, which is private. The crate `dermis-study` measures errors against noise, sensor faults,
//! conditioning and the paper.
//!
//! # Conventions
//!
//! Units are mm, N and MPa; compression is positive. Taxel (row, col) has index row·cols + col. x points towards higher
//! columns, y towards higher rows, both from the array's centre. fx and fy act on the elastic body.

pub mod data;
pub mod engine;
pub mod estimate;
pub mod fixed;
pub mod physics;
pub mod plain_words;
pub mod quantile;
pub mod random;
pub mod result;
pub mod spec;
pub mod wire;
pub mod write;

mod read;
#[cfg(test)]
mod reference;
