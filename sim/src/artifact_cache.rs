//! Cache of built folders: a folder appears complete or not at all.
//!
//! It is built in a staging folder beside its final path and renamed when complete, so that neither an interruption nor
//! a second process that builds the same folder leaves a partial one. A [`lock`] saves the second one from building it
//! again. The product's CRC-32 is stored next to it: a product that has been damaged since does not match and is built
//! again.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use dermis_golden::write::{write, FileError};
use tempfile::TempDir;

/// Exclusive lock on `folder`, released when the value is dropped. Another thread or process that locks the same folder
/// blocks until then.
///
/// # Errors
/// [`FileError`]: the lock, a file beside the folder, cannot be created.
pub(crate) fn lock(folder: &Path) -> Result<File, FileError> {
    let path = folder.with_extension("lock");
    let cache = folder.parent().unwrap_or(folder);
    fs::create_dir_all(cache).map_err(FileError::at(cache))?;
    let lock = File::create(&path).map_err(FileError::at(&path))?;
    lock.lock().map_err(FileError::at(&path))?;
    Ok(lock)
}

/// A temporary folder beside `folder` to build in, deleted when dropped.
///
/// # Errors
/// [`FileError`]: the folder cannot be created.
pub(crate) fn staging_folder(folder: &Path) -> Result<TempDir, FileError> {
    let cache = folder.parent().unwrap_or(folder);
    fs::create_dir_all(cache).map_err(FileError::at(cache))?;
    tempfile::Builder::new().prefix("building-").tempdir_in(cache).map_err(FileError::at(cache))
}

/// Renames the staging folder to `folder` and records the checksum of `product`. If another process has published an
/// intact `folder` meanwhile, that one is kept.
///
/// # Errors
/// [`FileError`].
pub(crate) fn publish(staging: TempDir, folder: &Path, product: &str) -> Result<(), FileError> {
    let path = staging.path().join(product);
    let own = checksum(&path).map_err(FileError::at(&path))?;
    write(&checksum_path(staging.path(), product), own.as_bytes())?;
    if folder.exists() && !is_intact(folder, product) {
        fs::remove_dir_all(folder).map_err(FileError::at(folder))?;
    }
    let built = staging.keep();
    match fs::rename(&built, folder) {
        Err(_) if is_intact(folder, product) => fs::remove_dir_all(&built).map_err(FileError::at(&built)),
        renamed => renamed.map_err(FileError::at(folder)),
    }
}

/// Whether `product` exists in `folder` and matches its recorded checksum.
pub(crate) fn is_intact(folder: &Path, product: &str) -> bool {
    let recorded = fs::read_to_string(checksum_path(folder, product));
    matches!((recorded, checksum(&folder.join(product))), (Ok(recorded), Ok(found)) if recorded == found)
}

fn checksum_path(folder: &Path, product: &str) -> PathBuf {
    folder.join(format!("{product}.crc32"))
}

fn checksum(path: &Path) -> io::Result<String> {
    Ok(format!("{:08x}\n", crc32fast::hash(&fs::read(path)?)))
}

/// FNV-1a of all names, texts and the tool's version, 128 bits in hexadecimal.
pub(crate) fn fingerprint(sources: &[(&str, &str)], version: &str) -> String {
    const OFFSET: u128 = 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d;
    const PRIME: u128 = 0x0000_0000_0100_0000_0000_0000_0000_013b;
    let mut hash = OFFSET;
    let mut add = |text: &str| {
        // The terminating zero distinguishes ("ab", "c") from ("a", "bc").
        for byte in text.bytes().chain([0]) {
            hash = (hash ^ u128::from(byte)).wrapping_mul(PRIME);
        }
    };
    add(version);
    for (name, text) in sources {
        add(name);
        add(text);
    }
    format!("{hash:032x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fill(folder: &Path, text: &str) -> Result<(), FileError> {
        let work = staging_folder(folder)?;
        fs::write(work.path().join("product"), text).unwrap();
        publish(work, folder, "product")
    }

    #[test]
    fn the_first_folder_is_kept_and_no_staging_folder_remains() {
        let cache = tempfile::tempdir().unwrap();
        let folder = cache.path().join("a/b");
        for text in ["first", "second"] {
            fill(&folder, text).unwrap();
            assert_eq!(fs::read_to_string(folder.join("product")).unwrap(), "first");
        }
        assert_eq!(fs::read_dir(cache.path().join("a")).unwrap().count(), 1);
    }

    #[test]
    fn a_damaged_product_is_not_intact_and_is_replaced() {
        let cache = tempfile::tempdir().unwrap();
        let folder = cache.path().join("b");
        assert!(!is_intact(&folder, "product"));
        fill(&folder, "first").unwrap();
        assert!(is_intact(&folder, "product"));
        for damaged in ["firsT", "fir", ""] {
            fs::write(folder.join("product"), damaged).unwrap();
            assert!(!is_intact(&folder, "product"), "{damaged:?}");
        }
        fill(&folder, "second").unwrap();
        assert_eq!(fs::read_to_string(folder.join("product")).unwrap(), "second");
        assert!(is_intact(&folder, "product"));
    }

    #[test]
    fn a_failed_build_leaves_no_folder() {
        let cache = tempfile::tempdir().unwrap();
        drop(staging_folder(&cache.path().join("b")).unwrap());
        assert_eq!(fs::read_dir(cache.path()).unwrap().count(), 0);
        fs::write(cache.path().join("file"), "").unwrap();
        assert!(fill(&cache.path().join("file/b"), "").unwrap_err().to_string().contains("file: "));
    }
}
