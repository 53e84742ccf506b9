//! A scene with several contacts: in words, in hardware, and its program.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

const PAD: &str = "[sensor]\nrows = 9\ncols = 12\npitch_x_mm = 2\npitch_y_mm = 2\nthickness_mm = 2\n\
                   [partition]\ncase = \"contacts\"\nmax_contacts = 2\n\
                   [search]\nestimator = \"evidence+network\"\nnetwork = \"pad.network\"\n";

/// Runs the command in a folder: exit code, standard output, standard error.
fn run(folder: &Path, args: &[&str]) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_dermis")).args(args).current_dir(folder).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

#[test]
fn contacts_are_reconstructed_in_words_and_in_hardware() {
    let work = tempfile::tempdir().unwrap();
    let folder = work.path();
    fs::write(folder.join("pad.toml"), PAD).unwrap();
    let small = ["--steps", "20", "--contacts", "60", "--hidden", "12,6", "--draws", "4", "--out", "pad.network"];
    let (code, _, error) = run(folder, &[&["train", "pad.toml"][..], &small].concat());
    // A training as short may be no better than no shear, which is code 1; the network is there.
    assert!(code <= Some(1) && folder.join("pad.network").is_file(), "{error}");
    let generate =
        ["generate", "pad.toml", "--contact", "hertz-circle:at=-6,0:size=2:normal=3:shear=0.6,0", "--contact"];
    let other = ["hertz-circle:at=6,1:size=2:normal=5:shear=0,-1", "--out", "f.json"];
    let (code, _, error) = run(folder, &[&generate[..], &other].concat());
    assert_eq!(code, Some(0), "{error}");

    let reconstruct = ["reconstruct", "pad.toml", "--frame", "f.json", "--engine", "fixed", "--json"];
    let (code, text, error) = run(folder, &reconstruct);
    assert_eq!(code, Some(0), "{error}");
    let result: Value = serde_json::from_str(&text).unwrap();
    let regions = result["regions"].as_array().unwrap();
    assert_eq!(regions.len(), 2);
    // The contact with the larger load comes first.
    let normal = |region: &Value| region["load_N"][2].as_f64().unwrap();
    assert!(normal(&regions[0]) > normal(&regions[1]) && normal(&regions[1]) > 2.0, "{regions:?}");

    let (code, text, error) = run(folder, &["check", "pad.toml", "--draws", "2"]);
    assert_eq!(code, Some(0), "{error}");
    assert!(text.contains("within the budget of 1000 µs"), "{text}");
    let (code, text, error) = run(folder, &["cosim", "pad.toml", "--frame", "f.json", "--device", "kernel"]);
    assert_eq!(code, Some(0), "{error}");
    assert!(text.contains("equal to the bit-true model to the bit"), "{text}");
    let (code, text, error) = run(folder, &["build", "pad.toml", "--explain", "--out", "rtl"]);
    assert_eq!(code, Some(0), "{error}");
    for line in
        ["contacts: a μ for each of 2 at most", "| each contact       | weights 1", "| each step of relax | −Ax"]
    {
        assert!(text.contains(line), "{line}: {text}");
    }
    let manifest: Value = serde_json::from_str(&fs::read_to_string(folder.join("rtl/manifest.json")).unwrap()).unwrap();
    let sections: Vec<&str> =
        manifest["program"].as_array().unwrap().iter().map(|own| own["section"].as_str().unwrap()).collect();
    let mut different = sections.clone();
    different.dedup();
    assert_eq!(different, ["first", "each contact", "each step of relax"]);
}
