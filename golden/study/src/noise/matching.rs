//! Matching: the contacts that a result found beside the true ones.
//!
//! Pairs are taken in order of the distance of their centres, each contact once. A true contact without a partner is
//! found with no force.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: found and true contacts | centre, force, standard deviation | mm, N |
//! | out: partner of each true contact | – | – |

use dermis_golden::data::generator::draws::ContactTruth;
use dermis_golden::result::reconstruct::{FoundContact, Reconstruction};

/// The contacts of a result that have a centre, or the whole array as one.
pub fn found(result: &Reconstruction) -> Vec<FoundContact> {
    if let Some(contacts) = result.contacts() {
        return contacts.into_iter().filter(|contact| contact.centre_mm.is_some()).collect();
    }
    // Of several subarrays each has a μ of its own.
    let (shear_sigma_N, normal_sigma_N) = match result.subarrays.as_slice() {
        [one] => (one.shear_sigma_N, one.normal_sigma_N),
        _ => (None, None),
    };
    let (centre_mm, force_N) = (Some([0.0; 2]), result.resultant_N);
    vec![FoundContact { centre_mm, force_N, shear_sigma_N, normal_sigma_N, ..FoundContact::default() }]
}

/// The partner of each true contact.
pub fn partners(found: &[FoundContact], truth: &[ContactTruth]) -> Vec<Option<FoundContact>> {
    let distance = |f: usize, t: usize| {
        let [u, v] = truth[t].centre_mm;
        found[f].centre_mm.map_or(f64::INFINITY, |[x, y]| (x - u).hypot(y - v))
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
    use dermis_golden::data::generator::draws::ContactShape;

    #[test]
    fn the_nearest_pair_comes_first() {
        let truth = [[0.0, 0.0], [10.0, 0.0], [0.0, 30.0]].map(|centre_mm| ContactTruth {
            shape: ContactShape::Ring,
            centre_mm,
            force_N: [0.0; 3],
        });
        let found = [[9.0, 0.0], [4.0, 0.0]].map(|centre_mm| FoundContact {
            centre_mm: Some(centre_mm),
            force_N: [centre_mm[0], 0.0, 1.0],
            ..FoundContact::default()
        });
        let partners = partners(&found, &truth);
        assert_eq!(partners, [Some(found[1]), Some(found[0]), None]);
    }
}
