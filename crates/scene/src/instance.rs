//! A mesh placed in the world.

use glam::{Affine3A, Mat3A};

/// One placement of a mesh.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Index into [`crate::SceneParts::meshes`].
    pub mesh: u32,
    /// Index into [`crate::SceneParts::origins`]; used where the mesh has no origins of its own.
    pub origin: u32,
    /// Local to world. The fields below follow from it; [`crate::Scene::new`] computes them anew.
    pub world_from_local: Affine3A,
    /// World to local.
    pub local_from_world: Affine3A,
    /// Takes a local normal to an unnormalised world normal on the same side of the surface: the inverse transpose. It
    /// keeps the front of a mirrored mesh where glTF 2.0 section 3.7.4 wants it (a negative determinant makes the
    /// clockwise side the front), so the cross product of transformed edges points the other way there.
    pub world_normal_from_local: Mat3A,
    /// Whether this is the identity, so that rays need no transform.
    pub identity: bool,
}

impl Instance {
    /// Places `mesh` by `world_from_local`; `None` if the transform is singular or not finite.
    pub fn new(mesh: u32, origin: u32, world_from_local: Affine3A) -> Option<Self> {
        let identity = world_from_local == Affine3A::IDENTITY;
        let local_from_world = world_from_local.inverse();
        let world_normal_from_local = local_from_world.matrix3.transpose();
        let usable = world_from_local.is_finite()
            && local_from_world.is_finite()
            && local_from_world.matrix3.determinant() != 0.0;
        usable.then_some(Self {
            mesh,
            origin,
            world_from_local,
            local_from_world,
            world_normal_from_local,
            identity,
        })
    }

    /// Places `mesh` where it is.
    pub fn identity(mesh: u32, origin: u32) -> Self {
        Self {
            mesh,
            origin,
            world_from_local: Affine3A::IDENTITY,
            local_from_world: Affine3A::IDENTITY,
            world_normal_from_local: Mat3A::IDENTITY,
            identity: true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, Vec3, Vec3A};

    #[test]
    fn normals_stay_perpendicular_and_in_front_also_when_mirrored() {
        let rotation = Quat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.4);
        for scale in [
            Vec3::new(1.0, 2.0, 0.5),
            Vec3::new(-1.0, 2.0, 0.5),
            Vec3::new(-3.0, -1.0, -2.0),
        ] {
            let place = Affine3A::from_scale_rotation_translation(scale, rotation, Vec3::new(5.0, -2.0, 1.0));
            let instance = Instance::new(0, 0, place).unwrap();
            let (edge1, edge2) = (Vec3A::new(1.0, 0.2, 0.1), Vec3A::new(-0.3, 1.0, 0.4));
            let front = edge1.cross(edge2);
            let normal = (instance.world_normal_from_local * front).normalize();
            for edge in [edge1, edge2] {
                assert!(normal.dot((place.matrix3 * edge).normalize()).abs() < 1e-6);
            }
            assert!(
                normal.dot(place.matrix3 * front) > 0.0,
                "what was in front has gone behind"
            );
        }
    }

    #[test]
    fn a_singular_transform_is_refused() {
        assert!(Instance::new(0, 0, Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0))).is_none());
        assert!(Instance::new(0, 0, Affine3A::from_scale(Vec3::splat(f32::NAN))).is_none());
        assert!(Instance::new(0, 0, Affine3A::IDENTITY).is_some_and(|i| i.identity));
    }
}
