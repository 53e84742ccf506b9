//! The table of `dermis faults`.

use super::table::{aligned, percent};
use dermis_cosim::faults::{interval, BitFlipRow, Shares, LARGE};
use dermis_hdl::state::CLASSES;

/// One row per storage class and stage; then the shares of each class, with its stages weighted by their bits.
pub fn faults(rows: &[BitFlipRow]) -> String {
    let head = [
        "class",
        "stage",
        "signals",
        "bits",
        "flipped",
        "different",
        "harmless",
        "detected",
        "hang",
        "silent",
        "silent above",
        "largest error",
        "not recovered",
    ];
    let line = |row: &BitFlipRow| {
        let counts = [
            row.signals,
            row.bits,
            row.flips,
            row.distinct_bits,
            row.harmless,
            row.detected,
            row.hang,
            row.silent,
            row.large,
        ];
        let mut cells = vec![row.class.name().to_owned(), row.stage.to_owned()];
        cells.extend(counts.iter().map(usize::to_string));
        cells.extend([percent((row.silent > 0).then_some(row.largest_error)), row.not_recovered.to_string()]);
        cells
    };
    let mut text = aligned(2, &head, rows.iter().map(line).collect());
    text.push_str(&format!(
        "bits: state bits of the stage; different: different bits flipped; hang: beats missing until the reset;\n\
         silent above: silent, with a force error above {} of the frame's largest force;\n\
         not recovered: the frame after the reset is wrong\n\n",
        percent(Some(LARGE))
    ));
    let head =
        ["of all bits of", "bits", "flipped", "harmless", "detected", "hang", "silent, 95 %", "silent above, 95 %"];
    let of = |class| {
        let class_shares = Shares::of(rows, class)?;
        let shares = [class_shares.harmless, class_shares.detected, class_shares.hang];
        let mut cells = vec![class.name().to_owned(), class_shares.bits.to_string(), class_shares.flips.to_string()];
        cells.extend(shares.map(|share| percent(Some(share))));
        let with_interval = |share, [low, high]: [f64; 2]| {
            let [share, low, high] = [share, low, high].map(|share| percent(Some(share)));
            format!("{share} ({low} … {high})")
        };
        cells.push(with_interval(class_shares.silent, class_shares.silent_interval));
        cells.push(with_interval(class_shares.large, class_shares.large_interval));
        Some(cells)
    };
    text.push_str(&aligned(1, &head, CLASSES.into_iter().filter_map(of).collect()));
    text.push_str(&format!("95 %: {}\n", interval::METHOD));
    text
}
