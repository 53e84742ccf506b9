//! The tests of the table in `tests/src/lib.rs`, but for `fuzz`, whose counting allocator and limits of time need a
//! program of their own.
//!
//! One program, so that it is linked once and its tests fill all processors to the end.

use std::fs;
use std::path::Path;

mod accuracy;
mod arrays;
mod artix;
mod bonded;
mod choice;
mod circles;
mod code_check;
mod coefficients;
mod constraints;
mod dead;
mod equality;
mod event_driven;
mod explain;
mod extreme;
mod faults;
mod features;
mod flipped_bit;
mod framing;
mod link;
mod lint;
mod microcontroller;
mod missing;
mod netlist;
mod over_time;
mod power;
mod proofs;
mod resources;
mod running_zero;
mod scale;
mod scan;
mod scenes;
mod serial;
mod streams;
mod synthesis;
mod tables;
mod versions;
mod words;

/// The compiler does not tell of a file that no `mod` names, and its tests would not run.
#[test]
fn every_file_of_tests_is_a_module() {
    for folder in ["tests/tests/integration", "sim/tests/program"] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(folder);
        let main = fs::read_to_string(folder.join("main.rs")).unwrap();
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_stem().unwrap().to_string_lossy().into_owned();
            let declared = main.lines().any(|line| line == format!("mod {name};"));
            assert!(name == "main" || declared, "{}: no `mod {name};` in main.rs", path.display());
        }
    }
}
