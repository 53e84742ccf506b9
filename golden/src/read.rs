//! Read: files of bounded size. A pipe or a device states no size, so that reading ends one byte beyond the limit.
//!
//! | | |
//! |---|---|
//! | in: path, limit | a file, bytes |
//! | out: content | `None` if the file is larger |

use std::fs::File;
use std::io::{Error, ErrorKind, Read};
use std::path::Path;

/// The bytes of a file of at most `limit` bytes.
///
/// # Errors
/// That of the operating system.
pub(crate) fn bytes_up_to(limit: u64, path: &Path) -> Result<Option<Vec<u8>>, Error> {
    let mut bytes = Vec::new();
    File::open(path)?.take(limit + 1).read_to_end(&mut bytes)?;
    Ok(Some(bytes).filter(|bytes| bytes.len() as u64 <= limit))
}

/// The text of a file of at most `limit` bytes.
///
/// # Errors
/// That of the operating system; [`ErrorKind::InvalidData`] for bytes that are no UTF-8.
pub(crate) fn text_up_to(limit: u64, path: &Path) -> Result<Option<String>, Error> {
    let text = |bytes| String::from_utf8(bytes).map_err(|error| Error::new(ErrorKind::InvalidData, error));
    bytes_up_to(limit, path)?.map(text).transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_up_to_its_limit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        std::fs::write(&path, "12345678").unwrap();
        assert_eq!(text_up_to(8, &path).unwrap().as_deref(), Some("12345678"));
        assert_eq!(text_up_to(7, &path).unwrap(), None);
        // A device without an end.
        assert_eq!(bytes_up_to(1000, Path::new("/dev/zero")).unwrap(), None);
        std::fs::write(&path, [0xff]).unwrap();
        assert_eq!(text_up_to(8, &path).unwrap_err().kind(), ErrorKind::InvalidData);
        assert_eq!(bytes_up_to(8, &folder.path().join("none")).unwrap_err().kind(), ErrorKind::NotFound);
    }
}
