//! Frames around a normal, and directions on disk, hemisphere, sphere and cone.

use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4};

/// A right-handed orthonormal frame whose local `+z` is a given normal.
///
/// T. Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1) (2017), listing 3: no branch, no singularity.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// First tangent, unit.
    pub tangent: Vec3,
    /// Second tangent, unit.
    pub bitangent: Vec3,
    /// The normal, unit.
    pub normal: Vec3,
}

impl Frame {
    /// A frame around the unit vector `normal`.
    #[inline]
    pub fn new(normal: Vec3) -> Self {
        let sign = 1_f32.copysign(normal.z);
        let a = -1.0 / (sign + normal.z);
        let b = normal.x * normal.y * a;
        Self {
            tangent: Vec3::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x),
            bitangent: Vec3::new(b, sign + normal.y * normal.y * a, -normal.y),
            normal,
        }
    }

    /// A frame around the unit vector `normal` that turns with it: no jump as long as the axis nearest to the normal is the same.
    #[inline]
    pub fn steady(normal: Vec3) -> Self {
        let a = normal.abs();
        let across = if a.x >= a.y && a.x >= a.z {
            Vec3::Y
        } else if a.y >= a.z {
            Vec3::Z
        } else {
            Vec3::X
        };
        let tangent = (across - normal * normal.dot(across)).normalize();
        Self {
            tangent,
            bitangent: normal.cross(tangent),
            normal,
        }
    }

    /// From local coordinates to those of the normal.
    #[inline]
    pub fn to_world(&self, local: Vec3) -> Vec3 {
        self.tangent * local.x + self.bitangent * local.y + self.normal * local.z
    }

    /// From the coordinates of the normal to local ones.
    #[inline]
    pub fn to_local(&self, world: Vec3) -> Vec3 {
        Vec3::new(
            self.tangent.dot(world),
            self.bitangent.dot(world),
            self.normal.dot(world),
        )
    }
}

/// Sine and cosine of `angle` in `[-pi/4, pi/4]`, to 1e-7. Taylor series: at this range they need no more than five
/// terms, and unlike the system's functions they give the same bits on every machine.
#[inline]
fn sin_cos_eighth(angle: f32) -> (f32, f32) {
    let x = angle * angle;
    let sin = angle * (1.0 + x * (-1.0 / 6.0 + x * (1.0 / 120.0 + x * (-1.0 / 5040.0 + x * (1.0 / 362_880.0)))));
    let cos = 1.0 + x * (-0.5 + x * (1.0 / 24.0 + x * (-1.0 / 720.0 + x * (1.0 / 40_320.0))));
    (sin, cos)
}

/// The point `(cos, sin)` of the unit circle at `turn` of a full turn, `turn` in `[0, 1]`.
#[inline]
pub fn unit_circle(turn: f32) -> Vec2 {
    let quarters = turn * 4.0;
    let nearest = (quarters + 0.5).floor();
    let (sin, cos) = sin_cos_eighth((quarters - nearest) * FRAC_PI_2);
    match nearest as u32 % 4 {
        0 => Vec2::new(cos, sin),
        1 => Vec2::new(-sin, cos),
        2 => Vec2::new(-cos, -sin),
        _ => Vec2::new(sin, -cos),
    }
}

/// A point uniform on the unit disk.
///
/// P. Shirley and K. Chiu, "A Low Distortion Map Between Disk and Square" (1997).
#[inline]
pub fn uniform_disk(u: Vec2) -> Vec2 {
    let p = 2.0 * u - Vec2::ONE;
    if p.x.abs() > p.y.abs() {
        let (sin, cos) = sin_cos_eighth(FRAC_PI_4 * (p.y / p.x));
        Vec2::new(cos, sin) * p.x
    } else if p.y != 0.0 {
        let (sin, cos) = sin_cos_eighth(FRAC_PI_4 * (p.x / p.y));
        Vec2::new(sin, cos) * p.y
    } else {
        Vec2::ZERO
    }
}

/// A local unit direction with density cos / pi around `+z`. `z` is above 0 for every `u`.
#[inline]
pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let disk = uniform_disk(u);
    // The rim would be a direction of density 0.
    let z = (1.0 - disk.length_squared()).max(1e-9).sqrt();
    disk.extend(z)
}

/// Density of [`cosine_hemisphere`] per sr, of a direction with cosine `cos_theta`; 0 below the horizon.
#[inline]
pub fn cosine_hemisphere_pdf(cos_theta: f32) -> f32 {
    cos_theta.max(0.0) * FRAC_1_PI
}

/// A unit direction uniform on the sphere; its density is 1 / (4 pi) per sr.
#[inline]
pub fn uniform_sphere(u: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * u.x;
    let radius = (1.0 - z * z).max(0.0).sqrt();
    (unit_circle(u.y) * radius).extend(z)
}

/// A local unit direction uniform in the cone around `+z` whose half-angle has cosine `1 - versine`.
///
/// The cone is given by its versine because a narrow cone's cosine has no digits left in `f32`. The density is
/// [`uniform_cone_pdf`].
#[inline]
pub fn uniform_cone(u: Vec2, versine: f32) -> Vec3 {
    let below = u.x * versine;
    let radius = (below * (2.0 - below)).max(0.0).sqrt();
    (unit_circle(u.y) * radius).extend(1.0 - below)
}

/// Density of [`uniform_cone`] per sr inside the cone.
#[inline]
pub fn uniform_cone_pdf(versine: f32) -> f32 {
    1.0 / (std::f32::consts::TAU * versine)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::statistics::{chi_square_p, pooled_chi_square};
    use proptest::prelude::*;

    #[test]
    fn unit_circle_agrees_with_the_library() {
        for i in 0..=10_000 {
            let turn = i as f32 / 10_000.0;
            let angle = f64::from(turn) * std::f64::consts::TAU;
            let p = unit_circle(turn).as_dvec2();
            assert!(
                (p.x - angle.cos()).abs() < 3e-7 && (p.y - angle.sin()).abs() < 3e-7,
                "{turn}"
            );
        }
    }

    /// p-value of directions binned in equal shares of azimuth and of `height`, the cumulative distribution of z.
    fn binned_p(seed: u64, direction: impl Fn(Vec2) -> Vec3, height: impl Fn(f32) -> f32) -> f64 {
        let random = Random::new(seed, 0, 0);
        let draws = 1 << 17;
        let mut bins = vec![0_u64; 256];
        for i in 0..draws {
            let d = direction(random.vec2(2 * i));
            let azimuth = (d.y.atan2(d.x) / std::f32::consts::TAU).rem_euclid(1.0);
            let row = ((height(d.z) * 16.0) as usize).min(15);
            bins[row * 16 + ((azimuth * 16.0) as usize).min(15)] += 1;
        }
        let (statistic, dof) = pooled_chi_square(&bins, &vec![f64::from(draws) / 256.0; 256], 5.0);
        chi_square_p(statistic, dof)
    }

    /// All together fail once in 1,000 seeds.
    #[test]
    fn directions_follow_their_densities() {
        let limit = 1e-3 / 4.0;
        assert!(binned_p(1, cosine_hemisphere, |z| 1.0 - z * z) > limit);
        assert!(binned_p(2, uniform_sphere, |z| (1.0 - z) * 0.5) > limit);
        assert!(binned_p(3, |u| uniform_cone(u, 0.25), |z| (1.0 - z) * 4.0) > limit);
        let disk = |u| uniform_disk(u).extend(0.0);
        let height = |d: Vec3| d.truncate().length_squared();
        assert!(binned_p(4, |u| disk(u).with_z(height(disk(u))), |z| z) > limit);
    }

    proptest! {
        #[test]
        fn frames_are_orthonormal(u in prop::array::uniform2(0.0_f32..1.0), flat: bool) {
            let mut normal = uniform_sphere(Vec2::from_array(u));
            if flat {
                normal = normal.with_z(-0.0).normalize_or(Vec3::X);
            }
            let frame = Frame::new(normal);
            for (a, b) in [(frame.tangent, frame.bitangent), (frame.bitangent, normal), (normal, frame.tangent)] {
                prop_assert!(a.dot(b).abs() < 1e-6);
                prop_assert!((a.length() - 1.0).abs() < 1e-6);
            }
            prop_assert!((frame.tangent.cross(frame.bitangent) - normal).length() < 1e-5);
            let v = Vec3::new(0.3, -0.5, 0.8);
            prop_assert!((frame.to_local(frame.to_world(v)) - v).length() < 1e-6);
        }

        #[test]
        fn adversarial_numbers_stay_in_range(
            u in prop::array::uniform2(prop_oneof![Just(0.0_f32), Just(0.5), Just(1.0 - f32::EPSILON / 2.0), 0.0_f32..1.0]),
            versine in 1e-12_f32..2.0,
        ) {
            let u = Vec2::from_array(u);
            prop_assert!(uniform_disk(u).length() <= 1.0 + 1e-6);
            let up = cosine_hemisphere(u);
            prop_assert!(up.z > 0.0 && (up.length() - 1.0).abs() < 1e-5);
            prop_assert!((uniform_sphere(u).length() - 1.0).abs() < 1e-6);
            let cone = uniform_cone(u, versine);
            prop_assert!((cone.length() - 1.0).abs() < 1e-6 && 1.0 - cone.z <= versine + 1e-6);
        }
    }
}
