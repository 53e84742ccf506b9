//! Presses: streams of frames of one contact that holds, grows, moves or changes at once, for figures over time.
//!
//! ```text
//! drawn contact ── motion at time t ── exact stress ── sensor: gains, drift, noise, codes ── frame at time t
//! ```
//!
//! | motion | from the first to the last frame |
//! |---|---|
//! | hold | nothing changes |
//! | ramp | load from a sixth to all of it, sizes with its third root, shear over load from an eighth to all of it |
//! | slide | centre by [`Press::speed_mm_s`] through the middle of the array, shear along it; before that it holds where the way is shorter |
//! | roll | centre likewise by a quarter of the speed, pressure tilted from one end of the way to the other, the shape turns by 60° |
//! | turn | direction of the shear by 180° in 0.4 s |
//! | step | half-way the shear turns to the other side, with half its size |
//! | oscillation | shear between none and all of it, four times a second |
//! | jump | half-way another contact takes the place of the first |
//! | second | half-way a second contact comes beside the first |
//! | release | load from all of it to 1 % |
//!
//! Gains are those of the whole press, zeros drift evenly from none at its first frame, noise is drawn for every frame. Their sizes
//! are shares as [`Converter`] has them, of the largest |b| of the press.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: number of the press, motion, frames, rate, speed | – | –, –, –, Hz, mm/s |
//! | out: frames with their true forces | frames | MPa, N |

use super::converter::Converter;
use super::draws::{DrawOptions, Draws, SPREAD};
use super::{generate, GeneratorError};
use crate::data::frame::{Contact, Frame};
use crate::random::Random;
use crate::spec::scene::Scene;
use crate::spec::sensor::Sensor;
use std::f64::consts::{PI, TAU};
use std::ops::Range;

/// First load of a ramp, last load of a release, over the largest.
const LOADS: [f64; 2] = [1.0 / 6.0, 0.01];
/// First shear over load of a ramp, over the last one.
const FIRST_RATIO: f64 = 1.0 / 8.0;
/// Speed of a roll over that of a slide.
const ROLL_SPEED: f64 = 0.25;
/// Largest tilt of a roll's pressure: p0 (1 ± tilt) at the ends of a diameter.
const TILT: f64 = 0.6;
/// By how much the shape of a roll turns, in degrees.
const ROLL_ANGLE: f64 = 60.0;
/// Time in which the shear of a turn changes to its opposite.
const HALF_TURN_S: f64 = 0.4;
/// Oscillations per second.
const OSCILLATION_HZ: f64 = 4.0;
/// Shear after a step over that before it.
const STEP: f64 = -0.5;
/// Full scale of a converter over the largest |b| of the press: the noise is not clipped.
const FULL_SCALE: f64 = 1.3;
/// Largest number of frames.
const MOST_FRAMES: usize = 1_000_000;

/// What a contact does during a press.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Motion {
    /// Nothing changes.
    Hold,
    /// The load grows.
    Ramp,
    /// The contact moves.
    Slide,
    /// The contact moves slowly, and its pressure tilts and turns.
    Roll,
    /// The shear turns.
    Turn,
    /// The shear changes at once.
    Step,
    /// The shear comes and goes.
    Oscillation,
    /// Another contact takes its place.
    Jump,
    /// A second contact comes.
    Second,
    /// The load fades.
    Release,
}

/// Where and when a contact is.
struct Moment<'a> {
    sensor: &'a Sensor,
    /// Seconds since the first frame, and from the first to the last one.
    time_s: f64,
    duration_s: f64,
    speed_mm_s: f64,
}

impl Moment<'_> {
    /// Share of the way from the first to the last frame, 0 to 1.
    fn share(&self) -> f64 {
        self.time_s / self.duration_s
    }

    /// Unit vector from the centre of `contact` through the middle of the array, and how far along it that is at `speed_mm_s`. It
    /// arrives on the other side with the last frame, as far from the border as its size, or as it began where that is less.
    fn way_mm(&self, contact: &Contact, speed_mm_s: f64) -> ([f64; 2], f64) {
        let centre_mm = contact.centre_mm.unwrap_or_default();
        let size_mm = contact.size_mm.iter().take(2).copied().fold(0.0, f64::max);
        let away = centre_mm[0].hypot(centre_mm[1]);
        let towards = if away > 0.0 { centre_mm.map(|at| -at / away) } else { [1.0, 0.0] };
        let margins = std::iter::zip(self.sensor.half_mm(), centre_mm).map(|(half, at)| half - at.abs());
        let margin = margins.fold(size_mm, f64::min);
        let until = |axis: usize| {
            let end = (self.sensor.half_mm()[axis] - margin) * towards[axis].signum();
            if towards[axis] == 0.0 {
                f64::INFINITY
            } else {
                (end - centre_mm[axis]) / towards[axis]
            }
        };
        let longest = until(0).min(until(1)).max(0.0);
        let moving_s = (longest / speed_mm_s).min(self.duration_s);
        (towards, speed_mm_s * (self.time_s - (self.duration_s - moving_s)).max(0.0))
    }
}

impl Motion {
    /// Every motion with its name in options and tables.
    pub const NAMES: [(&'static str, Motion); 10] = [
        ("hold", Motion::Hold),
        ("ramp", Motion::Ramp),
        ("slide", Motion::Slide),
        ("roll", Motion::Roll),
        ("turn", Motion::Turn),
        ("step", Motion::Step),
        ("oscillation", Motion::Oscillation),
        ("jump", Motion::Jump),
        ("second", Motion::Second),
        ("release", Motion::Release),
    ];

    /// The motions of one contact that lasts, in the tables of errors over time.
    pub const LASTING: [Motion; 7] =
        [Motion::Hold, Motion::Ramp, Motion::Slide, Motion::Roll, Motion::Turn, Motion::Step, Motion::Oscillation];

    /// The name in options and tables.
    pub fn name(self) -> &'static str {
        Motion::NAMES.iter().find(|(_, motion)| *motion == self).map_or("", |(name, _)| *name)
    }

    /// The contacts at a moment, of which `all` are drawn.
    fn contacts(self, all: &[Contact], moment: &Moment) -> Vec<Contact> {
        let mut first = all[0].clone();
        let centre = first.centre_mm.unwrap_or_default();
        let load = first.normal_N.unwrap_or_default();
        let shear = first.tangential_N.unwrap_or_default();
        let size = shear[0].hypot(shear[1]);
        let share = moment.share();
        let moved = |(towards, by): ([f64; 2], f64)| Some([0, 1].map(|axis| centre[axis] + by * towards[axis]));
        let turned = |angle: f64| {
            let (sin, cos) = angle.sin_cos();
            [cos * shear[0] - sin * shear[1], sin * shear[0] + cos * shear[1]]
        };
        let scaled = |factor: f64| Some(shear.map(|t| factor * t));
        match self {
            Motion::Hold => (),
            Motion::Ramp => {
                let factor = LOADS[0] + (1.0 - LOADS[0]) * share;
                first.normal_N = Some(factor * load);
                first.tangential_N = scaled(factor * (FIRST_RATIO + (1.0 - FIRST_RATIO) * share));
                // Half-axes or sides; what follows are angle and tilt, for a ring its inner radius.
                let lengths = if first.shape.as_deref() == Some("ring") || first.size_mm.len() > 1 { 2 } else { 1 };
                first.size_mm[..lengths].iter_mut().for_each(|length| *length *= factor.cbrt());
            }
            Motion::Slide => {
                let way = moment.way_mm(&first, moment.speed_mm_s);
                first.centre_mm = moved(way);
                first.tangential_N = Some(way.0.map(|along| size * along));
            }
            Motion::Roll => {
                let way = moment.way_mm(&first, ROLL_SPEED * moment.speed_mm_s);
                first.centre_mm = moved(way);
                let [long, short] = [0, 1].map(|k| *first.size_mm.get(k).unwrap_or(&first.size_mm[0]));
                let tilt = TILT * (2.0 * share - 1.0);
                first.shape = Some("tilted".to_string());
                first.size_mm = vec![long, short, ROLL_ANGLE * share, tilt, 0.0];
            }
            Motion::Turn => first.tangential_N = Some(turned(PI * moment.time_s / HALF_TURN_S)),
            Motion::Step if share >= 0.5 => first.tangential_N = scaled(STEP),
            Motion::Oscillation => {
                first.tangential_N = scaled(0.5 + 0.5 * (TAU * OSCILLATION_HZ * moment.time_s).sin());
            }
            Motion::Jump if share >= 0.5 => return vec![all[1].clone()],
            Motion::Second if share >= 0.5 => return all.to_vec(),
            Motion::Step | Motion::Jump | Motion::Second => (),
            Motion::Release => {
                let factor = 1.0 - (1.0 - LOADS[1]) * share;
                (first.normal_N, first.tangential_N) = (Some(factor * load), scaled(factor));
            }
        }
        vec![first]
    }
}

/// A press, and how it is read.
#[derive(Clone, Debug, PartialEq)]
pub struct Press {
    /// What the contact does.
    pub motion: Motion,
    /// Number of frames, at least two.
    pub frames: usize,
    /// Frames per second.
    pub rate_Hz: f64,
    /// Speed of a slide in mm/s.
    pub speed_mm_s: f64,
    /// What is drawn: shapes, load and shear of the contact, the sensor that reads it, the seed. Its converter averages nothing, and
    /// takes 1.3 times the largest |b| of the press for a full scale that is not stated.
    pub draw: DrawOptions,
}

impl Press {
    /// 0.8 s at 1000 frames per second, 20 mm/s, of an exact sensor.
    pub fn new(motion: Motion) -> Press {
        Press { motion, frames: 800, rate_Hz: 1000.0, speed_mm_s: 20.0, draw: DrawOptions::default() }
    }

    /// The same with so many frames, each with this noise, a share of the largest |b| of the press.
    pub fn of_frames(self, frames: usize, noise: f64) -> Press {
        Press { frames, ..self }.with_noise(noise)
    }

    /// The same with this noise, a share of the largest |b| of the press.
    pub fn with_noise(self, noise: f64) -> Press {
        let converter = Converter { noise, ..self.draw.converter };
        Press { draw: DrawOptions { converter, ..self.draw }, ..self }
    }

    /// The frames of press number `number`, in their order. Equal options and numbers give equal presses.
    ///
    /// ```
    /// use dermis_golden::{data::generator::presses::{Motion, Press}, spec::scene::Scene};
    ///
    /// let frames = Press::new(Motion::Ramp).of_frames(5, 0.001).frames(&Scene::builtin("sensor-1")?, 3)?;
    /// let normal: Vec<f64> = frames.iter().filter_map(|frame| Some(frame.resultant_N?[2])).collect();
    /// assert!((normal[0] / normal[4] - 1.0 / 6.0).abs() < 1e-9);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Press::exact`] and [`Press::read`].
    pub fn frames(&self, scene: &Scene, number: u64) -> Result<Vec<Frame>, GeneratorError> {
        self.read(self.exact(scene, number)?, number)
    }

    /// The same without the sensor.
    ///
    /// # Errors
    /// As [`Draws::contacts`] for two contacts, and as [`generate`]; [`GeneratorError::Option`] for a number of
    /// frames below two, a rate or speed that is not positive.
    pub fn exact(&self, scene: &Scene, number: u64) -> Result<Vec<Frame>, GeneratorError> {
        self.exact_part(scene, number, 0..self.frames)
    }

    /// Of the exact frames those in `part`.
    ///
    /// # Errors
    /// As [`Press::exact`].
    pub fn exact_part(&self, scene: &Scene, number: u64, part: Range<usize>) -> Result<Vec<Frame>, GeneratorError> {
        self.check()?;
        // Two for every motion, so that the first is the same in all.
        let all = Draws::new(scene, DrawOptions { contacts: 2, ..self.draw.clone() })?.contacts(number)?;
        let duration_s = (self.frames - 1) as f64 / self.rate_Hz;
        let mut frames: Vec<Frame> = Vec::with_capacity(part.len());
        for frame in part {
            let time_s = frame as f64 / self.rate_Hz;
            let moment = Moment { sensor: &scene.sensor, time_s, duration_s, speed_mm_s: self.speed_mm_s };
            let (id, contacts) = (format!("press-{number}-{frame}"), self.motion.contacts(&all, &moment));
            frames.push(match frames.last().filter(|last| last.contacts == contacts) {
                Some(same) => Frame { id, ..same.clone() },
                None => generate(&id, &scene.sensor, scene.medium, &contacts)?,
            });
        }
        Ok(frames)
    }

    /// What the sensor reads of the [exact](Press::exact) frames of press number `number`.
    ///
    /// # Errors
    /// As [`Converter::convert`].
    pub fn read(&self, mut exact: Vec<Frame>, number: u64) -> Result<Vec<Frame>, GeneratorError> {
        let seed = self.draw.converter.seed.wrapping_add(self.draw.seed).wrapping_mul(SPREAD) ^ number << 32;
        self.draw.converter.convert_in_order(&mut exact, FULL_SCALE, &mut Random::new(seed))?;
        Ok(exact)
    }

    fn check(&self) -> Result<(), GeneratorError> {
        let fail = |field, value, allowed| Err(GeneratorError::Option { field, value, allowed });
        if !(2..=MOST_FRAMES).contains(&self.frames) {
            return fail("frames", self.frames as f64, "a whole number from 2 to 1000000");
        }
        let positive = |value: f64| value > 0.0 && value.is_finite();
        match [("rate", self.rate_Hz), ("speed", self.speed_mm_s)].into_iter().find(|(_, value)| !positive(*value)) {
            Some((field, value)) => fail(field, value, "a number above 0"),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What changes over a press, and what does not.
    #[test]
    fn motions_change_what_they_say() {
        let scene = Scene::builtin("sensor-3").unwrap();
        for (_, motion) in Motion::NAMES {
            // 0, 0.1 and 0.2 s.
            let press = Press { frames: 3, rate_Hz: 10.0, ..Press::new(motion) };
            let frames = press.frames(&scene, 2).unwrap();
            let [first, middle, last] = [0, 1, 2].map(|k| frames[k].resultant_N.unwrap());
            let share = last[2] / first[2];
            let angle = |of: [f64; 3]| of[1].atan2(of[0]);
            let size = |of: [f64; 3]| of[0].hypot(of[1]);
            let centre = |k: usize| frames[k].contacts[0].centre_mm.unwrap();
            let way = (centre(2)[0] - centre(0)[0]).hypot(centre(2)[1] - centre(0)[1]);
            match motion {
                Motion::Hold => assert_eq!(frames[0].stress_MPa, frames[2].stress_MPa),
                Motion::Ramp => {
                    assert!((share - 6.0).abs() < 1e-9 && (size(last) / size(first) - 48.0).abs() < 1e-6)
                }
                Motion::Slide => assert!((way - 4.0).abs() < 1e-9),
                Motion::Roll => assert!((way - 1.0).abs() < 1e-9 && size(last) == size(first)),
                Motion::Turn => {
                    let turned = (angle(last) - angle(first)).rem_euclid(TAU);
                    assert!((turned - PI / 2.0).abs() < 1e-9 && (size(last) / size(first) - 1.0).abs() < 1e-9)
                }
                Motion::Step => assert!((last[0] / first[0] + 0.5).abs() < 1e-9 && middle == last),
                Motion::Oscillation => assert!(size(middle) > size(first) && size(last) < size(first)),
                Motion::Jump => assert!(way > 1.0 && frames[1].contacts == frames[2].contacts),
                Motion::Second => assert_eq!([0, 1, 2].map(|k| frames[k].contacts.len()), [1, 2, 2]),
                Motion::Release => assert!((share - 0.01).abs() < 1e-9),
            }
        }
    }

    /// A contact that would leave the array within the time holds first, and arrives with the last frame.
    #[test]
    fn slides_stay_on_the_array() {
        let scene = Scene::builtin("sensor-1").unwrap();
        for number in 0..20 {
            let press = Press { frames: 9, rate_Hz: 10.0, speed_mm_s: 60.0, ..Press::new(Motion::Slide) };
            let frames = press.frames(&scene, number).unwrap();
            let centre = |k: usize| frames[k].contacts[0].centre_mm.unwrap();
            let margin =
                |at: [f64; 2]| (scene.sensor.half_mm()[0] - at[0].abs()).min(scene.sensor.half_mm()[1] - at[1].abs());
            let size = frames[0].contacts[0].size_mm.iter().take(2).copied().fold(margin(centre(0)), f64::min);
            assert!((0..9).all(|k| margin(centre(k)) > size - 1e-9), "{number}");
            let step = (centre(8)[0] - centre(7)[0]).hypot(centre(8)[1] - centre(7)[1]);
            assert!(step > 0.1 && step < 6.0 + 1e-9 && centre(1) == centre(0), "{number}: {step}");
        }
    }

    /// Gains stay, drift grows, noise is that of each frame, all as shares of the press's peak.
    #[test]
    fn a_sensor_reads_a_press_with_the_same_gains() {
        let scene = Scene::builtin("sensor-1").unwrap();
        let exact = Press { frames: 40, ..Press::new(Motion::Release) };
        let read = |converter: Converter| {
            Press { draw: DrawOptions { converter, ..exact.draw.clone() }, ..exact.clone() }.frames(&scene, 4).unwrap()
        };
        let truth = exact.frames(&scene, 4).unwrap();
        let peak = truth.iter().map(Frame::peak_MPa).fold(0.0, f64::max);
        let off = |frames: &[Frame], k: usize| -> Vec<f64> {
            std::iter::zip(&frames[k].stress_MPa, &truth[k].stress_MPa).map(|(read, exact)| read - exact).collect()
        };
        let size = |off: &[f64]| (off.iter().map(|off| off * off).sum::<f64>() / off.len() as f64).sqrt();
        let noisy = read(Converter { noise: 0.01, ..Converter::default() });
        for k in [0, 39] {
            // 100 draws estimate a deviation to 1/√200 = 7 %; four times that.
            assert!((size(&off(&noisy, k)) / (0.01 * peak) - 1.0).abs() < 0.28);
        }
        let gains = read(Converter { gain_spread: 0.02, ..Converter::default() });
        let gain = |k: usize| off(&gains, k)[44] / truth[k].stress_MPa[44];
        assert!((gain(0) - gain(20)).abs() < 1e-9 && gain(0) != 0.0);
        let drift = read(Converter { drift: 0.02, ..Converter::default() });
        assert!(size(&off(&drift, 0)) == 0.0 && (size(&off(&drift, 39)) / (0.02 * peak) - 1.0).abs() < 0.28);
        let codes = read(Converter { bits: Some(8), ..Converter::default() });
        let step = 1.3 * peak / 127.0;
        assert!((0..40).all(|k| off(&codes, k).iter().all(|off| off.abs() <= 0.5001 * step)));
    }

    #[test]
    fn refusals_name_option_and_value() {
        let scene = Scene::builtin("sensor-1").unwrap();
        let refused = |press: Press| press.frames(&scene, 1).unwrap_err().to_string();
        let hold = Press::new(Motion::Hold);
        assert!(refused(Press { frames: 1, ..hold.clone() }).contains("frames = 1"));
        assert!(refused(Press { rate_Hz: 0.0, ..hold.clone() }).contains("rate = 0"));
        assert!(refused(Press { speed_mm_s: f64::NAN, ..hold.clone() }).contains("speed = NaN"));
        assert!(refused(hold.of_frames(2, -1.0)).contains("noise = -1"));
    }
}
