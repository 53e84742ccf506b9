//! Output: one force and its centre of pressure per subarray or contact, with `output.forces = "resultants"`; the wrench of
//! the whole array.
//!
//! F = Σ f, centre = Σ fz r / Σ fz over the taxels with compressive forces; M = Σ r × f over all taxels.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: forces | 3 × taxels | N |
//! | out: wrench | 3, 3 | N, N mm |
//! | out: force | 3 per subarray, or per region of `partition.case = "contacts"` | N |
//! | out: centre | 2, `None` without compressive forces | mm from the array's centre |

use crate::data::frame::Forces;
use crate::spec::sensor::Sensor;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The resultant force on one subarray or contact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Resultant {
    /// Sum of the forces in N, [x, y, normal].
    pub force_N: [f64; 3],
    /// Centre of pressure in mm from the array's centre; `None` without compressive forces.
    pub centre_mm: Option<[f64; 2]>,
}

/// Force and moment of all taxels. Axes are x along the columns, y along the rows and the normal into the sensor: right-handed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Wrench {
    /// Sum of the forces in N, [x, y, normal].
    pub force_N: [f64; 3],
    /// Moment about the array's centre in N mm, [about x, about y, about the normal]; the forces are in the plane of the
    /// surface.
    pub moment_Nmm: [f64; 3],
}

impl Wrench {
    /// The wrench of `forces`, row-major over the array; `None` if there is not one per taxel.
    pub fn of(sensor: &Sensor, forces: &Forces) -> Option<Wrench> {
        if forces.fz.len() != sensor.taxels() {
            return None;
        }
        let mut moment_Nmm = [0.0; 3];
        for k in 0..sensor.taxels() {
            let [x, y] = sensor.position_mm(k / sensor.cols, k % sensor.cols);
            let own = [y * forces.fz[k], -x * forces.fz[k], x * forces.fy[k] - y * forces.fx[k]];
            (0..3).for_each(|axis| moment_Nmm[axis] += own[axis]);
        }
        Some(Wrench { force_N: forces.resultant(), moment_Nmm })
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_by_hand() {
        let sensor = Sensor { rows: 1, cols: 3, pitch_x_mm: 2.0, pitch_y_mm: 5.0, thickness_mm: 1.0 };
        let forces = Forces { fx: vec![1.0; 3], fy: vec![0.0, 0.0, 3.0], fz: vec![1.0, 7.0, 5.0] };
        // x = −2, 0, 2 mm, y = 0: what presses at +x turns about −y, what pulls along y there turns about the normal.
        let wrench = Wrench { force_N: [3.0, 3.0, 13.0], moment_Nmm: [0.0, -8.0, 6.0] };
        assert_eq!(Wrench::of(&sensor, &forces), Some(wrench));
        let turned = Sensor { rows: 3, cols: 1, ..sensor };
        assert_eq!(Wrench::of(&turned, &forces).unwrap().moment_Nmm, [20.0, 0.0, 0.0]);
        assert_eq!(Wrench::of(&sensor, &Forces::default()), None);
    }
}
