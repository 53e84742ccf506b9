//! Extreme: frames at the limits of a sensor, and the result of each model.
//!
//! [`frames`] generates them for any scene; [`outcome`] runs both models. "Status" is the hardware's own
//! ([`dermis_golden::fixed::stages::send`]), flags are those of the result ([`dermis_golden::result::flags`]).
//!
//! | frame | result | flags |
//! |---|---|---|
//! | zero | every force exactly zero | `no-contact`, `condition-unmet` |
//! | spike, one taxel | p = Cz⁺'s column: a force of the spike's sign among smaller ones | |
//! | one taxel saturated | golden: forces of the stress as it is; fixed: of the clipped one | `saturated` |
//! | all saturated | the same; all directions are equal, the first is chosen | `saturated`, `load-outside` |
//! | all clipped, unipolar | golden: every force zero; the hardware refuses `input.unipolar` | `no-contact`, … |
//! | all tension | μ = 0, p = p₀: tensile forces | `no-compression` |
//! | checkerboard, Eq. 2 | finite forces; the largest stress lies on the rim | `load-outside` |
//! | μ at its bound, beyond | \|μ\| ≤ mu_max | |
//! | load 10^k of full scale | golden: proportional to it; fixed: error of the remaining codes | ≤ 10⁻⁴ `shear-unreliable` |
//! | … below half an LSB | golden: p₀, not searched; fixed: zero | `condition-unmet`, fixed `no-contact` |
//! | … above full scale | as saturated | `saturated` |
//! | load 2^k, own full scale | golden: proportional to it, to the bit; fixed: the same codes, the same words | |
//! | over the edge, in the corner, larger than the array | forces on the existing cells | `load-outside` |
//! | on a subarray boundary | each side on its own: a boundary through a contact loses part of it | |
//! | smaller than a taxel | the load to 10 %, its position to a cell | |
//!
//! The flags `saturated`, `load-outside`, `shear-unreliable` are derived on the host from frame and codes; the status
//! words report what only the engine knows: condition met, candidate found, no contact, saturations of its own
//! arithmetic, and the framing of its input.

use dermis_golden::fixed::stages::send::{status_fields, Status, STATUS_BEATS};

use dermis_golden::data::frame::{Contact, Frame};
use dermis_golden::data::generator::{generate, GeneratorError};
use dermis_golden::estimate::float::{Golden, GoldenError};
use dermis_golden::fixed::{FixedError, Model};
use dermis_golden::result::flags::{Flag, StatusField};
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::partition::{subarrays, Case};
use dermis_golden::spec::scene::{EstimatorKind, Scene};
use serde::Serialize;

/// Normal load of the contacts in N.
const LOAD_N: f64 = 5.0;
/// Direction of the shear, a unit vector.
const ALONG: [f64; 2] = [0.8, -0.6];
/// Default ratio of shear to load, in units of mu_max.
const SHEAR: f64 = 0.4;
/// Stress of the frames without a contact, in MPa.
const STRESS_MPA: f64 = 0.1;
/// Loads relative to full scale, as powers of ten.
const DECADES: [i32; 9] = [-9, -6, -4, -2, -1, 0, 1, 3, 9];
/// Loads with their own full scale, as powers of two: about 10^±9.
const OCTAVES: [i32; 2] = [-30, 30];

/// An extreme frame with its variant of the scene.
#[derive(Clone, Debug)]
pub struct Extreme {
    /// The scene with the options that make the frame extreme.
    pub scene: Scene,
    /// The frame; its id describes it.
    pub frame: Frame,
}

/// The result of one model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Sum of the forces in N, [x, y, normal].
    pub resultant_N: [f64; 3],
    /// Errors of the resultant as fractions: tangential, normal; `None` if undefined.
    pub errors: [Option<f64>; 2],
    /// Flags of the result.
    pub flags: Vec<Flag>,
}

/// One line of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExtremeRow {
    /// Id of the frame.
    pub frame: String,
    /// Result of the floating-point model.
    pub golden: Outcome,
    /// Result of the bit-true model.
    pub fixed: Option<Outcome>,
    /// Flags and saturations in the hardware's status words, over all subarrays.
    pub status: String,
    /// Why the bit-true model has no result.
    pub refused: Option<String>,
}

/// The extreme frames of a scene.
///
/// # Errors
/// [`GeneratorError`] if a contact does not fit the sensor.
pub fn frames(scene: &Scene) -> Result<Vec<Extreme>, GeneratorError> {
    let sensor = &scene.sensor;
    let [half_x, half_y] = sensor.half_mm();
    let pitch = sensor.pitch_x_mm.min(sensor.pitch_y_mm);
    let circle = |id: &str, shape: &str, radius: f64, centre: [f64; 2], mu: f64| {
        let contact = Contact {
            shape: Some(shape.to_string()),
            centre_mm: Some(centre),
            size_mm: vec![radius],
            normal_N: Some(LOAD_N),
            tangential_N: Some(ALONG.map(|along| along * mu * LOAD_N)),
            ..Default::default()
        };
        generate(id, sensor, scene.medium, &[contact])
    };
    let (radius, mu) = (0.35 * half_x.min(half_y), SHEAR * scene.search.mu_max);
    let press = circle("press", "hertz-circle", radius, [0.0; 2], mu)?;
    let peak = press.peak_MPa();
    let plain = |frame: Frame| Extreme { scene: scene.clone(), frame };
    let scaled = |id: String, factor: f64| {
        let mut frame = Frame { id, ..press.clone() };
        frame.stress_MPa.iter_mut().for_each(|b| *b *= factor);
        frame.resultant_N = frame.resultant_N.map(|force| force.map(|f| f * factor));
        for axis in frame.cell_forces_N.iter_mut().flat_map(|cells| [&mut cells.fx, &mut cells.fy, &mut cells.fz]) {
            axis.iter_mut().for_each(|f| *f *= factor);
        }
        frame
    };
    // Stress without known forces.
    let bare = |id: &str, b: &dyn Fn(usize, usize) -> f64| Frame {
        id: id.to_string(),
        resultant_N: None,
        cell_forces_N: None,
        contacts: Vec::new(),
        stress_MPa: (0..sensor.taxels()).map(|taxel| b(taxel / sensor.cols, taxel % sensor.cols)).collect(),
        ..press.clone()
    };
    let with_scale = |frame: Frame, full_scale: f64| {
        let mut scene = scene.clone();
        scene.input.full_scale_MPa = Some(full_scale);
        Extreme { scene, frame }
    };
    let middle = (sensor.rows / 2, sensor.cols / 2);
    let second = press.stress_MPa.iter().filter(|b| b.abs() < peak).fold(0.0f64, |second, b| second.max(b.abs()));
    let mut extremes = vec![
        plain(bare("zero", &|_, _| 0.0)),
        plain(bare("spike, one taxel", &|row, col| if (row, col) == middle { STRESS_MPA } else { 0.0 })),
        with_scale(Frame { id: "one taxel saturated".into(), ..press.clone() }, (peak + second) / 2.0),
        with_scale(bare("all saturated", &|_, _| 2.0 * STRESS_MPA), STRESS_MPA),
        plain(bare("all tension", &|row, col| -press.stress_MPa[row * sensor.cols + col].abs())),
        plain(bare("checkerboard", &|row, col| if (row + col) % 2 == 0 { STRESS_MPA } else { -STRESS_MPA })),
        plain(Frame { medium: None, ..Frame::eq2(sensor) }),
        plain(circle("μ at its bound", "hertz-circle", radius, [0.0; 2], scene.search.mu_max)?),
        plain(circle("μ beyond its bound", "hertz-circle", radius, [0.0; 2], 1.5 * scene.search.mu_max)?),
    ];
    let mut unipolar =
        plain(bare("all clipped, unipolar", &|row, col| -press.stress_MPa[row * sensor.cols + col].abs()));
    unipolar.scene.input.unipolar = true;
    // A network serves the readings and the partition that it was trained for.
    let network = scene.hardware_estimator() == EstimatorKind::Network;
    if scene.input.unipolar || !network {
        extremes.push(unipolar);
    }
    let decade = |k: &i32| with_scale(scaled(format!("load 1e{k} of full scale"), 10f64.powi(*k)), peak);
    extremes.extend(DECADES.iter().map(decade));
    extremes.extend(OCTAVES.iter().map(|k| plain(scaled(format!("load 2^{k}, own full scale"), 2f64.powi(*k)))));
    extremes.push(plain(circle("over the edge", "hertz-circle", radius, [half_x, 0.0], mu)?));
    extremes.push(plain(circle("in the corner", "hertz-circle", radius, [-half_x, half_y], mu)?));
    // The first of the paper's cases 2 and 3 that divides the array through its middle.
    let cuts = [2, 3].into_iter().filter_map(Case::numbered).find(|case| subarrays(*case, sensor).is_ok());
    if let Some(case) = cuts.filter(|_| !network) {
        let mut cut = plain(circle("on a subarray boundary", "hertz-circle", radius, [0.0; 2], mu)?);
        cut.scene.partition.case = case;
        extremes.push(cut);
    }
    let [x, y] = sensor.position_mm(middle.0, middle.1);
    extremes.push(plain(circle("smaller than a taxel", "hertz-circle", 0.2 * pitch, [x, y], mu)?));
    extremes.push(plain(circle("larger than the array", "flat-punch", 2.0 * half_x.hypot(half_y), [0.0; 2], mu)?));
    Ok(extremes)
}

/// Runs both models on an extreme frame.
///
/// # Errors
/// [`GoldenError`] if the golden model rejects scene or frame.
pub fn outcome(extreme: &Extreme) -> Result<ExtremeRow, GoldenError> {
    let Extreme { scene, frame } = extreme;
    let golden = Golden::reference(scene)?.run(frame)?;
    let fixed = || -> Result<(Reconstruction, String), FixedError> {
        let model = Model::for_frames(scene, std::slice::from_ref(frame))?;
        let trace = model.run(&model.readings(std::slice::from_ref(frame))?);
        Ok((model.decode(std::slice::from_ref(frame), "fixed", &trace.beats, &trace.status)?, status(&trace.status)))
    };
    let (fixed, status, refused) = match fixed() {
        Ok((result, status)) => (Some(of(&result)), status, None),
        Err(error) => (None, String::new(), Some(error.to_string())),
    };
    Ok(ExtremeRow { frame: frame.id.clone(), golden: of(&golden), fixed, status, refused })
}

fn of(result: &Reconstruction) -> Outcome {
    let errors = result.error.map_or([None; 2], |errors| [errors.tangential, errors.normal]);
    Outcome { resultant_N: result.resultant_N, errors, flags: result.flags.clone() }
}

/// The names of the bits that are set in the status words, and the number of saturations if any.
fn status(beats: &[[i32; 3]]) -> String {
    let all: Vec<Status> = Status::all(beats).collect();
    let is_set = |field: &StatusField| field.bits == 1 && beats.chunks(STATUS_BEATS).any(|beats| field.get(beats) != 0);
    let mut words: Vec<String> =
        status_fields().iter().filter(|field| is_set(field)).map(|field| field.name.replace('_', "-")).collect();
    // Every status has the force saturations of the whole frame.
    let saturations = all.iter().map(|status| status.rescale_saturations).sum::<u32>()
        + all.first().map_or(0, |status| status.force_saturations);
    if saturations > 0 {
        words.push(format!("{saturations} saturated"));
    }
    words.join(", ")
}
