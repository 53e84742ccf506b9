//! The JSON output: names and order of fields, and `null` for missing values.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// Stdout of a run that must succeed; the Verilator cache is shared with the other tests.
fn dermis(args: &[&str]) -> String {
    let build = Path::new(env!("CARGO_MANIFEST_DIR")).join("../build");
    let output = Command::new(env!("CARGO_BIN_EXE_dermis")).args(args).arg("--build-dir").arg(build).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Names of the fields at a nesting depth, in the order of the text.
fn fields(text: &str, nesting: usize) -> Vec<String> {
    let (mut depth, mut names, mut rest) = (0usize, Vec::new(), text);
    while let Some(at) = rest.find(['{', '}', '"']) {
        let (mark, after) = (rest.as_bytes()[at], &rest[at + 1..]);
        rest = after;
        match mark {
            b'{' => depth += 1,
            b'}' => depth -= 1,
            _ => {
                let end = after.find('"').unwrap();
                rest = &after[end + 1..];
                if depth == nesting && rest.starts_with(':') {
                    names.push(after[..end].to_owned());
                }
            }
        }
    }
    names
}

/// The text between two markers.
fn between<'a>(text: &'a str, start: &str, end: &str) -> &'a str {
    text.split_once(start).unwrap().1.split_once(end).unwrap().0
}

#[test]
fn reconstruct() {
    for engine in ["golden", "fixed", "rtl"] {
        let text = dermis(&["reconstruct", "eight-by-eight", "--engine", engine, "--json"]);
        let mut top = vec![
            "scene",
            "frame",
            "engine",
            "case",
            "subarrays",
            "resultant_N",
            "forces_N",
            "error",
            "flags",
            "checks",
        ];
        // The search tells no contacts apart.
        top.extend((engine == "golden").then_some("contacts"));
        top.push("wrench");
        assert_eq!(fields(&text, 1), top);
        assert_eq!(fields(between(&text, "\"wrench\":", "}"), 1), ["force_N", "moment_Nmm"]);
        let value: Value = serde_json::from_str(&text).unwrap();
        assert_eq!((&value["scene"], &value["engine"]), (&"eight-by-eight".into(), &engine.into()));
        for axis in ["fx", "fy", "fz"] {
            assert_eq!(value["forces_N"][axis].as_array().unwrap().len(), 64);
        }
        let subarray = [
            "row0",
            "col0",
            "rows",
            "cols",
            "centroid_condition",
            "compression_centroid_mm",
            "tension_centroid_mm",
            "mu",
            "objective_value",
        ];
        // Read from the text, as a parsed object does not keep the order.
        assert_eq!(fields(between(&text, "\"subarrays\":[", "],\"resultant_N\""), 1), subarray);
        let error = ["x1", "x2", "x3", "tangential", "normal"];
        assert_eq!(fields(between(&text, "\"error\":", ",\"flags\""), 1), error);
        assert_eq!(fields(between(&text, "\"forces_N\":", ",\"error\""), 1), ["fx", "fy", "fz"]);
        assert_eq!(fields(between(&text, "\"case\":", ",\"subarrays\""), 1), ["rows", "cols"]);
    }
}

#[test]
fn reconstruct_without_reference_has_null_errors() {
    let text = dermis(&["reconstruct", "sensor-1", "--frame", "eq2", "--json"]);
    let value: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(value["error"], Value::Null);
}

#[test]
fn cosim() {
    let text = dermis(&["cosim", "eight-by-eight", "--frame", "eq2", "--json"]);
    let top = [
        "scene",
        "frames",
        "equal",
        "mismatches",
        "cycles",
        "total_cycles",
        "frame_interval",
        "planned_interval",
        "clock_MHz",
        "time_us",
        "budget_us",
    ];
    assert_eq!(fields(&text, 1), top);
    assert_eq!(fields(&text, 2), ["min", "median", "max", "min", "median", "max", "median", "max"]);
    let value: Value = serde_json::from_str(&text).unwrap();
    assert_eq!((&value["equal"], &value["frames"]), (&true.into(), &1.into()));
    let cycles = value["total_cycles"]["max"].as_u64().unwrap() as f64;
    assert_eq!(value["time_us"]["max"].as_f64().unwrap(), cycles / value["clock_MHz"].as_f64().unwrap());
}
