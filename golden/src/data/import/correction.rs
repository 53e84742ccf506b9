//! Correction: zero, sign and orientation of the readings, where a file has them otherwise than a scene. In this order:
//!
//! | stated | readings |
//! |---|---|
//! | `zero_frames` | less the mean of each sensel over the first frames of the file, in which nothing presses |
//! | `invert` | with the other sign, so that those that fall with the load rise |
//! | `transpose` | rows become columns |
//! | `flip_x` | columns in the other order |
//! | `flip_y` | rows in the other order |
//!
//! A sensel without a reading in the frames of the zero has none in any.

use std::fmt;

use super::error::{ImportError, Source};
use super::recording::{DeviceFigure, Recording};
use serde::{Deserialize, Serialize};

/// What is corrected; the default is nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Correction {
    /// Number of frames at the begin of the file, at least one, of which the zero of each sensel is the mean.
    pub zero_frames: Option<usize>,
    /// Whether readings change their sign.
    pub invert: bool,
    /// Whether rows become columns.
    pub transpose: bool,
    /// Whether the columns, after that, stand in the other order.
    pub flip_x: bool,
    /// Whether the rows do.
    pub flip_y: bool,
}

impl Correction {
    /// Corrects a whole recording.
    pub(super) fn apply(&self, recording: &mut Recording, source: &Source) -> Result<(), ImportError> {
        if self.changes_readings() {
            self.level(recording, source)?;
        }
        if !(self.transpose || self.flip_x || self.flip_y) {
            return Ok(());
        }
        let (order, rows) = (self.order([recording.rows, recording.cols]), recording.rows);
        for frame in &mut recording.frames {
            frame.values = order.iter().map(|k| frame.values[*k]).collect();
            frame.stated = frame.stated.take().map(|stated| order.iter().map(|k| stated[*k]).collect());
        }
        if self.transpose {
            (recording.rows, recording.cols) = (recording.cols, rows);
            recording.pitch_mm = recording.pitch_mm.map(|[x, y]| [y, x]);
        }
        Ok(())
    }

    fn changes_readings(&self) -> bool {
        self.invert || self.zero_frames.is_some()
    }

    /// Zero and sign of the readings. A sum that the device states of them is of others then.
    fn level(&self, recording: &mut Recording, source: &Source) -> Result<(), ImportError> {
        let (frames, wanted) = (recording.frames.len(), self.zero_frames.unwrap_or(0));
        if self.zero_frames.is_some() && !(1..=frames).contains(&wanted) {
            return Err(source.field("--zero", format!("first:{wanted}"), format!("first:1 to first:{frames}")));
        }
        let unloaded = &recording.frames[..wanted];
        let zero = |k: usize| {
            let own = || unloaded.iter().map(|frame| frame.values[k]).filter(|value| !value.is_nan());
            own().sum::<f64>() / own().count() as f64
        };
        let taxels = recording.rows * recording.cols;
        let zero: Vec<f64> = (0..taxels).map(|k| if wanted == 0 { 0.0 } else { zero(k) }).collect();
        let sign = if self.invert { -1.0 } else { 1.0 };
        for frame in &mut recording.frames {
            let corrected = frame.values.iter().zip(&zero).map(|(value, zero)| sign * (value - zero)).collect();
            frame.stated = Some(std::mem::replace(&mut frame.values, corrected));
            frame.device = frame.device.filter(|figure| matches!(figure, DeviceFigure::Force(_)));
        }
        Ok(())
    }

    /// Where each sensel of the turned array stands in that of the file, both row-major.
    fn order(&self, [rows, cols]: [usize; 2]) -> Vec<usize> {
        let [new_rows, new_cols] = if self.transpose { [cols, rows] } else { [rows, cols] };
        let of = |flip: bool, k: usize, count: usize| if flip { count - 1 - k } else { k };
        let from = |k: usize| {
            let (row, col) = (of(self.flip_y, k / new_cols, new_rows), of(self.flip_x, k % new_cols, new_cols));
            if self.transpose {
                col * cols + row
            } else {
                row * cols + col
            }
        };
        (0..rows * cols).map(from).collect()
    }
}

impl fmt::Display for Correction {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let zero = self.zero_frames.map(|frames| match frames {
            1 => "less the first frame".to_owned(),
            _ => format!("less the mean of the first {frames} frames"),
        });
        let turned = [
            (self.invert, "with the other sign"),
            (self.transpose, "rows as columns"),
            (self.flip_x, "columns in the other order"),
            (self.flip_y, "rows in the other order"),
        ];
        let turned = turned.into_iter().filter(|(does, _)| *does).map(|(_, words)| words.to_owned());
        f.write_str(&zero.into_iter().chain(turned).collect::<Vec<_>>().join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::super::recording::RawFrame;
    use super::super::{import, Format, Imported, Settings, Unit};
    use super::*;
    use crate::random::Random;

    /// Every orientation.
    fn orientations() -> impl Iterator<Item = Correction> {
        let bit = |k: usize, bit: usize| k >> bit & 1 == 1;
        (0..8).map(move |k| Correction {
            transpose: bit(k, 0),
            flip_x: bit(k, 1),
            flip_y: bit(k, 2),
            ..Default::default()
        })
    }

    #[test]
    fn orientations_are_the_eight_of_a_rectangle() {
        let shape = [2, 3];
        let all: Vec<Vec<usize>> = orientations().map(|own| own.order(shape)).collect();
        for (k, order) in all.iter().enumerate() {
            assert!(!all[..k].contains(order), "{order:?} twice");
            let mut sorted = order.clone();
            sorted.sort_unstable();
            assert!(sorted.into_iter().eq(0..6), "{order:?}");
        }
        // 0 1 2 / 3 4 5 by hand: as columns, then in the other order along x.
        assert_eq!(Correction { transpose: true, ..Default::default() }.order(shape), [0, 3, 1, 4, 2, 5]);
        assert_eq!(Correction { flip_x: true, ..Default::default() }.order(shape), [2, 1, 0, 5, 4, 3]);
        assert_eq!(Correction { flip_y: true, ..Default::default() }.order(shape), [3, 4, 5, 0, 1, 2]);
        let both = Correction { transpose: true, flip_x: true, ..Default::default() };
        assert_eq!(both.order(shape), [3, 0, 4, 1, 5, 2]);
    }

    fn imported(frames: &[Vec<f64>], size: [usize; 2], correction: Correction) -> Result<Imported, ImportError> {
        let line = |frame: &Vec<f64>| frame.iter().map(f64::to_string).collect::<Vec<_>>().join(",") + "\n";
        let text: String = frames.iter().map(line).collect();
        let (unit, pitch_mm) = (Some(Unit::KiloPa), Some([5.0, 4.0]));
        let settings = Settings { unit, size: Some(size), pitch_mm, correction, ..Settings::default() };
        import("press.csv", text.as_bytes(), &settings)
    }

    fn stress(imported: &Imported) -> Vec<Vec<f64>> {
        imported.frames.iter().map(|frame| frame.stress_MPa.clone()).collect()
    }

    #[test]
    fn what_a_device_turns_inverts_and_lifts_is_undone_and_by_nothing_else() {
        let (mut random, [rows, cols], unloaded) = (Random::new(11), [4, 6], 3);
        let mut press =
            |t| (0..24).map(|_| if t < unloaded { 0.0 } else { random.between(0.0, 90.0).floor() }).collect();
        let pressed: Vec<Vec<f64>> = (0..9).map(&mut press).collect();
        let wanted = imported(&pressed, [rows, cols], Correction::default()).unwrap();
        for turned in orientations() {
            // The device's frame is the one that the correction takes back: 3000 and more counts, less under load.
            let size = if turned.transpose { [cols, rows] } else { [rows, cols] };
            let order = turned.order(size);
            let device = |frame: &Vec<f64>| {
                let mut own = vec![0.0; 24];
                order.iter().zip(frame).for_each(|(k, load)| own[*k] = 3000.0 + *k as f64 - load);
                own
            };
            let file: Vec<Vec<f64>> = pressed.iter().map(device).collect();
            let correction = Correction { zero_frames: Some(unloaded), invert: true, ..turned };
            let own = imported(&file, size, correction).unwrap();
            assert_eq!(stress(&own), stress(&wanted), "{correction}");
            assert_eq!(own.scene.sensor, wanted.scene.sensor, "{correction}");
            // The device's steps, not those of what is corrected.
            assert_eq!(own.summary.codes.step_MPa, Some(1e-3), "{correction}");
            assert_eq!((own.summary.correction, own.summary.idle_share()), (correction, None));
            // Every other correction gives something else.
            for other in orientations().filter(|other| *other != turned && other.transpose == turned.transpose) {
                let other = imported(&file, size, Correction { zero_frames: Some(unloaded), invert: true, ..other });
                assert_ne!(stress(&other.unwrap()), stress(&wanted));
            }
            let upright = Correction { invert: false, ..correction };
            assert_ne!(stress(&imported(&file, size, upright).unwrap()), stress(&wanted));
            // Frames with load in the zero.
            let late = Correction { zero_frames: Some(unloaded + 2), ..correction };
            assert_ne!(stress(&imported(&file, size, late).unwrap()), stress(&wanted));
        }
    }

    #[test]
    fn a_zero_of_no_frame_or_too_many_is_refused() {
        let frames = vec![vec![1.0; 16]; 3];
        for zero in [0, 4] {
            let correction = Correction { zero_frames: Some(zero), ..Default::default() };
            let error = imported(&frames, [4, 4], correction).unwrap_err().to_string();
            assert_eq!(
                error,
                format!("press.csv: --zero = first:{zero} is not allowed; it must be first:1 to first:3")
            );
        }
    }

    #[test]
    fn missing_readings_figures_and_pitch_follow() {
        let source = Source { file: "press" };
        let frame = |values: [f64; 2], device| RawFrame {
            number: 1,
            time_s: None,
            values: values.to_vec(),
            stated: None,
            device,
        };
        let frames = vec![
            frame([1.0, f64::NAN], Some(DeviceFigure::Sum(1.0))),
            frame([3.0, 5.0], Some(DeviceFigure::Force(2.0))),
        ];
        let mut recording = Recording { pitch_mm: Some([4.0, 3.0]), ..Recording::bare(Format::Csv, [1, 2], frames) };
        let correction = Correction { zero_frames: Some(1), transpose: true, flip_y: true, ..Default::default() };
        correction.apply(&mut recording, &source).unwrap();
        assert_eq!((recording.rows, recording.cols, recording.pitch_mm), (2, 1, Some([3.0, 4.0])));
        let [first, second] = &recording.frames[..] else { unreachable!("two frames") };
        assert!(first.values[0].is_nan() && second.values[0].is_nan(), "{second:?}");
        assert_eq!((first.values[1], second.values[1]), (0.0, 2.0));
        assert_eq!(second.stated, Some(vec![5.0, 3.0]));
        assert_eq!((first.device, second.device), (None, Some(DeviceFigure::Force(2.0))));
        assert_eq!(correction.to_string(), "less the first frame, rows as columns, rows in the other order");
    }
}
