//! Document: what a report holds, before it becomes HTML, Markdown, CSV or JSON.
//!
//! Every figure is a [`Cell`] with its number beside its text: pages show the text, CSV and JSON take the number, so
//! that all four forms say the same.

use crate::compare::median;

/// A report.
#[derive(Clone, Debug)]
pub struct Document {
    /// Name of its files.
    pub name: &'static str,
    /// Headline.
    pub title: String,
    /// Paragraphs below it.
    pub intro: Vec<String>,
    /// In the order of use to a reader.
    pub sections: Vec<Section>,
}

/// A part under a heading.
#[derive(Clone, Debug)]
pub struct Section {
    /// Anchor, unique in the document.
    pub id: &'static str,
    /// Heading.
    pub title: String,
    /// In order.
    pub items: Vec<Item>,
}

/// Something in a section.
#[derive(Clone, Debug)]
pub enum Item {
    /// A paragraph.
    Text(String),
    /// A table.
    Table(Table),
    /// Pictures side by side where there is room.
    Pictures(Vec<Picture>),
}

/// A table.
#[derive(Clone, Debug)]
pub struct Table {
    /// Name of its CSV file, unique in the document.
    pub id: String,
    /// What it shows, with units that the heads do not name.
    pub caption: String,
    /// Of the columns.
    pub head: Vec<&'static str>,
    /// Each as long as the head.
    pub rows: Vec<Vec<Cell>>,
    /// Long: shut until a reader opens it.
    pub collapsed: bool,
}

/// A picture.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Name of its SVG file, unique in the document.
    pub id: String,
    /// What it shows.
    pub caption: String,
    /// In the roles of [`super::style`].
    pub svg: String,
}

/// A cell of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// As shown.
    pub shown: String,
    /// The number behind it, in the column's unit (fractions for percent).
    pub number: Option<f64>,
}

impl Table {
    /// A table that is open.
    pub fn new(id: impl Into<String>, caption: impl Into<String>, head: &[&'static str], rows: Vec<Vec<Cell>>) -> Self {
        Table { id: id.into(), caption: caption.into(), head: head.to_vec(), rows, collapsed: false }
    }

    /// The same, shut.
    pub fn collapsed(self) -> Self {
        Table { collapsed: true, ..self }
    }

    /// Whether a column holds numbers, which are aligned to the right.
    pub fn is_number(&self, column: usize) -> bool {
        self.rows.iter().any(|row| row[column].number.is_some())
    }
}

/// Words.
pub fn text_cell(text: impl Into<String>) -> Cell {
    Cell { shown: text.into(), number: None }
}

/// Nothing to say.
pub fn empty_cell() -> Cell {
    text_cell("–")
}

/// A count.
pub fn count(n: u64) -> Cell {
    Cell { shown: n.to_string(), number: Some(n as f64) }
}

/// A fraction, shown in percent with two significant digits or more.
pub fn percent(fraction: Option<f64>) -> Cell {
    fraction.map_or_else(empty_cell, |f| Cell { shown: percent_text(f), number: Some(f) })
}

/// A fraction as text.
pub fn percent_text(f: f64) -> String {
    let decimals = if f.abs() < 0.1 { 2 } else { usize::from(f.abs() < 1.0) };
    format!("{:.decimals$} %", 100.0 * f)
}

/// A number with `decimals`.
pub fn decimal(value: Option<f64>, decimals: usize) -> Cell {
    value.map_or_else(empty_cell, |v| Cell { shown: format!("{v:.decimals$}"), number: Some(v) })
}

/// A time in seconds, shown in the unit that suits.
pub fn seconds(s: Option<f64>) -> Cell {
    s.map_or_else(empty_cell, |s| Cell { shown: seconds_text(s), number: Some(s) })
}

/// A time in seconds as text: three digits and the unit that suits.
pub fn seconds_text(s: f64) -> String {
    let (value, unit) = match s {
        s if s >= 1.0 => (s, "s"),
        s if s >= 1e-3 => (1e3 * s, "ms"),
        s => (1e6 * s, "µs"),
    };
    let decimals = if value >= 100.0 { 0 } else { 1 + usize::from(value < 10.0) };
    format!("{value:.decimals$} {unit}")
}

/// The median as a cell in percent.
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
