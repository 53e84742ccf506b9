//! Matching: the contacts that a result found beside the true ones.
//!
//! Pairs are taken in order of the distance of their centres, each contact once. A true contact without a partner is
//! found with no force.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: found and true contacts | centre, force, standard deviation | mm, N |
//! | out: partner of each true contact | – | – |

use crate::evidence::ContactEstimate;
use crate::generator::draws::ContactTruth;
use crate::reconstruct::Reconstruction;

/// A contact of a result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoundContact {
    /// Centre of pressure in mm from the array's centre.
    pub centre_mm: [f64; 2],
    /// Force in N, [x, y, normal].
    pub force_N: [f64; 3],
    /// Standard deviation of the force, if the estimator gives it.
    pub sigma_N: Option<ForceSigma>,
}

/// Standard deviation of a force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceSigma {
    /// N, [x, y].
    pub shear: [f64; 2],
    /// N; `None` where the estimator gives that of μ only.
    pub normal: Option<f64>,
}

impl ForceSigma {
    /// That of an estimator that knows μ alone.
    fn of_shear(shear_sigma_N: Option<[f64; 2]>) -> Option<ForceSigma> {
        shear_sigma_N.map(|shear| ForceSigma { shear, normal: None })
    }
}

/// The contacts of a result: those of `evidence`, its regions, or the whole array as one.
pub fn found(result: &Reconstruction) -> Vec<FoundContact> {
    if let Some(contacts) = &result.extra.contacts {
        let contact = |own: &ContactEstimate| {
            let [x, y, normal] = own.sigma_N;
            let sigma_N = Some(ForceSigma { shear: [x, y], normal: Some(normal) });
            FoundContact { centre_mm: own.centre_mm, force_N: own.force_N, sigma_N }
        };
        return contacts.iter().map(contact).collect();
    }
    match &result.extra.regions {
        Some(regions) => {
            let contact = |region: &crate::reconstruct::Region| {
                let sigma_N = ForceSigma::of_shear(region.shear_sigma_N);
                Some(FoundContact { centre_mm: region.centre_mm?, force_N: region.load_N, sigma_N })
            };
            regions.iter().filter_map(contact).collect()
        }
        None => {
            // Of several subarrays each has a μ of its own.
            let sigma_N = match result.subarrays.as_slice() {
                [one] => ForceSigma::of_shear(one.shear_sigma_N),
                _ => None,
            };
            vec![FoundContact { centre_mm: [0.0; 2], force_N: result.resultant_N, sigma_N }]
        }
    }
}

/// The partner of each true contact.
pub fn partners(found: &[FoundContact], truth: &[ContactTruth]) -> Vec<Option<FoundContact>> {
    let distance = |f: usize, t: usize| {
        let ([x, y], [u, v]) = (found[f].centre_mm, truth[t].centre_mm);
        (x - u).hypot(y - v)
    };
    let mut pairs: Vec<(usize, usize)> = (0..found.len()).flat_map(|f| (0..truth.len()).map(move |t| (f, t))).collect();
    pairs.sort_by(|a, b| distance(a.0, a.1).total_cmp(&distance(b.0, b.1)));
    let mut partners = vec![None; truth.len()];
    let mut taken = vec![false; found.len()];
    for (f, t) in pairs {
        if !taken[f] && partners[t].is_none() {
            taken[f] = true;
            partners[t] = Some(found[f]);
        }
    }
    partners
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generator::draws::Shape;

    #[test]
    fn the_nearest_pair_comes_first() {
        let truth = [[0.0, 0.0], [10.0, 0.0], [0.0, 30.0]].map(|centre_mm| ContactTruth {
            shape: Shape::Ring,
            centre_mm,
            force_N: [0.0; 3],
        });
        let found = [[9.0, 0.0], [4.0, 0.0]].map(|centre_mm| FoundContact {
            centre_mm,
            force_N: [centre_mm[0], 0.0, 1.0],
            sigma_N: None,
        });
        let partners = partners(&found, &truth);
        assert_eq!(partners, [Some(found[1]), Some(found[0]), None]);
    }
}
