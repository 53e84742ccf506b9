//! Frame: the stress on every taxel at one moment, with what is known about the contacts.
//!
//! Frames come from JSON files with known forces, CSV files of rows × cols stresses, recordings, the generator and the paper's Eq.
//! 2.
//!
//! | field | shape | unit | range |
//! |---|---|---|---|
//! | stress | taxels, row-major | MPa | finite, compression positive; 0 where a reading is missing |
//! | missing | list of taxels | – | ascending |
//! | cell forces | 3 × taxels | N | finite, on the body |
//! | resultant | 3 | N | finite, [x, y, normal] of the whole contact |
//! | time of acquisition | – | ns | whole; since 1970, or since a moment that the file does not say |
//!
//! A loaded frame is finite and has as many stresses as its sensor has taxels; [`Frame::check`] compares its sensor
//! with the scene's.
//!
//! A reading that is NaN is missing in its frame, and in no other: `null` in JSON, an empty field, `nan` or `null` in CSV, a
//! masked value in Python. [`Frame::from_stress`] alone makes a missing reading of NaN, [`Frame::readings`] the other way
//! round. What estimators take for it is in [`crate::data::input::missing`].

mod csv;
mod error;
mod json;
mod load;
mod recorded;
mod shipped;
#[cfg(test)]
mod tests;

pub use error::FrameError;
pub(in crate::data) use recorded::frame_name;

use crate::spec::scene::{Medium, Scene};
use crate::spec::sensor::Sensor;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One force vector per taxel, row-major, in N.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Forces {
    /// Forces along x on the elastic body, N.
    pub fx: Vec<f64>,
    /// Forces along y on the elastic body, N.
    pub fy: Vec<f64>,
    /// Normal forces, N; compression is positive.
    pub fz: Vec<f64>,
}

impl Forces {
    /// Zero force on each of `taxels` taxels.
    pub fn zeros(taxels: usize) -> Forces {
        let zero = || vec![0.0; taxels];
        Forces { fx: zero(), fy: zero(), fz: zero() }
    }

    /// Sum over the taxels in N, [x, y, normal].
    pub fn resultant(&self) -> [f64; 3] {
        [&self.fx, &self.fy, &self.fz].map(|axis| axis.iter().sum())
    }
}

/// A contact as the author of a frame describes it: input of [`crate::data::generator`], passed through by everything else.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Contact {
    /// Name of the shape.
    pub shape: Option<String>,
    /// Centre in mm from the array's centre.
    pub centre_mm: Option<[f64; 2]>,
    /// Sizes in mm; the shape defines their meaning, see [`crate::data::generator`].
    pub size_mm: Vec<f64>,
    /// Normal load in N.
    pub normal_N: Option<f64>,
    /// Tangential load in N.
    pub tangential_N: Option<[f64; 2]>,
    /// Distribution of the shear, see [`crate::data::generator`].
    pub kind_of_slip: Option<String>,
    /// Coefficient of friction, for partial slip.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// Angle of the shape in radians, if it is not part of its sizes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotation_rad: Option<f64>,
}

/// The stress on every taxel at one moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Name in reports.
    pub id: String,
    /// Elastic body for which the stress was computed, if known.
    pub medium: Option<Medium>,
    /// Origin of the stress, if known.
    pub source: Option<String>,
    /// The taxel array that read the stress.
    pub sensor: Sensor,
    /// The contacts, if known.
    pub contacts: Vec<Contact>,
    /// True resultant of all contacts in N, [x, y, normal], if known.
    pub resultant_N: Option<[f64; 3]>,
    /// True force on each cell in N, if known.
    pub cell_forces_N: Option<Forces>,
    /// Normal stress on each taxel in MPa, row-major; compression is positive. 0 on `missing` taxels, after
    /// [`Input::complete`](crate::data::input::Input::complete) what the others predict.
    pub stress_MPa: Vec<f64>,
    /// Taxels without a reading in this frame: row-major indices, ascending.
    pub missing: Vec<usize>,
    /// When the stress was read, in ns since 1970 ([`is_date`](crate::data::text::is_date)) or since a moment that is not stated, if known.
    pub time_ns: Option<i64>,
    /// Remarks of the frame's author.
    pub notes: Option<String>,
}

impl Frame {
    /// The time of a result of these frames in ns, that of the last one, if it is known.
    pub fn time_of_result(frames: &[Frame]) -> Option<i64> {
        frames.last()?.time_ns
    }

    /// A frame of stress alone, e.g. from a running sensor; `stress_MPa` is row-major, NaN where a reading is missing; `id`
    /// is the name in reports and errors.
    ///
    /// ```
    /// use dermis_golden::{data::frame::Frame, estimate::float::Golden, spec::scene::Scene};
    ///
    /// let scene = Scene::builtin("eight-by-eight")?;
    /// let mut stress_MPa = vec![0.0; scene.sensor.taxels()];
    /// stress_MPa[27] = 0.25;
    /// let frame = Frame::from_stress("one taxel", &scene.sensor, stress_MPa.clone())?;
    /// assert_eq!(frame.peak_MPa(), 0.25);
    /// // The largest force is on the taxel with the stress.
    /// let fz = Golden::new(&scene)?.run(&frame)?.forces_N.fz;
    /// assert!(fz.iter().all(|f| *f <= fz[27]));
    /// assert!(Frame::from_stress("too short", &scene.sensor, vec![0.0; 63]).is_err());
    /// stress_MPa[28] = f64::NAN;
    /// assert_eq!(Frame::from_stress("one missing", &scene.sensor, stress_MPa)?.missing, [28]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`FrameError::WrongCount`] or [`FrameError::NotFinite`], with `id` in place of a file name.
    pub fn from_stress(id: &str, sensor: &Sensor, stress_MPa: Vec<f64>) -> Result<Frame, FrameError> {
        let frame = Frame {
            id: id.to_string(),
            medium: None,
            source: None,
            sensor: sensor.clone(),
            contacts: Vec::new(),
            resultant_N: None,
            cell_forces_N: None,
            stress_MPa,
            missing: Vec::new(),
            time_ns: None,
            notes: None,
        };
        frame.with_missing(id)
    }

    /// The frame with its NaN as missing readings; `file` stands in errors.
    fn with_missing(mut self, file: &str) -> Result<Frame, FrameError> {
        self.missing = (0..self.stress_MPa.len()).filter(|&taxel| self.stress_MPa[taxel].is_nan()).collect();
        self.missing.iter().for_each(|&taxel| self.stress_MPa[taxel] = 0.0);
        self.check_values(file)?;
        Ok(self)
    }

    /// Whether the taxel with this row-major index has no reading.
    pub fn lacks(&self, taxel: usize) -> bool {
        self.missing.binary_search(&taxel).is_ok()
    }

    /// The stress of each taxel as it was read, in MPa, row-major; NaN where a reading is missing.
    pub fn readings(&self) -> Vec<f64> {
        let own = |(taxel, b): (usize, &f64)| if self.lacks(taxel) { f64::NAN } else { *b };
        self.stress_MPa.iter().enumerate().map(own).collect()
    }

    /// The stress of the paper's Eq. 2: S(x, y) = 10⁶ (y sin 100x + x cos 100y) N/m², x and y in metres from the first
    /// taxel.
    pub fn eq2(sensor: &Sensor) -> Frame {
        const M_PER_MM: f64 = 1e-3;
        let stress = |index: usize| {
            let x = (index % sensor.cols) as f64 * sensor.pitch_x_mm * M_PER_MM;
            let y = (index / sensor.cols) as f64 * sensor.pitch_y_mm * M_PER_MM;
            // 10⁶ N/m² are 1 MPa.
            y * (100.0 * x).sin() + x * (100.0 * y).cos()
        };
        Frame {
            id: "eq2".to_string(),
            medium: None,
            source: Some("Eq. 2".to_string()),
            sensor: sensor.clone(),
            contacts: Vec::new(),
            resultant_N: None,
            cell_forces_N: None,
            stress_MPa: (0..sensor.taxels()).map(stress).collect(),
            missing: Vec::new(),
            time_ns: None,
            notes: None,
        }
    }

    /// The frame with 0 MPa on the taxels `dead`, [row, col], so that they affect neither the peak nor the condition. Their
    /// readings are not missing.
    pub fn mask_dead(mut self, dead: &[[usize; 2]]) -> Frame {
        let cols = self.sensor.cols;
        for [row, col] in dead {
            // A frame of another sensor may lack the taxel; the frame is checked where it is used.
            self.stress_MPa.get_mut(row * cols + col).into_iter().for_each(|b| *b = 0.0);
        }
        self.missing.retain(|taxel| !dead.contains(&[taxel / cols, taxel % cols]));
        self
    }

    /// Largest |b| in MPa.
    pub fn peak_MPa(&self) -> f64 {
        self.stress_MPa.iter().fold(0.0, |peak, b| b.abs().max(peak))
    }

    /// Checks that the frame's sensor is the scene's, that its values are finite and complete, and that no more readings are
    /// missing than `input.missing_share` allows.
    ///
    /// # Errors
    /// [`FrameError::SensorMismatch`], which prints both sensors; [`FrameError::WrongCount`],
    /// [`FrameError::NotFinite`], [`FrameError::TooManyMissing`].
    pub fn check(&self, scene: &Scene) -> Result<(), FrameError> {
        if self.sensor != scene.sensor {
            return Err(FrameError::SensorMismatch {
                frame: self.id.clone(),
                scene: scene.name.clone(),
                frame_sensor: Box::new(self.sensor.clone()),
                scene_sensor: Box::new(scene.sensor.clone()),
            });
        }
        self.check_values(&self.id)?;
        self.check_missing(&self.id, Some(scene))
    }

    /// Checks the number of missing readings, if the frame is of this scene's sensor; those of dead taxels do not count.
    fn check_missing(&self, file: &str, scene: Option<&Scene>) -> Result<(), FrameError> {
        let Some(scene) = scene.filter(|scene| scene.sensor == self.sensor) else { return Ok(()) };
        let cols = self.sensor.cols;
        let count = self.missing.iter().filter(|taxel| !scene.input.is_dead([*taxel / cols, *taxel % cols])).count();
        let (taxels, most) = (self.sensor.taxels() - scene.input.dead.len(), scene.input.most_missing(&self.sensor));
        if count <= most {
            return Ok(());
        }
        let (file, share) = (file.to_string(), scene.input.missing_share);
        Err(FrameError::TooManyMissing { file, count, taxels, share, most })
    }

    /// Checks counts and values; the fields are public and may have been changed.
    fn check_values(&self, file: &str) -> Result<(), FrameError> {
        let forces = self.cell_forces_N.iter().flat_map(|forces| {
            [("cell_forces_N.fx", &forces.fx), ("cell_forces_N.fy", &forces.fy), ("cell_forces_N.fz", &forces.fz)]
        });
        for (field, values) in forces.chain([("stress_MPa", &self.stress_MPa)]) {
            error::check_count(file, field, values.len(), self.sensor.taxels())?;
            error::check_finite(file, field, values)?;
        }
        error::check_finite(file, "resultant_N", self.resultant_N.as_ref().map_or(&[][..], |r| r))
    }
}
