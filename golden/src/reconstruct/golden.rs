//! The golden engine: `float`'s stages in order, one subarray after the other.
//!
//! | case | per frame |
//! |---|---|
//! | rows × columns | each subarray for itself |
//! | adaptive | the whole array first, to see the contacts; then the case that `adaptive` allows |
//! | contacts | the whole array first; then its regions, one μ each |

use super::adaptive::{extents, objection};
use super::extra::{regions, Refused, Taken};
use super::{assemble, Reconstruction, SubarrayResult};
use crate::flags::{frame_flags, Flag};
use crate::float::contacts::Solver;
use crate::float::receive::{receive, Receipt};
use crate::float::search::{search, Found};
use crate::float::segment::{segment, Segments, WIDTH};
use crate::float::{force::force, objective::Sparse, pass::Polynomial};
use crate::frame::{Forces, Frame, FrameError};
use crate::input::{Input as InputOptions, InputError};
use crate::matrices::{Matrices, MatricesError};
use crate::partition::{subarrays, Case, PartitionError, Subarray};
use crate::quantise::{full_scale, noise_floor_codes, quantise};
use crate::scene::{Condition, Scene, SceneError};
use thiserror::Error;

/// A scene made ready for frames.
pub struct Golden {
    pub(super) scene: Scene,
    /// The scene's input options.
    pub(super) input: InputOptions,
    /// The case; of `adaptive` all cases that divide the array, the finest first, the whole last.
    cuts: Vec<Cut>,
}

/// A case with its matrices.
#[derive(Clone)]
struct Cut {
    case: Case,
    parts: Vec<Subarray>,
    /// Shared by all subarrays: a partition's rectangles are equal.
    shared: Matrices,
    /// One for each subarray where taxels are masked.
    masked: Vec<Matrices>,
}

impl Cut {
    fn matrices(&self, part: usize) -> &Matrices {
        self.masked.get(part).unwrap_or(&self.shared)
    }

    /// Leaves the taxels `dead` out, and no others.
    fn mask(mut self, dead: &[[usize; 2]]) -> Result<Cut, MatricesError> {
        let own = |part: &Subarray| self.shared.without(&part.own(dead));
        self.masked = match dead {
            [] => Vec::new(),
            _ => self.parts.iter().map(own).collect::<Result<_, _>>()?,
        };
        Ok(self)
    }
}

/// A frame with what all subarrays ask of it.
struct Input<'a> {
    stress_MPa: &'a [f64],
    codes: &'a [i32],
    floor: i32,
}

/// What the subarrays of a case came to.
struct Outcome {
    subarrays: Vec<SubarrayResult>,
    forces: Forces,
    flags: Vec<Flag>,
}

/// A scene or frame that cannot be reconstructed.
#[derive(Debug, Error)]
pub enum GoldenError {
    /// The scene asks for something this version does not have.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The partition does not fit the array.
    #[error(transparent)]
    Partition(#[from] PartitionError),
    /// The subarray has no usable matrices.
    #[error(transparent)]
    Matrices(#[from] MatricesError),
    /// The frame is not one of this scene.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// A file the input options name, or frames that do not fit them.
    #[error(transparent)]
    Input(#[from] InputError),
    /// Stress so large that its forces are no finite numbers.
    #[error("frame {frame}: peak stress {peak_MPa:e} MPa gives forces beyond the range of numbers")]
    TooStrong {
        /// The frame's id.
        frame: String,
        /// Its largest |b|.
        peak_MPa: f64,
    },
}

impl Golden {
    /// Computes the matrices a scene needs; milliseconds for 20 × 20, two seconds for the largest subarrays.
    ///
    /// # Errors
    /// [`GoldenError`] but `Frame` and `TooStrong`.
    pub fn new(scene: &Scene) -> Result<Golden, GoldenError> {
        scene.require_golden()?;
        let cut = |case: Case| -> Result<Cut, GoldenError> {
            let parts = subarrays(case, &scene.sensor)?;
            let shared = Matrices::through(&parts[0].sensor(&scene.sensor), scene.medium, scene.search.mu_max)?;
            Ok(Cut { case, parts, shared, masked: Vec::new() }.mask(&scene.input.dead)?)
        };
        let cases = match scene.partition.case {
            Case::Adaptive => {
                let cases = [1, 2, 3, 0].into_iter().filter_map(Case::numbered);
                cases.filter(|case| subarrays(*case, &scene.sensor).is_ok()).collect()
            }
            Case::Contacts => vec![Case::WHOLE],
            grid @ Case::Grid(_) => vec![grid],
        };
        let cuts = cases.into_iter().map(cut).collect::<Result<_, _>>()?;
        Ok(Golden { scene: scene.clone(), input: InputOptions::new(scene)?, cuts })
    }

    /// The matrices of a subarray; of `adaptive` those of the whole array.
    pub fn matrices(&self) -> &Matrices {
        self.whole().matrices(0)
    }

    /// The coarsest case.
    fn whole(&self) -> &Cut {
        &self.cuts[self.cuts.len() - 1]
    }

    /// The same scene without the readings of the taxels `dead`.
    ///
    /// # Errors
    /// `Matrices` when too few readings are left.
    pub(super) fn masked(&self, dead: &[[usize; 2]]) -> Result<Golden, GoldenError> {
        let cuts = self.cuts.iter().map(|cut| cut.clone().mask(dead)).collect::<Result<_, _>>()?;
        Ok(Golden { scene: self.scene.clone(), input: self.input.clone(), cuts })
    }

    /// Reconstructs calibrated stress. Forces come from the stress as it is, the condition from its codes.
    ///
    /// # Errors
    /// `Frame` when the frame is not the scene's, `TooStrong` when a force overflows.
    pub(super) fn engine(&self, frame: &Frame) -> Result<Reconstruction, GoldenError> {
        let scene = &self.scene;
        frame.check(scene)?;
        let codes = quantise(&frame.stress_MPa, scene.fixed.input_bits, full_scale(scene, frame));
        let floor = noise_floor_codes(scene, &codes);
        let input = Input { stress_MPa: &frame.stress_MPa, codes: &codes.codes, floor };
        let mut result = match scene.partition.case {
            Case::Grid(_) => self.finish(frame, self.subarrays(&input, self.whole())),
            Case::Adaptive => self.adaptive(frame, &input),
            Case::Contacts => self.contacts(frame, &input),
        };
        if !result.resultant_N.iter().all(|sum| sum.is_finite()) {
            let (frame, peak_MPa) = (frame.id.clone(), frame.peak_MPa());
            return Err(GoldenError::TooStrong { frame, peak_MPa });
        }
        result.flags.extend(frame_flags(scene, frame, &codes));
        result.flags.sort();
        result.flags.dedup();
        Ok(result)
    }

    fn finish(&self, frame: &Frame, Outcome { subarrays, forces, flags }: Outcome) -> Reconstruction {
        assemble(&self.scene, frame, "golden", subarrays, forces, flags)
    }

    /// The finest case that nothing stands against.
    fn adaptive(&self, frame: &Frame, input: &Input) -> Reconstruction {
        let sensor = &self.scene.sensor;
        let whole = self.subarrays(input, self.whole());
        let contacts = extents(sensor, &whole.forces.fz, &segment(sensor, &whole.forces.fz, WIDTH));
        let mut refused = Vec::new();
        for cut in &self.cuts {
            let receipts: Vec<Receipt> = cut.parts.iter().map(|part| self.receive(input, part)).collect();
            let case = cut.case.to_string();
            if let Some(reason) = objection(sensor, &cut.parts, &receipts, &contacts) {
                refused.push(Refused { case, reason });
                continue;
            }
            if cut.case == Case::WHOLE {
                break;
            }
            let reason = "every loaded subarray meets the condition and no boundary cuts a contact".to_string();
            let mut result = self.finish(frame, self.subarrays(input, cut));
            result.extra.taken = Some(Taken { case, reason, refused });
            return result;
        }
        let mut result = self.finish(frame, whole);
        let reason = "no finer case is possible".to_string();
        result.extra.taken = Some(Taken { case: Case::WHOLE.to_string(), reason, refused });
        result
    }

    /// One region per contact.
    fn contacts(&self, frame: &Frame, input: &Input) -> Reconstruction {
        let scene = &self.scene;
        let matrices = self.matrices();
        let mut outcome = self.subarrays(input, self.whole());
        let family = Polynomial::new(matrices, input.stress_MPa);
        let met = |segments: &Segments, region: usize| {
            let own = || (0..input.codes.len()).filter(move |&k| segments.labels[k] == region).map(|k| input.codes[k]);
            let (above, below) = (own().any(|code| code > input.floor), own().any(|code| code < -input.floor));
            match scene.partition.condition {
                Condition::Loaded => above || below,
                Condition::BothSigns => above && below,
            }
        };
        let Some(found) = search(&family, scene.search.mu_max, &Sparse::default()) else {
            return self.finish(frame, outcome);
        };
        let (mu_max, p0) = (scene.search.mu_max, family.v(0, 0));
        let solver = Solver { matrices, mu_max, objective: &Sparse::default(), p0, searched: &met };
        let contacts = solver.solve(&family, found);
        let mu: Vec<[f64; 2]> = contacts.segments.labels.iter().map(|&region| contacts.mu(region)).collect();
        let mut forces = force(&contacts.p, [0.0; 2], scene.threshold.min_force_N);
        forces.fx = forces.fz.iter().zip(&mu).map(|(fz, mu)| mu[0] * fz).collect();
        forces.fy = forces.fz.iter().zip(&mu).map(|(fz, mu)| mu[1] * fz).collect();
        let met: Vec<bool> = (0..contacts.segments.count).map(|k| met(&contacts.segments, k)).collect();
        let own = regions(&scene.sensor, &contacts, &met, &forces);
        outcome.forces = forces;
        let mut result = self.finish(frame, outcome);
        result.extra.regions = Some(own);
        result.extra.sweeps = Some(contacts.sweeps);
        result.extra.converged = Some(contacts.converged);
        result
    }

    fn receive(&self, input: &Input, part: &Subarray) -> Receipt {
        let codes = part.gather(&self.scene.sensor, input.codes);
        receive(&self.scene.sensor, part, &codes, input.floor, self.scene.partition.condition)
    }

    /// Every subarray of a case for itself.
    fn subarrays(&self, input: &Input, cut: &Cut) -> Outcome {
        let sensor = &self.scene.sensor;
        let mut outcome = Outcome { subarrays: Vec::new(), forces: Forces::zeros(sensor.taxels()), flags: Vec::new() };
        for (index, part) in cut.parts.iter().enumerate() {
            let receipt = self.receive(input, part);
            let b = part.gather(sensor, input.stress_MPa);
            let (found, own) = self.solve(cut.matrices(index), &b, receipt.condition_met);
            if receipt.condition_met && found.is_none() {
                outcome.flags.push(Flag::NoCompression);
            }
            part.scatter(sensor, &own.fx, &mut outcome.forces.fx);
            part.scatter(sensor, &own.fy, &mut outcome.forces.fy);
            part.scatter(sensor, &own.fz, &mut outcome.forces.fz);
            outcome.subarrays.push(SubarrayResult {
                row0: part.row0,
                col0: part.col0,
                rows: part.rows,
                cols: part.cols,
                centroid_condition: receipt.condition_met,
                compression_centroid_mm: receipt.compression_centroid_mm,
                tension_centroid_mm: receipt.tension_centroid_mm,
                mu: found.map_or([0.0; 2], |found| found.mu),
                objective_value: found.map(|found| found.objective),
            });
        }
        outcome
    }

    /// One subarray: the family, the search where the condition is met, the forces.
    fn solve(&self, matrices: &Matrices, b: &[f64], condition_met: bool) -> (Option<Found>, Forces) {
        let min_force = self.scene.threshold.min_force_N;
        if !condition_met {
            let family = Polynomial::of_degree(matrices, b, 0);
            return (None, force(family.v(0, 0), [0.0; 2], min_force));
        }
        let family = Polynomial::new(matrices, b);
        let found = search(&family, self.scene.search.mu_max, &Sparse::default());
        let mu = found.map_or([0.0; 2], |found| found.mu);
        (found, force(&family.eval(mu), mu, min_force))
    }
}
