//! Tables of Markdown text: reading, selecting columns, comparing.
//!
//! Cells are compared without the spaces that align them.

use std::fmt;

use anyhow::{anyhow, bail, ensure, Result};

use super::marker::Cell;
use dermis_report::aligned;

/// A table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Table {
    /// Heads of the columns.
    pub head: Vec<String>,
    /// Each as long as the head.
    pub rows: Vec<Vec<String>>,
    /// Leading columns that hold words, aligned to the left.
    pub labels: usize,
}

/// The first row in which two tables differ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// On the page; `None` where it has no such row.
    pub page: Option<String>,
    /// As the command prints it; `None` where it prints none.
    pub command: Option<String>,
}

impl Difference {
    /// The first line in which two texts differ.
    pub fn of_lines(page: &str, command: &str) -> Option<Self> {
        let (mut page, mut command) = (page.lines(), command.lines());
        loop {
            let pair = (page.next(), command.next());
            if pair.0 != pair.1 {
                return Some(Difference { page: pair.0.map(str::to_owned), command: pair.1.map(str::to_owned) });
            }
            pair.0?;
        }
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let row = |row: &Option<String>| row.clone().unwrap_or_else(|| "no such row".into());
        write!(f, "  page:    {}\n  command: {}", row(&self.page), row(&self.command))
    }
}

/// All tables of a text, in order: a head, a rule, rows. Rows of another length than the head end a table.
pub fn tables(text: &str) -> Vec<Table> {
    let mut tables: Vec<Table> = Vec::new();
    let lines: Vec<Option<Vec<String>>> = text.lines().map(cells).collect();
    let mut index = 0;
    while index + 1 < lines.len() {
        let (Some(head), Some(rule)) = (&lines[index], &lines[index + 1]) else {
            index += 1;
            continue;
        };
        if !is_rule(rule) || rule.len() != head.len() {
            index += 1;
            continue;
        }
        let rows = lines[index + 2..].iter().map_while(|cells| cells.clone().filter(|row| row.len() == head.len()));
        let labels = rule.iter().take_while(|cell| !cell.ends_with(':')).count();
        let table = Table { head: head.clone(), rows: rows.collect(), labels };
        index += 2 + table.rows.len();
        tables.push(table);
    }
    tables
}

/// The cells of a table's line; a `\|` is a | in a cell.
fn cells(line: &str) -> Option<Vec<String>> {
    let inner = line.trim().strip_prefix('|')?.strip_suffix('|')?;
    let mut cells = vec![String::new()];
    let mut escaped = false;
    for character in inner.chars() {
        match (character, cells.last_mut()) {
            ('|', Some(cell)) if escaped => {
                cell.pop();
                cell.push('|');
            }
            ('|', _) => cells.push(String::new()),
            (_, Some(cell)) => cell.push(character),
            _ => {}
        }
        escaped = character == '\\' && !escaped;
    }
    Some(cells.iter().map(|cell| cell.trim().to_owned()).collect())
}

fn is_rule(cells: &[String]) -> bool {
    let rule = |cell: &String| cell.contains('-') && cell.chars().all(|character| "-:".contains(character));
    cells.iter().all(rule)
}

fn line(cells: &[impl AsRef<str>]) -> String {
    let cells: Vec<&str> = cells.iter().map(AsRef::as_ref).collect();
    format!("| {} |", cells.join(" | "))
}

impl Table {
    /// As Markdown, columns padded.
    pub fn text(&self) -> String {
        let head: Vec<&str> = self.head.iter().map(String::as_str).collect();
        aligned(self.labels, &head, self.rows.clone())
    }

    /// The columns with these heads, in this order; all of them where none is named.
    ///
    /// # Errors
    /// A head that the table does not have, or has twice.
    pub fn select(&self, columns: &[String]) -> Result<Table> {
        if columns.is_empty() {
            return Ok(self.clone());
        }
        let indices = columns.iter().map(|column| self.column_index(column)).collect::<Result<Vec<usize>>>()?;
        let pick = |row: &Vec<String>| indices.iter().map(|&index| row[index].clone()).collect();
        let labels = indices.iter().take_while(|index| **index < self.labels).count();
        Ok(Table { head: columns.to_vec(), rows: self.rows.iter().map(pick).collect(), labels })
    }

    /// The cell in the row whose first cell is `row`, or one of its figures that `/` separates.
    ///
    /// # Errors
    /// A row, column or part that the table does not have, or has twice.
    pub fn cell(&self, cell: &Cell) -> Result<String> {
        let column = self.column_index(&cell.column)?;
        let mut rows = self.rows.iter().filter(|row| row[0] == cell.row);
        let text = match (rows.next(), rows.next()) {
            (Some(row), None) => &row[column],
            (None, _) => bail!("no row {:?}; there are: {}", cell.row, line(&self.first_cells())),
            _ => bail!("two rows are called {:?}", cell.row),
        };
        match cell.part {
            None => Ok(text.clone()),
            Some(part) => {
                let found = text.split('/').nth(part - 1).map(|text| text.trim().to_owned());
                found.ok_or_else(|| anyhow!("{text:?} has no part {part}"))
            }
        }
    }

    fn first_cells(&self) -> Vec<&str> {
        self.rows.iter().map(|row| row[0].as_str()).collect()
    }

    fn column_index(&self, column: &str) -> Result<usize> {
        let mut indices = (0..self.head.len()).filter(|index| self.head[*index] == column);
        match (indices.next(), indices.next()) {
            (Some(index), None) => Ok(index),
            (None, _) => bail!("no column {column:?}; there are: {}", line(&self.head)),
            _ => bail!("two columns are called {column:?}"),
        }
    }

    /// The first line in which the table that a command prints is another one.
    pub fn differs(&self, command: &Table) -> Option<Difference> {
        let lines = |table: &Table| -> Vec<String> {
            [&table.head].into_iter().chain(&table.rows).map(|row| line(row)).collect()
        };
        let (page, command) = (lines(self), lines(command));
        let most = page.len().max(command.len());
        let at = (0..most).find(|index| page.get(*index) != command.get(*index))?;
        Some(Difference { page: page.get(at).cloned(), command: command.get(at).cloned() })
    }

    /// The first row of a check's table that stands nowhere on the page. Rows are compared in the columns that both
    /// tables have, or in `columns` alone.
    ///
    /// # Errors
    /// Fewer than two columns in common: a row's label and a figure; a check without rows; a column that one does not
    /// have.
    pub fn lacks(&self, check: &Table, columns: &[String]) -> Result<Option<Difference>> {
        let common: Vec<String> = match columns {
            [] => check.head.iter().filter(|head| self.head.contains(head)).cloned().collect(),
            named => named.to_vec(),
        };
        ensure!(common.len() > 1, "page and check have fewer than two columns in common: {}", line(&check.head));
        ensure!(!check.rows.is_empty(), "the check's table has no rows");
        let (page, check) = (self.select(&common)?, check.select(&common)?);
        let Some(row) = check.rows.iter().find(|row| !page.rows.contains(row)) else { return Ok(None) };
        // Named by its label where that is on the page.
        let labels = ..check.labels.max(1);
        let old = page.rows.iter().find(|old| old[labels] == row[labels]);
        Ok(Some(Difference { page: old.map(|old| line(old)), command: Some(line(row)) }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "intro\n| s | x, µm | e \\| f |\n|---|---:|---:|\n| p | 1 | 2 % |\n| q | 10 | 3 % |\nend\n\n\
                        | not | a table |\n\n| a | b |\n|:--|---|\n| 1 | 2 |\n";

    #[test]
    fn tables_are_read_and_printed_aligned() {
        let all = tables(TEXT);
        assert_eq!(all.len(), 2);
        assert_eq!((all[0].labels, all[1].labels), (1, 2));
        assert_eq!(all[0].head, ["s", "x, µm", "e | f"]);
        let text = "| s | x, µm | e \\| f |\n|---|------:|-------:|\n| p |     1 |    2 % |\n| q |    10 |    3 % |\n";
        assert_eq!(all[0].text(), text);
        assert_eq!(tables(text)[0], all[0]);
    }

    #[test]
    fn columns_are_selected_by_head() {
        let one = &tables(TEXT)[0];
        let of = |columns: &[&str]| one.select(&columns.iter().map(|&c| c.to_owned()).collect::<Vec<_>>());
        assert_eq!(of(&["x, µm", "s"]).unwrap().rows[1], ["10", "q"]);
        assert_eq!(of(&[]).unwrap(), *one);
        assert_eq!(of(&["y"]).unwrap_err().to_string(), "no column \"y\"; there are: | s | x, µm | e | f |");
    }

    #[test]
    fn a_cell_is_found_by_row_and_column() {
        let table = &tables("| s | x |\n|---|--:|\n| p | 1 % / 2 % |\n| q | 3 |\n| q | 4 |\n")[0];
        let of = |row: &str, column: &str, part: Option<usize>| {
            let cell = Cell { row: row.into(), column: column.into(), part };
            table.cell(&cell).map_err(|error| error.to_string())
        };
        assert_eq!(of("p", "x", None).unwrap(), "1 % / 2 %");
        assert_eq!(of("p", "x", Some(2)).unwrap(), "2 %");
        assert_eq!(of("p", "x", Some(3)).unwrap_err(), "\"1 % / 2 %\" has no part 3");
        assert_eq!(of("r", "x", None).unwrap_err(), "no row \"r\"; there are: | p | q | q |");
        assert_eq!(of("q", "x", None).unwrap_err(), "two rows are called \"q\"");
        assert_eq!(of("p", "y", None).unwrap_err(), "no column \"y\"; there are: | s | x |");
    }

    #[test]
    fn the_first_differing_row_is_told() {
        let old = &tables(TEXT)[0];
        assert_eq!(old.differs(old), None);
        let new = &tables(&TEXT.replace("3 %", "4 %"))[0];
        assert_eq!(old.differs(new).unwrap().to_string(), "  page:    | q | 10 | 3 % |\n  command: | q | 10 | 4 % |");
        let shorter = Table { rows: old.rows[..1].to_vec(), ..old.clone() };
        assert_eq!(old.differs(&shorter).unwrap().command, None);
    }

    #[test]
    fn a_part_of_rows_and_columns_must_stand_in_the_page() {
        let page = &tables(TEXT)[0];
        let check = |text: &str, columns: &[&str]| {
            page.lacks(&tables(text)[0], &columns.iter().map(|&c| c.to_owned()).collect::<Vec<_>>())
        };
        assert_eq!(check("| e \\| f | s | more |\n|--:|---|---|\n| 3 % | q | 9 |\n", &[]).unwrap(), None);
        let stale = "| s | x, µm |\n|---|--:|\n| p | 1 |\n| q | 11 |\n";
        let wanted = Difference { page: Some("| q | 10 |".into()), command: Some("| q | 11 |".into()) };
        assert_eq!(check(stale, &[]).unwrap(), Some(wanted));
        assert_eq!(check("| s | x, µm |\n|---|--:|\n| r | 1 |\n", &[]).unwrap().unwrap().page, None);
        // Columns that the check does not hold exactly may be left out.
        let partly = "| s | x, µm | e \\| f |\n|---|--:|--:|\n| q | 10 | 9 % |\n";
        assert!(check(partly, &[]).unwrap().is_some());
        assert_eq!(check(partly, &["s", "x, µm"]).unwrap(), None);
        assert!(check("| z | s |\n|---|---|\n| 1 | q |\n", &[]).is_err());
        assert!(check("| s | x, µm |\n|---|--:|\n", &[]).is_err());
    }
}
