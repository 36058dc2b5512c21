//! Scenes made by hand, in metres.

use glam::Vec3;
use scene::{Camera, Instance, Light, LightKind, LightSource, Material, Mesh, PrimitiveId, Scene, SceneParts};
use std::f32::consts::PI;

/// Collects triangles and punctual lights.
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
    pub fn build(&self) -> Scene {
        Scene::new(self.parts()).expect("the scene is valid")
    }

    /// What [`Scene::new`] checks.
    pub fn parts(&self) -> SceneParts {
        let mut parts = self.parts.clone();
        parts.name = "test".into();
        parts.origins = vec![("node".into(), "mesh".into())];
        if !self.mesh.is_empty() {
            parts.meshes = vec![self.mesh.clone()];
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
        power: 4.0 * PI * scene::luminance(intensity),
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

/// Light from infinity that goes along the unit vector `along_ws`.
pub fn directional(along_ws: Vec3, irradiance: Vec3) -> Light {
    Light {
        kind: LightKind::Directional,
        normal_ws: along_ws,
        ..point(Vec3::ZERO, irradiance)
    }
}

/// A narrow camera at `eye` whose image, seen from `distance` away, is `size` wide at `target`: a light meter.
pub fn meter(eye: Vec3, target: Vec3, size: f32) -> Camera {
    let up = if (eye - target).normalize().y.abs() > 0.9 {
        Vec3::Z
    } else {
        Vec3::Y
    };
    Camera::look_at(
        "meter",
        eye,
        target,
        up,
        2.0 * (0.5 * size / eye.distance(target)).atan(),
    )
}

/// A ground of `material` at y = 0, facing up, 20 m wide.
pub fn ground(builder: &mut Builder, material: u32) {
    builder.quad(Vec3::new(-10.0, 0.0, -10.0), Vec3::Z * 20.0, Vec3::X * 20.0, material);
}

/// A few lights of every kind around a box on the ground, all lengths multiplied by `scale`; radiance is kept, point
/// intensity grows with the square, so that the image stays the same.
pub fn still_life(scale: f32) -> Builder {
    still_life_with(scale, |builder, material| {
        builder.quad(
            Vec3::new(-1.0, 3.0, -1.0) * scale,
            Vec3::X * scale,
            Vec3::Z * scale,
            material,
        );
    })
}

/// [`still_life`] with the square lamp made by `lamp` (in the same place, facing down) from the material it is given.
pub fn still_life_with(scale: f32, lamp: impl FnOnce(&mut Builder, u32)) -> Builder {
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
    let v = |x, y, z| Vec3::new(x, y, z) * scale;
    builder.quad(v(-4.0, 0.0, -4.0), v(0.0, 0.0, 8.0), v(8.0, 0.0, 0.0), grey);
    builder.quad(v(-4.0, 0.0, -2.0), v(8.0, 0.0, 0.0), v(0.0, 4.0, 0.0), glossy);
    // A block that throws shadows.
    builder.quad(v(0.0, 1.0, 0.0), v(0.0, 0.0, 1.0), v(1.0, 0.0, 0.0), red);
    builder.quad(v(0.0, 0.0, 1.0), v(1.0, 0.0, 0.0), v(0.0, 1.0, 0.0), red);
    builder.quad(v(0.0, 0.0, 0.0), v(0.0, 0.0, 1.0), v(0.0, 1.0, 0.0), red);
    builder.quad(v(2.0, 0.2, -1.8), v(1.5, 0.0, 0.0), v(0.0, 0.3, 0.0), strip);
    lamp(&mut builder, warm);
    let intensity = scale * scale;
    builder.light(point(v(2.0, 1.5, 1.0), Vec3::new(1.0, 0.8, 0.6) * intensity));
    builder.light(point(v(-2.5, 0.7, 0.5), Vec3::new(0.2, 0.3, 0.2) * intensity));
    builder.light(spot(
        v(0.5, 3.5, 2.0),
        Vec3::new(0.0, -0.8, -0.6),
        Vec3::splat(6.0 * intensity),
        0.2,
        0.5,
    ));
    builder.light(directional(Vec3::new(0.6, -0.64, -0.48), Vec3::new(0.1, 0.1, 0.2)));
    builder
}

/// The camera of [`still_life`].
pub fn still_life_camera(scale: f32) -> Camera {
    let eye = Vec3::new(1.0, 2.5, 6.0) * scale;
    Camera::look_at("still life", eye, Vec3::new(0.3, 0.8, 0.0) * scale, Vec3::Y, 0.8)
}
