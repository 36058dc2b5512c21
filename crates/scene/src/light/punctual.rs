//! Point, spot and directional lights (`KHR_lights_punctual`).

use super::{Light, LightKind, LightPoint};
use crate::{PrimitiveId, luminance};
use glam::Vec3;
use std::f32::consts::PI;

impl Light {
    /// A point light of the given radiant intensity, which ends at `range` (infinity for none).
    pub fn point(position_ws: Vec3, radiant_intensity: Vec3, range: f32) -> Self {
        Self::punctual(LightKind::Point, position_ws, Vec3::ZERO, radiant_intensity, range)
    }

    /// A spot light along the unit vector `axis_ws`: full intensity within the angle of `cos_inner`, dark beyond that of
    /// `cos_outer`.
    pub fn spot(
        position_ws: Vec3,
        axis_ws: Vec3,
        cos_inner: f32,
        cos_outer: f32,
        radiant_intensity: Vec3,
        range: f32,
    ) -> Self {
        let mut light = Self::punctual(LightKind::Spot, position_ws, axis_ws, radiant_intensity, range);
        light.cos_inner = cos_inner.max(cos_outer);
        light.cos_outer = cos_outer;
        light.set_power(0.0);
        light
    }

    /// A light from infinitely far away that travels along the unit vector `direction_ws`, with the given irradiance on
    /// a surface that faces it. Its power depends on the scene; [`crate::Scene::new`] fills it in.
    pub fn directional(direction_ws: Vec3, irradiance: Vec3) -> Self {
        Self::punctual(
            LightKind::Directional,
            Vec3::ZERO,
            direction_ws,
            irradiance,
            f32::INFINITY,
        )
    }

    fn punctual(kind: LightKind, position_ws: Vec3, normal_ws: Vec3, intensity: Vec3, range: f32) -> Self {
        let mut light = Self {
            kind,
            double_sided: false,
            textured: false,
            position_ws,
            edge1_ws: Vec3::ZERO,
            edge2_ws: Vec3::ZERO,
            normal_ws,
            intensity,
            area: 0.0,
            range,
            cos_inner: 1.0,
            cos_outer: -1.0,
            power: 0.0,
            primitive: PrimitiveId::NONE,
        };
        light.set_power(0.0);
        light
    }

    /// Fills in the power of a delta light in a scene of the given radius.
    pub(super) fn set_power(&mut self, scene_radius: f32) {
        let per_intensity = match self.kind {
            LightKind::Triangle => return,
            LightKind::Point => 4.0 * PI,
            // The square of the ramp between the cones integrates to a third of its width.
            LightKind::Spot => 2.0 * PI * (1.0 - self.cos_inner + (self.cos_inner - self.cos_outer) / 3.0),
            LightKind::Directional => PI * scene_radius * scene_radius,
        };
        self.power = (per_intensity * luminance(self.intensity)).min(f32::MAX);
    }

    /// What arrives at `at_ws` from a delta light: the direction towards it and the irradiance on a surface that faces it.
    #[inline]
    pub(super) fn illuminate(&self, at_ws: Vec3) -> Option<LightPoint> {
        let (wi_ws, distance, radiance);
        if self.kind == LightKind::Directional {
            (wi_ws, distance, radiance) = (-self.normal_ws, f32::INFINITY, self.intensity);
        } else {
            let towards = self.position_ws - at_ws;
            let distance_sq = towards.length_squared();
            let inverse = 1.0 / distance_sq.sqrt();
            wi_ws = towards * inverse;
            distance = distance_sq * inverse;
            let cone = if self.kind == LightKind::Spot {
                self.cone(-wi_ws.dot(self.normal_ws))
            } else {
                1.0
            };
            radiance = self.intensity * (cone * self.window(distance_sq) * inverse * inverse);
        }
        // False for NaN, which a shading point at the very light gives.
        let usable = radiance.max_element() > 0.0 && radiance.is_finite() && wi_ws.is_finite();
        usable.then_some(LightPoint {
            wi_ws,
            distance,
            radiance,
            pdf_solid_angle: 1.0,
        })
    }

    /// Share of the intensity at an angle of the given cosine to the axis: the square of a linear ramp between the two
    /// cosines, as `KHR_lights_punctual` recommends. Differs: without its least width of 0.001, which would dim the middle of
    /// cones narrower than 2.6 degrees.
    #[inline]
    fn cone(&self, cosine: f32) -> f32 {
        let width = (self.cos_inner - self.cos_outer).max(1e-7);
        let ramp = ((cosine - self.cos_outer) / width).clamp(0.0, 1.0);
        ramp * ramp
    }

    /// Share of the light at this distance that `range` leaves: `KHR_lights_punctual`, range property, recommends
    /// 1 - (d / range)^4, at least 0.
    #[inline]
    fn window(&self, distance_sq: f32) -> f32 {
        if self.range == f32::INFINITY {
            return 1.0;
        }
        let ratio_sq = distance_sq / (self.range * self.range);
        (1.0 - ratio_sq * ratio_sq).max(0.0)
    }

    #[inline]
    pub(super) fn punctual_irradiance(&self, at_ws: Vec3, normal_ws: Vec3) -> f32 {
        let arriving = self.illuminate(at_ws);
        arriving.map_or(0.0, |point| {
            luminance(point.radiance) * point.wi_ws.dot(normal_ws).max(0.0)
        })
    }
}
