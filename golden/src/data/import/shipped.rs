//! The recordings that are embedded in the crate, from `data/recordings`.

use super::{import, Crop, ImportError, Imported, Settings};

/// Stress of the largest count of the finger's recording in MPa: its file states none, so its forces are nominal.
const NOMINAL_MPA: f64 = 1.0;

impl Imported {
    /// The excerpts of real recordings: a finger on a Tekscan pad, whose counts are given a nominal full scale of 1 MPa,
    /// a foot in a Tekscan insole, a foot on a novel platform; the first two around their contacts. Nothing presses beside
    /// the insole: its missing sensels read 0.
    ///
    /// ```
    /// use dermis_golden::data::import::Imported;
    ///
    /// let names: Vec<String> = Imported::shipped()?.into_iter().map(|imported| imported.summary.name).collect();
    /// assert_eq!(names, ["iscan-finger", "fscan-walk", "emed-step"]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// None: the files are part of the crate.
    pub fn shipped() -> Result<Vec<Imported>, ImportError> {
        let around = Settings { crop: Crop::Contact, ..Settings::default() };
        let insole = Settings { missing_as_zero: true, ..around.clone() };
        let files: [(&str, &[u8], Settings); 3] = [
            (
                "iscan-finger.csv",
                include_bytes!("../../../data/recordings/iscan-finger.csv"),
                Settings { full_scale_MPa: Some(NOMINAL_MPA), ..around },
            ),
            ("fscan-walk.asf", include_bytes!("../../../data/recordings/fscan-walk.asf"), insole),
            ("emed-step.lst", include_bytes!("../../../data/recordings/emed-step.lst"), Settings::default()),
        ];
        files.iter().map(|(file, bytes, settings)| import(file, bytes, settings)).collect()
    }
}
