//! `dermis guide`: the tables, figures, code and pictures of README.md and of the guide, made by the commands that they name.
//!
//! ```text
//! page ── markers ── commands, each once ── Markdown table ──┬─ written between the marker's lines
//!                                                            └─ --check: compared with what stands there
//! ```
//!
//! A figure in the text is a cell of such a table. A quick check takes it from the table of the same command that a page has,
//! where that table has a cheaper check of its own.
//!
//! | module | does |
//! |---|---|
//! | [`marker`] | finds the markers of a page |
//! | [`markdown`] | reads, selects and compares Markdown tables |
//!
//! The pictures are drawn by [`dermis_report`]; that of run times is measured anew each time and not compared.

pub mod markdown;
pub mod marker;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread::available_parallelism;
use std::time::Instant;

use anyhow::{anyhow, bail, ensure, Context, Result};
use clap::Args;
use dermis_flow::say;
use dermis_golden::write::write;

use dermis_flow::jobs::{parallel, Interrupt};
use dermis_flow::progress::Progress;
use dermis_report::{fixed_pictures, time_picture, PictureFile};
use markdown::{tables, Difference, Table};
use marker::{markers, Marker};

/// The guide's folder, from the repository's root.
pub const GUIDE: &str = "docs";
/// Folder of the pictures in the guide's.
const PICTURES: &str = "pictures";
/// What every marker's command begins with.
const PROGRAM: &str = "dermis";

/// What `dermis guide` is asked for.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis guide                                       run every command, write its table: minutes
  dermis guide --only stability                      those whose command contains `stability`
  dermis guide --check                               compare in place of writing; exit code 1 when a table is stale
  dermis guide --check --quick                       the same with the markers' cheaper check commands
  dermis guide --pictures                            draw docs/pictures/*.svg

A table or code stands between two lines of a Markdown page:
  <!-- table: dermis table sensor-1 ; table: 2 ; columns: case | e_t ; check: dermis table sensor-1 --case 0 -->
  <!-- end of table -->
  <!-- code: dermis block butterfly --verilog ; language: verilog -->
  <!-- end of code -->
A figure stands in the text, within a line:
  … in <!-- figure: dermis table --cosim ; row: sensor-1 ; column: µs -->12.78<!-- end of figure --> µs …
Attributes follow the command after semicolons, all of them optional:
  check: COMMAND          what --quick runs; each of its rows must stand in the page, in the columns that both have
  check columns: A | B    compare only these columns of the check's table
  table: N                the N-th table that the command prints, 1 if not given; the check's as well
  columns: A | B          columns to keep, in this order
  row: A                  of a figure: the first cell of its row
  column: B               of a figure: the head of its column
  measured: yes           the table has times of this machine: every check takes the check's command
  part: N                 of a figure: the N-th of several that `/` separates in its cell
  takes: 40 s             how long the command takes, for the reader")]
pub struct Arguments {
    /// Folder of the repository, which holds README.md and docs; commands run in it.
    #[arg(long, value_name = "DIR", default_value = ".")]
    root: PathBuf,
    /// Compare with the pages, write nothing.
    #[arg(long)]
    check: bool,
    /// Take the markers' check commands, which print a part of the table.
    #[arg(long, requires = "check")]
    quick: bool,
    /// Only tables whose command contains this text.
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
    /// Commands that run at a time; without it as many as there are processors.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=64))]
    jobs: Option<u16>,
    /// The pictures in place of the tables.
    #[arg(long, conflicts_with_all = ["quick", "only"])]
    pictures: bool,
}

/// A page with its markers.
struct Page {
    /// From the root.
    name: String,
    text: String,
    markers: Vec<Marker>,
}

/// Outputs by command.
type Outputs = BTreeMap<String, String>;

/// Runs the command: what was written, or what is stale; and whether nothing is.
///
/// # Errors
/// A page that cannot be read or written, a marker that is wrong, a command that fails or prints no such table.
pub fn run(arguments: &Arguments, build: &Path) -> Result<(String, bool)> {
    let root = &arguments.root;
    if arguments.pictures {
        return pictures(root, arguments.check, build);
    }
    let mut pages = Vec::new();
    for name in page_names(root)? {
        let path = root.join(&name);
        let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        let mut markers = markers(&name, &text).map_err(|error| anyhow!("{error:#}"))?;
        markers.retain(|marker| arguments.only.as_ref().is_none_or(|only| marker.command.contains(only)));
        pages.push(Page { name, text, markers });
    }
    if let Some(only) = &arguments.only {
        ensure!(pages.iter().any(|page| !page.markers.is_empty()), "--only {only:?}: no table's command contains it");
    }
    let quick = arguments.quick;
    let command = |marker: &Marker| marker.quick_check(quick).unwrap_or(&marker.command).to_owned();
    let is_run = |marker: &&Marker| !quick || marker.cell.is_none() || checked_table(&pages, marker).is_none();
    let of_page = |page: &Page| -> Vec<(String, String)> {
        page.markers.iter().filter(is_run).map(|marker| (at(page, marker), command(marker))).collect()
    };
    let outputs = outputs(pages.iter().flat_map(of_page).collect(), arguments, build)?;
    match arguments.check {
        true => check(&pages, quick, &outputs),
        false => Ok((fill(&pages, root, &outputs)?, true)),
    }
}

/// The Markdown pages: those beside README.md, and those of the guide with its folders.
///
/// # Errors
/// A folder that cannot be read, or has no README.md.
pub fn page_names(root: &Path) -> Result<Vec<String>> {
    let mut names = markdown_files(root, Path::new(""))?;
    ensure!(names.iter().any(|name| name == "README.md"), "{}: no README.md in it; see --root", root.display());
    let mut folders = vec![PathBuf::from(GUIDE)];
    while let Some(folder) = folders.pop() {
        names.extend(markdown_files(root, &folder)?);
        for entry in entries(&root.join(&folder))? {
            if entry.is_dir() {
                folders.extend(entry.file_name().map(|name| folder.join(name)));
            }
        }
    }
    names.sort();
    Ok(names)
}

fn entries(folder: &Path) -> Result<Vec<PathBuf>> {
    let read = || std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<_>>();
    read().with_context(|| folder.display().to_string())
}

/// Names, from the root, of the Markdown files of one folder.
fn markdown_files(root: &Path, folder: &Path) -> Result<Vec<String>> {
    let paths = entries(&root.join(folder))?;
    let files = paths.iter().filter(|path| path.extension().is_some_and(|extension| extension == "md"));
    Ok(files.filter_map(|path| Some(folder.join(path.file_name()?).display().to_string())).collect())
}

/// Writes the tables of each page; which page has how many, and how many of them changed.
fn fill(pages: &[Page], root: &Path, outputs: &Outputs) -> Result<String> {
    let mut lines = String::new();
    for page in pages.iter().filter(|page| !page.markers.is_empty()) {
        let mut text = page.text.clone();
        let mut changed = 0;
        // From the last to the first: what is written moves only what follows it.
        for marker in page.markers.iter().rev() {
            let old = &page.text[marker.content.clone()];
            let (new, differs) = located(page, marker, content(marker, old, outputs))?;
            changed += usize::from(differs);
            text.replace_range(marker.content.clone(), &new);
        }
        if text != page.text {
            write(&root.join(&page.name), text.as_bytes())?;
        }
        lines.push_str(&format!("{}: {} tables and figures, {changed} changed\n", page.name, page.markers.len()));
    }
    Ok(lines)
}

/// What is to stand behind a marker, and whether it differs from what stands there.
fn content(marker: &Marker, old: &str, outputs: &Outputs) -> Result<(String, bool)> {
    if let Some(code) = code(marker, outputs) {
        let differs = old != code;
        return Ok((code, differs));
    }
    let new = printed(marker, &marker.command, outputs)?;
    if let Some(cell) = &marker.cell {
        let figure = new.cell(cell)?;
        let differs = old != figure;
        return Ok((figure, differs));
    }
    let new = new.select(&marker.columns)?;
    Ok((new.text(), tables(old) != [new]))
}

/// The fenced block of a marker of code.
fn code(marker: &Marker, outputs: &Outputs) -> Option<String> {
    let language = marker.language.as_ref()?;
    let printed = outputs.get(&marker.command).map(String::as_str).unwrap_or_default();
    Some(format!("```{language}\n{}\n```\n", printed.trim_end()))
}

/// Compares the tables of all pages; what is stale, and whether nothing is.
fn check(pages: &[Page], quick: bool, outputs: &Outputs) -> Result<(String, bool)> {
    let mut stale = String::new();
    let mut count = 0;
    for page in pages {
        for marker in &page.markers {
            count += 1;
            let command = marker.quick_check(quick).unwrap_or(&marker.command);
            if let Some(difference) = located(page, marker, differs(pages, page, marker, quick, outputs))? {
                stale.push_str(&format!("{}: stale: {command}\n{difference}\n", at(page, marker)));
            }
        }
    }
    match stale.is_empty() {
        true => Ok((format!("{count} tables and figures are as their commands print them\n"), true)),
        false => Ok((format!("{stale}dermis guide --only TEXT writes what the command prints\n"), false)),
    }
}

/// The table of the marker's command that a page has and a cheaper command checks.
fn checked_table(pages: &[Page], marker: &Marker) -> Option<Table> {
    let is_same =
        |other: &&Marker| other.check.is_some() && (&other.command, other.table) == (&marker.command, marker.table);
    let of_page =
        |page: &Page| page.markers.iter().find(is_same).map(|other| tables(&page.text[other.content.clone()]));
    pages.iter().find_map(of_page)?.pop()
}

/// The first row in which the page's table is not its command's, or its check's; of a figure the figure.
fn differs(pages: &[Page], page: &Page, marker: &Marker, quick: bool, outputs: &Outputs) -> Result<Option<Difference>> {
    if let Some(cell) = &marker.cell {
        let table = match checked_table(pages, marker).filter(|_| quick) {
            Some(table) => table,
            None => printed(marker, &marker.command, outputs)?,
        };
        return Ok(Difference::of_lines(&page.text[marker.content.clone()], &table.cell(cell)?));
    }
    if let Some(code) = code(marker, outputs) {
        return Ok(Difference::of_lines(&page.text[marker.content.clone()], &code));
    }
    let found = tables(&page.text[marker.content.clone()]);
    let [old] = &found[..] else { bail!("{} tables between the marker and its end, wanted 1", found.len()) };
    match marker.quick_check(quick) {
        Some(command) => old.lacks(&printed(marker, command, outputs)?, &marker.check_columns),
        None => Ok(old.differs(&printed(marker, &marker.command, outputs)?.select(&marker.columns)?)),
    }
}

/// The table of `command` that the marker asks for.
fn printed(marker: &Marker, command: &str, outputs: &Outputs) -> Result<Table> {
    let mut all = outputs.get(command).map_or_else(Vec::new, |output| tables(output));
    let (wanted, printed) = (marker.table, all.len());
    ensure!(wanted <= printed, "{command}: table {wanted} of {printed} that it prints");
    Ok(all.swap_remove(wanted - 1))
}

fn at(page: &Page, marker: &Marker) -> String {
    format!("{}:{}", page.name, marker.line)
}

/// Adds the marker's page and line to an error.
fn located<T>(page: &Page, marker: &Marker, result: Result<T>) -> Result<T> {
    result.map_err(|error| anyhow!("{}: {error:#}", at(page, marker)))
}

/// Runs commands, each with the place that wants it, several at a time and each once.
fn outputs(mut wanted: Vec<(String, String)>, arguments: &Arguments, build: &Path) -> Result<Outputs> {
    let mut seen = BTreeSet::new();
    wanted.retain(|(_, command)| seen.insert(command.clone()));
    let build = std::path::absolute(build).with_context(|| build.display().to_string())?;
    let run = |(place, command): (String, String)| {
        let output = output(&command, &arguments.root, &build).map_err(|error| anyhow!("{place}: {error:#}"))?;
        Ok((command, output))
    };
    let jobs = arguments.jobs.map_or_else(|| available_parallelism().map_or(1, usize::from), usize::from);
    Ok(parallel("tables", wanted, jobs, &Interrupt::default(), run)?.into_iter().collect())
}

/// What this program prints for a command.
fn output(command: &str, root: &Path, build: &Path) -> Result<String> {
    let mut words = command.split_whitespace();
    ensure!(words.next() == Some(PROGRAM), "{command}: wanted a command of `{PROGRAM}`");
    let progress = Progress::start(command);
    let begun = Instant::now();
    let program = std::env::current_exe().context("this program's own path")?;
    let mut own = Command::new(program);
    own.current_dir(root).args(words).arg("--build-dir").arg(build);
    let output = own.output().with_context(|| command.to_owned())?;
    drop(progress);
    let stderr = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{command}: {}: {}", output.status, stderr.trim());
    say!("{:7.1} s  {command}", begun.elapsed().as_secs_f64());
    String::from_utf8(output.stdout).with_context(|| command.to_owned())
}

/// Draws the pictures, or tells which are not as they would be drawn.
fn pictures(root: &Path, check: bool, build: &Path) -> Result<(String, bool)> {
    let folder = Path::new(GUIDE).join(PICTURES);
    let mut files = fixed_pictures(build)?;
    if !check {
        files.push(time_picture(build)?);
    }
    let (mut lines, mut stale) = (String::new(), false);
    for PictureFile { name, text } in &files {
        let name = folder.join(name);
        let path = root.join(&name);
        let is_same = || std::fs::read_to_string(&path).is_ok_and(|old| old == *text);
        let about = match check {
            true if is_same() => "as drawn",
            true => {
                stale = true;
                "stale; dermis guide --pictures draws it"
            }
            false => {
                write(&path, text.as_bytes())?;
                "drawn"
            }
        };
        lines.push_str(&format!("{}: {about}\n", name.display()));
    }
    Ok((lines, !stale))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page(text: &str) -> Page {
        Page { name: "README.md".into(), text: text.into(), markers: markers("README.md", text).unwrap() }
    }

    /// Commands that have run.
    fn ran(outputs: &[(&str, &str)]) -> Outputs {
        outputs.iter().map(|(command, output)| ((*command).to_owned(), (*output).to_owned())).collect()
    }

    const PAGE: &str =
        "# A\n\n<!-- table: dermis a ; check: dermis b -->\n| s | x |\n|---|--:|\n| p | 1 |\n| q | 2 |\n\
                        <!-- end of table -->\n\ntext\n<!-- table: dermis a ; columns: x -->\n<!-- end of table -->\n";
    const NEW: &str = "| s |  x |\n|---|---:|\n| p |  1 |\n| q | 30 |\n\nlegend\n";

    #[test]
    fn tables_are_written_between_their_markers() {
        let folder = tempfile::tempdir().unwrap();
        let lines = fill(&[page(PAGE)], folder.path(), &ran(&[("dermis a", NEW)])).unwrap();
        assert_eq!(lines, "README.md: 2 tables and figures, 2 changed\n");
        let text = std::fs::read_to_string(folder.path().join("README.md")).unwrap();
        let wanted = "# A\n\n<!-- table: dermis a ; check: dermis b -->\n| s |  x |\n|---|---:|\n| p |  1 |\n| q | 30 |\n\
                      <!-- end of table -->\n\ntext\n<!-- table: dermis a ; columns: x -->\n|  x |\n|---:|\n|  1 |\n| 30 |\n\
                      <!-- end of table -->\n";
        assert_eq!(text, wanted);
        // A second time nothing changes.
        let lines = fill(&[page(&text)], folder.path(), &ran(&[("dermis a", NEW)])).unwrap();
        assert_eq!(lines, "README.md: 2 tables and figures, 0 changed\n");
    }

    #[test]
    fn a_stale_table_is_found_with_its_place_command_and_rows() {
        let one = page(PAGE.split_once("text\n").unwrap().0);
        let check = |quick, outputs: &[(&str, &str)]| check(std::slice::from_ref(&one), quick, &ran(outputs));
        let (text, good) = check(false, &[("dermis a", NEW)]).unwrap();
        assert!(!good);
        assert!(
            text.starts_with("README.md:3: stale: dermis a\n  page:    | q | 2 |\n  command: | q | 30 |\n"),
            "{text}"
        );
        let same = "| s | x |\n|---|---|\n| p | 1 |\n| q | 2 |\n";
        assert!(check(false, &[("dermis a", same)]).unwrap().1);
        // The cheaper command prints a part of the rows.
        assert!(check(true, &[("dermis b", "| s | x |\n|---|---|\n| q | 2 |\n")]).unwrap().1);
        let (text, good) = check(true, &[("dermis b", "| s | x |\n|---|---|\n| q | 3 |\n")]).unwrap();
        assert!(!good && text.contains("README.md:3: stale: dermis b\n"), "{text}");
    }

    /// A figure in the text is written from its command's table, and a stale one is found, quickly too: there from the table
    /// on a page that has a check.
    #[test]
    fn a_figure_is_written_and_a_stale_one_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let figure = |text: &str, row: &str| {
            format!("{row} takes <!-- figure: dermis a ; row: {row} ; column: x -->{text}<!-- end of figure --> µs.\n")
        };
        let table = PAGE.split_once("text\n").unwrap().0;
        let stale = format!("{}{}\n{table}", figure("1", "p"), figure("3", "q"));
        let check = |text: &str, quick, outputs: &[(&str, &str)]| check(&[page(text)], quick, &ran(outputs)).unwrap();
        let of_check = ("dermis b", "| s | x |\n|---|---|\n| q | 2 |\n");
        let (text, good) = check(&stale, true, &[of_check]);
        assert!(!good && text.contains("README.md:2: stale: dermis a\n  page:    3\n  command: 2\n"), "{text}");
        assert!(!text.contains("README.md:1:"), "{text}");
        let lines = fill(&[page(&stale)], folder.path(), &ran(&[("dermis a", NEW)])).unwrap();
        assert_eq!(lines, "README.md: 3 tables and figures, 2 changed\n");
        let text = std::fs::read_to_string(folder.path().join("README.md")).unwrap();
        assert!(text.starts_with(&format!("{}{}\n# A", figure("1", "p"), figure("30", "q"))), "{text}");
        assert!(check(&text, false, &[("dermis a", NEW)]).1);
        let (text, good) = check(&stale, false, &[("dermis a", NEW)]);
        assert!(!good && text.contains("README.md:2: stale: dermis a\n  page:    3\n  command: 30\n"), "{text}");
    }

    #[test]
    fn a_table_that_the_command_does_not_print_is_an_error_with_its_place() {
        let one = page(PAGE);
        let error = fill(&[one], Path::new(""), &ran(&[("dermis a", "none\n")])).unwrap_err();
        assert_eq!(error.to_string(), "README.md:11: dermis a: table 1 of 0 that it prints");
        let error = output("rm a", Path::new(""), Path::new("")).unwrap_err();
        assert_eq!(error.to_string(), "rm a: wanted a command of `dermis`");
    }

    #[test]
    fn pages_are_the_root_s_and_the_guide_s_in_order() {
        let folder = tempfile::tempdir().unwrap();
        assert!(page_names(folder.path()).unwrap_err().to_string().contains("no README.md"));
        std::fs::create_dir_all(folder.path().join("docs/stages")).unwrap();
        for name in ["README.md", "docs/b.md", "docs/a.svg", "docs/stages/fold.md"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let wanted = ["README.md", "docs/b.md", "docs/stages/fold.md"];
        assert_eq!(page_names(folder.path()).unwrap(), wanted);
    }
}
