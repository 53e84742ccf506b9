//! What an import found out: the content of `recording.json`.

use super::correction::Correction;
use super::crop::Window;
use super::format::Format;
use super::measure::{Codes, Idle, Noise};
use super::units::Unit;
use serde::{Deserialize, Serialize};

/// Share of full scale up to which the level without load is that of a zero.
pub const IDLE_SHARE: f64 = 0.05;

/// One frame of an imported recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameRecord {
    /// Number as the device counts.
    pub number: usize,
    /// Time from the start in s, if known.
    pub time_s: Option<f64>,
    /// Σ b·area of the window in N, with what is taken for missing readings.
    pub normal_N: f64,
    /// Σ b·area of the sensels outside the window in N.
    pub outside_N: f64,
    /// The device's own normal force in N, of the whole array, if its file prints it.
    pub device_N: Option<f64>,
}

impl FrameRecord {
    /// Origin of the frame, in words.
    pub(super) fn source(&self) -> String {
        let time = self.time_s.map_or(String::new(), |seconds| format!(", {seconds:.4} s"));
        format!("recording, frame {}{time}", self.number)
    }

    /// Σ b·area of the whole array over the device's own figure − 1; none without a figure or for an unloaded frame.
    pub fn closure(&self) -> Option<f64> {
        let device = self.device_N.filter(|force| *force != 0.0)?;
        Some((self.normal_N + self.outside_N) / device - 1.0)
    }
}

/// Content of `recording.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Name of the scene.
    pub name: String,
    /// Name of the recording's file, without its folder.
    pub file: String,
    /// Path of that file, where it was read from one: an import of another file of the same name does not replace this one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<String>,
    /// Its format.
    pub format: Format,
    /// The device, as the file names it.
    pub device: Option<String>,
    /// Rows and columns of the recording.
    pub array: [usize; 2],
    /// The part of it that the scene has.
    pub window: Window,
    /// Sensels in the window without a reading in any frame.
    pub missing: usize,
    /// Readings that frames lack beside those.
    #[serde(default)]
    pub missing_readings: usize,
    /// Numbers of the frames that are left out because they lack too many readings.
    #[serde(default)]
    pub left_out: Vec<usize>,
    /// Layout of the lines of a plain text, in words.
    #[serde(default)]
    pub layout: Option<String>,
    /// Lines of a plain text that hold no frame, with the reason.
    #[serde(default)]
    pub lines_left_out: Vec<String>,
    /// Where the file ends too early, in words; the frames are those that are whole.
    #[serde(default)]
    pub cut: Option<String>,
    /// Where numbers of a plain text may have lost digits, in words.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub in_doubt: Vec<String>,
    /// Whether they are taxels that read 0; else they are dead taxels.
    pub missing_as_zero: bool,
    /// Zero, sign and orientation that were corrected.
    #[serde(default)]
    pub correction: Correction,
    /// Unit of the readings.
    pub unit: Unit,
    /// Units per MPa.
    pub units_per_MPa: f64,
    /// Full scale of the scene in MPa: stated, or the largest reading.
    pub full_scale_MPa: f64,
    /// Whether the thickness of a cover was stated; without it the scene finds no shear.
    pub covered: bool,
    /// Number of frames in the file.
    pub frames_in_file: usize,
    /// Codes seen in the window.
    pub codes: Codes,
    /// Noise in the window.
    pub noise: Noise,
    /// Readings without load in the window.
    #[serde(default)]
    pub idle: Option<Idle>,
    /// The imported frames.
    pub frames: Vec<FrameRecord>,
}

impl Summary {
    /// Largest |closure| of the frames, and the median; none where the file has no force.
    pub fn closure(&self) -> Option<[f64; 2]> {
        let mut all: Vec<f64> = self.frames.iter().filter_map(|frame| frame.closure().map(f64::abs)).collect();
        all.sort_by(f64::total_cmp);
        Some([*all.last()?, all[all.len() / 2]])
    }

    /// The level of the readings without load over the full scale, where it is more than [`IDLE_SHARE`], or the readings fall
    /// with the load.
    pub fn idle_share(&self) -> Option<f64> {
        let idle = self.idle?;
        let share = idle.level_MPa / self.full_scale_MPa;
        (idle.falls || share.abs() > IDLE_SHARE).then_some(share)
    }

    /// Largest Σ b·area outside the window over the largest Σ b·area of a frame.
    pub fn outside_share(&self) -> f64 {
        let largest = |force: fn(&FrameRecord) -> f64| self.frames.iter().map(|f| force(f).abs()).fold(0.0, f64::max);
        let all = largest(|frame| frame.normal_N + frame.outside_N);
        if all > 0.0 {
            largest(|frame| frame.outside_N) / all
        } else {
            0.0
        }
    }
}
