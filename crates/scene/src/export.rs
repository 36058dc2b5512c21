//! [`SceneParts`] out to a binary glTF file.

use crate::{SceneError, SceneParts};
use std::path::Path;

/// Writes `parts` as one `.glb` (beside the target first, then renamed).
///
/// # Errors
/// [`SceneError::Write`].
pub fn write_glb(parts: &SceneParts, path: &Path) -> Result<(), SceneError> {
    let _ = (parts, path);
    unimplemented!("owner: generate")
}
