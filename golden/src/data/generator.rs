//! Generator: frames of stress from described contacts, with their exact forces.
//!
//! ```text
//! contacts ── traction ─┬─ stress ── frame ── converter ── frame as a sensor gives it
//!             pieces    └─ cells ──┘          noise, clipping, codes, dead and stuck taxels
//! ```
//!
//! Stress is the integral of the continuous traction with the kernel of a point force, not a sum over cells, so the
//! reference does not share the cell model of the code under test.
//!
//! | shape | `size_mm` | pressure |
//! |---|---|---|
//! | `hertz-circle` | \[a\] | p0 √(1 − r²/a²) |
//! | `hertz-ellipse` | \[a, b, angle\] | p0 √(1 − X²/a² − Y²/b²) |
//! | `tilted` | \[a, b, angle, u, v\] | p0 (1 + u X/a + v Y/b) √(1 − X²/a² − Y²/b²), √(u² + v²) ≤ 1 |
//! | `lobed` | \[a, b, angle\] | 65 % as `hertz-ellipse`; 35 % on half the half-axes, touching the rim at X = a |
//! | `flat-punch` | \[a\] or \[a, b, angle\] | uniform on a disc or ellipse |
//! | `ring` | \[outer, inner\] | uniform between two circles |
//! | `rectangle` | \[width, height, angle\] | uniform |
//! | `plantar-left`, `plantar-right` | \[width, length, angle\] or none | measured template, uniform on each pixel |
//!
//! Half-axes for ellipses, full lengths for rectangles and feet; angles in degrees from +x towards +y.
//!
//! | `kind_of_slip` | shear traction |
//! |---|---|
//! | `none` | none; the tangential load must be zero |
//! | `full-sliding` (default), `proportional` | \|T\|/N times the pressure |
//! | `partial-slip` | Cattaneo–Mindlin, not for feet: friction (p over a − c/a p over c), c/a = (1 − \|T\|/friction N)^⅓; for a ring, whose width counts, its root |
//! | `even-shear` | \|T\| over the contact's area, not for feet |

mod cells;
pub mod converter;
pub mod draws;
mod error;
mod plantar;
pub mod presses;
mod random;
pub mod slip;
mod stress;
pub mod support;
#[cfg(test)]
mod tests;
mod traction;

pub use error::GeneratorError;
pub use random::{random_contacts, Draw, Shapes, MOST_RANDOM};

use crate::data::frame::{Contact, Frame};
use crate::physics::body::Body;
use crate::spec::scene::Medium;
use crate::spec::sensor::Sensor;

/// Computes the frame of `contacts` on a `medium`: stress on each taxel in MPa, force on each cell in N, resultant in
/// N.
/// ```
/// use dermis_golden::{data::frame::Contact, data::generator::generate, spec::scene::{Medium, Scene}};
///
/// let contact = Contact {
///     shape: Some("hertz-circle".to_string()),
///     size_mm: vec![4.0],
///     normal_N: Some(5.0),
///     tangential_N: Some([1.0, -0.5]),
///     ..Default::default()
/// };
/// let frame = generate("press", &Scene::builtin("sensor-1")?.sensor, Medium::HalfSpace, &[contact])?;
/// assert_eq!(frame.resultant_N, Some([1.0, -0.5, 5.0]));
/// // The contact is inside the array: the cells carry all of it.
/// let cells = frame.cell_forces_N.ok_or("no cells")?.resultant();
/// assert!((cells[0] - 1.0).abs() < 1e-9 && (cells[2] - 5.0).abs() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`GeneratorError`]: a sensor out of range, no contact, or a contact with invalid shape, sizes, loads or slip, or
/// beside the array.
pub fn generate(id: &str, sensor: &Sensor, medium: Medium, contacts: &[Contact]) -> Result<Frame, GeneratorError> {
    sensor.check()?;
    if contacts.is_empty() {
        return Err(GeneratorError::NoContact);
    }
    let mut pieces = Vec::new();
    for (index, contact) in contacts.iter().enumerate() {
        let own = traction::pieces(index, contact)?;
        if !own.iter().any(|piece| piece.touches(sensor)) {
            return Err(beside(index, contact, sensor));
        }
        pieces.extend(own);
    }
    let body = Body::new(medium, sensor.thickness_mm);
    let source = match medium {
        Medium::HalfSpace => "half-space-quadrature",
        Medium::BondedLayer { .. } => "bonded-layer-quadrature",
    };
    let at = |index: usize| sensor.position_mm(index / sensor.cols, index % sensor.cols);
    let stress_MPa: Vec<f64> = (0..sensor.taxels()).map(|index| body.stress_MPa(at(index), &pieces)).collect();
    if let Some(index) = stress_MPa.iter().position(|b| !b.is_finite()) {
        return Err(GeneratorError::NotFinite { index });
    }
    let cell_forces = cells::forces(sensor, &pieces);
    let resultant = traction::total_N(&pieces);
    Ok(Frame {
        id: id.to_string(),
        medium: Some(medium),
        source: Some(source.to_string()),
        sensor: sensor.clone(),
        contacts: contacts.to_vec(),
        resultant_N: Some(resultant),
        cell_forces_N: Some(cell_forces),
        stress_MPa,
        missing: Vec::new(),
        time_ns: None,
        notes: None,
    })
}

/// The error of a contact of which no part is on the array.
fn beside(index: usize, contact: &Contact, sensor: &Sensor) -> GeneratorError {
    let [x, y] = sensor.half_mm();
    GeneratorError::Contact {
        index,
        field: "centre_mm",
        value: format!("{:?}", contact.centre_mm.unwrap_or_default()),
        allowed: format!("such that part of the contact is on the array, x from -{x} to {x}, y from -{y} to {y} mm"),
    }
}
