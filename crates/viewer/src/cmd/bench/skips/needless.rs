//! What the renderer leaves out where a scene does not need it, and scenes that ask for it all the same.
//!
//! Nearly all of it is forced by the scene itself: a mask that cuts nothing out, a texture of one white texel, a placement by a shift that rounding
//! swallows. The code that then runs is that of scenes which do need it, and the image stays what it was.

use glam::{Affine3A, Mat2, Vec2, Vec3, Vec4};
use light_cache::SamplerKind;
use render::{Method, Settings};
use scene::{Instance, LightKind, Material, Mesh, Scene, SceneParts, Texture, texture::TextureRef};

/// Radiance that shows in no image.
const UNSEEN: f32 = 1e-30;

/// Something that is left out where it is not needed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Skip {
    /// What is left out, as `info` and `--stats` say it.
    pub(super) name: &'static str,
    /// What is done all the same, to find out what that would cost.
    pub(super) forced_by: &'static str,
    /// Whether there is anything to compare in this scene.
    pub(super) applies: fn(&Scene) -> bool,
    /// Makes of the scene one that does not need it: nothing is to be done to most.
    pub(super) skipped: Change,
    /// Makes of the scene one that does.
    pub(super) forced: Change,
}

/// What is done to a scene and the settings before they are rendered.
type Change = fn(&mut SceneParts, &mut Settings);

/// All that can be forced.
pub(super) const ALL: [Skip; 13] = [
    Skip {
        name: "one light: nothing to choose, nothing to learn",
        forced_by: "the sampler is made, asked and taught",
        applies: |scene| scene.lights.len() == 1,
        skipped: unchanged,
        forced: |_, settings| settings.light.choose_among_one = true,
    },
    Skip {
        name: "no lights: no shadow rays",
        forced_by: "a material glows with 1e-30",
        applies: |_| true,
        skipped: |parts, _| dim(parts, 1, 0.0),
        forced: |parts, _| {
            dim(parts, 1, 0.0);
            glow(parts);
        },
    },
    Skip {
        name: "black lights: no samples",
        forced_by: "every second lamp shines with 1e-30 instead of 0",
        applies: |scene| scene.lights.len() > 1,
        skipped: |parts, _| dim(parts, 2, 0.0),
        forced: |parts, _| dim(parts, 2, UNSEEN),
    },
    Skip {
        name: "no textures: no texture coordinates, no lookups",
        forced_by: "one white texel on everything",
        applies: |scene| scene.parts.textures.is_empty(),
        skipped: unchanged,
        forced: |parts, _| paper(parts),
    },
    Skip {
        name: "no normal maps: no tangents",
        forced_by: "a flat normal map on everything",
        applies: |scene| scene.parts.materials.iter().all(|m| m.normal_texture.is_none()),
        skipped: |parts, _| paper(parts),
        forced: |parts, _| {
            paper(parts);
            map_normals(parts);
        },
    },
    Skip {
        name: "no alpha masks: rays stop at the first triangle",
        forced_by: "masks that cut nothing out",
        applies: |scene| scene.parts.materials.iter().all(|m| m.alpha_cutoff.is_none()),
        skipped: unchanged,
        forced: |parts, _| parts.materials.iter_mut().for_each(|m| m.alpha_cutoff = Some(0.0)),
    },
    Skip {
        name: "no instancing: rays are not transformed",
        forced_by: "the whole scene is one instance",
        applies: |scene| scene.parts.instances.iter().all(|instance| instance.identity),
        skipped: unchanged,
        forced: |parts, _| instance(parts),
    },
    Skip {
        name: "flat triangles: no interpolation of normals",
        forced_by: "vertex normals that lean by 2e-6",
        applies: |_| true,
        skipped: unchanged,
        forced: |parts, _| parts.meshes.iter_mut().for_each(|mesh| lean(mesh)),
    },
    Skip {
        name: "no glossy materials: lights are not looked for by reflection",
        forced_by: "a coat that reflects 1e-30 on everything",
        applies: |scene| scene.parts.materials.iter().all(is_matt),
        skipped: unchanged,
        forced: |parts, _| coat(parts),
    },
    Skip {
        name: "punctual lights only: no multiple importance sampling",
        forced_by: "a material glows with 1e-30, all are coated",
        applies: |scene| scene.lights.iter().all(|light| light.kind != LightKind::Triangle),
        skipped: |parts, _| coat(parts),
        forced: |parts, _| {
            coat(parts);
            glow(parts);
        },
    },
    Skip {
        name: "not learning: no observations",
        forced_by: "uniform choice, of which `dump` wants to know all",
        applies: |_| true,
        skipped: |_, settings| settings.method = Method::Sampled(SamplerKind::Uniform),
        forced: |_, settings| {
            settings.method = Method::Sampled(SamplerKind::Uniform);
            settings.record_lights = true;
        },
    },
    Skip {
        name: "no auxiliary images asked for: none kept",
        forced_by: "they are asked for",
        applies: |_| true,
        skipped: unchanged,
        forced: |_, settings| settings.aovs = true,
    },
    Skip {
        name: "nothing",
        forced_by: "nothing: what chance alone makes of the ratio",
        applies: |_| true,
        skipped: unchanged,
        forced: |_, _| (),
    },
];

/// What is left out until a ray needs it; done all the same by [`scene::Scene::build_all`], which is no change of the scene.
pub(super) const ON_DEMAND: Skip = Skip {
    name: "made on demand: trees, records, textures, meshes of large files",
    forced_by: "all is made beforehand: load and first frame",
    applies: |scene| {
        let parts = &scene.parts;
        parts.instances.iter().any(|instance| !instance.identity)
            || parts.textures.iter().any(|texture| texture.texels.is_deferred())
    },
    skipped: unchanged,
    forced: unchanged,
};

fn unchanged(_: &mut SceneParts, _: &mut Settings) {}

fn is_matt(material: &Material) -> bool {
    material.metallic == 0.0 && material.dielectric_f0 == Vec3::ZERO && material.dielectric_f90 == 0.0
}

/// Lets every `period`-th lamp shine with `radiance` in its brightest channel, 0 for black.
fn dim(parts: &mut SceneParts, period: usize, radiance: f32) {
    let towards = |emission: Vec3| emission * (radiance / emission.max_element());
    let emitters = parts.materials.iter_mut().filter(|material| material.emits());
    for material in emitters.step_by(period) {
        material.emission = towards(material.emission);
    }
    for (light, _) in parts.punctual.iter_mut().step_by(period) {
        light.intensity = towards(light.intensity);
    }
}

/// Makes a light of the material with the fewest triangles among those that do not emit: one that nobody sees.
fn glow(parts: &mut SceneParts) {
    let mut triangles = vec![0_usize; parts.materials.len()];
    for &material in parts.meshes.iter().flat_map(|mesh| &mesh.materials) {
        triangles[material as usize] += 1;
    }
    let used = parts
        .materials
        .iter_mut()
        .zip(triangles)
        .filter(|(m, n)| *n > 0 && !m.emits());
    if let Some((rarest, _)) = used.min_by_key(|(_, triangles)| *triangles) {
        rarest.emission = Vec3::splat(UNSEEN);
    }
}

/// Gives everything texture coordinates, and a white texel for each input of its material.
fn paper(parts: &mut SceneParts) {
    let white = add_texel(parts, [255; 4], true);
    for material in &mut parts.materials {
        material.base_color_texture.get_or_insert(white);
        material.metallic_roughness_texture.get_or_insert(white);
        if material.emits() {
            material.emissive_texture.get_or_insert(white);
        }
    }
    for mesh in &mut parts.meshes {
        if mesh.uvs.is_empty() {
            // Any will do that make a plane of each triangle.
            mesh.uvs = mesh
                .positions
                .iter()
                .map(|p| Vec2::new(p.x + 0.5 * p.y, p.z - 0.25 * p.y))
                .collect();
        }
    }
}

/// Maps normals to themselves.
fn map_normals(parts: &mut SceneParts) {
    let flat = add_texel(parts, [128, 128, 255, 255], false);
    for material in &mut parts.materials {
        // 8 bits know no exact middle.
        (material.normal_texture, material.normal_scale) = (Some(flat), 0.0);
    }
}

fn add_texel(parts: &mut SceneParts, texel: [u8; 4], srgb: bool) -> TextureRef {
    parts.textures.push(Texture {
        name: "one texel".into(),
        width: 1,
        height: 1,
        texels: vec![texel].into(),
        srgb,
        wrap: Default::default(),
        nearest: false,
    });
    TextureRef {
        texture: parts.textures.len() as u32 - 1,
        uv_set: 0,
        columns: Mat2::IDENTITY,
        offset: Vec2::ZERO,
    }
}

/// Moves what is placed as it is by less than any digit tells.
fn instance(parts: &mut SceneParts) {
    let shift = Affine3A::from_translation(Vec3::splat(1e-30));
    for instance in parts.instances.iter_mut().filter(|instance| instance.identity) {
        if let Some(moved) = Instance::new(instance.mesh, instance.origin, shift) {
            *instance = moved;
        }
    }
}

/// Gives every triangle normals of its own that are not quite its own.
fn lean(mesh: &mut Mesh) {
    const BY: Vec3 = Vec3::new(2e-6, -2e-6, 2e-6);
    unshare(mesh);
    mesh.normals.resize(mesh.positions.len(), Vec3::ZERO);
    for triangle in 0..mesh.len() {
        let [a, b, c] = mesh.corners(triangle);
        let own = (b - a).cross(c - a).try_normalize().unwrap_or(Vec3::Z);
        for normal in &mut mesh.normals[3 * triangle..3 * triangle + 3] {
            // Zero stands for the triangle's own.
            let meant = if *normal == Vec3::ZERO { own } else { *normal };
            *normal = meant + BY;
        }
    }
}

/// Gives every triangle vertices of its own.
fn unshare(mesh: &mut Mesh) {
    fn spread<T: Copy>(stream: &mut Vec<T>, vertices: &[u32]) {
        if !stream.is_empty() {
            *stream = vertices.iter().map(|&vertex| stream[vertex as usize]).collect();
        }
    }
    let vertices: Vec<u32> = mesh.indices.iter().flatten().copied().collect();
    spread(&mut mesh.positions, &vertices);
    spread(&mut mesh.normals, &vertices);
    spread(&mut mesh.uvs, &vertices);
    spread(&mut mesh.uvs1, &vertices);
    spread::<Vec4>(&mut mesh.tangents, &vertices);
    spread::<Vec4>(&mut mesh.colors, &vertices);
    let corners = 0..mesh.indices.len() as u32;
    mesh.indices = corners
        .map(|triangle| [0, 1, 2].map(|corner| 3 * triangle + corner))
        .collect();
}

/// Makes everything glossy that is matt, by as good as nothing.
fn coat(parts: &mut SceneParts) {
    for material in parts.materials.iter_mut().filter(|material| is_matt(material)) {
        material.dielectric_f0 = Vec3::splat(UNSEEN);
        material.roughness = 0.5;
    }
}
