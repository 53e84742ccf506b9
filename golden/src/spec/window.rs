//! Window: the rectangle of taxels that a network reads, and where it lies on an array.
//!
//! An array of at most [`WHOLE_UP_TO`] taxels is one window. On a larger one, and wherever the network is evaluated for each
//! of several contacts, the window has a contact in its middle; it may reach beyond the array, where its readings are 0 and its
//! mask is 1.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: sensor, centre of a contact | – | mm |
//! | out: taxel of the array for each taxel of the window | window | index, or none |

use crate::spec::quads::Quads;
use crate::spec::sensor::Sensor;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Number of taxels up to which an array is one window.
pub const WHOLE_UP_TO: usize = 144;
/// Distance from the contact's centre to which a window around it reaches, in units of the thickness.
const REACH: f64 = 5.0;
/// Largest number of rows and of columns of a window around a contact.
const LARGEST: usize = 11;

/// Where a window lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Place {
    /// The window is the array, or as much larger on each side as on the opposite one.
    Array,
    /// The window has the contact's centre in its middle taxel.
    Contact,
}

/// A window.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Window {
    /// Where it lies.
    pub place: Place,
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub cols: usize,
}

impl Window {
    /// The window for an array with one contact.
    pub fn of(sensor: &Sensor) -> Window {
        if sensor.taxels() <= WHOLE_UP_TO {
            return Window { place: Place::Array, rows: sensor.rows, cols: sensor.cols };
        }
        Window::around_contact(sensor)
    }

    /// The window around a contact of an array with several.
    pub fn around_contact(sensor: &Sensor) -> Window {
        let lines = |pitch: f64| (2 * (REACH * sensor.thickness_mm / pitch).ceil() as usize + 1).min(LARGEST);
        Window { place: Place::Contact, rows: lines(sensor.pitch_y_mm), cols: lines(sensor.pitch_x_mm) }
    }

    /// Number of taxels.
    pub fn taxels(&self) -> usize {
        self.rows * self.cols
    }

    /// Its quads of mirror images.
    pub fn quads(&self) -> Quads {
        Quads { rows: self.rows, cols: self.cols }
    }

    /// The window as an array of its own.
    pub(crate) fn sensor(&self, sensor: &Sensor) -> Sensor {
        Sensor { rows: self.rows, cols: self.cols, ..sensor.clone() }
    }

    /// Row and column in the array of the window's first taxel, for a contact at `centre_mm`.
    pub(crate) fn origin(&self, sensor: &Sensor, centre_mm: [f64; 2]) -> [isize; 2] {
        let line =
            |centre: f64, pitch: f64, lines: usize| (centre / pitch + (lines as f64 - 1.0) / 2.0).round() as isize;
        match self.place {
            Place::Array => {
                let before = |lines: usize, own: usize| (lines as isize - own as isize) / 2;
                [before(sensor.rows, self.rows), before(sensor.cols, self.cols)]
            }
            Place::Contact => self.origin_around([
                line(centre_mm[1], sensor.pitch_y_mm, sensor.rows),
                line(centre_mm[0], sensor.pitch_x_mm, sensor.cols),
            ]),
        }
    }

    /// Row and column in the array of the first taxel of a window with this row and column in its middle.
    pub fn origin_around(&self, [row, col]: [isize; 2]) -> [isize; 2] {
        [row - self.rows as isize / 2, col - self.cols as isize / 2]
    }

    /// For each taxel of the window the taxel of the array, if there is one.
    pub fn taxels_of(&self, sensor: &Sensor, [row0, col0]: [isize; 2]) -> Vec<Option<usize>> {
        let line = |first: isize, own: usize, lines: usize| {
            first.checked_add_unsigned(own).filter(|line| (0..lines as isize).contains(line))
        };
        let taxel = |own: usize| {
            let row = line(row0, own / self.cols, sensor.rows)?;
            let col = line(col0, own % self.cols, sensor.cols)?;
            Some(row as usize * sensor.cols + col as usize)
        };
        (0..self.taxels()).map(taxel).collect()
    }

    /// Middle of the window in mm from the array's centre.
    pub(crate) fn middle_mm(&self, sensor: &Sensor, [row0, col0]: [isize; 2]) -> [f64; 2] {
        let middle = |first: isize, own: usize, lines: usize, pitch: f64| {
            (first as f64 + (own as f64 - lines as f64) / 2.0) * pitch
        };
        [
            middle(col0, self.cols, sensor.cols, sensor.pitch_x_mm),
            middle(row0, self.rows, sensor.rows, sensor.pitch_y_mm),
        ]
    }
}

impl fmt::Display for Window {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let place = match self.place {
            Place::Array => "whole array",
            Place::Contact => "window around each contact",
        };
        write!(f, "{place} of {} × {}", self.rows, self.cols)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sensor(rows: usize, cols: usize) -> Sensor {
        Sensor { rows, cols, pitch_x_mm: 2.0, pitch_y_mm: 4.0, thickness_mm: 3.0 }
    }

    #[test]
    fn a_small_array_is_a_window() {
        let array = sensor(10, 12);
        let window = Window::of(&array);
        assert_eq!(window, Window { place: Place::Array, rows: 10, cols: 12 });
        let taxels = window.taxels_of(&array, window.origin(&array, [9.0, -9.0]));
        assert_eq!(taxels, (0..120).map(Some).collect::<Vec<_>>());
    }

    /// A larger window has the array in its middle, so that mirror images of taxels are those of the array.
    #[test]
    fn a_window_that_is_larger_than_the_array_has_it_in_its_middle() {
        let (array, window) = (sensor(6, 8), Window { place: Place::Array, rows: 10, cols: 12 });
        let origin = window.origin(&array, [3.0, 1.0]);
        let taxels = window.taxels_of(&array, origin);
        assert_eq!(origin, [-2, -2]);
        let within = |taxel: usize| (2..8).contains(&(taxel / 12)) && (2..10).contains(&(taxel % 12));
        assert!((0..120).all(|taxel| taxels[taxel].is_some() == within(taxel)));
        assert_eq!((taxels[2 * 12 + 2], taxels[7 * 12 + 9]), (Some(0), Some(47)));
        assert_eq!(window.middle_mm(&array, origin), [0.0; 2]);
    }

    #[test]
    fn a_window_has_the_contact_in_its_middle() {
        let array = sensor(20, 21);
        let window = Window::of(&array);
        assert_eq!(window, Window { place: Place::Contact, rows: 9, cols: 11 });
        for (taxel, shift) in [(0, [0.9, 1.9]), (20 * 21 - 1, [-0.9, -1.9]), (10 * 21 + 3, [0.0, 1.0])] {
            let [x, y] = array.position_mm(taxel / 21, taxel % 21);
            let origin = window.origin(&array, [x + shift[0], y + shift[1]]);
            assert_eq!(window.taxels_of(&array, origin)[4 * 11 + 5], Some(taxel));
            let middle = window.middle_mm(&array, origin);
            assert!((middle[0] - x).abs() < 1e-12 && (middle[1] - y).abs() < 1e-12, "{taxel}");
        }
        // The corner's window has its upper left part beyond the array.
        let corner = window.taxels_of(&array, window.origin(&array, array.position_mm(0, 0)));
        assert_eq!(corner.iter().flatten().count(), 5 * 6);
    }
}
