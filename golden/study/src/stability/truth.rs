//! Truth: known forces of a scene, their stress, and the errors of reconstructed forces.
//!
//! ```text
//! p ∝ √(1 − ρ²) on an ellipse, Σp = 1 N          b₀ = Cz p          b = (μ1 Cx + μ2 Cy + Cz) p
//! ```
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: scene | sensor, medium, mu_max | mm |
//! | in: frame | known forces and their stress for one shear, if given | N, MPa |
//! | out: two frames | taxels | MPa, forces in N |

use super::extended;
use dermis_golden::data::frame::{Forces, Frame};
use dermis_golden::estimate::float::forces::{force, residual};
use dermis_golden::physics::matrices::Matrices;
use dermis_golden::result::errors::Errors;
use dermis_golden::spec::scene::Scene;
use serde::Serialize;

/// Errors of one number format.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FormatErrors {
    /// Forward error ‖Cz⁺b₀ − p‖/‖p‖.
    pub forward: f64,
    /// Residual ‖b − C x‖/‖b‖.
    pub residual: f64,
    /// Normal error of the resultant; `None` if undefined.
    pub normal: Option<f64>,
    /// Tangential error of the resultant; `None` if undefined.
    pub tangential: Option<f64>,
}

/// Ratio of shear to load in units of mu_max, [x, y].
const SHEAR: [f64; 2] = [0.6, -0.35];
/// Half-axes of the pressure's ellipse and its centre, relative to the array's width.
const HALF_AXIS: f64 = 0.38;
const PLACE: [f64; 2] = [0.05, -0.04];
/// Known forces and their stress.
pub(super) struct Truth {
    p: Vec<f64>,
    /// The frame with the shear μ p.
    pub(super) sheared: Frame,
    /// The frame without shear.
    pub(super) unsheared: Frame,
}

impl Truth {
    /// The two frames: of the known forces if given, else of the Hertz pressure.
    pub(super) fn of(scene: &Scene, known: Option<&Frame>) -> Truth {
        let forces = known.and_then(|frame| Some((frame, frame.cell_forces_N.as_ref()?)));
        let Some((frame, forces)) = forces else { return Truth::hertz(scene) };
        let p = forces.fz.clone();
        Truth { unsheared: made(scene, "normal", &p, [0.0; 2]), sheared: frame.clone(), p }
    }

    fn hertz(scene: &Scene) -> Truth {
        let sensor = &scene.sensor;
        let along =
            |steps: usize, count: usize, place: f64| ((steps as f64 + 0.5) / count as f64 - 0.5 - place) / HALF_AXIS;
        let at = |taxel: usize| {
            let x = along(taxel % sensor.cols, sensor.cols, PLACE[0]);
            let y = along(taxel / sensor.cols, sensor.rows, PLACE[1]);
            (1.0 - x * x - y * y).max(0.0).sqrt()
        };
        let raw: Vec<f64> = (0..sensor.taxels()).map(at).collect();
        let sum: f64 = raw.iter().sum();
        let p: Vec<f64> = raw.iter().map(|p| p / sum).collect();
        let mu = SHEAR.map(|share| share * scene.search.mu_max);
        Truth { sheared: made(scene, "sheared", &p, mu), unsheared: made(scene, "normal", &p, [0.0; 2]), p }
    }

    /// Forward error ‖p̂ − p‖/‖p‖ of reconstructed normal forces p̂.
    pub(super) fn forward(&self, p: &[f64]) -> f64 {
        let off: Vec<f64> = p.iter().zip(&self.p).map(|(p, q)| p - q).collect();
        norm(&off) / norm(&self.p)
    }

    /// The errors of the forces reconstructed from the sheared frame, with a given forward error.
    pub(super) fn figures(&self, matrices: &Matrices, forward: f64, forces: &Forces) -> FormatErrors {
        let b = &self.sheared.stress_MPa;
        let rest = residual(matrices, b, forces);
        let errors = self.sheared.resultant_N.map(|truth| Errors::new(truth, forces.resultant()));
        FormatErrors {
            forward,
            residual: norm(&rest) / norm(b),
            normal: errors.and_then(|errors| errors.normal),
            tangential: errors.and_then(|errors| errors.tangential),
        }
    }
}

/// The frame of known forces.
fn made(scene: &Scene, id: &str, p: &[f64], mu: [f64; 2]) -> Frame {
    let forces = force(p, mu, 0.0);
    Frame {
        id: id.to_string(),
        medium: Some(scene.medium),
        source: Some("cell model, extended precision".to_string()),
        sensor: scene.sensor.clone(),
        contacts: Vec::new(),
        resultant_N: Some(forces.resultant()),
        cell_forces_N: Some(forces),
        stress_MPa: extended::stress_MPa(&scene.sensor, scene.medium, p, mu),
        missing: Vec::new(),
        time_ns: None,
        notes: None,
    }
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}
