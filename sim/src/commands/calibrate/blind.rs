//! `dermis calibrate --blind`: the gains of a sensor from ordinary presses.

use std::path::Path;

use anyhow::{anyhow, Result};
use dermis_golden::data::frame::Frame;
use dermis_golden::estimate::blind_gains::BlindGains;
use dermis_golden::spec::scene::Scene;
use serde::Serialize;

use super::{full_scale_field, lines, save, table_field, Arguments};
use dermis_flow::progress::Progress;
use dermis_report as report;

/// The JSON of the command.
#[derive(Serialize)]
struct BlindCalibrationJson<'a> {
    scene: &'a str,
    table: Option<String>,
    offset: &'a [f64],
    gain: &'a [f64],
    #[serde(flatten)]
    found: &'a BlindGains,
}

impl Arguments {
    /// Finds the gains and writes what follows from them.
    ///
    /// # Errors
    /// A recording that cannot be read or gives no gains, a file that cannot be written.
    pub(super) fn gains_of_presses(&self, scene: &Scene, presses: &Path) -> Result<String> {
        let frames = Frame::load_all_as(presses, Some(scene), &self.layout.stated())?;
        let bar = Progress::share("gains");
        let share = |done: usize, all: usize| bar.set_share(done as f64 / all as f64);
        let gains = BlindGains::new(scene, &frames, &share)
            .map_err(|error| anyhow!("--blind {}: {error}", presses.display()))?;
        drop(bar);
        let full_scale = full_scale_field(gains.full_scale_MPa, scene, "at least; covers these presses")?;
        let fields: Vec<_> =
            table_field(self, "from presses of unknown load")?.into_iter().chain([full_scale]).collect();
        let stand = save(self, scene, &gains.table, &fields)?;
        if !self.json {
            return Ok(report::blind_gains(&gains, &stand, &lines(&fields)));
        }
        let table = self.out.as_ref().map(|out| out.display().to_string());
        let (offset, gain) = (&gains.table.offset, &gains.table.gain);
        Ok(serde_json::to_string(&BlindCalibrationJson { scene: &scene.name, table, offset, gain, found: &gains })?
            + "\n")
    }
}
