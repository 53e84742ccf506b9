//! The golden engine: `float`'s stages in order, one subarray after the other.

use super::{assemble, Reconstruction, SubarrayResult};
use crate::flags::{frame_flags, Flag};
use crate::float::search::{search, Found};
use crate::float::{force::force, objective::Sparse, pass::Polynomial, receive::receive};
use crate::frame::{Forces, Frame, FrameError};
use crate::matrices::{Matrices, MatricesError};
use crate::partition::{subarrays, PartitionError, Subarray};
use crate::quantise::{full_scale, noise_floor_codes, quantise};
use crate::scene::{Scene, SceneError};
use thiserror::Error;

/// A scene made ready for frames.
pub struct Golden {
    scene: Scene,
    parts: Vec<Subarray>,
    /// Shared by all subarrays: a partition's rectangles are equal.
    matrices: Matrices,
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
    /// Computes the matrices a scene needs; milliseconds for 10 × 10, seconds for the largest subarrays.
    ///
    /// # Errors
    /// [`GoldenError`] but `Frame` and `TooStrong`.
    pub fn new(scene: &Scene) -> Result<Golden, GoldenError> {
        scene.require_golden()?;
        let parts = subarrays(scene.partition.case, &scene.sensor)?;
        let shape = parts[0].sensor(&scene.sensor);
        Ok(Golden {
            scene: scene.clone(),
            matrices: Matrices::through(&shape, scene.medium, scene.search.mu_max)?,
            parts,
        })
    }

    /// The matrices of a subarray.
    pub fn matrices(&self) -> &Matrices {
        &self.matrices
    }

    /// Reconstructs one frame. Forces come from the stress as it is, the condition from its codes.
    ///
    /// # Errors
    /// `Frame` when the frame is not the scene's, `TooStrong` when a force overflows.
    pub fn run(&self, frame: &Frame) -> Result<Reconstruction, GoldenError> {
        let scene = &self.scene;
        frame.check(scene)?;
        let codes = quantise(&frame.stress_MPa, scene.fixed.input_bits, full_scale(scene, frame));
        let floor = noise_floor_codes(scene, &codes);
        let mut flags = frame_flags(scene, frame, &codes);
        let mut forces = Forces::zeros(scene.sensor.taxels());
        let mut results = Vec::with_capacity(self.parts.len());
        for part in &self.parts {
            let own_codes = part.gather(&scene.sensor, &codes.codes);
            let receipt = receive(&scene.sensor, part, &own_codes, floor, scene.partition.condition);
            let b = part.gather(&scene.sensor, &frame.stress_MPa);
            let (found, own) = self.solve(&b, receipt.condition_met);
            if receipt.condition_met && found.is_none() {
                flags.push(Flag::NoCompression);
            }
            part.scatter(&scene.sensor, &own.fx, &mut forces.fx);
            part.scatter(&scene.sensor, &own.fy, &mut forces.fy);
            part.scatter(&scene.sensor, &own.fz, &mut forces.fz);
            results.push(SubarrayResult {
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
        if !forces.resultant().iter().all(|sum| sum.is_finite()) {
            let (frame, peak_MPa) = (frame.id.clone(), frame.peak_MPa());
            return Err(GoldenError::TooStrong { frame, peak_MPa });
        }
        Ok(assemble(scene, frame, "golden", results, forces, flags))
    }

    /// One subarray: the family, the search where the condition is met, the forces.
    fn solve(&self, b: &[f64], condition_met: bool) -> (Option<Found>, Forces) {
        let min_force = self.scene.threshold.min_force_N;
        if !condition_met {
            let family = Polynomial::of_degree(&self.matrices, b, 0);
            return (None, force(family.v(0, 0), [0.0; 2], min_force));
        }
        let family = Polynomial::new(&self.matrices, b);
        let found = search(&family, self.scene.search.mu_max, &Sparse::default());
        let mu = found.map_or([0.0; 2], |found| found.mu);
        (found, force(&family.eval(mu), mu, min_force))
    }
}
