//! Random: seeded random contacts, for statistics over many frames.
//!
//! | drawn | range |
//! |---|---|
//! | first half-axis | s … 2 s, s = h, but the larger pitch where it exceeds 2 h: taxels miss smaller ones; less on a small array |
//! | second half-axis | 0.7 … 1.35 of the first |
//! | angle | 0 … 180° |
//! | normal load | 1 … 12 N |
//! | shear over load | 0.1 … 0.45, any direction |
//! | position | the rim at least s/2 inside the array, if possible, and 2 h from other contacts |
//!
//! | spread of the shear | `slip`; `other` shapes in full slip: Hertz circles at 0.5 … 0.91 of the friction limit |
//!
//! Contacts that touch: their circumscribed circles touch.
//!
//! Sizes, loads and shear ratios have the distribution of the shipped frames `S?-hs-random-*` and `S3-hs-multi-*`.

use super::slip::Slip;
use super::GeneratorError;
use crate::data::frame::Contact;
use crate::random::Random;
use crate::spec::sensor::Sensor;
use std::f64::consts::TAU;

/// Draws of a position; the required gap shrinks with each.
const TRIES: usize = 200;
/// Pitch in units of the thickness above which contacts of the size of the thickness fall between taxels.
const COARSE: f64 = 2.0;
/// Longest half-axis in units of s: 2 · 1.35.
const LONGEST: f64 = 2.7;
/// Gap between two rims in units of the thickness.
const GAP: f64 = 2.0;
/// Distance of a rim from the array's edge in units of s.
const INSIDE: f64 = 0.5;

/// The shapes that are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shapes {
    /// Ellipses in full sliding with Hertz's or a uniform pressure.
    #[default]
    Elliptic,
    /// Rings, rectangles and uniform discs in full sliding, Hertz circles in partial slip.
    Other,
}

/// Parameters of a random draw; equal parameters give equal contacts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Draw {
    /// Number of contacts.
    pub count: usize,
    /// The shapes of the contacts.
    pub shapes: Shapes,
    /// How the shear is spread over a contact.
    pub slip: Slip,
    /// Whether every contact but the first touches another one.
    pub touching: bool,
    /// Seed of the random numbers.
    pub seed: u64,
}

/// Largest number of random contacts.
pub const MOST_RANDOM: usize = 1000;

impl Draw {
    /// Checks the number of contacts.
    ///
    /// # Errors
    /// [`GeneratorError::Option`] above [`MOST_RANDOM`].
    pub fn check(&self) -> Result<(), GeneratorError> {
        if self.count > MOST_RANDOM {
            let allowed = "a whole number from 0 to 1000";
            return Err(GeneratorError::Option { field: "random", value: self.count as f64, allowed });
        }
        Ok(())
    }
}

/// Draws random contacts for an array.
pub fn random_contacts(sensor: &Sensor, draw: Draw) -> Vec<Contact> {
    let mut random = Random::new(draw.seed);
    let shaped = |random: &mut Random, _: usize, axes| shaped(random, draw.shapes, axes);
    let (contacts, _) = placed(sensor, &mut random, draw.count, draw.touching, shaped);
    let mut of_slip = Random::new(!draw.seed);
    contacts.into_iter().map(|contact| draw.slip.of(contact, &mut of_slip)).collect()
}

/// Draws size and place of `count` contacts; `shaped` makes contact k of its half-axes. Also returns whether all places are within
/// the array and apart from each other: there may be no room.
pub(super) fn placed(
    sensor: &Sensor,
    random: &mut Random,
    count: usize,
    touching: bool,
    shaped: impl Fn(&mut Random, usize, [f64; 2]) -> Contact,
) -> (Vec<Contact>, bool) {
    let mut contacts: Vec<(Contact, [f64; 2], f64)> = Vec::with_capacity(count);
    let mut fits = true;
    let half = sensor.half_mm();
    let (h, pitch_mm) = (sensor.thickness_mm, sensor.pitch_x_mm.max(sensor.pitch_y_mm));
    let size_mm = if pitch_mm > COARSE * h { pitch_mm } else { h };
    // On a small array the contacts are smaller.
    let unit = size_mm.min(half[0].min(half[1]) / (LONGEST + INSIDE));
    for index in 0..count {
        let first = random.between(unit, 2.0 * unit);
        let axes = [first, first * random.between(0.7, 1.35)];
        let reach = axes[0].max(axes[1]);
        let room = half.map(|half| (half - reach - INSIDE * unit).max(0.0));
        let mut gap = if touching { 0.0 } else { GAP * h };
        let (mut centre, mut found) = ([0.0; 2], false);
        for _ in 0..TRIES {
            centre = match random.pick(&contacts).filter(|_| touching) {
                Some((_, [x, y], far)) => {
                    let towards = random.between(0.0, TAU);
                    // A margin, so that rounding does not cause an overlap.
                    let off = (far + reach) * (1.0 + 1e-12);
                    [x + off * towards.cos(), y + off * towards.sin()]
                }
                None => room.map(|room| random.between(-room, room)),
            };
            let apart = |(_, other, far): &(Contact, [f64; 2], f64)| {
                (centre[0] - other[0]).hypot(centre[1] - other[1]) >= far + reach + gap
            };
            found = contacts.iter().all(apart) && centre[0].abs() <= room[0] && centre[1].abs() <= room[1];
            if found {
                break;
            }
            gap *= 0.98;
        }
        fits &= found;
        let contact = Contact { centre_mm: Some(centre), ..shaped(random, index, axes) };
        contacts.push((contact, centre, reach));
    }
    (contacts.into_iter().map(|(contact, _, _)| contact).collect(), fits)
}

/// A contact of the given half-axes with random shape, load and slip, without position.
fn shaped(random: &mut Random, shapes: Shapes, [a, b]: [f64; 2]) -> Contact {
    let normal = random.between(1.0, 12.0);
    let (ratio, towards, angle) = (random.between(0.1, 0.45), random.between(0.0, TAU), random.between(0.0, 180.0));
    let long = a.max(b);
    let (shape, size_mm, slip) = match shapes {
        Shapes::Elliptic if random.coin() => ("hertz-ellipse", vec![a, b, angle], "full-sliding"),
        Shapes::Elliptic => ("flat-punch", vec![a, b, angle], "full-sliding"),
        Shapes::Other => match (random.coin(), random.coin()) {
            (false, false) => ("ring", vec![long, random.between(0.3, 0.7) * long], "full-sliding"),
            // The corners reach as far as the ellipse.
            (false, true) => ("rectangle", vec![1.41 * a, 1.41 * b, angle], "full-sliding"),
            (true, false) => ("flat-punch", vec![long], "full-sliding"),
            (true, true) => ("hertz-circle", vec![long], "partial-slip"),
        },
    };
    Contact {
        shape: Some(shape.to_string()),
        size_mm,
        normal_N: Some(normal),
        tangential_N: Some([normal * ratio * towards.cos(), normal * ratio * towards.sin()]),
        kind_of_slip: Some(slip.to_string()),
        friction: (slip == "partial-slip").then(|| ratio * random.between(1.1, 2.0)),
        ..Default::default()
    }
}
