//! Cells: the integral of the traction over the cell of each taxel.
//!
//! Along x the integral of a piece's pressure has a closed form; along y it is computed by quadrature between the
//! positions where the outline crosses a cell boundary. In between it is analytic except for square roots at the ends,
//! which the substitution y = middle + half · sin removes.
//!
//! ```text
//! ellipse  Q(x, y) = A x² + 2 B x y + C y² ≤ 1:  1 − Q = m − A (x − x0)²,  m = 1 − (C − B²/A) y²,  x0 = −B y/A
//! Hertz    ∫ √(1 − Q) dx from the chord's start to τ half chords past its middle = m/√A ½ (τ √(1 − τ²) + asin τ + π/2)
//! uniform  ∫ dx = √(m/A) (τ + 1)
//! ```
//!
//! A tilt multiplies the pressure by 1 + g·(x, y), along the chord level + slope τ, which adds
//!
//! ```text
//! Hertz    slope (−⅓ (1 − τ²)^(3/2))        uniform  slope ½ (τ² − 1)
//! ```

use super::traction::{Piece, PressureShape};
use crate::data::frame::Forces;
use crate::physics::gauss::rule;
use crate::spec::sensor::Sensor;
use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::Range;

/// Nodes between two neighbouring crossings.
const NODES: usize = 32;

/// Force on each cell in N, row-major.
pub(super) fn forces(sensor: &Sensor, pieces: &[Piece]) -> Forces {
    let mut forces = Forces::zeros(sensor.taxels());
    for piece in pieces {
        let outline = Outline::new(piece);
        let x_edges = Edges { count: sensor.cols, pitch: sensor.pitch_x_mm, shift: piece.centre_mm[0] };
        let y_edges = Edges { count: sensor.rows, pitch: sensor.pitch_y_mm, shift: piece.centre_mm[1] };
        let cols = x_edges.cells(outline.reach()[0]);
        for row in y_edges.cells(outline.reach()[1]) {
            let shares =
                outline.strip([y_edges.at(row), y_edges.at(row + 1)], &x_edges, cols.clone(), piece.gradient());
            for (col, share) in cols.clone().zip(shares) {
                let cell = row * sensor.cols + col;
                forces.fx[cell] += share * piece.force_N[0];
                forces.fy[cell] += share * piece.force_N[1];
                forces.fz[cell] += share * piece.force_N[2];
            }
        }
    }
    forces
}

/// Boundaries of the cells along one axis, relative to a piece's centre.
struct Edges {
    count: usize,
    pitch: f64,
    shift: f64,
}

impl Edges {
    fn at(&self, index: usize) -> f64 {
        (index as f64 - self.count as f64 / 2.0) * self.pitch - self.shift
    }

    /// The cells that a piece of half length `reach` can overlap.
    fn cells(&self, reach: f64) -> Range<usize> {
        let place = |mm: f64| (mm + self.shift) / self.pitch + self.count as f64 / 2.0;
        // The casts saturate at 0.
        let first = place(-reach).floor() as usize;
        let last = (place(reach).ceil() as usize).min(self.count);
        first.min(last)..last
    }
}

/// The region of a piece, relative to its centre.
enum Outline {
    /// A, B, C of the quadratic form; whether the pressure is Hertz's.
    Ellipse { a: f64, b: f64, c: f64, hertz: bool },
    /// The corners in order; the area.
    Polygon { corners: [[f64; 2]; 4], area: f64 },
}

impl Outline {
    fn new(piece: &Piece) -> Outline {
        let ([p, q], [cos, sin]) = (piece.half_mm, piece.turn);
        match piece.form {
            PressureShape::Hertz | PressureShape::Disc => {
                let (p, q) = (1.0 / (p * p), 1.0 / (q * q));
                Outline::Ellipse {
                    a: cos * cos * p + sin * sin * q,
                    b: cos * sin * (p - q),
                    c: sin * sin * p + cos * cos * q,
                    hertz: piece.form == PressureShape::Hertz,
                }
            }
            PressureShape::Square => {
                let corner = |x: f64, y: f64| [x * p * cos - y * q * sin, x * p * sin + y * q * cos];
                let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
                Outline::Polygon { corners, area: 4.0 * p * q }
            }
        }
    }

    /// Largest |x| and |y|.
    fn reach(&self) -> [f64; 2] {
        match self {
            Outline::Ellipse { a, b, c, .. } => {
                let root = (a * c - b * b).sqrt();
                [c.sqrt() / root, a.sqrt() / root]
            }
            Outline::Polygon { corners, .. } => {
                [0, 1].map(|axis| corners.iter().fold(0.0, |most: f64, corner| most.max(corner[axis].abs())))
            }
        }
    }

    /// Fractions of the load on the cells of one row; `gradient` is that of the tilt.
    fn strip(&self, [low, high]: [f64; 2], edges: &Edges, cols: Range<usize>, gradient: [f64; 2]) -> Vec<f64> {
        let reach = self.reach()[1];
        let mut breaks = vec![low, high, -reach, reach];
        (cols.start..=cols.end).for_each(|edge| self.add_crossings(edges.at(edge), &mut breaks));
        if let Outline::Polygon { corners, .. } = self {
            breaks.extend(corners.map(|corner| corner[1]));
        }
        breaks.iter_mut().for_each(|y| *y = y.clamp(low.max(-reach), high.min(reach).max(low.max(-reach))));
        breaks.sort_by(f64::total_cmp);
        let mut shares = vec![0.0; cols.len()];
        for pair in breaks.windows(2).filter(|pair| pair[1] > pair[0]) {
            let (middle, half) = ((pair[0] + pair[1]) / 2.0, (pair[1] - pair[0]) / 2.0);
            for &(t, weight) in rule(NODES) {
                let angle = t * FRAC_PI_2;
                let weight = weight * FRAC_PI_2 * half * angle.cos();
                let chord = self.chord(middle + half * angle.sin(), gradient);
                let mut before = chord.up_to(edges.at(cols.start));
                for (share, col) in shares.iter_mut().zip(cols.clone()) {
                    let after = chord.up_to(edges.at(col + 1));
                    *share += weight * (after - before);
                    before = after;
                }
            }
        }
        shares
    }

    /// Adds the y at which the outline crosses the line at `x`.
    fn add_crossings(&self, x: f64, breaks: &mut Vec<f64>) {
        match self {
            Outline::Ellipse { a, b, c, .. } => {
                let square = b * b * x * x - c * (a * x * x - 1.0);
                if square > 0.0 {
                    breaks.extend([-1.0, 1.0].map(|sign| (-b * x + sign * square.sqrt()) / c));
                }
            }
            Outline::Polygon { corners, .. } => {
                for k in 0..4 {
                    let ([x0, y0], [x1, y1]) = (corners[k], corners[(k + 1) % 4]);
                    if (x0 < x) != (x1 < x) {
                        breaks.push(y0 + (y1 - y0) * (x - x0) / (x1 - x0));
                    }
                }
            }
        }
    }

    /// The region's chord at y.
    fn chord(&self, y: f64, gradient: [f64; 2]) -> Chord {
        let chord = |middle: f64, half: f64, scale: f64, hertz: bool| {
            let level = 1.0 + gradient[0] * middle + gradient[1] * y;
            Chord { middle, half, scale, level, slope: gradient[0] * half, hertz }
        };
        match self {
            Outline::Ellipse { a, b, c, hertz } => {
                let m = (1.0 - (c - b * b / a) * y * y).max(0.0);
                let area = PI / (a * c - b * b).sqrt();
                let (half, middle) = ((m / a).sqrt(), -b * y / a);
                let scale = if *hertz { 1.5 * m / a.sqrt() / area } else { half / area };
                chord(middle, half, scale, *hertz)
            }
            Outline::Polygon { corners, area } => {
                let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
                for k in 0..4 {
                    let ([x0, y0], [x1, y1]) = (corners[k], corners[(k + 1) % 4]);
                    if (y0 < y) != (y1 < y) {
                        let x = x0 + (x1 - x0) * (y - y0) / (y1 - y0);
                        (low, high) = (low.min(x), high.max(x));
                    }
                }
                if low > high {
                    (low, high) = (0.0, 0.0);
                }
                let half = (high - low) / 2.0;
                chord((low + high) / 2.0, half, half / area, false)
            }
        }
    }
}

/// A chord, with the fraction of the load per mm of y from its start to a point.
struct Chord {
    middle: f64,
    half: f64,
    scale: f64,
    /// The tilt's factor in the middle, and its change from there to the end.
    level: f64,
    slope: f64,
    hertz: bool,
}

impl Chord {
    fn up_to(&self, x: f64) -> f64 {
        if self.half <= 0.0 {
            return 0.0;
        }
        let t = ((x - self.middle) / self.half).clamp(-1.0, 1.0);
        let root = (1.0 - t * t).sqrt();
        let [even, odd] = match self.hertz {
            true => [(t * root + t.asin() + FRAC_PI_2) / 2.0, -root * root * root / 3.0],
            false => [t + 1.0, (t * t - 1.0) / 2.0],
        };
        self.scale * (self.level * even + self.slope * odd)
    }
}
