//! Classifies a fault by what a receiver of the output stream can notice.

use dermis_golden::fixed::stages::send::{
    Status, FLAG_COEFFICIENTS, FLAG_CONDITION, FLAG_FOUND, FLAG_FRAMING, STATUS_BEATS,
};

use super::super::drive::{Beat, Recording};
use super::super::stress::Sample;

/// Effect of a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Outcome {
    /// Every beat is right.
    Harmless,
    /// A beat is wrong and the device reports it.
    Detected,
    /// Beats are missing.
    Hang,
    /// A beat is wrong and the device reports nothing; the largest force error relative to the frame's largest
    /// component.
    Silent(f64),
}

/// Classifies the output recorded for these samples.
pub(super) fn classify(recording: &Recording, samples: &[&Sample]) -> Outcome {
    let beats = &recording.beats;
    let ends: Vec<usize> = samples
        .iter()
        .scan(0, |end, sample| {
            *end += sample.beats.len();
            Some(*end)
        })
        .collect();
    let all = ends.last().copied().unwrap_or(0);
    let wrong_last = beats.iter().enumerate().any(|(index, beat)| beat.last != ends.contains(&(index + 1)));
    match (wrong_last || beats.len() > all, beats.len() < all) {
        // A frame of the wrong length: a receiver that counts beats notices.
        (true, _) => return Outcome::Detected,
        (false, true) => return Outcome::Hang,
        (false, false) => {}
    }
    let mut rest = &beats[..];
    let (mut equal, mut reported, mut error) = (recording.violations.is_empty(), false, 0.0f64);
    for sample in samples {
        let (own, after) = rest.split_at(sample.beats.len());
        rest = after;
        equal &= own.iter().map(|beat| beat.data).eq(sample.beats.iter().copied());
        error = error.max(force_error(&own[..sample.forces], &sample.beats[..sample.forces]));
        reported |= reports_error(&own[sample.forces..], &sample.beats[sample.forces..]);
    }
    match (equal, reported) {
        (true, _) => Outcome::Harmless,
        (false, true) => Outcome::Detected,
        (false, false) => Outcome::Silent(error),
    }
}

/// Largest difference of a component, relative to the frame's largest component.
fn force_error(got: &[Beat], wanted: &[[i32; 3]]) -> f64 {
    let difference = |(got, wanted): (i32, i32)| (f64::from(got) - f64::from(wanted)).abs();
    let pairs = got.iter().zip(wanted).flat_map(|(got, wanted)| got.data.into_iter().zip(*wanted));
    let largest = wanted.iter().flatten().fold(0.0f64, |most, &word| most.max(f64::from(word).abs()));
    pairs.map(difference).fold(0.0, f64::max) / largest.max(1.0)
}

/// Whether a status reports an error that the model's status does not report.
fn reports_error(got: &[Beat], wanted: &[[i32; 3]]) -> bool {
    let got: Vec<[i32; 3]> = got.iter().map(|beat| beat.data).collect();
    got.chunks(STATUS_BEATS).zip(wanted.chunks(STATUS_BEATS)).any(|(got, wanted)| {
        let flags = |beats| Status::of_beats(beats).map_or([false; 4], |status| error_flags(&status));
        flags(got).into_iter().zip(flags(wanted)).any(|(got, wanted)| got && !wanted)
    })
}

/// Error indications of a status: framing flag, coefficient flag, saturations, search without result.
fn error_flags(status: &Status) -> [bool; 4] {
    let flag = |bit: u32| status.flags & bit != 0;
    let saturated = status.rescale_saturations + status.force_saturations > 0;
    [flag(FLAG_FRAMING), flag(FLAG_COEFFICIENTS), saturated, flag(FLAG_CONDITION) && !flag(FLAG_FOUND)]
}
