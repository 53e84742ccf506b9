//! The folder of an imported recording: scene, frames and `recording.json`.
//!
//! ```text
//! NAME/NAME.toml   NAME/frames/NAME-0001.json …   NAME/recording.json
//! ```

use super::error::ImportError;
use super::summary::Summary;
use super::Imported;
use crate::data::frame::Frame;
use crate::spec::scene::Scene;
use crate::write::{write, FileError};
use std::path::{Path, PathBuf};

/// Name of the file with the summary.
const SUMMARY: &str = "recording.json";
/// Largest summary in bytes; a frame takes some 150.
const LARGEST_SUMMARY: u64 = 64 << 20;

impl Imported {
    /// Writes scene, frames and summary into `folder`, which is made if needed; returns the path of the scene. Frames of
    /// an earlier import with the same names are replaced, others stay.
    ///
    /// # Errors
    /// [`ImportError::File`] for a folder or file that cannot be written.
    pub fn save(&self, folder: &Path) -> Result<PathBuf, ImportError> {
        let frames = folder.join("frames");
        std::fs::create_dir_all(&frames).map_err(FileError::at(&frames))?;
        for (frame, record) in self.frames.iter().zip(&self.summary.frames) {
            write(&folder.join(&record.file), (frame.to_json() + "\n").as_bytes())?;
        }
        // Numbers, texts and lists of them can always be written as JSON.
        let summary = serde_json::to_string(&self.summary).unwrap_or_default() + "\n";
        write(&folder.join(SUMMARY), summary.as_bytes())?;
        let scene = folder.join(&self.summary.name).with_added_extension("toml");
        write(&scene, self.scene_text.as_bytes())?;
        Ok(scene)
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
            message: error.to_string(),
        })?;
        let path = folder.join(&summary.name).with_added_extension("toml");
        let scene_text = super::recording::decoded(&super::read(&path, LARGEST_SUMMARY)?);
        let scene = Scene::parse(&scene_text, &path.display().to_string())?;
        let load = |file: &String| -> Result<Frame, ImportError> {
            let frame = Frame::load(folder.join(file), Some(&scene))?;
            frame.check(&scene)?;
            Ok(frame)
        };
        let frames = summary.frames.iter().map(|record| load(&record.file)).collect::<Result<_, _>>()?;
        Ok(Imported { scene_text, scene, frames, summary })
    }
}
