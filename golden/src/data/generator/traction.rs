//! Traction: decomposition of a described contact into simple pieces.
//!
//! A piece is a region with a pressure distribution and a force of fixed direction. A contact is a sum of pieces: a
//! ring is a disc minus a disc, partial slip is the pressure and a smaller one with shear alone, a lobed contact is two Hertz
//! pressures of which the smaller one touches the rim of the other, a foot is one square per pixel.

use super::plantar::{self, Foot};
use super::GeneratorError;
use crate::data::frame::Contact;
use crate::spec::sensor::Sensor;

/// Share of the load and of the half-axes of the smaller pressure of a lobed contact.
const LOBE: [f64; 2] = [0.35, 0.5];

/// Pressure distribution of a piece, in coordinates that are ±1 at its half-axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PressureShape {
    /// √(1 − ρ²) on the disc.
    Hertz,
    /// Uniform on the disc.
    Disc,
    /// Uniform on the square.
    Square,
}

/// A region with its traction.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Piece {
    /// Pressure distribution and region.
    pub(super) form: PressureShape,
    /// Centre of the region.
    pub(super) centre_mm: [f64; 2],
    /// Half-axes.
    pub(super) half_mm: [f64; 2],
    /// Cosine and sine of the angle from +x to the first half-axis.
    pub(super) turn: [f64; 2],
    /// Slopes of the pressure along the half-axes, in units of the mean at the half-axis' end: the pressure's factor is
    /// 1 + tilt·(X, Y). The load does not depend on it.
    pub(super) tilt: [f64; 2],
    /// Force of the whole piece, [x, y, normal].
    pub(super) force_N: [f64; 3],
}

impl Piece {
    /// Whether the smallest rectangle around the region, parallel to the array, has points above the array.
    pub(super) fn touches(&self, sensor: &Sensor) -> bool {
        let ([a, b], [cos, sin]) = (self.half_mm, self.turn.map(f64::abs));
        let reach = match self.form {
            PressureShape::Square => [a * cos + b * sin, a * sin + b * cos],
            PressureShape::Hertz | PressureShape::Disc => [(a * cos).hypot(b * sin), (a * sin).hypot(b * cos)],
        };
        let half = sensor.half_mm();
        (0..2).all(|axis| self.centre_mm[axis].abs() < half[axis] + reach[axis])
    }

    /// The tilt's gradient in 1/mm along x and y.
    pub(super) fn gradient(&self) -> [f64; 2] {
        let [along, across] = [self.tilt[0] / self.half_mm[0], self.tilt[1] / self.half_mm[1]];
        let [cos, sin] = self.turn;
        [along * cos - across * sin, along * sin + across * cos]
    }

    /// Centre of pressure in mm: the tilt shifts it by its share of the mean square of X.
    pub(super) fn centre_of_pressure_mm(&self) -> [f64; 2] {
        let square = match self.form {
            PressureShape::Hertz => 1.0 / 5.0,
            PressureShape::Disc => 1.0 / 4.0,
            PressureShape::Square => 1.0 / 3.0,
        };
        let [along, across] = [0, 1].map(|axis| square * self.tilt[axis] * self.half_mm[axis]);
        let [cos, sin] = self.turn;
        [self.centre_mm[0] + along * cos - across * sin, self.centre_mm[1] + along * sin + across * cos]
    }
}

/// Force of all pieces in N, [x, y, normal].
pub(super) fn total_N(pieces: &[Piece]) -> [f64; 3] {
    let mut total = [0.0; 3];
    pieces.iter().for_each(|piece| (0..3).for_each(|axis| total[axis] += piece.force_N[axis]));
    total
}

/// Centre of pressure of all pieces in mm.
pub(super) fn centre_of_pressure_mm(pieces: &[Piece]) -> [f64; 2] {
    let normal = total_N(pieces)[2];
    let moment = |axis: usize| pieces.iter().map(move |piece| piece.force_N[2] * piece.centre_of_pressure_mm()[axis]);
    [0, 1].map(|axis| moment(axis).sum::<f64>() / normal)
}

/// The pieces of one contact; `index` names it in errors.
pub(super) fn pieces(index: usize, contact: &Contact) -> Result<Vec<Piece>, GeneratorError> {
    let fail = |field, value: String, allowed: &str| {
        Err(GeneratorError::Contact { index, field, value, allowed: allowed.to_string() })
    };
    let centre_mm = contact.centre_mm.unwrap_or_default();
    if !centre_mm.iter().all(|c| c.is_finite()) {
        return fail("centre_mm", format!("{centre_mm:?}"), "two finite numbers");
    }
    let Some(normal) = contact.normal_N.filter(|n| *n > 0.0 && n.is_finite()) else {
        return fail("normal_N", stated(contact.normal_N), "a finite number above 0");
    };
    let shear = contact.tangential_N.unwrap_or_default();
    if !shear.iter().all(|t| t.is_finite()) {
        return fail("tangential_N", format!("{shear:?}"), "two finite numbers");
    }
    let sizes = &contact.size_mm;
    let lengths = |count: usize| sizes.iter().take(count).all(|s| *s > 0.0 && s.is_finite());
    let shape = contact.shape.as_deref().unwrap_or_default();
    let allowed = match (shape, sizes.as_slice()) {
        ("hertz-circle", [_]) | ("flat-punch", [_]) if lengths(1) => None,
        ("hertz-ellipse" | "flat-punch" | "rectangle", [_, _, angle]) if lengths(2) && angle.is_finite() => None,
        ("lobed", [_, _, angle]) if lengths(2) && angle.is_finite() => None,
        ("tilted", [_, _, angle, u, v]) if lengths(2) && angle.is_finite() && u.hypot(*v) <= 1.0 => None,
        ("ring", [outer, inner]) if lengths(2) && inner < outer => None,
        ("rectangle", [_, _]) | ("hertz-ellipse", [_, _]) if lengths(2) => None,
        (_, []) if Foot::named(shape).is_some() => None,
        (_, [_, _]) if Foot::named(shape).is_some() && lengths(2) => None,
        (_, [_, _, angle]) if Foot::named(shape).is_some() && lengths(2) && angle.is_finite() => None,
        ("hertz-circle", _) => Some("[a], a above 0"),
        ("hertz-ellipse", _) => Some("[a, b, angle], a and b above 0"),
        ("flat-punch", _) => Some("[a] or [a, b, angle], a and b above 0"),
        ("lobed", _) => Some("[a, b, angle], a and b above 0"),
        ("tilted", _) => Some("[a, b, angle, u, v], a and b above 0, √(u² + v²) at most 1"),
        ("ring", _) => Some("[outer, inner], inner above 0 and below outer"),
        ("rectangle", _) => Some("[width, height, angle], width and height above 0"),
        _ if Foot::named(shape).is_some() => Some("[], or [width, length, angle], width and length above 0"),
        _ => {
            let known = "hertz-circle, hertz-ellipse, tilted, lobed, flat-punch, ring, rectangle, plantar-left or plantar-right";
            return fail("shape", format!("{shape:?}"), known);
        }
    };
    if let Some(allowed) = allowed {
        return fail("size_mm", format!("{sizes:?}"), allowed);
    }
    let angle = contact.rotation_rad.unwrap_or_else(|| sizes.get(2).map_or(0.0, |degrees| degrees.to_radians()));
    let outline = Outline { shape, sizes, centre_mm, turn: [angle.cos(), angle.sin()] };
    let force = [shear[0], shear[1], normal];
    match contact.kind_of_slip.as_deref().unwrap_or("full-sliding") {
        "none" if shear != [0.0; 2] => fail("tangential_N", format!("{shear:?}"), "[0, 0] without slip"),
        "none" | "full-sliding" | "proportional" => Ok(outline.full_slip(force)),
        slip @ ("partial-slip" | "even-shear") if Foot::named(shape).is_some() => {
            fail("kind_of_slip", format!("{slip:?}"), "none or full-sliding for feet")
        }
        "partial-slip" => {
            let ratio = shear[0].hypot(shear[1]) / normal;
            let friction = contact.friction.unwrap_or(f64::NAN);
            // A NaN fails the comparison.
            if !(friction > ratio && friction.is_finite()) {
                let value = stated(contact.friction);
                return fail("friction", value, "given and above the ratio of tangential to normal load");
            }
            Ok(outline.partial_slip(force, friction))
        }
        "even-shear" => Ok(outline.even_shear(force)),
        slip => fail("kind_of_slip", format!("{slip:?}"), "none, full-sliding, partial-slip or even-shear"),
    }
}

/// Half-axes of a contact that may be round.
fn both(sizes: &[f64]) -> [f64; 2] {
    [sizes[0], *sizes.get(1).unwrap_or(&sizes[0])]
}

/// Where a contact is, its sizes checked.
struct Outline<'a> {
    shape: &'a str,
    sizes: &'a [f64],
    centre_mm: [f64; 2],
    turn: [f64; 2],
}

impl Outline<'_> {
    fn piece(&self, form: PressureShape, half_mm: [f64; 2], force_N: [f64; 3]) -> Piece {
        Piece { form, centre_mm: self.centre_mm, half_mm, turn: self.turn, tilt: [0.0; 2], force_N }
    }

    /// A force that is spread as the pressure.
    fn full_slip(&self, force: [f64; 3]) -> Vec<Piece> {
        let Outline { shape, sizes, centre_mm, turn } = *self;
        let times = |factor: f64| force.map(|f| f * factor);
        match shape {
            "hertz-circle" | "hertz-ellipse" => vec![self.piece(PressureShape::Hertz, both(sizes), force)],
            "tilted" => {
                vec![Piece { tilt: [sizes[3], sizes[4]], ..self.piece(PressureShape::Hertz, both(sizes), force) }]
            }
            "lobed" => {
                let [share, size] = LOBE;
                let off = (1.0 - size) * sizes[0];
                let centre = [centre_mm[0] + off * turn[0], centre_mm[1] + off * turn[1]];
                let lobe = self.piece(PressureShape::Hertz, both(sizes).map(|a| size * a), times(share));
                let rest = self.piece(PressureShape::Hertz, both(sizes), times(1.0 - share));
                vec![rest, Piece { centre_mm: centre, ..lobe }]
            }
            "flat-punch" => vec![self.piece(PressureShape::Disc, both(sizes), force)],
            "rectangle" => vec![self.piece(PressureShape::Square, [sizes[0] / 2.0, sizes[1] / 2.0], force)],
            "ring" => self.ring([sizes[0], sizes[1]], force),
            _ => plantar::pixels(shape, sizes)
                .into_iter()
                .map(|pixel| {
                    let [x, y] = pixel.centre_mm;
                    let centre = [x * turn[0] - y * turn[1] + centre_mm[0], x * turn[1] + y * turn[0] + centre_mm[1]];
                    Piece { centre_mm: centre, ..self.piece(PressureShape::Square, pixel.half_mm, times(pixel.share)) }
                })
                .collect(),
        }
    }

    /// A force that is spread evenly between two circles.
    fn ring(&self, [outer, inner]: [f64; 2], force: [f64; 3]) -> Vec<Piece> {
        let area = outer * outer - inner * inner;
        let disc = |radius: f64, sign: f64| {
            self.piece(PressureShape::Disc, [radius; 2], force.map(|f| f * sign * radius * radius / area))
        };
        vec![disc(outer, 1.0), disc(inner, -1.0)]
    }

    /// The pressure with shear at the friction limit, minus the excess shear of the area that sticks: the pressure that a smaller
    /// load would cause (Jäger 1998), of c times the size on a core c times as wide.
    fn partial_slip(&self, force: [f64; 3], friction: f64) -> Vec<Piece> {
        let [tx, ty, normal] = force;
        let shear = tx.hypot(ty);
        if shear == 0.0 {
            return self.full_slip(force);
        }
        let limit = friction * normal / shear;
        // The load that sticks, as a share of all; limit times this of the shear.
        let stick = 1.0 - 1.0 / limit;
        let excess = [tx * (1.0 - limit), ty * (1.0 - limit), 0.0];
        let core = match self.shape {
            // Narrower, and not smaller.
            "ring" => {
                let [middle, half] = [0.5 * (self.sizes[0] + self.sizes[1]), 0.5 * (self.sizes[0] - self.sizes[1])];
                let width = stick.sqrt() * half;
                self.ring([middle + width, middle - width], excess)
            }
            _ => {
                let smaller = |piece: Piece| Piece { half_mm: piece.half_mm.map(|half| stick.cbrt() * half), ..piece };
                self.full_slip(excess).into_iter().map(smaller).collect()
            }
        };
        let mut pieces = self.full_slip([tx * limit, ty * limit, normal]);
        pieces.extend(core);
        pieces
    }

    /// The pressure with a shear that is the same everywhere.
    fn even_shear(&self, force: [f64; 3]) -> Vec<Piece> {
        let [tx, ty, normal] = force;
        if matches!(self.shape, "flat-punch" | "rectangle" | "ring") {
            return self.full_slip(force);
        }
        let mut pieces = self.full_slip([0.0, 0.0, normal]);
        pieces.push(self.piece(PressureShape::Disc, both(self.sizes), [tx, ty, 0.0]));
        pieces
    }
}

/// A number for a message.
fn stated(number: Option<f64>) -> String {
    number.map_or_else(|| "none".to_string(), |number| number.to_string())
}
