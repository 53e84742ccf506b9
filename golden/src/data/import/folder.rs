//! The folder of an imported recording: scene, all frames in one file, and `recording.json`.
//!
//! ```text
//! NAME/NAME.toml   NAME/NAME.mcap   NAME/recording.json
//! ```

use super::error::{ImportError, Source};
use super::summary::Summary;
use super::Imported;
use crate::data::frame::Frame;
use crate::data::recording::message::{Header, Image, Time};
use crate::data::recording::{frame_messages, Kind, RecordingError, RecordingFile, Stamp};
use crate::data::text::decoded;
use crate::plain_words::JsonError;
use crate::spec::scene::Scene;
use crate::write::{replace, write, FileError};
use std::fs::File;
use std::io::Error;
use std::path::{Path, PathBuf};

/// Name of the file with the summary.
const SUMMARY: &str = "recording.json";
/// Largest summary in bytes; a frame takes some 150.
const LARGEST_SUMMARY: u64 = 64 << 20;
/// Frames that are written at a time.
const FRAMES_AT_A_TIME: u64 = 8192;

impl Summary {
    /// The file with the frames, in the folder of an import.
    fn recording(&self, folder: &Path) -> PathBuf {
        folder.join(&self.name).with_added_extension("mcap")
    }
}

impl Imported {
    /// Writes scene, frames and summary into `folder`, which is made if needed; returns the path of the scene. An earlier import
    /// of the same file is replaced.
    ///
    /// # Errors
    /// [`ImportError::Taken`] for a folder with the import of another file, or with files of that name that no import wrote;
    /// [`ImportError::File`] for a folder or file that cannot be written.
    pub fn save(&self, folder: &Path) -> Result<PathBuf, ImportError> {
        if let Some(other) = self.other_in(folder) {
            return Err(ImportError::Taken { folder: folder.to_owned(), other });
        }
        std::fs::create_dir_all(folder).map_err(FileError::at(folder))?;
        replace(&self.summary.recording(folder), |file| self.record(file.try_clone()?).map_err(Error::other))?;
        // Numbers, texts and lists of them can always be written as JSON.
        let summary = serde_json::to_string(&self.summary).unwrap_or_default() + "\n";
        write(&folder.join(SUMMARY), summary.as_bytes())?;
        let scene = folder.join(&self.summary.name).with_added_extension("toml");
        write(&scene, self.scene_text.as_bytes())?;
        Ok(scene)
    }

    /// What else than an import of the same file a folder has in the place of this one.
    fn other_in(&self, folder: &Path) -> Option<String> {
        let path = folder.join(SUMMARY);
        if path.exists() {
            // What cannot be read is none that an import has completed.
            let summary: Summary = serde_json::from_slice(&super::read(&path, LARGEST_SUMMARY).ok()?).ok()?;
            let is_same = match (&summary.path, &self.summary.path) {
                (Some(own), Some(other)) => own == other,
                _ => summary.file == self.summary.file,
            };
            let file = summary.path.unwrap_or(summary.file);
            return (!is_same).then(|| format!("the import of {file}"));
        }
        let scene = format!("{}.toml", self.summary.name);
        folder.join(&scene).exists().then(|| format!("a file {scene} that no import wrote"))
    }

    /// Writes the frames: in each the time from the start where it is known, else 0.
    fn record(&self, file: File) -> Result<(), RecordingError> {
        let sensor = &self.scene.sensor;
        let mut file = RecordingFile::begin(file)?;
        for ((sequence, frame), record) in (0..).zip(&self.frames).zip(&self.summary.frames) {
            let logged = (record.time_s.unwrap_or_default().max(0.0) * 1e9).round() as u64;
            let header = Header { stamp: Time::from(logged), frame_id: self.summary.name.clone() };
            for (topic, cdr) in frame_messages([sensor.rows, sensor.cols], &header, &frame.readings())? {
                file.message(topic, Kind::of::<Image>(), Stamp { sequence, logged }, &cdr)?;
            }
            if sequence % FRAMES_AT_A_TIME == FRAMES_AT_A_TIME - 1 {
                file.flush()?;
            }
        }
        file.finish()
    }

    /// Reads what [`Imported::save`] wrote; the scene and the frames may have been changed since.
    ///
    /// # Errors
    /// [`ImportError`] for a file that is missing, too large or not of an import.
    pub fn open(folder: &Path) -> Result<Imported, ImportError> {
        let path = folder.join(SUMMARY);
        let file = path.display().to_string();
        let bytes = super::read(&path, LARGEST_SUMMARY)?;
        let summary: Summary = serde_json::from_slice(&bytes).map_err(|error| ImportError::Json {
            file: file.clone(),
            line: error.line(),
            column: error.column(),
            message: JsonError::new(&error).message,
        })?;
        let path = folder.join(&summary.name).with_added_extension("toml");
        let scene_text = decoded(&super::read(&path, LARGEST_SUMMARY)?);
        let scene = Scene::parse(&scene_text, &path.display().to_string())?;
        let path = summary.recording(folder);
        let mut frames = Frame::load_all(&path, Some(&scene))?;
        if frames.len() != summary.frames.len() {
            let (got, wanted) = (frames.len(), summary.frames.len());
            let file = path.display().to_string();
            return Err(Source { file: &file }.field("number of frames", got, format!("{wanted}, as {SUMMARY} has")));
        }
        for (frame, record) in frames.iter_mut().zip(&summary.frames) {
            frame.source = Some(record.source());
        }
        Ok(Imported { scene_text, scene, frames, summary })
    }
}
