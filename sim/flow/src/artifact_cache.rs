//! Cache of built folders: a folder appears complete or not at all.
//!
//! It is built in a staging folder beside its final path and renamed when complete, so that neither an interruption nor
//! a second process that builds the same folder leaves a partial one. A [`lock`] saves the second one from building it
//! again.
//!
//! What is in the cache is loaded into the program, so that a folder that came with somebody's project must not be taken
//! for one that was built here. Name and product are marked with BLAKE3 under a key of this user, which stands outside the cache, in
//! `$XDG_STATE_HOME/dermis/build.key` (without that variable below `~/.local/state`). A product that was built elsewhere, for other
//! sources, or was damaged or replaced since, has another mark and is built again. Where no key can be stored, each run of the
//! program has its own.

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use blake3::Hasher;
use dermis_golden::write::{write, FileError};
use tempfile::TempDir;

/// Exclusive lock on `folder`, released when the value is dropped. Another thread or process that locks the same folder
/// blocks until then.
///
/// # Errors
/// [`FileError`]: the lock, a file beside the folder, cannot be created.
pub fn lock(folder: &Path) -> Result<File, FileError> {
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
pub fn staging_folder(folder: &Path) -> Result<TempDir, FileError> {
    let cache = folder.parent().unwrap_or(folder);
    fs::create_dir_all(cache).map_err(FileError::at(cache))?;
    tempfile::Builder::new().prefix("building-").tempdir_in(cache).map_err(FileError::at(cache))
}

/// Renames the staging folder to `folder` and records the mark of `product`. If another process has published an
/// intact `folder` meanwhile, that one is kept.
///
/// # Errors
/// [`FileError`].
pub fn publish(staging: TempDir, folder: &Path, product: &str) -> Result<(), FileError> {
    let path = staging.path().join(product);
    let own = mark(key(), folder, &path).map_err(FileError::at(&path))?;
    write(&mark_path(staging.path(), product), own.as_bytes())?;
    if folder.exists() && !is_intact(folder, product) {
        fs::remove_dir_all(folder).map_err(FileError::at(folder))?;
    }
    let built = staging.keep();
    match fs::rename(&built, folder) {
        Err(_) if is_intact(folder, product) => fs::remove_dir_all(&built).map_err(FileError::at(&built)),
        renamed => renamed.map_err(FileError::at(folder)),
    }
}

/// Whether `product` exists in `folder` and was built for it by this user.
pub fn is_intact(folder: &Path, product: &str) -> bool {
    let recorded = fs::read_to_string(mark_path(folder, product));
    matches!((recorded, mark(key(), folder, &folder.join(product))), (Ok(recorded), Ok(found)) if recorded == found)
}

fn mark_path(folder: &Path, product: &str) -> PathBuf {
    folder.join(format!("{product}.mark"))
}

/// The mark of a product at `path` that was built for `folder`.
fn mark(key: &Key, folder: &Path, path: &Path) -> io::Result<String> {
    let mut hasher = Hasher::new_keyed(key);
    hasher.update(folder.file_name().unwrap_or_default().as_encoded_bytes());
    hasher.update(&[0]);
    hasher.update(&fs::read(path)?);
    Ok(format!("{}\n", hasher.finalize().to_hex()))
}

/// Name of the folder of what is made from these names and texts with that version of a tool: 128 bits in hexadecimal,
/// another one for each user.
pub fn fingerprint(sources: &[(&str, &str)], version: &str) -> String {
    let mut hasher = Hasher::new_keyed(key());
    let mut add = |text: &str| {
        // The length distinguishes ("ab", "c") from ("a", "bc").
        hasher.update(&(text.len() as u64).to_le_bytes());
        hasher.update(text.as_bytes());
    };
    add(version);
    for (name, text) in sources {
        add(name);
        add(text);
    }
    hasher.finalize().to_hex().chars().take(32).collect()
}

/// A key of BLAKE3.
type Key = [u8; blake3::KEY_LEN];

/// The user's key; that of this run where none can be stored.
fn key() -> &'static Key {
    static KEY: OnceLock<Key> = OnceLock::new();
    KEY.get_or_init(|| {
        let state = std::env::var_os("XDG_STATE_HOME").map(PathBuf::from).filter(|path| path.is_absolute());
        let state = state.or_else(|| Some(std::env::home_dir()?.join(".local/state")));
        state.and_then(|state| stored_key(&state.join("dermis")).ok()).unwrap_or_else(random_key)
    })
}

/// The key in a folder, made there if there is none.
fn stored_key(folder: &Path) -> io::Result<Key> {
    let path = folder.join("build.key");
    let read = || fs::read(&path)?.try_into().map_err(|_| io::Error::from(io::ErrorKind::InvalidData));
    if !path.exists() {
        fs::create_dir_all(folder)?;
        // For this user's eyes alone; it appears whole, and one process's key is everybody's.
        let mut file = tempfile::NamedTempFile::new_in(folder)?;
        file.write_all(&random_key())?;
        if let Err(error) = file.persist_noclobber(&path) {
            return read().map_err(|_| error.error);
        }
    }
    read()
}

/// 256 bits of the operating system's generator.
fn random_key() -> Key {
    let mut key = Key::default();
    let system = File::open("/dev/urandom").and_then(|mut source| source.read_exact(&mut key));
    if system.is_err() {
        // Nobody else's either: of this run, and not stored.
        fastrand::fill(&mut key);
    }
    key
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

    #[test]
    fn what_others_built_or_moved_is_not_taken() {
        let cache = tempfile::tempdir().unwrap();
        let folder = cache.path().join("c");
        fill(&folder, "own").unwrap();
        let (product, recorded) = (folder.join("product"), mark_path(&folder, "product"));
        let own = fs::read_to_string(&recorded).unwrap();
        // With every mark that somebody without the key can make.
        fs::write(&product, "foreign").unwrap();
        let bare = blake3::hash(b"foreign").to_hex().to_string() + "\n";
        for foreign in [own.clone(), bare, mark(&[7; 32], &folder, &product).unwrap(), String::new()] {
            fs::write(&recorded, foreign).unwrap();
            assert!(!is_intact(&folder, "product"));
        }
        // A product of other sources with its own mark.
        fs::write(&product, "own").unwrap();
        fs::write(&recorded, &own).unwrap();
        assert!(is_intact(&folder, "product"));
        fs::rename(&folder, cache.path().join("d")).unwrap();
        assert!(!is_intact(&cache.path().join("d"), "product"));
    }

    #[test]
    fn a_key_is_made_once_and_a_damaged_one_is_not_used() {
        use std::os::unix::fs::PermissionsExt;
        let state = tempfile::tempdir().unwrap();
        let folder = state.path().join("dermis");
        let keys: Vec<Key> = std::thread::scope(|scope| {
            let all: Vec<_> = (0..8).map(|_| scope.spawn(|| stored_key(&folder).unwrap())).collect();
            all.into_iter().map(|made| made.join().unwrap()).collect()
        });
        assert!(keys.iter().all(|key| *key == keys[0] && *key != Key::default()), "{keys:?}");
        let path = folder.join("build.key");
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o077, 0);
        fs::write(&path, "short").unwrap();
        assert!(stored_key(&folder).is_err());
    }

    #[test]
    fn names_of_sources_tell_them_apart() {
        let of = |sources: &[(&str, &str)], version| fingerprint(sources, version);
        let all = [of(&[("a", "bc")], "1"), of(&[("ab", "c")], "1"), of(&[("a", "bc")], "2"), of(&[], "1")];
        assert!((0..4).all(|k| all[k].len() == 32 && all[..k].iter().all(|other| *other != all[k])), "{all:?}");
        assert_eq!(all[0], of(&[("a", "bc")], "1"));
    }
}
