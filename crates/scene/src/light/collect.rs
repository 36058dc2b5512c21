//! Finds the lights of a scene and puts them in order.

use super::{Light, LightKind};
use crate::inputs::{emission_varies, mean_emission};
use crate::shading::Shading;
use crate::surface::NO_LIGHT;
use crate::{PrimitiveId, SceneParts, luminance};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Triangles of less area than this share of the square of the scene's radius are no lights (their solid angle would be
/// noise), but stay visible.
const LEAST_AREA: f64 = 1e-20;

/// The lights of a scene.
pub(crate) struct Collected {
    /// In order: directional ones first, then along a Morton curve.
    pub(crate) lights: Vec<Light>,
    /// For each light its index in [`SceneParts::punctual`]; empty if there are none of those.
    pub(crate) punctual: Vec<u32>,
}

/// Collects emissive triangles and punctual lights, and enters the indices of the former into `shading.lights`. Decodes the textures of what emits.
pub(crate) fn collect(parts: &mut SceneParts, shading: &mut Shading, radius: f32) -> Collected {
    let punctual = check_punctual(parts, radius);
    let placed = placed_emitters(parts, shading);
    let found: Vec<Option<Light>> = placed
        .par_iter()
        .map(|&primitive| triangle_light(parts, primitive, f64::from(radius)))
        .collect();
    let tiny = found
        .par_iter()
        .zip(&placed)
        .filter(|(light, id)| light.is_none() && !is_black(parts, **id))
        .count();
    if tiny > 0 {
        parts.report.warn(format!(
            "{tiny} emissive triangles without area: visible, but not sampled as lights"
        ));
    }
    let of_punctual = |i: u32| &parts.punctual[i as usize].0;
    // Sources: placed emitters first, then punctual lights.
    let first_punctual = placed.len() as u64;
    let light = |source: u64| match source.checked_sub(first_punctual) {
        None => found[source as usize].as_ref().expect("sources are lights"),
        Some(i) => of_punctual(i as u32),
    };
    let sources: Vec<u64> = (0..first_punctual)
        .filter(|&i| found[i as usize].is_some())
        .chain(punctual.iter().map(|&i| first_punctual + u64::from(i)))
        .collect();
    let curve = Curve::around(sources.iter().map(|&s| light(s)));
    let mut order: Vec<(u64, u64)> = sources.par_iter().map(|&s| (curve.key(light(s)), s)).collect();
    // Pairs differ in their source, so the result does not depend on how the sort runs.
    order.par_sort_unstable();
    let lights: Vec<Light> = order.par_iter().map(|&(_, source)| *light(source)).collect();
    let of_light = |&(_, source): &(u64, u64)| source.checked_sub(first_punctual).map_or(NO_LIGHT, |i| i as u32);
    let punctual = if punctual.is_empty() {
        Vec::new()
    } else {
        order.par_iter().map(of_light).collect()
    };
    for (index, &(_, source)) in order.iter().enumerate() {
        if let Some(slot) = shading.lights.get_mut(source as usize) {
            *slot = index as u32;
        }
    }
    Collected { lights, punctual }
}

/// Indices of the punctual lights that shine, their power and numbers put right.
fn check_punctual(parts: &mut SceneParts, radius: f32) -> Vec<u32> {
    let mut black = 0;
    let mut kept = Vec::new();
    for (index, (light, source)) in parts.punctual.iter_mut().enumerate() {
        let axis = light.normal_ws.as_dvec3().normalize_or_zero().as_vec3();
        let needs_axis = matches!(light.kind, LightKind::Spot | LightKind::Directional);
        let numbers = light.position_ws.is_finite()
            && light.intensity.is_finite()
            && light.intensity.min_element() >= 0.0
            && light.kind != LightKind::Triangle
            && !(light.range.is_nan() || light.cos_inner.is_nan() || light.cos_outer.is_nan());
        if !numbers || (needs_axis && axis == Vec3::ZERO) {
            let name = &source.node;
            parts
                .report
                .warn(format!("punctual light '{name}' has unusable numbers: left out"));
        } else if light.intensity == Vec3::ZERO || light.range <= 0.0 {
            black += 1;
        } else {
            light.normal_ws = if needs_axis { axis } else { Vec3::ZERO };
            light.cos_inner = light.cos_inner.max(light.cos_outer);
            light.set_power(radius);
            kept.push(index as u32);
        }
    }
    if black > 0 {
        parts
            .report
            .warn(format!("{black} punctual lights are black: left out"));
    }
    kept
}

/// All placed triangles whose material emits, in the order of [`Shading::lights`].
fn placed_emitters(parts: &SceneParts, shading: &Shading) -> Vec<PrimitiveId> {
    let mut placed = Vec::with_capacity(shading.lights.len());
    for (index, instance) in parts.instances.iter().enumerate() {
        let emitters = &shading.emitters[instance.mesh as usize];
        placed.extend(emitters.iter().map(|&triangle| PrimitiveId {
            instance: index as u32,
            triangle,
        }));
    }
    placed
}

/// Mean radiance of a triangle.
fn radiance(parts: &SceneParts, id: PrimitiveId) -> Vec3 {
    let mesh = &parts.meshes[parts.instances[id.instance as usize].mesh as usize];
    let material = &parts.materials[mesh.materials[id.triangle as usize] as usize];
    mean_emission(&parts.textures, material, mesh, id.triangle as usize)
}

fn is_black(parts: &SceneParts, id: PrimitiveId) -> bool {
    luminance(radiance(parts, id)) <= 0.0
}

fn triangle_light(parts: &SceneParts, id: PrimitiveId, radius: f64) -> Option<Light> {
    let instance = &parts.instances[id.instance as usize];
    let mesh = &parts.meshes[instance.mesh as usize];
    let material = &parts.materials[mesh.materials[id.triangle as usize] as usize];
    let local = mesh.corners(id.triangle as usize);
    let corners = if instance.identity {
        local
    } else {
        local.map(|p| instance.world_from_local.transform_point3(p))
    };
    let radiance = radiance(parts, id);
    let mut light = Light::triangle(corners, radiance, material.double_sided)?;
    if luminance(radiance) <= 0.0 || f64::from(light.area) < LEAST_AREA * radius * radius {
        return None;
    }
    if instance.world_from_local.matrix3.determinant() < 0.0 {
        light.normal_ws = -light.normal_ws;
    }
    light.textured = emission_varies(material, mesh);
    light.primitive = id;
    Some(light)
}

/// A Morton curve through a cube around the lights' centres.
struct Curve {
    least: DVec3,
    cells_per_metre: f64,
}

impl Curve {
    /// Cells per axis: 21 bits of each coordinate fill 63 bits.
    const CELLS: f64 = (1_u32 << 21) as f64;

    fn around<'a>(lights: impl Iterator<Item = &'a Light>) -> Self {
        let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for light in lights.filter(|light| light.kind != LightKind::Directional) {
            let center = light.center_ws().as_dvec3();
            (least, most) = (least.min(center), most.max(center));
        }
        let size = (most - least).max_element();
        Self {
            least,
            cells_per_metre: if size > 0.0 && size.is_finite() {
                Self::CELLS / size
            } else {
                0.0
            },
        }
    }

    /// Sort key: 0 for directional lights, 1 + the place on the curve for others.
    fn key(&self, light: &Light) -> u64 {
        if light.kind == LightKind::Directional {
            return 0;
        }
        let cell = (light.center_ws().as_dvec3() - self.least) * self.cells_per_metre;
        let [x, y, z] = cell.to_array().map(|c| spread(c.clamp(0.0, Self::CELLS - 1.0) as u64));
        1 + (x << 2 | y << 1 | z)
    }
}

/// Two zero bits after each of the lowest 21 bits.
fn spread(x: u64) -> u64 {
    let x = (x | x << 32) & 0x001f_0000_0000_ffff;
    let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}
