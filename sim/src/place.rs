//! Place: a folder of built files appears whole or not at all.
//!
//! It is filled beside its place and takes its name only when all is in it, so that neither an interruption nor a second
//! process that builds the same leaves half a folder.

use std::fs;
use std::path::Path;

use dermis_golden::write::FileError;
use tempfile::TempDir;

/// A folder to fill, gone when it is dropped; it lies where `folder` is to be.
///
/// # Errors
/// [`FileError`]: no folder can be made there.
pub(crate) fn begin(folder: &Path) -> Result<TempDir, FileError> {
    let cache = folder.parent().unwrap_or(folder);
    fs::create_dir_all(cache).map_err(FileError::at(cache))?;
    tempfile::Builder::new().prefix("building-").tempdir_in(cache).map_err(FileError::at(cache))
}

/// Gives the filled folder its name. Where somebody else was first, which `product` in it shows, theirs serves as well.
///
/// # Errors
/// [`FileError`].
pub(crate) fn finish(filled: TempDir, folder: &Path, product: &str) -> Result<(), FileError> {
    let built = filled.keep();
    match fs::rename(&built, folder) {
        Err(_) if folder.join(product).is_file() => fs::remove_dir_all(&built).map_err(FileError::at(&built)),
        renamed => renamed.map_err(FileError::at(folder)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fill(folder: &Path, text: &str) -> Result<(), FileError> {
        let work = begin(folder)?;
        fs::write(work.path().join("product"), text).unwrap();
        finish(work, folder, "product")
    }

    #[test]
    fn the_first_stays_and_nothing_is_left_beside_it() {
        let cache = tempfile::tempdir().unwrap();
        let folder = cache.path().join("a/b");
        for text in ["first", "second"] {
            fill(&folder, text).unwrap();
            assert_eq!(fs::read_to_string(folder.join("product")).unwrap(), "first");
        }
        assert_eq!(fs::read_dir(cache.path().join("a")).unwrap().count(), 1);
    }

    #[test]
    fn what_cannot_be_built_leaves_nothing() {
        let cache = tempfile::tempdir().unwrap();
        drop(begin(&cache.path().join("b")).unwrap());
        assert_eq!(fs::read_dir(cache.path()).unwrap().count(), 0);
        fs::write(cache.path().join("file"), "").unwrap();
        assert!(fill(&cache.path().join("file/b"), "").unwrap_err().to_string().contains("file: "));
    }
}
