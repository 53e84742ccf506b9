//! The layout of a text, found from its lines.

use std::borrow::Cow;
use std::fmt;

use super::cells::{point, Digits, Separator};
use super::columns::{is_known, Columns, Found};
use super::time::TimeUnit;
use super::{reading, Line, NoReadings};

/// Lines from which a layout is found.
const LOOKED_AT: usize = 256;

/// How frames stand in a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// A line is a frame, in the order of the rows.
    Line,
    /// A line is a row; a frame follows the one before, with or without a blank line or a heading between them.
    Grid,
}

/// What is stated of a layout; what is `None` is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stated {
    /// First and last column of the readings, from 1.
    pub columns: Option<[usize; 2]>,
    /// Column of the time, from 1.
    pub time_column: Option<usize>,
    /// Lines at the begin that hold no readings.
    pub skip_rows: usize,
    /// Frame per line, or grid.
    pub form: Option<Form>,
}

/// The layout of a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// What stands between two cells.
    pub separator: Separator,
    pub(super) digits: Digits,
    /// Cells of a line, with the empty one behind a separator at its end.
    pub(super) cells: usize,
    /// The last cell is the empty one behind a separator at the end, which a line may lack.
    trailing: bool,
    /// First column of the readings, from 0.
    pub(super) first: usize,
    /// Readings of a line.
    pub(super) readings: usize,
    /// Column of the time, from 0, and its unit.
    pub time: Option<(usize, TimeUnit)>,
    /// Frame per line, or grid.
    pub form: Form,
    /// Lines of a frame.
    pub(super) lines: usize,
    /// A blank line ends a frame of a grid.
    pub(super) blocks: bool,
    /// Number of the first line with readings; those before are the header.
    pub first_line: usize,
    /// Number of the line with the names or numbers of the columns, if there is one.
    names_line: Option<usize>,
    /// The first line has the numbers of the columns, unless a line follows that shows it to be a frame.
    pub(super) may_be_numbers: bool,
    /// The readings of the only line are 0, 1, 2 … or 1, 2, 3 …
    counts: bool,
    /// A column that seems to be a time in a form that is not read, from 0, and its first cell.
    unread: Option<(usize, String)>,
}

/// A line split at a separator.
struct SplitLine<'s> {
    line: Line<'s>,
    cells: Vec<Cow<'s, str>>,
    /// Whether it [has numbers](has_numbers).
    numeric: bool,
}

/// Lines split at one separator.
struct Table<'s> {
    separator: Separator,
    rows: Vec<SplitLine<'s>>,
    /// Cells of most lines that have numbers.
    cells: usize,
    /// The last cell of these is always empty.
    trailing: bool,
}

impl Layout {
    /// The layout of `lines` of an array of `[rows, cols]`.
    ///
    /// # Errors
    /// No layout that fits, or more than one.
    pub fn of_lines(lines: &[Line], shape: [usize; 2], stated: &Stated) -> Result<Layout, NoReadings> {
        if lines.is_empty() {
            return Err(NoReadings::of_text("no line with readings"));
        }
        let all = Separator::ALL.into_iter().filter_map(|separator| Table::of(separator, lines));
        // The reason of the separator that finds most cells.
        let mut closest: Option<(usize, NoReadings)> = None;
        for table in all {
            match table.layout(shape, stated) {
                Ok(layout) => return Ok(layout),
                Err(error) if closest.as_ref().is_none_or(|(cells, _)| table.cells > *cells) => {
                    closest = Some((table.cells, error));
                }
                Err(_) => (),
            }
        }
        let [rows, cols] = shape;
        Err(closest.map(|(_, error)| error).unwrap_or_else(|| {
            NoReadings::of_line(&lines[0], format!("no numbers, wanted {} of {rows}x{cols} taxels", rows * cols))
        }))
    }

    /// Whether lines are readings separated by commas, and nothing else.
    pub fn is_plain(&self) -> bool {
        self.separator == Separator::Comma && self.readings == self.cells
    }

    /// The cells of a line.
    pub(super) fn split<'t>(&self, text: &'t str) -> Vec<Cow<'t, str>> {
        self.separator.cells(text)
    }

    /// Readings of a line, NaN where one is missing.
    pub(super) fn readings_of(&self, line: &Line, cells: &[Cow<str>]) -> Result<Vec<f64>, NoReadings> {
        let ends_without =
            self.trailing && cells.len() + 1 == self.cells && cells.last().is_some_and(|cell| !cell.is_empty());
        if cells.len() != self.cells && !ends_without {
            let empty = usize::from(self.trailing);
            let got = cells.len() - empty.min(usize::from(cells.last().is_some_and(|cell| cell.is_empty())));
            let none = NoReadings::of_line(line, format!("{got} values, wanted {}", self.cells - empty));
            // A remark of the device is none of its frames.
            return Err(if has_numbers(cells) { none.cut() } else { none });
        }
        let own = (self.first..self.first + self.readings).map(|column| {
            let cell = &cells[column];
            self.digits.reading(cell).map_err(|reason| {
                let none = NoReadings::of_cell(line, column + 1, reason);
                // A word in place of a number, such as `inf`, is no part of one.
                if cell.contains(|c: char| c.is_ascii_digit()) {
                    none.cut()
                } else {
                    none
                }
            })
        });
        own.collect()
    }

    /// Whether a reading among the cells of a line would be another number without one of its digits, and be read.
    pub(super) fn hides_a_lost_digit(&self, cells: &[Cow<str>]) -> bool {
        cells.iter().skip(self.first).take(self.readings).any(|cell| self.digits.hide_a_lost_digit(cell))
    }

    /// The cells of a line that are readings.
    pub(super) fn readings_as_written<'t>(&self, line: &'t str) -> impl Iterator<Item = Cow<'t, str>> {
        self.split(line).into_iter().skip(self.first).take(self.readings)
    }

    /// The last cell of a line, if it may be the begin of a longer one.
    pub(super) fn cut_cell<'t>(&self, line: &'t str) -> Option<Cow<'t, str>> {
        let mut cells = self.split(line);
        let is_reading = cells.len() == self.first + self.readings;
        cells.pop().filter(|cell| !is_reading || self.digits.may_be_cut(cell))
    }

    /// Whether the other layout reads lines alike: all but the number of the first line.
    pub(super) fn is_like(&self, other: &Layout) -> bool {
        (self.separator, self.cells, self.first) == (other.separator, other.cells, other.first)
    }

    /// Whether the cells of a line between the rows of a grid are a heading: words, or some of another number.
    pub(super) fn is_heading(&self, cells: &[Cow<str>]) -> bool {
        let numbers = cells.iter().filter(|cell| reading(&point(cell)).is_some_and(f64::is_finite)).count();
        numbers == 0 || (cells.len() != self.cells && 2 * numbers <= cells.len())
    }

    /// Whether a line before the first readings is a part of the header: its names, or fewer numbers than half of a line's readings.
    pub(super) fn is_header(&self, line: &Line) -> bool {
        let cells = self.split(line.text);
        let numbers = cells.iter().filter(|cell| reading(&point(cell)).is_some_and(f64::is_finite)).count();
        Some(line.number) == self.names_line || 2 * numbers < self.readings
    }

    /// Whether a line of its own shows which of its cells are the readings: it has no other ones.
    pub(super) fn is_sure(&self) -> bool {
        self.readings == self.cells && !self.counts
    }

    /// Whether the other layout reads lines alike, times too.
    pub(super) fn reads_as(&self, other: &Layout) -> bool {
        self.is_like(other) && (self.time, self.form) == (other.time, other.form)
    }
}

impl<'s> Table<'s> {
    /// The lines split at a separator; `None` if no line has numbers.
    fn of(separator: Separator, lines: &[Line<'s>]) -> Option<Table<'s>> {
        let split = |line: &Line<'s>| {
            let cells = separator.cells(line.text);
            SplitLine { line: *line, numeric: has_numbers(&cells), cells }
        };
        let rows: Vec<SplitLine> = lines.iter().take(LOOKED_AT).map(split).collect();
        let mut counts: Vec<usize> = rows.iter().filter(|row| row.numeric).map(|row| row.cells.len()).collect();
        counts.sort_unstable();
        let cells = counts.chunk_by(|a, b| a == b).max_by_key(|equal| equal.len())?[0];
        let mut table = Table { separator, cells, trailing: false, rows };
        table.trailing = cells > 1 && table.body(0).all(|cells| cells[cells.len() - 1].is_empty());
        Some(table)
    }

    /// Whether a line has numbers, and as many cells as most that have.
    fn is_like_most(&self, row: &SplitLine) -> bool {
        row.numeric && row.cells.len() == self.cells
    }

    /// Cells of the lines from `first` on that are like most.
    fn body(&self, first: usize) -> impl Iterator<Item = &Vec<Cow<'s, str>>> + Clone {
        self.rows[first..].iter().filter(|row| self.is_like_most(row)).map(|row| &row.cells)
    }

    /// The layout with this separator.
    fn layout(&self, [rows, cols]: [usize; 2], stated: &Stated) -> Result<Layout, NoReadings> {
        // A table has a line with numbers.
        let mut first = self.rows.iter().position(|row| self.is_like_most(row)).unwrap_or(0);
        let at_first = |reason: String| NoReadings::of_line(&self.rows[first].line, reason);
        let (form, readings) = self.form([rows, cols], stated).map_err(at_first)?;
        let lines = if form == Form::Line { 1 } else { rows };
        let before = first.checked_sub(1).map(|before| &self.rows[before].cells);
        let mut names = before.filter(|names| names.len() == self.cells);
        let data = self.body(first).count();
        let is_numbered = self.is_numbered(first, readings);
        if is_numbered && data > lines && (data - 1).is_multiple_of(lines) {
            names = Some(&self.rows[first].cells);
            first += 1;
        }
        let at_first = |reason: String| NoReadings::of_line(&self.rows[first].line, reason);
        let found = self
            .columns(first, names, readings, stated)
            .map_err(|reason| NoReadings { open: true, ..at_first(reason) })?;
        let of_readings: Vec<&str> = self
            .body(first)
            .flat_map(|cells| cells[found.first..found.first + readings].iter().map(Cow::as_ref))
            .collect();
        if let Some(cell) = Digits::thousands(of_readings.iter().copied()) {
            let plain = cell.replace(',', "");
            let point = point(cell);
            return Err(at_first(format!(
                "{cell:?} can be {plain} with a mark of thousands or {point} with a decimal comma; write numbers with a decimal \
                 point, and without marks of thousands"
            )));
        }
        let layout = Layout {
            separator: self.separator,
            digits: Digits::of_cells(of_readings.iter().copied()),
            cells: self.cells,
            trailing: self.trailing && found.first + readings < self.cells,
            first: found.first,
            readings,
            time: found.time,
            form,
            lines,
            blocks: form == Form::Grid && self.has_blocks(first, lines),
            first_line: self.rows[first].line.number,
            names_line: names.and(first.checked_sub(1)).map(|before| self.rows[before].line.number),
            may_be_numbers: is_numbered && data == 1,
            counts: data == 1 && self.counts(first, readings),
            unread: found.unread.and_then(|column| Some((column, self.body(first).next()?[column].to_string()))),
        };
        self.check(first, &layout)?;
        Ok(layout)
    }

    /// Frame per line or grid, and the readings of a line.
    fn form(&self, [rows, cols]: [usize; 2], stated: &Stated) -> Result<(Form, usize), String> {
        let (taxels, got) = (rows * cols, self.cells);
        let of = |form: Form| (form, if form == Form::Line { taxels } else { cols });
        if let Some([a, b]) = stated.columns {
            let forms =
                [Form::Line, Form::Grid].into_iter().filter(|form| stated.form.is_none_or(|wanted| wanted == *form));
            let fits = forms.map(of).find(|(_, readings)| a >= 1 && b + 1 == a + readings && b <= got);
            return fits.ok_or_else(|| {
                format!("--columns {a}..{b} of {got}, wanted {taxels} columns of a frame or {cols} of a row")
            });
        }
        let whole = self
            .body(0)
            .flatten()
            .all(|cell| cell.trim_start_matches(['-', '+']).bytes().all(|byte| byte.is_ascii_digit()));
        if self.separator == Separator::Comma && whole && [2 * taxels, 2 * cols].contains(&got) && got != taxels {
            let wanted = if got == 2 * cols { cols } else { taxels };
            return Err(format!(
                "{got} values, wanted {wanted}; a decimal mark is a point where commas separate values"
            ));
        }
        let count = got - usize::from(self.trailing);
        match stated.form {
            Some(form) if count >= of(form).1 || got == of(form).1 => Ok(of(form)),
            None if got == taxels || count >= taxels => Ok(of(Form::Line)),
            None if got == cols || count == cols => Ok(of(Form::Grid)),
            Some(form) => Err(format!("{count} values, wanted {}", of(form).1)),
            None => {
                let numbered = count > cols && self.numbers_rows(rows);
                let hint = if numbered { "; --columns A..B says which are the readings of a row" } else { "" };
                Err(format!("{count} values, wanted {taxels} of a frame or {cols} of a row{hint}"))
            }
        }
    }

    /// Whether the first column has the numbers of rows, from 0 or 1 on, anew in each frame or not.
    fn numbers_rows(&self, rows: usize) -> bool {
        let numbers = || self.body(0).map(|cells| cells[0].parse::<usize>().ok()).enumerate();
        let count = |first: usize, anew: usize| numbers().all(|(k, number)| number == Some(first + k % anew));
        self.body(0).count() > 1 && [0, 1].into_iter().any(|first| count(first, rows) || count(first, usize::MAX))
    }

    /// The columns of the readings and of the time in the lines from `first` on.
    fn columns(
        &self,
        first: usize,
        names: Option<&Vec<Cow<str>>>,
        readings: usize,
        stated: &Stated,
    ) -> Result<Found, String> {
        let column = |column: usize| self.body(first).map(|cells| cells[column].as_ref()).collect::<Vec<&str>>();
        let cells: Vec<Vec<&str>> = (0..self.cells).map(column).collect();
        let mut columns = Columns { cells, names: names.map(|names| names.iter().map(Cow::as_ref).collect()) };
        let time = stated.time_column.map(|column| column.saturating_sub(1));
        if let Some([a, _]) = stated.columns {
            return columns.stated(a - 1, readings, time);
        }
        // A last column that is always empty is none, unless it makes up the number of readings.
        if self.trailing && self.cells > readings && !(time.is_some() && self.cells == readings + 1) {
            columns.drop_last();
            if self.cells == readings + 1 && columns.begins_with_time() {
                return Err(format!(
                    "the last column is empty: a separator behind each line (--columns 1..{readings}), or a time in front and a \
                     reading that is always missing (--time-column 1)"
                ));
            }
        }
        let found = columns.find(readings, time)?;
        columns.check_names(found.first, readings)?;
        Ok(found)
    }

    /// Whether the line `first` has the numbers of the columns of readings, from 0 or 1 on, and names of the others; from 1 on
    /// without names of nine and more, or above numbers with decimals.
    fn is_numbered(&self, first: usize, readings: usize) -> bool {
        let cells = &self.rows[first].cells;
        if !self.counts(first, readings) {
            return false;
        }
        let is_text = |cell: &str| reading(&point(cell)).is_none() && TimeUnit::of_column(&[cell], None).is_none();
        // A name stands over cells of another kind, a label over labels.
        let is_name = |column: usize| {
            let mut below = self.body(first + 1).map(|cells| &cells[column]);
            is_text(&cells[column])
                && (is_known(&cells[column]) || below.any(|cell| !cell.is_empty() && !is_text(cell)))
        };
        let mut others = (0..cells.len()).filter(|column| cells[*column].parse::<usize>().is_err());
        let names = others.clone().filter(|column| is_name(*column)).count();
        others.all(|column| cells[column].is_empty() || is_name(column)) && {
            // Numbers from 1 on can be readings, but hardly where all others have decimals.
            let from_zero = cells.iter().any(|cell| cell == "0");
            let has_decimals = |cells: &Vec<Cow<str>>| cells.iter().any(|cell| cell.contains(['.', ',']));
            let mut below = self.body(first + 1).peekable();
            names > 0 || from_zero || readings >= 9 || below.peek().is_some() && below.all(has_decimals)
        }
    }

    /// Whether the readings of the line `first` are 0, 1, 2 … or 1, 2, 3 …, and no other of its cells is a whole number.
    fn counts(&self, first: usize, readings: usize) -> bool {
        let numbers: Vec<usize> = self.rows[first].cells.iter().filter_map(|cell| cell.parse().ok()).collect();
        let from = |first: usize| numbers.iter().enumerate().all(|(k, number)| *number == k + first);
        numbers.len() == readings && readings > 1 && (from(0) || from(1))
    }

    /// Whether frames of `lines` lines stand apart, by blank lines or headings.
    fn has_blocks(&self, first: usize, lines: usize) -> bool {
        let rows = self.rows[first..].iter().filter(|row| self.is_like_most(row));
        let numbers: Vec<usize> = rows.map(|row| row.line.number).collect();
        let runs: Vec<usize> = numbers.chunk_by(|a, b| a + 1 == *b).map(<[usize]>::len).collect();
        runs.len() > 1 && 2 * runs.iter().filter(|run| **run == lines).count() >= runs.len()
    }

    /// Checks that at least half of the lines with numbers have readings.
    fn check(&self, first: usize, layout: &Layout) -> Result<(), NoReadings> {
        let rows = self.rows[first..].iter().filter(|row| row.numeric);
        let unfit: Vec<Option<NoReadings>> = rows.map(|row| layout.readings_of(&row.line, &row.cells).err()).collect();
        match unfit.iter().flatten().count() * 2 > unfit.len() {
            true => unfit.into_iter().flatten().next().map_or(Ok(()), Err),
            false => Ok(()),
        }
    }
}

/// Whether at least half of a line's cells that are not empty are numbers.
pub(super) fn has_numbers(cells: &[Cow<str>]) -> bool {
    let filled = cells.iter().filter(|cell| !cell.is_empty());
    let is_number = |cell: &Cow<str>| reading(&point(cell)).is_some();
    let (numbers, others): (Vec<_>, Vec<_>) = filled.partition(|cell| is_number(cell));
    numbers.iter().any(|cell| reading(&point(cell)).is_some_and(f64::is_finite)) && numbers.len() >= others.len()
}

impl fmt::Display for Layout {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let mark = if self.digits.mark == Some(',') { ", decimal commas" } else { "" };
        let header = match self.first_line {
            1 => String::new(),
            line => format!(", header above line {line}"),
        };
        let time =
            self.time.map_or(String::new(), |(column, unit)| format!(", time in column {} ({unit})", column + 1));
        let (a, b) = (self.first + 1, self.first + self.readings);
        let form = match self.form {
            Form::Line => "a frame per line".to_owned(),
            Form::Grid => format!("a grid of {} lines per frame", self.lines),
        };
        write!(f, "{form}, separated by {}{mark}{header}{time}, readings in columns {a} to {b}", self.separator)?;
        match &self.unread {
            Some((column, cell)) => {
                write!(f, "; no time is read from column {}, {cell:?}: ISO 8601 and numbers are", column + 1)
            }
            None => Ok(()),
        }
    }
}
