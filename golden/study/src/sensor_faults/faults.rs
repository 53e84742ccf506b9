//! The faults: what each does to the readings of one moment.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: `Readings` | taxels, row-major | MPa |
//! | in: size | scalar | [`Unit`] |
//! | out: readings | taxels, row-major | MPa |

use dermis_golden::random::Random;
use dermis_golden::spec::sensor::Sensor;

/// Stress in MPa of frames that no contact causes.
const NO_CONTACT_MPA: f64 = 0.1;
/// Rows and columns beside a row or column that a multiplexer reads twice.
const NEXT: usize = 1;

/// What a fault does to the true force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// None: the frame of a working sensor.
    Clean,
    /// Spoils a press, and the frame or its stream shows it.
    Shown,
    /// Spoils a press in a way that another force explains.
    Hidden,
    /// Replaces the frame by one that no contact causes.
    NoContact,
}

/// Unit of a fault's size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Share of the press's largest stress, in percent.
    Percent,
    /// Factor.
    Times,
    /// Width of a code.
    Bits,
    /// There is one size.
    One,
}

impl Unit {
    /// A size in words; empty where there is one.
    pub fn text(self, size: f64) -> String {
        match self {
            Unit::Percent => format!("{} %", (1e4 * size).round() / 1e2),
            Unit::Times => format!("× {size}"),
            Unit::Bits => format!("{size} bits"),
            Unit::One => String::new(),
        }
    }
}

/// The moments of a stream that a fault spoils, and how the press grows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Moments {
    /// All, evenly growing.
    All,
    /// The last, evenly growing.
    Last,
    /// The last, whose load is larger than that before by the size.
    LastStep,
    /// The last, after those of another contact.
    LastOther,
}

/// Readings of one moment, in MPa, row-major.
pub(super) struct Readings<'a> {
    pub sensor: &'a Sensor,
    /// With noise.
    pub now: &'a [f64],
    /// Those of the moment before.
    pub before: &'a [f64],
    /// A normal number for each taxel, independent between moments.
    pub noise: &'a [f64],
    /// The largest stress of the whole press.
    pub peak_MPa: f64,
    /// Its taxel.
    pub peak_taxel: usize,
}

impl Readings<'_> {
    fn of(&self, reading: impl FnMut(usize) -> f64) -> Vec<f64> {
        (0..self.now.len()).map(reading).collect()
    }

    fn row_col(&self, taxel: usize) -> [usize; 2] {
        [taxel / self.sensor.cols, taxel % self.sensor.cols]
    }

    /// Position from −1 to 1 along x and y.
    fn along(&self, taxel: usize) -> [f64; 2] {
        let [row, col] = self.row_col(taxel);
        let share = |k: usize, count: usize| 2.0 * k as f64 / (count - 1) as f64 - 1.0;
        [share(col, self.sensor.cols), share(row, self.sensor.rows)]
    }

    /// The readings and the peak times a function of the position.
    fn plus(&self, surface: impl Fn([f64; 2]) -> f64) -> Vec<f64> {
        self.of(|k| self.now[k] + self.peak_MPa * surface(self.along(k)))
    }

    /// The readings with one taxel at a share of the peak.
    fn stuck(&self, taxel: usize, share: f64) -> Vec<f64> {
        self.of(|k| if k == taxel { share * self.peak_MPa } else { self.now[k] })
    }

    /// Each taxel's reading is that of another.
    fn from(&self, taxel: impl Fn([usize; 2]) -> [usize; 2]) -> Vec<f64> {
        self.of(|k| {
            let [row, col] = taxel(self.row_col(k));
            self.now[row * self.sensor.cols + col]
        })
    }

    /// The readings of the upper half of the rows, `other` below.
    fn upper_half(&self, other: impl Fn(usize) -> f64) -> Vec<f64> {
        self.of(|k| if self.row_col(k)[0] < self.sensor.rows / 2 { self.now[k] } else { other(k) })
    }

    /// A pattern in place of the readings: a share by row and column of [`NO_CONTACT_MPA`].
    fn pattern(&self, share: impl Fn([usize; 2]) -> f64) -> Vec<f64> {
        self.of(|k| NO_CONTACT_MPA * share(self.row_col(k)))
    }

    fn surface(&self, share: impl Fn([f64; 2]) -> f64) -> Vec<f64> {
        self.of(|k| NO_CONTACT_MPA * share(self.along(k)))
    }
}

/// A taxel beside that of the peak, in the same row.
pub(super) fn beside(r: &Readings) -> usize {
    match r.row_col(r.peak_taxel)[1] + 1 < r.sensor.cols {
        true => r.peak_taxel + 1,
        false => r.peak_taxel - 1,
    }
}

/// A fault of a sensor.
pub struct Fault {
    /// Its name in tables.
    pub name: &'static str,
    /// What it does to the force.
    pub kind: Kind,
    /// Unit of the sizes.
    pub unit: Unit,
    /// Sizes that are measured.
    pub sizes: &'static [f64],
    pub(super) moments: Moments,
    /// Readings of a moment, size, random numbers that are the same for each moment of a press.
    pub(super) apply: fn(&Readings, f64, &mut Random) -> Vec<f64>,
}

type Apply = fn(&Readings, f64, &mut Random) -> Vec<f64>;

const fn shown(name: &'static str, unit: Unit, sizes: &'static [f64], apply: Apply) -> Fault {
    Fault { name, kind: Kind::Shown, unit, sizes, moments: Moments::All, apply }
}

const fn hidden(name: &'static str, unit: Unit, sizes: &'static [f64], apply: Apply) -> Fault {
    Fault { name, kind: Kind::Hidden, unit, sizes, moments: Moments::All, apply }
}

const fn no_contact(name: &'static str, apply: Apply) -> Fault {
    Fault { name, kind: Kind::NoContact, unit: Unit::One, sizes: &[1.0], moments: Moments::All, apply }
}

const fn torn(name: &'static str, unit: Unit, sizes: &'static [f64], moments: Moments, apply: Apply) -> Fault {
    Fault { name, kind: Kind::Shown, unit, sizes, moments, apply }
}

/// Sizes of a fault without one.
const ONE: &[f64] = &[1.0];
/// Readings of a stuck taxel.
const STUCK: &[f64] = &[0.0, -0.5, 0.5, 1.5];

use Unit::{Bits, One, Percent, Times};

/// All faults; those of one sensor's part beside each other.
pub const FAULTS: &[Fault] = &[
    Fault {
        name: "clean, noise",
        kind: Kind::Clean,
        unit: Percent,
        sizes: &[0.0, 5e-4, 2e-3, 1e-2],
        moments: Moments::All,
        apply: |r, _, _| r.now.to_vec(),
    },
    // The zero.
    shown("baseline offset", Percent, &[5e-3, -5e-3, 0.02, -0.02, 0.1, -0.1], |r, s, _| r.plus(|_| s)),
    shown("slope along x", Percent, &[5e-3, 0.01, 0.05], |r, s, _| r.plus(|[x, _]| s * x)),
    shown("slope along y", Percent, &[5e-3, 0.01, 0.05], |r, s, _| r.plus(|[_, y]| s * y)),
    shown("slope along the diagonal", Percent, &[5e-3, 0.01, 0.05], |r, s, _| r.plus(|[x, y]| s * (x - y) / 2.0)),
    shown("smooth drift", Percent, &[0.01, 0.05], |r, s, random| {
        let terms: [f64; 5] = std::array::from_fn(|_| random.normal());
        let [a, b, c, d, e] = terms;
        let surface = |[x, y]: [f64; 2]| a * x + b * y + c * x * y + d * (x * x - 0.5) + e * (y * y - 0.5);
        let largest = (0..r.now.len()).map(|k| surface(r.along(k)).abs()).fold(0.0, f64::max);
        r.plus(|at| s * surface(at) / largest)
    }),
    shown("bowed zero", Percent, &[0.01, 0.05], |r, s, _| r.plus(|[x, y]| s * (x * x + y * y) / 2.0)),
    // Taxels.
    shown("taxel stuck, at the peak", Percent, STUCK, |r, s, _| r.stuck(r.peak_taxel, s)),
    shown("taxel stuck, beside the peak", Percent, STUCK, |r, s, _| r.stuck(beside(r), s)),
    shown("taxel stuck, at the border", Percent, STUCK, |r, s, random| {
        let border: Vec<usize> = (0..r.now.len()).filter(|k| r.sensor.is_border(*k)).collect();
        r.stuck(random.pick(&border).copied().unwrap_or(0), s)
    }),
    shown("taxel stuck, anywhere", Percent, STUCK, |r, s, random| {
        let any: Vec<usize> = (0..r.now.len()).collect();
        r.stuck(random.pick(&any).copied().unwrap_or(0), s)
    }),
    // Rows and columns.
    shown("row reads 0, through the peak", One, ONE, |r, _, _| {
        let row = r.row_col(r.peak_taxel)[0];
        r.of(|k| if r.row_col(k)[0] == row { 0.0 } else { r.now[k] })
    }),
    shown("column reads 0, through the peak", One, ONE, |r, _, _| {
        let col = r.row_col(r.peak_taxel)[1];
        r.of(|k| if r.row_col(k)[1] == col { 0.0 } else { r.now[k] })
    }),
    shown("row reads less, through the peak", Percent, &[0.9, 0.5], |r, s, _| {
        let row = r.row_col(r.peak_taxel)[0];
        r.of(|k| if r.row_col(k)[0] == row { s * r.now[k] } else { r.now[k] })
    }),
    shown("row doubled", One, ONE, |r, _, _| {
        let row = r.row_col(r.peak_taxel)[0];
        let twin = row.checked_sub(NEXT).unwrap_or(row + NEXT);
        r.from(|[i, j]| [if i == twin { row } else { i }, j])
    }),
    shown("column doubled", One, ONE, |r, _, _| {
        let col = r.row_col(r.peak_taxel)[1];
        let twin = col.checked_sub(NEXT).unwrap_or(col + NEXT);
        r.from(|[i, j]| [i, if j == twin { col } else { j }])
    }),
    shown("ghost rows and columns", Percent, &[0.03, 0.1], |r, s, _| {
        let (rows, cols) = (r.sensor.rows, r.sensor.cols);
        let mean = |sum: f64, count: usize| (sum / count as f64).max(0.0);
        let row: Vec<f64> = (0..rows).map(|i| mean(r.now[i * cols..][..cols].iter().sum(), cols)).collect();
        let col: Vec<f64> = (0..cols).map(|j| mean(r.now.iter().skip(j).step_by(cols).sum(), rows)).collect();
        r.of(|k| {
            let [i, j] = r.row_col(k);
            r.now[k] + s * (row[i] + col[j])
        })
    }),
    // The converter.
    shown("clipped", Percent, &[0.9, 0.7, 0.5, 0.3], |r, s, _| r.of(|k| r.now[k].min(s * r.peak_MPa))),
    shown("negative clipped", One, ONE, |r, _, _| r.of(|k| r.now[k].max(0.0))),
    shown("coarse codes", Bits, &[4.0, 6.0, 8.0], |r, s, _| {
        let step_MPa = r.peak_MPa / (s - 1.0).exp2();
        r.of(|k| (r.now[k] / step_MPa).round() * step_MPa)
    }),
    shown("deadband", Percent, &[0.01, 0.05], |r, s, _| {
        r.of(|k| if r.now[k].abs() > s * r.peak_MPa { r.now[k] } else { 0.0 })
    }),
    shown("soft threshold", Percent, &[0.01, 0.05], |r, s, _| {
        r.of(|k| (r.now[k].abs() - s * r.peak_MPa).max(0.0).copysign(r.now[k]))
    }),
    shown("sign reversed", One, ONE, |r, _, _| r.of(|k| -r.now[k])),
    // The transfer.
    shown("shifted by one taxel", One, ONE, |r, _, _| r.of(|k| r.now[(k + 1) % r.now.len()])),
    torn("torn: lower half reads 0", One, ONE, Moments::Last, |r, _, _| r.upper_half(|_| 0.0)),
    torn("torn: halves of two moments", Percent, &[0.1, 0.5], Moments::LastStep, |r, _, _| {
        r.upper_half(|k| r.before[k])
    }),
    torn("torn: halves of two contacts", One, ONE, Moments::LastOther, |r, _, _| r.upper_half(|k| r.before[k])),
    // The material.
    shown("creep: mixed with the next column", Percent, &[0.1, 0.3], |r, s, _| {
        r.of(|k| {
            let next = if r.row_col(k)[1] > 0 { k - 1 } else { k };
            (1.0 - s) * r.now[k] + s * r.now[next]
        })
    }),
    // What another force explains.
    hidden("gains scattered", Percent, &[0.05, 0.2], |r, s, random| r.of(|k| r.now[k] * (1.0 + s * random.normal()))),
    hidden("curved characteristic, power", Times, &[0.8, 1.25], |r, s, _| {
        r.of(|k| r.peak_MPa * (r.now[k].abs() / r.peak_MPa).powf(s).copysign(r.now[k]))
    }),
    hidden("crosstalk to the next columns", Percent, &[0.03, 0.1], |r, s, _| {
        let cols = r.sensor.cols;
        r.of(|k| {
            let (left, right) = (k - usize::from(k % cols > 0), k + usize::from(k % cols + 1 < cols));
            (1.0 - 2.0 * s) * r.now[k] + s * (r.now[left] + r.now[right])
        })
    }),
    hidden("blurred into the neighbours", Percent, &[0.03, 0.1], |r, s, _| {
        let (rows, cols) = (r.sensor.rows, r.sensor.cols);
        r.of(|k| {
            let [i, j] = r.row_col(k);
            let left = if j > 0 { k - 1 } else { k };
            let right = if j + 1 < cols { k + 1 } else { k };
            let above = if i > 0 { k - cols } else { k };
            let below = if i + 1 < rows { k + cols } else { k };
            (1.0 - 4.0 * s) * r.now[k] + s * [left, right, above, below].map(|k| r.now[k]).iter().sum::<f64>()
        })
    }),
    hidden("wrong unit", Times, &[10.0, 1e3, 1e-3], |r, s, _| r.of(|k| s * r.now[k])),
    hidden("mirrored", One, ONE, |r, _, _| r.from(|[i, j]| [i, r.sensor.cols - 1 - j])),
    hidden("rows and columns exchanged", One, ONE, |r, _, _| {
        let (rows, cols) = (r.sensor.rows, r.sensor.cols);
        r.of(|k| r.now[k % rows * cols + k / rows])
    }),
    // No contact.
    no_contact("constant pressure", |r, _, _| r.pattern(|_| 1.0)),
    no_contact("step, half of the columns", |r, _, _| r.pattern(|[_, j]| f64::from(u8::from(j >= r.sensor.cols / 2)))),
    no_contact("step, a quarter", |r, _, _| {
        r.pattern(|[i, j]| f64::from(u8::from(i < r.sensor.rows / 2 && j < r.sensor.cols / 2)))
    }),
    no_contact("checkerboard of 0 and 1", |r, _, _| r.pattern(|[i, j]| ((i + j) % 2) as f64)),
    no_contact("checkerboard of ±1", |r, _, _| r.pattern(|[i, j]| 1.0 - 2.0 * ((i + j) % 2) as f64)),
    no_contact("one hot taxel", |r, _, random| {
        let any: Vec<usize> = (0..r.now.len()).collect();
        let hot = random.pick(&any).copied().unwrap_or(0);
        r.of(|k| if k == hot { NO_CONTACT_MPA } else { 0.0 })
    }),
    no_contact("one hot row", |r, _, _| r.pattern(|[i, _]| f64::from(u8::from(i == r.sensor.rows / 2)))),
    no_contact("one hot column", |r, _, _| r.pattern(|[_, j]| f64::from(u8::from(j == r.sensor.cols / 2)))),
    no_contact("gradient from 0 to 1", |r, _, _| r.surface(|[x, _]| (1.0 + x) / 2.0)),
    no_contact("gradient from −1 to 1", |r, _, _| r.surface(|[x, _]| x)),
    no_contact("bent to a saddle", |r, _, _| r.surface(|[x, y]| y * y - x * x)),
    no_contact("bent along x", |r, _, _| r.surface(|[x, _]| 1.0 - x * x)),
    no_contact("noise alone", |r, _, _| r.of(|k| NO_CONTACT_MPA * r.noise[k])),
    no_contact("rectified noise alone", |r, _, _| r.of(|k| NO_CONTACT_MPA * r.noise[k].abs())),
];
