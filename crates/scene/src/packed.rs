//! A scene as plain words, for back ends without pointers: `shaders/scene` reads what is written here.

use crate::bsdf::albedo;
use crate::bvh::FlatBvh;
use crate::shading::MaterialRecord;
use crate::texture::{TextureRef, Wrap, linear_from_srgb};
use crate::{Instance, Light, LightKind, Material, Mesh, Scene, Texture};
use bytemuck::{Pod, Zeroable};
use glam::{Mat3A, Vec3};

/// Nothing is there.
pub const NONE: u32 = u32::MAX;

/// Distances and ranges of at least this have no end: shaders have no infinity.
pub const FAR: f32 = 3.0e38;

/// Where the sections of [`PackedScene::details`] begin, and what there is one of: `SceneParams` in `shaders/scene/bindings.wgsl`.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct SceneParams {
    /// Root of the tree of what is placed once, or [`NONE`].
    pub fixed_root: u32,
    /// Root of the tree over the placed instances, or [`NONE`].
    pub top_root: u32,
    /// Instance and root of each leaf of that tree.
    pub placed: u32,
    /// Triangle records, 6 words each.
    pub triangles: u32,
    /// Instances, 40 words each.
    pub instances: u32,
    /// Meshes, 8 words each.
    pub meshes: u32,
    /// Materials, 56 words each.
    pub materials: u32,
    /// Textures, 4 words each.
    pub textures: u32,
    /// Light index by placed emitting triangle.
    pub emitter_lights: u32,
    /// Table of specular albedos.
    pub albedo: u32,
    /// Linear values of sRGB codes.
    pub srgb: u32,
    /// Number of lights.
    pub light_count: u32,
    /// Radius of the scene, metres.
    pub radius: f32,
    /// 1 if any light can be hit.
    pub area_lights: u32,
    /// Unused.
    pub pad0: u32,
    /// Unused.
    pub pad1: u32,
}

/// One light: `Light` in `shaders/scene/bindings.wgsl`, where the fields are told of. See [`Light`].
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs, reason = "each field is that of `Light`")]
pub struct PackedLight {
    pub position_ws: [f32; 3],
    /// [`LightKind`] in order; 256: double-sided, 512: textured.
    pub kind: u32,
    pub edge1_ws: [f32; 3],
    pub area: f32,
    pub edge2_ws: [f32; 3],
    pub range: f32,
    pub normal_ws: [f32; 3],
    pub cos_inner: f32,
    pub intensity: [f32; 3],
    pub cos_outer: f32,
    pub primitive: [u32; 2],
    /// Unused.
    pub pad: [u32; 2],
}

/// A scene as words.
#[derive(Clone, Debug)]
pub struct PackedScene {
    /// Where everything is.
    pub params: SceneParams,
    /// Lights, in the scene's order.
    pub lights: Vec<PackedLight>,
    /// All sections that [`SceneParams`] names.
    pub details: Vec<u32>,
    /// RGBA texels, 8 bits each, red lowest.
    pub texels: Vec<u32>,
    /// Whether any instance is found through the top tree.
    pub has_instances: bool,
    /// Whether any material has holes.
    pub has_masks: bool,
    /// Whether any triangle has textures, vertex colours or a smooth normal.
    pub has_detail: bool,
}

impl From<&Light> for PackedLight {
    fn from(light: &Light) -> Self {
        let kind = match light.kind {
            LightKind::Triangle => 0,
            LightKind::Point => 1,
            LightKind::Spot => 2,
            LightKind::Directional => 3,
        };
        Self {
            position_ws: light.position_ws.to_array(),
            kind: kind | u32::from(light.double_sided) << 8 | u32::from(light.textured) << 9,
            edge1_ws: light.edge1_ws.to_array(),
            area: light.area,
            edge2_ws: light.edge2_ws.to_array(),
            range: light.range.min(FAR),
            normal_ws: light.normal_ws.to_array(),
            cos_inner: light.cos_inner,
            intensity: light.intensity.to_array(),
            cos_outer: light.cos_outer,
            primitive: [light.primitive.instance, light.primitive.triangle],
            pad: [0; 2],
        }
    }
}

/// Words under construction.
#[derive(Default)]
struct Words(Vec<u32>);

impl Words {
    fn here(&self) -> u32 {
        self.0.len() as u32
    }

    fn floats(&mut self, values: impl IntoIterator<Item = f32>) {
        self.0.extend(values.into_iter().map(f32::to_bits));
    }

    fn vec3(&mut self, v: Vec3) {
        self.floats(v.to_array());
    }

    fn matrix(&mut self, m: &Mat3A) {
        self.floats(m.to_cols_array());
    }

    /// A stream of `N` numbers per vertex; where it begins, [`NONE`] if it is empty.
    fn stream<const N: usize>(&mut self, values: impl ExactSizeIterator<Item = [f32; N]>) -> u32 {
        if values.len() == 0 {
            return NONE;
        }
        let at = self.here();
        values.for_each(|value| self.floats(value));
        at
    }
}

impl Scene {
    /// The scene as words, beside its trees as words; `None` if the scene's are more than 32 bits can count. All is built that was not needed so
    /// far: other back ends cannot ask for more.
    pub fn packed(&self, flat: &FlatBvh) -> Option<PackedScene> {
        let parts = &self.parts;
        let mut words = Words::default();
        let mut params = SceneParams {
            fixed_root: flat.fixed.unwrap_or(NONE),
            top_root: flat.top.unwrap_or(NONE),
            light_count: self.lights.len() as u32,
            radius: self.radius,
            area_lights: self.lights.iter().any(|light| !light.is_delta()).into(),
            ..SceneParams::default()
        };
        params.placed = words.here();
        words
            .0
            .extend(flat.placed.iter().flat_map(|placed| placed.unwrap_or([NONE; 2])));
        params.triangles = words.here();
        let mut has_detail = false;
        let mut first_triangles = Vec::with_capacity(parts.meshes.len());
        let mut first_triangle = 0;
        for mesh in 0..parts.meshes.len() as u32 {
            let records = self.shading.records(parts, mesh);
            first_triangles.push(first_triangle);
            first_triangle += records.len() as u32;
            for triangle in records {
                words.vec3(triangle.normal);
                words.floats([triangle.plane]);
                words.0.extend([triangle.material_word(), triangle.emitter]);
                has_detail |= !triangle.plain();
            }
        }
        params.emitter_lights = words.here();
        words.0.extend(&self.shading.lights);
        params.albedo = words.here();
        words.0.extend(albedo::words());
        params.srgb = words.here();
        words.0.extend(linear_from_srgb());
        params.materials = words.here();
        for (material, record) in parts.materials.iter().zip(&self.shading.materials) {
            pack_material(&mut words, material, record);
        }
        params.instances = words.here();
        for (instance, placement) in parts.instances.iter().zip(&self.shading.placements) {
            pack_instance(
                &mut words,
                instance,
                [first_triangles[placement.mesh as usize], placement.first_emitter],
            );
        }
        let meshes: Vec<[u32; 8]> = parts.meshes.iter().map(|mesh| pack_mesh(&mut words, mesh)).collect();
        params.meshes = words.here();
        words.0.extend(meshes.iter().flatten());
        params.textures = words.here();
        let mut texels = Vec::new();
        for texture in &parts.textures {
            words.0.extend([
                texels.len() as u32,
                texture.width,
                texture.height,
                texture_flags(texture),
            ]);
            texels.extend(texture.texels.iter().copied().map(u32::from_le_bytes));
        }
        let countable = u32::try_from(words.0.len().max(texels.len())).is_ok();
        countable.then(|| PackedScene {
            params,
            lights: self.lights.iter().map(PackedLight::from).collect(),
            details: words.0,
            texels,
            has_instances: flat.top.is_some() || parts.instances.iter().any(|instance| !instance.identity),
            has_masks: parts.materials.iter().any(|material| material.alpha_cutoff.is_some()),
            has_detail: has_detail || self.lights.iter().any(|light| light.textured),
        })
    }
}

fn pack_material(words: &mut Words, material: &Material, record: &MaterialRecord) {
    words.vec3(record.diffuse);
    words.floats([record.alpha]);
    words.vec3(record.f0);
    words.floats([record.f90]);
    words.vec3(record.emission);
    words
        .0
        .push(u32::from(record.double_sided) | u32::from(material.alpha_cutoff.is_some()) << 1);
    words.vec3(material.base_color);
    words.floats([material.metallic, material.roughness]);
    words.vec3(material.dielectric_f0);
    words.floats([
        material.dielectric_f90,
        material.alpha,
        material.alpha_cutoff.unwrap_or(0.0),
        material.normal_scale,
    ]);
    for reference in [
        &material.base_color_texture,
        &material.metallic_roughness_texture,
        &material.normal_texture,
        &material.emissive_texture,
    ] {
        pack_reference(words, reference.as_ref());
    }
}

fn pack_reference(words: &mut Words, reference: Option<&TextureRef>) {
    let Some(reference) = reference else {
        return words.0.extend([NONE, 0, 0, 0, 0, 0, 0, 0]);
    };
    words.0.extend([reference.texture, reference.uv_set.into()]);
    words.floats(reference.columns.to_cols_array());
    words.floats(reference.offset.to_array());
}

fn pack_instance(words: &mut Words, instance: &Instance, [first_triangle, first_emitter]: [u32; 2]) {
    for transform in [&instance.local_from_world, &instance.world_from_local] {
        words.matrix(&transform.matrix3);
        words.vec3(transform.translation.into());
    }
    words.matrix(&instance.world_normal_from_local);
    let identity = u32::from(instance.identity);
    words
        .0
        .extend([instance.mesh, identity, first_triangle, first_emitter, 0, 0, 0]);
}

/// Appends a mesh's streams; returns where they begin.
fn pack_mesh(words: &mut Words, mesh: &Mesh) -> [u32; 8] {
    let indices = words.here();
    words.0.extend(mesh.indices.iter().flatten());
    let three = |vectors: &[Vec3]| vectors.iter().map(|v| v.to_array()).collect::<Vec<_>>();
    let positions = words.stream(three(&mesh.positions).into_iter());
    let normals = words.stream(three(&mesh.normals).into_iter());
    let uvs = words.stream(mesh.uvs.iter().map(|v| v.to_array()));
    let uvs1 = words.stream(mesh.uvs1.iter().map(|v| v.to_array()));
    let tangents = words.stream(mesh.tangents.iter().map(|v| v.to_array()));
    let colors = words.stream(mesh.colors.iter().map(|v| v.to_array()));
    [indices, positions, normals, uvs, uvs1, tangents, colors, NONE]
}

fn texture_flags(texture: &Texture) -> u32 {
    let [u, v] = texture.wrap.map(|wrap| match wrap {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    });
    u | v << 2 | u32::from(texture.srgb) << 4 | u32::from(texture.nearest) << 5
}
