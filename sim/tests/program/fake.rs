//! Stand-ins for external tools.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

/// nextpnr, which reaches `reached_MHz` of the required clock and writes an empty configuration.
pub fn nextpnr(reached_MHz: f64, required_MHz: f64) -> String {
    format!(
        r#"#!/bin/sh
[ "$1" = --version ] && echo 'nextpnr 0.0' && exit
while [ $# -gt 0 ]; do
  case $1 in --report) report=$2;; --asc) configuration=$2;; esac
  shift
done
: > "$configuration"
echo '{{"fmax": {{"clk": {{"achieved": {reached_MHz}, "constraint": {required_MHz}}}}}, "utilization": {{}}}}' > "$report"
"#
    )
}

/// PATH with the folder `tools` first.
pub fn path(tools: &Path) -> String {
    format!("{}:{}", tools.display(), std::env::var("PATH").unwrap())
}

/// Puts a shell script called `name` into `folder`.
pub fn program(folder: &Path, name: &str, script: &str) {
    let path = folder.join(name);
    fs::write(&path, script).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
}
