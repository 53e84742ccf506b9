//! What the codes of a frame show of the sensor's electronics, in the words of the hardware; the same faults as
//! [`readings`](crate::result::checks::readings) finds in the readings, by sums that need neither logarithms nor a sorted frame.
//!
//! ```text
//! change      ones' complement magnitude of the difference of two codes beside each other; of a line or a frame the OR of its
//!             changes, a row's along it, a column's along it: the largest one, within a factor of 2
//! q           the least change above 0 along a row
//! clipped     more than 4 codes are the largest to the bit, and the next one is at least 8 q below
//! line fault  a row or column repeats the one before to the bit, four times its change is above the frame's, and the lines on
//!             both sides of the pair are not equal too; the frame's change is at least 32 q
//! ```
//! The codes are those of the converter, before zero and gain, which would make equal ones differ. Up to four equal largest codes
//! are what the mirror images of one press have, and lines that are equal on both sides of a pair are those of a frame that is its
//! own mirror image. A code that falls in steps of q is one of five largest by chance in one of 8⁴ frames.
//!
//! Dead taxels are never the largest and make no changes; a line has the codes of all its taxels. Where gains are negative codes
//! fall with the load, and their ones' complements are compared.
//!
//! | in | codes of a frame, row-major, `code_bits` signed |
//! |---|---|
//! | out | a bit for each fault: of any frame of a block that is averaged, of the last frame of a sliding mean |

use crate::fixed::words::arith::magnitude_bits;
use crate::result::flags::{Flag, FlagSet};
use crate::spec::scene::Scene;

/// Equal largest codes from which on they are a plateau: more than the mirror images of one press.
pub const PLATEAU_CODES: u32 = 5;
/// Binary logarithm of the least distance of a plateau from the next code, in q.
pub const PLATEAU_GAP: u32 = 3;
/// Binary logarithm of the least change of a frame of which lines are judged, in q.
pub const FINE: u32 = 5;
/// Binary logarithm of the change of a frame over the least one of a repeated line.
pub const LOADED: u32 = 2;
/// Lines between a line and the one that its frame has in its place if the pair between them is on the frame's axis.
pub const MIRROR: usize = 3;

/// The check of one scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CodeCheck {
    /// Rows of the array.
    pub rows: usize,
    /// Columns of the array.
    pub cols: usize,
    /// Codes fall with the load.
    pub falls: bool,
    /// Indices of dead taxels, row-major.
    pub dead: Vec<usize>,
}

/// A row or a column.
#[derive(Clone, Debug)]
struct Line {
    codes: Vec<i64>,
    change: u64,
}

impl CodeCheck {
    /// The check of the hardware of `scene`, the scene of a plan; `gain` of each taxel in words. `None` where it has none.
    pub fn of_scene(scene: &Scene, gain: Option<&[i32]>) -> Option<CodeCheck> {
        let sensor = &scene.sensor;
        scene.checks_codes().then(|| CodeCheck {
            rows: sensor.rows,
            cols: sensor.cols,
            falls: gain.is_some_and(|gain| gain.iter().map(|word| i64::from(*word)).sum::<i64>() < 0),
            dead: scene.input.dead.iter().map(|[row, col]| row * sensor.cols + col).collect(),
        })
    }

    /// The flags that the codes of a frame raise.
    pub fn flags(&self, codes: &[i32]) -> FlagSet {
        let upward: Vec<i64> = codes.iter().map(|&code| i64::from(if self.falls { !code } else { code })).collect();
        let (rows, cols) = (self.rows, self.cols);
        let by_row: Vec<Vec<usize>> = (0..rows).map(|row| (0..cols).map(|col| row * cols + col).collect()).collect();
        let by_col: Vec<Vec<usize>> = (0..cols).map(|col| (0..rows).map(|row| row * cols + col).collect()).collect();
        let along_rows = by_row.iter().flat_map(|row| self.changes(&upward, row)).filter(|change| *change > 0);
        let of_live = || (0..upward.len()).filter(|taxel| self.is_live(taxel)).map(|taxel| upward[taxel]);
        let (Some(step), Some(largest)) = (along_rows.min(), of_live().max()) else { return FlagSet::default() };
        let next = of_live().filter(|code| *code < largest).max();
        let equal = of_live().filter(|code| *code == largest).count();
        let gap = next.map_or(0, |next| largest.abs_diff(next));
        let lines = |places: &[Vec<usize>]| places.iter().map(|places| self.line(&upward, places)).collect::<Vec<_>>();
        let lines = [lines(&by_row), lines(&by_col)];
        let change = lines.iter().flatten().fold(0, |change, line| change | line.change);
        let repeated = lines.iter().fold(0, |change, lines| change | repeated(lines));
        FlagSet::raised([
            (Flag::Clipped, equal >= PLATEAU_CODES as usize && gap >> PLATEAU_GAP >= step),
            (Flag::LineFault, change >> FINE >= step && repeated << LOADED > change),
        ])
    }

    fn is_live(&self, taxel: &usize) -> bool {
        !self.dead.contains(taxel)
    }

    /// The changes along the taxels of a line.
    fn changes<'a>(&'a self, codes: &'a [i64], places: &'a [usize]) -> impl Iterator<Item = u64> + 'a {
        let live = places.windows(2).filter(|pair| pair.iter().all(|taxel| self.is_live(taxel)));
        live.map(|pair| magnitude_bits(codes[pair[1]] - codes[pair[0]]))
    }

    fn line(&self, codes: &[i64], places: &[usize]) -> Line {
        let change = self.changes(codes, places).fold(0, |all, change| all | change);
        Line { codes: places.iter().map(|&taxel| codes[taxel]).collect(), change }
    }
}

/// The changes of all lines that repeat the one before.
fn repeated(lines: &[Line]) -> u64 {
    let equals =
        |k: usize, before: usize| k >= before && lines.get(k).is_some_and(|line| line.codes == lines[k - before].codes);
    let repeated = (0..lines.len()).filter(|&k| equals(k, 1) && !equals(k + 1, MIRROR));
    repeated.fold(0, |change, k| change | lines[k].change)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::frame::{Contact, Frame};
    use crate::data::generator::converter::Converter;
    use crate::data::generator::draws::{DrawOptions, Draws};
    use crate::data::generator::generate;
    use crate::data::quantise::quantise;
    use crate::spec::scene::Medium;

    const CLEAN: [Flag; 0] = [];

    fn check(rows: usize, cols: usize) -> CodeCheck {
        CodeCheck { rows, cols, falls: false, dead: Vec::new() }
    }

    fn flags(check: &CodeCheck, codes: &[i32]) -> Vec<Flag> {
        check.flags(codes).iter().collect()
    }

    /// 4 × 5 codes of a press without symmetry, with steps of 1 in three places.
    fn press() -> Vec<i32> {
        let code = |k: i32| 4000 - 1200 * (k % 5 - 2).abs() - 400 * (k / 5 - 1).abs() - 7 * k * k;
        let mut codes: Vec<i32> = (0..20).map(code).collect();
        [(10, 11), (15, 16), (18, 19)].into_iter().for_each(|(taxel, beside)| codes[taxel] = codes[beside] - 1);
        codes
    }

    #[test]
    fn five_largest_codes_far_above_the_next_are_clipped() {
        let all_live = check(4, 5);
        let clipped = |most: i32| press().iter().map(|code| *code.min(&most)).collect::<Vec<i32>>();
        assert_eq!(flags(&all_live, &press()), CLEAN);
        let mut sorted = press();
        sorted.sort_unstable();
        // The four largest are equal, the five largest; then as far above the sixth as 7 and 8 steps.
        assert_eq!(flags(&all_live, &clipped(sorted[16])), CLEAN);
        assert_eq!(flags(&all_live, &clipped(sorted[15])), [Flag::Clipped]);
        let row = [0, 1, 3, 8, 8, 4, 0, 8, 8, 8];
        let codes = |most: i32| row.iter().map(|&code| if code == 8 { most } else { code }).cycle().take(20).collect();
        let codes: [Vec<i32>; 2] = [4 + 7, 4 + 8].map(codes);
        let no_lines = check(2, 10);
        assert_eq!(flags(&no_lines, &codes[0]), CLEAN);
        assert_eq!(flags(&no_lines, &codes[1]), [Flag::Clipped]);
        // Falling codes, and largest ones that are dead.
        let falling: Vec<i32> = clipped(sorted[15]).iter().map(|code| !code).collect();
        assert_eq!(flags(&all_live, &falling), CLEAN);
        assert_eq!(flags(&CodeCheck { falls: true, ..all_live.clone() }, &falling), [Flag::Clipped]);
        let largest = (0..20).filter(|&k| press()[k] >= sorted[15]).collect();
        assert_eq!(flags(&CodeCheck { dead: largest, ..all_live }, &clipped(sorted[15])), CLEAN);
    }

    #[test]
    fn a_loaded_row_or_column_that_repeats_the_one_before_is_a_fault() {
        let all_live = check(4, 5);
        for twin in 1..4 {
            let mut codes = press();
            codes.copy_within(5 * (twin - 1)..5 * twin, 5 * twin);
            assert_eq!(flags(&all_live, &codes), [Flag::LineFault], "row {twin}");
        }
        for twin in 1..5 {
            let mut codes = press();
            (0..4).for_each(|row| codes[5 * row + twin] = codes[5 * row + twin - 1]);
            assert_eq!(flags(&all_live, &codes), [Flag::LineFault], "column {twin}");
        }
        // One code differs; a pair without load; a frame of few steps; a frame that is its own mirror image.
        let mut codes = press();
        codes.copy_within(5..10, 10);
        codes[12] += 1;
        assert_eq!(flags(&all_live, &codes), CLEAN);
        let mut codes = press();
        codes[10..].fill(-2);
        codes[11] = -1;
        codes[16] = -1;
        assert_eq!(flags(&all_live, &codes), CLEAN);
        let mut coarse: Vec<i32> = press().iter().map(|code| code / 400 * 400).collect();
        coarse.copy_within(5..10, 10);
        assert_eq!(flags(&all_live, &coarse), CLEAN);
        let mut mirrored = press();
        mirrored.copy_within(5..10, 10);
        mirrored.copy_within(0..5, 15);
        assert_eq!(flags(&all_live, &mirrored), CLEAN);
    }

    /// The limits: none of clean drawn presses of 8 to 20 bits and 0 to 1 % of noise, of shipped frames, and of presses that are
    /// their own mirror images has a flag.
    #[test]
    fn clean_presses_raise_no_flag() {
        let mut all = 0;
        let mut is_clean = |scene: &Scene, frame: &Frame, name: &str| {
            let codes = quantise(&frame.stress_MPa, scene.fixed.input_bits, 1.01 * frame.peak_MPa()).codes;
            assert_eq!(flags(&check(scene.sensor.rows, scene.sensor.cols), &codes), CLEAN, "{name}");
            all += 1;
        };
        for name in ["sensor-1", "eight-by-eight"] {
            let scene = Scene::builtin(name).unwrap();
            let draws = Draws::new(&scene, DrawOptions { seed: 11, ..Default::default() }).unwrap();
            for number in 0..40 {
                let drawn = draws.frame(number).unwrap();
                let mut exact = drawn.frame.clone();
                exact.stress_MPa.clone_from(&drawn.exact_MPa);
                for (bits, noise) in [(8, 0.0), (8, 1e-2), (12, 1e-3), (20, 0.0), (20, 5e-4)] {
                    let full_scale_MPa = Some(drawn.peak_MPa() * (1.05 + (number % 4) as f64));
                    let converter =
                        Converter { noise, bits: Some(bits), full_scale_MPa, seed: number, ..Default::default() };
                    is_clean(&scene, &converter.convert(&exact).unwrap(), &format!("{name} {number} {bits} {noise}"));
                }
            }
            for frame in Frame::shipped(&scene) {
                is_clean(&scene, &frame, &frame.id.clone());
            }
            for centre in [[0.0, 0.0], [2.0, 0.0], [4.0, -4.0]] {
                let contact = Contact {
                    shape: Some("hertz-circle".to_owned()),
                    size_mm: vec![4.0],
                    centre_mm: Some(centre),
                    normal_N: Some(5.0),
                    ..Default::default()
                };
                let frame = generate("symmetric", &scene.sensor, Medium::HalfSpace, &[contact]).unwrap();
                let codes = Converter { bits: Some(12), ..Default::default() }.convert(&frame).unwrap();
                [frame, codes].iter().for_each(|frame| is_clean(&scene, frame, &format!("{name} at {centre:?}")));
            }
        }
        assert!(all > 400, "{all}");
    }
}
