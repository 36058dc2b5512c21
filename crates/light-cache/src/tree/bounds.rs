//! What is known about a light, or a group of lights, without looking at each: where, which way, how much.

use glam::Vec3;
use scene::{Light, LightKind, luminance};
use std::f32::consts::{FRAC_PI_2, PI};

/// Directions: every emitter's axis lies within `theta_o` of `axis`, and it emits up to `theta_e` beyond (Conty Estevez and Kulla 2018, section 4.1).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cone {
    /// Unit axis.
    pub(crate) axis: Vec3,
    /// Half angle of the axes, radians, in \[0, pi\].
    pub(crate) theta_o: f32,
    /// Half angle of the emission around each axis, radians.
    pub(crate) theta_e: f32,
}

impl Cone {
    /// Every direction.
    const SPHERE: Self = Self {
        axis: Vec3::Z,
        theta_o: PI,
        theta_e: FRAC_PI_2,
    };

    /// The cone of one light.
    fn of(light: &Light) -> Self {
        match light.kind {
            LightKind::Triangle if !light.double_sided => Self {
                axis: light.normal_ws,
                theta_o: 0.0,
                theta_e: FRAC_PI_2,
            },
            LightKind::Spot => {
                let outer = light.cos_outer.clamp(-1.0, 1.0).acos();
                let inner = light.cos_inner.clamp(-1.0, 1.0).acos().min(outer);
                Self {
                    axis: light.normal_ws,
                    theta_o: inner,
                    theta_e: outer - inner,
                }
            }
            _ => Self::SPHERE,
        }
    }

    /// A cone around both (Conty Estevez and Kulla 2018, appendix).
    fn union(self, other: Self) -> Self {
        let (a, b) = if self.theta_o >= other.theta_o {
            (self, other)
        } else {
            (other, self)
        };
        let theta_e = a.theta_e.max(b.theta_e);
        // f64: the angle between nearly parallel axes must not come out too small.
        let between = f64::from(a.axis.cross(b.axis).length()).atan2(f64::from(a.axis.dot(b.axis))) as f32;
        if (between + b.theta_o).min(PI) <= a.theta_o {
            return Self { theta_e, ..a };
        }
        let theta_o = 0.5 * (a.theta_o + between + b.theta_o);
        if theta_o >= PI {
            return Self {
                theta_e,
                ..Self::SPHERE
            };
        }
        // The axis turns from `a` towards `b`; across if they are opposite.
        let across = (b.axis - a.axis * a.axis.dot(b.axis)).normalize_or(a.axis.any_orthonormal_vector());
        let turn = theta_o - a.theta_o;
        Self {
            axis: (a.axis * turn.cos() + across * turn.sin()).normalize_or(a.axis),
            theta_o,
            theta_e,
        }
    }
}

/// Bounds of a group of lights.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    /// Lower corner of the box around them.
    pub(crate) min: Vec3,
    /// Upper corner.
    pub(crate) max: Vec3,
    /// Where they send light.
    pub(crate) cone: Cone,
}

impl Bounds {
    /// Bounds of one light.
    pub(crate) fn of(light: &Light) -> Self {
        let first = light.position_ws;
        let (min, max) = if light.kind == LightKind::Triangle {
            let (second, third) = (first + light.edge1_ws, first + light.edge2_ws);
            (first.min(second).min(third), first.max(second).max(third))
        } else {
            (first, first)
        };
        Self {
            min,
            max,
            cone: Cone::of(light),
        }
    }

    /// Middle of the box.
    pub(crate) fn center(&self) -> Vec3 {
        self.min + 0.5 * (self.max - self.min)
    }

    /// Bounds of both.
    pub(crate) fn union(&self, other: &Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
            cone: self.cone.union(other.cone),
        }
    }
}

/// How a leaf's light sends out what it has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(crate) enum Emission {
    /// From one side of a small flat surface.
    OneSided = 0,
    /// From both.
    TwoSided = 1,
    /// From a point, perhaps within a cone.
    Point = 2,
}

/// What importance needs to know about one light, in three quarters of a cache line.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[repr(C)]
pub(crate) struct LeafLight {
    /// Centroid or position, world space.
    pub(crate) center: Vec3,
    /// Distance of the farthest corner from `center`.
    pub(crate) radius: f32,
    /// Normal or spot axis.
    pub(crate) axis: Vec3,
    /// Luminance of radiance x area or of radiant intensity, in units of the strongest light; times what was learned.
    pub(crate) weight: f32,
    /// Spot: the angular attenuation is clamp(`cone_scale` cos + `cone_offset`)^2 (`KHR_lights_punctual`).
    pub(crate) cone_scale: f32,
    /// See `cone_scale`.
    pub(crate) cone_offset: f32,
    /// 1 / range^2; 0 if the light has no end.
    pub(crate) inverse_range_sq: f32,
    /// Index of the light, and its [`Emission`] in the upper two bits.
    tag: u32,
}

/// Lights that differ by more than this factor in strength are treated as if they did not: keeps products in range.
const MIN_RELATIVE_WEIGHT: f64 = 1e-18;

/// What a light's weight is measured by: luminance of radiance x area, of radiant intensity, or of irradiance.
pub(crate) fn strength(light: &Light) -> f64 {
    let per_unit = f64::from(luminance(light.intensity.abs()));
    match light.kind {
        LightKind::Triangle => per_unit * f64::from(light.area),
        _ => per_unit,
    }
}

/// `strength` in units of the strongest, kept within a range in which `f32` products are safe.
pub(crate) fn relative_weight(strength: f64, strongest: f64) -> f32 {
    if strength > 0.0 && strongest > 0.0 {
        (strength / strongest).clamp(MIN_RELATIVE_WEIGHT, 1.0) as f32
    } else {
        0.0
    }
}

impl LeafLight {
    const INDEX_BITS: u32 = 30;

    /// The record of light `index`; `strongest` is the largest [`strength`] in the scene.
    pub(crate) fn new(light: &Light, index: u32, strongest: f64) -> Self {
        let center = light.center_ws();
        let (emission, radius) = match light.kind {
            LightKind::Triangle => {
                let corners = [
                    light.position_ws,
                    light.position_ws + light.edge1_ws,
                    light.position_ws + light.edge2_ws,
                ];
                let radius_sq = corners.iter().map(|c| c.distance_squared(center)).fold(0.0, f32::max);
                let emission = if light.double_sided {
                    Emission::TwoSided
                } else {
                    Emission::OneSided
                };
                // A little more than exact, so that rounding never hides a corner.
                (emission, radius_sq.sqrt() * 1.001)
            }
            _ => (Emission::Point, 0.0),
        };
        let (cone_scale, cone_offset) = if light.kind == LightKind::Spot {
            let scale = 1.0 / (light.cos_inner - light.cos_outer).max(1e-3);
            (scale, -light.cos_outer * scale)
        } else {
            (0.0, 1.0)
        };
        let inverse_range = if light.range.is_finite() && light.range > 0.0 && emission == Emission::Point {
            1.0 / light.range
        } else {
            0.0
        };
        Self {
            center,
            radius,
            axis: light.normal_ws,
            weight: relative_weight(strength(light), strongest),
            cone_scale,
            cone_offset,
            inverse_range_sq: inverse_range * inverse_range,
            tag: index | ((emission as u32) << Self::INDEX_BITS),
        }
    }

    /// The same light with another weight.
    pub(crate) fn with_weight(self, weight: f32) -> Self {
        Self { weight, ..self }
    }

    /// Index of the light in the scene.
    #[inline]
    pub(crate) fn index(&self) -> u32 {
        self.tag & ((1 << Self::INDEX_BITS) - 1)
    }

    /// Index and [`Emission`] as they are stored.
    pub(crate) fn tag(&self) -> u32 {
        self.tag
    }

    /// A point light's strength at `distance`, `cos_axis` off its axis, relative to that on the axis without an end (`KHR_lights_punctual`).
    /// Zero only where the light has ended; a little more than exact next to there.
    #[inline]
    pub(crate) fn attenuation(&self, distance: f32, cos_axis: f32) -> f32 {
        let cone = cos_axis * self.cone_scale + self.cone_offset;
        let relative_sq = distance * distance * self.inverse_range_sq;
        let window = 1.0 - relative_sq * relative_sq;
        if cone <= -1e-4 * self.cone_scale || window <= -1e-4 {
            return 0.0;
        }
        let cone = cone.clamp(0.03, 1.0);
        cone * cone * window.clamp(1e-4, 1.0)
    }

    /// How it emits.
    #[inline]
    pub(crate) fn emission(&self) -> Emission {
        match self.tag >> Self::INDEX_BITS {
            0 => Emission::OneSided,
            1 => Emission::TwoSided,
            _ => Emission::Point,
        }
    }
}
