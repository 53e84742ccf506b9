//! Where the files of a board are: built into the program, or in a folder.

use crate::read::text_up_to;
use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};

use include_dir::{include_dir, Dir};

static BUILT_IN: Dir = include_dir!("$CARGO_MANIFEST_DIR/../constraints");
/// The folder that is built in, relative to the repository's root.
const CONSTRAINTS: &str = "constraints";
/// Largest file in bytes.
const LARGEST_FILE: u64 = 1 << 20;

/// A folder with the files of a board.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) enum Folder {
    /// `constraints`, as it was when this program was built.
    #[default]
    BuiltIn,
    /// A folder of the user.
    At(PathBuf),
}

impl Folder {
    /// Its path; of the built-in one relative to the repository's root.
    pub fn path(&self) -> &Path {
        match self {
            Folder::BuiltIn => Path::new(CONSTRAINTS),
            Folder::At(path) => path,
        }
    }

    /// The text of the file `name`.
    pub fn read(&self, name: &str) -> Result<String, Error> {
        match self {
            Folder::BuiltIn => {
                let file = BUILT_IN.get_file(name).ok_or(ErrorKind::NotFound)?;
                Ok(file.contents_utf8().ok_or(ErrorKind::InvalidData)?.to_owned())
            }
            Folder::At(path) => {
                let too_large = || Error::other(format!("over {LARGEST_FILE} bytes, too large for a file of a board"));
                text_up_to(LARGEST_FILE, &path.join(name))?.ok_or_else(too_large)
            }
        }
    }
}

/// Names of the built-in boards, sorted.
pub(super) fn built_in_names() -> Vec<&'static str> {
    let stems = BUILT_IN.files().filter(|file| file.path().extension().is_some_and(|ending| ending == "toml"));
    let mut names: Vec<_> = stems.filter_map(|file| file.path().file_stem()?.to_str()).collect();
    names.sort_unstable();
    names
}
