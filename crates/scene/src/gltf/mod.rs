//! glTF 2.0 in, [`SceneParts`] out.

use crate::{SceneError, SceneParts};
use std::path::Path;

/// Reads a `.gltf` or `.glb` file.
///
/// # Errors
/// [`SceneError`], naming file, place and remedy.
pub fn read(path: &Path) -> Result<SceneParts, SceneError> {
    let _ = path;
    unimplemented!("owner: scene loader")
}
