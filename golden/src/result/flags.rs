//! Flags: limitations of a result that a user must know before trusting it.
//!
//! | flag | raised when | by |
//! |---|---|---|
//! | `no-contact` | no taxel carries a force | [`crate::result::reconstruct::assemble`] |
//! | `no-compression` | no candidate μ leaves Σp > 0 | the engine |
//! | `condition-unmet` | a subarray does not meet the scene's condition and is not searched | `assemble` |
//! | `saturated` | a reading reached full scale, a sample the end of its converter's range, or a word of the engine saturated | [`frame_flags`], `Checks::flags`, the engine, the scan |
//! | `load-outside` | part of the contact is beyond the array's edge | `frame_flags` |
//! | `medium-mismatch` | the frame names another medium than the scene | `frame_flags` |
//! | `coefficients-damaged` | the hardware's coefficient memory has changed | the engine |
//! | `shear-unreliable` | noise floor or LSB/√12 above 5·10⁻⁵ of the peak, or noise found above 1.25·10⁻⁴, with `sparse` | `frame_flags`, [`find_noise`](crate::result::reconstruct::Reconstruction::find_noise) |
//! | `mu-at-bound` | a μ is at `search.mu_max` | [`Checks::flags`] |
//! | `implausible-stress` | a stress is above `input.plausible_MPa` | `Checks::flags` |
//! | `load-mismatch` | the normal force is far from that of the same stress without shear | `Checks::flags`, golden engine |
//! | `shear-not-resolved` | the shear's standard deviation is above a third of it | `Checks::flags`, with `search` where the noise is stated |
//! | `misfit` | the stated noise does not explain what the estimate leaves, or noise found from the frame is above a tenth of its peak; with a network also a frame unlike those of its training | `Checks::flags`, estimators but `search` |
//! | `shape-mismatch` | the shape that `patch` or `symmetric` fits leaves more than the noise | `Checks::flags`, golden engine |
//! | `too-many-contacts` | more contacts than `partition.max_contacts` or than the segmentation holds; the smallest have no shear | the engine, with a network |
//! | `tables-incomplete` | the hardware's tables are not whole: no force is computed from them | the engine |
//! | `tables-refused` | the last tables sent to the hardware were refused; it has those of before | the engine |
//! | `wrong-channel` | a converter that the hardware scans named another channel than that asked for | the scan |
//!
//! [`Checks::flags`]: crate::result::checks::Checks::flags

use crate::data::frame::Frame;
use crate::data::quantise::Codes;
use crate::spec::scene::{EstimatorKind, ObjectiveKind, Scene};
use serde::{Deserialize, Serialize};

/// A limitation of a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Flag {
    /// No taxel carries a force.
    NoContact,
    /// No candidate μ has a compressive resultant.
    NoCompression,
    /// A subarray does not meet the scene's condition and was not searched.
    ConditionUnmet,
    /// A value was clamped to the end of its range.
    Saturated,
    /// The contact extends beyond the array's edge.
    LoadOutside,
    /// Frame and scene name different media.
    MediumMismatch,
    /// Noise or quantisation is too large for the objective to determine the shear.
    ShearUnreliable,
    /// The hardware's coefficient memory does not hold the generated coefficients.
    CoefficientsDamaged,
    /// The ratio of shear to normal force is at the scene's bound; the true one may be larger.
    MuAtBound,
    /// The stress is above what a contact can plausibly cause.
    ImplausibleStress,
    /// The normal force differs from that of the same stress without shear.
    LoadMismatch,
    /// No contact of the shape that the objective assumes explains the stress within the stated noise.
    ShapeMismatch,
    /// The shear's standard deviation is above a third of it.
    ShearNotResolved,
    /// Noise of the stated size, or of a size that a sensor can have, does not explain what the estimate leaves of the
    /// stress; with a network, the frame is unlike those of its training.
    Misfit,
    /// There are more contacts than get a μ; the smallest have no shear.
    TooManyContacts,
    /// The tables of the hardware are not whole, and every stress is taken as 0.
    TablesIncomplete,
    /// The hardware refused the last tables that it was sent.
    TablesRefused,
    /// A converter that the hardware scans named another channel than that asked for.
    WrongChannel,
}

impl Flag {
    /// All flags, in order.
    pub const ALL: [Flag; 18] = [
        Flag::NoContact,
        Flag::NoCompression,
        Flag::ConditionUnmet,
        Flag::Saturated,
        Flag::LoadOutside,
        Flag::MediumMismatch,
        Flag::ShearUnreliable,
        Flag::CoefficientsDamaged,
        Flag::MuAtBound,
        Flag::ImplausibleStress,
        Flag::LoadMismatch,
        Flag::ShapeMismatch,
        Flag::ShearNotResolved,
        Flag::Misfit,
        Flag::TooManyContacts,
        Flag::TablesIncomplete,
        Flag::TablesRefused,
        Flag::WrongChannel,
    ];
}

/// Fraction of the true normal load that the cells must carry for it to count as inside.
pub const SHARE_INSIDE: f64 = 0.995;
/// Noise relative to the peak above which the sparse objective cannot determine the shear.
pub const SPARSE_NOISE_LIMIT: f64 = 5e-5;

/// The flags that depend on the frame and its codes alone, in the order of [`Flag`]; `noise_MPa` is the standard deviation
/// of a taxel of the averaged frame, 0 if it is not known, see [`crate::data::input::Input::noise_MPa`].
pub fn frame_flags(scene: &Scene, frame: &Frame, codes: &Codes, noise_MPa: f64) -> Vec<Flag> {
    let medium_differs = frame.medium.is_some_and(|medium| medium != scene.medium);
    [
        (Flag::Saturated, codes.clipped.contains(&true)),
        (Flag::LoadOutside, load_outside(frame)),
        (Flag::MediumMismatch, medium_differs),
        (Flag::ShearUnreliable, shear_unreliable(scene, frame, codes, noise_MPa)),
    ]
    .into_iter()
    .filter_map(|(flag, raised)| raised.then_some(flag))
    .collect()
}

/// With known forces: the cells carry less than the load. Without: the largest |b| is in the outermost rows or columns
/// of an array that has an interior.
fn load_outside(frame: &Frame) -> bool {
    if let (Some(cells), Some(resultant)) = (&frame.cell_forces_N, frame.resultant_N) {
        return cells.fz.iter().sum::<f64>().abs() < SHARE_INSIDE * resultant[2].abs();
    }
    let (rows, cols) = (frame.sensor.rows, frame.sensor.cols);
    if rows < 3 || cols < 3 {
        // Without an interior the position of the peak tells nothing.
        return false;
    }
    let ring = frame.stress_MPa.iter().enumerate().filter(|(index, _)| frame.sensor.is_border(*index));
    let ring_peak = ring.fold(0.0f64, |peak, (_, b)| b.abs().max(peak));
    ring_peak > 0.0 && ring_peak >= frame.peak_MPa()
}

/// Compares the noise, or the standard deviation LSB/√12 of rounding, with the peak.
fn shear_unreliable(scene: &Scene, frame: &Frame, codes: &Codes, noise_MPa: f64) -> bool {
    let search = &scene.search;
    let by_search = scene.estimator() == EstimatorKind::Search;
    let searched = by_search && search.objective == ObjectiveKind::Sparse && search.mu_max > 0.0;
    let noise = noise_MPa.max(codes.lsb_MPa() / 12f64.sqrt());
    let peak = frame.peak_MPa();
    searched && peak > 0.0 && noise > SPARSE_NOISE_LIMIT * peak
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::quantise::quantise;
    use crate::spec::scene::Medium;

    fn setting() -> (Scene, Frame) {
        let scene = Scene::builtin("sensor-1").unwrap().for_hardware();
        let frame = Frame::shipped(&scene).remove(1);
        (scene, frame)
    }

    fn flags(scene: &Scene, frame: &Frame, bits: u32, share: f64) -> Vec<Flag> {
        let peak = frame.peak_MPa();
        let full_scale = if peak > 0.0 { share * peak } else { 1.0 };
        let noise_MPa = scene.search.noise_floor_MPa * scene.input.noise_share();
        frame_flags(scene, frame, &quantise(&frame.stress_MPa, bits, full_scale), noise_MPa)
    }

    #[test]
    fn names_are_those_of_the_json() {
        let text = serde_json::to_string(&Flag::ALL).unwrap();
        let wanted = [
            "no-contact",
            "no-compression",
            "condition-unmet",
            "saturated",
            "load-outside",
            "medium-mismatch",
            "shear-unreliable",
            "coefficients-damaged",
            "mu-at-bound",
            "implausible-stress",
            "load-mismatch",
            "shape-mismatch",
            "shear-not-resolved",
            "misfit",
            "too-many-contacts",
            "tables-incomplete",
            "tables-refused",
            "wrong-channel",
        ];
        assert_eq!(text, serde_json::to_string(&wanted).unwrap());
    }

    #[test]
    fn a_good_frame_has_none() {
        let (scene, mut frame) = setting();
        assert_eq!(flags(&scene, &frame, 20, 1.0), []);
        frame.stress_MPa.fill(0.0);
        frame.cell_forces_N = None;
        assert_eq!(flags(&scene, &frame, 20, 1.0), []);
    }

    #[test]
    fn clipping_and_medium() {
        let (mut scene, frame) = setting();
        assert_eq!(flags(&scene, &frame, 20, 0.99), [Flag::Saturated]);
        scene.medium = Medium::BondedLayer { poisson: 0.48 };
        assert_eq!(flags(&scene, &frame, 20, 1.0), [Flag::MediumMismatch]);
    }

    #[test]
    fn load_outside_by_truth_and_by_the_ring() {
        let (scene, mut frame) = setting();
        frame.resultant_N = frame.resultant_N.map(|[x, y, z]| [x, y, z / 0.99]);
        assert_eq!(flags(&scene, &frame, 20, 1.0), [Flag::LoadOutside]);
        frame.cell_forces_N = None;
        assert_eq!(flags(&scene, &frame, 20, 1.0), []);
        frame.stress_MPa[9] = -frame.peak_MPa();
        assert_eq!(flags(&scene, &frame, 20, 1.0), [Flag::LoadOutside]);
    }

    #[test]
    fn without_an_interior_the_ring_says_nothing() {
        let (scene, frame) = setting();
        let outside = |rows: usize, cols: usize| {
            let sensor = crate::spec::sensor::Sensor { rows, cols, ..scene.sensor.clone() };
            let mut frame = Frame { sensor, cell_forces_N: None, ..frame.clone() };
            frame.stress_MPa = vec![0.0; rows * cols];
            frame.stress_MPa[1] = 1.0;
            flags(&Scene::of_sensor(&frame.sensor, "small"), &frame, 20, 1.0).contains(&Flag::LoadOutside)
        };
        assert_eq!([outside(2, 2), outside(2, 9), outside(9, 2), outside(3, 3)], [false, false, false, true]);
    }

    #[test]
    fn shear_needs_bits_and_quiet() {
        // LSB/√12 of the peak: 3.5e-5 with 14 bits, 7.0e-5 with 13.
        let (mut scene, frame) = setting();
        assert_eq!(flags(&scene, &frame, 14, 1.0), []);
        assert_eq!(flags(&scene, &frame, 13, 1.0), [Flag::ShearUnreliable]);
        scene.search.noise_floor_MPa = 6e-5 * frame.peak_MPa();
        assert_eq!(flags(&scene, &frame, 20, 1.0), [Flag::ShearUnreliable]);
        // The mean of two frames has less noise.
        scene.input.average = 1;
        assert_eq!(flags(&scene, &frame, 20, 1.0), []);
        scene.input.average = 0;
        scene.search.mu_max = 0.0;
        assert_eq!(flags(&scene, &frame, 20, 1.0), []);
    }
}
