//! Resultants as the board computes them: exact integers.

use super::Sums;

impl Sums {
    /// Sums of the force words `[fx, fy, fz]`, row-major over an array of `cols` columns.
    pub fn of(beats: &[[i32; 3]], cols: usize) -> Sums {
        let mut sums = Sums::default();
        for (index, beat) in beats.iter().enumerate() {
            let [fx, fy, fz] = beat.map(i64::from);
            sums.fx += fx;
            sums.fy += fy;
            sums.fz += fz;
            sums.moment_x += (index % cols) as i64 * fz;
            sums.moment_y += (index / cols) as i64 * fz;
            sums.loaded += u64::from(fz != 0);
        }
        sums
    }

    /// Centre of pressure as `[column, row]`, with fractions of a taxel; `None` if Σ fz is zero.
    pub fn centre(&self) -> Option<[f64; 2]> {
        (self.fz != 0).then(|| [self.moment_x, self.moment_y].map(|moment| moment as f64 / self.fz as f64))
    }
}
