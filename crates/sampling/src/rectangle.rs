//! Points on a rectangle, uniform by solid angle.

use crate::triangle::SphericalTriangle;
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::TAU;

/// A rectangle as seen from the origin, sampled uniformly by solid angle.
///
/// C. Urena, M. Fajardo, A. King, "An Area-Preserving Parametrization for Spherical Rectangles" (EGSR 2013). Differs: in
/// `f64`, because the sum of angles less 2 pi that the method inverts has no digits left below 1e-3 sr in `f32`; and the
/// reported solid angle is the sum of two triangles', accurate at any size.
#[derive(Clone, Copy, Debug)]
pub struct SphericalRectangle {
    /// Solid angle in sr. The density of [`SphericalRectangle::sample`] is its reciprocal.
    pub solid_angle: f32,
    axes: [DVec3; 3],
    /// Extent along the first axis.
    x: [f64; 2],
    /// Extent along the second axis.
    y: [f64; 2],
    /// Distance of the plane along the third axis; below 0.
    z: f64,
    normal_z: [f64; 2],
    /// 2 pi less the two angles at the far side.
    angle_offset: f64,
    angle_sum: f64,
}

impl SphericalRectangle {
    /// The rectangle with a corner at `corner` (relative to the shading point) and the sides `edge_x` and `edge_y`, which
    /// must be perpendicular to 1e-3. `None` if they are not, or if there is no solid angle.
    pub fn new(corner: Vec3, edge_x: Vec3, edge_y: Vec3) -> Option<Self> {
        let opposite = corner + edge_x + edge_y;
        let half = SphericalTriangle::new(corner, corner + edge_x, opposite)?.solid_angle;
        let solid_angle = half + SphericalTriangle::new(corner, opposite, corner + edge_y)?.solid_angle;

        let (corner, edge_x, edge_y) = (corner.as_dvec3(), edge_x.as_dvec3(), edge_y.as_dvec3());
        let (width, height) = (edge_x.length(), edge_y.length());
        if edge_x.dot(edge_y).abs() > 1e-3 * width * height {
            return None;
        }
        let (axis_x, axis_y) = (edge_x / width, edge_y / height);
        let mut axis_z = axis_x.cross(axis_y);
        let mut z = corner.dot(axis_z);
        if z > 0.0 {
            (z, axis_z) = (-z, -axis_z);
        }
        let x = [corner.dot(axis_x), corner.dot(axis_x) + width];
        let y = [corner.dot(axis_y), corner.dot(axis_y) + height];
        // z components of the outward normals of the four side planes; x and y components drop out of the dot products.
        let n = [-y[0], x[1], y[1], -x[0]].map(|extent| extent / extent.hypot(z));
        let angle = |a: f64, b: f64| (-a * b).clamp(-1.0, 1.0).acos();
        let angle_sum = angle(n[0], n[1]) + angle(n[1], n[2]) + angle(n[2], n[3]) + angle(n[3], n[0]) - TAU;
        let new = Self {
            solid_angle,
            axes: [axis_x, axis_y, axis_z],
            x,
            y,
            z,
            normal_z: [n[0], n[2]],
            angle_offset: TAU - angle(n[2], n[3]) - angle(n[3], n[0]),
            angle_sum: angle_sum.max(0.0),
        };
        (z < 0.0 && angle_sum.is_finite()).then_some(new)
    }

    /// A point on the rectangle, relative to the shading point, whose direction is uniform over the solid angle.
    pub fn sample(&self, u: Vec2) -> Vec3 {
        // Cut off the share u.x of the area by a plane through the origin parallel to the second axis.
        let (sin, cos) = (f64::from(u.x) * self.angle_sum + self.angle_offset).sin_cos();
        let f = (cos * self.normal_z[0] - self.normal_z[1]) / sin;
        let c = (1.0 / f.hypot(self.normal_z[0])).copysign(f).clamp(-1.0, 1.0);
        let x = -c * self.z / (1.0 - c * c).max(f64::MIN_POSITIVE).sqrt();
        // A NaN (0 / 0 at a rim seen edge-on) is clamped to the start.
        let x = x.max(self.x[0]).min(self.x[1]);
        // Along the cut, the sine of the elevation is uniform.
        let distance = x.hypot(self.z);
        let [h0, h1] = self.y.map(|y| y / distance.hypot(y));
        let h = h0 + f64::from(u.y) * (h1 - h0);
        let y = (h * distance / (1.0 - h * h).max(f64::MIN_POSITIVE).sqrt()).clamp(self.y[0], self.y[1]);
        (self.axes[0] * x + self.axes[1] * y + self.axes[2] * self.z).as_vec3()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::statistics::{chi_square_p, pooled_chi_square};
    use proptest::prelude::*;

    /// Solid angle of the axis-parallel rectangle from its corner below the origin, in closed form.
    fn corner_solid_angle(x: f64, y: f64, z: f64) -> f64 {
        (x * y / (z * (x * x + y * y + z * z).sqrt())).atan()
    }

    #[test]
    fn solid_angle_has_its_closed_form() {
        let rectangle = SphericalRectangle::new(Vec3::new(0.0, 0.0, 2.0), Vec3::X * 3.0, Vec3::Y).unwrap();
        assert!((f64::from(rectangle.solid_angle) - corner_solid_angle(3.0, 1.0, 2.0)).abs() < 1e-6);
        assert!((rectangle.angle_sum - corner_solid_angle(3.0, 1.0, 2.0)).abs() < 1e-12);
        let face = SphericalRectangle::new(Vec3::new(-1.0, -1.0, -1.0), Vec3::X * 2.0, Vec3::Y * 2.0).unwrap();
        assert!(
            (f64::from(face.solid_angle) - TAU / 3.0).abs() < 1e-6,
            "a face of a cube is a sixth of the sphere"
        );
    }

    #[test]
    fn degenerate_rectangles_are_refused() {
        assert!(SphericalRectangle::new(Vec3::X, Vec3::X, Vec3::Y).is_none(), "edge-on");
        assert!(SphericalRectangle::new(Vec3::Z, Vec3::X, Vec3::ZERO).is_none());
        assert!(
            SphericalRectangle::new(Vec3::Z, Vec3::X, Vec3::X + Vec3::Y).is_none(),
            "not a rectangle"
        );
        assert!(SphericalRectangle::new(Vec3::NAN, Vec3::X, Vec3::Y).is_none());
    }

    /// p-value of samples against the exact solid angles of 8 x 8 parts.
    fn uniformity_p(corner: Vec3, width: f32, height: f32, seed: u64) -> f64 {
        let rectangle = SphericalRectangle::new(corner, Vec3::X * width, Vec3::Y * height).unwrap();
        let draws = 1 << 17;
        let random = Random::new(seed, 0, 0);
        let mut counts = vec![0_u64; 64];
        for i in 0..draws {
            let p = rectangle.sample(random.vec2(2 * i)) - corner;
            let bin = |x: f32, size: f32| ((x / size * 8.0).max(0.0) as usize).min(7);
            counts[bin(p.x, width) * 8 + bin(p.y, height)] += 1;
        }
        let z = f64::from(corner.z);
        let at = |i: usize, j: usize| {
            corner_solid_angle(
                f64::from(corner.x) + f64::from(width) * i as f64 / 8.0,
                f64::from(corner.y) + f64::from(height) * j as f64 / 8.0,
                z,
            )
        };
        let mut expected: Vec<f64> = (0..64)
            .map(|k| (k / 8, k % 8))
            .map(|(i, j)| at(i + 1, j + 1) - at(i, j + 1) - at(i + 1, j) + at(i, j))
            .collect();
        let sum: f64 = expected.iter().sum();
        expected.iter_mut().for_each(|e| *e *= f64::from(draws) / sum);
        let (statistic, dof) = pooled_chi_square(&counts, &expected, 5.0);
        chi_square_p(statistic, dof)
    }

    /// All together fail once in 1,000 seeds.
    #[test]
    fn samples_are_uniform_by_solid_angle() {
        let limit = 1e-3 / 4.0;
        assert!(uniformity_p(Vec3::new(-1.0, -2.0, 1.0), 2.0, 3.0, 1) > limit);
        assert!(uniformity_p(Vec3::new(0.5, 1.0, 0.05), 4.0, 3.0, 2) > limit);
        assert!(uniformity_p(Vec3::new(3.0, -1.0, 5.0), 0.01, 0.02, 3) > limit);
        assert!(uniformity_p(Vec3::new(-50.0, -0.5, 1.0), 100.0, 1.0, 4) > limit);
    }

    proptest! {
        #[test]
        fn samples_lie_on_the_rectangle(
            p in prop::array::uniform3(-1.0_f32..1.0), size in prop::array::uniform2(1e-4_f32..100.0),
            u in prop::array::uniform2(prop_oneof![Just(0.0_f32), Just(1.0 - f32::EPSILON / 2.0), 0.0_f32..1.0]),
        ) {
            let corner = Vec3::from_array(p);
            if let Some(rectangle) = SphericalRectangle::new(corner, Vec3::X * size[0], Vec3::Y * size[1]) {
                let q = rectangle.sample(Vec2::from_array(u));
                let slack = 1e-5 * (1.0 + size[0] + size[1]);
                prop_assert!((q.z - corner.z).abs() < slack);
                prop_assert!(q.x >= corner.x - slack && q.x <= corner.x + size[0] + slack);
                prop_assert!(q.y >= corner.y - slack && q.y <= corner.y + size[1] + slack);
            }
        }
    }
}
