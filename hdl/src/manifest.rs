//! `manifest.json`: size and CRC-32 of every generated file, and a CRC-32 of its own, so that a reader detects missing,
//! truncated and changed files.
//!
//! | field | holds |
//! |---|---|
//! | `manifest_version` | version of the fields' meaning; a reader rejects any other |
//! | `files` | name to `bytes` and `crc32`, for all files except the manifest |
//! | `checksum` | CRC-32 of the manifest without it, as JSON with sorted keys, two-space indent and a final newline |

use dermis_golden::plain_words::JsonError;
use std::collections::BTreeMap;
use std::io::{Error, ErrorKind, Read};
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{json, Value};
use thiserror::Error;

/// `manifest_version`: version of the generated files' meaning; a reader rejects any other.
pub(crate) const MANIFEST_VERSION: u32 = 2;
/// File name of the manifest.
pub(crate) const MANIFEST: &str = "manifest.json";

/// Largest manifest that is read, in bytes; the largest scene's takes 30 kB.
const LARGEST: u64 = 4 << 20;
/// Largest generated file that is read, in bytes; the largest scene's Verilog takes 2 MB.
const LARGEST_FILE: u64 = 256 << 20;

/// A file of the generated hardware.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GeneratedFile {
    /// File name without folder.
    pub name: String,
    /// Content.
    pub text: String,
}

/// Size and checksum of a generated file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileSum {
    /// Size in bytes.
    pub bytes: u64,
    /// CRC-32 of the content.
    pub crc32: u32,
}

/// A manifest that cannot be read or is damaged, or files that differ from it.
#[derive(Debug, Error)]
pub enum ManifestError {
    /// Reading a file failed.
    #[error("{file}: cannot be read: {source}")]
    Unreadable {
        /// Path of the file.
        file: String,
        /// Error of the operating system.
        source: Error,
    },
    /// Not valid JSON, not an object, or a field is missing or of the wrong type.
    #[error("{file}: not a valid manifest: {reason}")]
    Syntax {
        /// Path of the file.
        file: String,
        /// What is wrong with it.
        reason: String,
    },
    /// Its `manifest_version` is another one.
    #[error(
        "{file}: manifest_version = {version} is not allowed; it must be {MANIFEST_VERSION}: build the scene again"
    )]
    Version {
        /// Path of the file.
        file: String,
        /// The value found.
        version: Value,
    },
    /// Truncated or changed.
    #[error("{file}: {field} = {says}, its content has {has}: it is damaged; build the scene again")]
    Damaged {
        /// Path of the file.
        file: String,
        /// Field of the manifest that differs: `checksum`, `bytes` or `crc32`.
        field: &'static str,
        /// Value in the manifest.
        says: u64,
        /// Value of the actual content.
        has: u64,
    },
}

/// Adds `files` and `checksum` to `manifest`; returns its text.
pub(crate) fn seal(manifest: &mut Value, files: &[GeneratedFile]) -> String {
    let others = files.iter().filter(|file| file.name != MANIFEST);
    let sums: BTreeMap<&str, FileSum> = others.map(|file| (file.name.as_str(), sum(file.text.as_bytes()))).collect();
    manifest["files"] = json!(sums);
    manifest["checksum"] = json!(own_sum(manifest));
    text(manifest)
}

/// Parses a manifest's text and checks version and checksum; `file` names it in errors.
///
/// # Errors
/// Every [`ManifestError`] except `Unreadable`.
pub fn parse(text: &str, file: &str) -> Result<Value, ManifestError> {
    let syntax = |reason: String| ManifestError::Syntax { file: file.to_owned(), reason };
    if !text.ends_with('\n') {
        return Err(syntax("truncated: the last line has no end".to_owned()));
    }
    let manifest: Value = serde_json::from_str(text).map_err(|error| syntax(JsonError::new(&error).to_string()))?;
    if !manifest.is_object() {
        return Err(syntax("not an object".to_owned()));
    }
    if manifest["manifest_version"] != json!(MANIFEST_VERSION) {
        return Err(ManifestError::Version { file: file.to_owned(), version: manifest["manifest_version"].clone() });
    }
    let says = manifest["checksum"].as_u64().ok_or_else(|| syntax("checksum is missing".to_owned()))?;
    match u64::from(own_sum(&manifest)) {
        has if has == says => Ok(manifest),
        has => Err(ManifestError::Damaged { file: file.to_owned(), field: "checksum", says, has }),
    }
}

/// Checks the manifest in `folder` and every file it lists; returns their number, the manifest among them.
///
/// # Errors
/// [`ManifestError`] for the first file that is missing or differs.
pub fn check(folder: &Path) -> Result<usize, ManifestError> {
    let path = folder.join(MANIFEST);
    let file = path.display().to_string();
    let bytes = read(&path, LARGEST)?;
    let invalid = |error| Error::new(ErrorKind::InvalidData, error);
    let content = String::from_utf8(bytes)
        .map_err(|error| ManifestError::Unreadable { file: file.clone(), source: invalid(error) })?;
    let manifest = parse(&content, &file)?;
    let files: BTreeMap<String, FileSum> = serde_json::from_value(manifest["files"].clone())
        .map_err(|error| ManifestError::Syntax { file: file.clone(), reason: format!("files: {error}") })?;
    for (name, says) in &files {
        // A manifest from elsewhere must not name files outside the folder.
        if Path::new(name).file_name() != Some(name.as_ref()) {
            return Err(ManifestError::Syntax { file, reason: format!("files: {name:?} is not the name of a file") });
        }
        let path = folder.join(name);
        let has = sum(&read(&path, says.bytes.saturating_add(1).min(LARGEST_FILE))?);
        let file = path.display().to_string();
        if has.bytes != says.bytes {
            return Err(ManifestError::Damaged { file, field: "bytes", says: says.bytes, has: has.bytes });
        }
        if has.crc32 != says.crc32 {
            let (says, has) = (u64::from(says.crc32), u64::from(has.crc32));
            return Err(ManifestError::Damaged { file, field: "crc32", says, has });
        }
    }
    Ok(files.len() + 1)
}

/// The first `most` bytes of a file, so that a wrong file cannot exhaust the memory.
fn read(path: &Path, most: u64) -> Result<Vec<u8>, ManifestError> {
    let mut bytes = Vec::new();
    let read = std::fs::File::open(path).and_then(|file| file.take(most).read_to_end(&mut bytes));
    match read {
        Ok(_) => Ok(bytes),
        Err(source) => Err(ManifestError::Unreadable { file: path.display().to_string(), source }),
    }
}

fn sum(bytes: &[u8]) -> FileSum {
    FileSum { bytes: bytes.len() as u64, crc32: crc32fast::hash(bytes) }
}

/// CRC-32 of the manifest without its `checksum` field.
fn own_sum(manifest: &Value) -> u32 {
    let mut rest = manifest.clone();
    if let Some(fields) = rest.as_object_mut() {
        fields.remove("checksum");
    }
    crc32fast::hash(text(&rest).as_bytes())
}

fn text(manifest: &Value) -> String {
    format!("{manifest:#}\n")
}
