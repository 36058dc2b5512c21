//! Scenes put together by hand, triangle by triangle: for tests, and for scenes whose image is known in closed form.

mod still_life;

pub use still_life::{square_lamp, still_life, still_life_camera};

use crate::{
    Instance, Light, LightKind, LightSource, Material, Mesh, PrimitiveId, Scene, SceneError, SceneParts, luminance,
};
use glam::Vec3;
use std::f32::consts::PI;

/// Collects triangles and punctual lights, in metres and world space.
#[derive(Clone, Debug, Default)]
pub struct Builder {
    parts: SceneParts,
    mesh: Mesh,
}

impl Builder {
    /// Adds a material and returns its index.
    pub fn material(&mut self, material: Material) -> u32 {
        self.parts.materials.push(material);
        self.parts.materials.len() as u32 - 1
    }

    /// Adds a triangle, counter-clockwise seen from its front.
    pub fn triangle(&mut self, corners: [Vec3; 3], material: u32) -> &mut Self {
        let first = self.mesh.positions.len() as u32;
        self.mesh.positions.extend(corners);
        self.mesh.indices.push([first, first + 1, first + 2]);
        self.mesh.materials.push(material);
        self.mesh.origins.push(0);
        self
    }

    /// Adds a parallelogram whose front is on the side of `edge1 x edge2`.
    pub fn quad(&mut self, corner: Vec3, edge1: Vec3, edge2: Vec3, material: u32) -> &mut Self {
        self.triangle([corner, corner + edge1, corner + edge1 + edge2], material);
        self.triangle([corner, corner + edge1 + edge2, corner + edge2], material)
    }

    /// Adds the six faces of a box, fronts inside.
    pub fn room(&mut self, low: Vec3, high: Vec3, material: u32) -> &mut Self {
        let (x, y, z) = ((high - low) * Vec3::X, (high - low) * Vec3::Y, (high - low) * Vec3::Z);
        for (corner, a, b) in [
            (low, x, y),
            (low, y, z),
            (low, z, x),
            (high, -y, -x),
            (high, -z, -y),
            (high, -x, -z),
        ] {
            self.quad(corner, a, b, material);
        }
        self
    }

    /// Adds a punctual light.
    pub fn light(&mut self, light: Light) -> &mut Self {
        self.parts.punctual.push((light, LightSource::default()));
        self
    }

    /// The scene.
    ///
    /// # Errors
    /// Those of [`Scene::new`].
    pub fn build(&self) -> Result<Scene, SceneError> {
        Scene::new(self.parts())
    }

    /// What [`Scene::new`] checks.
    pub fn parts(&self) -> SceneParts {
        let mut parts = self.parts.clone();
        parts.name = "assembled".into();
        parts.origins = vec![("node".into(), "mesh".into())];
        if !self.mesh.is_empty() {
            parts.meshes = vec![self.mesh.clone().into()];
            parts.instances = vec![Instance::identity(0, 0)];
        }
        parts
    }
}

/// A point light of `intensity` (radiant intensity).
pub fn point(position_ws: Vec3, intensity: Vec3) -> Light {
    Light {
        kind: LightKind::Point,
        double_sided: false,
        textured: false,
        position_ws,
        edge1_ws: Vec3::ZERO,
        edge2_ws: Vec3::ZERO,
        normal_ws: Vec3::ZERO,
        intensity,
        area: 0.0,
        range: f32::INFINITY,
        cos_inner: 1.0,
        cos_outer: 0.0,
        power: 4.0 * PI * luminance(intensity),
        primitive: PrimitiveId::NONE,
    }
}

/// A spot light along the unit vector `axis_ws`; the angles are half angles of the cones in radians.
pub fn spot(position_ws: Vec3, axis_ws: Vec3, intensity: Vec3, inner: f32, outer: f32) -> Light {
    Light {
        kind: LightKind::Spot,
        normal_ws: axis_ws,
        cos_inner: inner.cos(),
        cos_outer: outer.cos(),
        ..point(position_ws, intensity)
    }
}

/// Light from infinity that goes along the unit vector `along_ws`; `irradiance` on a surface that faces it.
pub fn directional(along_ws: Vec3, irradiance: Vec3) -> Light {
    Light {
        kind: LightKind::Directional,
        normal_ws: along_ws,
        ..point(Vec3::ZERO, irradiance)
    }
}
