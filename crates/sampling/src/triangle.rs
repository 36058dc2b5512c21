//! Points on a triangle, by area and by solid angle.

use crate::hemisphere::unit_circle;
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_PI_2, PI};

/// Barycentric coordinates `(b1, b2)` of a point uniform by area; the third is `1 - b1 - b2`.
///
/// E. Heitz, "A Low-Distortion Map Between Triangle and Square" (2019): unlike the square-root map it keeps strata
/// compact, and it needs no root.
#[inline]
pub fn uniform_triangle(u: Vec2) -> Vec2 {
    if u.y > u.x {
        let b1 = 0.5 * u.x;
        Vec2::new(b1, u.y - b1)
    } else {
        let b2 = 0.5 * u.y;
        Vec2::new(u.x - b2, b2)
    }
}

/// The angle of `(x, y)` in `[0, pi]` for `y` at least 0, to 3e-7 relative; a third of the cost of the library's. NaN for
/// `(0, 0)`. The polynomial interpolates `atan(z) / z` in `z^2` at the Chebyshev nodes of [0, 1].
#[inline]
fn atan2_upper(y: f32, x: f32) -> f32 {
    const SERIES: [f32; 8] = [
        0.999_999_9,
        -0.333_318_13,
        0.199_669_62,
        -0.140_032_9,
        0.098_688_655,
        -0.058_829_753,
        0.023_780_52,
        -0.004_559_792,
    ];
    let steep = y > x.abs();
    let z = if steep { x.abs() / y } else { y / x.abs() };
    let z_sq = z * z;
    let angle = z * SERIES.iter().rev().fold(0.0, |sum, &c| sum * z_sq + c);
    let first_quadrant = if steep { FRAC_PI_2 - angle } else { angle };
    if x < 0.0 { PI - first_quadrant } else { first_quadrant }
}

/// A triangle as seen from the origin, sampled uniformly by solid angle.
///
/// J. Arvo, "Stratified Sampling of Spherical Triangles" (SIGGRAPH 1995). Differs: his formulas subtract nearly equal
/// numbers when the triangle is small. Here the solid angle comes from the determinant of the EDGE vectors (Van Oosterom
/// and Strackee 1983, with one vertex and two edges, good to 1e-6 relative down to 1e-8 sr in `f32`); the vertex that cuts off a
/// given area comes from the half-angle form `tan(area / 2) = t m sin(alpha) / (1 + t m cos(alpha))` of the triangle with
/// sides `2 atan(t)` and `2 atan(m)` around the angle `alpha`, solved for `t`; and positions are built up from differences of
/// the unit vertices.
#[derive(Clone, Copy, Debug)]
pub struct SphericalTriangle {
    /// Solid angle in sr, in `(0, 2 pi]`. The density of [`SphericalTriangle::sample`] is its reciprocal.
    pub solid_angle: f32,
    /// Unit direction to the first vertex.
    a: Vec3,
    /// Unit direction to the second vertex, minus `a`.
    b_minus_a: Vec3,
    /// Unit tangent at `a` towards the third vertex.
    tangent_ac: Vec3,
    /// Tangent of half the side from `a` to the second vertex, as numerator and denominator.
    half_ab: Vec2,
    /// The same of the side from `a` to the third vertex.
    half_ac: Vec2,
    sin_alpha: f32,
    cos_alpha: f32,
}

impl SphericalTriangle {
    /// The triangle with vertices `a`, `b`, `c` relative to the shading point, in either winding. `None` if it has no
    /// solid angle: degenerate, seen edge-on, touching the origin, or not finite.
    #[inline]
    pub fn new(a: Vec3, b: Vec3, c: Vec3) -> Option<Self> {
        // In units of the distance of `a`, so that no product below leaves the range of single precision.
        let unit = 1.0 / a.length();
        let (a, edge_ab, edge_ac) = (a * unit, (b - a) * unit, (c - a) * unit);
        let (b, c) = (a + edge_ab, a + edge_ac);
        let (length_b, length_c) = (b.length(), c.length());
        let (dot_ab, dot_ac) = (a.dot(b), a.dot(c));
        let determinant = a.dot(edge_ab.cross(edge_ac)).abs();
        let denominator = length_b * length_c + b.dot(c) + dot_ab * length_c + dot_ac * length_b;
        let solid_angle = 2.0 * atan2_upper(determinant, denominator);
        // Normals of the planes through the sides that meet at `a`; from edges, since `a x b` cancels when they are close.
        let (normal_ab, normal_ac) = (a.cross(edge_ab), a.cross(edge_ac));
        let (sin_ab, sin_ac) = (normal_ab.length(), normal_ac.length());
        let per_normals = 1.0 / (sin_ab * sin_ac);
        if !(solid_angle > 0.0 && per_normals > 0.0 && per_normals < f32::INFINITY) {
            return None;
        }
        // b / |b| - a without the cancellation of two rounded unit vectors.
        let per_lengths = 1.0 / (length_b * (1.0 + length_b));
        let length_change = edge_ab.dot(a + b) * (per_lengths * length_b);
        let b_minus_a = (edge_ab - a * length_change) * (per_lengths * (1.0 + length_b));
        Some(Self {
            solid_angle,
            a,
            b_minus_a,
            tangent_ac: normal_ac.cross(a) * (sin_ab * per_normals),
            half_ab: Vec2::new(sin_ab, length_b + dot_ab),
            half_ac: Vec2::new(sin_ac, length_c + dot_ac),
            sin_alpha: determinant * per_normals,
            cos_alpha: normal_ab.dot(normal_ac) * per_normals,
        })
    }

    /// A unit direction uniform over the solid angle. Strata of `u` are mapped to connected parts of the triangle.
    #[inline]
    pub fn sample(&self, u: Vec2) -> Vec3 {
        // Cut off the share u.x of the area by a great circle from b to a point d on the side from a to c.
        let half = unit_circle(self.solid_angle * u.x * (0.25 / PI));
        let (sin_half, cos_half) = (half.y, half.x);
        let angle_rest = (self.sin_alpha * cos_half - self.cos_alpha * sin_half).max(0.0);
        let mut t = Vec2::new(sin_half * self.half_ab.y, angle_rest * self.half_ab.x);
        // Rounding must not carry d beyond c.
        if t.x * self.half_ac.y > t.y * self.half_ac.x {
            t = self.half_ac;
        }
        let scale = 2.0 * t.x / t.length_squared().max(f32::MIN_POSITIVE);
        let (versine_ad, sin_ad) = (scale * t.x, scale * t.y);
        let d_minus_b = self.tangent_ac * sin_ad - self.a * versine_ad - self.b_minus_a;
        // Then go the distance along the arc from b to d at which the cosine has covered the share u.y.
        let b = self.a + self.b_minus_a;
        let versine_bd = 0.5 * d_minus_b.length_squared();
        let tangent = (d_minus_b + b * versine_bd).normalize_or_zero();
        let versine = u.y * versine_bd;
        let sine = (versine * (2.0 - versine)).max(0.0).sqrt();
        (b * (1.0 - versine) + tangent * sine).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::statistics::{chi_square_p, pooled_chi_square};
    use glam::DVec3;
    use proptest::prelude::*;

    /// Solid angle in f64, by the same identity.
    fn solid_angle_f64(a: DVec3, b: DVec3, c: DVec3) -> f64 {
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + a.dot(c) * lb;
        2.0 * a.dot((b - a).cross(c - a)).abs().atan2(denominator)
    }

    fn unit_vector(random: &Random, d: u32) -> Vec3 {
        crate::hemisphere::uniform_sphere(random.vec2(d))
    }

    #[test]
    fn angles_agree_with_the_library() {
        for i in 0..=20_000 {
            let exact = std::f64::consts::PI * f64::from(i) / 20_000.0;
            for length in [1e-15, 1.0, 1e15] {
                let (y, x) = ((exact.sin().max(0.0) * length) as f32, (exact.cos() * length) as f32);
                let reference = f64::from(y).atan2(f64::from(x));
                assert!(
                    (f64::from(atan2_upper(y, x)) - reference).abs() <= 4e-7 * reference,
                    "{exact}"
                );
            }
        }
        assert!(atan2_upper(0.0, 0.0).is_nan());
    }

    #[test]
    fn octant_is_half_pi() {
        let triangle = SphericalTriangle::new(Vec3::X * 3.0, Vec3::Y * 0.1, Vec3::Z).unwrap();
        assert!((triangle.solid_angle - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
    }

    #[test]
    fn solid_angles_agree_with_f64_down_to_tiny_ones() {
        for i in 0..3000 {
            let random = Random::new(11, i, 0);
            let size = 10_f32.powf(-4.3 * random.f32(0));
            let distance = 10_f32.powf(6.0 * random.f32(1) - 3.0);
            let centre = unit_vector(&random, 2);
            let [a, b, c] = [4, 6, 8].map(|d| (centre + unit_vector(&random, d) * size) * distance);
            let exact = solid_angle_f64(a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
            // Slivers lose digits to the rounding of their vertices' differences, in proportion to how flat they are.
            let fatness = exact / f64::from(size * size);
            if fatness < 0.05 {
                continue;
            }
            let triangle = SphericalTriangle::new(a, b, c).unwrap();
            let error = (f64::from(triangle.solid_angle) / exact - 1.0).abs();
            assert!(error < 1e-5, "{exact} sr: relative error {error}");
        }
    }

    #[test]
    fn degenerate_triangles_are_refused() {
        let v = Vec3::new(1.0, 2.0, 3.0);
        assert!(SphericalTriangle::new(v, v, v).is_none());
        assert!(SphericalTriangle::new(v, v * 2.0, v * 3.0).is_none());
        assert!(SphericalTriangle::new(Vec3::ZERO, Vec3::X, Vec3::Y).is_none());
        assert!(SphericalTriangle::new(v, Vec3::NAN, Vec3::Y).is_none());
        assert!(SphericalTriangle::new(v, Vec3::INFINITY, Vec3::Y).is_none());
    }

    /// p-value of samples against the exact solid angles of 16 x 4 parts. The parts come from subdividing the flat
    /// triangle, the counts from where the sampled rays pierce it: nothing is shared with the sampler.
    fn uniformity_p(a: Vec3, b: Vec3, c: Vec3, seed: u64) -> f64 {
        let triangle = SphericalTriangle::new(a, b, c).unwrap();
        let (o, e1, e2) = (a.as_dvec3(), (b - a).as_dvec3(), (c - a).as_dvec3());
        let normal = e1.cross(e2);
        let n = 8;
        let cell = |i: f64, j: f64| o + e1 * (i / n as f64) + e2 * (j / n as f64);
        let mut expected = vec![0.0; 2 * n * n];
        for i in 0..n {
            for j in 0..n - i {
                let (x, y) = (i as f64, j as f64);
                expected[2 * (i * n + j)] = solid_angle_f64(cell(x, y), cell(x + 1.0, y), cell(x, y + 1.0));
                if i + j + 1 < n {
                    expected[2 * (i * n + j) + 1] =
                        solid_angle_f64(cell(x + 1.0, y), cell(x + 1.0, y + 1.0), cell(x, y + 1.0));
                }
            }
        }
        let draws = 1 << 17;
        let whole: f64 = expected.iter().sum();
        expected.iter_mut().for_each(|e| *e *= f64::from(draws) / whole);
        let random = Random::new(seed, 0, 0);
        let mut counts = vec![0_u64; expected.len()];
        for k in 0..draws {
            let direction = triangle.sample(random.vec2(2 * k)).as_dvec3();
            let hit = direction * (normal.dot(o) / normal.dot(direction)) - o;
            let b1 = hit.cross(e2).dot(normal) / normal.length_squared();
            let b2 = e1.cross(hit).dot(normal) / normal.length_squared();
            // A sample may miss by rounding; it belongs to the nearest part.
            let (x, y) = (b1.max(0.0) * n as f64, b2.max(0.0) * n as f64);
            let (i, j) = ((x as usize).min(n - 1), (y as usize).min(n - 1));
            let j = j.min(n - 1 - i);
            let upper = i + j + 1 < n && x.fract() + y.fract() > 1.0;
            counts[2 * (i * n + j) + usize::from(upper)] += 1;
        }
        let (statistic, dof) = pooled_chi_square(&counts, &expected, 5.0);
        chi_square_p(statistic, dof)
    }

    /// All together fail once in 1,000 seeds.
    #[test]
    fn samples_are_uniform_by_solid_angle() {
        let limit = 1e-3 / 6.0;
        let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
        assert!(uniformity_p(x, y, z, 1) > limit, "octant");
        assert!(
            uniformity_p(x + z * 0.01, y + z * 0.01, -x - y + z * 0.01, 2) > limit,
            "nearly a hemisphere"
        );
        assert!(
            uniformity_p(z * 5.0 + x, z * 5.0 + y, z * 5.0 - x, 3) > limit,
            "ordinary"
        );
        assert!(
            uniformity_p(z * 9.0, z * 9.0 + x * 0.01, z * 9.0 + y * 0.01, 4) > limit,
            "small"
        );
        assert!(uniformity_p(z, z + x * 100.0, z + y * 0.3, 5) > limit, "long");
        assert!(
            uniformity_p(
                x * 3.0 + z * 0.02,
                x * 5.0 + z * 0.1 + y,
                x * 4.0 - y * 2.0 + z * 0.05,
                6
            ) > limit,
            "grazing"
        );
    }

    /// All together fail once in 1,000 seeds.
    #[test]
    fn area_samples_are_uniform() {
        let random = Random::new(5, 0, 0);
        let mut moments = [crate::Moments::default(); 3];
        for i in 0..1 << 16 {
            let b = uniform_triangle(random.vec2(2 * i));
            assert!(b.min_element() >= 0.0 && b.x + b.y <= 1.0);
            // Mean of each barycentric coordinate 1/3, of the product of two 1/12.
            moments[0].push(f64::from(b.x));
            moments[1].push(f64::from(b.y));
            moments[2].push(f64::from(b.x * b.y));
        }
        for (m, expected) in moments.iter().zip([1.0 / 3.0, 1.0 / 3.0, 1.0 / 12.0]) {
            let z = (m.mean() - expected) / m.standard_error();
            assert!(crate::statistics::normal_p_two_sided(z) > 1e-3 / 3.0);
        }
    }

    proptest! {
        #[test]
        fn samples_stay_finite_and_unit(
            p in prop::array::uniform9(-1.0_f32..1.0), scale in -15_i32..15,
            u in prop::array::uniform2(prop_oneof![Just(0.0_f32), Just(1.0 - f32::EPSILON / 2.0), 0.0_f32..1.0]),
        ) {
            let s = 10_f32.powi(scale);
            let vertices = [Vec3::new(p[0], p[1], p[2]) * s, Vec3::new(p[3], p[4], p[5]) * s, Vec3::new(p[6], p[7], p[8]) * s];
            if let Some(triangle) = SphericalTriangle::new(vertices[0], vertices[1], vertices[2]) {
                let direction = triangle.sample(Vec2::from_array(u));
                prop_assert!((direction.length() - 1.0).abs() < 1e-5);
                prop_assert!(triangle.solid_angle > 0.0 && triangle.solid_angle <= std::f32::consts::TAU * 1.000_001);
                // Inside, to rounding: not on the far side of any bounding plane.
                let [a, b, c] = vertices.map(|v| v.as_dvec3().normalize());
                let d = direction.as_dvec3();
                let side = a.dot(b.cross(c)).signum();
                if triangle.solid_angle > 1e-3 {
                    for plane in [a.cross(b), b.cross(c), c.cross(a)] {
                        prop_assert!(plane.dot(d) * side > -1e-4, "outside by {}", plane.dot(d) * side);
                    }
                }
            }
        }
    }
}
