//! Physics: how forces on the elastic cover cause stress at the taxels, as matrices.
//!
//! | module | content |
//! |---|---|
//! | [`influence`], [`bonded`] | stress of a loaded cell on a half-space and on a layer bonded to a rigid base |
//! | [`body`] | stress of a point force on either |
//! | [`forward`] | stress of any forces on the surface, frame by frame |
//! | [`gauss`] | Gauss–Legendre quadrature |
//! | [`matrices`] | Cz⁺, Ax, Ay of a subarray |
//! | `panels` | products of a matrix with one vector after another |
//! | `smooth` | the smooth terms of a baseline |
//! | [`symmetry`] | the basis of parities, in which matrices are computed and stored |

pub mod body;
pub mod bonded;
pub mod forward;
pub mod gauss;
pub mod influence;
pub mod matrices;
pub(crate) mod panels;
pub(crate) mod smooth;
pub mod symmetry;
