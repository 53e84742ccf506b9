//! Figures: what the checks of a result need of its μ and forces.

use super::Reconstruction;
use crate::data::frame::Frame;
use crate::result::checks::pull::pull_share;
use crate::result::checks::{Checks, COUNTS_FROM};
use crate::spec::scene::Scene;
use crate::spec::sensor::Sensor;

impl Reconstruction {
    /// The figures that follow from this result and its calibrated frame.
    pub fn figures(&self, scene: &Scene, frame: &Frame) -> Checks {
        Checks {
            peak_MPa: frame.peak_MPa(),
            mu_share: mu_share(scene, self),
            pull_share: pull_share(scene, frame),
            border_share: border_share(&scene.sensor, &self.forces_N.fz),
            load_ratio: None,
            network_misfit: None,
            ..self.checks
        }
        .with_missing(scene, frame)
    }

    /// The share of Σ|fz| that is below zero; `None` where no taxel has a force.
    pub fn negative_share(&self) -> Option<f64> {
        let (below, all) =
            self.forces_N.fz.iter().fold((0.0, 0.0), |(below, all), fz| (below + (-fz).max(0.0), all + fz.abs()));
        (all > 0.0).then(|| below / all)
    }
}

/// The largest |μ| over `mu_max` among the subarrays, or with `contacts` the regions, that carry a share of the load.
fn mu_share(scene: &Scene, result: &Reconstruction) -> Option<f64> {
    let mu_max = scene.search.mu_max;
    let sum = |taxels: &mut dyn Iterator<Item = usize>| taxels.map(|k| result.forces_N.fz[k].abs()).sum::<f64>();
    let has_forces = !result.forces_N.fz.is_empty();
    let carried: Vec<([f64; 2], f64)> = match &result.extra.regions {
        Some(regions) => regions.iter().map(|region| (region.mu, region.load_N[2].abs())).collect(),
        None => {
            let load = |index: usize| {
                let part = result.subarrays[index].part();
                match &result.extra.resultants {
                    Some(all) if !has_forces => all[index].force_N[2].abs(),
                    _ => sum(&mut part.indices(&scene.sensor)),
                }
            };
            result.subarrays.iter().enumerate().map(|(index, own)| (own.mu, load(index))).collect()
        }
    };
    let total: f64 = carried.iter().map(|(_, load)| load).sum();
    let counts = carried.iter().filter(|(_, load)| *load > 0.0 && *load >= COUNTS_FROM * total);
    counts.map(|([x, y], _)| x.hypot(*y) / mu_max).filter(|share| share.is_finite()).reduce(f64::max)
}

/// The share of Σ|fz| in the outermost rows and columns.
fn border_share(sensor: &Sensor, fz: &[f64]) -> Option<f64> {
    let total: f64 = fz.iter().map(|fz| fz.abs()).sum();
    let inside = sensor.rows > 2 && sensor.cols > 2 && fz.len() == sensor.taxels();
    let border = fz.iter().enumerate().filter(|(index, _)| sensor.is_border(*index)).map(|(_, fz)| fz.abs());
    (inside && total > 0.0).then(|| border.sum::<f64>() / total)
}
