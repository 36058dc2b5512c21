//! Scenes that stress renderers, and transformations of any scene.

use anyhow::Result;
use glam::{Affine3A, DVec3, Vec3};
use light_cache::SamplerKind;
use render::Method;
use scene::assemble::{self, Builder};
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

/// [`assemble::still_life`] and its camera.
pub(super) fn still_life(lamp: impl FnOnce(&mut Builder, u32)) -> (SceneParts, Camera) {
    (
        assemble::still_life(1.0, lamp).parts(),
        assemble::still_life_camera(1.0),
    )
}

/// Its lamp in one piece.
pub(super) fn square_lamp(builder: &mut Builder, material: u32) {
    assemble::square_lamp(1.0)(builder, material);
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
