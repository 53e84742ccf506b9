//! Decode: the words of a device, or of this model, as a result in physical units.

use super::error::FixedError;
use super::model::Model;
use super::plan::contents::CasePlan;
use super::stages::resultants;
use super::stages::send::{
    labels_of_beats, ln_sigma_of_word, Status, CASE_SHIFT, FLAG_COEFFICIENTS, FLAG_CONDITION, FLAG_FOUND,
    FLAG_MORE_CONTACTS, FLAG_NO_CONTACT, FRAMES_SHIFT, STATUS_BEATS,
};
use super::words::formats::{LOG_FRACTION, MU_STEPS};
use crate::checks::Checks;
use crate::errors::Errors;
use crate::flags::{frame_flags, Flag};
use crate::float::objective::Estimate;
use crate::frame::{Forces, Frame};
use crate::input::Input;
use crate::partition::Subarray;
use crate::reception::{noise_floor_codes, receive, Received};
use crate::reconstruct::{
    assemble, shear_sigma_N, shear_spread_of, CaseChoice, Reconstruction, Region, Resultant, SubarrayResult,
};

/// μ as a status has it.
struct StatusMu {
    condition: bool,
    found: bool,
    mu: [f64; 2],
    /// What the network said, where there is one.
    estimate: Option<Estimate>,
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
        let trace = self.run(&self.readings(frames)?);
        self.decode(frames, "fixed", &trace.beats, &trace.status)
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
        let case = self.case_of(status)?;
        let input = Input::new(&self.scene)?;
        let frame = &input.calibrate(&input.average(&self.scene, readings)?);
        let codes = self.codes(frame)?;
        if beats.len() != self.force_beats() {
            return Err(FixedError::Beats { what: "forces", got: beats.len(), expected: self.force_beats() });
        }
        let expected = self.status_beats_of(case);
        if status.len() != expected {
            return Err(FixedError::Beats { what: "status", got: status.len(), expected });
        }
        let lsb = self.force_lsb_N(codes.full_scale_MPa);
        let taxels = self.scene.sensor.taxels();
        let (beats, labels) = match self.by_contact {
            Some(_) => (&beats[..taxels], Some(labels_of_beats(&beats[taxels..], taxels))),
            None => (beats, None),
        };
        let axis = |axis: usize| beats.iter().map(|beat| f64::from(beat[axis]) * lsb).collect();
        let forces = match self.sends_resultants() {
            false => Forces { fx: axis(0), fy: axis(1), fz: axis(2) },
            true => Forces::default(),
        };
        let resultants = self.sends_resultants().then(|| self.resultants(beats, lsb));
        let sum = |all: &Vec<Resultant>| [0, 1, 2].map(|k| all.iter().map(|r| r.force_N[k]).sum::<f64>());
        let resultant_N = resultants.as_ref().map_or_else(|| forces.resultant(), sum);

        if !resultant_N.iter().all(|sum| sum.is_finite()) {
            return Err(FixedError::TooStrong { frame: frame.id.clone(), peak_MPa: frame.peak_MPa() });
        }
        let sensor = &self.scene.sensor;
        let noise_MPa = input.noise_of_mean_MPa(readings.len());
        let mut flags = frame_flags(&self.scene, frame, &codes, noise_MPa);
        let mut subarrays = Vec::with_capacity(case.parts.len());
        let mut shear_spread = None;
        let all: Vec<Status> = status.chunks(STATUS_BEATS).filter_map(Status::of_beats).collect();
        for status in &all {
            if status.rescale_saturations + status.force_saturations > 0 {
                flags.push(Flag::Saturated);
            }
            if status.flags & FLAG_COEFFICIENTS != 0 {
                flags.push(Flag::CoefficientsDamaged);
            }
            if status.flags & FLAG_MORE_CONTACTS != 0 {
                flags.push(Flag::TooManyContacts);
            }
        }
        let floor = noise_floor_codes(&self.scene, &codes);
        let received = |part: &Subarray| {
            receive(sensor, part, &part.gather(sensor, &codes.codes), floor, self.scene.partition.condition)
        };
        let regions: Option<Vec<Region>> = labels.map(|labels| {
            let region = |(slot, status)| self.region(&labels, slot, status, &forces);
            all.iter().enumerate().filter_map(region).collect()
        });
        if let Some(regions) = &regions {
            shear_spread = shear_spread_of(regions);
            let whole = |part| SubarrayResult::of_regions(part, &received(part), resultant_N);
            subarrays.extend(case.parts.iter().map(whole));
        }
        let searched = all.iter().filter(|_| regions.is_none());
        for (part, status) in case.parts.iter().zip(searched) {
            let StatusMu { condition, found, mu, estimate } = self.told(status);
            if condition && self.searches() && !found {
                flags.push(Flag::NoCompression);
            }
            let received = Received { condition_met: condition, ..received(part) };
            shear_spread = shear_spread.or(estimate.and_then(|estimate| estimate.shear_spread()));
            let score = match estimate {
                Some(estimate) => Some(estimate.found.objective),
                None => found.then(|| -f64::from(status.score) / f64::from(1u32 << LOG_FRACTION)),
            };
            let mu_sigma = estimate.and_then(|estimate| estimate.sigma);
            subarrays.push(SubarrayResult { mu_sigma, ..SubarrayResult::new(part, &received, mu, score) });
        }
        let mut result = assemble(&self.scene, frame, engine, subarrays, forces, flags);
        result.extra.regions = regions;
        if self.sends_resultants() {
            // Without forces per taxel only the device knows whether there is a contact.
            let none = status.iter().step_by(STATUS_BEATS).all(|beat| beat[2] as u32 & FLAG_NO_CONTACT != 0);
            result.flags.retain(|flag| none || *flag != Flag::NoContact);
            result.resultant_N = resultant_N;
            result.error = frame.resultant_N.map(|truth| Errors::new(truth, resultant_N));
            for (own, of) in result.subarrays.iter_mut().zip(resultants.iter().flatten()) {
                own.shear_sigma_N = shear_sigma_N(own.mu_sigma, of.force_N[2]);
            }
            result.extra.resultants = resultants;
        }
        if self.scene.input.slides() {
            // As the device says, which alone knows of its resets.
            result.extra.mean_frames = status.first().map(|beat| (beat[2] as u32 >> FRAMES_SHIFT) as usize);
        }
        if self.chooses() {
            let reason = "the finest whose boundaries cut nothing, by the hardware's rule".to_string();
            result.extra.taken = Some(CaseChoice { case: case.case.to_string(), reason, refused: Vec::new() });
        }
        let full_scale_share = input.full_scale_share(readings);
        let network_misfit = self.misfit.as_ref().and_then(|misfit| misfit.of(&result, frame, noise_MPa));
        let checks = Checks { full_scale_share, network_misfit, shear_spread, ..result.figures(&self.scene, frame) };
        result.add_checks(&self.scene, checks);
        Ok(result)
    }

    /// What a status says of μ.
    fn told(&self, status: &Status) -> StatusMu {
        let [condition, found] = [FLAG_CONDITION, FLAG_FOUND].map(|flag| status.flags & flag != 0);
        let unit = 1.0 / MU_STEPS as f64;
        let mu = status.position.map(|x| f64::from(x) * unit * self.scene.search.mu_max);
        let sigma = ln_sigma_of_word(status.score).map(|ln| (f64::from(ln) * unit).exp() * self.scene.search.mu_max);
        let estimate = (found && self.has_network()).then(|| Estimate::told(mu, sigma, status.position));
        StatusMu { condition, found, mu, estimate }
    }

    /// The contact with the status in this slot, if there is one; `labels` are those of the taxels.
    fn region(&self, labels: &[usize], slot: usize, status: &Status, forces: &Forces) -> Option<Region> {
        let taxels: Vec<usize> = (0..labels.len()).filter(|&taxel| labels[taxel] == slot + 1).collect();
        let StatusMu { condition, mu, estimate, .. } = self.told(status);
        let own = Region {
            centroid_condition: condition,
            mu,
            objective_value: estimate.map(|estimate| estimate.found.objective),
            ..Region::of_taxels(&self.scene.sensor, forces, taxels).with_sigma(estimate.and_then(|told| told.sigma))
        };
        (!own.taxels.is_empty()).then_some(own)
    }

    /// The case that a frame's status names; of a scene with one case, that case.
    fn case_of(&self, status: &[[i32; 3]]) -> Result<&CasePlan, FixedError> {
        if !self.chooses() {
            return Ok(self.first());
        }
        let number = status.first().map_or(0, |beat| beat[2] as u32 >> CASE_SHIFT & 3);
        let case = self.cases().iter().find(|case| case.number() == number);
        case.ok_or(FixedError::Internal("the status names a case that was not built"))
    }

    /// The resultants in a device's beats; one LSB of a force word is `lsb_N`.
    fn resultants(&self, beats: &[[i32; 3]], lsb_N: f64) -> Vec<Resultant> {
        let sensor = &self.scene.sensor;
        let half_pitch = [sensor.pitch_x_mm / 2.0, sensor.pitch_y_mm / 2.0];
        let resultant = |beats: &[[i32; 3]]| {
            let [fx, fy, fz, pressed, x, y] = resultants::of_beats(beats).unwrap_or_default().map(|sum| sum as f64);
            let centre = [x * half_pitch[0] / pressed, y * half_pitch[1] / pressed];
            Resultant { force_N: [fx, fy, fz].map(|f| f * lsb_N), centre_mm: (pressed > 0.0).then_some(centre) }
        };
        beats.chunks(resultants::BEATS).map(resultant).collect()
    }
}
