//! What of the schema this version builds.

use super::{ForceOutput, Form, Medium, ObjectiveKind, Scene, SceneError};

impl Scene {
    /// Checks that this version has what the scene asks for.
    ///
    /// # Errors
    /// [`SceneError::NotAvailable`] naming the first choice that is valid but not built yet.
    pub fn require_supported(&self) -> Result<(), SceneError> {
        let missing = |field: &'static str, value: String, available: &'static str| {
            let scene = self.name.clone();
            Err(SceneError::NotAvailable { scene, field, value, available })
        };
        if self.medium != Medium::HalfSpace {
            return missing("medium.kind", self.medium.to_string(), "half-space");
        }
        if self.partition.case.grid().is_none() {
            return missing("partition.case", self.partition.case.to_string(), "0, 1, 2, 3, rows and cols");
        }
        if self.search.objective != ObjectiveKind::Sparse {
            let name = self.search.objective.name().to_string();
            return missing("search.objective", name, "sparse");
        }
        if self.search.form != Form::Oblique {
            return missing("search.form", "orthogonal".to_string(), "oblique");
        }
        let input = &self.input;
        if input.average > 0 {
            return missing("input.average", input.average.to_string(), "0");
        }
        for (field, file) in [("input.calibration", &input.calibration), ("input.tare", &input.tare)] {
            if let Some(path) = file {
                return missing(field, format!("{path:?}"), "none");
            }
        }
        if let Some(taxel) = input.dead.first() {
            return missing("input.dead", format!("[{taxel:?}, …]"), "none");
        }
        if input.unipolar {
            return missing("input.unipolar", "true".to_string(), "false");
        }
        if self.output.forces != ForceOutput::Taxels {
            return missing("output.forces", "resultants".to_string(), "taxels");
        }
        Ok(())
    }

    /// Checks that the golden model has what the scene asks for: more than the hardware.
    ///
    /// # Errors
    /// [`SceneError::NotAvailable`] naming the first choice that is valid but not built yet.
    pub fn require_golden(&self) -> Result<(), SceneError> {
        let missing = |field: &'static str, value: String, available: &'static str| {
            let scene = self.name.clone();
            Err(SceneError::NotAvailable { scene, field, value, available })
        };
        let orthogonal = self.search.form == Form::Orthogonal;
        if orthogonal && !self.input.dead.is_empty() {
            return missing("input.dead", format!("{:?}", self.input.dead), "none, with search.form = orthogonal");
        }
        if orthogonal && self.input.unipolar {
            return missing("input.unipolar", "true".to_string(), "false, with search.form = orthogonal");
        }
        // Patch, symmetric and the choice between them know the half-space's kernel.
        let by_score = matches!(self.search.objective, ObjectiveKind::Sparse | ObjectiveKind::Compressive);
        if self.medium != Medium::HalfSpace && !by_score {
            let name = self.search.objective.name().to_string();
            return missing("search.objective", name, "sparse and compressive, on a bonded layer");
        }
        // Regions and the choice of a case are judged by the sparse objective.
        let by_contact = self.partition.case.grid().is_none();
        if by_contact && self.search.objective != ObjectiveKind::Sparse {
            let name = self.search.objective.name().to_string();
            return missing("search.objective", name, "sparse, with partition.case = adaptive or contacts");
        }
        Ok(())
    }
}
