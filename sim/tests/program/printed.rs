//! What the guide prints beside its commands is what they print: each `text` block behind an `sh` block of a page. The commands of a
//! page run one after the other in a folder of its own. `…` stands for what the page leaves out.

use std::path::Path;
use std::process::Command;

use dermis_sim::commands::guide_pages::page_names;
use rayon::prelude::*;

/// Blocks that are not run here: a page, the begin of the commands, and why.
const NOT_RUN: [(&str, &str, &str); 6] = [
    ("boards.md", "dermis host --port /dev/ttyUSB0", "needs a board"),
    ("architecture/scan.md", "dermis cosim golden/data/scenes/resistive-mat.toml", "measures times; scan.rs"),
    ("your-sensor.md", "dermis table pad.toml --fresh 20", "a minute; the page shows some columns alone"),
    ("your-sensor.md", "dermis calibrate pad.toml", "needs readings of a sensor; calibrate.case"),
    ("your-sensor.md", "dermis reconstruct raw.toml --frame raw.csv", "needs readings of a sensor"),
    (
        "your-sensor.md",
        "dermis build pad.toml --explain",
        "builds a library with Verilator: minutes; integration/scale.rs",
    ),
];

/// Commands and what the page says that they print.
fn blocks<'p>(page: &'p str) -> Vec<(&'p str, &'p str)> {
    let pair = |rest: &'p str| {
        let (commands, rest) = rest.split_once("```\n")?;
        let (text, _) = rest.strip_prefix("\n```text\n")?.split_once("```\n")?;
        Some((commands, text))
    };
    page.split("```sh\n").skip(1).filter_map(pair).collect()
}

/// Parts of lines that are not in the output in their order.
fn absent<'t>(text: &'t str, output: &str) -> Vec<&'t str> {
    let plain = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let (output, mut at) = (plain(output), 0);
    let mut is_absent = |part: &&str| match output[at..].find(&plain(part)) {
        Some(found) => {
            at += found + plain(part).len();
            false
        }
        None => true,
    };
    text.lines()
        .flat_map(|line| line.split('…'))
        .filter(|part| !part.trim().is_empty())
        .filter(|part| is_absent(part))
        .collect()
}

/// What is stale on a page.
fn stale(root: &Path, name: &str) -> Vec<String> {
    let page = std::fs::read_to_string(root.join(name)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    std::os::unix::fs::symlink(root.join("golden"), folder.path().join("golden")).unwrap();
    let program = Path::new(env!("CARGO_BIN_EXE_dermis")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
    let is_run = |commands: &&(&str, &str)| {
        !NOT_RUN.iter().any(|(of, begin, _)| name.ends_with(of) && commands.0.starts_with(begin))
    };
    let mut all = Vec::new();
    for (commands, text) in blocks(&page).iter().filter(is_run) {
        let mut shell = Command::new("sh");
        let output = shell.args(["-c", commands]).env("PATH", &path).current_dir(folder.path()).output().unwrap();
        let printed = [output.stdout, output.stderr].concat();
        let printed = String::from_utf8_lossy(&printed);
        all.extend(
            absent(text, &printed).into_iter().map(|part| format!("{name}: stale: {part}\n{commands}{printed}")),
        );
    }
    all
}

#[test]
fn the_guide_prints_what_its_commands_print() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap();
    let names = page_names(&root).unwrap();
    for (page, begin, reason) in NOT_RUN {
        let name = names.iter().find(|name| name.ends_with(page)).unwrap();
        let text = std::fs::read_to_string(root.join(name)).unwrap();
        assert!(blocks(&text).iter().any(|(commands, _)| commands.starts_with(begin)), "{page}: {begin}: {reason}");
    }
    let all: Vec<String> = names.par_iter().flat_map_iter(|name| stale(&root, name)).collect();
    assert!(all.is_empty(), "{}", all.join("\n"));
}

#[test]
fn a_part_that_is_not_printed_is_found() {
    let page = "```sh\ndermis a\n```\n\n```text\nx  1.5 …\ny 2\n```\n\n```sh\ndermis b\n```\n";
    assert_eq!(blocks(page), [("dermis a\n", "x  1.5 …\ny 2\n")]);
    assert_eq!(absent("x  1.5 …\n…\ny 2\n", "x 1.5 mm\nz\ny 2"), [""; 0]);
    assert_eq!(absent("x  1.5 …\ny 2\n", "y 2\nx 1.6 mm"), ["x  1.5 "]);
}
