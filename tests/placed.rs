//! The GPU back end on meshes that are placed several times, and on holes in them, against the CPU.

use crate::gpu::{assert_images_agree, gpu, rendered};
use glam::{Affine3A, Mat2, Quat, Vec2, Vec3};
use light_cache::SamplerKind;
use render::{Method, Settings};
use scene::assemble::Builder;
use scene::texture::TextureRef;
use scene::{Camera, Instance, Material, Mesh, Scene, SceneParts, Texture};

/// A room with a mesh full of holes, placed four times: turned, scaled unevenly and mirrored; a lamp is one of several placed meshes too.
fn placed_and_masked() -> Scene {
    let mut builder = Builder::default();
    let wall = builder.material(Material::lambert("wall", Vec3::new(0.7, 0.6, 0.5)));
    let lamp = builder.material(Material::emitter("lamp", Vec3::splat(8.0)));
    let leaf = builder.material(Material {
        alpha_cutoff: Some(0.5),
        base_color_texture: Some(TextureRef {
            texture: 0,
            uv_set: 0,
            columns: Mat2::IDENTITY,
            offset: Vec2::ZERO,
        }),
        ..Material::lambert("leaf", Vec3::new(0.3, 0.8, 0.3))
    });
    builder.room(Vec3::splat(-2.0), Vec3::splat(2.0), wall);
    builder.quad(Vec3::new(-0.5, 1.9, -0.5), Vec3::X, Vec3::Z, lamp);
    let mut parts = builder.parts();
    let square = |material| Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y],
        indices: vec![[0, 1, 2], [0, 2, 3]],
        uvs: vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
        materials: vec![material; 2],
        ..Mesh::default()
    };
    parts.meshes.extend([square(leaf), square(lamp)].map(Into::into));
    let texel = |i: u32| {
        [
            200,
            90 + 20 * (i % 8) as u8,
            100,
            if (i / 8 + i).is_multiple_of(3) { 0 } else { 255 },
        ]
    };
    parts.textures.push(Texture {
        name: "leaf".into(),
        width: 8,
        height: 8,
        texels: (0..64).map(texel).collect::<Vec<_>>().into(),
        srgb: true,
        wrap: Default::default(),
        nearest: false,
    });
    for (mesh, scale, angle, position) in [
        (1, Vec3::new(1.0, 1.5, 1.0), 0.4, Vec3::new(-1.2, -0.6, 0.0)),
        (1, Vec3::new(-1.2, 0.9, 2.0), 2.0, Vec3::new(0.6, 0.3, 0.4)),
        (1, Vec3::splat(0.8), -1.1, Vec3::new(0.2, -1.4, 0.6)),
        (2, Vec3::splat(0.4), 3.3, Vec3::new(0.9, -0.8, -0.3)),
        (2, Vec3::new(0.3, 0.2, 1.0), 0.2, Vec3::new(-1.5, 0.9, -1.0)),
    ] {
        let placed = Affine3A::from_scale_rotation_translation(scale, Quat::from_rotation_y(angle), position);
        parts
            .instances
            .push(Instance::new(mesh, 0, placed).expect("it is regular"));
    }
    let eye = Vec3::new(0.3, 0.2, 1.9);
    parts
        .cameras
        .push(Camera::look_at("eye", eye, Vec3::ZERO, Vec3::Y, 1.2));
    Scene::new(parts).expect("it is valid")
}

#[test]
fn placed_meshes_and_holes_agree() {
    let Some(gpu) = gpu() else { return };
    let scene = placed_and_masked();
    let settings = Settings {
        width: 64,
        height: 64,
        method: Method::Sampled(SamplerKind::Uniform),
        max_bounces: 2,
        ..Settings::default()
    };
    assert_images_agree(gpu, &scene, &settings, 4);
    // Holes and placements matter.
    let image = rendered(&scene, &settings, 4, None);
    let without = |change: fn(&mut SceneParts)| {
        let mut parts = scene.parts.clone();
        change(&mut parts);
        rendered(&Scene::new(parts).expect("it is valid"), &settings, 4, None)
    };
    let differ = |other: &[[f32; 3]]| image.iter().zip(other).filter(|(a, b)| a != b).count();
    assert!(differ(&without(|parts| parts.materials[2].alpha_cutoff = None)) > 400);
    assert!(differ(&without(|parts| parts.instances.truncate(3))) > 400);
}
