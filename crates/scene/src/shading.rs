//! Packed records for [`crate::Scene::surface`]: what nearly every hit needs, without touching meshes and materials.
//!
//! A hit on a flat untextured triangle that is placed once reads one placement, one triangle record (24 bytes) and one
//! material record (48 bytes, shared by many hits), instead of indices, three positions, the material index and
//! the material: two dependent cache misses fewer in a large scene.

use crate::{Material, Mesh, SceneParts};
use glam::Vec3;
use rayon::prelude::*;

/// Marks a triangle whose material does not emit.
pub(crate) const NO_EMITTER: u32 = u32::MAX;

/// A triangle of a mesh, local space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleRecord {
    /// Unit normal of the front.
    pub(crate) normal: Vec3,
    /// `normal . x` for points of the triangle.
    pub(crate) plane: f32,
    /// Material index; the upper bits are flags.
    material: u32,
    /// Number of this triangle among the emitting ones of its mesh, or [`NO_EMITTER`].
    pub(crate) emitter: u32,
}

impl TriangleRecord {
    /// The shading normal varies over the triangle.
    const SMOOTH: u32 = 1 << 31;
    /// Textures or vertex colours take part.
    const DETAILED: u32 = 1 << 30;
    const FLAGS: u32 = Self::SMOOTH | Self::DETAILED;

    /// Material and flags as they are stored: bit 31 smooth, bit 30 detailed.
    pub(crate) fn material_word(&self) -> u32 {
        self.material
    }

    #[inline]
    pub(crate) fn material(&self) -> u32 {
        self.material & !Self::FLAGS
    }

    /// Gives it another material that has textures where the old one has.
    pub(crate) fn set_material(&mut self, material: u32) {
        self.material = self.material & Self::FLAGS | material;
    }

    /// Flat and of one colour: the record says it all.
    #[inline]
    pub(crate) fn plain(&self) -> bool {
        self.material & Self::FLAGS == 0
    }

    pub(crate) fn smooth(&self) -> bool {
        self.material & Self::SMOOTH != 0
    }

    pub(crate) fn detailed(&self) -> bool {
        self.material & Self::DETAILED != 0
    }
}

/// A material without its textures, in the terms of [`crate::Bsdf`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct MaterialRecord {
    pub(crate) diffuse: Vec3,
    pub(crate) alpha: f32,
    pub(crate) f0: Vec3,
    pub(crate) f90: f32,
    pub(crate) emission: Vec3,
    pub(crate) double_sided: bool,
}

impl MaterialRecord {
    pub(crate) fn new(material: &Material) -> Self {
        let lobes = Lobes::new(material, material.base_color, material.metallic, material.roughness);
        Self {
            diffuse: lobes.diffuse,
            alpha: lobes.alpha,
            f0: lobes.f0,
            f90: lobes.f90,
            emission: material.emission,
            double_sided: material.double_sided,
        }
    }
}

/// The lobes of a metallic-roughness material at given values of its inputs.
pub(crate) struct Lobes {
    pub(crate) diffuse: Vec3,
    pub(crate) f0: Vec3,
    pub(crate) f90: f32,
    pub(crate) alpha: f32,
}

impl Lobes {
    /// glTF 2.0 appendix B.3.5 (metals and dielectrics combined into one Fresnel), with the dielectric end from
    /// `KHR_materials_specular`.
    pub(crate) fn new(material: &Material, base_color: Vec3, metallic: f32, roughness: f32) -> Self {
        Self {
            diffuse: base_color * (1.0 - metallic),
            f0: material.dielectric_f0.lerp(base_color, metallic),
            f90: material.dielectric_f90 + (1.0 - material.dielectric_f90) * metallic,
            alpha: (roughness * roughness).max(crate::bsdf::MIN_ALPHA),
        }
    }
}

/// Where the records of an instance begin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    /// Index of the mesh's first triangle record.
    pub(crate) first_triangle: u32,
    /// Index into [`Shading::lights`] of the instance's first emitting triangle.
    pub(crate) first_emitter: u32,
    /// Local space is world space.
    pub(crate) identity: bool,
}

/// All records of a scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shading {
    pub(crate) placements: Vec<Placement>,
    pub(crate) triangles: Vec<TriangleRecord>,
    pub(crate) materials: Vec<MaterialRecord>,
    /// Light index by placed emitting triangle, [`crate::surface::NO_LIGHT`] where that triangle is too small to be one.
    pub(crate) lights: Vec<u32>,
    /// Per mesh, the emitting triangles.
    pub(crate) emitters: Vec<Vec<u32>>,
}

impl Shading {
    /// Packs the records; `lights` is filled in once the lights are in order.
    ///
    /// `None` if there are more triangles, or more emitting ones, than a u32 counts.
    pub(crate) fn new(parts: &SceneParts) -> Option<Self> {
        let triangles: usize = parts.meshes.iter().map(Mesh::len).sum();
        u32::try_from(triangles).ok()?;
        let mut shading = Self {
            triangles: Vec::with_capacity(triangles),
            materials: parts.materials.iter().map(MaterialRecord::new).collect(),
            ..Self::default()
        };
        let mut first_triangles = Vec::with_capacity(parts.meshes.len());
        for mesh in &parts.meshes {
            first_triangles.push(shading.triangles.len() as u32);
            let emitters: Vec<u32> = (0..mesh.len() as u32)
                .filter(|&i| parts.materials[mesh.materials[i as usize] as usize].emits())
                .collect();
            let first = shading.triangles.len();
            let records = (0..mesh.len()).into_par_iter();
            shading
                .triangles
                .par_extend(records.map(|i| pack(mesh, i, &parts.materials)));
            for (emitter, &triangle) in emitters.iter().enumerate() {
                shading.triangles[first + triangle as usize].emitter = emitter as u32;
            }
            shading.emitters.push(emitters);
        }
        let mut first_emitter = 0_usize;
        for instance in &parts.instances {
            shading.placements.push(Placement {
                first_triangle: first_triangles[instance.mesh as usize],
                first_emitter: u32::try_from(first_emitter).ok()?,
                identity: instance.identity,
            });
            first_emitter += shading.emitters[instance.mesh as usize].len();
        }
        u32::try_from(first_emitter).ok()?;
        shading.lights = vec![crate::surface::NO_LIGHT; first_emitter];
        Some(shading)
    }
}

fn pack(mesh: &Mesh, index: usize, materials: &[Material]) -> TriangleRecord {
    let [a, b, c] = mesh.corners(index).map(|p| p.as_dvec3());
    // In f64, so that needles and tiny triangles keep their normal. A triangle of no area cannot be hit.
    let normal = (b - a).cross(c - a).try_normalize().unwrap_or(glam::DVec3::Z);
    let material = mesh.materials[index];
    let mut flags = 0;
    if is_smooth(mesh, index, normal.as_vec3()) {
        flags |= TriangleRecord::SMOOTH;
    }
    let textured = crate::validate::texture_refs(&materials[material as usize])
        .iter()
        .any(Option::is_some);
    if textured || !mesh.colors.is_empty() {
        flags |= TriangleRecord::DETAILED;
    }
    // The plane goes through the centroid as seen along the rounded normal: its error grows with the size of the triangle only.
    let rounded = normal.as_vec3();
    TriangleRecord {
        normal: rounded,
        plane: (rounded.as_dvec3().dot(a + b + c) / 3.0) as f32,
        material: material | flags,
        emitter: NO_EMITTER,
    }
}

/// Whether the vertex normals say anything that the triangle's own normal does not.
fn is_smooth(mesh: &Mesh, index: usize, normal: Vec3) -> bool {
    if mesh.normals.is_empty() {
        return false;
    }
    let normals = mesh.indices[index].map(|v| mesh.normals[v as usize]);
    // 1e-6: exporters write flat normals with rounding errors of about 1e-7.
    normals.iter().all(|n| *n != Vec3::ZERO)
        && normals
            .iter()
            .any(|n| (*n - normal).length_squared() > 1e-6_f32.powi(2))
}
