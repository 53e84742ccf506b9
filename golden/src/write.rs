//! Write: files are replaced atomically.
//!
//! The bytes are written to a new file in the same folder, which is renamed to the target once all of them are on disk.
//! A full disk, a signal or a loss of power leaves the old file in place; at worst a `.dermis-…` file stays behind.
//!
//! | | |
//! |---|---|
//! | in: path | an existing or new file in an existing folder; links are followed |
//! | in: bytes | the whole content of the file |
//! | errors | [`FileError`] with the path and the error of the operating system |
//!
//! A path that is no regular file, such as a pipe or `/dev/stdout`, is written to directly: it has no old content to
//! keep.

use std::fs::{self, File, Permissions};
use std::io::{Error, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// Permissions of a new file before the process's mask.
const NEW_FILE: u32 = 0o666;

/// A file or folder could not be read or written; a failed write leaves its old content.
#[derive(Debug, Error)]
#[error("{}: {source}", path.display())]
pub struct FileError {
    /// The file or folder.
    pub path: PathBuf,
    /// Error of the operating system.
    pub source: Error,
}

impl FileError {
    /// Converts an error of the operating system on `path`, for `map_err`.
    pub fn at(path: &Path) -> impl FnOnce(Error) -> FileError + '_ {
        |source| FileError { path: path.to_owned(), source }
    }
}

/// Replaces the file at `path` by `bytes`, atomically.
///
/// # Errors
/// [`FileError`] if the file cannot be written.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    replace(path, |file| file.write_all(bytes))
}

/// Replaces the file at `path` by what `fill` writes into an empty one, atomically.
///
/// # Errors
/// [`FileError`] if the file cannot be written, or with the error of `fill`.
pub fn replace(path: &Path, fill: impl FnOnce(&mut File) -> Result<(), Error>) -> Result<(), FileError> {
    replace_file(path, fill).map_err(FileError::at(path))
}

fn replace_file(path: &Path, fill: impl FnOnce(&mut File) -> Result<(), Error>) -> Result<(), Error> {
    // A symbolic link is kept and its target replaced.
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    if fs::metadata(&target).is_ok_and(|found| !found.is_file() && !found.is_dir()) {
        return fill(&mut File::options().write(true).open(&target)?);
    }
    let folder = match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    // A missing folder is reported without the name of the temporary file.
    fs::metadata(folder)?;
    // Deleted when dropped, unless it became the target.
    let mut part = tempfile::Builder::new()
        .prefix(".dermis-")
        .permissions(Permissions::from_mode(NEW_FILE))
        .tempfile_in(folder)?;
    fill(part.as_file_mut())?;
    if let Ok(found) = fs::metadata(&target) {
        part.as_file().set_permissions(found.permissions())?;
    }
    part.as_file().sync_all()?;
    part.persist(&target)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn files_are_new_replaced_and_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("f.txt");
        for text in ["first", "second, longer", "3"] {
            write(&path, text.as_bytes()).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), text);
        }
        assert_eq!(names(folder.path()), ["f.txt"]);
    }

    #[test]
    fn links_are_followed_and_permissions_kept() {
        let folder = tempfile::tempdir().unwrap();
        let [path, link] = ["f.txt", "link"].map(|name| folder.path().join(name));
        fs::write(&path, "old").unwrap();
        fs::set_permissions(&path, Permissions::from_mode(0o640)).unwrap();
        std::os::unix::fs::symlink(&path, &link).unwrap();
        write(&link, b"new").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o640);
    }

    #[test]
    fn what_cannot_be_written_is_named_and_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let absent = folder.path().join("absent/f.txt");
        assert!(write(&absent, b"x").unwrap_err().to_string().contains("absent/f.txt: No such file"));
        // A folder of the same name.
        let taken = folder.path().join("taken");
        fs::create_dir(&taken).unwrap();
        assert!(write(&taken, b"x").is_err());
        assert_eq!(names(folder.path()), ["taken"]);
        let full = write(Path::new("/dev/full"), b"x").unwrap_err().to_string();
        assert!(full.starts_with("/dev/full: No space left on device"), "{full}");
    }
}
