//! Reading frames from files, with a limit on their size.

use super::recorded::Recording;
use super::{csv, json, Frame, FrameError};
use crate::data::text::{decoded, Stated};
use crate::spec::scene::Scene;
use std::fs::File;
use std::io::{Error, Read};
use std::path::Path;

/// Largest frame file in bytes: 64 MB.
pub const LARGEST_FILE: u64 = 64 << 20;
/// Spreadsheets mark UTF-8 with it; it belongs to no value.
const MARK: char = '\u{feff}';

impl Frame {
    /// Reads a frame from a `.json` or `.csv` file, or frame N from 1 of a recording, `FILE.mcap:N`; N may be left out where
    /// that has one frame. A recording, a CSV file, or a JSON file without a sensor, takes the scene's;
    /// [`Frame::check`] compares the sensors if both exist.
    ///
    /// # Errors
    /// Any [`FrameError`] except `SensorMismatch`.
    pub fn load(path: impl AsRef<Path>, scene: Option<&Scene>) -> Result<Frame, FrameError> {
        let path = path.as_ref();
        let file = path.display().to_string();
        if let Some(recording) = Recording::named(path) {
            let mut frames = recording.load(scene)?;
            return match (frames.pop(), frames.len()) {
                (Some(frame), 0) => Ok(frame),
                (_, others) => Err(FrameError::SeveralFrames { file, count: others + 1 }),
            };
        }
        let parser = parser(path)?;
        Frame::parsed(parser, &read(path, &file)?, path, scene)
    }

    /// Reads every frame of a recording: of a folder the `.json`, `.csv` and `.mcap` files in the order of their names, of a CSV
    /// file or an MCAP file one frame after the other, of a JSON file its frame.
    ///
    /// ```
    /// use dermis_golden::{data::frame::Frame, spec::scene::Scene, spec::sensor::Sensor};
    ///
    /// let sensor = Sensor { rows: 2, cols: 2, pitch_x_mm: 4.0, pitch_y_mm: 4.0, thickness_mm: 3.0 };
    /// let scene = Scene::of_sensor(&sensor, "small");
    /// let folder = tempfile::tempdir()?;
    /// std::fs::write(folder.path().join("zero.csv"), "0.01, 0.02\n-0.01, 0\n0, 0.01\n0, 0\n")?;
    /// let frames = Frame::load_all(folder.path(), Some(&scene))?;
    /// assert_eq!((frames.len(), frames[1].stress_MPa[1]), (2, 0.01));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Frame::load`]; [`FrameError::NoFrames`] for a folder without frames.
    pub fn load_all(path: impl AsRef<Path>, scene: Option<&Scene>) -> Result<Vec<Frame>, FrameError> {
        Frame::load_all_as(path, scene, &Stated::default())
    }

    /// As [`Frame::load_all`], of texts whose layout is `stated`.
    ///
    /// # Errors
    /// As [`Frame::load_all`].
    pub fn load_all_as(
        path: impl AsRef<Path>,
        scene: Option<&Scene>,
        stated: &Stated,
    ) -> Result<Vec<Frame>, FrameError> {
        let path = path.as_ref();
        let file = path.display().to_string();
        if path.is_dir() {
            let unreadable = |source| FrameError::Unreadable { file: file.clone(), source };
            let entries =
                std::fs::read_dir(path).and_then(Iterator::collect::<Result<Vec<_>, _>>).map_err(unreadable)?;
            let mut files: Vec<_> = entries.into_iter().map(|entry| entry.path()).collect();
            files.retain(|path| parser(path).is_ok() || Recording::named(path).is_some());
            files.sort();
            let frames: Vec<Vec<Frame>> =
                files.iter().map(|path| Frame::load_all_as(path, scene, stated)).collect::<Result<_, _>>()?;
            let frames = frames.concat();
            return if frames.is_empty() { Err(FrameError::NoFrames { file }) } else { Ok(frames) };
        }
        if let Some(recording) = Recording::named(path) {
            return recording.load(scene);
        }
        let text = parser(path).and_then(|_| read(path, &file))?;
        if is_csv(path) || is_lines_of_json(&text) {
            return csv::parse_all(&text, &file, &stem(path), scene, stated);
        }
        Ok(vec![Frame::parse(path, &text, scene)?])
    }

    /// Reads a frame from the text of a `.json` or `.csv` file called `name`, as [`Frame::load`] does.
    ///
    /// ```
    /// use dermis_golden::{data::frame::Frame, spec::scene::Scene, spec::sensor::Sensor};
    ///
    /// let sensor = Sensor { rows: 2, cols: 2, pitch_x_mm: 4.0, pitch_y_mm: 4.0, thickness_mm: 3.0 };
    /// let scene = Scene::of_sensor(&sensor, "small");
    /// let csv = Frame::parse("a.csv", "0.01, 0.02\n-0.01, 0\n", Some(&scene))?;
    /// assert_eq!(csv.stress_MPa, [0.01, 0.02, -0.01, 0.0]);
    /// let json = Frame::parse("a.json", &csv.to_json(), None)?;
    /// assert_eq!(json, csv);
    /// let error = Frame::parse("b.csv", "0.01, x\n0, 0\n", Some(&scene)).unwrap_err();
    /// assert_eq!(error.to_string(), "b.csv, line 1, value 2: \"x\" is not a finite number");
    /// let error = Frame::parse("c.csv", "0.01, \n0, 0\n", Some(&scene)).unwrap_err();
    /// assert_eq!(error.to_string(), "c.csv: 1 of 4 readings are missing, wanted at most 0 (input.missing_share = 0.2)");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Frame::load`], except those of the file system.
    pub fn parse(name: impl AsRef<Path>, text: &str, scene: Option<&Scene>) -> Result<Frame, FrameError> {
        let name = name.as_ref();
        Frame::parsed(parser(name)?, text, name, scene)
    }

    fn parsed(parser: Parser, text: &str, path: &Path, scene: Option<&Scene>) -> Result<Frame, FrameError> {
        let file = path.display().to_string();
        let frame = parser(text.strip_prefix(MARK).unwrap_or(text), &file, &stem(path), scene)?;
        frame.check_missing(&file, scene)?;
        Ok(frame)
    }
}

/// Endings of files with frames in lines, of numbers or of JSON.
const LINES: [&str; 3] = ["csv", "ndjson", "jsonl"];

/// The file's name without its ending.
fn stem(path: &Path) -> String {
    path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Whether a file has frames in lines.
fn is_csv(path: &Path) -> bool {
    path.extension().is_some_and(|extension| LINES.iter().any(|own| extension.eq_ignore_ascii_case(own)))
}

/// Whether a text has several lines, each an object of JSON, as a stream has them, and not one object.
fn is_lines_of_json(text: &str) -> bool {
    let mut lines = text.lines().filter(|line| !line.trim().is_empty());
    let is_object =
        |line: &str| line.trim_start_matches(MARK).trim_start().starts_with('{') && line.trim_end().ends_with('}');
    text.trim_end().contains('\n') && lines.all(is_object)
}

/// Text, file, its stem, scene.
type Parser = fn(&str, &str, &str, Option<&Scene>) -> Result<Frame, FrameError>;

/// The parser for a file's kind, by its extension.
fn parser(path: &Path) -> Result<Parser, FrameError> {
    let extension = path.extension().map(|extension| extension.to_ascii_lowercase());
    match extension.as_ref().and_then(|extension| extension.to_str()) {
        Some("json") => Ok(json::parse),
        Some(extension) if LINES.contains(&extension) => Ok(csv::parse),
        _ => Err(FrameError::UnknownKind { file: path.display().to_string() }),
    }
}

/// The file's text. Files without a stated size, such as pipes, are read up to the limit.
fn read(path: &Path, file: &str) -> Result<String, FrameError> {
    let unreadable = |source: Error| {
        let file = file.to_string();
        FrameError::Unreadable { file, source }
    };
    let too_large = || {
        let file = file.to_string();
        FrameError::TooLarge { file, limit: LARGEST_FILE }
    };
    let handle = File::open(path).map_err(unreadable)?;
    if handle.metadata().map_err(unreadable)?.len() > LARGEST_FILE {
        return Err(too_large());
    }
    let mut bytes = Vec::new();
    handle.take(LARGEST_FILE + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > LARGEST_FILE {
        return Err(too_large());
    }
    Ok(decoded(&bytes))
}
