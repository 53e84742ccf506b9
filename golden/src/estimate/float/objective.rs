//! Objective: a score for how much a candidate p looks like real contact forces, and the search for the best μ.
//!
//! | name | Π, maximised | right for |
//! |---|---|---|
//! | [`Sparse`] | −Σ log2(ε + \|p_i\|/Σp): force on few taxels | any shape, hardly any noise |
//! | [`Compressive`] | −Σ min(p, 0)²/(Σp)²: the paper's constraint i) alone | a baseline |
//! | [`Symmetric`] | pressure symmetric about its centre | noise, symmetric shapes |
//! | [`Patch`] | likelihood of one elliptic contact | noise, one contact per subarray |
//! | [`Auto`] | one of the above, chosen by frame and noise floor | – |
//!
//! | | shape | unit | range |
//! |---|---|---|---|
//! | in: p | n | N | finite |
//! | out: Π | scalar | bits | at most −n log2 ε; none where Σp ≤ 0 |
//!
//! The score does not depend on the scale of p. Used by `search`.

mod auto;
mod compressive;
pub mod disc;
pub mod ellipse;
mod estimate;
mod fit;
pub(crate) mod multi_ellipse;
mod patch;
mod radial;
mod sparse;
mod symmetric;
mod symmetric_pressure;
pub mod taxels;

pub use auto::Auto;
pub use compressive::Compressive;
pub use estimate::{MuEstimate, Objective, SearchInput};
pub(crate) use fit::misfit_limit;
pub use patch::Patch;
pub use sparse::{Sparse, EPSILON};
pub use symmetric::Symmetric;

use crate::spec::scene::{Medium, ObjectiveKind};
use crate::spec::sensor::Sensor;

/// The objective of `kind` for subarrays of the shape of `sensor` under `medium`.
pub fn of_kind(kind: ObjectiveKind, sensor: &Sensor, medium: Medium) -> Box<dyn Objective + Send + Sync> {
    match kind {
        ObjectiveKind::Sparse => Box::new(Sparse::default()),
        ObjectiveKind::Compressive => Box::new(Compressive),
        ObjectiveKind::Symmetric => Box::new(Symmetric::new(sensor, medium)),
        ObjectiveKind::Patch => Box::new(Patch::new(sensor, medium)),
        ObjectiveKind::Auto => Box::new(Auto::new(sensor, medium)),
    }
}
