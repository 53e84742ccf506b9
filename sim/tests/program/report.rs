//! The report's files: all formats agree, times are cycles divided by the clock, and an interruption keeps earlier
//! files.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use dermis_golden::fixed::{Cycles, Model};
use dermis_golden::spec::scene::Scene;
use serde_json::Value;

fn dermis(work: &Path, args: &[&str]) -> Command {
    // The Verilator cache is shared with the other tests.
    let build = Path::new(env!("CARGO_MANIFEST_DIR")).join("../build");
    let mut command = Command::new(env!("CARGO_BIN_EXE_dermis"));
    command.current_dir(work).args(args).arg("--build-dir").arg(build);
    command
}

/// Column headers and rows of the table with an id.
fn table<'a>(report: &'a Value, id: &str) -> (Vec<&'a str>, &'a Vec<Value>) {
    let items = report["sections"].as_array().unwrap().iter().flat_map(|section| section["items"].as_array().unwrap());
    let table = items.filter(|item| item["table"] == id).collect::<Vec<_>>();
    assert_eq!(table.len(), 1, "{id}");
    let head = table[0]["head"].as_array().unwrap().iter().map(|head| head.as_str().unwrap()).collect();
    (head, table[0]["rows"].as_array().unwrap())
}

/// Number of rows with one contact and with several.
fn row_counts(rows: &[Value], column: usize) -> [usize; 2] {
    ["one", "several"].map(|count| rows.iter().filter(|row| row[column] == count).count())
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut all: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    all.sort();
    all
}

#[test]
fn all_formats_agree() {
    let work = tempfile::tempdir().unwrap();
    let out = work.path().join("out");
    fs::create_dir_all(out.join("report-tables")).unwrap();
    fs::write(out.join("report-tables/of-an-earlier-run.csv"), "").unwrap();
    let output = dermis(work.path(), &["report", "eight-by-eight", "--quick", "--out", "out"]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(String::from_utf8(output.stdout).unwrap(), "out/report.html\n");
    let report: Value = serde_json::from_str(&fs::read_to_string(out.join("report.json")).unwrap()).unwrap();
    let markdown = fs::read_to_string(out.join("report.md")).unwrap();
    let page = fs::read_to_string(out.join("report.html")).unwrap();

    // The page begins with error against noise beside error against run time.
    let first = &report["sections"][0];
    let names: Vec<&str> = first["items"].as_array().unwrap().iter().filter_map(|item| item["file"].as_str()).collect();
    let pictures = ["noise-eight-by-eight", "first-time-eight-by-eight-shear"];
    assert_eq!(names, pictures.map(|name| format!("report-pictures/{name}.svg")));
    let (head, rows) = table(&report, "noise");
    let at = |name: &str| head.iter().position(|head| *head == name).unwrap();
    for row in rows {
        let (error, noise) = (row[at("shear error, median")].as_f64().unwrap(), row[at("noise")].as_f64().unwrap());
        assert!(if row[at("estimator")] == "none" { error == 1.0 } else { error > 0.0 && error < 3.0 }, "{row}");
        assert_eq!(row[at("bound, median")].as_f64().unwrap() > 0.0, noise > 0.0, "{row}");
    }
    assert_eq!(rows.iter().filter(|row| row[at("estimator")] == "search sparse").count(), 5);

    // One recommendation, case 0, with co-simulated cycles.
    let (head, rows) = table(&report, "choice");
    let at = |name: &str| head.iter().position(|head| *head == name).unwrap();
    assert_eq!((rows.len(), &rows[0][at("take case")]), (1, &Value::from("0 (1×1)")));
    let (cycles, us) = (rows[0][at("cycles")].as_f64().unwrap(), rows[0][at("µs")].as_f64().unwrap());
    let model = Model::new(&Scene::builtin("eight-by-eight").unwrap()).unwrap();
    let planned = Cycles::longest(&model).total;
    assert_eq!((cycles, us), (planned as f64, model.board.microseconds(planned)));
    assert_eq!(rows[0][at("cycles from")], "co-simulation");
    // Every engine has a time; the hardware's is its cycles at 100 MHz.
    let (head, rows) = table(&report, "time");
    let at = |name: &str| head.iter().position(|head| *head == name).unwrap();
    // Frames with one contact and with several are never in one row.
    assert_eq!((rows.len(), row_counts(rows, at("contacts"))), (4 * 4 + 1, [17, 0]));
    for row in rows {
        let ninety = row[at("shear error, median") + 1].as_f64().unwrap();
        assert!(ninety >= row[at("shear error, median")].as_f64().unwrap(), "{row}");
        assert_eq!(row[at("frames")].as_f64(), Some(5.0), "{row}");
        assert!(row[at("time of a frame")].as_f64().unwrap() > 0.0, "{row}");
    }
    let hardware: Vec<&Value> = rows.iter().filter(|row| row[at("engine")] == "hardware, search").collect();
    assert_eq!(hardware.len(), 4);
    for row in hardware {
        let seconds = row[at("cycles")].as_f64().unwrap() / 100e6;
        assert!((row[at("time of a frame")].as_f64().unwrap() / seconds - 1.0).abs() < 1e-12, "{row}");
    }
    let simulated: Vec<&Value> = rows.iter().filter(|row| row[at("RTL = bit-true")] == "yes").collect();
    assert_eq!(simulated.len(), 1);
    // Hardware that was not co-simulated has hollow marks, and what needs no estimator has a line.
    let svg = fs::read_to_string(out.join("report-pictures/time-eight-by-eight-shear.svg")).unwrap();
    assert!(svg.contains("not co-simulated") && svg.contains("no shear"), "{svg}");
    assert!(page.contains("Σ b·area\n</text>"), "the sum of the stress is not drawn in");
    assert!(page.contains("<details><summary>Largest and RMS difference"), "the table of the stages is open");

    // The normal error is at most 1 % up to a condition number of 10⁶, and at most 5 % beyond.
    let (head, rows) = table(&report, "stability");
    let at = |name: &str| head.iter().position(|head| *head == name).unwrap();
    assert_eq!(rows.iter().filter(|row| row[at("varied")] == "50 digits").count(), 4);
    for row in rows {
        let most = if row[at("condition")].as_f64().unwrap() <= 1e6 { 0.01 } else { 0.05 };
        for column in [at("e_n f64"), at("e_n f64") + 1, at("e_n f64") + 2] {
            assert!(row[column].as_f64().unwrap() <= most, "{row}");
        }
    }
    // Extreme frames with the flags of both models and of the status beats.
    let (head, rows) = table(&report, "extremes-eight-by-eight");
    let at = |name: &str| head.iter().position(|head| *head == name).unwrap();
    let zero = rows.iter().find(|row| row[at("frame")] == "zero").unwrap();
    assert_eq!(
        (&zero[at("flags")], &zero[at("status")]),
        (&"no-contact, condition-unmet".into(), &"no-contact".into())
    );
    assert!(rows.len() >= 24);

    // A file for each table and picture; those of an earlier run are deleted.
    let items = || report["sections"].as_array().unwrap().iter().flat_map(|s| s["items"].as_array().unwrap());
    let tables = items().filter_map(|item| item["table"].as_str());
    let mut wanted: Vec<PathBuf> = tables.map(|id| out.join(format!("report-tables/{id}.csv"))).collect();
    wanted.sort();
    assert_eq!(files(&out.join("report-tables")), wanted);
    for item in items() {
        if let Some(id) = item["table"].as_str() {
            let csv = fs::read_to_string(out.join(format!("report-tables/{id}.csv"))).unwrap();
            assert_eq!(csv.lines().count(), 1 + item["rows"].as_array().unwrap().len(), "{id}");
            assert!(page.contains(&format!("<table id=\"{id}\">")), "{id}");
        }
        if let Some(file) = item["file"].as_str() {
            assert!(fs::read_to_string(out.join(file)).unwrap().ends_with("</svg>\n"), "{file}");
            assert!(markdown.contains(&format!("]({file})")), "{file}");
        }
    }
    assert_eq!(page.matches("<figure ").count(), files(&out.join("report-pictures")).len());
    assert_eq!(page.matches("<h2 ").count(), markdown.matches("\n## ").count());
}

#[test]
fn the_papers_figures() {
    let work = tempfile::tempdir().unwrap();
    let args = ["report", "sensor-1", "sensor-2", "--paper", "--quick", "--out", "out"];
    let output = dermis(work.path(), &args).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_str(&fs::read_to_string(work.path().join("out/paper.json")).unwrap()).unwrap();
    let (head, rows) = table(&report, "table-2");
    let contacts: Vec<&Value> = rows.iter().map(|row| &row[2]).collect();
    assert_eq!((rows.len(), head[3], rows[0][3].as_f64()), (8, "paper X1", Some(0.1284)));
    assert!(contacts.iter().all(|contacts| **contacts == "one"), "{contacts:?}");
    assert!(fs::read_to_string(work.path().join("out/paper.md")).unwrap().contains("the paper's centroid condition"));
    let (_, judged) = table(&report, "judged");
    // The paper's conclusion for a single Hertzian contact is confirmed.
    assert_eq!((judged.len(), &judged[0][1], &judged[0][7]), (4, &Value::from("0 (1×1)"), &Value::from("yes")));
    assert!(work.path().join("out/paper-pictures/fig-1-forces.svg").is_file());
    assert!(work.path().join("out/paper-pictures/fig-4a-sensor-1-case-2-golden.svg").is_file());
}

#[test]
fn the_page_of_a_recording() {
    let work = tempfile::tempdir().unwrap();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../golden/data/recordings/iscan-finger.csv");
    let args = ["--full-scale", "0.5", "--crop", "contact", "--frames", "3..10", "--out", "finger"];
    let mut import = dermis(work.path(), &["import"]);
    assert!(import.arg(file).args(args).status().unwrap().success());
    let output = dermis(work.path(), &["report", "--recording", "finger", "--out", "out"]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(String::from_utf8(output.stdout).unwrap(), "out/recordings.html\n");
    let text = fs::read_to_string(work.path().join("out/recordings.json")).unwrap();
    let report: Value = serde_json::from_str(&text).unwrap();
    let (head, rows) = table(&report, "recordings");
    let at = |name: &str| head.iter().position(|head| *head == name).unwrap();
    assert_eq!((rows.len(), &rows[0][at("array")], rows[0][at("frames")].as_f64()), (1, &"28×28".into(), Some(8.0)));
    // Counts: a step of 1/255 of full scale, noise of the order of a step and well below the peak.
    assert!((rows[0][at("step, kPa")].as_f64().unwrap() / (500.0 / 255.0) - 1.0).abs() < 1e-9);
    let noise = rows[0][at("of peak")].as_f64().unwrap();
    assert!((0.001..0.05).contains(&noise), "{noise}");
    let (head, rows) = table(&report, "recording-forces");
    let at = |name: &str| head.iter().position(|head| *head == name).unwrap();
    let share = |name: &str| rows[0][at(name)].as_f64().unwrap();
    // The file's raw sums are exact; the force of a film is stress times area; 18-bit words agree to 0.1 %.
    assert!(share("at most") < 1e-9);
    assert!(share("reconstructed off stress × area, median") < 0.01);
    assert!(share("fixed off golden, largest") < 1e-3);
    assert!(share("cycles") > 0.0 && share("golden, CPU") > 0.0);
    // No shear is claimed.
    assert!(text.contains("no shear is searched, and none is claimed") && !text.contains("e_t"));
    assert_eq!(files(&work.path().join("out/recordings-pictures")).len(), 5);
}

#[test]
fn an_interruption_keeps_earlier_files() {
    let work = tempfile::tempdir().unwrap();
    let out = work.path().join("out");
    fs::create_dir(&out).unwrap();
    fs::write(out.join("report.html"), "of before").unwrap();
    let mut command = dermis(work.path(), &["report", "--quick", "--out", "out"]);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // Long enough to have started, far from finished.
    std::thread::sleep(Duration::from_millis(700));
    let pid = rustix::process::Pid::from_child(&child);
    rustix::process::kill_process(pid, rustix::process::Signal::INT).unwrap();
    let output = child.wait_with_output().unwrap();
    let message = String::from_utf8(output.stderr).unwrap();
    let said = "interrupted: the tasks that run are ended first; a second signal ends them at once\n\
                error: interrupted; nothing was written\n";
    assert_eq!((output.status.code(), message.as_str()), (Some(130), said));
    assert_eq!(files(&out), [out.join("report.html")]);
    assert_eq!(fs::read_to_string(out.join("report.html")).unwrap(), "of before");
}
