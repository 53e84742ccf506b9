//! Differences between two reconstructions of the same frame.
//!
//! Over all 3·taxels components: max |a − b| and RMS = √(Σ (a − b)² / 3n), in LSBs of the force word and
//! as a share of the reference's largest |component|.
//!
//! | | unit | range |
//! |---|---|---|
//! | in: reference, other, LSB | N | finite, equal lengths |
//! | out: [`Difference`] | LSB, fraction | ≥ 0; fractions 0 where the reference has no force |

use dermis_golden::data::frame::Forces;
use dermis_golden::result::reconstruct::Reconstruction;
use serde::Serialize;

/// Difference between two force fields.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Difference {
    /// Largest difference of a component, in LSBs.
    pub max_lsb: f64,
    /// Root mean square over all components, in LSBs.
    pub rms_lsb: f64,
    /// Largest difference over the reference's largest component.
    pub max_share: f64,
    /// Root mean square over the reference's largest component.
    pub rms_share: f64,
}

/// The forces by which results are compared: per taxel, or the resultants where the scene outputs only those.
pub fn comparable_forces(result: &Reconstruction) -> Forces {
    match &result.extra.resultants {
        None => result.forces_N.clone(),
        Some(all) => {
            let axis = |k: usize| all.iter().map(|resultant| resultant.force_N[k]).collect();
            Forces { fx: axis(0), fy: axis(1), fz: axis(2) }
        }
    }
}

/// Compares `other` with `reference`; `lsb_N` > 0 is the force of one LSB.
pub fn difference(reference: &Forces, other: &Forces, lsb_N: f64) -> Difference {
    let components = |f: &Forces| -> Vec<f64> { [&f.fx, &f.fy, &f.fz].into_iter().flatten().copied().collect() };
    let (reference, other) = (components(reference), components(other));
    let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, |m: f64, v| m.max(v.abs()));
    let max = largest(&mut reference.iter().zip(&other).map(|(a, b)| a - b));
    let square: f64 = reference.iter().zip(&other).map(|(a, b)| (a - b).powi(2)).sum();
    let rms = (square / reference.len().max(1) as f64).sqrt();
    let peak = largest(&mut reference.iter().copied());
    let share = |value: f64| if peak > 0.0 { value / peak } else { 0.0 };
    Difference { max_lsb: max / lsb_N, rms_lsb: rms / lsb_N, max_share: share(max), rms_share: share(rms) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn forces(fz: [f64; 2]) -> Forces {
        Forces { fx: vec![0.0; 2], fy: vec![0.0; 2], fz: fz.to_vec() }
    }

    #[test]
    fn one_component_of_six_off_by_three_lsb() {
        let d = difference(&forces([4.0, 2.0]), &forces([4.0, 0.5]), 0.5);
        // 1.5 N = 3 LSB; RMS √(9/6) LSB; peak 4 N.
        assert_eq!((d.max_lsb, d.max_share), (3.0, 0.375));
        assert!((d.rms_lsb - 1.5f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn zero_forces_give_zero_difference() {
        assert_eq!(difference(&forces([0.0; 2]), &forces([0.0; 2]), 1.0), Difference::default());
    }
}
