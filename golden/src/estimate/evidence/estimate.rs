//! What the evidence says of one frame.

use crate::data::frame::Forces;
use crate::result::reconstruct::ContactEstimate;

/// What one frame says.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// The contacts; none without a reading above zero.
    pub contacts: Vec<ContactEstimate>,
    /// Force on each taxel in N.
    pub forces_N: Forces,
    /// Standard deviation of the noise in MPa, as it was given or as it was found.
    pub noise_MPa: f64,
    /// Probability that noise of the given size leaves as much unexplained; `None` where the noise was found from the
    /// frame itself.
    pub misfit_probability: Option<f64>,
    /// Rounds until μ stood still.
    pub rounds: usize,
    /// Number of coefficients r of the pressures.
    pub rank: usize,
}
