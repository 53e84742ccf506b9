//! Segment: the contact to which each taxel belongs, from the normal forces alone.
//!
//! The algorithm is one of integers, the same for both models: the forces are words, those of the floating-point model are
//! first brought to [`PEAK_BITS`] bits. Every step is one that hardware can do with one multiplier,
//! comparisons and memories.
//!
//! ```text
//! p ── compressive part ── smooth along x, y ── climb ── basins ── join ── contact of each taxel, or none
//! ```
//! q is the compressive part of p, smoothed by a Gaussian of σ = width · h (width 0.8, h at least 0.75 pitches). Each
//! taxel ascends to its steepest neighbour until a maximum is reached; the taxels of one maximum are a basin. A maximum up
//! to 1/[`FLOOR`] of the largest q is no contact, and its taxels belong to none; so do those of maxima beyond [`BASINS`]. The
//! saddle of two basins is the largest min(q_i, q_j) over neighbours i, j, one in each; taxels of no contact are basin
//! [`NONE`] here. Basins are joined, one pair at a time:
//!
//! 1. the basin with the smallest load, if that is at most 1/[`SMALL`] of the whole, joins the neighbour with the highest
//!    saddle;
//! 2. two basins whose saddle is at least [`SADDLE`] of the lower maximum are one, those of the highest saddle first: a
//!    ring, a punch or a long contact has several maxima with shallow valleys between them.
//!
//! Of equal ones the first is taken everywhere.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: p | n, row-major | words, or N |
//! | out: labels | n | contact of each taxel, 0 …, in the order of their largest taxels, or none |
//!
//! Feeds the contacts of both models, the golden model's estimator `evidence` and its choice of `adaptive`.

use crate::spec::sensor::Sensor;

/// Width of the smoothing in units of h: finer structure is not visible from the depth of the taxels.
pub const WIDTH: f64 = 0.8;
/// Smallest h in pitches for the smoothing: the force on a single taxel is no structure.
const MIN_PITCHES: f64 = 0.75;
/// Bits of the largest floating-point force as a word.
pub const PEAK_BITS: i32 = 30;
/// Width of a word of the bit-true model, without a sign.
pub const WORD_BITS: u32 = 16;
/// Fraction bits of a weight of the smoothing.
pub const WEIGHT_BITS: u32 = 8;
/// Fraction bits of the inverse distance between neighbours, in units of the smaller pitch.
pub const SLOPE_BITS: u32 = 7;
/// The largest q over the largest maximum that is no contact.
pub const FLOOR: i64 = 64;
/// Largest number of basins.
pub const BASINS: usize = 31;
/// The basin of the taxels of no contact.
pub const NONE: usize = 0;
/// The whole load over the largest load of a basin that is joined to another.
pub const SMALL: i64 = 32;
/// Ratio of saddle to lower maximum from which two basins are one contact, numerator and denominator.
pub const SADDLE: [i64; 2] = [29, 32];

/// The contacts of an array.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Segments {
    /// Contact of each taxel, row-major, if it belongs to one.
    pub labels: Vec<Option<usize>>,
    /// Number of contacts.
    pub count: usize,
}

impl Segments {
    /// All taxels in one contact.
    pub fn whole(taxels: usize) -> Segments {
        Segments { labels: vec![Some(0); taxels], count: 1 }
    }

    /// The taxels of a contact, ascending.
    pub fn taxels(&self, contact: usize) -> impl Iterator<Item = usize> + '_ {
        (0..self.labels.len()).filter(move |&taxel| self.labels[taxel] == Some(contact))
    }

    /// Numbers arbitrary labels, one per taxel, in the order of their first taxels.
    pub fn numbered(labels: &[Option<usize>]) -> Segments {
        let mut names: Vec<usize> = Vec::new();
        let mut number = |label: usize| {
            names.iter().position(|name| *name == label).unwrap_or_else(|| {
                names.push(label);
                names.len() - 1
            })
        };
        let labels = labels.iter().map(|label| label.map(&mut number)).collect();
        Segments { labels, count: names.len() }
    }

    /// The segments with contacts `a` and `b` joined.
    pub fn joined(&self, a: usize, b: usize) -> Segments {
        let labels: Vec<_> = self.labels.iter().map(|&label| if label == Some(b) { Some(a) } else { label }).collect();
        Segments::numbered(&labels)
    }
}

/// Segments the array into contacts; `p` in N, row-major; `width` of the smoothing in units of h, above 0. Without a
/// contact the whole array is one.
pub fn segment(sensor: &Sensor, p: &[f64], width: f64) -> Segments {
    basins(sensor, p, width).segments
}

/// The same with what led to it.
pub fn basins(sensor: &Sensor, p: &[f64], width: f64) -> Basins {
    Segmenter::new(sensor, width).segment_forces(p)
}

/// The up to eight neighbours of a taxel, diagonal ones included, ascending.
pub fn neighbours(sensor: &Sensor, taxel: usize) -> impl Iterator<Item = usize> {
    let (rows, cols) = (sensor.rows, sensor.cols);
    let (row, col) = (taxel / cols, taxel % cols);
    let near = |at: usize, count: usize| at.saturating_sub(1)..=(at + 1).min(count - 1);
    let all = near(row, rows).flat_map(move |r| near(col, cols).map(move |c| r * cols + c));
    all.filter(move |&other| other != taxel)
}

/// The weights of a Gaussian window along one axis.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Window {
    /// Number of taxels to each side.
    pub reach: usize,
    /// For each taxel of a line the weights of its 2·reach + 1 neighbours in 2^−[`WEIGHT_BITS`], 0 beyond the array.
    pub weights: Vec<Vec<i64>>,
}

/// A Gaussian window of σ on a line of `count` points at `pitch`: for each point the weights of all. At the ends the window
/// is cut and normalised.
pub(crate) fn gaussian(count: usize, pitch: f64, sigma: f64) -> Vec<Vec<f64>> {
    let gauss = |distance: usize| (-0.5 * (distance as f64 * pitch / sigma).powi(2)).exp();
    let by_distance: Vec<f64> = (0..count).map(gauss).collect();
    let own = |at: usize| {
        let sum: f64 = (0..count).map(|other| by_distance[at.abs_diff(other)]).sum();
        (0..count).map(|other| by_distance[at.abs_diff(other)] / sum).collect()
    };
    (0..count).map(own).collect()
}

/// The values of a grid after a step along its rows and then one along its columns: `line(axis, at, value)` is the new value
/// at place `at` of a line with the old ones `value(place)`; axis 0 is along a row.
pub(crate) fn along_both_axes<T: Copy>(
    grid: &Sensor,
    values: &[T],
    line: impl Fn(usize, usize, &dyn Fn(usize) -> T) -> T,
) -> Vec<T> {
    let cols = grid.cols;
    let along: Vec<T> = (0..values.len()).map(|k| line(0, k % cols, &|col| values[k - k % cols + col])).collect();
    (0..values.len()).map(|k| line(1, k / cols, &|row| along[row * cols + k % cols])).collect()
}

impl Window {
    /// A window of σ on a line of `count` taxels at `pitch`.
    fn new(count: usize, pitch: f64, sigma: f64) -> Window {
        let one = f64::from(1u32 << WEIGHT_BITS);
        let word = |weight: &f64| (one * weight).round() as i64;
        let own = |weights: &Vec<f64>| weights.iter().map(word).collect();
        let all: Vec<Vec<i64>> = gaussian(count, pitch, sigma).iter().map(own).collect();
        let reach_at = |at: usize| {
            let kept = (0..count).filter(|other| all[at][*other] > 0);
            kept.map(|other| at.abs_diff(other)).max().unwrap_or(0)
        };
        let reach = (0..count).map(reach_at).max().unwrap_or(0);
        let taps = |at: usize| -> Vec<i64> {
            let tap = |k: usize| (at + k).checked_sub(reach).and_then(|other| all[at].get(other).copied());
            (0..=2 * reach).map(|k| tap(k).unwrap_or(0)).collect()
        };
        Window { reach, weights: (0..count).map(taps).collect() }
    }
}

/// The constants of the segmentation of an array.
#[derive(Clone, Debug, PartialEq)]
pub struct Segmenter {
    sensor: Sensor,
    /// Windows along a row and along a column.
    pub windows: [Window; 2],
    /// Inverse distance in 2^−[`SLOPE_BITS`] of a neighbour along x, along y and of a diagonal one.
    pub slopes: [i64; 3],
}

/// The contacts of an array, and what led to them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Basins {
    /// Smoothed forces.
    pub smoothed: Vec<i64>,
    /// Basin of each taxel before any was joined; [`NONE`] or 1 …, in the order of their maxima.
    pub basins: Vec<usize>,
    /// The steepest neighbour of each taxel, itself at a maximum.
    pub steps: Vec<usize>,
    /// The joinings in their order.
    pub joins: Vec<Join>,
    /// The contacts.
    pub segments: Segments,
    /// Whether there were more than [`BASINS`] basins.
    pub overflow: bool,
}

/// A joining of two basins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Join {
    /// Number of basins before it.
    pub basins: usize,
    /// Whether one of the two had a small load; otherwise their saddle is high.
    pub small: bool,
}

impl Basins {
    /// The contacts by their loads, sums of the smoothed forces, the largest first; of equal ones the first comes first.
    pub fn by_load(&self) -> Vec<usize> {
        let load = |contact: usize| -> i64 { self.segments.taxels(contact).map(|taxel| self.smoothed[taxel]).sum() };
        let mut order: Vec<usize> = (0..self.segments.count).collect();
        order.sort_by_key(|&contact| std::cmp::Reverse(load(contact)));
        order
    }
}

/// Load, largest q and saddles of each basin.
struct Table {
    whole: i64,
    exists: Vec<bool>,
    load: Vec<i64>,
    top: Vec<i64>,
    saddle: Vec<Vec<i64>>,
}

impl Segmenter {
    /// For an array, with a smoothing of `width` in units of h.
    pub fn new(sensor: &Sensor, width: f64) -> Segmenter {
        let (x, y) = (sensor.pitch_x_mm, sensor.pitch_y_mm);
        let sigma = |pitch: f64| width * sensor.thickness_mm.max(MIN_PITCHES * pitch);
        let slope = |distance: f64| (f64::from(1u32 << SLOPE_BITS) * x.min(y) / distance).round() as i64;
        Segmenter {
            sensor: sensor.clone(),
            windows: [Window::new(sensor.cols, x, sigma(x)), Window::new(sensor.rows, y, sigma(y))],
            slopes: [slope(x), slope(y), slope(x.hypot(y))],
        }
    }

    /// The contacts for the normal forces `p` in N, row-major; without a contact the whole array is one.
    pub fn segment_forces(&self, p: &[f64]) -> Basins {
        let peak = p.iter().copied().fold(0.0, f64::max);
        let word = |p: &f64| if *p > 0.0 { (p / peak * 2f64.powi(PEAK_BITS)).round() as i64 } else { 0 };
        let words: Vec<i64> = p.iter().map(word).collect();
        match self.segment(&words) {
            found if found.segments.count > 0 => found,
            found => Basins { segments: Segments::whole(p.len()), ..found },
        }
    }

    /// The contacts for the normal forces `p`, row-major.
    pub fn segment(&self, p: &[i64]) -> Basins {
        let smoothed = self.smooth(p);
        let steps = self.steps(&smoothed);
        let top = tops(&steps);
        let floor = smoothed.iter().copied().max().unwrap_or(0) / FLOOR;
        let mut numbers = vec![NONE; p.len()];
        let mut count = 0;
        for taxel in (0..p.len()).filter(|&taxel| top[taxel] == taxel && smoothed[taxel] > floor) {
            count += 1;
            numbers[taxel] = if count > BASINS { NONE } else { count };
        }
        let basins: Vec<usize> = top.iter().map(|&top| numbers[top]).collect();
        let (joined, joins) = self.table(&smoothed, &basins).join();
        let names: Vec<usize> = (1..=BASINS).filter(|&basin| joined[basin] == basin).collect();
        let label = |basin: &usize| names.iter().position(|name| *name == joined[*basin]);
        let segments = Segments { labels: basins.iter().map(label).collect(), count: names.len() };
        Basins { smoothed, basins, steps, joins, segments, overflow: count > BASINS }
    }

    /// The compressive part of p, smoothed along the rows, then along the columns, each rounded half up.
    fn smooth(&self, p: &[i64]) -> Vec<i64> {
        let pressing: Vec<i64> = p.iter().map(|p| (*p).max(0)).collect();
        along_both_axes(&self.sensor, &pressing, |axis, at, value| {
            let Window { reach, weights } = &self.windows[axis];
            let taps = weights[at].iter().enumerate().filter(|(_, weight)| **weight > 0);
            let sum: i64 = taps.map(|(k, weight)| weight * value(at + k - reach)).sum();
            (sum + (1 << (WEIGHT_BITS - 1))) >> WEIGHT_BITS
        })
    }

    /// The steepest neighbour of each taxel, itself at a maximum.
    fn steps(&self, q: &[i64]) -> Vec<usize> {
        let cols = self.sensor.cols;
        let up = |taxel: usize| {
            let (mut steepest, mut next) = (0, taxel);
            for other in neighbours(&self.sensor, taxel) {
                let slope = match (other / cols == taxel / cols, other % cols == taxel % cols) {
                    (true, _) => self.slopes[0],
                    (_, true) => self.slopes[1],
                    _ => self.slopes[2],
                };
                let rise = (q[other] - q[taxel]) * slope;
                if rise > steepest {
                    (steepest, next) = (rise, other);
                }
            }
            next
        };
        (0..q.len()).map(up).collect()
    }

    fn table(&self, q: &[i64], basins: &[usize]) -> Table {
        let count = BASINS + 1;
        let mut table = Table {
            whole: q.iter().sum(),
            exists: vec![false; count],
            load: vec![0; count],
            top: vec![0; count],
            saddle: vec![vec![0; count]; count],
        };
        for (taxel, &own) in basins.iter().enumerate() {
            table.exists[own] |= own != NONE;
            table.load[own] += q[taxel];
            table.top[own] = q[taxel].max(table.top[own]);
            for other in neighbours(&self.sensor, taxel) {
                let saddle = &mut table.saddle[own][basins[other]];
                *saddle = q[taxel].min(q[other]).max(*saddle);
            }
        }
        table
    }
}

/// The maximum to which each taxel ascends by `steps`.
fn tops(steps: &[usize]) -> Vec<usize> {
    let mut top = steps.to_vec();
    // q rises with every step, so that the loop ends.
    while (0..top.len()).any(|taxel| top[top[taxel]] != top[taxel]) {
        top = top.iter().map(|&next| top[next]).collect();
    }
    top
}

impl Table {
    /// The basin that each basin is part of in the end, [`NONE`] for those that do not exist; and how it came to be.
    fn join(mut self) -> (Vec<usize>, Vec<Join>) {
        let own = |basin: usize| if self.exists[basin] { basin } else { NONE };
        let mut joined: Vec<usize> = (0..self.load.len()).map(own).collect();
        let mut joins = Vec::new();
        while let Some((small, (into, gone))) = self.next_pair() {
            joins.push(Join { basins: self.exists.iter().filter(|exists| **exists).count(), small });
            joined.iter_mut().filter(|basin| **basin == gone).for_each(|basin| *basin = into);
            self.exists[gone] = false;
            self.load[into] += self.load[gone];
            self.top[into] = self.top[into].max(self.top[gone]);
            for other in 0..self.load.len() {
                let saddle = self.saddle[into][other].max(self.saddle[gone][other]);
                (self.saddle[into][other], self.saddle[other][into]) = (saddle, saddle);
            }
        }
        (joined, joins)
    }

    /// The next two basins to join, the first of which remains, and whether one of them has a small load.
    fn next_pair(&self) -> Option<(bool, (usize, usize))> {
        let all = || (1..self.load.len()).filter(|&basin| self.exists[basin]);
        let small = all().reduce(|a, b| if self.load[b] < self.load[a] { b } else { a })?;
        if SMALL * self.load[small] <= self.whole {
            let saddle = |other: usize| self.saddle[small][other];
            let others = std::iter::once(NONE).chain(all()).filter(|&other| other != small);
            let next = others.reduce(|a, b| if saddle(b) > saddle(a) { b } else { a })?;
            return Some((true, if next < small { (next, small) } else { (small, next) }));
        }
        let pairs = all().flat_map(|a| all().filter(move |b| a < *b).map(move |b| (a, b)));
        let shallow = pairs.filter(|&(a, b)| SADDLE[1] * self.saddle[a][b] >= SADDLE[0] * self.top[a].min(self.top[b]));
        let highest = |(a, b): (usize, usize), (c, d): (usize, usize)| match self.saddle[c][d] > self.saddle[a][b] {
            true => (c, d),
            false => (a, b),
        };
        Some((false, shallow.reduce(highest)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sensor() -> Sensor {
        Sensor { rows: 12, cols: 20, pitch_x_mm: 2.0, pitch_y_mm: 2.0, thickness_mm: 2.0 }
    }

    fn forces(shape: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let sensor = sensor();
        let at = |k: usize| sensor.position_mm(k / sensor.cols, k % sensor.cols);
        (0..sensor.taxels()).map(|k| shape(at(k)[0], at(k)[1])).collect()
    }

    fn disc(x: f64, y: f64, radius: f64) -> f64 {
        (1.0 - (x * x + y * y) / (radius * radius)).max(0.0).sqrt()
    }

    #[test]
    fn two_contacts_and_a_crumb() {
        let p = forces(|x, y| disc(x - 9.0, y, 6.0) + disc(x + 9.0, y, 6.0) + 0.1 * disc(x, y - 9.0, 3.0));
        let segments = segment(&sensor(), &p, WIDTH);
        assert_eq!(segments.count, 2);
        assert_eq!((segments.labels[5 * 20 + 3], segments.labels[5 * 20 + 17]), (Some(0), Some(1)));
        assert_eq!(segments.labels[11 * 20], None);
    }

    #[test]
    fn a_ring_is_one() {
        let p = forces(|x, y| disc(x.hypot(y) - 6.5, 0.0, 4.0));
        assert_eq!(segment(&sensor(), &p, WIDTH).count, 1);
    }

    #[test]
    fn nothing_is_one_region() {
        assert_eq!(segment(&sensor(), &[0.0; 240], WIDTH), Segments::whole(240));
        assert_eq!(segment(&sensor(), &[-1.0; 240], WIDTH), Segments::whole(240));
    }

    /// Faint maxima are no contacts, and their taxels have none.
    #[test]
    fn faint_maxima_are_no_contacts() {
        let p = forces(|x, y| disc(x - 12.0, y, 5.0) + 0.01 * disc(x + 14.0, y, 3.0));
        let segments = segment(&sensor(), &p, WIDTH);
        assert_eq!((segments.count, segments.labels[5 * 20 + 16]), (1, Some(0)));
        assert_eq!(segments.labels[5 * 20 + 3], None);
    }

    /// More maxima than basins: those beyond are no contacts, and it is told.
    #[test]
    fn too_many_maxima_are_told() {
        let sensor = Sensor { rows: 16, cols: 16, pitch_x_mm: 4.0, pitch_y_mm: 4.0, thickness_mm: 0.5 };
        let lone = |k: usize| if (k / 16).is_multiple_of(2) && k.is_multiple_of(2) { 1 << 20 } else { 0 };
        let p: Vec<i64> = (0..256).map(lone).collect();
        let found = Segmenter::new(&sensor, 0.3).segment(&p);
        assert_eq!((found.basins.iter().max(), found.overflow), (Some(&BASINS), true));
        assert_eq!((found.basins[0], found.basins[255]), (1, NONE));
        let few: Vec<i64> = p.iter().enumerate().map(|(k, p)| if k < 32 { *p } else { 0 }).collect();
        assert!(!Segmenter::new(&sensor, 0.3).segment(&few).overflow);
    }

    /// The weights of a window add up to one at the edge as inside.
    #[test]
    fn windows_are_normalised() {
        for (count, sigma) in [(20, 1.2), (8, 0.6), (3, 4.0), (1, 1.0)] {
            let window = Window::new(count, 1.0, sigma);
            for weights in &window.weights {
                assert_eq!(weights.len(), 2 * window.reach + 1);
                let off = weights.iter().sum::<i64>() - (1 << WEIGHT_BITS);
                assert!(off.abs() <= 3, "{count} {sigma} {off}");
            }
        }
        assert_eq!(Window::new(1, 1.0, 1.0).weights, [[1 << WEIGHT_BITS]]);
    }

    #[test]
    fn corners_have_three_neighbours() {
        assert_eq!(neighbours(&sensor(), 0).collect::<Vec<_>>(), [1, 20, 21]);
        assert_eq!(neighbours(&sensor(), 21).count(), 8);
    }
}
