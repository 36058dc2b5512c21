//! The validated whole.

use crate::bvh::{Bvh, PACKET, Packet};
use crate::inputs::Inputs;
use crate::light::collect::{Collected, collect};
use crate::recentre::recentre;
use crate::shading::Shading;
use crate::validate::{texture_refs, validate};
use crate::{
    Camera, Hit, Instance, Light, LightKind, LightPoint, LightSource, Material, Memory, Mesh, PrimitiveId, Ray, Report,
    SceneError, StoredMesh, Texture,
};
use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// What a loader or generator fills. Anyone may make one; [`Scene::new`] checks it.
#[derive(Clone, Debug, Default)]
pub struct SceneParts {
    /// For titles and file names: "rooms", "modern_hall".
    pub name: String,
    /// Meshes. Mesh 0 holds geometry that is placed once, in world space; further ones are instanced. Some may still be in their file.
    pub meshes: Vec<StoredMesh>,
    /// Placements. Instance 0 places mesh 0 by the identity, if there is such geometry.
    pub instances: Vec<Instance>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Textures. Some may still be in their file.
    pub textures: Vec<Texture>,
    /// Punctual lights, with where they come from. [`Scene::new`] adds the emissive triangles.
    pub punctual: Vec<(Light, LightSource)>,
    /// (node, mesh) names by origin index.
    pub origins: Vec<(String, String)>,
    /// Cameras, at least one after loading: a framing one is made up when the file has none.
    pub cameras: Vec<Camera>,
    /// What was found on the way.
    pub report: Report,
    /// Where the zero of all positions here lies in the file, metres. Scenes that lie far from zero for their size are moved there, because
    /// single precision has no digits for both; add it to positions that people or other programs see.
    pub origin_ws: DVec3,
    /// The account of what is made on demand.
    pub memory: Arc<Memory>,
}

/// A scene ready for rendering.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Geometry, materials, textures, cameras, report. Changing them does not change what was built from them.
    pub parts: SceneParts,
    /// All lights: directional ones first, then the others along a Morton curve through their centres, so that
    /// neighbours in this order are neighbours in space and one stratified number chooses stratified lights.
    pub lights: Vec<Light>,
    /// Centre of the bounding box, world space.
    pub center_ws: Vec3,
    /// Radius of the sphere around the bounding box, metres; at least a tiny positive number.
    pub radius: f32,
    /// Seconds spent in building what every ray needs of the BVH; trees of instanced meshes follow when a ray first comes near them.
    pub build_s: f64,
    pub(crate) shading: Shading,
    pub(crate) bvh: Arc<Bvh>,
    /// Index into `parts.punctual` by light; empty if there are none.
    pub(crate) punctual_of_light: Vec<u32>,
    /// By mesh with emitting triangles, the first triangle of each run of triangles that come from one primitive of the file.
    runs: Vec<Vec<u32>>,
}

/// How much of everything there is, for `info`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Counts {
    /// Triangles, instanced ones as often as they are placed.
    pub triangles: u64,
    /// Triangles stored.
    pub stored_triangles: u64,
    /// Placements.
    pub instances: u64,
    /// Materials.
    pub materials: u64,
    /// Textures.
    pub textures: u64,
    /// Cameras.
    pub cameras: u64,
    /// Lights that are emissive triangles.
    pub triangle_lights: u64,
    /// Of these, the ones whose emission varies with a texture.
    pub textured_lights: u64,
    /// Point lights.
    pub point_lights: u64,
    /// Spot lights.
    pub spot_lights: u64,
    /// Directional lights.
    pub directional_lights: u64,
}

/// Loads `what`: a path to a `.gltf` or `.glb`, or `demo:NAME[:LIGHTS[:SEED]]`.
///
/// # Errors
/// [`SceneError`] for anything unreadable or invalid; unsupported features are no error, see [`Report`].
pub fn load(what: &str) -> Result<Scene, SceneError> {
    let parts = match what.strip_prefix("demo:") {
        Some(demo) => crate::generate::demo(demo)?,
        None => crate::gltf::read(Path::new(what))?,
    };
    Scene::new(parts)
}

impl SceneParts {
    /// Whether a placement, which is instance 0, is of geometry that lies in world space and was read beforehand: what every ray needs.
    pub(crate) fn is_fixed(&self, instance: &Instance) -> bool {
        instance.identity && !self.meshes[instance.mesh as usize].is_deferred()
    }
}

impl Scene {
    /// Checks `parts`, collects the lights and builds the BVH.
    ///
    /// # Errors
    /// [`SceneError::Invalid`] for an index out of range, a stream of the wrong length or a position that is not finite.
    /// Lesser faults are repaired, with a line in the report.
    pub fn new(mut parts: SceneParts) -> Result<Self, SceneError> {
        validate(&mut parts)?;
        recentre(&mut parts);
        let mut shading = Shading::new(&parts).ok_or_else(|| SceneError::Invalid {
            path: parts.name.clone().into(),
            place: "scene".into(),
            problem: "more than 2^32 - 1 triangles".into(),
            remedy: "instance them, or split the scene".into(),
        })?;
        let (center, radius) = bounding_sphere(&parts);
        let Collected { lights, punctual } = collect(&mut parts, &mut shading, radius);
        let of_lamps = parts.meshes.iter().zip(&shading.emitters);
        let runs = of_lamps
            .map(|(mesh, emitters)| if emitters.is_empty() { Vec::new() } else { runs(mesh) })
            .collect();
        let start = Instant::now();
        let bvh = Arc::new(Bvh::build(&parts));
        let mut scene = Self {
            parts,
            lights,
            center_ws: center,
            radius,
            build_s: start.elapsed().as_secs_f64(),
            shading,
            bvh,
            punctual_of_light: punctual,
            runs,
        };
        scene.tell_skipped();
        Ok(scene)
    }

    /// Enters into the report what this scene does not need.
    fn tell_skipped(&mut self) {
        let parts = &self.parts;
        let masked = |m: &Material| m.alpha_cutoff.is_some();
        let flat = parts.meshes.iter().all(StoredMesh::is_flat);
        let placed_once = parts.instances.iter().all(|instance| instance.identity);
        let lambert = self
            .shading
            .materials
            .iter()
            .all(|m| m.f90 == 0.0 && m.f0 == Vec3::ZERO);
        let textured = |m: &Material| texture_refs(m).iter().any(Option::is_some);
        let unneeded = [
            (
                !parts.materials.iter().any(textured),
                "no textures: no texture coordinates, no lookups",
            ),
            (
                !parts.materials.iter().any(masked),
                "no alpha masks: rays stop at the first triangle",
            ),
            (placed_once, "no instancing: rays are not transformed"),
            (
                !placed_once,
                "instanced meshes that no ray comes near: no trees, no shading records (render --stats counts them)",
            ),
            (
                parts.textures.iter().any(|texture| texture.texels.is_deferred()),
                "textures that no ray meets: not decoded, only their headers were checked (render --stats counts them)",
            ),
            (flat, "no smooth normals: no interpolation"),
            (lambert, "no glossy materials: lights are not looked for by reflection"),
            (self.lights.is_empty(), "no lights: no shadow rays"),
            (self.lights.len() == 1, "one light: nothing to choose, nothing to learn"),
        ];
        let lines = unneeded
            .into_iter()
            .filter(|(unneeded, _)| *unneeded)
            .map(|(_, line)| line.to_owned());
        self.parts.report.skipped.extend(lines);
    }

    /// Builds all that otherwise waits until a ray needs it: trees and shading records of instanced meshes, meshes and textures that are still in
    /// their file. The image does not depend on it.
    pub fn build_all(&self) {
        self.bvh.build_all(&self.parts);
        let meshes = 0..self.parts.meshes.len() as u32;
        meshes.into_par_iter().for_each(|mesh| {
            self.shading.records(&self.parts, mesh);
        });
        self.parts.textures.par_iter().for_each(|texture| {
            let _: &[[u8; 4]] = &texture.texels;
        });
    }

    /// Why a mesh or a texture could not be read when a ray first needed it, if one could not: the images since then lack it.
    pub fn fault(&self) -> Option<&SceneError> {
        let of_mesh = self.parts.meshes.iter().find_map(StoredMesh::fault);
        of_mesh.or_else(|| self.parts.textures.iter().find_map(|texture| texture.texels.fault()))
    }

    /// The acceleration structure.
    pub fn bvh(&self) -> &Bvh {
        &self.bvh
    }

    /// The nearest visible surface along the ray; `from` is the triangle it starts on.
    #[inline]
    pub fn nearest(&self, ray: &Ray, from: PrimitiveId) -> Option<Hit> {
        self.bvh.nearest(&self.parts, ray, from)
    }

    /// The nearest visible surface along each ray of `packet`.
    #[inline]
    pub fn nearest_of_packet(&self, packet: &Packet) -> [Option<Hit>; PACKET] {
        self.bvh.nearest_of_packet(&self.parts, packet)
    }

    /// Whether anything but the triangles `from` and `to` stands on the ray.
    #[inline]
    pub fn occluded(&self, ray: &Ray, from: PrimitiveId, to: PrimitiveId) -> bool {
        self.bvh.occluded(&self.parts, ray, from, to)
    }

    /// The light at `index` as a triangle's hit sees it, texture included: [`Light::sample`] with the exact texel.
    #[inline(always)]
    pub fn sample_light(&self, index: u32, from_ws: Vec3, u: Vec2) -> Option<LightPoint> {
        let light = &self.lights[index as usize];
        let mut point = light.sample(from_ws, u)?;
        if light.textured {
            point.radiance = self.texel(light, from_ws, point.wi_ws, point.distance);
            if point.radiance == Vec3::ZERO {
                return None;
            }
        }
        Some(point)
    }

    /// Radiance of a textured light in a direction.
    #[cold]
    #[inline(never)]
    fn texel(&self, light: &Light, from_ws: Vec3, wi_ws: Vec3, distance: f32) -> Vec3 {
        let PrimitiveId { instance, triangle } = light.primitive;
        let mesh = &self.parts.meshes[self.parts.instances[instance as usize].mesh as usize];
        let material = &self.parts.materials[mesh.materials[triangle as usize] as usize];
        let at = light.barycentrics(from_ws, wi_ws, distance);
        Inputs::at(mesh, triangle as usize, at.x, at.y).emission(&self.parts.textures, material)
    }

    /// Where light `index` comes from.
    pub fn light_source(&self, index: u32) -> LightSource {
        let PrimitiveId { instance, triangle } = self.lights[index as usize].primitive;
        let Some(instance) = self.parts.instances.get(instance as usize) else {
            let punctual = self.punctual_of_light[index as usize];
            return self.parts.punctual[punctual as usize].1.clone();
        };
        let mesh = &self.parts.meshes[instance.mesh as usize];
        let origin = mesh.origins.get(triangle as usize).copied().unwrap_or(instance.origin);
        let (node, mesh_name) = self.parts.origins[origin as usize].clone();
        let runs = &self.runs[instance.mesh as usize];
        let run = runs.partition_point(|&first| first <= triangle) - 1;
        LightSource {
            node,
            mesh: mesh_name,
            material: self.parts.materials[mesh.materials[triangle as usize] as usize]
                .name
                .clone(),
            triangle: triangle - runs[run],
        }
    }

    /// How much of everything there is.
    pub fn counts(&self) -> Counts {
        let parts = &self.parts;
        let mut counts = Counts {
            triangles: self.triangle_count(),
            stored_triangles: parts.meshes.iter().map(|mesh| mesh.len() as u64).sum(),
            instances: parts.instances.len() as u64,
            materials: parts.materials.len() as u64,
            textures: parts.textures.len() as u64,
            cameras: parts.cameras.len() as u64,
            ..Counts::default()
        };
        for light in &self.lights {
            counts.textured_lights += u64::from(light.textured);
            *match light.kind {
                LightKind::Triangle => &mut counts.triangle_lights,
                LightKind::Point => &mut counts.point_lights,
                LightKind::Spot => &mut counts.spot_lights,
                LightKind::Directional => &mut counts.directional_lights,
            } += 1;
        }
        counts
    }

    /// Triangles, instanced ones counted as often as they are placed.
    pub fn triangle_count(&self) -> u64 {
        self.parts
            .instances
            .iter()
            .map(|i| self.parts.meshes[i.mesh as usize].len() as u64)
            .sum()
    }
}

/// Centre and radius of the sphere around the bounding box of everything placed, in f64 on the way: squares of large
/// coordinates, and differences of close ones.
pub(crate) fn bounding_sphere(parts: &SceneParts) -> (Vec3, f32) {
    let nothing = || (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let join = |a: (Vec3, Vec3), b: (Vec3, Vec3)| (a.0.min(b.0), a.1.max(b.1));
    let local: Vec<[Vec3; 2]> = parts.meshes.par_iter().map(StoredMesh::bounds).collect();
    let mut bounds = nothing();
    for instance in &parts.instances {
        let [least, most] = local[instance.mesh as usize];
        if least.x > most.x {
            continue;
        }
        for corner in 0..8 {
            let pick = Vec3::select(
                glam::BVec3::from_array([1, 2, 4].map(|bit| corner & bit != 0)),
                most,
                least,
            );
            let placed = instance.world_from_local.transform_point3(pick);
            bounds = join(bounds, (placed, placed));
        }
    }
    if bounds.0.x > bounds.1.x {
        return (Vec3::ZERO, f32::MIN_POSITIVE.sqrt());
    }
    let (least, most) = (bounds.0.as_dvec3(), bounds.1.as_dvec3());
    let radius = (0.5 * (most - least).length()).clamp(f64::from(f32::MIN_POSITIVE.sqrt()), f64::from(f32::MAX));
    ((0.5 * (least + most)).as_vec3(), radius as f32)
}

/// First triangles of the runs with one origin and one material: what was one primitive in the file.
fn runs(mesh: &Mesh) -> Vec<u32> {
    let key = |i: usize| (mesh.origins.get(i), mesh.materials[i]);
    (0..mesh.len())
        .filter(|&i| i == 0 || key(i) != key(i - 1))
        .map(|i| i as u32)
        .collect()
}

#[cfg(test)]
mod tests;
