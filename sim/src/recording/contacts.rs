//! The contacts of a result: what the live page draws and a recording holds as wrenches.

use dermis_golden::flags::Flag;
use dermis_golden::reconstruct::Reconstruction;
use serde::Serialize;

/// The force of one contact.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ContactForce {
    /// Centre of pressure in mm from the array's centre; `None` without compressive forces.
    pub centre_mm: Option<[f64; 2]>,
    /// Force in N, [x, y, normal].
    pub force_N: [f64; 3],
    /// Standard deviation of the force in N; `None` where the estimator gives none.
    pub sigma_N: Option<[f64; 3]>,
}

/// The contacts that the estimator tells apart, else the regions, else the resultants; the whole array as one contact where
/// it is one subarray with a contact.
pub fn contacts(result: &Reconstruction) -> Vec<ContactForce> {
    let plain = |centre_mm, force_N| ContactForce { centre_mm, force_N, sigma_N: None };
    let extra = &result.extra;
    if let Some(found) = &extra.contacts {
        let contact = |own: &dermis_golden::evidence::ContactEstimate| ContactForce {
            sigma_N: Some(own.sigma_N),
            ..plain(Some(own.centre_mm), own.force_N)
        };
        return found.iter().map(contact).collect();
    }
    if let Some(regions) = &extra.regions {
        return regions.iter().map(|region| plain(region.centre_mm, region.load_N)).collect();
    }
    if let Some(resultants) = &extra.resultants {
        return resultants.iter().map(|own| plain(own.centre_mm, own.force_N)).collect();
    }
    match result.subarrays.as_slice() {
        [whole] if !result.flags.contains(&Flag::NoContact) => {
            vec![plain(whole.compression_centroid_mm, result.resultant_N)]
        }
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dermis_golden::float::Golden;
    use dermis_golden::frame::Frame;
    use dermis_golden::scene::Scene;

    #[test]
    fn estimated_contacts_come_first_and_one_subarray_is_one_contact() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let frame = Frame::shipped(&scene).remove(0);
        let estimated = Golden::new(&scene).unwrap().run(&frame).unwrap();
        let found = contacts(&estimated);
        assert_eq!(found[0].sigma_N, Some(estimated.extra.contacts.as_ref().unwrap()[0].sigma_N));
        let golden = Golden::new(&scene.for_hardware()).unwrap();
        let searched = golden.run(&frame).unwrap();
        let (force_N, centre_mm) = (searched.resultant_N, searched.subarrays[0].compression_centroid_mm);
        assert_eq!(contacts(&searched), [ContactForce { centre_mm, force_N, sigma_N: None }]);
        let still = Frame::from_stress("still", &scene.sensor, vec![0.0; 64]).unwrap();
        assert_eq!(contacts(&golden.run(&still).unwrap()), []);
    }
}
