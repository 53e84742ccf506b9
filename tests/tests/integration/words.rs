//! No file has a phrase of `tests/words.txt`, which also says what to write instead.
//!
//! Text is compared without the marks of comments, and on over the ends of lines: comments are wrapped.

use std::fs;
use std::path::{Path, PathBuf};

/// The phrases, from the repository's root.
const LIST: &str = "tests/words.txt";
/// Text files by the end of their name.
const ENDINGS: [&str; 15] = [
    ".rs", ".md", ".toml", ".v", ".vlt", ".cpp", ".py", ".pyi", ".ipynb", ".sh", ".case", ".yml", ".lpf", ".pcf",
    "Makefile",
];
/// Folders that hold no text of ours.
const SKIPPED: [&str; 4] = ["target", "build", "data", "corpus"];
/// What a line of a comment, or of a table, may begin with.
const MARKS: [&str; 7] = ["///", "//!", "//", "##", "#", "|", "*"];

/// A phrase that is not to be written.
#[derive(Debug, PartialEq)]
struct Phrase {
    words: String,
    /// Only where it is all of a comment's line.
    whole: bool,
    instead: String,
}

/// Reads the list.
fn phrases(text: &str) -> Vec<Phrase> {
    let lines = text.lines().zip(1..).filter(|(line, _)| !line.is_empty() && !line.starts_with('#'));
    let phrase = |(line, number): (&str, usize)| {
        let (words, instead) =
            line.split_once(" => ").unwrap_or_else(|| panic!("{LIST}:{number}: wanted `phrase => what to write`"));
        let whole = words.strip_prefix('^').and_then(|words| words.strip_suffix('$'));
        Phrase { words: whole.unwrap_or(words).to_lowercase(), whole: whole.is_some(), instead: instead.to_owned() }
    };
    lines.map(phrase).collect()
}

/// A line without the mark of a comment, and whether it had one.
fn unmarked(line: &str) -> (&str, bool) {
    let line = line.trim();
    let comment = MARKS.iter().find_map(|mark| line.strip_prefix(mark));
    match comment.or_else(|| line.split_once(" // ").map(|(_, comment)| comment)) {
        Some(text) => (text.trim(), true),
        None => (line, false),
    }
}

/// Lines and phrases of a text, in the order of the list.
fn found<'a>(text: &str, phrases: &'a [Phrase]) -> Vec<(usize, &'a Phrase)> {
    let lines: Vec<(String, bool)> = text.lines().map(unmarked).map(|(l, c)| (l.to_lowercase(), c)).collect();
    // The whole text in one line, and where each line of it begins.
    let (mut running, mut begins) = (String::new(), Vec::new());
    for (line, _) in &lines {
        begins.push(running.len());
        running.push_str(line);
        running.push(' ');
    }
    let mut found = Vec::new();
    for phrase in phrases {
        if phrase.whole {
            let same = lines.iter().zip(1..).filter(|((line, comment), _)| *comment && *line == phrase.words);
            found.extend(same.map(|(_, number)| (number, phrase)));
            continue;
        }
        for (at, _) in running.match_indices(&phrase.words) {
            let letter = |character: Option<char>| character.is_some_and(char::is_alphanumeric);
            let after = running[at + phrase.words.len()..].chars().next();
            if !letter(running[..at].chars().next_back()) && !letter(after) {
                found.push((begins.partition_point(|begin| *begin <= at), phrase));
            }
        }
    }
    found
}

/// All text files below a folder, in order.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut entries: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    let mut all = Vec::new();
    for path in entries {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            if !SKIPPED.contains(&name.as_str()) && (!name.starts_with('.') || name == ".ci") {
                all.extend(files(&path));
            }
        } else if ENDINGS.iter().any(|ending| name.ends_with(ending))
            || path.parent().and_then(Path::file_name).is_some_and(|folder| folder == ".ci")
        {
            all.push(path);
        }
    }
    all
}

#[test]
fn no_file_has_a_phrase_of_the_list() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let phrases = phrases(&fs::read_to_string(root.join(LIST)).unwrap());
    let files = files(&root);
    assert!(files.len() > 400, "{} files", files.len());
    let mut found_phrases = String::new();
    for path in files {
        let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let name = path.strip_prefix(&root).unwrap().display();
        for (line, phrase) in found(&text, &phrases) {
            found_phrases.push_str(&format!("{name}:{line}: {:?}; write: {}\n", phrase.words, phrase.instead));
        }
    }
    assert!(found_phrases.is_empty(), "phrases of {LIST}:\n{found_phrases}");
}

#[test]
fn a_phrase_is_found_with_its_line_whatever_its_case_and_line_breaks() {
    // Words that the list does not have: this file is read as well.
    let phrases = phrases("# a comment\n\na moon late => a moon later\n^Dolor.$ => a sentence\n");
    let lines = |text: &str| found(text, &phrases).iter().map(|(line, _)| *line).collect::<Vec<_>>();
    assert_eq!(phrases[1], Phrase { words: "dolor.".into(), whole: true, instead: "a sentence".into() });
    assert_eq!(lines("x\n/// told A Moon late: far\n"), [2]);
    assert_eq!(lines("x\n    //! it is told a\n    //! moon late.\n"), [2]);
    assert_eq!(lines("## `make` is a moon late\n"), [1]);
    // Another word, and another place.
    assert_eq!(lines("/// a moon later\n/// extra moon late\n"), [0usize; 0]);
    assert_eq!(lines("/// Dolor.\npub a: u8, // dolor.\n/// Dolor. And more.\nlet a = \"Dolor.\";\nDolor.\n"), [1, 2]);
}
