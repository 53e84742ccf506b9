//! Loading scenes: built-in ones by name, others from files.

use super::{Scene, SceneError};
use crate::plain_words::line_of;
use crate::spec::suggest::{distance, nearest};
use std::io::Read;

/// What stands between the name of a scene and the number of one of its arrays.
const ARRAY_MARK: char = '#';
/// Largest scene file in bytes.
const LARGEST_FILE: u64 = 1 << 20;

/// Built-in scenes: name and TOML text.
const BUILTINS: [(&str, &str); 11] = [
    ("sensor-1", include_str!("../../../scenes/sensor-1.toml")),
    ("sensor-1-noisy", include_str!("../../../scenes/sensor-1-noisy.toml")),
    ("sensor-1-unipolar", include_str!("../../../scenes/sensor-1-unipolar.toml")),
    ("sensor-1-bonded", include_str!("../../../scenes/sensor-1-bonded.toml")),
    ("sensor-2", include_str!("../../../scenes/sensor-2.toml")),
    ("sensor-3", include_str!("../../../scenes/sensor-3.toml")),
    ("sensor-3-contacts", include_str!("../../../scenes/sensor-3-contacts.toml")),
    ("sensor-4", include_str!("../../../scenes/sensor-4.toml")),
    ("eight-by-eight", include_str!("../../../scenes/eight-by-eight.toml")),
    ("eight-by-eight-bonded", include_str!("../../../scenes/eight-by-eight-bonded.toml")),
    ("eight-by-eight-contacts", include_str!("../../../scenes/eight-by-eight-contacts.toml")),
];

impl Scene {
    /// Names of the built-in scenes.
    pub fn builtin_names() -> Vec<&'static str> {
        BUILTINS.iter().map(|(name, _)| *name).collect()
    }

    /// The built-in scene called `name`; see [`Scene::builtin_names`].
    ///
    /// ```
    /// use dermis_golden::spec::scene::Scene;
    ///
    /// let scene = Scene::builtin("sensor-1")?;
    /// assert_eq!((scene.sensor.rows, scene.sensor.cols, scene.search.mu_max), (10, 10, 0.6));
    /// let error = Scene::builtin("sensor1").unwrap_err().to_string();
    /// assert!(error.ends_with("did you mean \"sensor-1\"?"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`SceneError::NotFound`], which suggests the most similar name.
    pub fn builtin(name: &str) -> Result<Scene, SceneError> {
        builtin(name).ok_or_else(|| not_found(name)).and_then(|text| Scene::parse(text, name))
    }

    /// Loads a scene by built-in name or by path; a built-in name takes precedence over a file of that name. `hand.toml#3` is array 3
    /// of an engine of several, alone ([`Scene::of_array`]).
    ///
    /// # Errors
    /// Any [`SceneError`] except `NotAvailable`.
    pub fn load(name_or_path: &str) -> Result<Scene, SceneError> {
        let Some((name, number)) = array_of(name_or_path) else {
            return Scene::parse(&Scene::text(name_or_path)?, name_or_path);
        };
        let scene = Scene::parse(&Scene::text(name)?, name)?;
        let arrays = scene.hardware.arrays;
        match number.parse() {
            Ok(array) if array < arrays => Ok(scene.of_array(array)),
            _ => Err(SceneError::NoArray { file: name.to_owned(), number: number.to_owned(), arrays }),
        }
    }

    /// The text of a scene that [`Scene::load`] loads.
    ///
    /// # Errors
    /// [`SceneError::NotFound`], `Unreadable` or `TooLarge`.
    pub fn text(name_or_path: &str) -> Result<String, SceneError> {
        if let Some(text) = builtin(name_or_path) {
            return Ok(text.to_owned());
        }
        if !std::path::Path::new(name_or_path).exists() {
            return Err(not_found(name_or_path));
        }
        let text = read(name_or_path).map_err(|source| {
            let file = name_or_path.to_string();
            SceneError::Unreadable { file, source }
        })?;
        if text.len() as u64 > LARGEST_FILE {
            let file = name_or_path.to_string();
            return Err(SceneError::TooLarge { file, limit: LARGEST_FILE });
        }
        Ok(text)
    }
}

/// Name or path of a scene and the number of an array behind it; `None` if the whole is a file's name, or no number follows.
fn array_of(name_or_path: &str) -> Option<(&str, &str)> {
    let (name, number) = name_or_path.rsplit_once(ARRAY_MARK)?;
    let is_number = !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
    (is_number && !std::path::Path::new(name_or_path).exists()).then_some((name, number))
}

/// The text of a built-in scene.
fn builtin(name: &str) -> Option<&'static str> {
    BUILTINS.iter().find(|(builtin, _)| *builtin == name).map(|(_, text)| *text)
}

/// The file's text, read up to one byte beyond the limit so that the caller can tell it is too large.
fn read(path: &str) -> std::io::Result<String> {
    let mut bytes = Vec::new();
    std::fs::File::open(path)?.take(LARGEST_FILE + 1).read_to_end(&mut bytes)?;
    String::from_utf8(bytes).map_err(|error| {
        let line = line_of(error.as_bytes(), error.utf8_error().valid_up_to());
        std::io::Error::new(std::io::ErrorKind::InvalidData, format!("line {line} is no text in UTF-8"))
    })
}

fn not_found(name: &str) -> SceneError {
    let builtins = Scene::builtin_names();
    // A built-in scene is often taken for a file of that name.
    let word = name.strip_suffix(".toml").unwrap_or(name);
    let nearest = nearest(builtins.iter().copied(), |builtin| distance(word, builtin));
    SceneError::NotFound { name: name.to_string(), nearest, builtins }
}
