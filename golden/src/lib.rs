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
//! remain per subarray; a search over |μ| ≤ mu_max takes the μ whose p looks most like a contact. [`float`] computes
//! this in floating point, [`fixed`] bit for bit as the generated hardware does.
//!
//! # Example
//!
//! ```
//! use dermis_golden::{frame::Frame, float::Golden, scene::Scene};
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
//! | module | content |
//! |---|---|
//! | [`scene`] | sensor, method, number formats and hardware of a run, from TOML |
//! | [`sensor`], [`partition`] | the taxel array, and its division into subarrays |
//! | [`adc`] | converters that the hardware reads by itself, and the timing of a scan |
//! | [`board`] | the device for which hardware is generated |
//! | [`frame`] | stress on every taxel, with known forces if there are any; JSON, CSV, frames shipped with the crate |
//! | [`generator`] | frames computed from described or random contacts, with their exact forces |
//! | [`import`] | recordings of real arrays as scene and frames |
//! | [`input`] | averaging, calibration and dead taxels of a real sensor |
//! | [`quantise`], [`reception`] | stress as the codes of a converter; the condition for a search, and centroids |
//! | [`influence`], [`bonded`] | stress of a loaded cell on a half-space and on a layer bonded to a rigid base |
//! | [`matrices`], [`degree`] | Cz⁺, Ax, Ay of a subarray; how many terms the series in μ needs |
//! | [`symmetry`] | mirror images of a taxel, and the basis of parities, in which matrices are computed and stored |
//! | [`segment`] | the contact to which each taxel belongs |
//! | [`float`] | the stages in floating point, the objectives, and the golden engine that runs them |
//! | [`evidence`] | forces and standard deviations for contacts of any shape under noise |
//! | [`learned`] | shear by a small network that is trained on the scene's own physics |
//! | [`reconstruct`] | the result format of all engines |
//! | [`deviations`] | standard deviations of forces that a search found |
//! | [`misfit`] | how far a frame is from those of a network's training |
//! | [`errors`], [`flags`], [`checks`] | errors relative to known forces; limitations of a result, and their figures |
//! | [`fixed`] | the same stages in integers, bit for bit the hardware; formats, cycles, resources |
//! | [`link`] | packets between a host and a board |
//! | [`registers`] | the register map of an engine on a bus |
//! | [`baseline`], [`paper`] | the paper's algorithm as printed, and its published results, for comparison |
//! | [`noise`], [`stability`] | studies: errors with noise against the Cramér–Rao bound; errors against conditioning |
//! | [`gauss`], [`mod@write`] | Gauss–Legendre quadrature; atomic file writing |
//!
//! # Conventions
//!
//! Units are mm, N and MPa; compression is positive. Taxel (row, col) has index row·cols + col. x points towards higher
//! columns, y towards higher rows, both from the array's centre. fx and fy act on the elastic body.
#![deny(missing_docs)]
// Names carry their unit as SI writes it: `stress_MPa`, `resultant_N`.
#![allow(non_snake_case)]

pub mod adc;
pub mod baseline;
pub mod board;
pub mod bonded;
pub mod checks;
pub mod degree;
pub mod deviations;
pub mod errors;
pub mod evidence;
pub mod fixed;
pub mod flags;
pub mod float;
pub mod found_noise;
pub mod frame;
pub mod gauss;
pub mod generator;
pub mod import;
pub mod influence;
pub mod input;
pub mod learned;
pub mod link;
pub mod link_kind;
pub mod matrices;
pub mod misfit;
pub mod noise;
pub mod paper;
pub mod partition;
pub mod quads;
pub mod quantise;
mod read;
pub mod reception;
pub mod reconstruct;
pub mod registers;
pub mod scene;
pub mod segment;
pub mod sensor;
pub mod sliding;
pub mod stability;
pub mod symmetry;
pub mod window;
pub mod write;

mod random;
#[cfg(test)]
mod reference;
mod suggest;
