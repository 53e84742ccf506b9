//! Decode: the words of a device, or of this model, as a result in physical units.

mod records;
#[cfg(test)]
mod tests;

use std::ops::BitOr;

use self::records::Records;
use super::error::FixedError;
use super::model::Model;
use super::plan::contents::CasePlan;
use super::stages::prepare::Prepared;
use super::stages::send::{labels_of_beats, ln_sigma_of_word, Status, CASE};
use super::words::formats::{LOG_FRACTION, MU_STEPS};
use crate::data::frame::{Forces, Frame};
use crate::data::input::means::Window;
use crate::data::input::memory::Memory;
use crate::data::reception::{full_scale, noise_floor_codes, receive, SubarrayStats};
use crate::estimate::float::objective::MuEstimate;
use crate::result::checks::Checks;
use crate::result::errors::Errors;
use crate::result::flags::{frame_flags, Flag, FlagSet};
use crate::result::reconstruct::{
    assemble, shear_sigma_N, shear_spread_of, CaseChoice, Reconstruction, Region, SubarrayResult,
};
use crate::spec::mean_window::MeanNoise;
use crate::spec::partition::Subarray;
use crate::spec::sensor::Sensor;
use crate::spec::sliding::most_frames;

/// The mean of the frames of a result.
struct Mean {
    /// Calibrated.
    stress: Frame,
    /// Variance over that of a frame.
    variance: f64,
    /// As in [`Checks`].
    zero_share: Option<f64>,
}

/// μ as a status has it.
struct StatusMu {
    condition: bool,
    found: bool,
    mu: [f64; 2],
    /// What the network said, where there is one.
    estimate: Option<MuEstimate>,
}

impl Model {
    /// Reconstructs one frame; for scenes with `input.average = 0`, or the first frame of a sliding mean.
    ///
    /// # Errors
    /// As [`Model::stress`].
    pub fn reconstruct(&self, frame: &Frame) -> Result<Reconstruction, FixedError> {
        self.reconstruct_averaged(std::slice::from_ref(frame))
    }

    /// Reconstructs the mean of 2^average frames, or the sliding mean of all frames since a reset.
    ///
    /// # Errors
    /// As [`Model::stress`].
    pub fn reconstruct_averaged(&self, frames: &[Frame]) -> Result<Reconstruction, FixedError> {
        self.reconstruct_after(&mut Memory::default(), &mut self.prepare.empty(), frames)
    }

    /// The same where frames came before, of which `memory` is, and `prepared` what the hardware has of them. Both are then
    /// those after these frames.
    ///
    /// # Errors
    /// As [`Model::stress`].
    pub fn reconstruct_after(
        &self,
        memory: &mut Memory,
        prepared: &mut Prepared,
        frames: &[Frame],
    ) -> Result<Reconstruction, FixedError> {
        let before = memory.clone();
        let (stress, variance) = self.stress_after(memory, frames)?;
        self.add(prepared, &self.readings_after(&before, full_scale(&self.scene, &stress), frames));
        let trace = self.run_prepared(prepared);
        let mean = self.mean_of(memory, stress, variance, &trace.status);
        self.decode_mean(frames, mean, "fixed", &trace.beats, &trace.status)
    }

    /// Converts the words that a device sent for the [`Model::readings`] of `readings`, the frames of one
    /// reconstruction, to physical units; `engine` names the device in the result.
    ///
    /// # Errors
    /// [`FixedError::Beats`] if forces or status are incomplete; errors of the frames as in [`Model::stress`].
    pub fn decode(
        &self,
        readings: &[Frame],
        engine: &str,
        beats: &[[i32; 3]],
        status: &[[i32; 3]],
    ) -> Result<Reconstruction, FixedError> {
        let mut memory = Memory::default();
        let (stress, variance) = self.stress_after(&mut memory, readings)?;
        let mean = self.mean_of(&memory, stress, variance, status);
        self.decode_mean(readings, mean, engine, beats, status)
    }

    /// The mean after the frames of which `memory` is: `stress`, with its `variance`; where it is adaptive that of the window that
    /// the device took.
    fn mean_of(&self, memory: &Memory, stress: Frame, variance: f64, status: &[[i32; 3]]) -> Mean {
        let zero_share = memory.drift().share();
        let window = Status::all(status).next().and_then(|status| self.window_of(&status));
        match (window, memory.means()) {
            (Some(window), Some(means)) => {
                let mean = Frame { stress_MPa: means.mean(&window), ..stress };
                Mean { stress: self.input.calibrate(&mean), variance: window.variance, zero_share }
            }
            _ => Mean { stress, variance, zero_share },
        }
    }

    /// The window of an adaptive mean that a status names.
    fn window_of(&self, status: &Status) -> Option<Window> {
        let adaptive = self.prepare.adaptive.as_ref()?;
        let window = adaptive.windows.get(status.window as usize)?;
        // The count of frames stops.
        let frames = status.frames as usize;
        let averages = &adaptive.averages;
        let noise = match frames < most_frames(adaptive.longest()) {
            true => MeanNoise::after(averages, frames),
            false => MeanNoise::settled(averages),
        };
        Some(Window::of(averages, *window, &noise))
    }

    /// The same where the mean of the readings is known.
    fn decode_mean(
        &self,
        readings: &[Frame],
        Mean { stress, variance, zero_share }: Mean,
        engine: &str,
        beats: &[[i32; 3]],
        status: &[[i32; 3]],
    ) -> Result<Reconstruction, FixedError> {
        let frame = &stress;
        let case = self.case_of(status)?;
        let codes = self.codes(frame)?;
        self.check_beats(case, beats, status)?;
        let lsb = self.force_lsb_N(codes.full_scale_MPa);
        let taxels = self.scene.sensor.taxels();
        let records = Records::new(self, beats, lsb);
        let forces = match records {
            None => {
                let axis = |axis: usize| beats[..taxels].iter().map(|beat| f64::from(beat[axis]) * lsb).collect();
                Forces { fx: axis(0), fy: axis(1), fz: axis(2) }
            }
            Some(_) => Forces::default(),
        };
        let resultant_N = records.as_ref().map_or_else(|| forces.resultant(), Records::resultant_N);

        if !resultant_N.iter().all(|sum| sum.is_finite()) {
            return Err(FixedError::TooStrong { frame: frame.id.clone(), peak_MPa: frame.peak_MPa() });
        }
        let sensor = &self.scene.sensor;
        let noise_MPa = self.input.noise_of_mean_MPa(variance);
        let mut flags = frame_flags(&self.scene, self.estimator(), frame, &codes, noise_MPa);
        let mut subarrays = Vec::with_capacity(case.parts.len());
        let mut shear_spread = None;
        let all: Vec<Status> = Status::all(status).collect();
        // Where each contact has a status the condition of the array is that of its codes, see `assemble`.
        flags.extend(self.status_flags(&all, |_| self.by_contact.is_none()).iter());
        let floor = noise_floor_codes(&self.scene, &codes);
        let received = |part: &Subarray| {
            receive(sensor, part, &part.gather(sensor, &codes.codes), floor, self.scene.partition.condition)
        };
        let regions = self.by_contact.is_some().then(|| {
            // The contact of each status: the taxels of its label, or the record after that of no contact.
            let own = match &records {
                None => regions_of_labels(sensor, &forces, &beats[taxels..], all.len()),
                Some(records) => records.regions(),
            };
            let found = own.into_iter().zip(&all).filter(|(own, _)| own.taxel_count > 0);
            found.map(|(own, status)| self.with_status(own, status)).collect::<Vec<Region>>()
        });
        if let Some(regions) = &regions {
            shear_spread = shear_spread_of(regions);
            let whole = |part| SubarrayResult::of_regions(part, &received(part), resultant_N);
            subarrays.extend(case.parts.iter().map(whole));
        }
        let searched = all.iter().filter(|_| regions.is_none());
        for (part, status) in case.parts.iter().zip(searched) {
            let (own, spread) = self.of_status(part, received(part), status);
            shear_spread = shear_spread.or(spread);
            subarrays.push(own);
        }
        let mut result = assemble(&self.scene, frame, engine, subarrays, forces, flags);
        result.extra.regions = regions;
        if let Some(records) = &records {
            self.add_records(&mut result, records, &all);
            result.error = frame.resultant_N.map(|truth| Errors::new(truth, resultant_N));
        }
        self.add_state(&mut result, case, all.first());
        let network_misfit = self.misfit.as_ref().and_then(|misfit| misfit.of(&result, frame, noise_MPa));
        let newest = self.scene.input.newest(readings);
        let figures = result.figures(&self.scene, frame).with_readings(&self.input, newest);
        let checks = Checks { network_misfit, shear_spread, zero_share, ..figures };
        result.add_checks(&self.scene, checks);
        result.add_missing(&self.scene, frame, newest);
        if let Some(deviations) = &self.deviations {
            deviations.add(&mut result, &self.scene, frame, noise_MPa);
        }
        Ok(result)
    }

    /// Checks the numbers of beats.
    fn check_beats(&self, case: &CasePlan, beats: &[[i32; 3]], status: &[[i32; 3]]) -> Result<(), FixedError> {
        let numbers =
            [("forces", beats.len(), self.force_beats()), ("status", status.len(), self.status_beats_of(case))];
        match numbers.into_iter().find(|(_, got, expected)| got != expected) {
            Some((what, got, expected)) => Err(FixedError::Beats { what, got, expected }),
            None => Ok(()),
        }
    }

    /// A subarray and its status, and how much the shear may be wrong, if the status tells.
    fn of_status(&self, part: &Subarray, received: SubarrayStats, status: &Status) -> (SubarrayResult, Option<f64>) {
        let StatusMu { condition, found, mu, estimate } = self.mu_of(status);
        let received = SubarrayStats { condition_met: condition, ..received };
        let score = match estimate {
            Some(estimate) => Some(estimate.found.objective),
            None => found.then(|| -f64::from(status.score) / f64::from(1u32 << LOG_FRACTION)),
        };
        let mu_sigma = estimate.and_then(|estimate| estimate.sigma);
        let own = SubarrayResult { mu_sigma, ..SubarrayResult::new(part, &received, mu, score) };
        (own, estimate.and_then(|estimate| estimate.shear_spread()))
    }

    /// Adds the forces that the device has summed up.
    fn add_records(&self, result: &mut Reconstruction, records: &Records, statuses: &[Status]) {
        // Without forces per taxel only the device knows whether there is a contact.
        let none = statuses.iter().all(|status| status.raised.contains(Flag::NoContact));
        result.flags.retain(|flag| none || *flag != Flag::NoContact);
        result.resultant_N = records.resultant_N();
        result.extra.resultants = Some(match &result.extra.regions {
            Some(regions) => {
                result.extra.wrench = Some(records.wrench());
                regions.iter().map(Region::resultant).collect()
            }
            None => {
                let resultants = records.resultants();
                for (own, of) in result.subarrays.iter_mut().zip(&resultants) {
                    own.shear_sigma_N = shear_sigma_N(own.mu_sigma, of.force_N[2]);
                }
                resultants
            }
        });
    }

    /// Adds what the first status says of the device: its mean, the version of its tables, the case that it took.
    fn add_state(&self, result: &mut Reconstruction, case: &CasePlan, status: Option<&Status>) {
        if self.scene.input.slides() {
            // As the device says, which alone knows of its resets.
            let window = status.and_then(|status| self.window_of(status));
            result.extra.lag_frames = window.as_ref().map(|window| window.age);
            let frames = status.map(|status| status.frames as usize);
            result.extra.mean_frames = window.map(|window| window.frames_held()).or(frames);
        }
        if self.has_writable_tables() {
            result.extra.tables_version = status.map(|status| status.tables_version as u16);
        }
        if self.chooses() {
            let reason = "the finest whose boundaries cut nothing, by the hardware's rule".to_string();
            result.extra.taken = Some(CaseChoice { case: case.case.to_string(), reason, refused: Vec::new() });
        }
    }

    /// The flags that the statuses of a frame raise; `condition-unmet` only by those whose μ `counts`, by their index.
    pub fn status_flags(&self, statuses: &[Status], counts: impl Fn(usize) -> bool) -> FlagSet {
        let raised = |(index, status): (usize, &Status)| {
            let applies = |flag: &Flag| match flag {
                Flag::ConditionUnmet => counts(index),
                Flag::NoCompression => self.searches(),
                _ => true,
            };
            status.flags().iter().filter(applies).collect()
        };
        statuses.iter().enumerate().map(raised).fold(FlagSet::default(), FlagSet::bitor)
    }

    /// μ of a status.
    fn mu_of(&self, status: &Status) -> StatusMu {
        let Status { condition, found, .. } = *status;
        let unit = 1.0 / MU_STEPS as f64;
        let mu = status.position().map(|x| f64::from(x) * unit * self.scene.search.mu_max);
        let sigma = ln_sigma_of_word(status.score).map(|ln| (f64::from(ln) * unit).exp() * self.scene.search.mu_max);
        let estimate = (found && self.has_network()).then(|| MuEstimate::of_density(mu, sigma, status.position()));
        StatusMu { condition, found, mu, estimate }
    }

    /// A contact with what its status says.
    fn with_status(&self, own: Region, status: &Status) -> Region {
        let StatusMu { condition, mu, estimate, .. } = self.mu_of(status);
        let objective_value = estimate.map(|estimate| estimate.found.objective);
        let own = Region { centroid_condition: condition, mu, objective_value, ..own };
        own.with_sigma(estimate.and_then(|estimate| estimate.sigma))
    }

    /// The case that a frame's status names; of a scene with one case, that case.
    fn case_of(&self, status: &[[i32; 3]]) -> Result<&CasePlan, FixedError> {
        if !self.chooses() {
            return Ok(self.first());
        }
        let number = CASE.get(status);
        let case = self.cases().iter().find(|case| case.number() == number);
        case.ok_or(FixedError::Internal("the status names a case that was not built"))
    }
}

/// The contact of each of `statuses` from the labels of its taxels.
fn regions_of_labels(sensor: &Sensor, forces: &Forces, beats: &[[i32; 3]], statuses: usize) -> Vec<Region> {
    let labels = labels_of_beats(beats, sensor.taxels());
    let of = |slot| (0..labels.len()).filter(|&taxel| labels[taxel] == slot + 1).collect();
    (0..statuses).map(|slot| Region::of_taxels(sensor, forces, of(slot))).collect()
}
