//! Content of a report, independent of its output format (HTML, Markdown, CSV, JSON).
//!
//! Every value of a table is a [`Cell`] with both its text and its number: HTML and Markdown show the text, CSV and
//! JSON contain the number.

use dermis_golden::quantile::median;

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

/// A value with two significant digits, without trailing zeros; below 10⁻⁴ as a multiple of a power of ten.
pub fn two_digits(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let trimmed = |text: String| match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    };
    if value.abs() < 1e-4 {
        let text = format!("{value:.1e}");
        let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        let raised = exponent.chars().map(|c| match c.to_digit(10) {
            Some(digit) => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][digit as usize],
            None => '⁻',
        });
        return format!("{}·10{}", trimmed(digits.to_owned()), raised.collect::<String>());
    }
    let decimals = (1.0 - value.abs().log10().floor()).clamp(0.0, 9.0) as usize;
    trimmed(format!("{value:.decimals$}"))
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
        assert_eq!([100.0, 30.0, 3.0, 0.5, 0.015].map(two_digits), ["100", "30", "3", "0.5", "0.015"]);
        // A difference far below an LSB is neither 0.0 nor in the notation of a program.
        let small = [0.0, 0.00012, 1.23e-5, 2e-12, -3.1e-7].map(two_digits);
        assert_eq!(small, ["0", "0.00012", "1.2·10⁻⁵", "2·10⁻¹²", "-3.1·10⁻⁷"]);
    }
}
