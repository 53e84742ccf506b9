//! The tables and pictures of README.md and of the guide are those that the program makes, and `dermis guide` tells where
//! they are not.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use dermis_hdl::describe::names;
use dermis_sim::commands::guide_pages::{page_names, GUIDE};
use roxmltree::Document;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn guide(root: &Path, args: &[&str]) -> Output {
    // Built libraries are shared with the other tests.
    let build = self::root().join("build");
    let mut command = Command::new(env!("CARGO_BIN_EXE_dermis"));
    command.arg("guide").arg("--root").arg(root).args(args).arg("--build-dir").arg(build).output().unwrap()
}

/// What it printed, and its exit code.
fn outcome(output: &Output) -> (String, Option<i32>) {
    let all = [&output.stdout[..], &output.stderr[..]].concat();
    (String::from_utf8_lossy(&all).into_owned(), output.status.code())
}

/// A folder with the repository's pages.
fn copied() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for name in page_names(&root()).unwrap() {
        let path = folder.path().join(&name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::copy(root().join(&name), path).unwrap();
    }
    folder
}

#[test]
fn the_tables_of_the_pages_are_what_their_commands_print() {
    let (text, code) = outcome(&guide(&root(), &["--check", "--quick"]));
    assert_eq!(code, Some(0), "{text}");
}

#[test]
fn a_changed_digit_is_found_and_mended() {
    const COMMAND: &str = "dermis bitstream --committed";
    let folder = copied();
    let of_command = |text: &str| Some(text.find(&format!("<!-- table: {COMMAND}"))? + "<!-- table: ".len());
    let marked = |name: &String| of_command(&fs::read_to_string(folder.path().join(name)).unwrap()).is_some();
    let name = page_names(folder.path()).unwrap().into_iter().find(marked).expect("a page with that table");
    let path = folder.path().join(&name);
    let whole = fs::read_to_string(&path).unwrap();
    // The last digit of the table's last row.
    let (before, rest) = whole.split_at(of_command(&whole).unwrap());
    let (table, after) = rest.split_at(rest.find("<!-- end of table -->").unwrap());
    let digit = table.rfind(|character: char| character.is_ascii_digit()).unwrap();
    let other = if table[digit..].starts_with('0') { "1" } else { "0" };
    let mut changed = table.to_owned();
    changed.replace_range(digit..=digit, other);
    fs::write(&path, format!("{before}{changed}{after}")).unwrap();
    let check = || outcome(&guide(folder.path(), &["--check", "--quick", "--only", COMMAND]));
    let (text, code) = check();
    assert_eq!(code, Some(1), "{text}");
    let line = before.lines().count();
    assert!(text.contains(&format!("{name}:{line}: stale: {COMMAND}")), "{text}");
    let row = |table: &str| table.trim_end().lines().last().unwrap().split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(text.contains(&format!("page:    {}", row(&changed))), "{text}");
    assert!(text.contains(&format!("command: {}", row(table))), "{text}");
    // Written anew the table is as it was.
    let (text, code) = outcome(&guide(folder.path(), &["--only", COMMAND]));
    assert_eq!(code, Some(0), "{text}");
    assert_eq!(fs::read_to_string(&path).unwrap(), whole);
    assert_eq!(check().1, Some(0));
}

#[test]
fn a_stale_figure_in_the_text_is_found_and_mended() {
    const COMMAND: &str = "dermis bitstream --committed --board ulx3s-85f";
    const END: &str = "<!-- end of figure -->";
    let folder = copied();
    let path = folder.path().join("README.md");
    let whole = fs::read_to_string(&path).unwrap();
    let at = whole.find(&format!("<!-- figure: {COMMAND} ;")).expect("a figure of that command");
    let from = at + whole[at..].find("-->").unwrap() + "-->".len();
    let to = from + whole[from..].find(END).unwrap();
    fs::write(&path, format!("{}1 267{}", &whole[..from], &whole[to..])).unwrap();
    let check = || outcome(&guide(folder.path(), &["--check", "--quick", "--only", COMMAND]));
    let (text, code) = check();
    assert_eq!(code, Some(1), "{text}");
    let line = whole[..at].lines().count();
    let wanted = format!("README.md:{line}: stale: {COMMAND}\n  page:    1 267\n  command: {}\n", &whole[from..to]);
    assert!(text.contains(&wanted), "{text}");
    assert_eq!(outcome(&guide(folder.path(), &["--only", COMMAND])).1, Some(0));
    assert_eq!(fs::read_to_string(&path).unwrap(), whole);
    assert_eq!(check().1, Some(0));
}

#[test]
fn a_command_that_fails_and_a_marker_without_end_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir_all(folder.path().join(GUIDE)).unwrap();
    let page = |text: &str| {
        fs::write(folder.path().join("README.md"), text).unwrap();
        outcome(&guide(folder.path(), &[]))
    };
    let (text, code) = page("a\n<!-- table: dermis study link-times no-such-scene -->\n<!-- end of table -->\n");
    assert_eq!(code, Some(2), "{text}");
    assert!(
        text.contains("README.md:2: dermis study link-times no-such-scene: ") && text.contains("error: "),
        "{text}"
    );
    let (text, code) = page("<!-- table: dermis study link-times -->\n");
    assert_eq!(code, Some(2));
    assert!(text.contains("README.md:1: no `<!-- end of table -->`"), "{text}");
    assert_eq!(outcome(&guide(folder.path(), &["--only", "nothing"])).1, Some(2));
    let (text, code) = outcome(&guide(&folder.path().join(GUIDE), &[]));
    assert_eq!((code, text.contains("no README.md")), (Some(2), true), "{text}");
}

#[test]
fn the_pictures_that_only_the_program_changes_are_drawn_anew() {
    let (text, code) = outcome(&guide(&root(), &["--check", "--pictures"]));
    assert_eq!(code, Some(0), "{text}");
    // And one that is not is told.
    let folder = tempfile::tempdir().unwrap();
    let pictures = folder.path().join(GUIDE).join("pictures");
    fs::create_dir_all(&pictures).unwrap();
    fs::write(pictures.join("feet.svg"), "<svg/>").unwrap();
    let (text, code) = outcome(&guide(folder.path(), &["--check", "--pictures"]));
    assert_eq!(code, Some(1));
    assert!(text.contains("feet.svg: stale"), "{text}");
}

/// Drawn by `python/examples/ball_on_pad.py`, not by the program.
const OF_EXAMPLE: &str = "ball-on-pad.svg";

#[test]
fn pictures_have_titles_their_labels_and_colours_for_light_and_dark() {
    let drawn = names().into_iter().filter(|name| *name != "butterfly");
    let timings: Vec<String> = drawn.map(|stage| format!("timing-{stage}.svg")).collect();
    let of_stages = timings.iter().map(|name| (name.as_str(), &["cycle", "input", "output"][..]));
    let pictures = [
        ("data-flow.svg", &["receive", "pass", "search", "20 bits", "μ of 18 bits"][..]),
        ("feet.svg", &["N, normal"]),
        ("time-sensor-1-shear.svg", &["1 ms", "hardware", "time of a frame"]),
        ("devices.svg", &["sensor-1-noisy: network, Cortex-M7", "median", "time of a frame"]),
    ];
    let folder = root().join(GUIDE).join("pictures");
    let pictures: Vec<_> = pictures.into_iter().chain(of_stages).collect();
    assert!(folder.join(OF_EXAMPLE).exists());
    assert_eq!(fs::read_dir(&folder).unwrap().count(), pictures.len() + 1);
    for (name, labels) in pictures {
        let text = fs::read_to_string(folder.join(name)).unwrap();
        let document = Document::parse(&text).unwrap();
        let svg = document.root_element();
        assert_eq!(svg.attribute("role"), Some("img"), "{name}");
        let of = |tag: &str| svg.children().find(|node| node.has_tag_name(tag)).and_then(|node| node.text());
        assert!(of("title").is_some_and(|title| title.len() > 10), "{name}");
        assert!(of("desc").is_some_and(|description| description.len() > 10), "{name}");
        let shown: Vec<&str> = svg.descendants().filter(|n| n.has_tag_name("text")).filter_map(|n| n.text()).collect();
        for label in labels {
            assert!(shown.iter().any(|text| text.contains(label)), "{name}: {label}: {shown:?}");
        }
        // Every colour, the background's as well, has one for the dark.
        let style = of("style").unwrap();
        assert!(style.starts_with("@media (prefers-color-scheme:dark){"), "{name}: {style}");
        for node in svg.descendants() {
            for property in ["fill", "stroke"] {
                let Some(colour) = node.attribute(property).filter(|colour| colour.starts_with('#')) else { continue };
                assert!(
                    style.contains(&format!("[{property}=\"{colour}\"]{{{property}:#")),
                    "{name}: {property} {colour}"
                );
            }
        }
        let background = svg.children().find(|node| node.has_tag_name("rect")).unwrap();
        assert_eq!((background.attribute("width"), background.attribute("fill")), (Some("100%"), Some("#ffffff")));
    }
}
