//! Classifies a fault by what a receiver of the output stream can notice.

use dermis_golden::fixed::stages::send::{Status, STATUS_BEATS};
use dermis_golden::result::flags::{Flag, FlagSet};

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
        match [got, wanted].map(Status::of_beats) {
            [Some(got), Some(wanted)] => {
                let additional = |flag: Flag| !errors(&wanted).contains(flag);
                (got.framing && !wanted.framing) || errors(&got).iter().any(additional)
            }
            _ => false,
        }
    })
}

/// The flags of a status that report an error; the others describe the frame.
fn errors(status: &Status) -> FlagSet {
    let describes = |flag: &Flag| matches!(flag, Flag::NoContact | Flag::ConditionUnmet | Flag::TooManyContacts);
    status.flags().iter().filter(|flag| !describes(flag)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beats(status: &[[i32; 3]]) -> Vec<Beat> {
        status.iter().map(|data| Beat { cycle: 0, data: *data, last: false }).collect()
    }

    /// Each flag of a status is an error report, or describes the frame; so a new one is reported unless it is named here.
    #[test]
    fn each_flag_of_a_status_is_an_error_or_describes_the_frame() {
        let good = Status { condition: true, found: true, ..Status::default() };
        let reports = |status: Status| reports_error(&beats(&status.beats()), &good.beats());
        assert!(!reports(good));
        for flag in Flag::ALL.into_iter().filter(|flag| flag.status_bit().is_some()) {
            let describes = [Flag::NoContact, Flag::TooManyContacts].contains(&flag);
            assert_eq!(reports(Status { raised: FlagSet::raised([(flag, true)]), ..good }), !describes, "{flag:?}");
        }
        assert!(reports(Status { framing: true, ..good }) && reports(Status { found: false, ..good }));
        assert!(reports(Status { force_saturations: 1, ..good }));
        assert!(!reports(Status { condition: false, ..good }) && !reports(Status { score: 7, ..good }));
        // What the model reports too is no detection.
        let both = Status { framing: true, found: false, ..good };
        assert!(!reports_error(&beats(&both.beats()), &both.beats()));
    }
}
