//! Crop: the part of a recording that becomes the scene's array.
//!
//! | crop | window |
//! |---|---|
//! | auto | all sensels, without border lines that have none; around the contact if they are more than [`MOST_TAXELS`] |
//! | contact | around the contact |
//! | rows and columns | those, both ends included, from 0 |
//!
//! The contact is every sensel whose largest reading exceeds [`CONTACT_SHARE`] of the recording's largest; around it
//! stay [`MARGIN`] lines where the array has them.

use super::error::{ImportError, Source};
use super::recording::Recording;
use crate::spec::sensor::MIN_SIDE;
use serde::{Deserialize, Serialize};

/// Largest number of taxels of a scene: 48 × 48, the largest array for which times and errors are measured.
pub const MOST_TAXELS: usize = 48 * 48;
/// Share of the recording's largest reading above which a sensel is part of the contact.
pub const CONTACT_SHARE: f64 = 0.1;
/// Lines kept around the contact.
pub const MARGIN: usize = 2;

/// What to keep of a recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Crop {
    /// Everything if it is small enough, else what is around the contact.
    #[default]
    Auto,
    /// What is around the contact.
    Contact,
    /// Rows and columns from 0, first and last of each.
    Lines {
        /// First and last row.
        rows: [usize; 2],
        /// First and last column.
        cols: [usize; 2],
    },
}

/// A rectangle of sensels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Window {
    /// First row, from 0.
    pub row0: usize,
    /// First column, from 0.
    pub col0: usize,
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub cols: usize,
}

impl Window {
    /// Indices of its sensels in an array with `cols` columns, row-major.
    pub(super) fn indices(self, cols: usize) -> impl Iterator<Item = usize> {
        let rows = self.row0..self.row0 + self.rows;
        rows.flat_map(move |row| (self.col0..self.col0 + self.cols).map(move |col| row * cols + col))
    }

    fn has(self, row: usize, col: usize) -> bool {
        let (rows, cols) = (self.row0..self.row0 + self.rows, self.col0..self.col0 + self.cols);
        rows.contains(&row) && cols.contains(&col)
    }

    /// The smallest window with all sensels for which `test` holds.
    fn around(rows: usize, cols: usize, test: impl Fn(usize) -> bool) -> Option<Window> {
        let row_has = |row: &usize| (0..cols).any(|col| test(row * cols + col));
        let col_has = |col: &usize| (0..rows).any(|row| test(row * cols + col));
        let (row0, row1) = ((0..rows).find(row_has)?, (0..rows).rev().find(row_has)?);
        let (col0, col1) = ((0..cols).find(col_has)?, (0..cols).rev().find(col_has)?);
        Some(Window { row0, col0, rows: row1 - row0 + 1, cols: col1 - col0 + 1 })
    }

    /// The window with up to `margin` more lines on each side, within `outer`.
    fn widened(self, margin: usize, outer: Window) -> Window {
        let (row0, col0) =
            (self.row0.saturating_sub(margin).max(outer.row0), self.col0.saturating_sub(margin).max(outer.col0));
        let row_end = (self.row0 + self.rows + margin).min(outer.row0 + outer.rows);
        let col_end = (self.col0 + self.cols + margin).min(outer.col0 + outer.cols);
        Window { row0, col0, rows: row_end - row0, cols: col_end - col0 }
    }
}

/// The window of a recording.
pub(super) fn window(recording: &Recording, crop: Crop, source: &Source) -> Result<Window, ImportError> {
    let (rows, cols) = (recording.rows, recording.cols);
    let sensels = Window::around(rows, cols, |k| !recording.missing[k]);
    let sensels = sensels.ok_or_else(|| source.field("sensels", 0, "at least one that is not missing"))?;
    let contact = || {
        let largest = largest(recording);
        let limit = CONTACT_SHARE * largest.iter().copied().fold(0.0, f64::max);
        let window = Window::around(rows, cols, |k| largest[k] > limit)?.widened(MARGIN, sensels);
        // Without lines at its border that have no sensel.
        Window::around(rows, cols, |k| window.has(k / cols, k % cols) && !recording.missing[k])
    };
    let small = |window: &Window| window.rows * window.cols <= MOST_TAXELS;
    let (field, found) = match crop {
        Crop::Lines { rows: [row0, row1], cols: [col0, col1] } => {
            if row0 > row1 || row1 >= rows || col0 > col1 || col1 >= cols {
                let allowed = format!("rows within 0..{} and columns within 0..{}", rows - 1, cols - 1);
                return Err(source.field("--crop", format!("{row0}..{row1},{col0}..{col1}"), allowed));
            }
            ("--crop", Some(Window { row0, col0, rows: row1 - row0 + 1, cols: col1 - col0 + 1 }))
        }
        Crop::Auto if small(&sensels) => ("size", Some(sensels)),
        Crop::Auto => ("size", contact()),
        Crop::Contact => ("--crop", contact()),
    };
    let found =
        found.ok_or_else(|| source.missing("the contact", "every reading is 0; give rows and columns with --crop"))?;
    if found.rows < MIN_SIDE || found.cols < MIN_SIDE || !small(&found) {
        let allowed = format!(
            "at least {MIN_SIDE}×{MIN_SIDE} and at most {MOST_TAXELS} taxels; choose rows and columns with --crop, such as \
             --crop 0..47,0..47"
        );
        return Err(source.field(field, format!("{}×{}", found.rows, found.cols), allowed));
    }
    Ok(found)
}

/// Largest magnitude that each sensel reads in any frame.
fn largest(recording: &Recording) -> Vec<f64> {
    let mut largest = vec![0.0f64; recording.rows * recording.cols];
    for frame in &recording.frames {
        largest.iter_mut().zip(&frame.values).for_each(|(most, value)| *most = most.max(value.abs()));
    }
    largest
}
