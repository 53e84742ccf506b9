//! What `dermis calibrate` prints: the fields for the scene, and the residuals of the loads.

use dermis_golden::data::input::known_loads::LoadFit;

use super::document::percent_text;
use super::table::{markdown, significant_digits};

/// Step of the full scale in MPa.
const SHOWN: f64 = 1e-3;
/// Share of a full scale that the arithmetic may add.
const ROUNDING: f64 = 1e-12;

/// The scene's fields that follow from a calibration whose table is in the file `table`, and its residuals.
pub fn calibration(fit: &LoadFit, table: &str) -> String {
    let mut text = String::new();
    for stress_MPa in &fit.saturated_MPa {
        text += &format!(
            "left out: the load of {stress_MPa} MPa, whose readings stand at the end of the converter's range\n"
        );
    }
    if let Some(share) = fit.curved_share() {
        let off = percent_text(share);
        text += &format!(
            "curved: the readings are no straight line of the load, off by {off} of the largest one; see below\n"
        );
    }
    text += &format!("{table}: offset and gain of {} taxels; for the scene:\n\n", fit.table.gain.len());
    text += &format!("[input]\ncalibration = {table:?}\n");
    // Rounded up, so that no reading is beyond it, but for the last bits of the arithmetic.
    let full_scale_MPa = (fit.full_scale_MPa * (1.0 - ROUNDING) / SHOWN).ceil() * SHOWN;
    text += &format!("full_scale_MPa = {full_scale_MPa:.3}       # at least; covers the readings of these loads\n");
    if !fit.dead.is_empty() {
        text += &format!("dead = {:?}       # readings do not follow the load\n", fit.dead);
    }
    match fit.noise_MPa {
        Some(noise) => {
            text += &format!("\n[search]\nnoise_floor_MPa = {noise:.2e}       # of one frame, as these loads show it\n")
        }
        None => text += "\nnoise unknown: no load has more than one frame\n",
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
