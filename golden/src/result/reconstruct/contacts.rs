//! Contacts: those that a result tells apart, in one form for all estimators.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: contacts of `evidence`, else regions | – | – |
//! | out: force, μ, centre, standard deviations, number of taxels | per contact | N, –, mm, – |

use super::contact_estimate::ContactEstimate;
use super::{Reconstruction, Region, Resultant, SubarrayResult};
use crate::result::flags::Flag;
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

    /// With the μ of its subarray and the standard deviations.
    fn deviating(self, own: &SubarrayResult) -> FoundContact {
        let SubarrayResult { mu, mu_sigma, shear_sigma_N, normal_sigma_N, .. } = *own;
        FoundContact { mu, mu_sigma, shear_sigma_N, normal_sigma_N, ..self }
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

    /// The same; else the resultants of subarrays; else the whole array as one contact, where it is one subarray with a contact.
    pub fn all_contacts(&self) -> Vec<FoundContact> {
        let plain = |centre_mm, force_N| FoundContact { centre_mm, force_N, ..FoundContact::default() };
        if let Some(found) = self.contacts() {
            return found;
        }
        if let Some(resultants) = &self.extra.resultants {
            let own = |(own, part): (&Resultant, &SubarrayResult)| plain(own.centre_mm, own.force_N).deviating(part);
            return resultants.iter().zip(&self.subarrays).map(own).collect();
        }
        match self.subarrays.as_slice() {
            [whole] if !self.flags.contains(&Flag::NoContact) => {
                vec![plain(whole.compression_centroid_mm, self.resultant_N).deviating(whole)]
            }
            _ => Vec::new(),
        }
    }

    /// Standard deviation of the resultant in N, [x, y, normal], the contacts being independent; `None` unless each has one.
    pub fn sigma_N(&self) -> Option<[f64; 3]> {
        let all: Option<Vec<[f64; 3]>> = self.contacts()?.iter().map(FoundContact::sigma_N).collect();
        let all = all.filter(|all| !all.is_empty())?;
        Some([0, 1, 2].map(|axis| all.iter().map(|own| own[axis].powi(2)).sum::<f64>().sqrt()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::frame::Frame;
    use crate::estimate::float::Golden;
    use crate::spec::scene::Scene;

    #[test]
    fn estimated_contacts_come_first_and_one_subarray_is_one_contact() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let frame = Frame::shipped(&scene).remove(0);
        let estimated = Golden::new(&scene).unwrap().run(&frame).unwrap();
        let found = estimated.all_contacts();
        assert_eq!(found[0].sigma_N(), Some(estimated.extra.contacts.as_ref().unwrap()[0].sigma_N));
        let golden = Golden::reference(&scene).unwrap();
        let searched = golden.run(&frame).unwrap();
        let (force_N, own) = (searched.resultant_N, &searched.subarrays[0]);
        let whole = FoundContact { centre_mm: own.compression_centroid_mm, force_N, mu: own.mu, ..Default::default() };
        assert_eq!(searched.all_contacts(), [whole]);
        let still = Frame::from_stress("still", &scene.sensor, vec![0.0; 64]).unwrap();
        assert_eq!(golden.run(&still).unwrap().all_contacts(), []);
    }
}
