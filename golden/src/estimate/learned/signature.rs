//! Signature: the physics that a network was trained for, that of one sensor or of a range of them.
//!
//! A network for a range has three inputs more, where the sensor lies in it. They are the same for every frame, so that they become a
//! part of the first layer's bias when the file is read for a scene: the network is then one for this sensor.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: scene | – | – |
//! | out: whether a network serves it, and the field that forbids it | – | – |
//! | out: place of a sensor in a range | 3 | −1 … 1 |

use super::error::LearnedError;
use crate::spec::partition::Case;
use crate::spec::scene::{EstimatorKind, Medium, Scene};
use crate::spec::sensor::Sensor;
use crate::spec::window::Window;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Fractional parts of a low-discrepancy sequence in three dimensions: powers of the reciprocal of 1.2207…, the root of x⁴ = x + 1.
const SPREAD: [f64; 3] = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_971_5];

/// The physics that a network was trained for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Signature {
    /// Pitches and cover.
    #[serde(flatten)]
    pub cover: Cover,
    /// The window that is read.
    pub window: Window,
    /// Whether tension reads as zero.
    pub unipolar: bool,
    /// Largest ratio of shear to normal force.
    pub mu_max: f64,
}

/// The pitches and the cover of one sensor, or of a range of sensors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Cover {
    /// One sensor.
    One {
        /// Pitch along columns in mm.
        pitch_x_mm: f64,
        /// Pitch along rows in mm.
        pitch_y_mm: f64,
        /// Thickness of the cover in mm.
        thickness_mm: f64,
        /// The elastic body.
        medium: Medium,
    },
    /// Any sensor of a range.
    Range(SensorRange),
}

/// Sensors that one network serves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensorRange {
    /// Least and largest pitch, along x and y alike, in units of the thickness.
    pub pitch_over_thickness: [f64; 2],
    /// Least and largest Poisson ratio of a bonded layer; `None`: a half-space, whose stress does not depend on it.
    pub poisson: Option<[f64; 2]>,
}

impl Cover {
    /// That of a scene.
    fn of(scene: &Scene) -> Cover {
        let Sensor { pitch_x_mm, pitch_y_mm, thickness_mm, .. } = scene.sensor;
        Cover::One { pitch_x_mm, pitch_y_mm, thickness_mm, medium: scene.medium }
    }

    /// Inputs of the network that state the sensor.
    pub(super) fn inputs(&self) -> usize {
        match self {
            Cover::One { .. } => 0,
            Cover::Range(_) => SensorRange::INPUTS,
        }
    }

    /// Field, value it was trained for and value of the scene where they differ.
    fn difference(&self, scene: &Scene) -> Option<(&'static str, String, String)> {
        let sensor = &scene.sensor;
        match self {
            Cover::One { pitch_x_mm, pitch_y_mm, thickness_mm, medium } => first_difference([
                ("sensor.pitch_x_mm", pitch_x_mm.to_string(), sensor.pitch_x_mm.to_string()),
                ("sensor.pitch_y_mm", pitch_y_mm.to_string(), sensor.pitch_y_mm.to_string()),
                ("sensor.thickness_mm", thickness_mm.to_string(), sensor.thickness_mm.to_string()),
                ("medium.kind", medium.to_string(), scene.medium.to_string()),
            ]),
            Cover::Range(range) => range.difference(sensor, scene.medium),
        }
    }

    /// The scene itself for one sensor; for a range `count` scenes with sensors spread evenly over it, of the scene's thickness.
    pub fn scenes(&self, scene: &Scene, count: usize) -> Vec<Scene> {
        match self {
            Cover::One { .. } => vec![scene.clone()],
            Cover::Range(range) => (0..count).map(|index| range.scene(scene, index)).collect(),
        }
    }
}

impl fmt::Display for Cover {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Cover::One { pitch_x_mm, pitch_y_mm, thickness_mm, medium } => {
                write!(f, "pitch {pitch_x_mm} × {pitch_y_mm} mm, thickness {thickness_mm} mm, {medium}")
            }
            Cover::Range(range) => {
                write!(f, "pitches of {} of the thickness, {}", between(range.pitch_over_thickness), range.medium())
            }
        }
    }
}

impl SensorRange {
    /// Inputs of a network that state where a sensor lies in a range.
    pub(super) const INPUTS: usize = 3;
    /// Poisson ratios of bonded layers that a network for a range is trained for: those that the hardware takes.
    pub const POISSON: [f64; 2] = [0.3, 0.499];

    /// Where a sensor lies in the range, from −1 to 1 within it: the logarithms of both pitches over the thickness, Poisson ratio.
    pub(super) fn place(&self, sensor: &Sensor, medium: Medium) -> [f32; SensorRange::INPUTS] {
        let within = |[low, high]: [f64; 2], value: f64| match high > low {
            true => (2.0 * (value - low) / (high - low) - 1.0) as f32,
            false => 0.0,
        };
        let of_pitch = |pitch: f64| within(self.pitch_over_thickness.map(f64::ln), (pitch / sensor.thickness_mm).ln());
        let of_poisson = match (self.poisson, medium) {
            (Some(range), Medium::BondedLayer { poisson }) => within(range, poisson),
            _ => 0.0,
        };
        [of_pitch(sensor.pitch_x_mm), of_pitch(sensor.pitch_y_mm), of_poisson]
    }

    /// `scene` with the sensor of this number.
    fn scene(&self, scene: &Scene, index: usize) -> Scene {
        let [x, y, z] = SPREAD.map(|step| (0.5 + (index + 1) as f64 * step).fract());
        let at = |[low, high]: [f64; 2], share: f64| low + share * (high - low);
        let pitch = |share: f64| at(self.pitch_over_thickness.map(f64::ln), share).exp() * scene.sensor.thickness_mm;
        let mut own = scene.clone();
        (own.sensor.pitch_x_mm, own.sensor.pitch_y_mm) = (pitch(x), pitch(y));
        if let Some(poisson) = self.poisson {
            own.medium = Medium::BondedLayer { poisson: at(poisson, z) };
        }
        own
    }

    /// The field of a sensor that is not in the range, the range, and the value.
    fn difference(&self, sensor: &Sensor, medium: Medium) -> Option<(&'static str, String, String)> {
        // A value of the range's end is in it, whichever way a scene's file rounds it.
        let outside = |[low, high]: [f64; 2], value: f64| !(low * (1.0 - 1e-9)..=high * (1.0 + 1e-9)).contains(&value);
        let pitches = [("sensor.pitch_x_mm", sensor.pitch_x_mm), ("sensor.pitch_y_mm", sensor.pitch_y_mm)];
        let over = pitches.map(|(field, pitch)| (field, pitch / sensor.thickness_mm));
        if let Some((field, value)) = over.into_iter().find(|(_, value)| outside(self.pitch_over_thickness, *value)) {
            let range = between(self.pitch_over_thickness);
            return Some((field, format!("{range} of the thickness"), format!("{value:.4} of it")));
        }
        let fits = match (self.poisson, medium) {
            (None, Medium::HalfSpace) => true,
            (Some(range), Medium::BondedLayer { poisson }) => !outside(range, poisson),
            _ => false,
        };
        (!fits).then(|| ("medium.kind", self.medium(), medium.to_string()))
    }

    /// The medium in words.
    fn medium(&self) -> String {
        self.poisson.map_or("half-space".to_owned(), |range| format!("bonded-layer, poisson {}", between(range)))
    }
}

impl Signature {
    /// The signature of a scene.
    pub fn of(scene: &Scene) -> Signature {
        Signature {
            cover: Cover::of(scene),
            window: match scene.partition.case {
                Case::Contacts => Window::around_contact(&scene.sensor),
                _ => Window::of(&scene.sensor),
            },
            unipolar: scene.input.unipolar,
            mu_max: scene.search.mu_max,
        }
    }

    /// Checks that a network with this signature serves an estimator of `scene`; `file` names it in the error.
    ///
    /// # Errors
    /// [`LearnedError::Mismatch`] with the first field that differs.
    pub fn check(&self, scene: &Scene, estimator: EstimatorKind, file: &str) -> Result<(), LearnedError> {
        let mut wanted = Signature::of(scene);
        // An estimator with evidence takes either window.
        let either = [Window::of(&scene.sensor), Window::around_contact(&scene.sensor)];
        if estimator.has_evidence() && either.contains(&self.window) {
            wanted.window = self.window;
        }
        let others = || {
            first_difference([
                ("sensor.rows and cols", self.window.to_string(), wanted.window.to_string()),
                ("input.unipolar", self.unipolar.to_string(), wanted.unipolar.to_string()),
                ("search.mu_max", self.mu_max.to_string(), wanted.mu_max.to_string()),
            ])
        };
        match self.cover.difference(scene).or_else(others) {
            None => Ok(()),
            Some((field, trained, scene)) => {
                Err(LearnedError::Mismatch { file: file.to_owned(), field, trained, scene })
            }
        }
    }
}

/// A range in words.
fn between([low, high]: [f64; 2]) -> String {
    format!("{low} to {high}")
}

/// The first of these fields whose values differ.
fn first_difference<const N: usize>(
    fields: [(&'static str, String, String); N],
) -> Option<(&'static str, String, String)> {
    fields.into_iter().find(|(_, own, other)| own != other)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_physics_is_refused_by_field() {
        let scene = Scene::builtin("sensor-1").unwrap();
        let signature = Signature::of(&scene);
        assert!(signature.check(&scene, EstimatorKind::Network, "n").is_ok());
        let refused = |change: fn(&mut Scene)| {
            let mut other = scene.clone();
            change(&mut other);
            signature.check(&other, EstimatorKind::Network, "n").unwrap_err().to_string()
        };
        type Case = (fn(&mut Scene), &'static str);
        let cases: [Case; 7] = [
            (|s| s.sensor.pitch_x_mm = 2.5, "sensor.pitch_x_mm = 2, the scene has 2.5"),
            (|s| s.sensor.pitch_y_mm = 2.0, "sensor.pitch_y_mm = 4, the scene has 2"),
            (|s| s.sensor.thickness_mm = 4.0, "sensor.thickness_mm = 3, the scene has 4"),
            (|s| s.medium = Medium::BondedLayer { poisson: 0.48 }, "half-space, the scene has bonded-layer"),
            (|s| s.sensor.rows = 9, "whole array of 10 × 10, the scene has whole array of 9 × 10"),
            (|s| s.input.unipolar = true, "input.unipolar = false, the scene has true"),
            (|s| s.search.mu_max = 1.0, "search.mu_max = 0.6, the scene has 1"),
        ];
        for (change, wanted) in cases {
            let message = refused(change);
            assert!(message.starts_with("n:") && message.contains(wanted), "{message}");
        }
    }
}
