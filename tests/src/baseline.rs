//! Committed figures that tests compare with: `tests/baselines/NAME.csv`, one figure a line.
//!
//! | column | holds |
//! |---|---|
//! | `figure` | name without commas; `measured on` for the compiler and processor of the last renewal |
//! | `value` | the figure |
//!
//! With `DERMIS_ACCEPT` set, a test writes its figures and prints the old ones and the new ones.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::sync::{Mutex, PoisonError};

/// Line with compiler and processor.
const ORIGIN: &str = "measured on";
/// First line of a file.
const HEAD: &str = "figure,value";

/// The file `tests/baselines/<name>.csv`.
fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("baselines").join(format!("{name}.csv"))
}

/// The committed figures as text, by name.
fn committed(name: &str) -> BTreeMap<String, String> {
    let text = fs::read_to_string(path(name)).unwrap_or_default();
    let lines = text.lines().skip(1).filter_map(|line| line.split_once(','));
    lines.map(|(figure, value)| (figure.to_owned(), value.to_owned())).collect()
}

/// A figure as it is committed.
fn shown(value: f64) -> String {
    ((1e4 * value).round() / 1e4).to_string()
}

/// Old and new value of a figure.
fn change((figure, value): &(String, f64), was: Option<&String>) -> String {
    format!("{figure}: {} -> {}", was.map_or("none", String::as_str), shown(*value))
}

/// The measured figures that `tests/baselines/<name>.csv` lacks or that are not met, with old and new value. `is_met` gets
/// the committed figure, the measured one, and whether both come from the same compiler and processor.
pub fn missed(name: &str, measured: &[(String, f64)], is_met: impl Fn(f64, f64, bool) -> bool) -> Vec<String> {
    let all = committed(name);
    let same = all.get(ORIGIN) == Some(&origin());
    let met = |(figure, value): &&(String, f64)| {
        let was = all.get(figure).and_then(|was| was.parse().ok());
        was.is_some_and(|was| is_met(was, shown(*value).parse().unwrap_or(f64::NAN), same))
    };
    measured.iter().filter(|own| !met(own)).map(|own| change(own, all.get(&own.0))).collect()
}

/// Asserts that no figure of a test is [`missed`]; with `DERMIS_ACCEPT` set writes them instead.
///
/// # Panics
/// If a figure is missed, with all of these.
pub fn check(name: &str, measured: &[(String, f64)], is_met: impl Fn(f64, f64, bool) -> bool) {
    // Tests of one program that share a file may run at the same time.
    static RENEWING: Mutex<()> = Mutex::new(());
    let _one = RENEWING.lock().unwrap_or_else(PoisonError::into_inner);
    if std::env::var_os("DERMIS_ACCEPT").is_some() {
        let mut all = committed(name);
        for own in measured {
            println!("{}", change(own, all.get(&own.0)));
            all.insert(own.0.clone(), shown(own.1));
        }
        all.insert(ORIGIN.to_owned(), origin());
        let lines: String = all.iter().map(|(figure, value)| format!("{figure},{value}\n")).collect();
        return fs::write(path(name), format!("{HEAD}\n{lines}")).unwrap_or_else(|error| panic!("{name}.csv: {error}"));
    }
    let missed = missed(name, measured, is_met).join("\n");
    assert!(missed.is_empty(), "tests/baselines/{name}.csv; DERMIS_ACCEPT=1 writes it anew\n{missed}");
}

/// Compiler and processor, without commas.
fn origin() -> String {
    let compiler = Command::new("rustc").arg("-V").output().map(|output| output.stdout).unwrap_or_default();
    let info = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let processor = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    let processor = processor.map_or("an unnamed processor", |(_, name)| name.trim());
    format!("{}; {processor}", String::from_utf8_lossy(&compiler).trim()).replace(',', ";")
}
