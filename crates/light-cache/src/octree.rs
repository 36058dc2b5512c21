//! Fixed subdivision of space: in every cell the bright lights have probabilities of their own, the dim ones share a rest.
//!
//! Shirley, Wang and Zimmerman 1996, "Monte Carlo Techniques for Direct Lighting Calculations", section 4.3: contributions are
//! estimated once per cell, for its middle and any orientation, visibility unknown. Differs: cells are the leaves of an octree of
//! fixed depth and are filled when first touched; bright are the strongest lights up to a fixed number, not those above a threshold;
//! they are found through a light tree, so that a cell costs the same however many lights there are.

use crate::tree::{CellReceiver, Tree};
use crate::{Choice, LightRecord, LightSampler, Observation, SamplerStats, Settings, ShadingPoint, records};
use glam::{UVec3, Vec3};
use sampling::Discrete;
use sampling::discrete::TOTAL;
use sampling::hash::hash2;
use scene::{Light, Scene};
use std::sync::OnceLock;
use std::time::Instant;

/// Least share of the dim lights. It bounds the noise of what the estimate of a cell has missed, and carries the floor.
const MIN_REST: f64 = 0.05;
/// Deepest octree that is made: 2^21 cells of one pointer and a flag each.
const MAX_DEPTH: u32 = 7;

/// Per-cell lists of bright lights over a rest by power.
#[derive(Debug)]
pub struct OctreeSampler {
    tree: Tree,
    /// All lights by power, floor included; `None` if there are no lights.
    rest: Option<Discrete>,
    cells: Vec<OnceLock<Box<Cell>>>,
    /// Lower corner of the subdivided cube, world space.
    corner_ws: Vec3,
    cell_size: f32,
    /// Cells per axis.
    cells_per_axis: u32,
    bright: usize,
    build_s: f64,
}

/// A cell's distribution: integer masses, as everywhere.
#[derive(Debug)]
struct Cell {
    /// Bright lights, ascending.
    lights: Vec<u32>,
    /// First random number of each bright light, then the first of the rest.
    starts: Vec<u32>,
}

/// The cell of one shading point.
#[derive(Clone, Copy, Debug)]
pub struct Local<'a> {
    /// `None` if there are no lights.
    cell: Option<(&'a Cell, &'a Discrete)>,
    salt: u32,
}

impl OctreeSampler {
    /// Prepares the subdivision of `scene`; cells are filled when they are first needed.
    pub fn new(scene: &Scene, settings: &Settings) -> Self {
        Self::over(&scene.lights, scene.center_ws, scene.radius, settings)
    }

    /// The subdivision of the cube around a sphere.
    pub(crate) fn over(lights: &[Light], center_ws: Vec3, radius: f32, settings: &Settings) -> Self {
        let start = Instant::now();
        let cells_per_axis = 1 << settings.octree_depth.min(MAX_DEPTH);
        let powers: Vec<f64> = lights.iter().map(|light| f64::from(light.power)).collect();
        let floor = (f64::from(settings.min_probability_mass) / MIN_REST).min(1.0);
        Self {
            tree: Tree::new(lights),
            rest: Discrete::new(&powers, floor),
            cells: (0..cells_per_axis * cells_per_axis * cells_per_axis)
                .map(|_| OnceLock::new())
                .collect(),
            corner_ws: center_ws - Vec3::splat(radius),
            cell_size: (2.0 * radius / cells_per_axis as f32).max(f32::MIN_POSITIVE),
            cells_per_axis,
            bright: settings.octree_bright as usize,
            build_s: start.elapsed().as_secs_f64(),
        }
    }

    /// The cell of a point; points outside belong to the nearest cell of the border.
    fn cell(&self, position_ws: Vec3) -> &Cell {
        let at = ((position_ws - self.corner_ws) / self.cell_size)
            .max(Vec3::ZERO)
            .as_uvec3();
        let at = at.min(UVec3::splat(self.cells_per_axis - 1));
        let index = (at.z * self.cells_per_axis + at.y) * self.cells_per_axis + at.x;
        self.cells[index as usize].get_or_init(|| Box::new(self.fill(at)))
    }

    /// Works out a cell: a function of the cell alone, so it does not matter who comes first.
    fn fill(&self, at: UVec3) -> Cell {
        let receiver = CellReceiver {
            center: self.corner_ws + self.cell_size * (at.as_vec3() + 0.5),
            radius: 0.5 * 3.0_f32.sqrt() * self.cell_size,
        };
        let (mut bright, rest) = self.tree.brightest(&receiver, self.bright);
        bright.sort_unstable_by_key(|&(light, _)| light);
        let sum = bright.iter().map(|&(_, weight)| f64::from(weight)).sum::<f64>();
        let rest = f64::from(rest).max(MIN_REST / (1.0 - MIN_REST) * sum);
        let weights: Vec<f64> = bright
            .iter()
            .map(|&(_, weight)| f64::from(weight))
            .chain([rest])
            .collect();
        let masses = Discrete::new(&weights, 0.0).expect("a cell has at least the rest");
        let mut start = 0;
        let starts = (0..weights.len() as u32).map(|i| {
            let first = start;
            start += masses.mass(i);
            // The first entry starts at 0 and every entry has a mass, so that no start reaches 2^32.
            first as u32
        });
        Cell {
            starts: starts.collect(),
            lights: bright.iter().map(|&(light, _)| light).collect(),
        }
    }
}

impl Cell {
    /// First random number of the rest.
    #[inline]
    fn rest(&self) -> u32 {
        self.starts[self.lights.len()]
    }

    /// Random numbers that draw `light` for itself.
    #[inline]
    fn mass(&self, light: u32) -> u32 {
        self.lights
            .binary_search(&light)
            .map_or(0, |entry| self.starts[entry + 1] - self.starts[entry])
    }
}

impl LightSampler for OctreeSampler {
    type Local<'a> = Local<'a>;
    const LEARNS: bool = false;

    #[inline]
    fn local(&self, _scene: &Scene, point: &ShadingPoint) -> Local<'_> {
        Local {
            cell: self.rest.as_ref().map(|rest| (self.cell(point.position_ws), rest)),
            salt: point.salt(),
        }
    }

    #[inline]
    fn sample(&self, local: &Local<'_>, u: u32) -> Option<Choice> {
        let (cell, rest) = local.cell?;
        let light = if u < cell.rest() {
            cell.lights[cell.starts.partition_point(|&start| start <= u) - 1]
        } else {
            // Stretched to all 32 bits; hashed bits stand in for those that `u` lacks, so that every value of the rest's
            // distribution is met equally often.
            let share = TOTAL - u64::from(cell.rest());
            let low = hash2(u, local.salt);
            rest.sample((((u64::from(u - cell.rest()) << 32) | u64::from(low)) / share) as u32)
                .index
        };
        Some(Choice::new(light, self.pmf(local, light)))
    }

    #[inline]
    fn pmf(&self, local: &Local<'_>, light: u32) -> f32 {
        let Some((cell, rest)) = local.cell else { return 0.0 };
        let share = TOTAL - u64::from(cell.rest());
        // Units of 2^-64. Only a light that is alone has all 2^64 of them.
        let own = u128::from(cell.mass(light)) << 32;
        let mass = own + u128::from(share) * u128::from(rest.mass(light));
        u64::try_from(mass).unwrap_or(u64::MAX) as f32 * (1.0 / (TOTAL as f32 * TOTAL as f32))
    }

    fn end_frame(&mut self, _scene: &Scene, _logs: &[Vec<Observation>]) {}

    fn stats(&self) -> SamplerStats {
        let cells = self.cells.iter().filter_map(OnceLock::get);
        let entries = cells.clone().map(|cell| cell.lights.len()).sum::<usize>();
        let count = cells.count();
        SamplerStats {
            bytes: self.tree.bytes()
                + self.rest.as_ref().map_or(0, Discrete::bytes)
                + size_of_val(&self.cells[..])
                + count * size_of::<Cell>()
                + 2 * entries * size_of::<u32>(),
            cells: count,
            min_probability: MIN_REST * self.rest.as_ref().map_or(0.0, Discrete::floor),
            build_s: self.build_s,
            ..SamplerStats::default()
        }
    }

    fn records(&self, scene: &Scene) -> Vec<LightRecord> {
        records::of_sampler(self, scene, &[])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{check, check_each_light_is_drawn, mixed_lights, point, points, scene_of};

    #[test]
    fn keeps_the_promises_of_a_sampler() {
        for count in [2, 5, 300] {
            let scene = scene_of(mixed_lights(count, 3));
            let sampler = OctreeSampler::new(&scene, &Settings::default());
            check(&sampler, &scene, &points(24, 5));
            check_each_light_is_drawn(&sampler, &scene);
        }
    }

    #[test]
    fn a_light_in_the_cell_is_bright() {
        let mut lights: Vec<Light> = (0..1000).map(|i| point(Vec3::new(i as f32, 0.0, 0.0), 1.0)).collect();
        lights[510].power *= 1e-3;
        let sampler = OctreeSampler::over(&lights, Vec3::new(500.0, 0.0, 0.0), 500.0, &Settings::default());
        let cell = sampler.cell(Vec3::new(510.0, 1.0, 1.0));
        assert!(cell.mass(510) > cell.mass(540) && cell.mass(540) > 0);
        assert_eq!(cell.mass(0), 0, "far lights are left to the rest");
        assert_eq!(sampler.stats().cells, 1);
    }

    #[test]
    fn points_outside_the_scene_have_a_cell() {
        let sampler = OctreeSampler::over(&mixed_lights(10, 1), Vec3::splat(5.0), 9.0, &Settings::default());
        for position in [Vec3::splat(-1e9), Vec3::splat(1e9), Vec3::NAN] {
            assert!(sampler.cell(position).starts[0] == 0);
        }
    }
}
