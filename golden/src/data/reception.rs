//! Receive: whether a subarray is loaded and meets the scene's condition, and the centroids of compression and tension.
//!
//! c⁺ = Σ b⁺ r / Σ b⁺ over the codes above the noise floor, c⁻ = Σ b⁻ r / Σ b⁻ over those below its negative.
//!
//! | | shape | unit | range |
//! |---|---|---|---|
//! | in: codes | n, row-major in the subarray | LSB | ±(2^(bits − 1) − 1) |
//! | in: floor | scalar | LSB | at least 0; a code counts when strictly beyond it |
//! | out: centroids | 2 | mm from the array's centre | inside the subarray |
//!
//! Decided on codes, in integers, so that all models decide alike: positions count half pitches, sums stay below 2^23 ·
//! 2304 · 255 < 2^43. Feeds `search`, which runs only where the condition is met.

use crate::data::frame::Frame;
use crate::data::quantise::Codes;
use crate::spec::partition::Subarray;
use crate::spec::scene::{Condition, Scene};
use crate::spec::sensor::Sensor;

/// Full scale in MPa: the scene's, else the frame's largest |b|, else (all zero) 1 MPa.
pub fn full_scale(scene: &Scene, frame: &Frame) -> f64 {
    scene.input.full_scale_MPa.unwrap_or_else(|| {
        let peak = frame.peak_MPa();
        if peak > 0.0 {
            peak
        } else {
            1.0
        }
    })
}

/// The scene's noise floor in LSBs, rounded down; a code counts if its magnitude is strictly larger.
pub fn noise_floor_codes(scene: &Scene, codes: &Codes) -> i32 {
    // The cast saturates.
    (scene.search.noise_floor_MPa() / codes.lsb_MPa()).floor() as i32
}

/// Sign, condition and centroids of one subarray's codes.
#[derive(Clone, Debug, PartialEq)]
pub struct SubarrayStats {
    /// Largest |code| in LSBs.
    pub max_code: i32,
    /// Some code is above the floor.
    pub positive: bool,
    /// Some code is below the floor's negative.
    pub negative: bool,
    /// Centroid of the codes above the floor in mm from the array's centre; `None` if there are none.
    pub compression_centroid_mm: Option<[f64; 2]>,
    /// Centroid of the codes below the floor's negative in mm from the array's centre; `None` if there are none.
    pub tension_centroid_mm: Option<[f64; 2]>,
    /// Whether the scene's condition for a search is met.
    pub condition_met: bool,
    /// Whether the largest |code| is beyond the floor.
    pub loaded: bool,
}

/// Sums over the codes of one sign.
#[derive(Default)]
struct Moments {
    weight: i64,
    /// Σ code · position in half pitches from the array's centre.
    x: i64,
    y: i64,
}

impl Moments {
    fn centroid_mm(&self, sensor: &Sensor) -> Option<[f64; 2]> {
        let mean = |moment: i64| moment as f64 / self.weight as f64;
        (self.weight != 0).then(|| [mean(self.x) * sensor.pitch_x_mm / 2.0, mean(self.y) * sensor.pitch_y_mm / 2.0])
    }
}

/// Evaluates the codes of subarray `part` of `sensor`; `floor` is the noise floor in codes, ≥ 0.
pub fn receive(sensor: &Sensor, part: &Subarray, codes: &[i32], floor: i32, condition: Condition) -> SubarrayStats {
    let (mut compression, mut tension) = (Moments::default(), Moments::default());
    let mut max_code = 0;
    let half_pitches = |index: usize, count: usize| 2 * index as i64 - (count as i64 - 1);
    for (index, &code) in part.indices(sensor).zip(codes) {
        max_code = max_code.max(code.abs());
        let sum = match code {
            _ if code > floor => &mut compression,
            _ if code < -floor => &mut tension,
            _ => continue,
        };
        let code = i64::from(code);
        sum.weight += code;
        sum.x += code * half_pitches(index % sensor.cols, sensor.cols);
        sum.y += code * half_pitches(index / sensor.cols, sensor.rows);
    }
    let (positive, negative) = (compression.weight != 0, tension.weight != 0);
    let loaded = max_code > floor;
    SubarrayStats {
        max_code,
        positive,
        negative,
        compression_centroid_mm: compression.centroid_mm(sensor),
        tension_centroid_mm: tension.centroid_mm(sensor),
        condition_met: match condition {
            Condition::Loaded => loaded,
            Condition::BothSigns => positive && negative,
        },
        loaded,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::quantise::quantise;
    use proptest::prelude::*;

    fn sensor() -> Sensor {
        Sensor { rows: 2, cols: 4, pitch_x_mm: 2.0, pitch_y_mm: 4.0, thickness_mm: 3.0 }
    }

    /// The right half, at x = 1 and 3, y = −2 and 2.
    const RIGHT: Subarray = Subarray { row0: 0, col0: 2, rows: 2, cols: 2 };

    #[test]
    fn by_hand() {
        let received = receive(&sensor(), &RIGHT, &[30, 10, -5, -15], 4, Condition::BothSigns);
        assert_eq!(received.max_code, 30);
        assert_eq!(received.compression_centroid_mm, Some([1.5, -2.0]));
        assert_eq!(received.tension_centroid_mm, Some([2.5, 2.0]));
        assert!(received.condition_met && received.loaded);
    }

    #[test]
    fn the_floor_itself_does_not_count() {
        let run = |codes: &[i32], condition| receive(&sensor(), &RIGHT, codes, 5, condition);
        let quiet = run(&[5, -5, 0, 0], Condition::Loaded);
        assert!(!quiet.loaded && !quiet.condition_met && !quiet.positive && !quiet.negative);
        assert_eq!(quiet.compression_centroid_mm, None);
        let pressed = [6, -5, 0, 0];
        assert!(run(&pressed, Condition::Loaded).condition_met);
        assert!(!run(&pressed, Condition::BothSigns).condition_met);
        assert_eq!(run(&pressed, Condition::Loaded).tension_centroid_mm, None);
    }

    #[test]
    fn a_floor_beyond_every_code_is_quiet() {
        let codes = [i32::MAX, -i32::MAX, 1, 0];
        let received = receive(&sensor(), &RIGHT, &codes, i32::MAX, Condition::Loaded);
        assert!(!received.loaded && !received.positive && !received.negative);
    }

    #[test]
    fn full_scale_falls_back_to_the_frame() {
        let mut scene = Scene::builtin("sensor-1").unwrap();
        let mut frame = Frame::eq2(&scene.sensor);
        assert_eq!(full_scale(&scene, &frame), frame.peak_MPa());
        frame.stress_MPa.fill(0.0);
        assert_eq!(full_scale(&scene, &frame), 1.0);
        scene.input.full_scale_MPa = Some(0.25);
        assert_eq!(full_scale(&scene, &frame), 0.25);
    }

    #[test]
    fn noise_floor_rounds_down_and_saturates() {
        let mut scene = Scene::builtin("sensor-1").unwrap();
        let codes = quantise(&[0.0], 8, 127.0);
        for (floor, expected) in [(0.0, 0), (2.9, 2), (1e300, i32::MAX)] {
            scene.search.noise_floor_MPa = Some(floor);
            assert_eq!(noise_floor_codes(&scene, &codes), expected);
        }
    }

    proptest! {
        #[test]
        fn centroids_lie_inside(codes in proptest::collection::vec(-8_388_607i32..=8_388_607, 4)) {
            let received = receive(&sensor(), &RIGHT, &codes, 0, Condition::Loaded);
            for [x, y] in received.compression_centroid_mm.into_iter().chain(received.tension_centroid_mm) {
                prop_assert!((1.0..=3.0).contains(&x) && (-2.0..=2.0).contains(&y));
            }
        }
    }
}
