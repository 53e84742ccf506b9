//! README, CONTRIBUTING and the guide: every link and every path in them exists, every page is in the table of contents
//! and in the documentation, every `dermis` command that they show is one that the program takes.
//!
//! | in a page | must |
//! |---|---|
//! | `[text](file)`, `[label]: file`, relative | be a file or folder beside the page |
//! | `[text][label]` | have a definition on the page |
//! | `` `golden/…` ``, `` `hdl/…` ``, `` `sim/…` ``, `` `python/…` ``, `` `ros/…` ``, `` `constraints/…` ``, `` `tests/…` `` | be a file or folder of the repository |
//! | a line that begins with `dermis` in an `sh` block | be accepted by the command line |
//! | a fence | name its language |
//!
//! What they say of the project's own lists is compared with these: folders, stages, values of a field, columns of cycles,
//! figures in the README's text.

use std::fs;
use std::path::{Path, PathBuf};

use dermis_sim::commands::check_arguments;
use dermis_sim::commands::guide_pages::markdown::tables;

/// Longest README in lines: one page.
const README_LINES: usize = 140;
/// Folders whose files pages name in backticks.
const FOLDERS: [&str; 8] = ["docs", "golden", "hdl", "sim", "python", "ros", "constraints", "tests"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The pages' files below a folder.
fn markdown(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut pages: Vec<PathBuf> = entries
        .flat_map(|path| match path.is_dir() {
            true => markdown(&path),
            false => vec![path],
        })
        .filter(|path| path.extension().is_some_and(|extension| extension == "md"))
        .collect();
    pages.sort();
    pages
}

fn guide() -> PathBuf {
    root().join("docs")
}

/// Everything that is wrong with a page's text; `file` is where it stands.
fn faults(file: &Path, text: &str) -> Vec<String> {
    let mut faults = Vec::new();
    let mut language: Option<&str> = None;
    let mut labels = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let mut fault = |what: String| faults.push(format!("{}:{}: {what}", file.display(), index + 1));
        if let Some(fence) = line.trim_start().strip_prefix("```") {
            if language.is_none() && fence.is_empty() {
                fault("a fence without a language".into());
            }
            language = if language.is_some() { None } else { Some(fence) };
            continue;
        }
        match language {
            Some("sh") if line.starts_with("dermis ") => {
                if let Err(error) = check_arguments(words(line)) {
                    fault(format!("{line}: {error}"));
                }
            }
            Some(_) => {}
            None => {
                for target in targets(line) {
                    let target = target.split('#').next().unwrap_or_default();
                    let here = file.parent().unwrap_or(Path::new("."));
                    if !target.contains("://") && !here.join(target).exists() {
                        fault(format!("no such file: {target}"));
                    }
                }
                for path in code(line).filter(|span| is_path(span)) {
                    if !root().join(path).exists() {
                        fault(format!("no such file: `{path}`"));
                    }
                }
                labels.extend(references(line).map(|label| (index + 1, label)));
            }
        }
    }
    for (line, label) in labels {
        if !text.lines().any(|text| text.starts_with(&format!("[{label}]: "))) {
            faults.push(format!("{}:{line}: [{label}] is not defined", file.display()));
        }
    }
    faults
}

/// The words of a command up to a comment or a redirection.
fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split_whitespace().take_while(|word| !word.starts_with(['#', '>', '<', '|']))
}

/// What stands between backticks.
fn code(line: &str) -> impl Iterator<Item = &str> {
    line.split('`').skip(1).step_by(2)
}

fn is_path(span: &str) -> bool {
    let folder = span.split_once('/').map(|(folder, _)| folder);
    folder.is_some_and(|folder| FOLDERS.contains(&folder)) && !span.contains([' ', '…', '*']) && !has_placeholder(span)
}

/// `STAGE.rs`, `NAME.toml`: to be replaced by the reader.
fn has_placeholder(path: &str) -> bool {
    let stem = |part: &str| part.split('.').next().unwrap_or_default().to_owned();
    path.split('/').map(stem).any(|stem| stem.len() > 1 && stem.chars().all(|c| c.is_ascii_uppercase()))
}

/// Targets of inline links and pictures, and of a definition.
fn targets(line: &str) -> Vec<&str> {
    let inline = line.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    let defined = line.starts_with('[').then(|| line.split_once("]: ")).flatten().map(|(_, target)| target);
    inline.chain(defined).collect()
}

/// Labels of `[text][label]`.
fn references(line: &str) -> impl Iterator<Item = &str> {
    line.split("][").skip(1).filter_map(|rest| rest.split(']').next())
}

#[test]
fn pages_say_what_is_there() {
    let mut pages = markdown(&guide());
    assert!(pages.len() > 20, "{pages:?}");
    pages.extend(["README.md", "CONTRIBUTING.md"].map(|name| root().join(name)));
    let faults: Vec<String> = pages.iter().flat_map(|page| faults(page, &fs::read_to_string(page).unwrap())).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn the_readme_is_one_page() {
    let lines = fs::read_to_string(root().join("README.md")).unwrap().lines().count();
    assert!(lines <= README_LINES, "{lines} lines");
}

#[test]
fn every_page_is_in_the_contents_and_in_the_documentation() {
    let contents = fs::read_to_string(guide().join("index.md")).unwrap();
    let modules = fs::read_to_string(root().join("sim/src/guide.rs")).unwrap();
    for page in markdown(&guide()) {
        let name = page.strip_prefix(guide()).unwrap().display().to_string();
        assert!(modules.contains(&format!("\"{name}\" ")), "{name} is not in sim/src/guide.rs");
        assert!(name == "index.md" || contents.contains(&format!("]: {name}\n")), "{name} is not in index.md");
    }
}

fn read(page: &str) -> String {
    fs::read_to_string(root().join(page)).unwrap()
}

/// First cells of the rows of a page's tables whose first head is `head`.
fn first_cells(page: &str, head: &str) -> Vec<String> {
    let all = tables(&read(page)).into_iter().filter(|table| table.head[0] == head);
    all.flat_map(|table| table.rows).map(|row| row[0].clone()).collect()
}

#[test]
fn each_crate_of_sim_is_named() {
    let text = read("CONTRIBUTING.md");
    let list = text.split_once("the crates in `sim` (").unwrap().1.split_once(')').unwrap().0;
    let mut named: Vec<&str> = code(list).collect();
    named.sort();
    let entries = fs::read_dir(root().join("sim")).unwrap().map(|entry| entry.unwrap().path());
    let mut folders: Vec<String> = entries
        .filter(|path| path.join("Cargo.toml").exists())
        .map(|path| path.file_name().unwrap().to_string_lossy().into_owned())
        .collect();
    folders.sort();
    assert_eq!(named, folders);
}

#[test]
fn the_stages_are_those_of_the_hardware() {
    let all = first_cells("docs/architecture.md", "stage");
    let of_contacts = first_cells("docs/architecture/contacts.md", "stage");
    let blocks = first_cells("docs/architecture/blocks.md", "block");
    let stages: Vec<&String> = blocks.iter().filter(|name| *name != "`butterfly`").collect();
    assert!(stages.len() > 10, "{stages:?}");
    for stage in stages {
        assert!(all.contains(stage) || of_contacts.contains(stage), "{stage} is in no table of stages");
    }
    // The page counts those of the other page in words.
    let words = ["none", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten"];
    let count = format!("have {} more: [stages of contacts]", words[of_contacts.len()]);
    assert!(read("docs/architecture.md").contains(&count), "{count}");
}

#[test]
fn the_limits_know_both_kinds_of_tables() {
    let page = read("docs/limits.md");
    let specimen = page.split("\n- ").find(|item| item.contains("serves one specimen")).unwrap();
    let scene = |kind: &str| {
        let text = format!(
            "[sensor]\nrows = 4\ncols = 4\npitch_x_mm = 2\npitch_y_mm = 2\nthickness_mm = 2\n\
             [input]\nfull_scale_MPa = 1\n[hardware]\ntables = \"{kind}\"\n"
        );
        dermis_golden::spec::scene::Scene::parse(&text, "s.toml").unwrap().hardware.has_writable_tables()
    };
    for (kind, writable) in [("rom", false), ("writable", true)] {
        assert_eq!(scene(kind), writable);
        assert!(specimen.contains(&format!("\"{kind}\"")), "{kind}: {specimen}");
    }
}

/// A scene has one number of cycles on its shipped frames, and another one in the worst case: the heads of columns say which.
#[test]
fn a_column_of_cycles_says_of_which_frames() {
    let heads = |page: &str| tables(&read(page)).into_iter().flat_map(|table| table.head).collect::<Vec<String>>();
    let heads = ["README.md", "docs/boards.md"].map(heads).concat();
    let cycles: Vec<&String> = heads.iter().filter(|head| head.contains("cycles")).collect();
    let which = ["shipped frames", "worst case", "frame interval"];
    assert!(
        !cycles.is_empty() && cycles.iter().all(|head| which.iter().any(|which| head.contains(which))),
        "{cycles:?}"
    );
}

/// Text of a page without its figures, which a command writes.
fn without_figures(text: &str) -> String {
    let mut parts = text.split("<!-- figure:");
    let first = parts.next().unwrap_or_default().to_owned();
    let rest = parts.map(|part| part.split_once("<!-- end of figure -->").unwrap().1);
    [first].into_iter().chain(rest.map(str::to_owned)).collect()
}

/// Measured times in the text of a page that no command writes: a number before a unit of time.
fn unmarked(text: &str) -> Vec<String> {
    let mut fenced = false;
    let prose = without_figures(text);
    let prose = prose.lines().filter(|line| {
        fenced ^= line.starts_with("```");
        !fenced && !line.starts_with('|')
    });
    let words: Vec<&str> = prose.flat_map(str::split_whitespace).collect();
    let is_number = |word: &str| word.chars().any(|c| c.is_ascii_digit()) && !word.contains('×');
    let is_time = |word: &str| ["cycles", "clock", "µs"].iter().any(|unit| word.trim_end_matches([',', '.']) == *unit);
    words.windows(2).filter(|pair| is_number(pair[0]) && is_time(pair[1])).map(|pair| pair.join(" ")).collect()
}

#[test]
fn times_in_the_readme_are_written_by_a_command() {
    let text = read("README.md");
    assert_eq!(unmarked(&text), [""; 0]);
    assert!(text.contains("<!-- figure:"));
    // As it once was.
    let stale = format!("{text}\n10×10 taxels take 1 267 clock cycles, 12.7 µs at 100 MHz.\n");
    assert_eq!(unmarked(&stale), ["267 clock", "12.7 µs"]);
}

#[test]
fn what_is_wrong_is_found() {
    let page = guide().join("index.md");
    let found = |text: &str| faults(&page, text);
    let right = "[a](limits.md), [b][limits.md], `golden/src/lib.rs`\n\n[limits.md]: limits.md\n\n\
                 ```sh\ndermis cosim sensor-1 --device verilator # runs\n```\n";
    assert_eq!(found(right), [""; 0]);
    for (wrong, says) in [
        ("[a](nowhere.md)\n", "no such file: nowhere.md"),
        ("![picture](pictures/none.svg)\n", "no such file: pictures/none.svg"),
        ("[limits.md]: no-limits.md\n", "no such file: no-limits.md"),
        ("see [limits][limits.md]\n", "[limits.md] is not defined"),
        ("`golden/src/none.rs`\n", "no such file: `golden/src/none.rs`"),
        ("```\ntext\n```\n", "without a language"),
        ("```sh\ndermis cosim sensor-1 --no-such-option\n```\n", "unexpected argument"),
        ("```sh\ndermis fly sensor-1\n```\n", "unrecognized subcommand"),
        ("```sh\ndermis noise\n```\n", "required"),
    ] {
        let found = found(wrong);
        assert!(found.len() == 1 && found[0].contains(says), "{wrong}: {found:?}");
    }
}
