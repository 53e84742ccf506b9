//! Frame: one picture of stress, with what is known about the contact behind it.
//!
//! Three sources: JSON files with truth, CSV files of rows × cols stresses, and the paper's Eq. 2.
//!
//! | field | shape | unit | range |
//! |---|---|---|---|
//! | stress | taxels, row-major | MPa | finite, compression positive |
//! | cell forces | 3 × taxels | N | finite, on the body |
//! | resultant | 3 | N | finite, [x, y, normal] of the whole contact |
//!
//! A loaded frame is finite and has as many stresses as its sensor has taxels; whether its sensor is the scene's is
//! asked by [`Frame::check`].

mod csv;
mod error;
mod json;
mod load;
mod shipped;
#[cfg(test)]
mod tests;

pub use error::FrameError;

use crate::scene::{Medium, Scene};
use crate::sensor::Sensor;
use serde::{Deserialize, Serialize};

/// One force vector per taxel, row-major, in N.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Forces {
    /// Along x, on the body.
    pub fx: Vec<f64>,
    /// Along y, on the body.
    pub fy: Vec<f64>,
    /// Normal, positive pressing in.
    pub fz: Vec<f64>,
}

impl Forces {
    /// No force on any of `taxels` taxels.
    pub fn zeros(taxels: usize) -> Forces {
        let zero = || vec![0.0; taxels];
        Forces { fx: zero(), fy: zero(), fz: zero() }
    }

    /// Sum over the taxels, [x, y, normal].
    pub fn resultant(&self) -> [f64; 3] {
        [&self.fx, &self.fy, &self.fz].map(|axis| axis.iter().sum())
    }
}

/// A contact as the frame's author describes it: input of [`crate::generator`], carried along everywhere else.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Contact {
    /// Name of the shape.
    pub shape: Option<String>,
    /// Centre in mm from the array's centre.
    pub centre_mm: Option<[f64; 2]>,
    /// Sizes in mm, meaning by shape.
    pub size_mm: Vec<f64>,
    /// Normal load in N.
    pub normal_N: Option<f64>,
    /// Tangential load in N.
    pub tangential_N: Option<[f64; 2]>,
    /// How the shear is distributed.
    pub kind_of_slip: Option<String>,
    /// Coefficient of friction, where the slip is partial.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// Angle of the shape in radians, where it is not part of its sizes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotation_rad: Option<f64>,
}

/// Stress on every taxel at one moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Name in reports.
    pub id: String,
    /// Body the stress was computed for, where it is known.
    pub medium: Option<Medium>,
    /// How the stress was obtained.
    pub source: Option<String>,
    /// The array it was read with.
    pub sensor: Sensor,
    /// The contacts, where they are known.
    pub contacts: Vec<Contact>,
    /// True force of the whole contact in N.
    pub resultant_N: Option<[f64; 3]>,
    /// True force on each cell in N.
    pub cell_forces_N: Option<Forces>,
    /// Compression under each taxel in MPa, row-major.
    pub stress_MPa: Vec<f64>,
    /// Remarks of the author.
    pub notes: Option<String>,
}

impl Frame {
    /// A frame that is nothing but stress, e.g. from a running sensor.
    ///
    /// # Errors
    /// A wrong count or a value that is not finite; `id` stands for the file.
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
            notes: None,
        };
        frame.check_values(id)?;
        Ok(frame)
    }

    /// The paper's Eq. 2: S(x, y) = 10⁶ (y sin 100x + x cos 100y) N/m², x and y in metres from the first taxel.
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
            notes: None,
        }
    }

    /// Largest |b| in MPa.
    pub fn peak_MPa(&self) -> f64 {
        self.stress_MPa.iter().fold(0.0, |peak, b| b.abs().max(peak))
    }

    /// Checks that the frame was read with the scene's sensor.
    ///
    /// # Errors
    /// [`FrameError::SensorMismatch`], which prints both.
    pub fn check(&self, scene: &Scene) -> Result<(), FrameError> {
        if self.sensor != scene.sensor {
            return Err(FrameError::SensorMismatch {
                frame: self.id.clone(),
                scene: scene.name.clone(),
                frame_sensor: Box::new(self.sensor.clone()),
                scene_sensor: Box::new(scene.sensor.clone()),
            });
        }
        self.check_values(&self.id)
    }

    /// Checks counts and values, which the fields being public cannot promise.
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
