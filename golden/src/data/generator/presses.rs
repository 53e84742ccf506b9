//! Presses: streams of frames of one contact that holds, grows, moves or changes at once, for figures over time.
//!
//! ```text
//! drawn contact ── motion at moment k ── exact stress ── + noise σ = share of the stream's peak ── frame k
//! ```
//!
//! | motion | from the first to the last moment |
//! |---|---|
//! | hold | nothing changes |
//! | ramp | load from 0.3 to all of it, sizes with its third root |
//! | slide | centre by [`STEP_MM`] a moment towards the middle of the array, shear along it |
//! | roll | centre by half of that, shear from one side to the other |
//! | turn | direction of the shear by 360° |
//! | jump | half-way another contact takes the place of the first |
//! | second | half-way a second contact comes beside the first |
//! | release | load from all of it to 1 % |
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: number of the press, motion, moments, noise | – | share of the peak |
//! | out: frames with their true forces | moments | MPa, N |

use super::draws::{DrawOptions, Draws};
use super::{generate, GeneratorError};
use crate::data::frame::{Contact, Frame};
use crate::random::Random;
use crate::spec::scene::Scene;
use std::f64::consts::TAU;

/// Way of a sliding contact from one moment to the next in mm: 50 mm/s at 1000 frames per second.
pub const STEP_MM: f64 = 0.05;
/// First load of a ramp, last load of a release, over the largest.
const LOADS: [f64; 2] = [0.3, 0.01];

/// What a contact does during a press.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Nothing changes.
    Hold,
    /// The load grows.
    Ramp,
    /// The contact moves.
    Slide,
    /// The contact moves and its shear turns to the other side.
    Roll,
    /// The shear turns.
    Turn,
    /// Another contact takes its place.
    Jump,
    /// A second contact comes.
    Second,
    /// The load fades.
    Release,
}

impl Motion {
    /// Every motion.
    pub const ALL: [Motion; 8] = [
        Motion::Hold,
        Motion::Ramp,
        Motion::Slide,
        Motion::Roll,
        Motion::Turn,
        Motion::Jump,
        Motion::Second,
        Motion::Release,
    ];

    /// The contacts at `share` of the way, 0 to 1, of which `all` are drawn; the way is `length_mm`.
    fn contacts(self, all: &[Contact], share: f64, length_mm: f64) -> Vec<Contact> {
        let mut first = all[0].clone();
        let middle = first.centre_mm.unwrap_or_default();
        let away = middle[0].hypot(middle[1]).max(f64::MIN_POSITIVE);
        let towards = middle.map(|at| -at / away);
        let load = first.normal_N.unwrap_or_default();
        let shear = first.tangential_N.unwrap_or_default();
        let size = shear[0].hypot(shear[1]);
        let loaded = |contact: &mut Contact, factor: f64| {
            contact.normal_N = Some(factor * load);
            contact.tangential_N = Some(shear.map(|t| factor * t));
        };
        let moved = |by: f64| Some([0, 1].map(|axis| middle[axis] + by * towards[axis]));
        match self {
            Motion::Hold => (),
            Motion::Ramp => {
                let factor = LOADS[0] + (1.0 - LOADS[0]) * share;
                loaded(&mut first, factor);
                // Half-axes or sides; what follows are angle and tilt, for a ring its inner radius.
                let lengths = if first.shape.as_deref() == Some("ring") || first.size_mm.len() > 1 { 2 } else { 1 };
                first.size_mm[..lengths].iter_mut().for_each(|length| *length *= factor.cbrt());
            }
            Motion::Slide => {
                first.centre_mm = moved(share * length_mm);
                first.tangential_N = Some(towards.map(|along| size * along));
            }
            Motion::Roll => {
                first.centre_mm = moved(0.5 * share * length_mm);
                first.tangential_N = Some(shear.map(|t| (1.0 - 2.0 * share) * t));
            }
            Motion::Turn => {
                let (sin, cos) = (TAU * share).sin_cos();
                first.tangential_N = Some([cos * shear[0] - sin * shear[1], sin * shear[0] + cos * shear[1]]);
            }
            Motion::Jump if share >= 0.5 => return vec![all[1].clone()],
            Motion::Second if share >= 0.5 => return all.to_vec(),
            Motion::Jump | Motion::Second => (),
            Motion::Release => loaded(&mut first, 1.0 - (1.0 - LOADS[1]) * share),
        }
        vec![first]
    }
}

/// The frames of a press with `motion` of `moments` moments, at least two; `noise` is a share of the largest |b| of all. Equal
/// options and numbers give equal presses.
///
/// ```
/// use dermis_golden::{data::generator::presses::{press, Motion}, spec::scene::Scene};
///
/// let frames = press(&Scene::builtin("sensor-1")?, 3, Motion::Ramp, 5, 0.001)?;
/// let normal: Vec<f64> = frames.iter().filter_map(|frame| Some(frame.resultant_N?[2])).collect();
/// assert!((normal[0] / normal[4] - 0.3).abs() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`Draws::contacts`] for two contacts; [`GeneratorError`] of the generator.
pub fn press(
    scene: &Scene,
    number: u64,
    motion: Motion,
    moments: usize,
    noise: f64,
) -> Result<Vec<Frame>, GeneratorError> {
    let all = Draws::new(scene, DrawOptions { contacts: 2, ..DrawOptions::default() })?.contacts(number)?;
    let steps = moments.saturating_sub(1).max(1) as f64;
    let at = |moment: usize| {
        let contacts = motion.contacts(&all, moment as f64 / steps, STEP_MM * steps);
        generate(&format!("press-{number}-{moment}"), &scene.sensor, scene.medium, &contacts)
    };
    let mut frames = (0..moments).map(at).collect::<Result<Vec<Frame>, _>>()?;
    let peak_MPa = frames.iter().map(Frame::peak_MPa).fold(0.0, f64::max);
    let mut random = Random::new(number ^ 1 << 40);
    let readings = frames.iter_mut().flat_map(|frame| &mut frame.stress_MPa);
    readings.for_each(|b| *b += noise * peak_MPa * random.normal());
    Ok(frames)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What changes over a press, and what does not.
    #[test]
    fn motions_change_what_they_say() {
        let scene = Scene::builtin("sensor-3").unwrap();
        for motion in Motion::ALL {
            let frames = press(&scene, 2, motion, 4, 0.0).unwrap();
            let force = |k: usize| frames[k].resultant_N.unwrap();
            let [first, last] = [force(0), force(3)];
            let share = last[2] / first[2];
            let centre = |k: usize| frames[k].contacts[0].centre_mm.unwrap();
            let way = (centre(3)[0] - centre(0)[0]).hypot(centre(3)[1] - centre(0)[1]);
            match motion {
                Motion::Hold => assert_eq!(frames[0].stress_MPa, frames[3].stress_MPa),
                Motion::Ramp => assert!((share - 1.0 / 0.3).abs() < 1e-9),
                Motion::Slide => assert!((way - 0.15).abs() < 1e-9),
                Motion::Roll => assert!((first[0] + last[0]).abs() < 1e-9 && (way - 0.075).abs() < 1e-9),
                Motion::Turn => {
                    assert!((0..2).all(|axis| (first[axis] - last[axis]).abs() < 1e-9) && first != force(1))
                }
                Motion::Jump => assert!(way > 1.0 && frames[1].contacts == frames[0].contacts),
                Motion::Second => assert_eq!([0, 1, 2, 3].map(|k| frames[k].contacts.len()), [1, 1, 2, 2]),
                Motion::Release => assert!((share - 0.01).abs() < 1e-9),
            }
        }
    }
}
