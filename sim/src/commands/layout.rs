//! Options for the layout of lines of numbers, where it can be read in two ways.

use clap::Args;
use dermis_golden::data::text::Stated;

/// What is stated of a layout.
#[derive(Args, Clone, Debug, Default)]
pub struct LayoutArguments {
    /// First and last column of the readings in a text, counted from 1; default: found.
    #[arg(long, value_name = "A..B", value_parser = columns)]
    columns: Option<Columns>,
    /// Column of the time in a text, counted from 1; default: found.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    time_column: Option<u32>,
    /// Lines at the begin of a text that are not read.
    #[arg(long, value_name = "N", default_value_t = 0)]
    skip_rows: usize,
}

/// First and last column, from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Columns([usize; 2]);

impl LayoutArguments {
    pub(crate) fn stated(&self) -> Stated {
        Stated {
            columns: self.columns.map(|Columns(columns)| columns),
            // A column of a line: no number is too large.
            time_column: self.time_column.map(|column| column as usize),
            skip_rows: self.skip_rows,
            form: None,
        }
    }
}

fn columns(text: &str) -> Result<Columns, String> {
    let parse = |(a, b): (&str, &str)| Some([a.trim().parse().ok()?, b.trim().parse().ok()?]);
    let ends = text.split_once("..").and_then(parse).filter(|[a, b]: &[usize; 2]| *a >= 1 && a <= b);
    ends.map(Columns).ok_or_else(|| "two columns from 1, as 2..101".to_owned())
}
