//! Contacts: those that a result tells apart, in one form for all estimators.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: contacts of `evidence`, else regions | – | – |
//! | out: force, μ, centre, standard deviations, number of taxels | per contact | N, –, mm, – |

use super::contact_estimate::ContactEstimate;
use super::{Reconstruction, Region};
use serde::Serialize;

/// A contact of a result. What the estimator does not give is `None`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FoundContact {
    /// Centre of pressure in mm from the array's centre; `None` without compressive forces.
    pub centre_mm: Option<[f64; 2]>,
    /// Force in N, [x, y, normal].
    pub force_N: [f64; 3],
    /// Standard deviation of the shear in N, [x, y].
    pub shear_sigma_N: Option<[f64; 2]>,
    /// Standard deviation of the normal force in N.
    pub normal_sigma_N: Option<f64>,
    /// Ratio of shear to normal force, [x, y].
    pub mu: [f64; 2],
    /// Standard deviation of μ, [x, y].
    pub mu_sigma: Option<[f64; 2]>,
    /// Covariance of μ, [xx, xy, yy].
    pub mu_covariance: Option<[f64; 3]>,
    /// Number of its taxels; `None` where contacts overlap.
    pub taxels: Option<usize>,
}

impl FoundContact {
    /// Standard deviation of the force in N, [x, y, normal], where all three are known.
    pub fn sigma_N(&self) -> Option<[f64; 3]> {
        let ([x, y], normal) = (self.shear_sigma_N?, self.normal_sigma_N?);
        Some([x, y, normal])
    }
}

impl From<&ContactEstimate> for FoundContact {
    fn from(found: &ContactEstimate) -> FoundContact {
        let [x, y, normal] = found.sigma_N;
        FoundContact {
            centre_mm: Some(found.centre_mm),
            force_N: found.force_N,
            shear_sigma_N: Some([x, y]),
            normal_sigma_N: Some(normal),
            mu: found.mu,
            mu_sigma: Some([0, 2].map(|axis| found.mu_covariance[axis].sqrt())),
            mu_covariance: Some(found.mu_covariance),
            taxels: None,
        }
    }
}

impl From<&Region> for FoundContact {
    fn from(region: &Region) -> FoundContact {
        FoundContact {
            centre_mm: region.centre_mm,
            force_N: region.load_N,
            shear_sigma_N: region.shear_sigma_N,
            normal_sigma_N: None,
            mu: region.mu,
            mu_sigma: region.mu_sigma,
            mu_covariance: None,
            taxels: Some(region.taxel_count),
        }
    }
}

impl Reconstruction {
    /// The contacts of `evidence`, else the regions; `None` where the contacts are not told apart.
    pub fn contacts(&self) -> Option<Vec<FoundContact>> {
        let estimated = self.extra.contacts.as_ref().map(|all| all.iter().map(FoundContact::from).collect());
        estimated.or_else(|| self.extra.regions.as_ref().map(|all| all.iter().map(FoundContact::from).collect()))
    }

    /// Standard deviation of the resultant in N, [x, y, normal], the contacts being independent; `None` unless each has one.
    pub fn sigma_N(&self) -> Option<[f64; 3]> {
        let all: Option<Vec<[f64; 3]>> = self.contacts()?.iter().map(FoundContact::sigma_N).collect();
        let all = all.filter(|all| !all.is_empty())?;
        Some([0, 1, 2].map(|axis| all.iter().map(|own| own[axis].powi(2)).sum::<f64>().sqrt()))
    }
}
