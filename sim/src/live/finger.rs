//! The finger: frames of the contact that the page's mouse describes, with their exact forces.
//!
//! | the page's mouse | the contact |
//! |---|---|
//! | pressed | a Hertzian circle there, with the normal force of the page's slider |
//! | dragged | a tangential force along the way from where it was pressed, up to friction; beyond it the contact slides |
//! | released | none: a frame of zeros |
//!
//! Until a mouse is pressed for the first time, a press plays: a finger that goes round and is sheared on its way.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use anyhow::Result;
use dermis_golden::data::frame::{Contact, Forces, Frame};
use dermis_golden::data::generator::converter::Converter;
use dermis_golden::data::generator::generate;
use dermis_golden::plain_words::JsonError;
use dermis_golden::spec::scene::Scene;
use serde::Deserialize;

use dermis_host::engine::typed;
use dermis_host::stream::{nanoseconds, seconds, Estimators, Note, Outcome, Output, StreamAnswer};

/// Radius of the finger over the larger pitch: some dozen taxels are pressed.
const RADIUS_IN_PITCHES: f64 = 2.0;
/// Largest normal force in N that is taken from the page.
const MOST_N: f64 = 1000.0;
/// Time in s in which the finger that plays goes round.
const ROUND_S: f64 = 8.0;
/// Its distance from the array's centre over half the array's size.
const ROUND_SHARE: f64 = 0.4;
/// Its mean normal force in N, and its tangential force over the normal one.
const PLAYED: (f64, f64) = (4.0, 0.3);

/// What the page's mouse does.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Finger {
    /// Centre in mm from the array's centre, [x, y].
    pub centre_mm: [f64; 2],
    /// Force in N, [x, y, normal].
    pub force_N: [f64; 3],
}

impl Finger {
    /// The finger in a request's body; `null` is none.
    ///
    /// # Errors
    /// Anything but `null` or two finite coordinates on the array and a force with a positive normal part.
    pub fn read(body: &[u8], scene: &Scene) -> Result<Option<Finger>, String> {
        let finger: Option<Finger> =
            serde_json::from_slice(body).map_err(|error| JsonError::new(&error).to_string())?;
        let Some(Finger { centre_mm, force_N }) = finger else { return Ok(None) };
        let half = scene.sensor.half_mm();
        if (0..2).any(|axis| centre_mm[axis].abs() > half[axis] || !centre_mm[axis].is_finite()) {
            return Err(format!("centre_mm = {centre_mm:?} is not allowed: up to ±{half:?}, on the array"));
        }
        if force_N.iter().any(|force| !force.is_finite() || force.abs() > MOST_N) || force_N[2] <= 0.0 {
            return Err(format!("force_N = {force_N:?} is not allowed: up to {MOST_N}, the normal one above 0"));
        }
        Ok(finger)
    }

    /// The finger that plays, some time after its start.
    fn playing(scene: &Scene, time_s: f64) -> Finger {
        let (normal, shear) = PLAYED;
        let (sin, cos) = (std::f64::consts::TAU * time_s / ROUND_S).sin_cos();
        let [x, y] = scene.sensor.half_mm();
        // Between half and one and a half of the mean, as it goes round.
        let normal = normal * (1.0 + 0.5 * sin);
        let along = [-sin, cos].map(|direction| shear * normal * direction);
        Finger { centre_mm: [ROUND_SHARE * x * cos, ROUND_SHARE * y * sin], force_N: [along[0], along[1], normal] }
    }

    fn contact(&self, scene: &Scene) -> Contact {
        let [x, y, normal] = self.force_N;
        Contact {
            shape: Some("hertz-circle".into()),
            centre_mm: Some(self.centre_mm),
            size_mm: vec![RADIUS_IN_PITCHES * scene.sensor.pitch_x_mm.max(scene.sensor.pitch_y_mm)],
            normal_N: Some(normal),
            tangential_N: Some([x, y]),
            ..Contact::default()
        }
    }
}

/// What the mouse has said.
#[derive(Clone, Copy, Default)]
enum Mouse {
    /// Nothing yet: a press plays.
    #[default]
    Silent,
    /// That it does not press.
    Up,
    /// Where it presses, and how.
    Down(Finger),
}

/// The finger as the mouse last described it; before its first word a press plays.
#[derive(Default)]
pub struct Hand(Mutex<Mouse>);

impl Hand {
    /// Takes what the mouse does now.
    pub fn set(&self, finger: Option<Finger>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = finger.map_or(Mouse::Up, Mouse::Down);
    }

    /// The finger `time_s` after the start.
    fn now(&self, scene: &Scene, time_s: f64) -> Option<Finger> {
        match *self.0.lock().unwrap_or_else(PoisonError::into_inner) {
            Mouse::Silent => Some(Finger::playing(scene, time_s)),
            Mouse::Up => None,
            Mouse::Down(finger) => Some(finger),
        }
    }

    /// Draws, reconstructs and shows a frame in every `period`, or as soon as the one before is done; `noise` is its
    /// standard deviation over the largest stress.
    ///
    /// # Errors
    /// A scene that generator or engine refuse, an output that fails.
    pub fn run(&self, mut estimators: Estimators, noise: f64, period: Duration, output: &mut Output) -> Result<()> {
        let (scene, mut change, start) = (estimators.scene(), None, Instant::now());
        for sequence in 0.. {
            let begun = Instant::now();
            let (received, received_at) = (SystemTime::now(), estimators.clock().now());
            let frame = self.frame(scene, noise, sequence, (begun - start).as_secs_f64())?;
            let frames = vec![frame; scene.input.frames_per_result()];
            let result = estimators.next(&frames).map_err(typed)?;
            let answered_s = seconds(SystemTime::now());
            let (line, times_ns) = (sequence + 1, vec![nanoseconds(received); frames.len()]);
            output(&Outcome::Answer(StreamAnswer {
                sequence,
                line,
                received_s: seconds(received),
                answered_s,
                dropped: 0,
                estimator: estimators.name(),
                estimator_change: change.take().as_deref(),
                frames: &frames,
                times_ns: &times_ns,
                result: &result,
            }))?;
            if let Some(Note { text, changed }) = estimators.after(line, received_at, 0) {
                output(&Outcome::Note(&text))?;
                change = changed.then_some(text);
            }
            std::thread::sleep(period.saturating_sub(begun.elapsed()));
        }
        Ok(())
    }

    /// The frame of the finger `time_s` after the start.
    fn frame(&self, scene: &Scene, noise: f64, seed: u64, time_s: f64) -> Result<Frame> {
        let id = format!("finger {seed}");
        let Some(finger) = self.now(scene, time_s) else {
            let taxels = scene.sensor.taxels();
            let mut frame = Frame::from_stress(&id, &scene.sensor, vec![0.0; taxels])?;
            (frame.resultant_N, frame.cell_forces_N) = (Some([0.0; 3]), Some(Forces::zeros(taxels)));
            return Ok(frame);
        };
        let frame = generate(&id, &scene.sensor, scene.medium, &[finger.contact(scene)])?;
        let (frames, unipolar) = (scene.input.frames_per_result(), scene.input.unipolar);
        Ok(Converter { noise, frames, unipolar, seed, ..Converter::default() }.convert(&frame)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finger_is_read_and_what_is_wrong_is_named() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let read = |text: &str| Finger::read(text.as_bytes(), &scene);
        assert_eq!(read("null"), Ok(None));
        let finger = Finger { centre_mm: [1.0, -2.0], force_N: [0.5, 0.0, 2.0] };
        assert_eq!(read("{\"centre_mm\": [1, -2], \"force_N\": [0.5, 0, 2]}"), Ok(Some(finger)));
        for (text, wanted) in [
            ("{\"centre_mm\": [1e9, 0], \"force_N\": [0, 0, 1]}", "centre_mm = [1000000000.0, 0.0] is not allowed"),
            ("{\"centre_mm\": [0, 0], \"force_N\": [0, 0, 0]}", "force_N = [0.0, 0.0, 0.0] is not allowed"),
            ("{\"centre_mm\": [0, 0], \"force_N\": [0, 2000, 1]}", "force_N = [0.0, 2000.0, 1.0] is not allowed"),
            ("{\"centre_mm\": [0, 0]}", "line 1, column 21: force_N is missing"),
            ("{\"force\": 1}", "line 1, column 8: unknown field force;"),
            ("", "line 1, column 1: the text ends where a value is wanted"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.starts_with(wanted), "{error}");
        }
    }

    #[test]
    fn the_frame_has_the_forces_of_the_finger() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let hand = Hand::default();
        hand.set(None);
        let none = hand.frame(&scene, 0.01, 0, 0.0).unwrap();
        assert_eq!((none.peak_MPa(), none.resultant_N), (0.0, Some([0.0; 3])));
        hand.set(Some(Finger { centre_mm: [1.0, -2.0], force_N: [0.5, 0.0, 2.0] }));
        let [one, same, other] = [1, 1, 2].map(|seed| hand.frame(&scene, 0.01, seed, 0.0).unwrap());
        assert_eq!(one.resultant_N, Some([0.5, 0.0, 2.0]));
        assert_eq!(one.stress_MPa, same.stress_MPa);
        assert_ne!(one.stress_MPa, other.stress_MPa);
    }

    #[test]
    fn a_press_plays_on_the_array_until_the_mouse_takes_over() {
        for name in Scene::builtin_names() {
            let scene = Scene::builtin(name).unwrap();
            let hand = Hand::default();
            let played: Vec<Finger> = (0..80).map(|t| hand.now(&scene, f64::from(t) / 10.0).unwrap()).collect();
            for finger in &played {
                // What the page may send, and below friction.
                let body = serde_json::json!({"centre_mm": finger.centre_mm, "force_N": finger.force_N}).to_string();
                assert_eq!(Finger::read(body.as_bytes(), &scene), Ok(Some(*finger)), "{name}");
                let [x, y, normal] = finger.force_N;
                assert!(x.hypot(y) > 0.2 * normal && x.hypot(y) < 0.5 * normal, "{name}: {finger:?}");
            }
            assert!(played.windows(2).all(|pair| pair[0].centre_mm != pair[1].centre_mm), "{name}");
            hand.set(None);
            assert_eq!(hand.now(&scene, 1.0), None);
        }
    }
}
