//! Random: contacts drawn from a seed, for statistics over many frames.
//!
//! | drawn | range |
//! |---|---|
//! | first half-axis | h … 2 h, less where the array is small |
//! | second half-axis | 0.7 … 1.35 of the first |
//! | angle | 0 … 180° |
//! | normal load | 1 … 12 N |
//! | shear over load | 0.1 … 0.45, any direction |
//! | place | the rim at least h/2 inside the array, as far as it has room, and 2 h from other contacts |
//!
//! Of touching contacts the circles around two of them touch.
//!
//! Sizes, loads and friction ratios are spread as in the shipped frames `S?-hs-random-*` and `S3-hs-multi-*`.

use crate::frame::Contact;
use crate::random::Random;
use crate::sensor::Sensor;
use std::f64::consts::TAU;

/// Draws of a place before contacts may lie closer.
const TRIES: usize = 200;
/// Longest half-axis in thicknesses: 2 · 1.35.
const LONGEST: f64 = 2.7;
/// Distance of two rims in thicknesses.
const GAP: f64 = 2.0;
/// Distance of a rim from the array's edge, in thicknesses.
const INSIDE: f64 = 0.5;

/// Which shapes are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shapes {
    /// Ellipses in full sliding, Hertz's pressure or a uniform one.
    #[default]
    Elliptic,
    /// Rings, rectangles, uniform discs and Hertz circles in partial slip.
    Other,
}

/// What is drawn; the same draw gives the same contacts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Draw {
    /// Number of contacts.
    pub count: usize,
    /// Their shapes.
    pub shapes: Shapes,
    /// Whether every contact but the first touches another one.
    pub touching: bool,
    /// Start of the random numbers.
    pub seed: u64,
}

/// Draws contacts for an array.
pub fn random_contacts(sensor: &Sensor, draw: Draw) -> Vec<Contact> {
    let mut random = Random::new(draw.seed);
    let mut contacts: Vec<(Contact, [f64; 2], f64)> = Vec::with_capacity(draw.count);
    let half = [sensor.cols as f64 * sensor.pitch_x_mm / 2.0, sensor.rows as f64 * sensor.pitch_y_mm / 2.0];
    let h = sensor.thickness_mm;
    // On a small array the contacts shrink with it.
    let unit = h.min(half[0].min(half[1]) / (LONGEST + INSIDE));
    for _ in 0..draw.count {
        let first = random.between(unit, 2.0 * unit);
        let axes = [first, first * random.between(0.7, 1.35)];
        let reach = axes[0].max(axes[1]);
        let room = half.map(|half| (half - reach - INSIDE * unit).max(0.0));
        let mut gap = if draw.touching { 0.0 } else { GAP * h };
        let mut centre = [0.0; 2];
        for _ in 0..TRIES {
            centre = match random.pick(&contacts).filter(|_| draw.touching) {
                Some((_, [x, y], far)) => {
                    let towards = random.between(0.0, TAU);
                    // Rounding must not take it for an overlap.
                    let off = (far + reach) * (1.0 + 1e-12);
                    [x + off * towards.cos(), y + off * towards.sin()]
                }
                None => room.map(|room| random.between(-room, room)),
            };
            let apart = |(_, other, far): &(Contact, [f64; 2], f64)| {
                (centre[0] - other[0]).hypot(centre[1] - other[1]) >= far + reach + gap
            };
            if contacts.iter().all(apart) && centre[0].abs() <= room[0] && centre[1].abs() <= room[1] {
                break;
            }
            gap *= 0.98;
        }
        let contact = Contact { centre_mm: Some(centre), ..shaped(&mut random, draw.shapes, axes) };
        contacts.push((contact, centre, reach));
    }
    contacts.into_iter().map(|(contact, _, _)| contact).collect()
}

/// A contact of the drawn half-axes, with shape, load and slip but no place.
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
