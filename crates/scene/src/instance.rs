//! A mesh placed in the world.

use glam::{Affine3A, Mat3A};

/// One placement of a mesh.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Index into [`crate::SceneParts::meshes`].
    pub mesh: u32,
    /// Index into [`crate::SceneParts::origins`]; used where the mesh has no origins of its own.
    pub origin: u32,
    /// Local to world.
    pub world_from_local: Affine3A,
    /// World to local.
    pub local_from_world: Affine3A,
    /// Takes a local normal to an unnormalised world normal on the same side of the surface (inverse transpose times
    /// the sign of the determinant, so that the front of a mirrored mesh stays where the file's winding, flipped as
    /// glTF 2.0 section 3.7.4 asks, puts it).
    pub world_normal_from_local: Mat3A,
    /// Whether this is the identity, so that rays need no transform.
    pub identity: bool,
}
