//! Output: one force and its centre of pressure per subarray or contact, with `output.forces = "resultants"`.
//!
//! F = Σ f, centre = Σ fz r / Σ fz over the taxels with compressive forces.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: forces | 3 × taxels | N |
//! | out: force | 3 per subarray, or per region of `partition.case = "contacts"` | N |
//! | out: centre | 2, `None` without compressive forces | mm from the array's centre |

use crate::frame::Forces;
use crate::sensor::Sensor;
use serde::{Deserialize, Serialize};

/// The resultant force on one subarray or contact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Resultant {
    /// Sum of the forces in N, [x, y, normal].
    pub force_N: [f64; 3],
    /// Centre of pressure in mm from the array's centre; `None` without compressive forces.
    pub centre_mm: Option<[f64; 2]>,
}

/// Standard deviation of the shear μ·`normal_N` of one contact, [x, y], from that of its μ. That of the normal force, which is
/// a few tenths of a percent, is not in it; an estimator that knows μ alone does not give it.
pub fn shear_sigma_N(mu_sigma: Option<[f64; 2]>, normal_N: f64) -> Option<[f64; 2]> {
    mu_sigma.map(|sigma| sigma.map(|sigma| sigma * normal_N.abs()))
}

impl Resultant {
    /// The resultant of `forces`, row-major over the array, on some of its taxels.
    pub(crate) fn of(sensor: &Sensor, forces: &Forces, taxels: impl Iterator<Item = usize>) -> Resultant {
        let (mut force_N, mut pressed, mut moment) = ([0.0; 3], 0.0, [0.0; 2]);
        for k in taxels {
            let own = [forces.fx[k], forces.fy[k], forces.fz[k]];
            (0..3).for_each(|axis| force_N[axis] += own[axis]);
            let load = own[2].max(0.0);
            let place = sensor.position_mm(k / sensor.cols, k % sensor.cols);
            pressed += load;
            (0..2).for_each(|axis| moment[axis] += load * place[axis]);
        }
        Resultant { force_N, centre_mm: (pressed > 0.0).then(|| moment.map(|m| m / pressed)) }
    }
}
