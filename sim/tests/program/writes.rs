//! Failed and interrupted writes, and damaged generated folders.

use std::fs;
use std::path::Path;
use std::process::Command;

use tempfile::TempDir;

/// Runs the program in `folder` from a shell, after the commands `before`; returns exit code and stderr.
fn dermis(folder: &Path, before: &str, args: &str) -> (Option<i32>, String) {
    let script = format!("{before} exec {} {args}", env!("CARGO_BIN_EXE_dermis"));
    let output = Command::new("sh").args(["-c", &script]).current_dir(folder).output().unwrap();
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

/// A folder with an old frame file.
fn with_old_frame() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("f.json"), "old").unwrap();
    folder
}

const GENERATE: &str = "generate eight-by-eight --random 1 --out f.json";

#[test]
fn a_full_disk_leaves_the_old_file_and_no_other() {
    let folder = with_old_frame();
    // At most 512 bytes per file, with the signal ignored: the write returns an error.
    let (code, stderr) = dermis(folder.path(), "trap '' XFSZ; ulimit -f 1;", GENERATE);
    assert_eq!(code, Some(2), "{stderr}");
    assert!(stderr.starts_with("error: f.json: File too large"), "{stderr}");
    assert_eq!(fs::read_to_string(folder.path().join("f.json")).unwrap(), "old");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn a_killed_write_leaves_the_old_file() {
    let folder = with_old_frame();
    // The same limit with the signal: the program is killed during the write.
    let (code, _) = dermis(folder.path(), "ulimit -f 1;", GENERATE);
    assert_eq!(code, None);
    assert_eq!(fs::read_to_string(folder.path().join("f.json")).unwrap(), "old");
    // Without the limit the new file is complete.
    assert_eq!(dermis(folder.path(), "", GENERATE).0, Some(0));
    let text = fs::read_to_string(folder.path().join("f.json")).unwrap();
    assert!(serde_json::from_str::<serde_json::Value>(&text).is_ok());
}

#[test]
fn a_damaged_folder_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let check = || dermis(folder.path(), "", "check rtl");
    let program = |args: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_dermis")).current_dir(folder.path()).args(args).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    let listed =
        program(&["build", "eight-by-eight", "--out", "rtl"]).lines().filter(|l| l.ends_with(" bytes)")).count();
    assert_eq!(check(), (Some(0), String::new()));
    let files: Vec<_> = fs::read_dir(folder.path().join("rtl")).unwrap().map(|entry| entry.unwrap().path()).collect();
    // Both commands count all files of the folder.
    assert_eq!(listed, files.len());
    assert!(program(&["check", "rtl"]).starts_with(&format!("rtl: {listed} files are as built")));
    let json: serde_json::Value = serde_json::from_str(&program(&["check", "rtl", "--json"])).unwrap();
    assert_eq!(json["files"], listed);
    for path in files {
        let whole = fs::read(&path).unwrap();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let refused = |bytes: &[u8]| {
            fs::write(&path, bytes).unwrap();
            let (code, stderr) = check();
            assert_eq!(code, Some(2), "{name}");
            assert!(stderr.contains(&format!("rtl/{name}")), "{name}: {stderr}");
        };
        for kept in [0, 1, whole.len() / 2, whole.len() - 1] {
            refused(&whole[..kept]);
        }
        // Flips one bit of the last character; the file remains text.
        let last = whole.iter().rposition(|byte| !byte.is_ascii_whitespace()).unwrap();
        let mut flipped = whole.clone();
        flipped[last] ^= 1;
        refused(&flipped);
        fs::remove_file(&path).unwrap();
        assert!(check().1.contains("cannot be read: No such file"), "{name}");
        fs::write(&path, &whole).unwrap();
    }
    assert_eq!(check(), (Some(0), String::new()));
}

#[test]
fn manifests_of_another_version_or_with_paths_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("rtl")).unwrap();
    let refuses = |text: &str, wanted: &str| {
        fs::write(folder.path().join("rtl/manifest.json"), text).unwrap();
        let (code, stderr) = dermis(folder.path(), "", "check rtl");
        assert!(code == Some(2) && stderr.contains(wanted), "{stderr}");
    };
    refuses("{\"manifest_version\": 99}\n", "manifest_version = 99 is not allowed");
    refuses("{}", "the last line has no end");
    refuses("[]\n", "not an object");
    refuses("{\"manifest_version\": 2}\n", "checksum is missing");
    let outside = concat!(
        "{\n  \"files\": {\n    \"../f\": {\n      \"bytes\": 1,\n      \"crc32\": 1\n    }\n  },\n",
        "  \"manifest_version\": 2\n}\n"
    );
    let sum = crc32fast::hash(outside.as_bytes());
    let sealed = outside.replacen('{', &format!("{{\n  \"checksum\": {sum},"), 1);
    refuses(&sealed, "files: \"../f\" is not the name of a file");
}
