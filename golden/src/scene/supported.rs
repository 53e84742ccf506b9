//! What of the schema this version builds.

use super::{Medium, ObjectiveKind, Scene, SceneError};
use crate::partition::Case;

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
        if self.partition.case != Case::WHOLE {
            return missing("partition.case", self.partition.case.to_string(), "0");
        }
        if self.search.objective != ObjectiveKind::Sparse {
            let name = self.search.objective.name().to_string();
            return missing("search.objective", name, "sparse");
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
        }
        if self.search.objective != ObjectiveKind::Sparse {
            let name = self.search.objective.name().to_string();
            return missing("search.objective", name, "sparse");
        }
        Ok(())
    }
}
