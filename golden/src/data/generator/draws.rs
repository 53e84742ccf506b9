//! Draws: seeded random frames of any shape, with the force of each contact, for tables over many frames.
//!
//! | drawn | range |
//! |---|---|
//! | shape of contact k of frame n | `shapes` in turn, from the (n + k)th |
//! | half-axes, angle, place | as [`super::random_contacts`] |
//! | inner over outer radius of a ring | 0.3 … 0.7 |
//! | tilt | 0.3 … 0.8, any direction |
//! | normal load | `normal_N`, 1 … 12 N |
//! | shear over load | `ratio`, 0.15 … 0.5, any direction |
//! | spread of the shear | `slip`, full |
//!
//! Frames that differ in `slip` alone have the same contacts and forces.
//!
//! The stress is the generator's quadrature of the continuous traction, on the scene's medium. `converter` makes the
//! readings: noise as a share of max |b|, gains, drift, averaging, clipping, codes.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: number of the frame | scalar | – |
//! | out: exact stress, readings | taxels each | MPa |
//! | out: truth | centre and force per contact, total | mm, N |

use super::converter::Converter;
use super::random::placed;
use super::slip::Slip;
use super::traction::{centre_of_pressure_mm, pieces, total_N};
use super::{generate, GeneratorError};
use crate::data::frame::{Contact, Frame};
use crate::random::Random;
use crate::spec::scene::{Medium, Scene};
use crate::spec::sensor::Sensor;
use std::f64::consts::TAU;

/// Draws of all places before the array counts as too small.
const TRIES: usize = 20;
/// Largest number of contacts of a frame.
const MOST_CONTACTS: usize = 64;
/// Multiplier of the seed: neighbouring seeds have no random numbers in common.
pub(super) const SPREAD: u64 = 0x9e37_79b9_7f4a_7c15;

/// Shape of a drawn contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactShape {
    /// Hertz's pressure on an ellipse.
    Hertz,
    /// Uniform pressure on an ellipse.
    Punch,
    /// Uniform pressure between two circles.
    Ring,
    /// Uniform pressure on a rectangle.
    Rectangle,
    /// Hertz's pressure on an ellipse, times a linear function.
    Tilted,
    /// Two Hertz pressures, the smaller one beside the centre: a pressure that is not even about any point.
    Asymmetric,
}

impl ContactShape {
    /// Every shape with its name in options and tables.
    pub const NAMES: [(&'static str, ContactShape); 6] = [
        ("hertz", ContactShape::Hertz),
        ("punch", ContactShape::Punch),
        ("ring", ContactShape::Ring),
        ("rectangle", ContactShape::Rectangle),
        ("tilted", ContactShape::Tilted),
        ("asymmetric", ContactShape::Asymmetric),
    ];

    /// The five shapes of the published tables, in equal shares: all but `asymmetric`.
    pub const TABLE: [ContactShape; 5] =
        [ContactShape::Hertz, ContactShape::Punch, ContactShape::Ring, ContactShape::Rectangle, ContactShape::Tilted];

    /// The name in options and tables.
    pub fn name(self) -> &'static str {
        ContactShape::NAMES.iter().find(|(_, shape)| *shape == self).map_or("", |(name, _)| *name)
    }

    /// Shape and sizes of a contact with the given half-axes, as [`crate::data::generator`] takes them.
    fn describe(self, random: &mut Random, [a, b]: [f64; 2]) -> (&'static str, Vec<f64>) {
        let angle = random.between(0.0, 180.0);
        let long = a.max(b);
        match self {
            ContactShape::Hertz => ("hertz-ellipse", vec![a, b, angle]),
            ContactShape::Punch => ("flat-punch", vec![a, b, angle]),
            ContactShape::Ring => ("ring", vec![long, random.between(0.3, 0.7) * long]),
            // The corners reach as far as the ellipse.
            ContactShape::Rectangle => ("rectangle", vec![1.41 * a, 1.41 * b, angle]),
            ContactShape::Tilted => {
                let (tilt, towards) = (random.between(0.3, 0.8), random.between(0.0, TAU));
                ("tilted", vec![a, b, angle, tilt * towards.cos(), tilt * towards.sin()])
            }
            ContactShape::Asymmetric => ("lobed", vec![a, b, angle]),
        }
    }
}

/// What is drawn; equal options give equal frames.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawOptions {
    /// The shapes, taken in turn; not empty.
    pub shapes: Vec<ContactShape>,
    /// Number of contacts of a frame, 1 to 64; they do not overlap.
    pub contacts: usize,
    /// Smallest and largest normal load of a contact in N.
    pub normal_N: [f64; 2],
    /// Smallest and largest ratio of shear to normal load.
    pub ratio: [f64; 2],
    /// How the shear is spread over a contact.
    pub slip: Slip,
    /// max |b| of the exact stress in MPa, to which all loads of a frame are scaled; `None`: not scaled.
    pub peak_MPa: Option<f64>,
    /// The sensor; its seed is added to that of each frame.
    pub converter: Converter,
    /// Seed of contacts and noise.
    pub seed: u64,
}

impl Default for DrawOptions {
    fn default() -> Self {
        DrawOptions {
            shapes: ContactShape::TABLE.to_vec(),
            contacts: 1,
            normal_N: [1.0, 12.0],
            ratio: [0.15, 0.5],
            slip: Slip::Full,
            peak_MPa: None,
            converter: Converter::default(),
            seed: 1,
        }
    }
}

/// The truth of one contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactTruth {
    /// Its shape.
    pub shape: ContactShape,
    /// Centre of pressure in mm from the array's centre.
    pub centre_mm: [f64; 2],
    /// Force in N, [x, y, normal].
    pub force_N: [f64; 3],
}

/// A drawn frame.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnFrame {
    /// The frame as the sensor reads it; contacts, resultant and cell forces are the true ones.
    pub frame: Frame,
    /// Stress without noise, gains and clipping in MPa, row-major.
    pub exact_MPa: Vec<f64>,
    /// The contacts.
    pub truth: Vec<ContactTruth>,
    /// Force of all contacts in N, [x, y, normal].
    pub total_N: [f64; 3],
}

impl DrawnFrame {
    /// max |b| of the exact stress in MPa.
    pub fn peak_MPa(&self) -> f64 {
        self.exact_MPa.iter().fold(0.0f64, |peak, b| b.abs().max(peak))
    }

    /// The frame as another sensor reads it.
    ///
    /// # Errors
    /// As [`Converter::convert`].
    pub fn read(&self, converter: &Converter) -> Result<Frame, GeneratorError> {
        converter.convert(&Frame { stress_MPa: self.exact_MPa.clone(), ..self.frame.clone() })
    }
}

/// Draws frames of one scene.
#[derive(Clone, Debug)]
pub struct Draws {
    sensor: Sensor,
    medium: Medium,
    options: DrawOptions,
}

impl Draws {
    /// Frames for sensor and medium of a scene.
    ///
    /// ```
    /// use dermis_golden::{data::generator::{converter::Converter, draws::{DrawOptions, Draws}}, spec::scene::Scene};
    ///
    /// let converter = Converter { noise: 0.002, gain_spread: 0.01, frames: 64, unipolar: true, ..Default::default() };
    /// let draws = Draws::new(&Scene::builtin("sensor-3")?, DrawOptions { contacts: 3, converter, ..Default::default() })?;
    /// let drawn = draws.frame(7)?;
    /// assert_eq!((drawn.truth.len(), drawn.frame.resultant_N), (3, Some(drawn.total_N)));
    /// assert!(drawn.frame.stress_MPa.iter().all(|b| *b >= 0.0) && drawn.exact_MPa.iter().any(|b| *b < 0.0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`GeneratorError::Option`] without shapes or contacts, and for a range of loads or ratios that is not one.
    pub fn new(scene: &Scene, options: DrawOptions) -> Result<Draws, GeneratorError> {
        let fail = |field, value, allowed| Err(GeneratorError::Option { field, value, allowed });
        if options.shapes.is_empty() {
            return fail("shapes", 0.0, "at least one");
        }
        if !(1..=MOST_CONTACTS).contains(&options.contacts) {
            return fail("contacts", options.contacts as f64, "a whole number from 1 to 64");
        }
        let [light, heavy] = options.normal_N;
        if !(light > 0.0 && heavy >= light && heavy.is_finite()) {
            return fail("normal_N", if light > 0.0 { heavy } else { light }, "two finite numbers above 0 in order");
        }
        let [low, high] = options.ratio;
        if !(low >= 0.0 && high >= low && high.is_finite()) {
            return fail("ratio", if low >= 0.0 { high } else { low }, "two finite numbers of at least 0 in order");
        }
        if let Some(peak) = options.peak_MPa.filter(|peak| !(*peak > 0.0 && peak.is_finite())) {
            return fail("peak_MPa", peak, "a finite number above 0");
        }
        Ok(Draws { sensor: scene.sensor.clone(), medium: scene.medium, options })
    }

    /// The options.
    pub fn options(&self) -> &DrawOptions {
        &self.options
    }

    /// The contacts of a frame.
    ///
    /// # Errors
    /// [`GeneratorError::Option`] if so many contacts have no room on the array.
    pub fn contacts(&self, number: u64) -> Result<Vec<Contact>, GeneratorError> {
        let DrawOptions { contacts: count, normal_N, ratio, slip, seed, .. } = self.options;
        let seed = seed.wrapping_mul(SPREAD) ^ number << 32;
        let (mut random, mut of_slip) = (Random::new(seed), Random::new(!seed));
        let shaped = |random: &mut Random, index: usize, axes: [f64; 2]| {
            let (shape, size_mm) = self.shape(number, index).describe(random, axes);
            let normal = random.between(normal_N[0], normal_N[1]);
            let (shear, towards) = (normal * random.between(ratio[0], ratio[1]), random.between(0.0, TAU));
            Contact {
                shape: Some(shape.to_string()),
                size_mm,
                normal_N: Some(normal),
                tangential_N: Some([shear * towards.cos(), shear * towards.sin()]),
                ..Default::default()
            }
        };
        for _ in 0..TRIES {
            if let (contacts, true) = placed(&self.sensor, &mut random, count, false, shaped) {
                return Ok(contacts.into_iter().map(|contact| slip.of(contact, &mut of_slip)).collect());
            }
        }
        let allowed = "so few that they fit on the array without overlap";
        Err(GeneratorError::Option { field: "contacts", value: count as f64, allowed })
    }

    fn shape(&self, number: u64, index: usize) -> ContactShape {
        let shapes = &self.options.shapes;
        shapes[((number % shapes.len() as u64) as usize + index) % shapes.len()]
    }

    /// The frame of a number; another number is another frame, the same number the same.
    ///
    /// # Errors
    /// As [`Draws::contacts`]; [`GeneratorError`] of the sensor or the converter.
    pub fn frame(&self, number: u64) -> Result<DrawnFrame, GeneratorError> {
        let id = format!("drawn-{}-{number}", self.options.seed);
        let mut contacts = self.contacts(number)?;
        let mut exact = generate(&id, &self.sensor, self.medium, &contacts)?;
        if let Some(wanted) = self.options.peak_MPa {
            let scale = wanted / exact.peak_MPa();
            for contact in &mut contacts {
                contact.normal_N = contact.normal_N.map(|normal| scale * normal);
                contact.tangential_N = contact.tangential_N.map(|shear| shear.map(|t| scale * t));
            }
            exact = generate(&id, &self.sensor, self.medium, &contacts)?;
        }
        let truth = |(index, contact): (usize, &Contact)| {
            let pieces = pieces(index, contact)?;
            let (centre_mm, force_N) = (centre_of_pressure_mm(&pieces), total_N(&pieces));
            Ok(ContactTruth { shape: self.shape(number, index), centre_mm, force_N })
        };
        let truth: Vec<ContactTruth> = contacts.iter().enumerate().map(truth).collect::<Result<_, GeneratorError>>()?;
        let mut total_N = [0.0; 3];
        truth.iter().for_each(|contact| (0..3).for_each(|axis| total_N[axis] += contact.force_N[axis]));
        let converter = &self.options.converter;
        let seed = converter.seed.wrapping_add(self.options.seed).wrapping_mul(SPREAD) ^ (number << 32 | 1);
        let frame = Converter { seed, ..converter.clone() }.convert(&exact)?;
        Ok(DrawnFrame { frame, exact_MPa: exact.stress_MPa, truth, total_N })
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::{random_contacts, Draw, Shapes};
    use super::*;
    use std::f64::consts::PI;

    fn draws(scene: &str, options: DrawOptions) -> Draws {
        Draws::new(&Scene::builtin(scene).unwrap(), options).unwrap()
    }

    fn all() -> Vec<ContactShape> {
        ContactShape::NAMES.map(|(_, shape)| shape).to_vec()
    }

    #[test]
    fn shapes_take_turns_and_frames_repeat() {
        let draws = draws("sensor-1", DrawOptions { shapes: all(), ..Default::default() });
        for number in 0..12 {
            let drawn = draws.frame(number).unwrap();
            assert_eq!(drawn.truth[0].shape, all()[number as usize % 6]);
            assert_eq!(drawn, draws.frame(number).unwrap());
            let [x, y, normal] = drawn.total_N;
            let ratio = x.hypot(y) / normal;
            assert!((0.15..=0.5).contains(&ratio) && (1.0..=12.0).contains(&normal), "{drawn:?}");
            assert_ne!(drawn.exact_MPa, draws.frame(number + 12).unwrap().exact_MPa);
        }
    }

    #[test]
    fn cells_carry_the_forces_about_the_centre_of_pressure() {
        // Fine cells: the sum over cells of force times place is the true moment up to a thousandth of a cell.
        let fine = Scene {
            sensor: Sensor { rows: 200, cols: 200, pitch_x_mm: 0.1, pitch_y_mm: 0.1, thickness_mm: 3.0 },
            ..Scene::builtin("sensor-1").unwrap()
        };
        for (number, shape) in all().into_iter().enumerate() {
            let draws = Draws::new(&fine, DrawOptions { shapes: vec![shape], ..Default::default() }).unwrap();
            let contacts = draws.contacts(number as u64).unwrap();
            let pieces = pieces(0, &contacts[0]).unwrap();
            let cells = super::super::cells::forces(&fine.sensor, &pieces);
            let (total, sum) = (total_N(&pieces), cells.resultant());
            assert!((0..3).all(|k| (total[k] - sum[k]).abs() < 1e-9 * total[2]), "{shape:?}: {total:?} {sum:?}");
            let mut centre = [0.0; 2];
            for (index, force) in cells.fz.iter().enumerate() {
                assert!(*force > -1e-12 * total[2], "{shape:?}: tension");
                let at = fine.sensor.position_mm(index / 200, index % 200);
                (0..2).for_each(|axis| centre[axis] += force / total[2] * at[axis]);
            }
            let wanted = centre_of_pressure_mm(&pieces);
            assert!((0..2).all(|k| (centre[k] - wanted[k]).abs() < 2e-3), "{shape:?}: {centre:?} {wanted:?}");
        }
    }

    #[test]
    fn the_stress_is_that_of_the_forces_on_fine_cells() {
        // Two independent ways: quadrature of the kernel of a point force, and cells of 0.2 mm.
        let sensor = Sensor { rows: 80, cols: 80, pitch_x_mm: 0.2, pitch_y_mm: 0.2, thickness_mm: 3.0 };
        let fine = Scene { sensor: sensor.clone(), ..Scene::builtin("sensor-1").unwrap() };
        for shape in [ContactShape::Tilted, ContactShape::Asymmetric] {
            let draws = Draws::new(&fine, DrawOptions { shapes: vec![shape], ..Default::default() }).unwrap();
            let contacts = draws.contacts(5).unwrap();
            let drawn_pieces = pieces(0, &contacts[0]).unwrap();
            let cells = super::super::cells::forces(&sensor, &drawn_pieces);
            let body = crate::physics::body::Body::HalfSpace { h: 3.0 };
            let taxels = [[0.0, 0.0], [2.05, -3.05], [-6.0, 1.0]];
            let wanted = taxels.map(|taxel| body.stress_MPa(taxel, &drawn_pieces));
            let peak = wanted.iter().fold(0.0f64, |peak, b| b.abs().max(peak));
            for (taxel, wanted) in taxels.iter().zip(wanted) {
                let mut sum = 0.0;
                for index in 0..sensor.taxels() {
                    let at = sensor.position_mm(index / 80, index % 80);
                    let [dx, dy] = [taxel[0] - at[0], taxel[1] - at[1]];
                    let [x, y, z] =
                        [crate::physics::influence::cx, crate::physics::influence::cy, crate::physics::influence::cz]
                            .map(|f| f(dx, dy, 0.2, 0.2, 3.0));
                    sum += x * cells.fx[index] + y * cells.fy[index] + z * cells.fz[index];
                }
                // Uniform cells blur the pressure by a²/12 ∇²b, with ∇²b at most some 6/h² of the peak.
                assert!((sum - wanted).abs() < 2.3e-3 * peak, "{shape:?} {taxel:?}: {sum} {wanted}");
            }
        }
    }

    #[test]
    fn several_contacts_stay_apart_or_are_refused() {
        let draws3 = draws("sensor-3", DrawOptions { contacts: 4, shapes: all(), ..Default::default() });
        for number in 0..20 {
            let contacts = draws3.contacts(number).unwrap();
            let circle = |contact: &Contact| (contact.centre_mm.unwrap(), contact.size_mm[0].max(contact.size_mm[1]));
            for (k, one) in contacts.iter().enumerate() {
                let ([x, y], _) = circle(one);
                assert!(x.abs() < 20.0 && y.abs() < 40.0);
                for other in &contacts[..k] {
                    let ([u, v], _) = circle(other);
                    // Rectangles give full lengths: the larger half-axis of both is at least half the size.
                    assert!((x - u).hypot(y - v) > (circle(one).1 + circle(other).1) / 2.0);
                }
            }
        }
        let crowd = draws("sensor-1", DrawOptions { contacts: 40, ..Default::default() });
        assert!(crowd.frame(0).unwrap_err().to_string().contains("contacts = 40"));
    }

    #[test]
    fn a_bonded_layer_and_a_sensors_readings() {
        let scene = Scene { medium: Medium::BondedLayer { poisson: 0.48 }, ..Scene::builtin("sensor-2").unwrap() };
        let converter = Converter { noise: 0.01, unipolar: true, ..Default::default() };
        let drawn = Draws::new(&scene, DrawOptions { converter, ..Default::default() }).unwrap().frame(4).unwrap();
        assert_eq!(drawn.frame.medium, Some(scene.medium));
        assert_ne!(drawn.frame.stress_MPa, drawn.exact_MPa);
        assert!(drawn.frame.stress_MPa.iter().all(|b| *b >= 0.0));
        assert_eq!(drawn.read(&Converter::default()).unwrap().stress_MPa, drawn.exact_MPa);
    }

    #[test]
    fn contacts_are_seen_on_a_coarse_array() {
        let draws = draws("sensor-4", DrawOptions::default());
        // Of the mean pressure on the largest contact, half-axes of 2 · 1.35 pitches.
        let is_seen = |peak_MPa: f64, normal_N: f64| peak_MPa > normal_N / (PI * (2.7f64 * 8.0).powi(2));
        for number in 0..10 {
            let drawn = draws.frame(number).unwrap();
            assert!(is_seen(drawn.peak_MPa(), drawn.total_N[2]), "{number}");
            let draw = Draw { count: 1, shapes: Shapes::Elliptic, slip: Slip::Full, touching: false, seed: number };
            let frame = generate("random", &draws.sensor, draws.medium, &random_contacts(&draws.sensor, draw)).unwrap();
            assert!(is_seen(frame.peak_MPa(), frame.resultant_N.unwrap()[2]), "{number}");
        }
    }

    #[test]
    fn loads_scale_to_the_peak() {
        let options = DrawOptions { peak_MPa: Some(0.1), ..Default::default() };
        let [drawn, plain] =
            [options, DrawOptions::default()].map(|options| draws("sensor-1", options).frame(3).unwrap());
        assert!((drawn.peak_MPa() / 0.1 - 1.0).abs() < 1e-12);
        let ratio = |drawn: &DrawnFrame| drawn.total_N[0] / drawn.total_N[2];
        assert!((ratio(&drawn) - ratio(&plain)).abs() < 1e-12);
    }

    #[test]
    fn refusals_name_the_option() {
        let scene = Scene::builtin("sensor-1").unwrap();
        let good = DrawOptions::default();
        let cases = [
            (DrawOptions { shapes: vec![], ..good.clone() }, "shapes"),
            (DrawOptions { contacts: 0, ..good.clone() }, "contacts = 0"),
            (DrawOptions { contacts: 65, ..good.clone() }, "contacts = 65"),
            (DrawOptions { peak_MPa: Some(0.0), ..good.clone() }, "peak_MPa"),
            (DrawOptions { normal_N: [0.0, 1.0], ..good.clone() }, "normal_N"),
            (DrawOptions { ratio: [0.5, 0.1], ..good }, "ratio"),
        ];
        for (options, field) in cases {
            assert!(Draws::new(&scene, options).unwrap_err().to_string().starts_with(field));
        }
    }
}
