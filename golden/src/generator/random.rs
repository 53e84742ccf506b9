//! Random: contacts drawn from a seed, for statistics over many frames.
//!
//! Ellipses, Hertz or uniform, full sliding, the friction ratio 0.1 … 0.5 in any direction, wholly inside the array and
//! apart from each other by at least twice the thickness where the array has room for that.

use crate::frame::Contact;
use crate::random::Random;
use crate::sensor::Sensor;
use std::f64::consts::TAU;

/// Draws of a place before contacts may lie closer.
const TRIES: usize = 200;
/// Half-axes in thicknesses.
const HALF_AXES: [f64; 2] = [0.8, 2.2];

/// Draws `count` contacts; the same seed gives the same contacts.
pub fn random_contacts(sensor: &Sensor, count: usize, seed: u64) -> Vec<Contact> {
    let mut random = Random::new(seed);
    let mut contacts: Vec<(Contact, [f64; 2], f64)> = Vec::with_capacity(count);
    let size = [sensor.cols as f64 * sensor.pitch_x_mm / 2.0, sensor.rows as f64 * sensor.pitch_y_mm / 2.0];
    let largest = HALF_AXES[1] * sensor.thickness_mm.min(size[0].min(size[1]) / 4.0);
    for _ in 0..count {
        let axes = [0; 2].map(|_| random.between(HALF_AXES[0] / HALF_AXES[1] * largest, largest));
        let reach = axes[0].max(axes[1]);
        let mut gap = 2.0 * sensor.thickness_mm;
        let mut centre = [0.0; 2];
        for _ in 0..TRIES {
            centre = size.map(|half| random.between(reach - half, half - reach));
            let apart = |(_, other, far): &(Contact, [f64; 2], f64)| {
                (centre[0] - other[0]).hypot(centre[1] - other[1]) >= far + reach + gap
            };
            if contacts.iter().all(apart) {
                break;
            }
            gap *= 0.98;
        }
        let normal = random.between(2.0, 10.0);
        let (ratio, towards) = (random.between(0.1, 0.5), random.between(0.0, TAU));
        let shape = if random.coin() { "hertz-ellipse" } else { "flat-punch" };
        let contact = Contact {
            shape: Some(shape.to_string()),
            centre_mm: Some(centre),
            size_mm: vec![axes[0], axes[1], random.between(0.0, 180.0)],
            normal_N: Some(normal),
            tangential_N: Some([normal * ratio * towards.cos(), normal * ratio * towards.sin()]),
            kind_of_slip: Some("full-sliding".to_string()),
            ..Default::default()
        };
        contacts.push((contact, centre, reach));
    }
    contacts.into_iter().map(|(contact, _, _)| contact).collect()
}
