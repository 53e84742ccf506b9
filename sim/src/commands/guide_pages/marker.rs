//! Markers: HTML comments of a Markdown page that say which command prints a table, a piece of code or a figure in the text.
//!
//! ```text
//! <!-- table: COMMAND ; attribute: value ; … -->      may go on over several lines
//! | … |                                                what the command printed
//! <!-- end of table -->
//! <!-- code: COMMAND ; language: verilog -->
//! a fenced block                                       all that the command printed
//! <!-- end of code -->
//! … take <!-- figure: COMMAND ; row: sensor-1 ; column: cycles -->1278<!-- end of figure --> cycles, …
//! ```
//! A figure is a cell of a printed table: that in the row whose first cell is `row`. It stands within one line, and not first:
//! a comment at the beginning of a line ends a paragraph in Markdown.
//!
//! Code is skipped, so that a page can show a marker.

use std::ops::Range;

use anyhow::{bail, ensure, Result};

/// What a marker begins with, and the line behind its content: of a table, of code.
const KINDS: [(&str, &str); 2] = [("<!-- table:", "<!-- end of table -->"), ("<!-- code:", "<!-- end of code -->")];
/// What a figure in the text begins with, and ends with.
const FIGURE: [&str; 2] = ["<!-- figure:", "<!-- end of figure -->"];
/// What ends a comment.
const CLOSE: &str = "-->";
/// What begins and ends a block of code.
const FENCES: [&str; 2] = ["```", "~~~"];

/// A cell of a table.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cell {
    /// First cell of its row.
    pub row: String,
    /// Head of its column.
    pub column: String,
    /// Which of the figures in the cell that `/` separates, from 1; without it the whole cell.
    pub part: Option<usize>,
}

/// A table, a piece of code or a figure of a page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Marker {
    /// Line of the marker, from 1.
    pub line: usize,
    /// Prints the table or code.
    pub command: String,
    /// Prints a part of it in less time.
    pub check: Option<String>,
    /// Columns of the check's table to compare; without any all that the page has.
    pub check_columns: Vec<String>,
    /// Whether times of a machine are in the table, which no other run has: every check takes the check's command.
    pub measured: bool,
    /// Which of the printed tables, from 1.
    pub table: usize,
    /// Columns to keep; without any all.
    pub columns: Vec<String>,
    /// Language of code; `None` for a table.
    pub language: Option<String>,
    /// The cell of a figure; `None` for a table and code.
    pub cell: Option<Cell>,
    /// How long the command takes, for the reader of the page.
    pub takes: Option<String>,
    /// Bytes between the marker's line and the end's, of a figure between its comments.
    pub content: Range<usize>,
}

impl Marker {
    /// The check's command where it is to be taken, and there is one.
    pub fn quick_check(&self, quick: bool) -> Option<&str> {
        self.check.as_deref().filter(|_| quick || self.measured)
    }

    /// The line behind the content.
    fn end(&self) -> &'static str {
        KINDS[usize::from(self.language.is_some())].1
    }
}

/// The markers of a page, in order.
///
/// # Errors
/// Names page and line: a marker or comment without end, an end without marker, an attribute that is unknown, given
/// twice or wrong.
pub fn markers(page: &str, text: &str) -> Result<Vec<Marker>> {
    let mut markers = Vec::new();
    let mut lines = text.split_inclusive('\n').zip(1..);
    let (mut offset, mut fenced) = (0, false);
    let mut open: Option<Marker> = None;
    while let Some((line_text, number)) = lines.next() {
        let begin = offset;
        offset += line_text.len();
        let line = line_text.trim();
        if FENCES.iter().any(|fence| line.starts_with(fence)) {
            fenced = !fenced;
        } else if fenced {
            continue;
        } else if let Some((_, end)) = KINDS.iter().find(|(_, end)| *end == line) {
            let closes = |marker: &Marker| marker.end() == *end;
            let Some(mut marker) = open.take().filter(closes) else {
                bail!("{page}:{number}: `{end}` without a marker before it")
            };
            marker.content.end = begin;
            markers.push(marker);
        } else if let Some((begin, end)) = KINDS.iter().find(|(begin, _)| line.starts_with(begin)) {
            if let Some(marker) = &open {
                bail!("{}", unclosed(page, marker));
            }
            let mut comment = line.to_owned();
            while !comment.ends_with(CLOSE) {
                let Some((next, _)) = lines.next() else { bail!("{page}:{number}: the comment has no `{CLOSE}`") };
                offset += next.len();
                comment.extend([" ", next.trim()]);
            }
            let inner = comment[begin.len()..comment.len() - CLOSE.len()].trim();
            let mut marker = parse(inner).map_err(|reason| reason.context(format!("{page}:{number}")))?;
            (marker.line, marker.content) = (number, offset..offset);
            let is_code = *end == KINDS[1].1;
            ensure!(
                is_code == marker.language.is_some(),
                "{page}:{number}: code wants one attribute `language`, a table none"
            );
            ensure!(marker.cell.is_none(), "{page}:{number}: row, column and part are a figure's");
            open = Some(marker);
        } else {
            for figure in figures(line_text) {
                let (marker, content) = figure.map_err(|reason| reason.context(format!("{page}:{number}")))?;
                let content = begin + content.start..begin + content.end;
                markers.push(Marker { line: number, content, ..marker });
            }
        }
    }
    match &open {
        Some(marker) => bail!("{}", unclosed(page, marker)),
        None => Ok(markers),
    }
}

fn unclosed(page: &str, marker: &Marker) -> String {
    format!("{page}:{}: no `{}` behind what `{}` prints", marker.line, marker.end(), marker.command)
}

/// The figures in a line of text, each with the bytes between its comments.
fn figures(line: &str) -> Vec<Result<(Marker, Range<usize>)>> {
    let [begin, end] = FIGURE;
    let figure = |(at, _): (usize, &str)| {
        ensure!(!line[..at].trim().is_empty(), "a figure cannot begin a line");
        let inner = &line[at + begin.len()..];
        let Some((attributes, content)) = inner.split_once(CLOSE) else { bail!("the comment has no `{CLOSE}`") };
        let Some((content, _)) = content.split_once(end) else { bail!("no `{end}` in the line of a figure") };
        let marker = parse(attributes.trim())?;
        let whole = marker.cell.as_ref().is_some_and(|cell| !cell.row.is_empty() && !cell.column.is_empty());
        ensure!(whole, "a figure wants one attribute `row` and one `column`");
        let other = marker.check.is_some() || !marker.columns.is_empty() || marker.language.is_some();
        ensure!(!other, "check, columns and language are not a figure's");
        let from = at + begin.len() + attributes.len() + CLOSE.len();
        Ok((marker, from..from + content.len()))
    };
    // Between backticks stands an example.
    let is_code = |(at, _): &(usize, &str)| line[..*at].matches('`').count() % 2 == 1;
    line.match_indices(begin).filter(|found| !is_code(found)).map(figure).collect()
}

/// Command and attributes.
fn parse(inner: &str) -> Result<Marker> {
    let mut parts = inner.split(';').map(str::trim);
    let command = parts.next().filter(|command| !command.is_empty());
    let Some(command) = command else { bail!("a marker without a command") };
    let mut marker = Marker {
        line: 0,
        command: command.to_owned(),
        check: None,
        check_columns: Vec::new(),
        measured: false,
        table: 1,
        columns: Vec::new(),
        language: None,
        cell: None,
        takes: None,
        content: 0..0,
    };
    let mut seen = Vec::new();
    for part in parts {
        let Some((name, value)) = part.split_once(':') else { bail!("{part:?}: wanted `attribute: value`") };
        let (name, value) = (name.trim(), value.trim());
        ensure!(!value.is_empty() && !seen.contains(&name), "{name}: wanted one value");
        seen.push(name);
        match name {
            "check" => marker.check = Some(value.to_owned()),
            "check columns" => marker.check_columns = columns(value),
            "column" => marker.cell.get_or_insert_default().column = value.to_owned(),
            "columns" => marker.columns = columns(value),
            "language" => marker.language = Some(value.to_owned()),
            "measured" => {
                ensure!(value == "yes", "measured: {value:?} is not `yes`");
                marker.measured = true;
            }
            "part" => marker.cell.get_or_insert_default().part = Some(from_one(name, value)?),
            "row" => marker.cell.get_or_insert_default().row = value.to_owned(),
            "takes" => marker.takes = Some(value.to_owned()),
            "table" => marker.table = from_one(name, value)?,
            _ => bail!(
                "unknown attribute {name:?}; known: check, check columns, column, columns, language, measured, part, row, table, takes"
            ),
        }
    }
    ensure!(marker.check_columns.is_empty() || marker.check.is_some(), "check columns: there is no check");
    ensure!(!marker.measured || marker.check.is_some(), "measured: there is no check");
    Ok(marker)
}

/// A number from 1.
fn from_one(name: &str, value: &str) -> Result<usize> {
    match value.parse() {
        Ok(number) if number > 0 => Ok(number),
        _ => bail!("{name}: {value:?}: wanted a number from 1"),
    }
}

/// Heads of columns, which may hold commas.
fn columns(value: &str) -> Vec<String> {
    value.split('|').map(|column| column.trim().to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(text: &str) -> String {
        format!("{:#}", markers("a.md", text).unwrap_err())
    }

    #[test]
    fn attributes_lines_and_content() {
        let text =
            "x\n<!-- table: dermis a --b ; check: dermis c; table: 2\n     ; columns: µs, max | n ; takes: 3 s -->\n\
                    | 1 |\n<!-- end of table -->\n<!-- table: dermis d -->\n<!-- end of table -->\n";
        let found = markers("a.md", text).unwrap();
        assert_eq!(found.len(), 2);
        let first = &found[0];
        assert_eq!((first.line, first.command.as_str(), first.table), (2, "dermis a --b", 2));
        assert_eq!((first.check.as_deref(), first.takes.as_deref()), (Some("dermis c"), Some("3 s")));
        assert_eq!(first.columns, ["µs, max", "n"]);
        assert_eq!(&text[first.content.clone()], "| 1 |\n");
        assert_eq!((found[1].line, &text[found[1].content.clone()]), (6, ""));
    }

    #[test]
    fn what_is_not_closed_is_named_with_page_and_line() {
        let open = "a\n<!-- table: dermis a -->\n| 1 |\n";
        assert_eq!(error(open), "a.md:2: no `<!-- end of table -->` behind what `dermis a` prints");
        assert_eq!(error(&format!("{open}{open}")), error(open));
        assert_eq!(error("\n<!-- table: dermis a\n"), "a.md:2: the comment has no `-->`");
        assert_eq!(error("<!-- end of table -->"), "a.md:1: `<!-- end of table -->` without a marker before it");
    }

    #[test]
    fn wrong_attributes_are_named() {
        let of = |attribute: &str| error(&format!("<!-- table: dermis a ; {attribute} -->\n<!-- end of table -->\n"));
        assert!(of("colums: a").starts_with("a.md:1: unknown attribute \"colums\"; known: check, "));
        assert_eq!(of("table: 0"), "a.md:1: table: \"0\": wanted a number from 1");
        assert_eq!(of("takes"), "a.md:1: \"takes\": wanted `attribute: value`");
        assert_eq!(of("takes: 1 s ; takes: 2 s"), "a.md:1: takes: wanted one value");
        assert_eq!(of("check columns: a"), "a.md:1: check columns: there is no check");
        assert_eq!(of("measured: yes"), "a.md:1: measured: there is no check");
        assert_eq!(of("measured: no ; check: dermis b"), "a.md:1: measured: \"no\" is not `yes`");
        assert_eq!(error("<!-- table: ; check: dermis b -->"), "a.md:1: a marker without a command");
    }

    #[test]
    fn code_has_a_language_and_its_own_end() {
        let text =
            "<!-- code: dermis a ; language: rust -->\n```rust\n<!-- end of code -->\n```\n<!-- end of code -->\n";
        let found = markers("a.md", text).unwrap();
        assert_eq!(found[0].language.as_deref(), Some("rust"));
        assert_eq!(&text[found[0].content.clone()], "```rust\n<!-- end of code -->\n```\n");
        assert!(error("<!-- code: dermis a -->\n<!-- end of code -->\n").contains("wants one attribute `language`"));
        assert!(error("<!-- code: dermis a ; language: rust -->\n<!-- end of table -->\n").contains("without a marker"));
    }

    #[test]
    fn figures_stand_in_the_text() {
        let figure =
            |attributes: &str| format!("takes <!-- figure: dermis a ; {attributes} -->12<!-- end of figure --> µs");
        let text = format!("µ\n  {}, {}\n", figure("row: p ; column: x, y"), figure("row: q ; column: z ; part: 2"));
        let found = markers("a.md", &text).unwrap();
        let cells: Vec<Cell> = found.iter().filter_map(|marker| marker.cell.clone()).collect();
        assert_eq!(cells[0], Cell { row: "p".into(), column: "x, y".into(), part: None });
        assert_eq!(cells[1], Cell { row: "q".into(), column: "z".into(), part: Some(2) });
        assert!(found.iter().all(|marker| marker.line == 2 && &text[marker.content.clone()] == "12"));
        assert_eq!(error(&figure("row: p")), "a.md:1: a figure wants one attribute `row` and one `column`");
        assert!(error(&figure("row: p ; column: x ; check: dermis b")).ends_with("are not a figure's"));
        assert!(error(&figure("row: p ; column: x ; part: 0")).ends_with("wanted a number from 1"));
        let open = "a <!-- figure: dermis a ; row: p ; column: x -->12\n<!-- end of figure -->\n";
        assert_eq!(error(open), "a.md:1: no `<!-- end of figure -->` in the line of a figure");
        assert_eq!(error("a <!-- figure: dermis a\n"), "a.md:1: the comment has no `-->`");
        assert_eq!(error(" <!-- figure: dermis a -->"), "a.md:1: a figure cannot begin a line");
        let table = "<!-- table: dermis a ; row: p -->\n<!-- end of table -->\n";
        assert_eq!(error(table), "a.md:1: row, column and part are a figure's");
        for code in [format!("```text\n{text}```\n"), format!("- write `{}`\n", figure("row: … ; column: …"))] {
            assert_eq!(markers("a.md", &code).unwrap(), []);
        }
    }

    #[test]
    fn code_is_skipped() {
        let text = "```text\n<!-- table: dermis a -->\n```\n";
        assert_eq!(markers("a.md", text).unwrap(), []);
    }
}
