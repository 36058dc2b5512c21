//! `KHR_lights_punctual`.

use super::geometry::MAX_COORDINATE;
use super::json::{self, Checked, LightType};
use super::nodes::{Placed, label};
use super::source::Source;
use crate::{Light, LightKind, LightSource, PrimitiveId, Report, SceneError, luminance};
use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// The punctual lights of the placed nodes.
///
/// # Errors
/// [`SceneError::Invalid`] for a light that does not exist.
pub(super) fn read(
    source: &Source,
    placed: &[Placed],
    report: &mut Report,
) -> Result<Vec<(Light, LightSource)>, SceneError> {
    let lights: &[json::Light] = source.json.as_ref();
    let mut read = Vec::new();
    for node in placed {
        let json = &source.json.nodes[node.node];
        let extensions = json.extensions.as_ref();
        let Some(reference) = extensions.and_then(|e| e.khr_lights_punctual.as_ref()) else {
            continue;
        };
        let index = reference.light.value();
        let place = label(source, node.node);
        let light = lights
            .get(index)
            .ok_or_else(|| source.no_such(&place, "light", index, lights.len()))?;
        let name = light.name.clone().unwrap_or_else(|| format!("light {index}"));
        if let Some(record) = record(light, node, &format!("{place}, light '{name}'"), report) {
            let origin = LightSource {
                node: json.name.clone().unwrap_or(place),
                mesh: name,
                material: String::new(),
                triangle: 0,
            };
            read.push((record, origin));
        }
    }
    Ok(read)
}

fn record(json: &json::Light, node: &Placed, place: &str, report: &mut Report) -> Option<Light> {
    let kind = match json.type_ {
        Checked::Valid(LightType::Point) => LightKind::Point,
        Checked::Valid(LightType::Spot) => LightKind::Spot,
        Checked::Valid(LightType::Directional) => LightKind::Directional,
        Checked::Invalid => {
            report.ignore("punctual lights of an unknown type");
            return None;
        }
    };
    let intensity = Vec3::from(json.color) * json.intensity;
    let clean = Vec3::from(
        intensity
            .to_array()
            .map(|c| if c.is_finite() && c > 0.0 { c } else { 0.0 }),
    );
    if clean != intensity {
        report.warn(format!("{place}: intensity is negative or not finite, set to 0 there"));
    }
    if clean == Vec3::ZERO {
        report.warn(format!("{place}: intensity 0, left out"));
        return None;
    }
    let position_ws = node.world.translation.as_vec3();
    // Lights look along their local -z (KHR_lights_punctual, "Directional").
    let axis_ws = (-node.world.matrix3.z_axis).normalize_or_zero().as_vec3();
    if axis_ws == Vec3::ZERO && kind != LightKind::Point {
        report.warn(format!(
            "{place}: its node is scaled to nothing, so that it has no direction; left out"
        ));
        return None;
    }
    let near = position_ws.abs().max_element() <= MAX_COORDINATE;
    if !near && kind != LightKind::Directional {
        report.warn(format!("{place}: too far away, left out"));
        return None;
    }
    let range = match json.range {
        None => f32::INFINITY,
        Some(range) if range > 0.0 => range,
        Some(range) => {
            report.warn(format!("{place}: range {range}, taken as none"));
            f32::INFINITY
        }
    };
    let (cos_inner, cos_outer) = match kind {
        LightKind::Spot => cone(json, place, report),
        _ => (1.0, -1.0),
    };
    let radiant_intensity = luminance(clean);
    let power = match kind {
        LightKind::Point => 4.0 * PI * radiant_intensity,
        // The squared falloff of KHR_lights_punctual, integrated between the two angles, is a third.
        LightKind::Spot => 2.0 * PI * (1.0 - cos_inner + (cos_inner - cos_outer) / 3.0) * radiant_intensity,
        // Depends on the size of the scene: `Scene::new` fills it in.
        LightKind::Directional | LightKind::Triangle => 0.0,
    };
    Some(Light {
        kind,
        double_sided: false,
        textured: false,
        position_ws: if kind == LightKind::Directional {
            Vec3::ZERO
        } else {
            position_ws
        },
        edge1_ws: Vec3::ZERO,
        edge2_ws: Vec3::ZERO,
        normal_ws: if kind == LightKind::Point { Vec3::ZERO } else { axis_ws },
        intensity: clean,
        area: 0.0,
        range: if kind == LightKind::Directional {
            f32::INFINITY
        } else {
            range
        },
        cos_inner,
        cos_outer,
        power,
        primitive: PrimitiveId::NONE,
    })
}

/// Cosines of the inner and outer angle, 0 <= inner < outer <= pi/2.
fn cone(json: &json::Light, place: &str, report: &mut Report) -> (f32, f32) {
    let angles = json
        .spot
        .as_ref()
        .map(|spot| (spot.inner_cone_angle, spot.outer_cone_angle));
    let (inner, outer) = angles.unwrap_or((0.0, FRAC_PI_4));
    if inner >= 0.0 && inner < outer && outer <= FRAC_PI_2 + 1e-4 {
        return (inner.cos(), outer.min(FRAC_PI_2).cos().max(0.0));
    }
    let fixed_outer = if outer > 0.0 { outer.min(FRAC_PI_2) } else { FRAC_PI_4 };
    let fixed_inner = if inner > 0.0 {
        inner.min(0.99 * fixed_outer)
    } else {
        0.0
    };
    report.warn(format!(
        "{place}: cone angles {inner} and {outer} rad are not in order 0 <= inner < outer <= pi/2, \
         taken as {fixed_inner} and {fixed_outer}"
    ));
    (fixed_inner.cos(), fixed_outer.cos().max(0.0))
}
