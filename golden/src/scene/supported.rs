//! What of the schema this version builds.

use super::{Form, Medium, ObjectiveKind, Scene, SceneError};

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
        if self.medium != Medium::HalfSpace {
            return missing("medium.kind", self.medium.to_string(), "half-space");
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
