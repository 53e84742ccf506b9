//! `dermis import`: a recording of a real pressure array becomes a scene and frames.
//!
//! The folder holds `NAME.toml`, all frames in `NAME.mcap`, and `recording.json`; `dermis reconstruct` takes scene and
//! frames, `dermis report --recording` the folder.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail, Result};
use clap::{Args, ValueEnum};
use dermis_golden::data::import::{load, Correction, Crop, Format, Settings, Summary, Unit};
use dermis_golden::data::text::Form;

use super::layout::LayoutArguments;
use dermis_report::document::percent_text;

/// Arguments of `dermis import`.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Recording: Tekscan ASF or CSV, novel LST or .asc, XSENSOR, BodiTrak or PaXini CSV, XELA messages, FlexiTac bytes,
    /// NumPy .npy, or lines of numbers.
    file: PathBuf,
    /// Folder for scene, frames and recording.json; default: recordings/NAME in the build folder.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Name of the scene; default: the file's.
    #[arg(long)]
    name: Option<String>,
    /// Format, if it is not recognised: tekscan, lst, npy, xsensor, flexitac, paxini, xela or csv.
    #[arg(long, value_name = "NAME", value_parser = format)]
    format: Option<Format>,
    /// Unit of the readings: Pa, kPa, MPa, bar, mbar, N/cm2, psi, mmHg, kg/cm2, g/cm2, N (on each taxel) or raw; default: the file's.
    #[arg(long, value_name = "UNIT", value_parser = unit)]
    units: Option<Unit>,
    /// Stress of the largest reading in MPa; raw counts need it.
    #[arg(long, value_name = "MPA")]
    full_scale: Option<f64>,
    /// Bits of a raw count; default: 8 for Tekscan.
    #[arg(long, value_name = "N")]
    bits: Option<u32>,
    /// Rows and columns of the array, for plain CSV and arrays of one line per frame.
    #[arg(long, value_name = "ROWSxCOLS")]
    size: Option<String>,
    /// Sensor to read, where the file has several, as 0-1 (PaXini: channel and slot) or 2 (XELA).
    #[arg(long, value_name = "NAME")]
    sensor: Option<String>,
    /// Pitch in mm along columns and rows; default: the file's.
    #[arg(long, value_name = "X,Y")]
    pitch: Option<String>,
    /// Thickness in mm of an elastic cover over the array; without it no shear is searched.
    #[arg(long, value_name = "MM")]
    thickness: Option<f64>,
    /// Frames to import, the first and the last, counted from 1; default: all. Or how they stand in a text, grid: a line per row, or
    /// line: a line per frame; default: found. May be given twice.
    #[arg(long, value_name = "A..B|grid|line")]
    frames: Vec<String>,
    /// Take a file whose end is missing: the frames before that. Else it is an error.
    #[arg(long)]
    partial: bool,
    #[command(flatten)]
    layout: LayoutArguments,
    /// auto, contact, or rows and columns counted from 0: A..B,C..D, ends included.
    #[arg(long, value_name = "WINDOW", default_value = "auto")]
    crop: String,
    /// What missing sensels become: dead taxels, on which forces continue those around them, or taxels that read 0.
    #[arg(long, value_enum, default_value = "dead")]
    missing: Missing,
    #[command(flatten)]
    correction: CorrectionArguments,
    /// Print the summary as JSON and nothing else.
    #[arg(long)]
    json: bool,
}

/// Zero, sign and orientation of the readings. `--size` is that of the file; `--pitch`, `--crop` and the scene are those of the
/// array after them.
#[derive(Args, Clone, Debug, Default)]
struct CorrectionArguments {
    /// Frames without load at the begin of the file, first:N: the mean of each taxel over them is its zero.
    #[arg(long, value_name = "first:N", value_parser = zero_frames)]
    zero: Option<usize>,
    /// Change the sign of the readings, after the zero: for those that fall with the load.
    #[arg(long)]
    invert: bool,
    /// Make rows columns.
    #[arg(long)]
    transpose: bool,
    /// Mirror along x, the other order of the columns, or along y, that of the rows; after --transpose.
    #[arg(long, value_enum, value_delimiter = ',')]
    flip: Vec<Axis>,
}

/// An axis of the array.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum Axis {
    /// Along the columns.
    X,
    /// Along the rows.
    Y,
}

impl CorrectionArguments {
    fn correction(&self) -> Correction {
        let flips = |axis| self.flip.contains(&axis);
        let (flip_x, flip_y) = (flips(Axis::X), flips(Axis::Y));
        Correction { zero_frames: self.zero, invert: self.invert, transpose: self.transpose, flip_x, flip_y }
    }
}

fn zero_frames(text: &str) -> Result<usize, String> {
    let number = text.strip_prefix("first:").and_then(|number| number.parse().ok());
    number.filter(|number| *number > 0).ok_or_else(|| "the number of frames without load, as first:20".to_owned())
}

/// What missing sensels become.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum Missing {
    /// Dead taxels.
    Dead,
    /// Taxels that read 0, where nothing can press on them.
    Zero,
}

const EXAMPLES: &str = "Examples:
  dermis import walk.asf --missing zero
  dermis import finger.csv --full-scale 0.4 --crop contact --frames 1..20 --out finger
  dermis import press.npy --units kPa --pitch 2.5,2.5 --thickness 3
  dermis import log.csv --size 4x4 --units N/cm2 --pitch 5,5 --json
  dermis import glove.csv --size 4x4 --units raw --bits 12 --full-scale 0.1 --pitch 5,5 --invert --zero first:20
  dermis import skin.bin --size 16x32 --full-scale 0.2 --pitch 2,2 --zero first:30 --partial
  dermis import paxini.csv --sensor 0-1 --size 4x6 --pitch 3,3
  dermis import left.csv --size 4x4 --units kPa --pitch 5,5 --transpose --flip x

Reads the size, pitch and unit that the file states. A sensel without a reading (B, NaN, empty) in any
frame becomes a dead taxel; one without a reading in some frames is missing in those. An array of
more than 2304 sensels is cropped around the contact; rows and columns in --crop choose another part.
All frames are in one file, DIR/NAME.mcap, in the form of dermis reconstruct --stream --record. Then:
dermis reconstruct DIR/NAME.toml --frame DIR/NAME.mcap:1 (the first frame), dermis live DIR/NAME.toml --recording
DIR/NAME.mcap, dermis replay DIR/NAME.mcap | dermis reconstruct DIR/NAME.toml --stream, dermis report --recording DIR";

/// Imports the recording and writes its folder; returns the summary.
///
/// # Errors
/// A file that cannot be read or is malformed, something that neither file nor options state, an option out of range, a
/// folder that cannot be written.
pub fn run(arguments: &Arguments, build_dir: &Path) -> Result<String> {
    let imported = load(&arguments.file, &arguments.settings()?)?;
    let summary = &imported.summary;
    let out = arguments.out.clone().unwrap_or_else(|| build_dir.join("recordings").join(&summary.name));
    let scene = imported.save(&out)?;
    if arguments.json {
        return Ok(serde_json::to_string(summary)? + "\n");
    }
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = lines(&mut text, summary, &imported.scene.sensor.to_string());
    Ok(text + &format!("written         {} and {} frames\n", scene.display(), summary.frames.len()))
}

impl Arguments {
    fn settings(&self) -> Result<Settings> {
        let size = self.size.as_deref().map(|text| pair("--size", text, "ROWSxCOLS", |text| text.split_once('x')));
        let pitch = self.pitch.as_deref().map(|text| pair("--pitch", text, "X,Y", |text| text.split_once(',')));
        let (mut frames, mut layout) = (None, self.layout.stated());
        for text in &self.frames {
            match text.as_str() {
                "grid" => layout.form = Some(Form::Grid),
                "line" => layout.form = Some(Form::Line),
                _ => frames = Some(range("--frames", text, text).map_err(|error| anyhow!("{error}, grid or line"))?),
            }
        }
        Ok(Settings {
            name: self.name.clone(),
            format: self.format,
            unit: self.units,
            size: size.transpose()?,
            pitch_mm: pitch.transpose()?,
            full_scale_MPa: self.full_scale,
            bits: self.bits,
            frames,
            crop: crop(&self.crop)?,
            missing_as_zero: self.missing == Missing::Zero,
            thickness_mm: self.thickness,
            partial: self.partial,
            layout,
            sensor: self.sensor.clone(),
            correction: self.correction.correction(),
        })
    }
}

/// The lines of the printed summary, without the written files.
fn lines(text: &mut String, summary: &Summary, sensor: &str) -> std::fmt::Result {
    of_file(text, summary, sensor)?;
    of_frames(text, summary)
}

/// What was read of the file, and what not.
fn of_file(text: &mut String, summary: &Summary, sensor: &str) -> std::fmt::Result {
    let window = &summary.window;
    let [rows, cols] = summary.array;
    let device = summary.device.as_deref().unwrap_or("device not stated");
    writeln!(
        text,
        "{}: {}, {device}, {rows}×{cols}, unit {}",
        summary.file,
        summary.format.name(),
        summary.unit.name()
    )?;
    writeln!(
        text,
        "window          rows {}..{}, columns {}..{}: {sensor}",
        window.row0,
        window.row0 + window.rows - 1,
        window.col0,
        window.col0 + window.cols - 1,
    )?;
    if let Some(layout) = &summary.layout {
        writeln!(text, "layout          {layout}")?;
    }
    if let Some(first) = summary.lines_left_out.first() {
        writeln!(text, "left out        {} lines without a frame; {first}", summary.lines_left_out.len())?;
    }
    if let Some(words) = &summary.cut {
        writeln!(text, "ends early      {words}")?;
    }
    for words in &summary.in_doubt {
        writeln!(text, "in doubt        {words}")?;
    }
    if summary.correction != Correction::default() {
        writeln!(text, "corrected       {}", summary.correction)?;
    }
    if summary.missing > 0 {
        let what = match summary.missing_as_zero {
            true => "they read 0",
            false => "dead taxels; forces on them continue those around (--missing zero: none)",
        };
        writeln!(text, "missing         {} sensels: {what}", summary.missing)?;
    }
    if summary.outside_share() > 0.0 {
        writeln!(
            text,
            "                up to {} of the largest load is outside",
            percent_text(summary.outside_share())
        )?;
    }
    if summary.missing_readings > 0 {
        writeln!(text, "missing         {} readings of single frames", summary.missing_readings)?;
    }
    if !summary.left_out.is_empty() {
        let numbers: Vec<String> = summary.left_out.iter().map(usize::to_string).collect();
        writeln!(
            text,
            "left out        frame {}: more readings missing than input.missing_share allows",
            numbers.join(", ")
        )?;
    }
    Ok(())
}

/// What the frames hold.
fn of_frames(text: &mut String, summary: &Summary) -> std::fmt::Result {
    let Summary { codes, noise, .. } = summary;
    let count = summary.frames.len();
    let period = summary.frames.first().zip(summary.frames.get(1)).and_then(|(a, b)| Some(b.time_s? - a.time_s?));
    let period = period.map_or(String::new(), |seconds| format!(", {seconds:.4} s apart"));
    writeln!(text, "frames          {count} of {}{period}", summary.frames_in_file)?;
    let step = codes.step_MPa.map_or("none".to_owned(), |MPa| format!("{:.3} kPa", 1e3 * MPa));
    let bits = codes.bits.map_or(String::new(), |bits| format!(", {bits} bits"));
    let full_kPa = 1e3 * summary.full_scale_MPa;
    writeln!(text, "codes           {} levels, step {step}{bits}; full scale {full_kPa:.1} kPa", codes.levels)?;
    if codes.at_full_scale > 0 {
        writeln!(text, "                {} readings at full scale", codes.at_full_scale)?;
    }
    if let Some((share, idle)) = summary.idle_share().zip(summary.idle) {
        let level = format!("{:.1} kPa, {} of full scale", 1e3 * idle.level_MPa, percent_text(share));
        let zero = match idle.frames {
            0 => "--zero first:N with N frames without load at the begin of the file".to_owned(),
            frames => format!("--zero first:{frames}"),
        };
        let what = match idle.falls {
            true => format!("readings fall with the load: import with --invert {zero}"),
            false => format!("without load: import with {zero}"),
        };
        writeln!(text, "zero            {level}; {what}")?;
    }
    match (noise.loaded_MPa, noise.loaded_share) {
        (Some(MPa), Some(share)) => {
            let of = format!("{:.3} kPa, {} of the peak", 1e3 * MPa, percent_text(share));
            writeln!(text, "noise           {of}, in {} frames of a held load", noise.held_frames)?;
        }
        _ => writeln!(text, "noise           not measured: no frame holds its load")?,
    }
    if let Some(MPa) = noise.empty_MPa {
        writeln!(text, "                {:.3} kPa without contact, {} frames", 1e3 * MPa, noise.empty_frames)?;
    }
    let forces = || summary.frames.iter().map(|frame| frame.normal_N + frame.outside_N);
    let (least, most) = (forces().fold(f64::INFINITY, f64::min), forces().fold(f64::NEG_INFINITY, f64::max));
    writeln!(text, "normal force    {least:.2} to {most:.2} N, stress times area")?;
    if let Some([largest, median]) = summary.closure() {
        let (largest, median) = (percent_text(largest), percent_text(median));
        writeln!(text, "                off the device's own figure by {largest} at most, {median} median")?;
    }
    match summary.covered {
        true => writeln!(text, "shear           searched under the stated cover"),
        false => writeln!(text, "shear           not searched: no cover of known thickness (--thickness)"),
    }
}

/// Two values between a separator.
fn pair<T: std::str::FromStr>(
    option: &str,
    text: &str,
    wanted: &str,
    split: impl Fn(&str) -> Option<(&str, &str)>,
) -> Result<[T; 2]> {
    let parse = |(a, b): (&str, &str)| Some([a.trim().parse().ok()?, b.trim().parse().ok()?]);
    split(text).and_then(parse).ok_or_else(|| anyhow!("{option} {text:?}: wanted {wanted}"))
}

/// `A..B`; `whole` is the option's value.
fn range(option: &str, text: &str, whole: &str) -> Result<[usize; 2]> {
    pair(option, text, "A..B", |text| text.split_once("..")).map_err(|_| anyhow!("{option} {whole:?}: wanted A..B"))
}

/// `auto`, `contact` or `A..B,C..D`.
fn crop(text: &str) -> Result<Crop> {
    match text {
        "auto" => Ok(Crop::Auto),
        "contact" => Ok(Crop::Contact),
        _ => {
            let wrong = || anyhow!("--crop {text:?}: wanted auto, contact or rows and columns A..B,C..D");
            let (rows, cols) = text.split_once(',').ok_or_else(wrong)?;
            let lines = |part| range("--crop", part, text).map_err(|_| wrong());
            Ok(Crop::Lines { rows: lines(rows)?, cols: lines(cols)? })
        }
    }
}

fn format(name: &str) -> Result<Format> {
    let known = Format::ALL.iter().find(|(own, _)| *own == name);
    let Some((_, format)) = known else { bail!("one of {}", Format::names().join(", ")) };
    Ok(*format)
}

fn unit(name: &str) -> Result<Unit> {
    Unit::named(name).ok_or_else(|| anyhow!("one of {}", Unit::names()))
}
