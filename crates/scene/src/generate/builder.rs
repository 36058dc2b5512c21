//! Closed solids out of triangles: the clay of which the generated scenes are made.

use super::dice::sin_cos;
use crate::{Camera, Instance, Light, LightSource, Material, Mesh, SceneParts, StoredMesh, assemble, luminance};
use glam::{Affine3A, Mat3, Vec2, Vec3};
use std::collections::BTreeMap;
use std::f32::consts::PI;

/// Where furniture stands: a point, and a turn about the vertical.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    pub(super) origin: Vec3,
    /// World direction (x, z) of the local x axis; unit length.
    pub(super) x_axis: Vec2,
}

impl Pose {
    pub(super) const IDENTITY: Self = Self {
        origin: Vec3::ZERO,
        x_axis: Vec2::X,
    };

    /// At `origin`, turned counter-clockwise seen from above by `turns` whole turns.
    pub(super) fn new(origin: Vec3, turns: f32) -> Self {
        let (sin, cos) = sin_cos(turns);
        Self {
            origin,
            x_axis: Vec2::new(cos, -sin),
        }
    }

    fn direction(&self, v: Vec3) -> Vec3 {
        let Vec2 { x: c, y: s } = self.x_axis;
        Vec3::new(c * v.x - s * v.z, v.y, s * v.x + c * v.z)
    }

    pub(super) fn point(&self, v: Vec3) -> Vec3 {
        self.origin + self.direction(v)
    }

    /// The pose `inner`, which is given in the local space of this one.
    pub(super) fn of(&self, inner: Self) -> Self {
        let x_axis = self.direction(Vec3::new(inner.x_axis.x, 0.0, inner.x_axis.y));
        Self {
            origin: self.point(inner.origin),
            x_axis: Vec2::new(x_axis.x, x_axis.z),
        }
    }

    fn world_from_local(&self) -> Affine3A {
        let axes = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| self.direction(axis));
        Affine3A::from_mat3_translation(Mat3::from_cols(axes[0], axes[1], axes[2]), self.origin)
    }
}

/// Index of a material.
pub(super) type Paint = u32;

/// Collects one static mesh, meshes that are placed by instances, their materials and lights.
#[derive(Default)]
pub(super) struct Builder {
    parts: SceneParts,
    mesh: Mesh,
    shared: Vec<Mesh>,
    placed: Vec<Instance>,
    paints: BTreeMap<[u32; 6], Paint>,
    emissive_triangles: usize,
    origin: u32,
    pose: Option<Pose>,
}

/// Corners of a box by bit: 1 = high x, 2 = high y, 4 = high z. Faces -x, +x, -y, +y, -z, +z, counter-clockwise from
/// outside.
const BOX_FACES: [[usize; 4]; 6] = [
    [0, 4, 6, 2],
    [1, 3, 7, 5],
    [0, 1, 5, 4],
    [2, 6, 7, 3],
    [0, 2, 3, 1],
    [4, 5, 7, 6],
];

impl Builder {
    pub(super) fn new(name: &str) -> Self {
        let mut builder = Self::default();
        builder.parts.name = name.into();
        builder
    }

    /// What follows belongs to the node `node`, which shows the mesh `mesh`.
    pub(super) fn begin(&mut self, node: impl Into<String>, mesh: &str) {
        self.origin = self.parts.origins.len() as u32;
        self.parts.origins.push((node.into(), mesh.into()));
    }

    /// What follows is given in the local space of `pose`.
    pub(super) fn place(&mut self, pose: Pose) {
        self.pose = Some(pose);
    }

    /// What follows is given in world space.
    pub(super) fn place_in_world(&mut self) {
        self.pose = None;
    }

    fn paint(&mut self, material: Material) -> Paint {
        let color = if material.emits() {
            material.emission
        } else {
            material.base_color
        };
        let kind = if material.emits() { -1.0 } else { material.metallic };
        let [r, g, b] = color.to_array().map(f32::to_bits);
        let key = [
            r,
            g,
            b,
            kind.to_bits(),
            material.roughness.to_bits(),
            material.dielectric_f90.to_bits(),
        ];
        let materials = &mut self.parts.materials;
        *self.paints.entry(key).or_insert_with(|| {
            materials.push(material);
            materials.len() as Paint - 1
        })
    }

    /// A Lambert surface. Surfaces of equal colour share one material, with the first one's name.
    pub(super) fn lambert(&mut self, name: &str, color: [f32; 3]) -> Paint {
        self.paint(Material::lambert(name, color.into()))
    }

    /// A metal of this roughness.
    pub(super) fn metal(&mut self, name: &str, color: [f32; 3], roughness: f32) -> Paint {
        self.paint(Material {
            metallic: 1.0,
            roughness,
            dielectric_f0: Vec3::splat(0.04),
            dielectric_f90: 1.0,
            ..Material::lambert(name, color.into())
        })
    }

    /// A dielectric coat of this roughness over a coloured base.
    pub(super) fn glazed(&mut self, name: &str, color: [f32; 3], roughness: f32) -> Paint {
        self.paint(Material {
            roughness,
            dielectric_f0: Vec3::splat(0.04),
            dielectric_f90: 1.0,
            ..Material::lambert(name, color.into())
        })
    }

    /// A one-sided emitter of this radiance.
    pub(super) fn emitter(&mut self, name: &str, radiance: Vec3) -> Paint {
        self.paint(Material::emitter(name, radiance))
    }

    fn vertex(&mut self, at: Vec3, normal: Vec3) -> u32 {
        let (at, normal) = match &self.pose {
            Some(pose) => (pose.point(at), pose.direction(normal)),
            None => (at, normal),
        };
        self.mesh.positions.push(at);
        self.mesh.normals.push(normal);
        self.mesh.positions.len() as u32 - 1
    }

    fn index(&mut self, corners: [u32; 3], paint: Paint) {
        self.mesh.indices.push(corners);
        self.mesh.materials.push(paint);
        self.mesh.origins.push(self.origin);
        self.emissive_triangles += usize::from(self.parts.materials[paint as usize].emits());
    }

    /// A flat triangle, counter-clockwise from its front.
    pub(super) fn triangle(&mut self, corners: [Vec3; 3], paint: Paint) {
        let indices = corners.map(|at| self.vertex(at, Vec3::ZERO));
        self.index(indices, paint);
    }

    /// A flat convex polygon, counter-clockwise from its front, as a fan.
    pub(super) fn polygon(&mut self, corners: &[Vec3], paint: Paint) {
        let first = self.mesh.positions.len() as u32;
        for &at in corners {
            self.vertex(at, Vec3::ZERO);
        }
        for i in 2..corners.len() as u32 {
            self.index([first, first + i - 1, first + i], paint);
        }
    }

    /// A closed box.
    pub(super) fn cuboid(&mut self, low: [f32; 3], high: [f32; 3], paint: Paint) {
        self.cuboid_painted(low, high, [paint; 6]);
    }

    /// A closed box whose faces -x, +x, -y, +y, -z, +z are painted apart.
    pub(super) fn cuboid_painted(&mut self, low: [f32; 3], high: [f32; 3], paints: [Paint; 6]) {
        let corners = std::array::from_fn(|i| {
            let pick = |axis: usize| if i >> axis & 1 == 1 { high[axis] } else { low[axis] };
            Vec3::new(pick(0), pick(1), pick(2))
        });
        self.hexahedron(corners, paints);
    }

    /// A closed convex solid with the topology of a box; corner `i` has high x if bit 0 of `i` is set, and so on.
    pub(super) fn hexahedron(&mut self, corners: [Vec3; 8], paints: [Paint; 6]) {
        let at = corners.map(|corner| self.vertex(corner, Vec3::ZERO));
        for (face, paint) in BOX_FACES.iter().zip(paints) {
            let [a, b, c, d] = face.map(|corner| at[corner]);
            self.index([a, b, c], paint);
            self.index([a, c, d], paint);
        }
    }

    /// A closed straight bar of square cross-section from `from` to `to`, which differ.
    pub(super) fn bar(&mut self, from: Vec3, to: Vec3, width: f32, paint: Paint) {
        let along = (to - from).normalize();
        let helper = if along.y.abs() > 0.9 { Vec3::X } else { Vec3::Y };
        let x = along.cross(helper).normalize();
        // Right-handed (x, y, along), so that the faces of `hexahedron` look outwards.
        let y = along.cross(x);
        let corners = std::array::from_fn(|i| {
            let sign = |bit: usize| if i >> bit & 1 == 1 { 0.5 } else { -0.5 };
            (if i & 4 == 4 { to } else { from }) + x * (width * sign(0)) + y * (width * sign(1))
        });
        self.hexahedron(corners, [paint; 6]);
    }

    /// A closed upright frustum with a smooth mantle: radius `radii[0]` at the bottom, `radii[1]` on top, both positive.
    pub(super) fn frustum(&mut self, base: Vec3, radii: [f32; 2], height: f32, segments: u32, paint: Paint) {
        let slope = (radii[0] - radii[1]) / height;
        let mantle = self.mesh.positions.len() as u32;
        let rims: [Vec<Vec3>; 2] = [0, 1].map(|end: usize| {
            let turn = |i| {
                let (sin, cos) = sin_cos(i as f32 / segments as f32);
                base + Vec3::new(radii[end] * cos, height * end as f32, -radii[end] * sin)
            };
            (0..segments).map(turn).collect()
        });
        for i in 0..segments {
            let (sin, cos) = sin_cos(i as f32 / segments as f32);
            let normal = Vec3::new(cos, slope, -sin).normalize();
            self.vertex(rims[0][i as usize], normal);
            self.vertex(rims[1][i as usize], normal);
        }
        for i in 0..segments {
            let (a, b) = (mantle + 2 * i, mantle + 2 * ((i + 1) % segments));
            self.index([a, b, b + 1], paint);
            self.index([a, b + 1, a + 1], paint);
        }
        self.polygon(&rims[1], paint);
        let bottom: Vec<Vec3> = rims[0].iter().rev().copied().collect();
        self.polygon(&bottom, paint);
    }

    /// A closed upright cylinder.
    pub(super) fn cylinder(&mut self, base: Vec3, radius: f32, height: f32, segments: u32, paint: Paint) {
        self.frustum(base, [radius; 2], height, segments, paint);
    }

    /// A closed smooth ellipsoid of `2 * segments * (rings - 1)` triangles.
    pub(super) fn ellipsoid(&mut self, center: Vec3, radii: Vec3, segments: u32, rings: u32, paint: Paint) {
        let on_sphere = |unit: Vec3| (center + unit * radii, (unit / radii).normalize());
        let first = self.mesh.positions.len() as u32;
        for ring in 1..rings {
            let (sin_theta, cos_theta) = sin_cos(0.5 * ring as f32 / rings as f32);
            for i in 0..segments {
                let (sin, cos) = sin_cos(i as f32 / segments as f32);
                let (at, normal) = on_sphere(Vec3::new(sin_theta * cos, cos_theta, -sin_theta * sin));
                self.vertex(at, normal);
            }
        }
        let [top, bottom] = [Vec3::Y, Vec3::NEG_Y].map(|pole| {
            let (at, normal) = on_sphere(pole);
            self.vertex(at, normal)
        });
        let at = |ring: u32, i: u32| first + (ring - 1) * segments + i % segments;
        for i in 0..segments {
            self.index([top, at(1, i), at(1, i + 1)], paint);
            for ring in 1..rings - 1 {
                self.index([at(ring, i), at(ring + 1, i), at(ring + 1, i + 1)], paint);
                self.index([at(ring, i), at(ring + 1, i + 1), at(ring, i + 1)], paint);
            }
            self.index([bottom, at(rings - 1, i + 1), at(rings - 1, i)], paint);
        }
    }

    /// A closed smooth ball.
    pub(super) fn ball(&mut self, center: Vec3, radius: f32, segments: u32, paint: Paint) {
        self.ellipsoid(center, Vec3::splat(radius), segments, segments / 2, paint);
    }

    /// A closed octahedron: the cheapest thing that looks like a bulb. Eight triangles.
    pub(super) fn octahedron(&mut self, center: Vec3, radii: Vec3, paint: Paint) {
        let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| axis * radii);
        let poles = [x, -z, -x, z].map(|offset| self.vertex(center + offset, Vec3::ZERO));
        let [top, bottom] = [y, -y].map(|offset| self.vertex(center + offset, Vec3::ZERO));
        for i in 0..4 {
            let (a, b) = (poles[i], poles[(i + 1) % 4]);
            self.index([a, b, top], paint);
            self.index([b, a, bottom], paint);
        }
    }

    /// A mesh of its own out of what `make` builds around the origin; it stands where [`Builder::instance`] places it. Returns its index.
    pub(super) fn shared(&mut self, name: &str, make: impl FnOnce(&mut Self)) -> u32 {
        let fixed = std::mem::take(&mut self.mesh);
        self.place_in_world();
        make(self);
        self.place_in_world();
        let mut mesh = std::mem::replace(&mut self.mesh, fixed);
        mesh.name = name.into();
        // Its triangles stand where its instances do.
        mesh.origins = Vec::new();
        if mesh.normals.iter().all(|normal| *normal == Vec3::ZERO) {
            mesh.normals = Vec::new();
        }
        self.shared.push(mesh);
        self.shared.len() as u32
    }

    /// Places a mesh that [`Builder::shared`] has made, as part of the current node.
    pub(super) fn instance(&mut self, mesh: u32, pose: &Pose) {
        let place = Instance::new(mesh, self.origin, pose.world_from_local());
        self.placed.push(place.expect("poses are rigid"));
    }

    /// A light from infinity along the unit vector `along`, of this irradiance, named as the current node.
    pub(super) fn directional_light(&mut self, along: Vec3, irradiance: Vec3) {
        self.add_punctual(assemble::directional(along, irradiance));
    }

    /// A point light of this radiant intensity (RGB), named as the current node.
    pub(super) fn point_light(&mut self, at: Vec3, intensity: Vec3) {
        let position_ws = self.pose.map_or(at, |pose| pose.point(at));
        self.add_punctual(Light {
            cos_outer: -1.0,
            ..assemble::point(position_ws, intensity)
        });
    }

    fn add_punctual(&mut self, light: Light) {
        let (node, mesh) = self.parts.origins[self.origin as usize].clone();
        let source = LightSource {
            node,
            mesh,
            material: String::new(),
            triangle: 0,
        };
        self.parts.punctual.push((light, source));
    }

    /// Lights so far: emissive triangles and point lights.
    #[cfg(test)]
    pub(super) fn light_count(&self) -> usize {
        self.emissive_triangles + self.parts.punctual.len()
    }

    /// Emitted power so far, luminance-weighted, watts.
    pub(super) fn power(&self) -> f64 {
        let mesh = &self.mesh;
        let triangles = (0..mesh.len()).map(|i| {
            let radiance = luminance(self.parts.materials[mesh.materials[i] as usize].emission);
            let [a, b, c] = mesh.corners(i);
            f64::from(radiance * PI * 0.5 * (b - a).cross(c - a).length())
        });
        triangles.sum::<f64>()
            + self
                .parts
                .punctual
                .iter()
                .map(|(light, _)| f64::from(light.power))
                .sum::<f64>()
    }

    /// Adds a camera; the first one is the default.
    pub(super) fn camera(&mut self, name: &str, eye: Vec3, target: Vec3, fov_y: f32) {
        self.parts
            .cameras
            .push(Camera::look_at(name, eye, target, Vec3::Y, fov_y));
    }

    /// The scene: what was built in place in mesh 0, placed by the identity, then the shared meshes.
    pub(super) fn finish(self) -> SceneParts {
        let mut parts = self.parts;
        parts.meshes.push(self.mesh.into());
        parts.meshes.extend(self.shared.into_iter().map(StoredMesh::from));
        parts.instances.push(Instance::identity(0, 0));
        parts.instances.extend(self.placed);
        parts
    }
}
