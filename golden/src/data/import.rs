//! Import: recordings of real pressure arrays become a scene and frames.
//!
//! ```text
//! file ── format ── tekscan │ lst │ npy │ … │ csv ── readings ── correction ── crop ── ÷ units per MPa ┬─ scene, dead taxels
//!                                                                                                            ├─ frames
//!                                                                                                            └─ summary: codes, noise, closure
//! ```
//!
//! | format | recognised by | states | to be given |
//! |---|---|---|---|
//! | Tekscan ASF, CSV | `DATA_TYPE`, `ASCII_DATA` | size, pitch, unit, missing sensels (`B`) | full scale for raw counts |
//! | novel LST | `Pict-No` | size, pitch, force per picture | |
//! | XSENSOR CSV | `SENSELS` | size, pitch, unit, force | |
//! | novel pliance and pedar `.asc`, BodiTrak CSV | their headers | unit, times | size, pitch |
//! | serial bytes of a FlexiTac | marks `AA 55` at equal distances | width of a count | size, pitch, full scale |
//! | PaXini PXSR CSV | `Timestamp`, `-NxN-Z[` | forces of the taxels and of the sensor, times | size, pitch; sensor, of several |
//! | XELA server, JSON lines | `message`, `taxels` | forces or counts, times | size, pitch; sensor, of several; full scale of counts |
//! | NumPy `.npy` | first six bytes | size | unit, pitch |
//! | lines of numbers | `.csv`, `.tsv`, `.txt`, `.dat` | | size, unit, pitch; layout where it can be read in two ways |
//!
//! A sensel without a reading in any frame becomes a dead taxel, on which forces continue those around it; where nothing can
//! press on it, as outside the outline of an insole, it may be stated to read 0 instead. A sensel without a reading in some
//! frames is missing in those. A frame that lacks more readings than `input.missing_share` allows is left out. Counts have no stress: without a stated full scale they are refused.

mod correction;
mod crop;
mod csv;
mod error;
mod flexitac;
mod folder;
mod format;
mod loggers;
mod lst;
mod measure;
mod npy;
mod paxini;
mod recording;
mod scene;
mod shipped;
mod summary;
mod tekscan;
#[cfg(test)]
mod tests;
mod triaxial;
mod units;
mod xela;
mod xsensor;

pub use correction::Correction;
pub use crop::{Crop, Window, CONTACT_SHARE, MARGIN, MOST_TAXELS};
pub use error::ImportError;
pub use format::Format;
pub use measure::{idle, noise, Codes, Idle, Noise};
pub use scene::BARE_DEPTH;
pub use summary::{FrameRecord, Summary, IDLE_SHARE};
pub use units::Unit;

use crate::data::frame::Frame;
use crate::data::input::missing::complete;
use crate::data::text::{decoded, Stated};
use crate::spec::scene::Scene;
use crate::spec::sensor::{Sensor, MAX_LENGTH_MM};
use error::Source;
use recording::{DeviceFigure, RawFrame, Recording, LARGEST_SIDE};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Largest file of a recording in bytes: 256 MB.
pub const LARGEST_FILE: u64 = 256 << 20;

/// What the user states about a recording; what is `None` is taken from the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settings {
    /// Name of the scene; default: the file's, with `-` for characters that a name may not have.
    pub name: Option<String>,
    /// Format.
    pub format: Option<Format>,
    /// Unit of the readings.
    pub unit: Option<Unit>,
    /// Rows and columns, for plain CSV and arrays of one line per frame.
    pub size: Option<[usize; 2]>,
    /// Pitch along columns and rows in mm.
    pub pitch_mm: Option<[f64; 2]>,
    /// Stress of the largest reading in MPa; for counts, of the largest count.
    pub full_scale_MPa: Option<f64>,
    /// Bits of a count.
    pub bits: Option<u32>,
    /// First and last frame, counted from 1.
    pub frames: Option<[usize; 2]>,
    /// What to keep of the array.
    pub crop: Crop,
    /// Whether missing sensels become taxels that read 0 instead of dead ones.
    pub missing_as_zero: bool,
    /// Thickness of an elastic cover over the array in mm.
    pub thickness_mm: Option<f64>,
    /// Whether a file whose end is missing is taken; else it is an error.
    pub partial: bool,
    /// Layout of the lines of a plain text.
    pub layout: Stated,
    /// Name of the sensor, of a file with several.
    pub sensor: Option<String>,
    /// Zero, sign and orientation of the readings, which the file has otherwise.
    pub correction: Correction,
}

/// An imported recording.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The scene's TOML text.
    pub scene_text: String,
    /// The scene.
    pub scene: Scene,
    /// The frames in the order of the recording.
    pub frames: Vec<Frame>,
    /// Origin, codes, noise, forces of the frames.
    pub summary: Summary,
}

impl DeviceFigure {
    /// The figure in N, with the force of one unit of reading.
    fn force_N(self, unit_N: f64) -> f64 {
        match self {
            DeviceFigure::Force(force) => force,
            DeviceFigure::Sum(sum) => sum * unit_N,
        }
    }
}

/// Reads and imports a file of a recording.
///
/// # Errors
/// Any [`ImportError`] but those of writing.
pub fn load(path: &Path, settings: &Settings) -> Result<Imported, ImportError> {
    let mut imported = import(&path.display().to_string(), &read(path, LARGEST_FILE)?, settings)?;
    imported.summary.path = std::fs::canonicalize(path).ok().map(|path| path.display().to_string());
    Ok(imported)
}

/// Imports the content of a file called `file`.
///
/// ```
/// use dermis_golden::data::import::{import, Settings, Unit};
///
/// // Two frames of 2×2 taxels, one of which does not exist.
/// let csv = b"0, 10, B, 0\n0, 20, B, 5\n";
/// let stated = Settings { unit: Some(Unit::KiloPa), pitch_mm: Some([4.0, 4.0]), ..Settings::default() };
/// let error = import("press.csv", csv, &stated).unwrap_err();
/// assert_eq!(error.to_string(), "press.csv: the size is missing; give it with --size ROWSxCOLS");
/// let imported = import("press.csv", csv, &Settings { size: Some([2, 2]), ..stated })?;
/// assert_eq!(imported.scene.input.dead, [[1, 0]]);
/// assert_eq!(imported.frames[1].stress_MPa, [0.0, 0.02, 0.0, 0.005]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Any [`ImportError`] but those of the file system.
pub fn import(file: &str, bytes: &[u8], settings: &Settings) -> Result<Imported, ImportError> {
    let source = Source { file };
    settings.check(&source)?;
    let mut recording = parse(file, bytes, settings, &source)?;
    if let Some(name) = settings.sensor.as_ref().filter(|_| !recording.format.has_sensors()) {
        let allowed = format!("left out: a recording of format {} is of one array", recording.format.name());
        return Err(source.field("--sensor", name, allowed));
    }
    if let Some(words) = recording.cut.as_ref().filter(|_| !settings.partial || recording.frames.is_empty()) {
        return Err(source.cut(words, recording.frames.len()));
    }
    let frames_in_file = recording.frames.len();
    settings.correction.apply(&mut recording, &source)?;
    select(&mut recording, settings.frames, &source)?;
    let stated_mm = settings.pitch_mm.or(recording.pitch_mm);
    let (unit, per_MPa) = scale(&recording, settings, stated_mm, &source)?;
    let pitch = stated_mm.ok_or_else(|| missing_pitch(&source))?;
    let window = crop::window(&recording, settings.crop, &source)?;
    let bare_mm = BARE_DEPTH * pitch[0].min(pitch[1]);
    let sensor = Sensor {
        rows: window.rows,
        cols: window.cols,
        pitch_x_mm: pitch[0],
        pitch_y_mm: pitch[1],
        thickness_mm: settings.thickness_mm.unwrap_or(bare_mm),
    };
    let name = settings.name.clone().unwrap_or_else(|| name_of(file));
    let dead: Vec<bool> = window.indices(recording.cols).map(|k| recording.missing[k]).collect();
    let mut lacking = Scene::of_sensor(&sensor, &name);
    lacking.input.dead = (0..dead.len()).filter(|&k| dead[k]).map(|k| [k / sensor.cols, k % sensor.cols]).collect();
    let left_out = scene::leave_out(&mut recording, window, &lacking, &source)?;
    let (frames, records) = scene::frames(&recording, window, &lacking, per_MPa)?;
    let alive: Vec<bool> = dead.iter().map(|dead| !dead).collect();
    let readings: Vec<f64> = window_readings(&recording, window, |frame| &frame.values);
    let stated = window_readings(&recording, window, |frame| frame.stated.as_ref().unwrap_or(&frame.values));
    let largest_MPa = readings.iter().fold(0.0f64, |most, reading| most.max((reading / per_MPa).abs()));
    let stated_MPa = settings.full_scale_MPa.or(recording.full_scale.map(|reading| reading / per_MPa));
    let most_MPa = largest_MPa.max(stated_MPa.unwrap_or(0.0));
    // A recording without load has no largest reading: one unit.
    let full_scale_MPa = if most_MPa > 0.0 { most_MPa } else { 1.0 / per_MPa };
    let unipolar = readings.iter().all(|reading| *reading >= 0.0);
    let complete: Vec<Frame> = frames.iter().map(|frame| complete(&lacking.input, frame.clone())).collect();
    let stress: Vec<&[f64]> = complete.iter().map(|frame| frame.stress_MPa.as_slice()).collect();
    let summary = Summary {
        file: Path::new(file).file_name().map_or(file.into(), |name| name.to_string_lossy().into_owned()),
        path: None,
        name,
        format: recording.format,
        device: recording.device.clone(),
        array: [recording.rows, recording.cols],
        window,
        missing: dead.iter().filter(|dead| **dead).count(),
        missing_readings: frames.iter().map(|frame| frame.missing.len()).sum(),
        left_out,
        layout: recording.layout.clone(),
        lines_left_out: recording.left_out.clone(),
        cut: recording.cut.clone(),
        in_doubt: recording.in_doubt.clone(),
        missing_as_zero: settings.missing_as_zero,
        correction: settings.correction,
        unit,
        units_per_MPa: per_MPa,
        full_scale_MPa,
        covered: settings.thickness_mm.is_some(),
        frames_in_file,
        codes: measure::codes(stated, per_MPa, stated_MPa, full_scale_MPa),
        noise: noise(&stress, &alive),
        idle: idle(&stress, &alive),
        frames: records,
    };
    let listed: &[bool] = if settings.missing_as_zero { &[] } else { &dead };
    let facts = scene::Facts { sensor: &sensor, covered: summary.covered, unipolar, dead: listed };
    let (scene_text, scene) = scene::scene(&summary, &facts)?;
    Ok(Imported { scene_text, scene, frames, summary })
}

impl Settings {
    /// Checks the ranges that the scene's parser does not.
    fn check(&self, source: &Source) -> Result<(), ImportError> {
        let length = |mm: f64| mm > 0.0 && mm <= MAX_LENGTH_MM;
        if let Some(pitch) = self.pitch_mm.filter(|pitch| !pitch.iter().all(|mm| length(*mm))) {
            let allowed = format!("above 0, at most {MAX_LENGTH_MM} mm");
            return Err(source.field("--pitch", format!("{},{}", pitch[0], pitch[1]), allowed));
        }
        if let Some(MPa) = self.full_scale_MPa.filter(|MPa| !(*MPa > 0.0 && *MPa <= 1e9)) {
            return Err(source.field("--full-scale", MPa, "above 0, at most 1e9 MPa"));
        }
        if let Some(bits) = self.bits.filter(|bits| !(1..=32).contains(bits)) {
            return Err(source.field("--bits", bits, "1 to 32"));
        }
        if let Some([rows, cols]) = self.size.filter(|size| !size.iter().all(|n| (1..=LARGEST_SIDE).contains(n))) {
            return Err(source.field(
                "--size",
                format!("{rows}x{cols}"),
                format!("1 to {LARGEST_SIDE} rows and columns"),
            ));
        }
        Ok(())
    }
}

/// Reads the file in its format.
fn parse(file: &str, bytes: &[u8], settings: &Settings, source: &Source) -> Result<Recording, ImportError> {
    if bytes.starts_with(format::HDF5_MAGIC) {
        return Err(ImportError::Hdf5 { file: file.to_string() });
    }
    if format::is_npz(bytes) {
        return Err(ImportError::Npz { file: file.to_string() });
    }
    let format = settings.format.or_else(|| Format::of(file, bytes));
    let wanted = triaxial::Wanted { size: settings.size, sensor: settings.sensor.as_deref() };
    match format.ok_or_else(|| ImportError::Unrecognised { file: file.to_string() })? {
        Format::Tekscan => tekscan::parse(&decoded(bytes), source),
        Format::Lst => lst::parse(&decoded(bytes), source),
        Format::Xsensor => xsensor::parse(&decoded(bytes), source),
        Format::Flexitac => flexitac::parse(bytes, settings.size, source),
        Format::Paxini => paxini::parse(&decoded(bytes), &wanted, source),
        Format::Xela => xela::parse(&decoded(bytes), &wanted, source),
        Format::Npy => npy::parse(bytes, settings.size, source),
        Format::Csv => csv::parse(&decoded(bytes), settings.size, &settings.layout, source),
    }
}

/// Keeps the wanted frames, at least one, and finds the sensels that they never read.
fn select(recording: &mut Recording, wanted: Option<[usize; 2]>, source: &Source) -> Result<(), ImportError> {
    let count = recording.frames.len();
    if count == 0 {
        return Err(source.missing("the first frame", "the file has none"));
    }
    let [first, last] = wanted.unwrap_or([1, count]);
    if first == 0 || first > last || last > count {
        return Err(source.field("--frames", format!("{first}..{last}"), format!("within 1..{count}")));
    }
    recording.frames.truncate(last);
    recording.frames.drain(..first - 1);
    let never = |k: usize| recording.frames.iter().all(|frame| frame.values[k].is_nan());
    recording.missing = (0..recording.rows * recording.cols).map(never).collect();
    Ok(())
}

fn missing_pitch(source: &Source) -> ImportError {
    source.missing("the pitch", "give it with --pitch X,Y in mm")
}

/// The unit of the readings and its number per MPa.
fn scale(
    recording: &Recording,
    settings: &Settings,
    pitch_mm: Option<[f64; 2]>,
    source: &Source,
) -> Result<(Unit, f64), ImportError> {
    let unit = settings
        .unit
        .or(recording.unit)
        .ok_or_else(|| source.missing("the unit", format!("give it with --units, one of {}", Unit::names())))?;
    if let Some(per_MPa) = unit.per_MPa() {
        return Ok((unit, per_MPa));
    }
    if unit == Unit::Newton {
        // 1 MPa is 1 N on each mm² of a taxel.
        let [x_mm, y_mm] = pitch_mm.ok_or_else(|| missing_pitch(source))?;
        return Ok((unit, x_mm * y_mm));
    }
    let counts = "raw counts have no stress; give that of the largest count in MPa with --full-scale";
    let full_scale_MPa = settings.full_scale_MPa.ok_or_else(|| source.missing("the full scale", counts))?;
    let bits = settings.bits.or(recording.bits);
    let bits = bits.ok_or_else(|| source.missing("the width of a count", "give its bits with --bits"))?;
    // At most 32 bits.
    let largest = ((1u64 << bits) - 1) as f64;
    check_counts(recording, largest, bits, source)?;
    Ok((unit, largest / full_scale_MPa))
}

/// Checks that no count is above the largest one that so many bits have.
///
/// # Errors
/// The first that is, with its frame and place.
fn check_counts(recording: &Recording, largest: f64, bits: u32, source: &Source) -> Result<(), ImportError> {
    for frame in &recording.frames {
        let counts = frame.stated.as_ref().unwrap_or(&frame.values);
        if let Some(place) = counts.iter().position(|count| *count > largest) {
            let [row, col] = [place / recording.cols, place % recording.cols];
            let field = format!("frame {}, row {row}, column {col}", frame.number);
            return Err(source.field(
                &field,
                counts[place],
                format!("at most {largest}, the largest count of {bits} bits (--bits)"),
            ));
        }
    }
    Ok(())
}

/// The readings of all sensels that exist in the window.
fn window_readings(recording: &Recording, window: Window, of: fn(&RawFrame) -> &Vec<f64>) -> Vec<f64> {
    let alive: Vec<usize> = window.indices(recording.cols).filter(|k| !recording.missing[*k]).collect();
    let there = |values: &Vec<f64>| alive.iter().map(|k| values[*k]).filter(|reading| !reading.is_nan()).collect();
    recording.frames.iter().map(of).flat_map::<Vec<f64>, _>(there).collect()
}

/// A scene's name from a file's.
fn name_of(file: &str) -> String {
    let stem = Path::new(file).file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let tame = |c: char| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' };
    let name: String = stem.chars().take(64).map(tame).collect();
    match name.trim_start_matches('.') {
        "" => "recording".to_string(),
        name => name.to_string(),
    }
}

/// The bytes of a file up to a limit.
fn read(path: &Path, limit: u64) -> Result<Vec<u8>, ImportError> {
    let file = path.display().to_string();
    let mut bytes = Vec::new();
    let read = File::open(path).and_then(|handle| handle.take(limit + 1).read_to_end(&mut bytes));
    match read {
        Err(source) => Err(ImportError::Unreadable { file, source }),
        Ok(_) if bytes.len() as u64 > limit => Err(ImportError::TooLarge { file, limit }),
        Ok(_) => Ok(bytes),
    }
}
