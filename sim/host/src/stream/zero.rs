//! Zeros that are taken anew while a stream runs: the mean of the next frames, which then are those without contact.
//!
//! ```text
//! asked ── mean of the next 16 frames ── reading − mean + stored zero ── calibration, as with that mean as tare
//! ```
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: frames, stored zero | taxels | readings |
//! | out: frames shifted by what the zero has moved | taxels | readings |

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;

use dermis_golden::data::frame::Frame;
use dermis_golden::data::input::tare::{require_readings, Tare};
use dermis_golden::data::input::Input;
use dermis_golden::spec::scene::Scene;

/// Frames of which a zero is the mean.
pub const ZERO_FRAMES: usize = 16;

/// Asks a stream, from any thread, to take its zero from the next frames.
#[derive(Clone, Debug, Default)]
pub struct ZeroRequest(Arc<AtomicBool>);

impl ZeroRequest {
    /// Asks; once more while frames are collected begins again with the next one.
    pub fn now(&self) {
        self.0.store(true, Ordering::Release);
    }

    fn taken(&self) -> bool {
        self.0.swap(false, Ordering::AcqRel)
    }
}

/// The zero of a stream.
#[derive(Debug, Default)]
pub(super) struct Zeros {
    request: ZeroRequest,
    /// Frames of a zero that is being taken.
    waiting: Option<Vec<Frame>>,
    /// What each reading is shifted by; empty as long as the stored zero holds.
    shift: Vec<f64>,
}

impl Zeros {
    /// The stored zero, until it is asked for another one.
    pub(super) fn new(request: ZeroRequest) -> Zeros {
        Zeros { request, waiting: None, shift: Vec::new() }
    }

    /// Adds a frame as it was read; says so where it completes a zero, from which on frames are shifted by it.
    ///
    /// # Errors
    /// What is wrong with the frames, in words; the zero stays.
    pub(super) fn add(&mut self, frame: &Frame, scene: &Scene, input: &Input) -> Result<bool, String> {
        if self.request.taken() {
            self.waiting = Some(Vec::with_capacity(ZERO_FRAMES));
        }
        let Some(waiting) = &mut self.waiting else { return Ok(false) };
        waiting.push(frame.clone());
        if waiting.len() < ZERO_FRAMES {
            return Ok(false);
        }
        let frames = self.waiting.take().unwrap_or_default();
        require_readings("the frames of a zero", &frames, scene).map_err(|error| error.to_string())?;
        let stored = |taxel: usize| input.zero().map_or(0.0, |zero| zero[taxel]);
        let zero = Tare::of(&frames, scene).zero;
        self.shift = zero.iter().enumerate().map(|(taxel, own)| stored(taxel) - own).collect();
        Ok(true)
    }

    /// The frame as it is with the newest zero.
    pub(super) fn apply(&self, mut frame: Frame) -> Frame {
        for (taxel, shift) in self.shift.iter().enumerate() {
            if !frame.lacks(taxel) {
                frame.stress_MPa[taxel] += shift;
            }
        }
        frame
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dermis_golden::data::input::calibration::Calibration;

    /// With a table of offsets too, readings of a moved zero give the stress that those of the stored one gave.
    #[test]
    fn what_was_read_without_contact_is_zero_from_then_on() {
        let mut scene = Scene::builtin("eight-by-eight").unwrap();
        let folder = tempfile::tempdir().unwrap();
        let table = folder.path().join("table.csv");
        let calibration = Calibration { offset: vec![0.5; 64], gain: vec![2.0; 64] };
        std::fs::write(&table, calibration.to_csv(&scene.sensor)).unwrap();
        scene.input.calibration = Some(table);
        let input = Input::new(&scene).unwrap();
        let frame = |value: f64| Frame::from_stress("f", &scene.sensor, vec![value; 64]).unwrap();
        let stress = |zeros: &Zeros, value| input.calibrate(&zeros.apply(frame(value))).stress_MPa[9];
        let request = ZeroRequest::default();
        let mut zeros = Zeros::new(request.clone());
        assert_eq!(zeros.add(&frame(0.7), &scene, &input), Ok(false));
        assert_eq!(stress(&zeros, 0.6), 2.0 * (0.6 - 0.5));
        request.now();
        let added: Vec<bool> = (0..ZERO_FRAMES).map(|_| zeros.add(&frame(0.7), &scene, &input).unwrap()).collect();
        assert!(added[ZERO_FRAMES - 1] && !added[..ZERO_FRAMES - 1].contains(&true));
        assert!((stress(&zeros, 0.8) - 2.0 * (0.8 - 0.7)).abs() < 1e-12);
        // Missing readings stay; a taxel that no frame has read keeps the zero.
        let mut lacking = frame(0.9);
        (lacking.stress_MPa[9], lacking.missing) = (0.0, vec![9]);
        assert_eq!(zeros.apply(lacking.clone()).stress_MPa[9], 0.0);
        request.now();
        let all: Vec<_> = (0..ZERO_FRAMES).map(|_| zeros.add(&lacking, &scene, &input)).collect();
        assert!(all[ZERO_FRAMES - 1].as_ref().is_err_and(|error| error.contains("row 1, column 1")), "{all:?}");
        assert!((stress(&zeros, 0.8) - 2.0 * (0.8 - 0.7)).abs() < 1e-12);
    }
}
