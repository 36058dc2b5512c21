//! Scenes that lie far from zero are moved there: coordinates of 1e5 have steps of 8 mm in `f32`, and the distance by which rays are kept off
//! the surfaces they leave grows with them.

use crate::scene::bounding_sphere;
use crate::{Instance, LightKind, SceneParts, StoredMesh};
use glam::{DVec3, Vec3, Vec3A};

/// Centres further from zero than this many radii of the scene are moved. Higher values leave more scenes as they are; lower values keep
/// more digits.
const FAR: f64 = 16.0;

/// Moves everything so that the centre of a scene that lies far away becomes zero, and adds where zero was to [`SceneParts::origin_ws`].
pub(crate) fn recentre(parts: &mut SceneParts) {
    let (center, radius) = bounding_sphere(parts);
    if center.as_dvec3().length() <= FAR * f64::from(radius) {
        return;
    }
    let centre = center.as_dvec3();
    // Differences of neighbours are exact in `f32` already; of others, the digits count.
    let moved = |p: Vec3| (p.as_dvec3() - centre).as_vec3();
    // What is still in its file is moved by its placements.
    let mut placed: Vec<bool> = parts.meshes.iter().map(StoredMesh::is_deferred).collect();
    for instance in parts.instances.iter().filter(|instance| !instance.identity) {
        placed[instance.mesh as usize] = true;
    }
    for (mesh, placed) in parts.meshes.iter_mut().zip(&placed) {
        // In world space already, if it is anywhere at all.
        if !placed {
            mesh.positions.iter_mut().for_each(|p| *p = moved(*p));
        }
    }
    for instance in parts.instances.iter_mut().filter(|i| placed[i.mesh as usize]) {
        let mut place = instance.world_from_local;
        place.translation = moved(place.translation.into()).into();
        if let Some(there) = Instance::new(instance.mesh, instance.origin, place) {
            *instance = there;
        }
    }
    for (light, _) in &mut parts.punctual {
        if light.kind != LightKind::Directional {
            light.position_ws = moved(light.position_ws);
        }
    }
    for camera in &mut parts.cameras {
        let eye = moved(camera.world_from_camera.translation.into());
        camera.world_from_camera.translation = Vec3A::from(eye);
    }
    parts.origin_ws += centre;
}

impl SceneParts {
    /// A position of the scene as its file has it: [`SceneParts::origin_ws`] is added.
    pub fn in_file(&self, position_ws: Vec3) -> DVec3 {
        position_ws.as_dvec3() + self.origin_ws
    }
}

#[cfg(test)]
mod tests {
    use crate::assemble::{Builder, point};
    use crate::{Camera, Instance, Material, Scene, SceneParts};
    use glam::{Affine3A, DVec3, Vec3};

    /// A triangle, the same again as an instance, a light and a camera, around `at`.
    fn parts(at: Vec3) -> SceneParts {
        let mut builder = Builder::default();
        let grey = builder.material(Material::lambert("grey", Vec3::ONE));
        builder.triangle([at, at + Vec3::X, at + Vec3::Z], grey);
        builder.light(point(at + Vec3::Y, Vec3::ONE));
        let mut parts = builder.parts();
        let mut local = parts.meshes[0].clone();
        local.positions.iter_mut().for_each(|p| *p -= at);
        parts.meshes.push(local);
        let place = Affine3A::from_translation(at + Vec3::Y * 2.0);
        parts.instances.push(Instance::new(1, 0, place).expect("a translation"));
        parts.cameras = vec![Camera::look_at("eye", at + Vec3::ONE, at, Vec3::Y, 1.0)];
        parts
    }

    #[test]
    fn what_lies_far_away_is_moved_as_a_whole() {
        let far = Vec3::new(1e5, -2e5, 65_536.0);
        let scene = Scene::new(parts(far)).expect("valid");
        let parts = &scene.parts;
        assert!(scene.center_ws.length() < 1e-2 && scene.radius < 3.0);
        let back = |p: Vec3| (parts.in_file(p) - far.as_dvec3()).as_vec3();
        assert_eq!(back(parts.meshes[0].positions[1]), Vec3::X);
        assert_eq!(
            back(parts.instances[1].world_from_local.translation.into()),
            Vec3::Y * 2.0
        );
        assert_eq!(back(scene.lights[0].position_ws), Vec3::Y);
        assert_eq!(back(parts.cameras[0].world_from_camera.translation.into()), Vec3::ONE);
        let inverse = parts.instances[1].local_from_world * parts.instances[1].world_from_local;
        assert!(inverse.abs_diff_eq(Affine3A::IDENTITY, 1e-6));
    }

    #[test]
    fn what_lies_near_stays() {
        let scene = Scene::new(parts(Vec3::new(10.0, 5.0, 3.0))).expect("valid");
        assert_eq!(scene.parts.origin_ws, DVec3::ZERO);
        assert_eq!(scene.parts.meshes[0].positions[0], Vec3::new(10.0, 5.0, 3.0));
    }
}
