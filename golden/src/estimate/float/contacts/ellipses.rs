//! Ellipses: elliptic contacts instead of segmented regions, where they explain the stress.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: p and segmented regions | n | N, – |
//! | in: stress, noise | n, scalar | MPa |
//! | out: p, regions, μ of each | n, n, count × 2 | N, –, – |
//!
//! A single ellipse changes nothing: one contact has one μ for the whole array. The forces of a region are its
//! ellipse's pressure over each cell, scaled to its load; a cell under two ellipses belongs to the one with the larger
//! force on it.

use super::{MeasuredStress, SolvedContacts, Solver};
use crate::estimate::float::objective::misfit_limit;
use crate::estimate::float::objective::multi_ellipse::{fit_ellipses, start_parameters, EllipseFit, FIT_WIDTHS};
use crate::estimate::float::search::{SearchResult, RADIUS};
use crate::estimate::segment::{segment, Segments};

/// Relative tolerance by which the |μ| of an ellipse may exceed mu_max; it is then reduced to mu_max.
const MU_TOLERANCE: f64 = 0.05;

impl Solver<'_> {
    /// The best fit of ellipses to the stress, started from the regions of `state`; `None` where no fit is wanted or
    /// found.
    pub(super) fn fit(&self, state: &SolvedContacts) -> Option<EllipseFit> {
        let MeasuredStress { taxels, b, noise_MPa } = self.stress?;
        let sensor = &self.matrices.sensor;
        // Starts with equally many regions lead to the same fit.
        let drawn = FIT_WIDTHS.map(|width| segment(sensor, &state.p, width));
        let mut drawings = vec![&state.segments];
        drawings.extend(&drawn);
        let mut counts = Vec::new();
        drawings.retain(|segments| {
            let new = !counts.contains(&segments.count);
            counts.push(segments.count);
            new
        });
        let starts: Vec<Vec<f64>> =
            drawings.into_iter().map(|segments| start_parameters(sensor, &state.p, segments)).collect();
        fit_ellipses(taxels, b, &starts, misfit_limit(b, noise_MPa))
    }

    /// The contacts of a fit that explains the stress; for a single ellipse `state`, if that has a single region too.
    pub(super) fn contacts_of_fit(&self, fitted: &EllipseFit, state: &SolvedContacts) -> Option<SolvedContacts> {
        match fitted.patches.len() {
            _ if !fitted.explains_stress() => None,
            1 => (state.segments.count == 1).then(|| state.clone()),
            _ => self.ellipse_contacts(fitted, state),
        }
    }

    /// The regions of the ellipses, each with the forces of its ellipse; `None` where a region has no force, is not to
    /// be searched or exceeds mu_max.
    fn ellipse_contacts(&self, fitted: &EllipseFit, state: &SolvedContacts) -> Option<SolvedContacts> {
        let sensor = &self.matrices.sensor;
        let cells = fitted.cells(sensor);
        let labels = fitted.labels(sensor);
        let segments = Segments::numbered(&labels);
        let mut p: Vec<f64> = (0..labels.len()).map(|k| cells.iter().map(|cells| cells[k]).sum()).collect();
        let mut found = vec![None; segments.count];
        let mut filled = 0;
        for (ellipse, patch) in fitted.patches.iter().enumerate() {
            let first = labels.iter().position(|&label| label == Some(ellipse))?;
            let region = segments.labels[first]?;
            let sum: f64 = (0..p.len()).filter(|&k| labels[k] == Some(ellipse)).map(|k| p[k]).sum();
            let [x, y, load] = patch.force;
            let ratio = (x / load).hypot(y / load);
            if !(self.searched)(&segments, region) || sum <= 0.0 || ratio > (1.0 + MU_TOLERANCE) * self.mu_max {
                return None;
            }
            (0..p.len()).filter(|&k| labels[k] == Some(ellipse)).for_each(|k| p[k] *= load / sum);
            let cut = if ratio > self.mu_max { self.mu_max / ratio } else { 1.0 };
            let mu = [x, y].map(|f| f / load * cut);
            let position = mu.map(|mu| (mu * f64::from(RADIUS) / self.mu_max) as i32);
            found[region] = Some(SearchResult { mu, position, objective: 0.0, evaluations: fitted.evaluations });
            filled += 1;
        }
        let objective = self.objective.score(&p)?;
        found.iter_mut().flatten().for_each(|found| found.objective = objective);
        (filled == segments.count).then_some(SolvedContacts {
            segments,
            found,
            p,
            sweeps: state.sweeps,
            converged: true,
        })
    }
}
