//! Lights seen from the origin, as maps of the unit square.

use super::reflection::around;
use crate::rectangle::SphericalRectangle;
use glam::{DVec3, Vec2};
use std::f64::consts::{PI, TAU};

/// An area light, seen from the origin.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shape {
    /// Shines to both sides.
    Rectangle {
        corner: DVec3,
        edges: [DVec3; 2],
        spherical: SphericalRectangle,
    },
    /// Its outside shines; the origin is outside.
    Sphere { center: DVec3, radius: f64 },
}

/// A place on a light.
pub(super) struct Place {
    /// From the origin to it, unit.
    pub(super) wi: DVec3,
    /// Solid angle, seen from the origin, per area of the unit square: `cos(theta') A / d^2`; 0 where the light faces away.
    pub(super) solid_angle_per_square: f64,
}

impl Shape {
    /// A rectangle with its centre there, perpendicular to `normal` (unit); `None` if it is seen from the edge.
    pub(super) fn rectangle(center: DVec3, normal: DVec3, [width, height]: [f64; 2]) -> Option<Self> {
        let (a, b) = normal.any_orthonormal_pair();
        let edges = [a * width, b * height];
        let corner = center - 0.5 * (edges[0] + edges[1]);
        let spherical = SphericalRectangle::new(corner.as_vec3(), edges[0].as_vec3(), edges[1].as_vec3())?;
        Some(Self::Rectangle {
            corner,
            edges,
            spherical,
        })
    }

    /// Area that shines.
    pub(super) fn area(&self) -> f64 {
        match self {
            Self::Rectangle { edges, .. } => edges[0].length() * edges[1].length(),
            Self::Sphere { radius, .. } => 4.0 * PI * radius * radius,
        }
    }

    /// The place that `x` of the unit square stands for; equal areas of the square are equal areas of the light.
    pub(super) fn place(&self, x: [f64; 2]) -> Place {
        let (position, normal) = match self {
            Self::Rectangle { corner, edges, .. } => {
                let position = *corner + edges[0] * x[0] + edges[1] * x[1];
                let normal = edges[0].cross(edges[1]).normalize();
                (position, if normal.dot(position) > 0.0 { -normal } else { normal })
            }
            Self::Sphere { center, radius } => {
                let normal = around(DVec3::Z, 1.0 - 2.0 * x[0], x[1]);
                (*center + normal * *radius, normal)
            }
        };
        let wi = position.normalize();
        let cos = -normal.dot(wi);
        Place {
            wi,
            solid_angle_per_square: cos.max(0.0) * self.area() / position.length_squared(),
        }
    }

    /// The point of the square for a `position` on the light.
    fn square(&self, position: DVec3) -> [f64; 2] {
        match self {
            Self::Rectangle { corner, edges, .. } => edges.map(|edge| {
                let along = (position - *corner).dot(edge) / edge.length_squared();
                along.clamp(0.0, 1.0)
            }),
            Self::Sphere { center, radius } => {
                let normal = (position - *center) / *radius;
                let (a, b) = DVec3::Z.any_orthonormal_pair();
                let turn = normal.dot(b).atan2(normal.dot(a)) / TAU;
                [(0.5 - 0.5 * normal.z).clamp(0.0, 1.0), turn.rem_euclid(1.0)]
            }
        }
    }

    /// Solid angle in which the light is seen, sr.
    pub(super) fn solid_angle(&self) -> f64 {
        match self {
            Self::Rectangle { spherical, .. } => f64::from(spherical.solid_angle),
            Self::Sphere { .. } => TAU * self.versine(),
        }
    }

    /// 1 minus the cosine of the half-angle of the cone in which a sphere is seen; 0 for a rectangle.
    fn versine(&self) -> f64 {
        match self {
            Self::Rectangle { .. } => 0.0,
            Self::Sphere { center, radius } => {
                let sin_sq = radius * radius / center.length_squared();
                sin_sq / (1.0 + (1.0 - sin_sq).sqrt())
            }
        }
    }

    /// The point of the square for a direction that is uniform over the solid angle.
    pub(super) fn sample_solid_angle(&self, u: [f64; 2]) -> [f64; 2] {
        match self {
            Self::Rectangle { spherical, .. } => {
                let position = spherical.sample(Vec2::new(u[0] as f32, u[1] as f32));
                self.square(position.as_dvec3())
            }
            Self::Sphere { center, .. } => {
                let cos = 1.0 - u[0] * self.versine();
                let wi = around(center.normalize(), cos, u[1]);
                // A direction along the rim may miss by rounding: then the rim it is.
                self.hit(wi).unwrap_or_else(|| self.square(wi * center.dot(wi)))
            }
        }
    }

    /// The point of the square where the light is first met along `wi`, if it is.
    pub(super) fn hit(&self, wi: DVec3) -> Option<[f64; 2]> {
        match self {
            Self::Rectangle { corner, edges, .. } => {
                let normal = edges[0].cross(edges[1]);
                let distance = normal.dot(*corner) / normal.dot(wi);
                let position = wi * distance;
                let inside = |edge: &DVec3| (0.0..=edge.length_squared()).contains(&(position - *corner).dot(*edge));
                (distance > 0.0 && edges.iter().all(inside)).then(|| self.square(position))
            }
            Self::Sphere { center, radius } => {
                let nearest = center.dot(wi);
                let below_rim = radius * radius - (center.length_squared() - nearest * nearest);
                (below_rim >= 0.0 && nearest > 0.0).then(|| self.square(wi * (nearest - below_rim.sqrt())))
            }
        }
    }

    /// The direction in the visible part of the light that `[u, turn]` stands for, uniform by solid angle; spheres only.
    pub(super) fn cone_direction(center: DVec3, radius: f64, u: [f64; 2]) -> DVec3 {
        let sphere = Self::Sphere { center, radius };
        around(center.normalize(), 1.0 - u[0] * sphere.versine(), u[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shapes() -> [Shape; 2] {
        let center = DVec3::new(0.6, -0.3, 1.5);
        [
            Shape::rectangle(center, DVec3::new(0.6, 0.0, -0.8), [0.7, 0.4]).unwrap(),
            Shape::Sphere { center, radius: 0.8 },
        ]
    }

    #[test]
    fn places_are_hit_where_they_are_seen() {
        for shape in shapes() {
            for i in 0..100 {
                let x = [f64::from(i % 10) / 10.0 + 0.05, f64::from(i / 10) / 10.0 + 0.05];
                let place = shape.place(x);
                if place.solid_angle_per_square > 1e-3 {
                    let hit = shape.hit(place.wi).expect("the light is there");
                    assert!((hit[0] - x[0]).abs() + (hit[1] - x[1]).abs() < 1e-9, "{x:?} {hit:?}");
                }
            }
        }
    }

    /// The mean of the Jacobian over the square is the solid angle.
    #[test]
    fn solid_angles_agree_with_their_jacobian() {
        for shape in shapes() {
            let m = 1000;
            let jacobian = |i: u32| {
                let x = [i % m, i / m].map(|k| (f64::from(k) + 0.5) / f64::from(m));
                shape.place(x).solid_angle_per_square
            };
            let mean = (0..m * m).map(jacobian).sum::<f64>() / f64::from(m * m);
            assert!(
                (mean / shape.solid_angle() - 1.0).abs() < 1e-5,
                "{mean} {}",
                shape.solid_angle()
            );
        }
    }
}
