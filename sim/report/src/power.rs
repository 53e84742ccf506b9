//! The tables of `dermis power`.

use dermis_study::paper::powers;

use super::document::two_digits;
use super::table::aligned;
use dermis_cosim::power::PowerEstimate;

/// What the estimate is, in a sentence.
pub(super) const WHAT: &str =
    "An estimate of the engine alone, without pins, link and oscillator, calibrated against no board";

/// Two ends with two significant digits each, which is more than they mean.
pub(super) fn range(ends: [f64; 2]) -> String {
    let [lower, upper] = ends.map(|value| {
        let unit = 10_f64.powf((value.abs().max(f64::MIN_POSITIVE).log10() - 1.0).floor());
        two_digits((value / unit).round() * unit)
    });
    format!("{lower} … {upper}")
}

/// A row per stage; then power and energy per frame at each rate, beside the published power.
pub fn power(estimate: &PowerEstimate) -> String {
    let toggles = &estimate.toggles;
    let stages = toggles.stages.iter().zip(&estimate.stages_nJ).map(|(stage, energy)| {
        let bits = stage.register_bits.to_string();
        vec![stage.stage.to_owned(), bits, format!("{:.0}", stage.toggles), range(*energy)]
    });
    let mut text = aligned(1, &["stage", "register bits", "changes per frame", "nJ per frame"], stages.collect());
    text.push_str(&format!(
        "{} frames back to back, {:.0} cycles from one to the next; clock and static power apart\n\n",
        toggles.frames, toggles.interval
    ));
    let row = |name: &str, per_second: String, power: [f64; 2], energy: String| {
        vec![name.to_owned(), per_second, range(power), energy]
    };
    let mut rows = vec![
        row("static", String::new(), estimate.static_mW, String::new()),
        row("clock", String::new(), estimate.clock_mW, String::new()),
    ];
    rows.extend(estimate.rates.iter().map(|rate| {
        let per_second = format!("{:.0}", rate.frames_per_second);
        row(&format!("all, {}", rate.name), per_second, rate.power_mW, range(rate.frame_uJ))
    }));
    text.push_str(&aligned(1, &["power", "frames per second", "mW", "µJ per frame"], rows));
    text.push_str(&format!("{} at {} MHz. {WHAT}.\n", estimate.device, estimate.clock_MHz));
    for published in powers() {
        let columns = [published.system, published.sensor, published.source];
        text.push_str(&format!("{}, {}: {} W ({})\n", columns[0], columns[1], published.power_W, columns[2]));
    }
    text.push_str(&format!("energies: {}\n", estimate.source));
    text
}
