//! Trial: a scene with a network of a few steps in a temporary file. Its μ are poor, its words and shapes as any network's;
//! tests of this and the other crates compare models and hardware with it.

use super::{Learned, LearnedError, Training};
use crate::spec::scene::Scene;
use crate::write::FileError;
use std::ops::ControlFlow::Continue;
use tempfile::NamedTempFile;

impl Training {
    /// A few steps, for hidden layers of these widths.
    pub fn trial(hidden: &[usize]) -> Training {
        Training { steps: 20, batch: 16, contacts: 40, hidden: hidden.to_vec(), ..Training::default() }
    }
}

/// `scene`, whose estimator takes a network, with one trained for it; its file lives as long as the handle.
///
/// # Errors
/// As [`Learned::train`], or the file cannot be written.
pub fn with_network(mut scene: Scene, training: &Training) -> Result<(Scene, NamedTempFile), LearnedError> {
    let trained = Learned::train(&scene, training, &mut |_| Continue(()))?;
    let file = NamedTempFile::new().map_err(FileError::at(&std::env::temp_dir()))?;
    std::fs::write(file.path(), trained.bytes).map_err(FileError::at(file.path()))?;
    scene.search.network = Some(file.path().to_owned());
    Ok((scene, file))
}
