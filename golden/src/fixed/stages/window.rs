//! Stage `window`: what the network reads around a contact, from the frame buffer.
//!
//! ```text
//! codes of the window ── magnitude ── normalise ── fold ── high limb: operands of the first layer
//! mask of the window ────────────────────────── fold: operands of its mask
//! ```
//! The window has the contact's middle in its own. Beyond the array and on dead taxels the code is 0 and the mask
//! [`MASKED`]. The shift of `normalise` is the window's own.

use super::fold;
use super::normalise;
use super::pass::{high_limbs, Vector};
use super::receive::{receive, Received};
use crate::fixed::words::formats::Formats;
use crate::fixed::words::network::MASKED;
use crate::spec::quads::Quads;
use crate::spec::sensor::Sensor;
use crate::spec::window::Window;

/// The window of a contact.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WindowWords {
    /// High limbs of the folded codes.
    pub input: Vector,
    /// The folded mask.
    pub mask: Vector,
    /// Magnitude and signs of the codes of the contact's own taxels in the window.
    pub own: Received,
}

/// Cycles from the start until the first taxel is folded: the window's first row and column 1, those of the taxel 1, whether
/// the array has them 1, row and column of its quad 1, address 1, frame buffer 2, lane 1, shift 2, sum 1.
const LATENCY: u64 = 11;

/// Cycles of the hardware from the start of a window until all of it has been written: its quads are read twice, a taxel a
/// cycle, for the magnitude and to be shifted and folded.
pub fn cycles(window: &Window) -> u64 {
    2 * (Quads::LANES * window.quads().len()) as u64 + LATENCY
}

/// An array whose windows are read.
#[derive(Clone, Copy, Debug)]
pub struct Array<'a> {
    /// Rows and columns.
    pub sensor: &'a Sensor,
    /// Words of the frame buffer, row-major.
    pub codes: &'a [i32],
    /// Dead taxels, row-major, ascending.
    pub dead: &'a [usize],
    /// Noise floor in codes.
    pub floor: i32,
}

/// The `window` around the contact in `middle`, [row, column]; `is_own` tells its taxels, row-major.
pub fn window(
    formats: &Formats,
    window: &Window,
    array: &Array,
    middle: [usize; 2],
    is_own: &dyn Fn(usize) -> bool,
) -> WindowWords {
    let Array { sensor, codes, dead, floor } = *array;
    let origin = window.origin_around(middle.map(|line| line as isize));
    let is_alive = |taxel: &usize| dead.binary_search(taxel).is_err();
    let taxels: Vec<Option<usize>> =
        window.taxels_of(sensor, origin).into_iter().map(|taxel| taxel.filter(is_alive)).collect();
    let read: Vec<i32> = taxels.iter().map(|taxel| taxel.map_or(0, |taxel| codes[taxel])).collect();
    let mask: Vec<i64> = taxels.iter().map(|taxel| if taxel.is_none() { MASKED } else { 0 }).collect();
    let own: Vec<i32> = taxels.iter().flatten().filter(|taxel| is_own(**taxel)).map(|taxel| codes[*taxel]).collect();
    let (layout, shift) = (window.quads(), normalise::shift(receive(&read, floor).magnitude, formats.input_bits));
    WindowWords {
        input: high_limbs(&fold::fold(&normalise::normalise(&layout.pack(&read), shift)), formats),
        mask: fold::fold(&layout.pack(&mask)),
        own: receive(&own, floor),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::symmetry::parity::hadamard;
    use crate::spec::scene::Scene;
    use crate::spec::window::WindowPosition;

    /// A window in the corner: what is beyond the array is masked, its own loudest code sets the shift.
    #[test]
    fn a_window_in_the_corner() {
        let model = crate::fixed::Model::new(&Scene::builtin("sensor-1-noisy").unwrap()).unwrap();
        let formats = model.formats();
        let sensor = Sensor { rows: 4, cols: 4, ..model.scene.sensor.clone() };
        let codes: Vec<i32> = (0..16).map(|taxel| if taxel < 8 { 100 + taxel } else { 100_000 }).collect();
        let small = Window { place: WindowPosition::Contact, rows: 3, cols: 3 };
        let array = Array { sensor: &sensor, codes: &codes, dead: &[1], floor: 103 };
        let found = window(formats, &small, &array, [0, 0], &|taxel| taxel == 4);
        // Rows −1 to 1: codes 100, dead, 104, 105 in the lower right; all shifted to the full width.
        let shift = formats.input_bits - 1 - 7;
        let word = |code: i64| code << shift;
        let middle = found.input[3];
        assert_eq!(middle, [(4 * word(100)) >> formats.input_low_bits, 0, 0, 0]);
        // The quad of the corners: (−1, −1), (−1, 1), (1, −1), (1, 1), of which only the last is on the array.
        let corners = hadamard([0, 0, 0, word(105)]).map(|f| f >> formats.input_low_bits);
        assert_eq!((found.input[0], found.mask[0]), (corners, hadamard([MASKED, MASKED, MASKED, 0])));
        assert_eq!((found.mask[3], found.own.positive), ([0; 4], true));
        // (0, −1) is beyond the array, (0, 1) dead: both sides of the middle line are masked.
        assert_eq!(found.mask[2], [4 * MASKED, 0, 0, 0]);
        let loud = window(formats, &small, &array, [1, 1], &|_| false);
        assert!(!loud.own.positive && loud.input[0] != found.input[0]);
    }
}
