//! The validated whole.

use crate::bvh::Bvh;
use crate::{
    Camera, Hit, Instance, Light, LightPoint, LightSource, Material, Mesh, PrimitiveId, Ray, Report, SceneError,
    Surface, Texture,
};
use glam::{Vec2, Vec3};
use std::path::Path;

/// What a loader or generator fills. Anyone may make one; [`Scene::new`] checks it.
#[derive(Clone, Debug, Default)]
pub struct SceneParts {
    /// For titles and file names: "rooms", "modern_hall".
    pub name: String,
    /// Meshes. Mesh 0 holds all geometry that is placed once, in world space; further ones are instanced.
    pub meshes: Vec<Mesh>,
    /// Placements. Instance 0 places mesh 0 by the identity, if there is such geometry.
    pub instances: Vec<Instance>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Textures.
    pub textures: Vec<Texture>,
    /// Punctual lights, with where they come from. [`Scene::new`] adds the emissive triangles.
    pub punctual: Vec<(Light, LightSource)>,
    /// (node, mesh) names by origin index.
    pub origins: Vec<(String, String)>,
    /// Cameras, at least one after loading: a framing one is made up when the file has none.
    pub cameras: Vec<Camera>,
    /// What was found on the way.
    pub report: Report,
}

/// A scene ready for rendering.
#[derive(Debug)]
pub struct Scene {
    /// Geometry, materials, textures, cameras, report.
    pub parts: SceneParts,
    /// All lights: directional ones first, then the others along a Morton curve through their centres, so that
    /// neighbours in this order are neighbours in space and one stratified number chooses stratified lights.
    pub lights: Vec<Light>,
    /// Centre of the bounding box, world space.
    pub center_ws: Vec3,
    /// Radius of the sphere around the bounding box, metres; at least a tiny positive number.
    pub radius: f32,
    /// Seconds spent in building the BVH.
    pub build_s: f64,
    bvh: Bvh,
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

impl Scene {
    /// Checks `parts`, collects the lights and builds the BVH.
    ///
    /// # Errors
    /// [`SceneError::Invalid`] for an index out of range or a position that is not finite.
    pub fn new(parts: SceneParts) -> Result<Self, SceneError> {
        let _ = parts;
        unimplemented!("owner: scene loader")
    }

    /// The nearest visible surface along the ray; `from` is the triangle it starts on.
    #[inline]
    pub fn nearest(&self, ray: &Ray, from: PrimitiveId) -> Option<Hit> {
        self.bvh.nearest(&self.parts, ray, from)
    }

    /// Whether anything but the triangles `from` and `to` stands on the ray.
    #[inline]
    pub fn occluded(&self, ray: &Ray, from: PrimitiveId, to: PrimitiveId) -> bool {
        self.bvh.occluded(&self.parts, ray, from, to)
    }

    /// Everything shading needs to know about a hit.
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let _ = (ray, hit);
        unimplemented!("owner: scene loader")
    }

    /// A ray that leaves `surface` towards `wi_ws`, its origin moved off the surface by a few units in the last place
    /// (Waechter and Binder, Ray Tracing Gems 2019, chapter 6) on the side of `wi_ws`.
    pub fn ray_from(&self, surface: &Surface, wi_ws: Vec3, t_max: f32) -> Ray {
        let _ = (surface, wi_ws, t_max);
        unimplemented!("owner: scene loader")
    }

    /// The light at `index` as a triangle's hit sees it, texture included: [`Light::sample`] with the exact texel.
    pub fn sample_light(&self, index: u32, from_ws: Vec3, u: Vec2) -> Option<LightPoint> {
        let _ = (index, from_ws, u);
        unimplemented!("owner: scene loader")
    }

    /// Where light `index` comes from.
    pub fn light_source(&self, index: u32) -> LightSource {
        let _ = index;
        unimplemented!("owner: scene loader")
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
