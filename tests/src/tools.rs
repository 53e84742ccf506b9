//! Generated files in a folder, and Yosys on them.

use std::fs;
use std::path::Path;
use std::process::Command;

use dermis_hdl::Generated;
use tempfile::TempDir;

/// Writes all files of `generated` into `folder`.
///
/// # Panics
/// If a file cannot be written.
pub fn write_files(generated: &Generated, folder: &Path) {
    for file in &generated.files {
        fs::write(folder.join(&file.name), &file.text).unwrap_or_else(|error| panic!("{}: {error}", file.name));
    }
}

/// A new folder with all files of `generated`, deleted when dropped.
///
/// # Panics
/// If it cannot be written.
pub fn folder_of(generated: &Generated) -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    write_files(generated, folder.path());
    folder
}

/// Runs a script of Yosys in `folder`.
///
/// # Errors
/// What Yosys prints when it fails.
///
/// # Panics
/// If Yosys is not installed.
pub fn yosys(folder: &Path, script: &str) -> Result<(), String> {
    let output = Command::new("yosys").current_dir(folder).args(["-q", "-p", script]).output();
    let output = output.expect("yosys is installed (make setup)");
    output.status.success().then_some(()).ok_or_else(|| String::from_utf8_lossy(&output.stderr).into_owned())
}

/// The number of cells by type that Yosys has after `synthesis`, a command for the top module, for example
/// `synth_ecp5 -run begin:map_ffram`.
///
/// # Panics
/// If Yosys is not installed or refuses the design.
pub fn cells(generated: &Generated, synthesis: &str) -> impl Fn(&str) -> usize + use<> {
    let folder = folder_of(generated);
    let top = &generated.top;
    let script = format!("read_verilog {top}.v; {synthesis} -top {top}; tee -o stat.json stat -json");
    yosys(folder.path(), &script).unwrap_or_else(|error| panic!("{top}: {error}"));
    let text = fs::read_to_string(folder.path().join("stat.json")).expect("stat.json");
    let stat: serde_json::Value = serde_json::from_str(&text).expect("stat.json");
    let cells = stat["design"]["num_cells_by_type"].clone();
    move |cell| cells[cell].as_u64().unwrap_or(0) as usize
}
