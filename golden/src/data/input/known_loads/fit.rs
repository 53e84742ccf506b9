//! Fit: straight lines, or one curve behind them, through the readings of known loads.
//!
//! The readings of taxel k under load l are
//!
//! ```text
//! r_kl = offset_k + u_l / gain_k       straight: u_l is the stress;  curved: u_l is found, c(u_l) is the stress
//! ```
//!
//! and u_l follows by least squares, lines and values in turn, with u = 0 without load and u the stress under the largest one. The
//! characteristic is curved where what the curve explains beyond the lines, per value that it has more, exceeds [`CURVED`] times
//! what it leaves per degree of freedom (an F-test whose scatter is that of the taxels: their noise and differences of shape), and
//! the lines leave more than [`WORTH`] of the range. This takes four different loads, one of them 0, under which readings rise by
//! at least [`FLATTEST`] of the mean slope from each to the next.

use super::super::calibration::Calibration;
use super::super::curve::Curve;
use serde::Serialize;

/// A taxel is dead where its reading changes by less than this share of the median taxel's, or the other way.
const DEAD_SHARE: f64 = 0.1;
/// Ratio of mean squares above which a characteristic is curved: by chance below 1 in 10⁴ on arrays of 16 taxels or more.
const CURVED: f64 = 20.0;
/// Least share of the range of loads that lines leave of a curved characteristic.
const WORTH: f64 = 0.005;
/// Least slope of the readings between two loads, over the mean slope: beyond it noise grows by as much.
const FLATTEST: f64 = 0.05;
/// Fewest different loads of a curve.
const FEWEST_FOR_CURVE: usize = 4;
/// Most turns of lines and values.
const MOST_TURNS: usize = 200;
/// Change of the values, over the range, below which they are found.
const FOUND: f64 = 1e-12;

/// The stress of a load in MPa and the mean reading of each taxel; `None` where no frame has one.
pub(super) type Mean = (f64, Vec<Option<f64>>);

/// Number of different stresses.
pub(super) fn different(means: &[&Mean]) -> usize {
    let mut stresses: Vec<f64> = means.iter().map(|(stress, _)| *stress).collect();
    stresses.sort_by(f64::total_cmp);
    stresses.dedup();
    stresses.len()
}

/// A characteristic that is no straight line, common to all taxels.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Curvature {
    /// Knots of the curve behind the table, [u, b] in MPa, both rising.
    pub knots: Vec<[f64; 2]>,
    /// Root mean square of what straight lines leave of the loads, over the range of the loads.
    pub line_share: f64,
    /// Mean square that the curve explains and lines do not, over the mean square that the curve leaves.
    pub ratio: f64,
}

/// What the readings under some loads show of the sensor.
pub(super) struct Characteristic {
    /// Offset and gain of each taxel; a dead one has the median gain.
    pub(super) table: Calibration,
    /// Whether each taxel follows the load.
    pub(super) live: Vec<bool>,
    /// The characteristic where it is curved.
    pub(super) curvature: Option<Curvature>,
    curve: Option<Curve>,
}

impl Characteristic {
    /// Of at least two different loads: curved where that explains more, else straight.
    pub(super) fn of(means: &[&Mean], taxels: usize) -> Characteristic {
        let curved = (different(means) >= FEWEST_FOR_CURVE).then(|| Characteristic::curved(means, taxels)).flatten();
        curved.filter(Characteristic::is_worth_it).unwrap_or_else(|| Characteristic::straight(means, taxels))
    }

    /// Straight lines.
    pub(super) fn straight(means: &[&Mean], taxels: usize) -> Characteristic {
        let stresses: Vec<f64> = means.iter().map(|(stress, _)| *stress).collect();
        let (table, live) = table(means, &stresses, taxels);
        Characteristic { table, live, curvature: None, curve: None }
    }

    /// A curve behind straight lines; `None` where the loads do not give one.
    pub(super) fn curved(means: &[&Mean], taxels: usize) -> Option<Characteristic> {
        let mut loads: Vec<f64> = means.iter().map(|(stress, _)| *stress).collect();
        loads.sort_by(f64::total_cmp);
        loads.dedup();
        let zero = loads.iter().position(|stress| *stress == 0.0)?;
        let largest = (0..loads.len()).max_by(|a, b| loads[*a].abs().total_cmp(&loads[*b].abs()))?;
        let load_of = |(stress, _): &&Mean| loads.iter().position(|own| own == stress);
        let load_of: Vec<usize> = means.iter().filter_map(load_of).collect();
        let of_means = |values: &[f64]| load_of.iter().map(|&load| values[load]).collect::<Vec<f64>>();
        let (straight, live) = table(means, &of_means(&loads), taxels);
        let line_squares = squares(means, &of_means(&loads), &straight, &live);
        let (mut values, mut table_of_values) = (loads.clone(), straight);
        for _ in 0..MOST_TURNS {
            let mut next = next_values(means, &load_of, &table_of_values, &live, loads.len())?;
            let (origin, scale) = (next[zero], loads[largest] / (next[largest] - next[zero]));
            next.iter_mut().for_each(|value| *value = (*value - origin) * scale);
            let change = next.iter().zip(&values).map(|(next, value)| (next - value).abs()).fold(0.0, f64::max);
            values = next;
            table_of_values = table(means, &of_means(&values), taxels).0;
            if change.is_nan() || change <= FOUND * loads[largest].abs() {
                break;
            }
        }
        // The scaling may leave a last digit.
        (values[zero], values[largest]) = (0.0, loads[largest]);
        let knots: Vec<[f64; 2]> = values.iter().zip(&loads).map(|(value, load)| [*value, *load]).collect();
        let rises = |pair: &[[f64; 2]]| pair[1][0] - pair[0][0] >= FLATTEST * (pair[1][1] - pair[0][1]);
        let curve = Curve::new(&knots).filter(|_| knots.windows(2).all(rises))?;
        let own = squares(means, &of_means(&values), &table_of_values, &live);
        let (count, more) = (own.count as f64, loads.len() as f64 - 2.0);
        // Each live taxel has two values of its own.
        let free = count - 2.0 * live.iter().filter(|live| **live).count() as f64 - more;
        let range = loads[loads.len() - 1] - loads[0];
        let ratio = (line_squares.sum - own.sum) / more / (own.sum / free);
        let line_share = (line_squares.sum / count).sqrt() / range;
        let curvature = Some(Curvature { knots, line_share, ratio });
        Some(Characteristic { table: table_of_values, live, curvature, curve: Some(curve) })
    }

    /// Whether a curve is more than the scatter of the taxels.
    fn is_worth_it(&self) -> bool {
        self.curvature.as_ref().is_some_and(|own| own.line_share > WORTH && own.ratio > CURVED)
    }

    /// Takes a taxel out: it has the median gain of the live ones.
    pub(super) fn declare_dead(&mut self, k: usize, means: &[&Mean]) {
        self.live[k] = false;
        let mut gains: Vec<f64> = (0..self.live.len()).filter(|k| self.live[*k]).map(|k| self.table.gain[k]).collect();
        gains.sort_by(f64::total_cmp);
        let readings: Vec<f64> = means.iter().filter_map(|(_, readings)| readings[k]).collect();
        self.table.gain[k] = gains.get(gains.len() / 2).copied().unwrap_or(self.table.gain[k]);
        self.table.offset[k] = readings.iter().sum::<f64>() / readings.len().max(1) as f64;
    }

    /// The stress of a taxel's reading in MPa.
    pub(super) fn stress_MPa(&self, k: usize, reading: f64) -> f64 {
        let straight = self.table.gain[k] * (reading - self.table.offset[k]);
        self.curve.as_ref().map_or(straight, |curve| curve.stress_MPa(straight))
    }
}

/// The value of each load by least squares over the live taxels; `None` where no taxel has a reading under one.
fn next_values(
    means: &[&Mean],
    load_of: &[usize],
    table: &Calibration,
    live: &[bool],
    loads: usize,
) -> Option<Vec<f64>> {
    let mut sums = vec![[0.0; 2]; loads];
    for ((_, readings), &load) in means.iter().zip(load_of) {
        for (k, reading) in readings.iter().enumerate().filter(|(k, _)| live[*k]) {
            let (Some(reading), slope) = (reading, 1.0 / table.gain[k]) else { continue };
            sums[load][0] += slope * (reading - table.offset[k]);
            sums[load][1] += slope * slope;
        }
    }
    sums.into_iter().map(|[sum, weight]| (weight > 0.0).then(|| sum / weight)).collect()
}

/// Squares in MPa² of what a table leaves of the live taxels' means, and their number.
struct Squares {
    sum: f64,
    count: usize,
}

fn squares(means: &[&Mean], values: &[f64], table: &Calibration, live: &[bool]) -> Squares {
    let off = |k: usize, reading: f64, value: f64| (table.gain[k] * (reading - table.offset[k]) - value).powi(2);
    let mut squares = Squares { sum: 0.0, count: 0 };
    for ((_, readings), value) in means.iter().zip(values) {
        for (k, reading) in readings.iter().enumerate().filter(|(k, _)| live[*k]) {
            let Some(reading) = reading else { continue };
            squares.sum += off(k, *reading, *value);
            squares.count += 1;
        }
    }
    squares
}

/// Table and live taxels of at least two different loads that have these values.
fn table(means: &[&Mean], values: &[f64], taxels: usize) -> (Calibration, Vec<bool>) {
    let lines: Vec<Line> = (0..taxels).map(|k| Line::of(means, values, k)).collect();
    let mut sorted: Vec<f64> = lines.iter().map(|line| line.slope).collect();
    sorted.sort_by(f64::total_cmp);
    let median = sorted[taxels / 2];
    let live: Vec<bool> = lines.iter().map(|line| median != 0.0 && line.slope / median > DEAD_SHARE).collect();
    let gain = lines.iter().zip(&live).map(|(line, live)| 1.0 / if *live { line.slope } else { median }).collect();
    let of = |(line, live): (&Line, &bool)| line.reading - if *live { line.slope * line.value } else { 0.0 };
    let offset = lines.iter().zip(&live).map(of).collect();
    (Calibration { offset, gain }, live)
}

/// The straight line through the readings of a taxel.
struct Line {
    /// Mean value of the loads under which it has a reading.
    value: f64,
    /// Mean of these readings.
    reading: f64,
    /// Change of the reading per MPa of the value; 0 where the loads do not differ.
    slope: f64,
}

impl Line {
    /// Of a taxel whose readings are proportional to `values` but for an offset, under each load.
    fn of(means: &[&Mean], values: &[f64], k: usize) -> Line {
        let points = || means.iter().zip(values).filter_map(|((_, readings), value)| Some((*value, readings[k]?)));
        let count = points().count().max(1) as f64;
        let centre = points().map(|(value, _)| value / count).sum::<f64>();
        let spread: f64 = points().map(|(value, _)| (value - centre).powi(2)).sum();
        let first = points().next().map_or(0.0, |(_, reading)| reading);
        // Against the first load, so that equal readings give exactly 0; the sum of the values' differences is 0.
        let change = points().map(|(value, reading)| (value - centre) * (reading - first)).sum::<f64>();
        let slope = if spread > 0.0 { change / spread } else { 0.0 };
        Line { value: centre, reading: points().map(|(_, reading)| reading / count).sum(), slope }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    const TAXELS: usize = 64;
    /// MPa.
    const LOADS: [f64; 6] = [0.0, 0.025, 0.05, 0.1, 0.15, 0.2];

    /// Counts over the offset at a stress in MPa, of a taxel whose shape differs by the factor.
    type Shape = fn(f64, f64) -> f64;

    /// Characteristics of drawn sensors.
    const DRAWN: [(&str, Shape); 4] = [
        // A force-sensing resistor under a divider: its conductance is a power of the load.
        ("divider, exponent 0.8", |s, own| 1023.0 * s.powf(0.8) / (s.powf(0.8) + (0.15 * own).powf(0.8))),
        ("divider, exponent 1", |s, own| 1023.0 * s / (s + 0.2 * own)),
        ("power 0.7", |s, own| 800.0 * own * (s / 0.2).powf(0.7)),
        ("quadratic", |s, own| 600.0 * own * (s / 0.2 + 0.3 * (s / 0.2).powi(2))),
    ];

    /// Means of loads with this noise in counts, and a taxel's exact reading.
    fn drawn(shape: Shape, noise: f64) -> (Vec<Mean>, impl Fn(usize, f64) -> f64) {
        let mut random = Random::new(11);
        let own: Vec<[f64; 3]> = (0..TAXELS)
            .map(|_| [20.0 + 3.0 * random.normal(), 1.0 + 0.15 * random.normal(), 1.0 + 0.1 * random.normal()])
            .collect();
        let reading = move |k: usize, stress: f64| own[k][0] + own[k][1] * shape(stress, own[k][2]);
        let mean = |stress: f64| {
            let noisy = (0..TAXELS).map(|k| Some(reading(k, stress) + noise * random.normal())).collect();
            (stress, noisy)
        };
        let means = LOADS.map(mean).into();
        (means, reading)
    }

    /// Root mean square error over all stresses up to the largest load, over that.
    fn error(own: &Characteristic, reading: impl Fn(usize, f64) -> f64) -> f64 {
        let stresses = || (0..=100).map(|k| 0.002 * f64::from(k));
        let off = |k: usize, stress: f64| own.stress_MPa(k, reading(k, stress)) - stress;
        let squares: f64 =
            (0..TAXELS).flat_map(|k| stresses().map(move |s| (k, s))).map(|(k, s)| off(k, s).powi(2)).sum();
        (squares / (101 * TAXELS) as f64).sqrt() / 0.2
    }

    #[test]
    fn a_curve_reads_between_the_loads_where_lines_do_not() {
        for (name, shape) in DRAWN {
            let (means, reading) = drawn(shape, 0.25);
            let all: Vec<&Mean> = means.iter().collect();
            let found = Characteristic::of(&all, TAXELS);
            let (line, curve) = (error(&Characteristic::straight(&all, TAXELS), &reading), error(&found, &reading));
            println!("{name}: {:.2} % by lines, {:.2} % by a curve", 100.0 * line, 100.0 * curve);
            assert!(found.curvature.is_some() && line > 0.015 && curve < 0.01 && curve < line / 6.0, "{name}");
        }
    }

    /// Lines stay lines, whatever their noise.
    #[test]
    fn noise_and_spread_of_gains_make_no_curve() {
        for noise in [0.0, 0.25, 5.0, 40.0] {
            let (means, _) = drawn(|s, own| 800.0 * own * s / 0.2, noise);
            let all: Vec<&Mean> = means.iter().collect();
            assert!(Characteristic::of(&all, TAXELS).curvature.is_none(), "{noise}");
        }
    }

    /// A curve takes a load of 0, four loads, and readings that rise.
    #[test]
    fn what_loads_do_not_give_is_no_curve() {
        let (means, _) = drawn(DRAWN[0].1, 0.25);
        let curved = |loads: &[usize]| {
            let some: Vec<&Mean> = loads.iter().map(|k| &means[*k]).collect();
            Characteristic::of(&some, TAXELS).curvature.is_some()
        };
        assert!(curved(&[0, 2, 3, 5]) && !curved(&[0, 2, 5]) && !curved(&[1, 2, 3, 5]));
        let (flat, _) = drawn(|s, _| 1000.0 * s.min(0.1), 0.25);
        assert!(Characteristic::of(&flat.iter().collect::<Vec<_>>(), TAXELS).curvature.is_none());
    }
}
