use super::*;
use crate::{Camera, Instance, Mesh, Scene, gltf};
use glam::{Affine3A, Vec3};

/// Writes and reads `parts` again.
fn round_trip(parts: &SceneParts) -> SceneParts {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.glb");
    write_glb(parts, &path).unwrap();
    let files: Vec<_> = std::fs::read_dir(folder.path()).unwrap().collect();
    assert_eq!(files.len(), 1, "nothing is left beside the file");
    gltf::read(&path).unwrap()
}

/// Corners as bits, looks, (node, mesh).
type Triangle = ([[u32; 3]; 3], String, (String, String));

/// Every triangle in world space with its material's name, colour and origin, in an order that does not depend on the file's.
fn triangles(parts: &SceneParts) -> Vec<Triangle> {
    let mut out = Vec::new();
    for instance in &parts.instances {
        let mesh = &parts.meshes[instance.mesh as usize];
        for i in 0..mesh.len() {
            let corners = mesh.corners(i).map(|p| {
                instance
                    .world_from_local
                    .transform_point3(p)
                    .to_array()
                    .map(f32::to_bits)
            });
            let m = &parts.materials[mesh.materials[i] as usize];
            let look = format!(
                "{} {:?} {:.4?} {} {}",
                m.name, m.base_color, m.emission, m.roughness, m.double_sided
            );
            let origin = if mesh.origins.is_empty() {
                instance.origin
            } else {
                mesh.origins[i]
            };
            out.push((corners, look, parts.origins[origin as usize].clone()));
        }
    }
    out.sort();
    out
}

#[test]
fn generated_scenes_survive_the_round_trip() {
    for what in ["rooms:100", "spheres:50", "one-light"] {
        let parts = crate::generate::demo(what).unwrap();
        let back = round_trip(&parts);
        let (a, b) = (triangles(&parts), triangles(&back));
        assert_eq!(a.len(), b.len(), "{what}");
        assert!(
            a == b,
            "{what}: {:?} is not {:?}",
            a.iter().find(|t| !b.contains(t)),
            b.first()
        );
        assert_eq!(parts.cameras.len(), back.cameras.len());
        for (a, b) in parts.cameras.iter().zip(&back.cameras) {
            assert!(
                a.world_from_camera.abs_diff_eq(b.world_from_camera, 1e-5),
                "{what}: {}",
                a.name
            );
            assert_eq!((&a.name, a.fov_y), (&b.name, b.fov_y));
        }
        let (a, b) = (Scene::new(parts).unwrap(), Scene::new(back).unwrap());
        assert_eq!(a.lights.len(), b.lights.len());
        let power = |scene: &Scene| scene.lights.iter().map(|light| f64::from(light.power)).sum::<f64>();
        assert!((power(&a) / power(&b) - 1.0).abs() < 1e-5);
    }
}

#[test]
fn point_lights_survive_the_round_trip() {
    let parts = crate::generate::demo("points:77").unwrap();
    let back = round_trip(&parts);
    assert_eq!(parts.punctual.len(), back.punctual.len());
    for ((a, from), (b, to)) in parts.punctual.iter().zip(&back.punctual) {
        assert_eq!(a.position_ws, b.position_ws);
        assert!(a.intensity.abs_diff_eq(b.intensity, 1e-5 * a.intensity.max_element()));
        assert_eq!((&from.node, &from.mesh), (&to.node, &to.mesh));
    }
}

#[test]
fn glossy_materials_survive_the_round_trip() {
    let parts = crate::generate::demo("spheres:16").unwrap();
    let back = round_trip(&parts);
    for a in &parts.materials {
        let b = back.materials.iter().find(|b| b.name == a.name).unwrap();
        assert_eq!(
            (a.metallic, a.roughness, a.dielectric_f90),
            (b.metallic, b.roughness, b.dielectric_f90),
            "{}",
            a.name
        );
        assert!(a.dielectric_f0.abs_diff_eq(b.dielectric_f0, 1e-6), "{}", a.name);
    }
}

#[test]
fn a_shared_mesh_is_stored_once() {
    let mut parts = crate::generate::demo("one-light").unwrap();
    let mesh = Mesh {
        name: "leaflet".into(),
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        indices: vec![[0, 1, 2]],
        materials: vec![0],
        ..Mesh::default()
    };
    parts.meshes.push(mesh.into());
    for i in 0..3 {
        parts.origins.push((format!("copy {i}"), "leaflet".into()));
        let place = Affine3A::from_translation(Vec3::new(i as f32, 0.0, 0.5));
        parts
            .instances
            .push(Instance::new(1, parts.origins.len() as u32 - 1, place).unwrap());
    }
    let before = triangles(&parts);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shared.glb");
    write_glb(&parts, &path).unwrap();
    let text = std::fs::read(&path).unwrap();
    let named = text.windows(16).filter(|w| *w == b"\"name\":\"leaflet\"").count();
    assert_eq!(named, 1);
    assert_eq!(triangles(&gltf::read(&path).unwrap()), before);
}

#[test]
fn an_unwritable_place_is_an_error_and_leaves_nothing() {
    let parts = crate::generate::demo("one-light").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("missing").join("scene.glb");
    let message = write_glb(&parts, &path).unwrap_err().to_string();
    assert!(
        message.contains("missing") && message.contains("cannot write"),
        "{message}"
    );
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_scene_of_nothing_but_a_camera_is_written() {
    let parts = SceneParts {
        cameras: vec![Camera::look_at("only", Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0)],
        ..SceneParts::default()
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("camera.glb");
    write_glb(&parts, &path).unwrap();
    assert!(std::fs::read(&path).unwrap().starts_with(b"glTF"));
}
