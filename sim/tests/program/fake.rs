//! Stand-ins for external tools.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

/// Puts a shell script called `name` into `folder`.
pub fn program(folder: &Path, name: &str, script: &str) {
    let path = folder.join(name);
    fs::write(&path, script).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
}
