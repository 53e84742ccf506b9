//! Cache: folded matrices stored on disk, so that large arrays need not compute them again.
//!
//! Nothing is stored until [`set_folder`] names a folder, which a program does but no numerical test. A file holds
//!
//! ```text
//! magic  key length  key  4 numbers  3 × (blocks  (row0  col0  rows  cols  entries column by column)…)  CRC-32
//! ```
//!
//! all little-endian, 64 bits each except magic, key and CRC. The key is the text of everything the matrices depend on,
//! with the versions of the layout and of this crate; the file's name is its CRC-32 and length. A file with another
//! key, truncated or damaged is ignored: the matrices are computed and written again.

use crate::physics::symmetry::folded::{Block, Operator};
use crate::spec::scene::{Inversion, Medium};
use crate::spec::sensor::Sensor;
use crate::write::write;
use faer::Mat;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::RwLock;

/// Version of the file's layout and of the numbers; to be raised with either.
const VERSION: u32 = 2;
const MAGIC: &[u8; 8] = b"dermisA\n";
/// Fewest taxels that are cached; for fewer, computing is as fast as reading.
const MIN_TAXELS: usize = 400;

static FOLDER: RwLock<Option<PathBuf>> = RwLock::new(None);

/// Sets the cache folder of this process; `None` disables the cache, as at the start.
pub fn set_folder(folder: Option<&Path>) {
    *FOLDER.write().unwrap_or_else(std::sync::PoisonError::into_inner) = folder.map(Path::to_owned);
}

/// The cached part of a subarray's matrices.
#[derive(Clone, Debug)]
pub(super) struct CachedMatrices {
    /// Condition, rank, gain and convergence rate r.
    pub numbers: [f64; 4],
    /// Cz⁺, Ax, Ay.
    pub operators: [Operator; 3],
}

/// The cache file of one subarray.
pub(super) struct CacheFile {
    path: PathBuf,
    key: String,
}

impl CacheFile {
    /// The file of these matrices; `None` if there is no folder or the subarray is too small.
    pub(super) fn of(sensor: &Sensor, medium: Medium, mu_max: f64, inversion: Inversion) -> Option<CacheFile> {
        let folder = FOLDER.read().ok()?.clone()?;
        (sensor.taxels() >= MIN_TAXELS).then(|| CacheFile::at(&folder, sensor, medium, mu_max, inversion))
    }

    fn at(folder: &Path, sensor: &Sensor, medium: Medium, mu_max: f64, inversion: Inversion) -> CacheFile {
        // Debug prints the shortest text that reads back as the same number.
        let version = env!("CARGO_PKG_VERSION");
        let key = format!("{VERSION} {version} {sensor:?} {medium:?} {mu_max:?} {inversion:?}");
        let path = folder.join(format!("{:08x}-{}.matrices", crc32fast::hash(key.as_bytes()), key.len()));
        CacheFile { path, key }
    }

    /// The contents of the file; `None` unless it is complete and has this key.
    pub(super) fn read(&self) -> Option<CachedMatrices> {
        let bytes = fs::read(&self.path).ok()?;
        let (content, crc) = bytes.split_at_checked(bytes.len().checked_sub(4)?)?;
        let whole = crc32fast::hash(content).to_le_bytes() == crc;
        let mut rest = Reader(content.strip_prefix(MAGIC).filter(|_| whole)?);
        let length = rest.size()?;
        if rest.take(length)? != self.key.as_bytes() {
            return None;
        }
        let numbers = [rest.number()?, rest.number()?, rest.number()?, rest.number()?];
        let operators = [rest.operator()?, rest.operator()?, rest.operator()?];
        rest.0.is_empty().then_some(CachedMatrices { numbers, operators })
    }

    /// Writes the file. A failure is no error: the next run computes the matrices again.
    pub(super) fn write(&self, cached: &CachedMatrices) {
        let mut bytes = MAGIC.to_vec();
        let size = |bytes: &mut Vec<u8>, n: usize| bytes.extend((n as u64).to_le_bytes());
        size(&mut bytes, self.key.len());
        bytes.extend(self.key.as_bytes());
        cached.numbers.iter().for_each(|number| bytes.extend(number.to_le_bytes()));
        for operator in &cached.operators {
            size(&mut bytes, operator.blocks.len());
            for Block { row0, col0, entries, .. } in &operator.blocks {
                [*row0, *col0, entries.nrows(), entries.ncols()].into_iter().for_each(|n| size(&mut bytes, n));
                entries.col_iter().for_each(|col| col.iter().for_each(|c| bytes.extend(c.to_le_bytes())));
            }
        }
        bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
        if self.path.parent().is_none_or(|folder| fs::create_dir_all(folder).is_ok()) {
            let _ = write(&self.path, &bytes);
        }
    }
}

/// The rest of a file while it is read.
struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(taken)
    }

    fn word(&mut self) -> Option<[u8; 8]> {
        self.take(8)?.try_into().ok()
    }

    fn size(&mut self) -> Option<usize> {
        usize::try_from(u64::from_le_bytes(self.word()?)).ok()
    }

    fn number(&mut self) -> Option<f64> {
        Some(f64::from_le_bytes(self.word()?))
    }

    fn operator(&mut self) -> Option<Operator> {
        let count = self.size()?;
        let block = |_| {
            let [row0, col0, rows, cols] = [self.size()?, self.size()?, self.size()?, self.size()?];
            let bytes = self.take(rows.checked_mul(cols)?.checked_mul(8)?)?;
            let at = |k: usize| f64::from_le_bytes(std::array::from_fn(|byte| bytes[8 * k + byte]));
            Some(Block::new(row0, col0, Mat::from_fn(rows, cols, |i, j| at(j * rows + i))))
        };
        Some(Operator { blocks: (0..count).map(block).collect::<Option<_>>()? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sensor() -> Sensor {
        Sensor { rows: 20, cols: 20, pitch_x_mm: 2.0, pitch_y_mm: 4.0, thickness_mm: 3.0 }
    }

    fn cached() -> CachedMatrices {
        let operator = |by: f64| Operator {
            blocks: vec![
                Block::new(0, 2, Mat::from_fn(2, 3, |i, j| by / (1 + i + 10 * j) as f64)),
                Block::new(2, 0, Mat::from_fn(1, 2, |_, j| -by * j as f64)),
            ],
        };
        CachedMatrices {
            numbers: [17.0, 400.0, 1e12, 0.1 + 0.2],
            operators: [operator(1.0), operator(0.3), operator(1e-300)],
        }
    }

    fn cache_file(folder: &Path, mu_max: f64) -> CacheFile {
        CacheFile::at(folder, &sensor(), Medium::HalfSpace, mu_max, Inversion::EXACT)
    }

    #[test]
    fn comes_back_to_the_bit() {
        let folder = tempfile::tempdir().unwrap();
        let cache_file = cache_file(folder.path(), 0.6);
        assert!(cache_file.read().is_none());
        cache_file.write(&cached());
        assert_eq!(format!("{:?}", cache_file.read().unwrap()), format!("{:?}", cached()));
        // No temporary file is left.
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn cut_short_damaged_or_of_another_scene_is_none() {
        let folder = tempfile::tempdir().unwrap();
        let first = cache_file(folder.path(), 0.6);
        first.write(&cached());
        let whole = fs::read(&first.path).unwrap();
        for length in [0, 3, 8, 20, whole.len() - 9, whole.len() - 1] {
            fs::write(&first.path, &whole[..length]).unwrap();
            assert!(first.read().is_none(), "{length} of {} bytes", whole.len());
        }
        for at in [0, 10, whole.len() / 2, whole.len() - 1] {
            let mut damaged = whole.clone();
            damaged[at] ^= 4;
            fs::write(&first.path, damaged).unwrap();
            assert!(first.read().is_none(), "byte {at}");
        }
        // The content of one scene in the file of another.
        let second = cache_file(folder.path(), 0.5);
        fs::write(&second.path, &whole).unwrap();
        assert!(second.read().is_none());
        first.write(&cached());
        assert!(first.read().is_some());
    }

    #[test]
    fn threads_that_write_the_same_do_not_disturb_each_other() {
        let folder = tempfile::tempdir().unwrap();
        let wanted = format!("{:?}", cached());
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    let cache_file = cache_file(folder.path(), 0.6);
                    for _ in 0..50 {
                        cache_file.write(&cached());
                        assert_eq!(format!("{:?}", cache_file.read().unwrap()), wanted);
                    }
                });
            }
        });
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn where_nothing_can_be_written_nothing_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "").unwrap();
        let cache_file = cache_file(&file, 0.6);
        cache_file.write(&cached());
        assert!(cache_file.read().is_none());
    }
}
