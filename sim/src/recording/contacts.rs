//! The contacts of a result: what the live page draws and a recording holds as wrenches.

use dermis_golden::result::flags::Flag;
use dermis_golden::result::reconstruct::{FoundContact, Reconstruction, Resultant, SubarrayResult};

/// The contacts that the estimator tells apart, else the resultants; the whole array as one contact where it is one subarray
/// with a contact.
pub fn contacts(result: &Reconstruction) -> Vec<FoundContact> {
    let plain = |centre_mm, force_N| FoundContact { centre_mm, force_N, ..FoundContact::default() };
    if let Some(found) = result.contacts() {
        return found;
    }
    if let Some(resultants) = &result.extra.resultants {
        let told = |(own, of): (&Resultant, &SubarrayResult)| deviating(of, plain(own.centre_mm, own.force_N));
        return resultants.iter().zip(&result.subarrays).map(told).collect();
    }
    match result.subarrays.as_slice() {
        [whole] if !result.flags.contains(&Flag::NoContact) => {
            let own = plain(whole.compression_centroid_mm, result.resultant_N);
            vec![deviating(whole, own)]
        }
        _ => Vec::new(),
    }
}

/// The contact with the μ of its subarray and the standard deviations.
fn deviating(own: &SubarrayResult, contact: FoundContact) -> FoundContact {
    let SubarrayResult { mu, mu_sigma, shear_sigma_N, normal_sigma_N, .. } = *own;
    FoundContact { mu, mu_sigma, shear_sigma_N, normal_sigma_N, ..contact }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dermis_golden::data::frame::Frame;
    use dermis_golden::estimate::float::Golden;
    use dermis_golden::spec::scene::Scene;

    #[test]
    fn estimated_contacts_come_first_and_one_subarray_is_one_contact() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let frame = Frame::shipped(&scene).remove(0);
        let estimated = Golden::new(&scene).unwrap().run(&frame).unwrap();
        let found = contacts(&estimated);
        assert_eq!(found[0].sigma_N(), Some(estimated.extra.contacts.as_ref().unwrap()[0].sigma_N));
        let golden = Golden::reference(&scene).unwrap();
        let searched = golden.run(&frame).unwrap();
        let (force_N, own) = (searched.resultant_N, &searched.subarrays[0]);
        let whole = FoundContact { centre_mm: own.compression_centroid_mm, force_N, mu: own.mu, ..Default::default() };
        assert_eq!(contacts(&searched), [whole]);
        let still = Frame::from_stress("still", &scene.sensor, vec![0.0; 64]).unwrap();
        assert_eq!(contacts(&golden.run(&still).unwrap()), []);
    }
}
