//! Content of a report, independent of its output format (HTML, Markdown, CSV, JSON).
//!
//! Every value of a table is a [`Cell`] with both its text and its number: HTML and Markdown show the text, CSV and
//! JSON contain the number.

use crate::compare::median;

/// A report.
#[derive(Clone, Debug)]
pub struct Document {
    /// Base name of its files.
    pub name: &'static str,
    /// Title.
    pub title: String,
    /// Paragraphs below the title.
    pub intro: Vec<String>,
    /// Sections in order.
    pub sections: Vec<Section>,
}

/// A section with a heading.
#[derive(Clone, Debug)]
pub struct Section {
    /// Anchor, unique in the document.
    pub id: &'static str,
    /// Heading.
    pub title: String,
    /// Content in order.
    pub items: Vec<Item>,
}

/// An element of a section.
#[derive(Clone, Debug)]
pub enum Item {
    /// A paragraph.
    Text(String),
    /// A table.
    Table(Table),
    /// Pictures, side by side if there is room.
    Pictures(Vec<Picture>),
}

/// A table.
#[derive(Clone, Debug)]
pub struct Table {
    /// Name of its CSV file, unique in the document.
    pub id: String,
    /// Caption, with units that the column headers do not name.
    pub caption: String,
    /// Column headers.
    pub head: Vec<&'static str>,
    /// Rows; each has as many cells as there are columns.
    pub rows: Vec<Vec<Cell>>,
    /// Whether the HTML page shows it only after a click, for long tables.
    pub collapsed: bool,
}

/// A picture.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Name of its SVG file, unique in the document.
    pub id: String,
    /// Caption.
    pub caption: String,
    /// SVG in the placeholder colours of [`super::style`].
    pub svg: String,
}

/// A cell of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// Text as shown.
    pub shown: String,
    /// Its value in the column's unit (fractions for percent); none for text.
    pub number: Option<f64>,
}

impl Table {
    /// A table that is shown at once.
    pub fn new(id: impl Into<String>, caption: impl Into<String>, head: &[&'static str], rows: Vec<Vec<Cell>>) -> Self {
        Table { id: id.into(), caption: caption.into(), head: head.to_vec(), rows, collapsed: false }
    }

    /// The same table, collapsed.
    pub fn collapsed(self) -> Self {
        Table { collapsed: true, ..self }
    }

    /// Whether a column contains numbers, which are right-aligned.
    pub fn is_number(&self, column: usize) -> bool {
        self.rows.iter().any(|row| row[column].number.is_some())
    }
}

/// A cell with text.
pub fn text_cell(text: impl Into<String>) -> Cell {
    Cell { shown: text.into(), number: None }
}

/// A cell without value.
pub fn empty_cell() -> Cell {
    text_cell("–")
}

/// A cell with a count.
pub fn count(n: u64) -> Cell {
    Cell { shown: n.to_string(), number: Some(n as f64) }
}

/// A cell with a fraction, shown in percent with at least two significant digits.
pub fn percent(fraction: Option<f64>) -> Cell {
    fraction.map_or_else(empty_cell, |f| Cell { shown: percent_text(f), number: Some(f) })
}

/// A fraction in percent as text.
pub fn percent_text(f: f64) -> String {
    let decimals = if f.abs() < 0.1 { 2 } else { usize::from(f.abs() < 1.0) };
    format!("{:.decimals$} %", 100.0 * f)
}

/// A cell with a number, shown with `decimals` decimals.
pub fn decimal(value: Option<f64>, decimals: usize) -> Cell {
    value.map_or_else(empty_cell, |v| Cell { shown: format!("{v:.decimals$}"), number: Some(v) })
}

/// A cell with a time in seconds, shown in s, ms or µs.
pub fn seconds(s: Option<f64>) -> Cell {
    s.map_or_else(empty_cell, |s| Cell { shown: seconds_text(s), number: Some(s) })
}

/// A time in seconds as text: three significant digits, in s, ms or µs.
pub fn seconds_text(s: f64) -> String {
    let (value, unit) = match s {
        s if s >= 1.0 => (s, "s"),
        s if s >= 1e-3 => (1e3 * s, "ms"),
        s => (1e6 * s, "µs"),
    };
    let decimals = if value >= 100.0 { 0 } else { 1 + usize::from(value < 10.0) };
    format!("{value:.decimals$} {unit}")
}

/// A cell with the median of fractions, in percent.
pub fn median_percent(values: impl Iterator<Item = Option<f64>>) -> Cell {
    percent(median(values.flatten().collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_by_hand() {
        let times =
            [(2705.33, "2705 s"), (16.43, "16.4 s"), (1.6e-6, "1.60 µs"), (58.68e-3, "58.7 ms"), (1e-3, "1.00 ms")];
        for (s, text) in times {
            assert_eq!(seconds_text(s), text);
        }
        assert_eq!([0.0107, -0.455, 1.75].map(percent_text), ["1.07 %", "-45.5 %", "175 %"]);
        assert_eq!(percent(None), empty_cell());
    }
}
