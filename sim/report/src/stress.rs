//! The table of `dermis stress`.

use super::table::aligned;
use dermis_cosim::stress::Outcome;

/// One row per experiment, and the violations below.
pub fn stress(outcomes: &[Outcome]) -> String {
    let head = [
        "scene",
        "experiment",
        "cycles",
        "stalled",
        "frames in",
        "frames out",
        "alone, in time",
        "wrong tlast",
        "frames cut",
        "flagged",
        "images",
        "refused",
        "broken",
        "resets",
        "of cycles",
        "longest",
        "violations",
    ];
    let line = |o: &Outcome| {
        let counts = [
            o.cycles,
            o.stalled,
            o.frames_in,
            o.frames_out,
            o.timed,
            o.wrong_tlast,
            o.cut,
            o.flagged,
            o.images,
            o.images_refused,
            o.images_broken,
            o.resets,
            o.possible_reset_cycles,
            o.longest_reset,
            o.violations,
        ];
        let names = [o.scene.clone(), o.experiment.to_owned()];
        names.into_iter().chain(counts.iter().map(u64::to_string)).collect()
    };
    let mut text = aligned(2, &head, outcomes.iter().map(line).collect());
    for outcome in outcomes {
        for violation in &outcome.first {
            let Outcome { scene, experiment, .. } = outcome;
            text.push_str(&format!("- {scene}, {experiment}, cycle {}: {}\n", violation.cycle, violation.rule));
        }
    }
    text
}
