//! Segment: the contact to which each taxel belongs, from the normal forces alone.
//!
//! q is the compressive part of p, smoothed by a Gaussian of σ = width · h (width 0.8, h at least 0.75 pitches). Each
//! taxel ascends to its steepest neighbour until a maximum is reached; the taxels of one maximum are a basin. The
//! saddle of two basins is the largest min(q_i, q_j) over neighbours i, j, one in each. Basins are joined, one pair at
//! a time:
//!
//! 1. a basin with less than 3 % of the whole load joins the neighbour with the highest saddle;
//! 2. two basins whose saddle is above 90 % of the lower maximum are one: a ring, a punch or a long contact has several
//!    maxima with shallow valleys between them.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: p | n, row-major | N |
//! | out: labels | n | region of each taxel, 0 …, in the order of the first taxel |
//!
//! Every taxel has a region, unloaded ones included. Feeds `contacts` and the choice of `adaptive`.

use crate::sensor::Sensor;

/// Width of the smoothing in units of h: finer structure is not visible from the depth of the taxels.
pub const WIDTH: f64 = 0.8;
/// Smallest h in pitches for the smoothing: the force on a single taxel is no structure.
const MIN_PITCHES: f64 = 0.75;
/// Fraction of the whole load below which a basin is joined to another.
const MIN_LOAD_SHARE: f64 = 0.03;
/// Ratio of saddle to lower maximum from which two basins are one contact.
const JOIN_SADDLE: f64 = 0.9;

/// A partition of the taxels into regions.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Segments {
    /// Region of each taxel, row-major; regions are numbered from 0 in the order of their first taxels.
    pub labels: Vec<usize>,
    /// Number of regions, at least 1.
    pub count: usize,
}

impl Segments {
    /// All taxels in one region.
    pub fn whole(taxels: usize) -> Segments {
        Segments { labels: vec![0; taxels], count: 1 }
    }

    /// The taxels of a region, ascending.
    pub fn taxels(&self, region: usize) -> impl Iterator<Item = usize> + '_ {
        (0..self.labels.len()).filter(move |&taxel| self.labels[taxel] == region)
    }

    /// Renumbers arbitrary region labels, one per taxel, in the order of their first taxels.
    pub fn numbered(labels: &[usize]) -> Segments {
        let mut names: Vec<usize> = Vec::new();
        let number = |label: &usize| {
            names.iter().position(|name| name == label).unwrap_or_else(|| {
                names.push(*label);
                names.len() - 1
            })
        };
        let labels = labels.iter().map(number).collect();
        Segments { labels, count: names.len().max(1) }
    }

    /// The segments with regions `a` and `b` joined.
    pub fn joined(&self, a: usize, b: usize) -> Segments {
        let labels: Vec<usize> = self.labels.iter().map(|&label| if label == b { a } else { label }).collect();
        Segments::numbered(&labels)
    }
}

/// Segments the array into contacts; `p` in N, row-major; `width` of the smoothing in units of h, above 0.
pub fn segment(sensor: &Sensor, p: &[f64], width: f64) -> Segments {
    let q = smooth(sensor, p, width);
    let mut segments = Segments::numbered(&climb(sensor, &q));
    while let Some((a, b)) = pair_to_join(sensor, &q, &segments) {
        segments = segments.joined(a, b);
    }
    segments
}

/// Compressive forces smoothed by a Gaussian window of `width` · h, h at least [`MIN_PITCHES`].
fn smooth(sensor: &Sensor, p: &[f64], width: f64) -> Vec<f64> {
    let sigma = |pitch: f64| width * sensor.thickness_mm.max(MIN_PITCHES * pitch);
    smooth_window(sensor, p, [sigma(sensor.pitch_x_mm), sigma(sensor.pitch_y_mm)])
}

/// Compressive forces smoothed by a Gaussian window of `sigma_mm` along x and y; at the edge the window is cut and
/// normalised.
pub(crate) fn smooth_window(sensor: &Sensor, p: &[f64], sigma_mm: [f64; 2]) -> Vec<f64> {
    let (rows, cols) = (sensor.rows, sensor.cols);
    let weights = |pitch: f64, sigma: f64, count: usize| -> Vec<f64> {
        (0..count).map(|k| (-0.5 * (k as f64 * pitch / sigma).powi(2)).exp()).collect()
    };
    let wx = weights(sensor.pitch_x_mm, sigma_mm[0], cols);
    let wy = weights(sensor.pitch_y_mm, sigma_mm[1], rows);
    let mean = |w: &[f64], at: usize, count: usize, value: &dyn Fn(usize) -> f64| {
        let (mut sum, mut weight) = (0.0, 0.0);
        for k in 0..count {
            sum += w[k.abs_diff(at)] * value(k);
            weight += w[k.abs_diff(at)];
        }
        sum / weight
    };
    let along: Vec<f64> = (0..p.len()).map(|k| mean(&wx, k % cols, cols, &|c| p[k - k % cols + c].max(0.0))).collect();
    (0..p.len()).map(|k| mean(&wy, k / cols, rows, &|r| along[r * cols + k % cols])).collect()
}

/// The up to eight neighbours of a taxel, diagonal ones included.
pub fn neighbours(sensor: &Sensor, taxel: usize) -> impl Iterator<Item = usize> {
    let (rows, cols) = (sensor.rows, sensor.cols);
    let (row, col) = (taxel / cols, taxel % cols);
    let near = |at: usize, count: usize| at.saturating_sub(1)..=(at + 1).min(count - 1);
    let all = near(row, rows).flat_map(move |r| near(col, cols).map(move |c| r * cols + c));
    all.filter(move |&other| other != taxel)
}

/// Index of the maximum to which each taxel ascends.
fn climb(sensor: &Sensor, q: &[f64]) -> Vec<usize> {
    let distance = |a: usize, b: usize| {
        let (cols, x, y) = (sensor.cols, sensor.pitch_x_mm, sensor.pitch_y_mm);
        ((a % cols).abs_diff(b % cols) as f64 * x).hypot((a / cols).abs_diff(b / cols) as f64 * y)
    };
    let up = |taxel: usize| {
        let slope = |&other: &usize| (q[other] - q[taxel]) / distance(taxel, other);
        let best = neighbours(sensor, taxel).max_by(|a, b| slope(a).total_cmp(&slope(b)));
        best.filter(|best| q[*best] > q[taxel]).unwrap_or(taxel)
    };
    let mut next: Vec<usize> = (0..q.len()).map(up).collect();
    // Taxels without any load are one basin, however many they are.
    if let Some(first) = q.iter().position(|&q| q == 0.0) {
        let flat = |(k, next): &(usize, &mut usize)| q[*k] == 0.0 && **next == *k;
        next.iter_mut().enumerate().filter(flat).for_each(|(_, next)| *next = first);
    }
    let top = |mut taxel: usize| {
        // q rises with every step, so the loop ends.
        while next[taxel] != taxel {
            taxel = next[taxel];
        }
        taxel
    };
    (0..q.len()).map(top).collect()
}

/// The next two basins to join: the smallest one below the load limit, else the pair with the shallowest valley.
fn pair_to_join(sensor: &Sensor, q: &[f64], segments: &Segments) -> Option<(usize, usize)> {
    let count = segments.count;
    let (mut load, mut top) = (vec![0.0; count], vec![0.0f64; count]);
    let mut saddle = vec![f64::NEG_INFINITY; count * count];
    for (taxel, &label) in segments.labels.iter().enumerate() {
        load[label] += q[taxel];
        top[label] = q[taxel].max(top[label]);
        for other in neighbours(sensor, taxel) {
            let at = label * count + segments.labels[other];
            saddle[at] = saddle[at].max(q[taxel].min(q[other]));
        }
    }
    let least = MIN_LOAD_SHARE * load.iter().sum::<f64>();
    let small = (0..count).filter(|&k| load[k] <= least).min_by(|&a, &b| load[a].total_cmp(&load[b]));
    if let (Some(small), true) = (small, count > 1) {
        let others = (0..count).filter(|&k| k != small);
        return others
            .max_by(|&a, &b| saddle[small * count + a].total_cmp(&saddle[small * count + b]))
            .map(|other| (small, other));
    }
    let pairs = (0..count).flat_map(|a| (0..a).map(move |b| (b, a)));
    let depth = |&(a, b): &(usize, usize)| saddle[a * count + b] / top[a].min(top[b]);
    pairs.filter(|pair| depth(pair) >= JOIN_SADDLE).max_by(|a, b| depth(a).total_cmp(&depth(b)))
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
        assert_eq!((segments.labels[0], segments.labels[19]), (0, 1));
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

    #[test]
    fn corners_have_three_neighbours() {
        assert_eq!(neighbours(&sensor(), 0).collect::<Vec<_>>(), [1, 20, 21]);
        assert_eq!(neighbours(&sensor(), 21).count(), 8);
    }
}
