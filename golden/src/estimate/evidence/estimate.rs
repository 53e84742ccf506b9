//! What the evidence says of one frame.

use crate::data::frame::Forces;
use crate::result::reconstruct::{ContactEstimate, SuspectTaxel};
use crate::spec::sensor::Sensor;

/// What one frame says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EvidenceEstimate {
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
    /// Multiplications of the posteriors of all fits of the frame from the start, in order of magnitude: the time it takes,
    /// whatever the machine.
    pub work: u64,
    /// Whether no fit explains the stress: the normal force is Σ b·area, the shear is not known.
    pub failed: bool,
    /// Root mean square of the baseline over the readings in MPa; 0 where no fit was made.
    pub baseline_MPa: f64,
    /// Taxels whose readings no force explains; they are taken as missing.
    pub suspects: Vec<SuspectTaxel>,
    /// Distance, in standard deviations, of the reading that the others explain least; `None` where no fit was made.
    pub outlier: Option<f64>,
    /// Correlation of what neighbours leave, in standard deviations; `None` where no fit was made.
    pub residual_correlation: Option<f64>,
}

impl EvidenceEstimate {
    /// Makes it that of readings `unit` times as large.
    pub(super) fn scale(&mut self, unit: f64) {
        let Forces { fx, fy, fz } = &mut self.forces_N;
        let of_contacts = self.contacts.iter_mut().flat_map(|own| own.force_N.iter_mut().chain(&mut own.sigma_N));
        let of_suspects = self.suspects.iter_mut().flat_map(|own| [&mut own.stress_MPa, &mut own.expected_MPa]);
        let all = [fx, fy, fz].into_iter().flatten().chain(of_contacts).chain(of_suspects);
        all.chain([&mut self.noise_MPa, &mut self.baseline_MPa]).for_each(|value| *value *= unit);
    }
}

impl SuspectTaxel {
    /// The taxel with this row-major index.
    pub(super) fn new(sensor: &Sensor, taxel: usize, stress_MPa: f64, expected_MPa: f64) -> SuspectTaxel {
        SuspectTaxel { row: taxel / sensor.cols, col: taxel % sensor.cols, stress_MPa, expected_MPa }
    }
}
