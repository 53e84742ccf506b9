//! The frames of a recording, an MCAP file: all of `FILE.mcap`, or one by its number, `FILE.mcap:17`.

use super::{Frame, FrameError};
use crate::data::recording::{End, FrameOptions, Frames, RecordingError};
use crate::spec::scene::Scene;
use std::path::{Path, PathBuf};

/// Most readings that are taken from one recording: 1 GB of them.
const MOST_READINGS: usize = 1 << 27;

/// A recording as it is named.
pub(super) struct Recording {
    file: PathBuf,
    /// The only frame that is wanted, from 1; all if none is named.
    number: Option<usize>,
}

impl Recording {
    /// The recording that a path names, if it names one.
    pub(super) fn named(path: &Path) -> Option<Recording> {
        let is_recording = |path: &Path| path.extension().is_some_and(|own| own.eq_ignore_ascii_case("mcap"));
        if is_recording(path) {
            return Some(Recording { file: path.to_owned(), number: None });
        }
        let (file, number) = path.to_str()?.rsplit_once(':')?;
        let number = number.parse().ok().filter(|_| is_recording(Path::new(file)))?;
        Some(Recording { file: file.into(), number: Some(number) })
    }

    /// The wanted frames, at least one, with the scene's sensor; the name of each has its number from 1.
    pub(super) fn load(&self, scene: Option<&Scene>) -> Result<Vec<Frame>, FrameError> {
        let Recording { file: path, number } = self;
        let file = path.display().to_string();
        let Some(scene) = scene else { return Err(FrameError::NoSensor { file }) };
        let wrong = |source| FrameError::Recording { file: file.clone(), source };
        let shape = [scene.sensor.rows, scene.sensor.cols];
        let options = FrameOptions { shape: Some(shape), ..FrameOptions::default() };
        let mut frames = Frames::open(path, options).map_err(wrong)?;
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let (mut found, mut count) = (Vec::new(), 0);
        while let Some(recorded) = frames.next_frame().map_err(wrong)? {
            count += 1;
            if number.is_some_and(|number| number != count) {
                continue;
            }
            let id = frame_name(&stem, count);
            // A stamp of 0 states no time.
            let time_ns = i64::try_from(recorded.time_ns).ok().filter(|ns| *ns > 0);
            let frame = Frame { time_ns, ..Frame::from_stress(&id, &scene.sensor, recorded.stress_MPa)? };
            frame.check_missing(&format!("{file}:{count}"), Some(scene))?;
            found.push(frame);
            if found.len() * shape[0] * shape[1] > MOST_READINGS {
                return Err(wrong(RecordingError::new(format!(
                    "has more frames than fit into memory: dermis replay {file} | dermis reconstruct SCENE --stream"
                ))));
            }
            if number.is_some() {
                break;
            }
        }
        match (number, frames.end()) {
            (Some(number), _) if found.is_empty() => {
                Err(wrong(RecordingError::new(format!("frame {number} is not there: it has {count}, counted from 1"))))
            }
            (None, end @ End::Cut) => Err(wrong(RecordingError::new(end.words().unwrap_or_default()))),
            _ => Ok(found),
        }
    }
}

/// Name of a recording's frame in reports, by its number from 1.
pub(in crate::data) fn frame_name(recording: &str, number: usize) -> String {
    format!("{recording}-{number:04}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::message::{Header, Image, Time};
    use crate::data::recording::{frame_messages, Kind, RecordingFile, Stamp};

    /// Stamp of frame k from 0.
    fn stamp_ns(k: usize) -> u64 {
        if k == 0 {
            0
        } else {
            1_732_770_000_020_000_000 + k as u64
        }
    }

    /// A recording of three frames of the scene, whose first taxel lacks a reading in the second one.
    fn recorded(path: &Path) -> (Scene, Vec<Frame>) {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let mut frames = Frame::shipped(&scene)[..3].to_vec();
        let mut lacking = frames[1].stress_MPa.clone();
        lacking[0] = f64::NAN;
        frames[1] = Frame::from_stress("press-0002", &scene.sensor, lacking).unwrap();
        let mut file = RecordingFile::create(path).unwrap();
        for (k, frame) in frames.iter().enumerate() {
            // The first frame has no time.
            let header = Header { stamp: Time::from(stamp_ns(k)), frame_id: "skin".into() };
            for (topic, cdr) in frame_messages([8, 8], &header, &frame.readings()).unwrap() {
                file.message(topic, Kind::of::<Image>(), Stamp { sequence: 0, logged: 0 }, &cdr).unwrap();
            }
        }
        file.finish().unwrap();
        let plain = |(k, frame): (usize, &Frame)| {
            let time_ns = (k > 0).then(|| stamp_ns(k) as i64);
            let plain = Frame::from_stress(&frame_name("press", k + 1), &scene.sensor, frame.readings()).unwrap();
            Frame { time_ns, ..plain }
        };
        let frames = frames.iter().enumerate().map(plain).collect();
        (scene, frames)
    }

    #[test]
    fn frames_of_a_recording_are_taken_by_number_or_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("press.mcap");
        let (scene, frames) = recorded(&path);
        let numbered = |number: usize| format!("{}:{number}", path.display());
        assert_eq!(Frame::load_all(&path, Some(&scene)).unwrap(), frames);
        assert_eq!(Frame::load_all(folder.path(), Some(&scene)).unwrap(), frames);
        for (k, frame) in frames.iter().enumerate() {
            assert_eq!(Frame::load(numbered(k + 1), Some(&scene)).unwrap(), *frame);
            assert_eq!(Frame::load_all(numbered(k + 1), Some(&scene)).unwrap(), std::slice::from_ref(frame));
        }
        let error = |path: &str, scene: Option<&Scene>| Frame::load(path, scene).unwrap_err().to_string();
        let named = path.display().to_string();
        assert_eq!(error(&named, Some(&scene)), format!("{named}: has 3 frames, wanted one: {named}:1 is the first"));
        let absent = format!("{named}: frame 4 is not there: it has 3, counted from 1");
        assert_eq!(error(&numbered(4), Some(&scene)), absent);
        assert_eq!(error(&named, None), format!("{named}: no sensor in the file; name a scene"));
        let other = Scene::builtin("sensor-1").unwrap();
        let shape = format!("{named}: /dermis/stress_exact, message 0: 8×8 taxels, wanted 10×10");
        assert_eq!(error(&named, Some(&other)), shape);
        // A file that is cut is refused where all frames are wanted, and gives those before the cut by their numbers.
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() - 9]).unwrap();
        let cut = Frame::load_all(&path, Some(&scene)).unwrap_err().to_string();
        assert!(cut.starts_with(&format!("{named}: ends early")), "{cut}");
        assert_eq!(Frame::load(numbered(2), Some(&scene)).unwrap(), frames[1]);
    }
}
