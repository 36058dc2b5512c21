//! Scenes that stress renderers, and transformations of any scene.

use anyhow::Result;
use glam::{Affine3A, DVec3, Vec3};
use light_cache::SamplerKind;
use render::Method;
use scene::assemble::{Builder, directional, point, spot};
use scene::{Camera, LightKind, Material, Scene, SceneParts};

/// The samplers that guarantee every light a probability, so that even a light that nothing points to is drawn in time.
pub(super) const WITH_FLOOR: [SamplerKind; 5] = [
    SamplerKind::Uniform,
    SamplerKind::Power,
    SamplerKind::TreeVisible,
    SamplerKind::Table,
    SamplerKind::Adaptive,
];

/// All methods by name.
pub(super) fn methods() -> Vec<(&'static str, Method)> {
    Method::all().map(|method| (method.name(), method)).collect()
}

/// Methods by kind of sampler, and `exact`.
pub(super) fn exact_and(kinds: &[SamplerKind]) -> Vec<(&'static str, Method)> {
    let sampled = kinds.iter().map(|&kind| Method::Sampled(kind));
    let all = sampled.chain([Method::Exact]);
    all.map(|method| (method.name(), method)).collect()
}

/// A camera that looks about inside a box from `low` to `high`.
pub(super) fn inside(low: Vec3, high: Vec3) -> Camera {
    let at = |share: Vec3| low + (high - low) * share;
    Camera::look_at(
        "inside",
        at(Vec3::new(0.4, 0.6, 0.7)),
        at(Vec3::new(0.8, 0.3, 0.1)),
        Vec3::Y,
        1.5,
    )
}

/// Closed boxes in a row, one per radiance: everything inside box `i` emits `radiances[i]` and reflects half of what arrives. Direct
/// light makes every point show 1.5 times the radiance.
pub(super) fn furnaces(radiances: &[Vec3]) -> Result<(Scene, Vec<Camera>)> {
    let mut builder = Builder::default();
    let mut cameras = Vec::new();
    for (index, &radiance) in radiances.iter().enumerate() {
        let wall = builder.material(Material {
            emission: radiance,
            double_sided: false,
            ..Material::lambert("wall", Vec3::splat(0.5))
        });
        let low = Vec3::X * 4.0 * index as f32;
        let high = low + Vec3::new(3.0, 2.0, 2.5);
        builder.room(low, high, wall);
        cameras.push(inside(low, high));
    }
    Ok((builder.build()?, cameras))
}

/// A table with things on it under lamps of all kinds; `lamp` makes a square one facing down, a metre wide at 3 m, from its material.
pub(super) fn still_life(lamp: impl FnOnce(&mut Builder, u32)) -> (SceneParts, Camera) {
    let mut builder = Builder::default();
    let grey = builder.material(Material::lambert("grey", Vec3::splat(0.6)));
    let red = builder.material(Material::lambert("red", Vec3::new(0.7, 0.2, 0.1)));
    let glossy = builder.material(Material {
        roughness: 0.4,
        dielectric_f0: Vec3::splat(0.04),
        dielectric_f90: 1.0,
        ..Material::lambert("glossy", Vec3::new(0.2, 0.3, 0.6))
    });
    let warm = builder.material(Material::emitter("warm", Vec3::new(5.0, 4.0, 3.0)));
    let strip = builder.material(Material::emitter("strip", Vec3::new(0.5, 1.0, 2.0)));
    builder.quad(Vec3::new(-4.0, 0.0, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0, grey);
    builder.quad(Vec3::new(-4.0, 0.0, -2.0), Vec3::X * 8.0, Vec3::Y * 4.0, glossy);
    builder.quad(Vec3::Y, Vec3::Z, Vec3::X, red);
    builder.quad(Vec3::Z, Vec3::X, Vec3::Y, red);
    builder.quad(Vec3::ZERO, Vec3::Z, Vec3::Y, red);
    builder.quad(Vec3::new(2.0, 0.25, -1.75), Vec3::X * 1.5, Vec3::Y * 0.25, strip);
    lamp(&mut builder, warm);
    builder.light(point(Vec3::new(2.0, 1.5, 1.0), Vec3::new(1.0, 0.8, 0.6)));
    builder.light(point(Vec3::new(-2.5, 0.75, 0.5), Vec3::new(0.2, 0.3, 0.2)));
    let downwards = Vec3::new(0.0, -0.8, -0.6);
    builder.light(spot(Vec3::new(0.5, 3.5, 2.0), downwards, Vec3::splat(6.0), 0.2, 0.5));
    builder.light(directional(Vec3::new(0.6, -0.64, -0.48), Vec3::new(0.1, 0.1, 0.2)));
    let camera = Camera::look_at(
        "still life",
        Vec3::new(1.0, 2.5, 6.0),
        Vec3::new(0.25, 0.75, 0.0),
        Vec3::Y,
        0.8,
    );
    (builder.parts(), camera)
}

/// [`still_life`]'s lamp in one piece.
pub(super) fn square_lamp(builder: &mut Builder, material: u32) {
    builder.quad(Vec3::new(-1.0, 3.0, -1.0), Vec3::X, Vec3::Z, material);
}

/// The same scene with all lengths times `scale` and then moved by `offset`, as nodes of files move meshes; radiance kept: a picture of it is the same.
pub(super) fn transformed(mut parts: SceneParts, scale: f64, offset: DVec3) -> SceneParts {
    let place = |p: Vec3| (p.as_dvec3() * scale + offset).as_vec3();
    for (index, mesh) in parts.meshes.iter_mut().enumerate() {
        // A mesh is either in world space or placed by its instances.
        if parts.instances.iter().any(|i| i.mesh as usize == index && i.identity) {
            mesh.positions.iter_mut().for_each(|p| *p *= scale as f32);
        }
    }
    for instance in &mut parts.instances {
        let matrix = instance.world_from_local;
        let scale = if instance.identity { 1.0 } else { scale as f32 };
        instance.world_from_local = Affine3A {
            matrix3: matrix.matrix3 * scale,
            translation: place(matrix.translation.into()).into(),
        };
    }
    for (light, _) in &mut parts.punctual {
        if light.kind != LightKind::Directional {
            light.position_ws = place(light.position_ws);
            light.intensity *= (scale * scale) as f32;
            light.range *= scale as f32;
        }
    }
    for camera in &mut parts.cameras {
        *camera = transformed_camera(camera, scale, offset);
    }
    parts
}

/// The camera that sees a [`transformed`] scene as `camera` saw it before.
pub(super) fn transformed_camera(camera: &Camera, scale: f64, offset: DVec3) -> Camera {
    let mut new = camera.clone();
    let eye = Vec3::from(camera.world_from_camera.translation).as_dvec3() * scale + offset;
    new.world_from_camera.translation = eye.as_vec3().into();
    new
}
