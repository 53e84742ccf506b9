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
use crate::spec::window::{Place, Window};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Base of a low-discrepancy sequence in five dimensions, whose steps are powers of its reciprocal: the root of x⁶ = x + 1.
const BASE: f64 = 1.134_724_138_401_519_5;
/// Least width of an array in units of its thickness: on a smaller one the contacts of the training have no place.
const LEAST_WIDTH: f64 = 5.0;

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
    /// Fewest rows and columns of an array: those of the window, or fewer by even numbers. `None`: those of the window alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub least_side: Option<usize>,
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

    /// Whether there is a sensor of it.
    pub(super) fn is_possible(&self) -> bool {
        let ordered = |[low, high]: [f64; 2]| 0.0 < low && low <= high;
        match self {
            Cover::One { .. } => true,
            Cover::Range(range) => ordered(range.pitch_over_thickness) && range.poisson.is_none_or(ordered),
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

    /// The scene itself for one sensor; for a range `count` scenes with sensors spread evenly over it, of the scene's thickness; the scene
    /// has the largest array.
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
        let share = |axis: i32| (0.5 + (index + 1) as f64 * BASE.powi(-axis)).fract();
        let at = |[low, high]: [f64; 2], share: f64| low + share * (high - low);
        let pitch = |share: f64| at(self.pitch_over_thickness.map(f64::ln), share).exp() * scene.sensor.thickness_mm;
        let mut drawn = scene.clone();
        (drawn.sensor.pitch_x_mm, drawn.sensor.pitch_y_mm) = (pitch(share(1)), pitch(share(2)));
        if let Some(poisson) = self.poisson {
            drawn.medium = Medium::BondedLayer { poisson: at(poisson, share(3)) };
        }
        if let Some(least) = self.least_side {
            let side = |largest: usize, pitch_mm: f64, share: f64| {
                let fewer = largest.saturating_sub(fewest(least, pitch_mm, drawn.sensor.thickness_mm)) / 2;
                largest - 2 * ((share * (fewer + 1) as f64) as usize).min(fewer)
            };
            let rows = side(drawn.sensor.rows, drawn.sensor.pitch_y_mm, share(4));
            (drawn.sensor.cols, drawn.sensor.rows) = (side(drawn.sensor.cols, drawn.sensor.pitch_x_mm, share(5)), rows);
        }
        drawn
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
        let own = Signature::of(scene);
        // An estimator with evidence takes either window.
        let either = [Window::of(&scene.sensor), Window::around_contact(&scene.sensor)];
        let serves =
            self.serves(&own.window, &scene.sensor) || estimator.has_evidence() && either.contains(&self.window);
        let window = (!serves).then(|| ("sensor.rows and cols", self.windows(), own.window.to_string()));
        let others = || {
            first_difference([
                ("input.unipolar", self.unipolar.to_string(), own.unipolar.to_string()),
                ("search.mu_max", self.mu_max.to_string(), own.mu_max.to_string()),
            ])
        };
        match self.cover.difference(scene).or(window).or_else(others) {
            None => Ok(()),
            Some((field, trained, scene)) => {
                Err(LearnedError::Mismatch { file: file.to_owned(), field, trained, scene })
            }
        }
    }

    /// Whether it serves this window of `sensor`: its own, of a range those of smaller arrays too.
    fn serves(&self, array: &Window, sensor: &Sensor) -> bool {
        if *array == self.window {
            return true;
        }
        let Cover::Range(SensorRange { least_side: Some(least), .. }) = self.cover else { return false };
        let fits = |own: usize, largest: usize, pitch_mm: f64| {
            let fewest = fewest(least, pitch_mm, sensor.thickness_mm);
            (fewest..=largest).contains(&own) && (largest - own).is_multiple_of(2)
        };
        let places = [self.window.place, array.place];
        places == [Place::Array; 2]
            && fits(array.rows, self.window.rows, sensor.pitch_y_mm)
            && fits(array.cols, self.window.cols, sensor.pitch_x_mm)
    }

    /// The windows that it serves, in words.
    fn windows(&self) -> String {
        match self.cover {
            Cover::Range(SensorRange { least_side: Some(least), .. }) => {
                format!("{}, or fewer by even numbers, at least {least} and {LEAST_WIDTH} thicknesses", self.window)
            }
            _ => self.window.to_string(),
        }
    }
}

/// Fewest rows or columns of an array of a range, `least` or more.
fn fewest(least: usize, pitch_mm: f64, thickness_mm: f64) -> usize {
    ((LEAST_WIDTH * thickness_mm / pitch_mm).ceil() as usize).max(least)
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

    /// A change of a scene, and what its refusal says.
    type Case = (fn(&mut Scene), &'static str);

    /// The signature does not serve `scene` after any of the changes.
    fn is_refused(signature: &Signature, scene: &Scene, cases: &[Case]) {
        for (change, wanted) in cases {
            let mut other = scene.clone();
            change(&mut other);
            let message = signature.check(&other, EstimatorKind::Network, "n").unwrap_err().to_string();
            assert!(message.starts_with("n:") && message.contains(wanted), "{message}");
        }
    }

    #[test]
    fn another_physics_is_refused_by_field() {
        let scene = Scene::builtin("sensor-1").unwrap();
        let signature = Signature::of(&scene);
        assert!(signature.check(&scene, EstimatorKind::Network, "n").is_ok());
        let cases: [Case; 7] = [
            (|s| s.sensor.pitch_x_mm = 2.5, "sensor.pitch_x_mm = 2, the scene has 2.5"),
            (|s| s.sensor.pitch_y_mm = 2.0, "sensor.pitch_y_mm = 4, the scene has 2"),
            (|s| s.sensor.thickness_mm = 4.0, "sensor.thickness_mm = 3, the scene has 4"),
            (|s| s.medium = Medium::BondedLayer { poisson: 0.48 }, "half-space, the scene has bonded-layer"),
            (|s| s.sensor.rows = 9, "whole array of 10 × 10, the scene has whole array of 9 × 10"),
            (|s| s.input.unipolar = true, "input.unipolar = false, the scene has true"),
            (|s| s.search.mu_max = 1.0, "search.mu_max = 0.6, the scene has 1"),
        ];
        is_refused(&signature, &scene, &cases);
    }

    /// A network for a range serves every sensor in it, and names the field of one that is not.
    #[test]
    fn a_sensor_outside_the_range_is_refused_by_field() {
        let scene = Scene::builtin("sensor-1-bonded").unwrap();
        let range =
            SensorRange { pitch_over_thickness: [0.5, 2.0], poisson: Some(SensorRange::POISSON), least_side: None };
        let signature = Signature { cover: Cover::Range(range.clone()), ..Signature::of(&scene) };
        assert!(signature.check(&scene, EstimatorKind::Network, "n").is_ok());
        let spread = signature.cover.scenes(&scene, 60);
        let serves = |scene: &Scene| signature.check(scene, EstimatorKind::Network, "n").is_ok();
        assert!(spread.len() == 60 && spread.iter().all(serves));
        let places: Vec<[f32; 3]> = spread.iter().map(|scene| range.place(&scene.sensor, scene.medium)).collect();
        for axis in 0..3 {
            // Spread evenly: as many below the middle as above, and near both ends.
            let own: Vec<f32> = places.iter().map(|place| place[axis]).collect();
            assert!((25..=35).contains(&own.iter().filter(|place| **place < 0.0).count()));
            assert!(own.iter().any(|place| *place < -0.9) && own.iter().any(|place| *place > 0.9));
            assert!(own.iter().all(|place| (-1.0..=1.0).contains(place)));
        }
        let cases: [Case; 5] = [
            (
                |s| s.sensor.pitch_x_mm = 1.4,
                "sensor.pitch_x_mm = 0.5 to 2 of the thickness, the scene has 0.4667 of it",
            ),
            (
                |s| s.sensor.thickness_mm = 1.9,
                "sensor.pitch_y_mm = 0.5 to 2 of the thickness, the scene has 2.1053 of it",
            ),
            (|s| s.medium = Medium::BondedLayer { poisson: 0.29 }, "poisson 0.3 to 0.499, the scene has bonded-layer"),
            (|s| s.medium = Medium::HalfSpace, "poisson 0.3 to 0.499, the scene has half-space"),
            (|s| s.sensor.rows = 9, "whole array of 10 × 10, the scene has whole array of 9 × 10"),
        ];
        is_refused(&signature, &scene, &cases);
    }

    /// Of a range smaller arrays too, down to the least side and the least width, by even numbers.
    #[test]
    fn smaller_arrays_of_a_range_are_served() {
        let mut scene = Scene::builtin("eight-by-eight-bonded").unwrap();
        let range =
            SensorRange { pitch_over_thickness: [0.5, 2.0], poisson: Some(SensorRange::POISSON), least_side: Some(6) };
        let window = Window { place: Place::Array, rows: 12, cols: 12 };
        let signature = Signature { cover: Cover::Range(range), window, ..Signature::of(&scene) };
        let mut refused = |rows: usize, cols: usize, pitch_mm: f64| {
            (scene.sensor.rows, scene.sensor.cols) = (rows, cols);
            (scene.sensor.pitch_x_mm, scene.sensor.pitch_y_mm) = (pitch_mm, pitch_mm);
            signature.check(&scene, EstimatorKind::Network, "n").map_err(|error| error.to_string()).err()
        };
        for (rows, cols, pitch_mm) in [(12, 12, 1.5), (8, 10, 4.0), (6, 12, 2.5), (10, 6, 3.0)] {
            assert_eq!(refused(rows, cols, pitch_mm), None, "{rows} × {cols}");
        }
        for (rows, cols, pitch_mm) in [(12, 14, 3.0), (9, 10, 4.0), (4, 8, 4.0), (8, 8, 1.5)] {
            let message = refused(rows, cols, pitch_mm).unwrap();
            let wanted =
                "whole array of 12 × 12, or fewer by even numbers, at least 6 and 5 thicknesses, the scene has ";
            assert!(message.contains(wanted), "{message}");
        }
        let mut largest = Scene::builtin("eight-by-eight-bonded").unwrap();
        (largest.sensor.rows, largest.sensor.cols) = (12, 12);
        let all = signature.cover.scenes(&largest, 60);
        assert!(all.iter().all(|scene| signature.check(scene, EstimatorKind::Network, "n").is_ok()));
        assert!([6, 8, 10, 12].iter().all(|side| all.iter().any(|scene| scene.sensor.rows == *side)));
    }

    /// Older files, of one sensor, are read as they were; a range is written beside the other fields.
    #[test]
    fn signatures_in_json() {
        let scene = Scene::builtin("sensor-1").unwrap();
        let one = serde_json::to_value(Signature::of(&scene)).unwrap();
        assert_eq!((&one["pitch_y_mm"], &one["medium"]["kind"]), (&4.0.into(), &"half-space".into()));
        let range = SensorRange { pitch_over_thickness: [0.5, 2.0], poisson: None, least_side: None };
        let signature = Signature { cover: Cover::Range(range), ..Signature::of(&scene) };
        let text = serde_json::to_string(&signature).unwrap();
        assert!(text.starts_with("{\"pitch_over_thickness\":[0.5,2.0],\"poisson\":null,\"window\":"), "{text}");
        assert_eq!(serde_json::from_str::<Signature>(&text).unwrap(), signature);
        assert_eq!(serde_json::from_value::<Signature>(one).unwrap(), Signature::of(&scene));
    }
}
