//! The isotropic GGX microfacet distribution and the sampling of its visible normals.
//!
//! B. Walter et al., "Microfacet Models for Refraction through Rough Surfaces" (EGSR 2007) for the distribution, E. Heitz,
//! "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs", JCGT 3(2) (2014) for the masking. All vectors are
//! unit and local: `+z` is the macroscopic normal. `alpha` is the width, the square of the perceptual roughness;
//! values from 1e-4 on are safe in `f32`.

use crate::hemisphere::unit_circle;
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// Density of microfacet normals with cosine `cos_h`, per sr and projected area; 0 below the horizon.
///
/// Where the vector is at hand [`d_vector`] is sharper: near the peak the cosine alone has no digits left.
#[inline]
pub fn d(cos_h: f32, alpha: f32) -> f32 {
    d_of(cos_h, (1.0 - cos_h) * (1.0 + cos_h), alpha)
}

/// [`d`] of the microfacet normal `h`.
#[inline]
pub fn d_vector(h: Vec3, alpha: f32) -> f32 {
    d_of(h.z, h.x * h.x + h.y * h.y, alpha)
}

#[inline]
fn d_of(cos_h: f32, sin_sq: f32, alpha: f32) -> f32 {
    if cos_h <= 0.0 {
        return 0.0;
    }
    let alpha_sq = alpha * alpha;
    // cos^2 (alpha^2 - 1) + 1 without its cancellation at the peak. Divided one at a time: the square of a narrow
    // peak's denominator underflows.
    let t = sin_sq + cos_h * cos_h * alpha_sq;
    alpha_sq / t / (PI * t)
}

/// Smith's Lambda of a direction with cosine `cos_w`: the masked area per visible area. Infinite at the horizon.
#[inline]
pub fn lambda(cos_w: f32, alpha: f32) -> f32 {
    let cos_sq = cos_w * cos_w;
    let tan_sq = (1.0 - cos_sq).max(0.0) / cos_sq;
    0.5 * ((1.0 + alpha * alpha * tan_sq).sqrt() - 1.0)
}

/// Share of the microsurface visible from a direction with cosine `cos_w`.
#[inline]
pub fn g1(cos_w: f32, alpha: f32) -> f32 {
    1.0 / (1.0 + lambda(cos_w, alpha))
}

/// Share of the microsurface visible from both directions, height-correlated (Heitz 2014, equation 99).
#[inline]
pub fn g2(cos_o: f32, cos_i: f32, alpha: f32) -> f32 {
    1.0 / (1.0 + lambda(cos_o, alpha) + lambda(cos_i, alpha))
}

/// Draws a microfacet normal visible from `wo` (`wo.z` above 0), with density [`pdf_vndf`].
///
/// J. Dupuy and A. Benyoub, "Sampling Visible GGX Normals with Spherical Caps" (HPG 2023), listing 3.
#[inline]
pub fn sample_vndf(wo: Vec3, alpha: f32, u: Vec2) -> Vec3 {
    let stretched = Vec3::new(alpha * wo.x, alpha * wo.y, wo.z).normalize_or(Vec3::Z);
    let circle = unit_circle(u.x);
    // z uniform in (-stretched.z, 1]; written from the top, where narrow lobes need the digits.
    let below = u.y * (1.0 + stretched.z);
    let radius = (below * (2.0 - below)).max(0.0).sqrt();
    let cap = (circle * radius).extend(1.0 - below);
    let h = cap + stretched;
    // Exactly opposite at u.y -> 1 and a grazing view: any normal will do, its density is 0.
    Vec3::new(alpha * h.x, alpha * h.y, h.z.max(0.0)).normalize_or(Vec3::Z)
}

/// Density per sr of the microfacet normal `h` among those visible from `wo`; 0 for normals facing away.
/// Divide by `4 wo.h` for the density of the reflected direction.
#[inline]
pub fn pdf_vndf(wo: Vec3, h: Vec3, alpha: f32) -> f32 {
    let cos_oh = wo.dot(h);
    if wo.z <= 0.0 || cos_oh <= 0.0 {
        return 0.0;
    }
    // g1 / cos_o with the cosine multiplied in, so that a grazing view does not divide by zero.
    let visible_area = 0.5 * (wo.z + (wo.z * wo.z + alpha * alpha * (1.0 - wo.z * wo.z).max(0.0)).sqrt());
    d_vector(h, alpha) * cos_oh / visible_area
}

/// Density per sr of the direction reflected from `wo` at a normal of [`sample_vndf`], `h` being the half vector.
#[inline]
pub fn pdf_reflection(wo: Vec3, h: Vec3, alpha: f32) -> f32 {
    let cos_oh = wo.dot(h);
    if cos_oh > 0.0 {
        pdf_vndf(wo, h, alpha) / (4.0 * cos_oh)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::statistics::{chi_square_p, pooled_chi_square};
    use proptest::prelude::*;
    use std::f64::consts::TAU;

    /// Integral of `f(h) sin` over cells of the hemisphere; theta is warped by `tan(theta) = alpha t / (1 - t)` so that
    /// narrow lobes are resolved. Returns the `rows x columns` cells.
    fn integrate(alpha: f32, rows: usize, columns: usize, f: impl Fn(Vec3) -> f64) -> Vec<f64> {
        let sub = 24;
        let mut cells = vec![0.0; rows * columns];
        for i in 0..rows * sub {
            let t = (i as f64 + 0.5) / (rows * sub) as f64;
            let theta = (f64::from(alpha) * t / (1.0 - t)).atan();
            let jacobian = f64::from(alpha) / (1.0 - t).powi(2) * theta.cos().powi(2) / (rows * sub) as f64;
            for j in 0..columns * sub {
                let phi = TAU * (j as f64 + 0.5) / (columns * sub) as f64;
                let h = glam::DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()).as_vec3();
                cells[i / sub * columns + j / sub] += f(h) * theta.sin() * jacobian * TAU / (columns * sub) as f64;
            }
        }
        cells
    }

    fn view(cos_theta: f32) -> Vec3 {
        Vec3::new(
            (1.0 - cos_theta * cos_theta).sqrt() * 0.6,
            (1.0 - cos_theta * cos_theta).sqrt() * 0.8,
            cos_theta,
        )
    }

    #[test]
    fn projected_normals_cover_the_surface_once() {
        for alpha in [0.001, 0.03, 0.3, 1.0] {
            let sum: f64 = integrate(alpha, 16, 1, |h| f64::from(d_vector(h, alpha) * h.z))
                .iter()
                .sum();
            assert!((sum - 1.0).abs() < 2e-3, "alpha {alpha}: {sum}");
        }
    }

    #[test]
    fn visible_normals_integrate_to_one() {
        for alpha in [0.01, 0.2, 1.0] {
            for cos_theta in [1.0, 0.6, 0.1, 0.01] {
                let wo = view(cos_theta);
                let sum: f64 = integrate(alpha, 16, 16, |h| f64::from(pdf_vndf(wo, h, alpha)))
                    .iter()
                    .sum();
                assert!((sum - 1.0).abs() < 5e-3, "alpha {alpha} cos {cos_theta}: {sum}");
            }
        }
    }

    #[test]
    fn pdf_is_the_textbook_formula() {
        for cos_theta in [0.9, 0.3, 0.02] {
            let (wo, h, alpha) = (view(cos_theta), Vec3::new(0.1, 0.2, 0.9).normalize(), 0.4);
            let textbook = g1(wo.z, alpha) * d(h.z, alpha) * wo.dot(h) / wo.z;
            assert!((pdf_vndf(wo, h, alpha) / textbook - 1.0).abs() < 1e-4);
            assert!((pdf_reflection(wo, h, alpha) - textbook / (4.0 * wo.dot(h))).abs() < 1e-4);
        }
        assert!(
            (g2(0.5, 1.0, 0.3) - g1(0.5, 0.3)).abs() < 1e-6,
            "nothing masks the normal direction"
        );
    }

    /// All together fail once in 1,000 seeds.
    #[test]
    fn samples_follow_the_density() {
        for (seed, (alpha, cos_theta)) in [
            (0.05, 0.9),
            (0.05, 0.2),
            (0.5, 0.5),
            (0.5, 0.05),
            (1.0, 0.7),
            (0.002, 0.5),
        ]
        .into_iter()
        .enumerate()
        {
            let wo = view(cos_theta);
            let (rows, columns) = (12, 12);
            let draws = 1 << 17;
            let mut expected = integrate(alpha, rows, columns, |h| f64::from(pdf_vndf(wo, h, alpha)));
            let sum: f64 = expected.iter().sum();
            expected.iter_mut().for_each(|e| *e *= f64::from(draws) / sum);
            let random = Random::new(seed as u64, 0, 0);
            let mut counts = vec![0_u64; rows * columns];
            for i in 0..draws {
                let h = sample_vndf(wo, alpha, random.vec2(2 * i));
                let tan = h.truncate().length() / h.z.max(1e-9) / alpha;
                let row = ((f64::from(tan / (1.0 + tan)) * rows as f64) as usize).min(rows - 1);
                let phi = f64::from(h.y.atan2(h.x)).rem_euclid(TAU);
                counts[row * columns + ((phi / TAU * columns as f64) as usize).min(columns - 1)] += 1;
            }
            let (statistic, dof) = pooled_chi_square(&counts, &expected, 10.0);
            let p = chi_square_p(statistic, dof);
            assert!(p > 1e-3 / 6.0, "alpha {alpha} cos {cos_theta}: p {p}");
        }
    }

    proptest! {
        #[test]
        fn adversarial_numbers_give_unit_normals_above(
            u in prop::array::uniform2(prop_oneof![Just(0.0_f32), Just(0.5), Just(1.0 - f32::EPSILON / 2.0), 0.0_f32..1.0]),
            alpha in prop_oneof![Just(1e-4_f32), Just(1.0), 1e-4_f32..1.0],
            cos_theta in prop_oneof![Just(1e-7_f32), Just(1.0), 1e-7_f32..1.0],
        ) {
            let wo = view(cos_theta);
            let h = sample_vndf(wo, alpha, Vec2::from_array(u));
            prop_assert!((h.length() - 1.0).abs() < 1e-5 && h.z >= 0.0);
            let pdf = pdf_vndf(wo, h, alpha);
            prop_assert!(pdf.is_finite() && pdf >= 0.0);
        }
    }
}
