//! Packed records for [`crate::Scene::surface`]: what nearly every hit needs, without touching meshes and materials.
//!
//! Those of mesh 0 are packed beforehand, those of other meshes when one is first hit.
//!
//! A hit on a flat untextured triangle that is placed once reads one placement, one triangle record (24 bytes) and one
//! material record (48 bytes, shared by many hits), instead of indices, three positions, the material index and
//! the material: two dependent cache misses fewer in a large scene.

use crate::memory::{Droppable, OnDemand};
use crate::{Material, Mesh, SceneParts, StoredMesh};
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
    /// Index of the mesh.
    pub(crate) mesh: u32,
    /// Index into [`Shading::lights`] of the instance's first emitting triangle.
    pub(crate) first_emitter: u32,
    /// It is instance 0 and stands where it is stored, see [`SceneParts::is_fixed`]: [`Shading::fixed`] has the records.
    pub(crate) fixed: bool,
}

/// All records of a scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shading {
    pub(crate) placements: Vec<Placement>,
    /// Records of the mesh of instance 0, if it is placed by the identity.
    pub(crate) fixed: Vec<TriangleRecord>,
    /// By mesh, records of the others.
    triangles: Vec<OnDemand<Vec<TriangleRecord>>>,
    pub(crate) materials: Vec<MaterialRecord>,
    /// Light index by placed emitting triangle, [`crate::surface::NO_LIGHT`] where that triangle is too small to be one.
    pub(crate) lights: Vec<u32>,
    /// Per mesh, the emitting triangles, in increasing order.
    pub(crate) emitters: Vec<Vec<u32>>,
}

impl Shading {
    /// Packs the records; `lights` is filled in once the lights are in order.
    ///
    /// `None` if there are more triangles, or more emitting ones, than a u32 counts.
    pub(crate) fn new(parts: &SceneParts) -> Option<Self> {
        let triangles: usize = parts.meshes.iter().map(StoredMesh::len).sum();
        u32::try_from(triangles).ok()?;
        let emitting: Vec<bool> = parts.materials.iter().map(Material::emits).collect();
        let emitters = |mesh: &StoredMesh| -> Vec<u32> {
            if mesh.is_deferred() {
                return Vec::new();
            }
            (0..mesh.len() as u32)
                .filter(|&i| emitting[mesh.materials[i as usize] as usize])
                .collect()
        };
        let mut shading = Self {
            triangles: parts.meshes.iter().map(|_| OnDemand::default()).collect(),
            materials: parts.materials.iter().map(MaterialRecord::new).collect(),
            emitters: parts.meshes.par_iter().map(emitters).collect(),
            ..Self::default()
        };
        let mut first_emitter = 0_usize;
        for (index, instance) in parts.instances.iter().enumerate() {
            shading.placements.push(Placement {
                mesh: instance.mesh,
                first_emitter: u32::try_from(first_emitter).ok()?,
                fixed: index == 0 && parts.is_fixed(instance),
            });
            first_emitter += shading.emitters[instance.mesh as usize].len();
        }
        u32::try_from(first_emitter).ok()?;
        shading.lights = vec![crate::surface::NO_LIGHT; first_emitter];
        if let Some(mesh) = shading.fixed_mesh() {
            shading.fixed = shading.pack_mesh(parts, mesh);
        }
        Some(shading)
    }

    fn fixed_mesh(&self) -> Option<u32> {
        self.placements
            .first()
            .filter(|first| first.fixed)
            .map(|first| first.mesh)
    }

    /// The records of a mesh, packed now if none of its triangles was hit before.
    pub(crate) fn records(&self, parts: &SceneParts, mesh: u32) -> &[TriangleRecord] {
        if self.fixed_mesh() == Some(mesh) {
            return &self.fixed;
        }
        self.triangles[mesh as usize].get_or_make(&parts.memory, || self.pack_mesh(parts, mesh))
    }

    /// The record of a triangle, if it is packed already.
    pub(crate) fn packed_mut(&mut self, mesh: u32, triangle: u32) -> Option<&mut TriangleRecord> {
        if self.fixed_mesh() == Some(mesh) {
            return self.fixed.get_mut(triangle as usize);
        }
        self.triangles[mesh as usize].get_mut()?.get_mut(triangle as usize)
    }

    /// For dropping records: those of mesh 0 stay.
    pub(crate) fn droppable(&mut self) -> impl Iterator<Item = &mut dyn Droppable> {
        self.triangles.iter_mut().map(|records| records as &mut dyn Droppable)
    }

    /// Bytes of what stays.
    pub(crate) fn kept_bytes(&self) -> usize {
        size_of_val(&*self.fixed)
            + size_of_val(&*self.placements)
            + size_of_val(&*self.materials)
            + size_of_val(&*self.lights)
            + self
                .emitters
                .iter()
                .map(|emitters| size_of_val(&**emitters))
                .sum::<usize>()
    }

    fn pack_mesh(&self, parts: &SceneParts, index: u32) -> Vec<TriangleRecord> {
        // As it was read: one that could not be has no triangles, whatever its file claims.
        let mesh: &Mesh = &parts.meshes[index as usize];
        let records = (0..mesh.len()).into_par_iter();
        let mut records: Vec<TriangleRecord> = records.map(|i| pack(mesh, i, &parts.materials)).collect();
        for (emitter, &triangle) in self.emitters[index as usize].iter().enumerate() {
            records[triangle as usize].emitter = emitter as u32;
        }
        records
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
