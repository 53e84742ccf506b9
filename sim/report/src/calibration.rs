//! What `dermis calibrate` prints: the fields of the scene, and the residuals of the loads or what presses tell of the gains.

use dermis_golden::data::input::known_loads::{Curvature, LoadFit};
use dermis_golden::estimate::blind_gains::BlindGains;

use super::document::percent_text;
use super::table::{markdown, significant_digits};

/// What a calibration found: the `fields` of the scene that follow from it, with where they stand in words, and its residuals.
pub fn calibration(fit: &LoadFit, stand: &str, fields: &str) -> String {
    let mut text = String::new();
    for stress_MPa in &fit.saturated_MPa {
        text += &format!(
            "left out: the load of {stress_MPa} MPa, whose readings stand at the end of the converter's range\n"
        );
    }
    if let Some(Curvature { line_share, ratio, .. }) = &fit.curvature {
        let off = percent_text(*line_share);
        text += &format!(
            "curved: straight lines leave {off} of the range, {ratio:.0} times what the taxels' scatter explains; input.curve has the \
             characteristic, which the floating-point model takes and the hardware does not\n"
        );
    } else if let Some(share) = fit.curved_share() {
        let off = percent_text(share);
        text += &format!(
            "curved: the readings are no straight line of the load, off by {off} of the largest one; see below. With four \
             loads under which they rise, one of them 0, a curve is fitted\n"
        );
    }
    text += &format!("{stand}:\n\n{fields}");
    if fit.noise_MPa.is_none() {
        text += "\nnoise unknown: no load has more than one frame\n";
    }
    if fit.residuals.is_empty() {
        return text + "\nresiduals unknown: three different loads are needed, so that one can be left out\n";
    }
    let head = ["load left out, MPa", "frames", "mean, MPa", "RMS, MPa", "largest, MPa", "taxel"];
    let rows = fit.residuals.iter().map(|residual| {
        let [row, col] = residual.taxel;
        let stresses = [residual.mean_MPa, residual.rms_MPa, residual.largest_MPa];
        let [mean, rms, largest] = stresses.map(|stress| format!("{stress:+.2e}"));
        let load = significant_digits(residual.stress_MPa, residual.stress_MPa);
        vec![load, residual.frames.to_string(), mean, rms.replace('+', ""), largest, format!("{row},{col}")]
    });
    text + "\nEach load compared with the table of the others:\n\n" + &markdown(&head, rows.collect())
}

/// What presses of unknown load found: the `fields` of the scene that follow, with where they stand in words.
pub fn blind_gains(gains: &BlindGains, stand: &str, fields: &str) -> String {
    let BlindGains { presses, flagged, spoiled, unseen, smooth, spread_before, spread_after, rise, .. } = gains;
    let mut text = format!("{presses} presses");
    if *flagged > 0 {
        text += &format!(
            "; left out: {flagged} frames that are saturated, clipped or have a faulty line, {spoiled} presses"
        );
    }
    let [before, after] = [spread_before, spread_after].map(|spread| percent_text(*spread));
    text += &format!("\nspread of the gains: {before} before, at least {after} after\n");
    text += &format!(
        "gains of one half raise the log likelihood of a press of the other by {:.2}, standard error {:.2}\n",
        rise[0], rise[1]
    );
    if !unseen.is_empty() {
        let places: Vec<String> = unseen.iter().map(|[row, col]| format!("{row},{col}")).collect();
        text += &format!("keep their gain, too few presses load them: {}\n", places.join(" "));
    }
    text += &format!(
        "unknown: the common scale and {} patterns that change slowly over the array, which stay as they are\n",
        smooth - 1
    );
    if stand.is_empty() {
        return text + "\n" + fields;
    }
    text + &format!("{stand}:\n\n{fields}")
}
