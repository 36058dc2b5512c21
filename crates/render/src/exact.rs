//! Direct light at a path vertex from all lights: the judge of everything that chooses.

use crate::direct::{Connection, Direct, DirectLight, LightNumbers, Vertex};
use crate::path::{Probe, TileLog};
use glam::{DVec3, Vec2, Vec3};
use light_cache::ShadingPoint;
use sampling::hash::hash2;
use sampling::unit_f32;
use scene::{Light, LightKind, Scene};

/// Lights tested at a time: a few vector registers, one word of a bit mask.
const BLOCK: usize = 32;

/// Sums over all lights, one point on each. Uses no cache and makes no choice.
pub(crate) struct AllLights {
    blocks: Vec<Block>,
}

/// What tells cheaply, and never wrongly, that a light cannot reach a point: structure of arrays, so that the
/// compiler tests several lights at a time.
#[derive(Clone)]
struct Block {
    center_x: [f32; BLOCK],
    center_y: [f32; BLOCK],
    center_z: [f32; BLOCK],
    /// Radius of a sphere around the light; infinite for lights at infinity.
    radius: [f32; BLOCK],
    /// Plane of a one-sided emitter (x, y, z, offset): what lies below is dark. All zero, offset 1: no such plane.
    plane_x: [f32; BLOCK],
    plane_y: [f32; BLOCK],
    plane_z: [f32; BLOCK],
    plane_offset: [f32; BLOCK],
    /// Square of the distance beyond which nothing arrives.
    range_sq: [f32; BLOCK],
}

impl Block {
    /// No lights: an empty range.
    const EMPTY: Self = Self {
        center_x: [0.0; BLOCK],
        center_y: [0.0; BLOCK],
        center_z: [0.0; BLOCK],
        radius: [0.0; BLOCK],
        plane_x: [0.0; BLOCK],
        plane_y: [0.0; BLOCK],
        plane_z: [0.0; BLOCK],
        plane_offset: [1.0; BLOCK],
        range_sq: [-1.0; BLOCK],
    };

    /// Margin of the tests relative to the coordinates involved: well above rounding.
    const MARGIN: f32 = 1e-4;

    fn set(&mut self, i: usize, light: &Light) {
        let center = light.center_ws();
        [self.center_x[i], self.center_y[i], self.center_z[i]] = center.to_array();
        self.range_sq[i] = f32::INFINITY;
        let margin = Self::MARGIN * center.abs().max_element();
        match light.kind {
            LightKind::Triangle => {
                let corners = [Vec3::ZERO, light.edge1_ws, light.edge2_ws].map(|e| light.position_ws + e);
                let radius = corners.iter().map(|c| c.distance(center)).fold(0.0, f32::max);
                self.radius[i] = radius * (1.0 + Self::MARGIN) + margin;
                if !light.double_sided {
                    let n = light.normal_ws;
                    [self.plane_x[i], self.plane_y[i], self.plane_z[i]] = n.to_array();
                    self.plane_offset[i] = margin + Self::MARGIN * radius - n.dot(center);
                }
            }
            LightKind::Point | LightKind::Spot => {
                self.radius[i] = margin;
                self.range_sq[i] = light.range * light.range * (1.0 + Self::MARGIN);
            }
            LightKind::Directional => self.radius[i] = f32::INFINITY,
        }
    }

    /// One bit for each light that may reach a surface at `p` with geometric normal `n`.
    #[inline]
    fn may_reach(&self, p: Vec3, n: Vec3) -> u32 {
        let margin = Self::MARGIN * p.abs().max_element();
        let mut mask = 0;
        for i in 0..BLOCK {
            let (x, y, z) = (self.center_x[i] - p.x, self.center_y[i] - p.y, self.center_z[i] - p.z);
            let above = n.x * x + n.y * y + n.z * z + self.radius[i] + margin > 0.0;
            let plane = self.plane_x[i] * p.x + self.plane_y[i] * p.y + self.plane_z[i] * p.z;
            let front = plane + self.plane_offset[i] + margin > 0.0;
            let near = x * x + y * y + z * z <= self.range_sq[i];
            mask |= u32::from(above & front & near) << i;
        }
        mask
    }
}

impl AllLights {
    pub(crate) fn new(lights: &[Light]) -> Self {
        let block = |lights: &[Light]| {
            let mut block = Block::EMPTY;
            lights.iter().enumerate().for_each(|(i, light)| block.set(i, light));
            block
        };
        Self {
            blocks: lights.chunks(BLOCK).map(block).collect(),
        }
    }

    /// The lights that may reach a vertex, in their order; few others.
    #[inline]
    pub(crate) fn reaching(&self, vertex: &Vertex<'_>) -> impl Iterator<Item = u32> {
        let (p, n) = (vertex.surface.position_ws, vertex.surface.geometric_normal_ws);
        let masks = self.blocks.iter().map(move |block| block.may_reach(p, n));
        masks.zip((0..).step_by(BLOCK)).flat_map(|(mut mask, first)| {
            std::iter::from_fn(move || {
                let light = (mask != 0).then(|| first + mask.trailing_zeros())?;
                mask &= mask - 1;
                Some(light)
            })
        })
    }
}

impl DirectLight for AllLights {
    type Local<'a> = ();

    fn local(&self, _scene: &Scene, _point: &ShadingPoint) -> Self::Local<'_> {}

    fn estimate(
        &self,
        scene: &Scene,
        (): &Self::Local<'_>,
        vertex: &Vertex<'_>,
        numbers: &[LightNumbers],
        log: &mut TileLog<'_>,
        probe: &mut impl Probe,
    ) -> Direct {
        // Each light gets the vertex's stratified point under a digital shift of its own (Kollig and Keller 2002,
        // section 3): as well stratified over the frames, and independent of the other lights.
        let [u0, u1] = numbers[0].point;
        // In f64: a million lights may add up here.
        let mut sum = DVec3::ZERO;
        for light in self.reaching(vertex) {
            let u = Vec2::new(unit_f32(u0 ^ hash2(light, 0)), unit_f32(u1 ^ hash2(light, 1)));
            if let Some(connection) = Connection::new(scene, vertex, light, 1.0, u)
                && connection.is_visible(scene, vertex, log, probe)
            {
                sum += connection.contribution(1.0).as_dvec3();
            }
        }
        Direct {
            radiance: sum.as_vec3(),
            control: Vec3::ZERO,
            light: None,
        }
    }

    fn pmf(&self, (): &Self::Local<'_>, _light: u32) -> f32 {
        1.0
    }

    fn scene_changed(&mut self, scene: &Scene) {
        *self = Self::new(&scene.lights);
    }
}
