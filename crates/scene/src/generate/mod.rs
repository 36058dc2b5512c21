//! Scenes with many lights, made from (name, number of lights, seed).

use crate::{SceneError, SceneParts};

/// Makes the scene named by `what` = `NAME[:LIGHTS[:SEED]]`.
///
/// # Errors
/// [`SceneError::Demo`] for an unknown name or a number of lights outside 16..=1,000,000 (1 for `one-light`).
pub fn demo(what: &str) -> Result<SceneParts, SceneError> {
    let _ = what;
    unimplemented!("owner: generate")
}
