//! Crates that the program uses have the same features as in the build of the tests, so that tests, program and Python
//! package share one compilation. Else cargo compiles them, and all that use them, once more.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

/// Lines of `cargo tree` with name, version and features of every crate that the workspace's default members have over `edges`.
fn tree(edges: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let arguments = ["tree", "--offline", "--locked", "--prefix", "none", "--no-dedupe"];
    let mut command = Command::new(env!("CARGO"));
    let output = command.current_dir(root).args(arguments).args(["-f", "{p} [{f}]", "-e", edges]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Crates of the program that the tests' build has with other features.
fn different<'a>(program: &'a str, tests: &str) -> BTreeSet<&'a str> {
    let tests: BTreeSet<&str> = tests.lines().collect();
    program.lines().filter(|line| !tests.contains(line)).collect()
}

#[test]
fn crates_of_the_program_have_the_features_of_the_tests() {
    let (program, tests) = (tree("normal,build"), tree("normal,build,dev"));
    let found = different(&program, &tests);
    assert!(found.is_empty(), "with more features in the tests; add these in Cargo.toml: {found:#?}");
    // More crates are in the tests' build: the two lists are not the same one.
    assert!(!different(&tests, &program).is_empty());
}

#[test]
fn a_feature_that_only_the_tests_have_is_found() {
    let found = different("serde v1.0.0 [std]\ntoml v1.0.0 []\n", "serde v1.0.0 [alloc,std]\ntoml v1.0.0 []\n");
    assert_eq!(Vec::from_iter(found), ["serde v1.0.0 [std]"]);
}
