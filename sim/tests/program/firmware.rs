//! The firmware in the guide, compiled for this computer with pins that are simulated: from its lines to a calibration and forces.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;

/// What Arduino's environment gives a program, over a mat whose conductance is proportional to the pressure: that of argument 1, on all
/// taxels, or on the four in the middle if there is a second argument.
const ENVIRONMENT: &str = r#"
#include <cstdio>
#include <cstdlib>
enum { INPUT, OUTPUT, LOW = 0, HIGH = 1 };
static int level[64];
static double pressure;
static bool middle;
static int analogRead(int pin);
static void pinMode(int, int) {}
static void digitalWrite(int pin, int value) { level[pin] = value; }
static void delayMicroseconds(int) {}
static struct {
    void begin(long) {}
    void print(long value) { printf("%ld", value); }
    void print(char value) { putchar(value); }
} Serial;
#include "sketch.h"
static int analogRead(int pin) {
    double current = 0;
    for (int row = 0; row < ROWS; row++)
        for (int col = 0; col < COLS; col++)
            if (level[ROW_PINS[row]] && COL_PINS[col] == pin && (!middle || (row % 3 && col % 3)))
                current += pressure * (20 + row + 2 * col);
    return int(FULL * current / (1 + current));
}
int main(int count, char **arguments) {
    pressure = atof(arguments[1]);
    middle = count > 2;
    setup();
    for (int frame = 0; frame < 10; frame++) loop();
}
"#;

/// Runs a program in a folder; it must succeed.
fn run(folder: &Path, program: &str, arguments: &[&str], input: &[u8]) -> Output {
    let mut command = Command::new(program);
    command.current_dir(folder).args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    child.stdin.take().unwrap().write_all(input).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{program} {arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

#[test]
fn the_firmware_of_the_guide_gives_lines_that_are_calibrated_and_read() {
    let page = include_str!("../../../docs/your-sensor.md");
    let sketch = page.split("```cpp\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("sketch.h"), sketch).unwrap();
    fs::write(folder.join("mat.cpp"), ENVIRONMENT).unwrap();
    run(folder, "g++", &["-Wall", "-Wextra", "-Werror", "-o", "mat", "mat.cpp"], b"");
    let mat = folder.join("mat").display().to_string();
    // The commands of the page, with files in place of the port.
    let dermis = env!("CARGO_BIN_EXE_dermis");
    let new = "new mat.toml --rows 4 --cols 4 --pitch 10 --thickness 3 --tension no";
    assert!(page.contains(&format!("dermis {new}\n")));
    run(folder, dermis, &new.split(' ').collect::<Vec<_>>(), b"");
    for (name, pressure) in [("zero.csv", "0"), ("half.csv", "0.02"), ("full.csv", "0.04")] {
        fs::write(folder.join(name), run(folder, &mat, &[pressure], b"").stdout).unwrap();
    }
    let calibrate = "calibrate mat.toml --load 0=zero.csv --load 0.02=half.csv --load 0.04=full.csv --out mat.csv";
    assert!(page.contains(&format!("dermis {calibrate}\n")));
    let printed = run(folder, dermis, &calibrate.split(' ').collect::<Vec<_>>(), b"").stdout;
    // Conductance is a straight line of the pressure; the code alone would be off by a tenth.
    let printed = String::from_utf8(printed).unwrap();
    assert!(!printed.contains("curved"), "{printed}");
    let pressed = run(folder, &mat, &["0.03", "middle"], b"").stdout;
    let answers = run(folder, dermis, &["reconstruct", "mat.toml", "--stream", "--engine", "golden"], &pressed).stdout;
    let answers: Vec<Value> =
        answers.split(|byte| *byte == b'\n').filter_map(|line| serde_json::from_slice(line).ok()).collect();
    assert_eq!(answers.len(), 10);
    // 0.03 MPa on four taxels of 100 mm².
    let normal = answers[9]["resultant_N"][2].as_f64().unwrap();
    assert!((normal / 12.0 - 1.0).abs() < 0.25, "{normal}");
}
