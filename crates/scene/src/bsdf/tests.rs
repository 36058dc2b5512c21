use super::*;
use proptest::prelude::*;
use sampling::Moments;
use sampling::statistics::{chi_square_p, normal_p_two_sided, pooled_chi_square};
use sampling::{HemisphereGuide, Random};
use std::f64::consts::TAU;

fn bsdf(diffuse: f32, f0: f32, f90: f32, alpha: f32) -> Bsdf {
    Bsdf {
        normal_ws: Vec3::new(0.36, 0.48, 0.8),
        diffuse: Vec3::splat(diffuse),
        f0: Vec3::splat(f0),
        f90,
        alpha,
    }
}

fn lambert(albedo: f32) -> Bsdf {
    bsdf(albedo, 0.0, 0.0, 1.0)
}

/// A direction with the given cosine to the normal.
fn leaning(bsdf: &Bsdf, cosine: f32) -> Vec3 {
    Frame::new(bsdf.normal_ws).to_world(Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine))
}

/// The reflected share of uniform light from everywhere, with its standard error.
fn albedo(bsdf: &Bsdf, wo: Vec3, draws: u32) -> Moments {
    let random = Random::new(1, 0, 0);
    let mut moments = Moments::default();
    for i in 0..draws {
        let sample = bsdf.sample(wo, random.f32(3 * i), random.vec2(3 * i + 1));
        moments.push(sample.map_or(0.0, |s| f64::from(s.value.x / s.pdf_solid_angle)));
    }
    moments
}

#[test]
fn lambert_is_exact() {
    let white = lambert(0.5);
    let wo = leaning(&white, 0.3);
    for cosine in [0.01, 0.4, 1.0] {
        let wi = leaning(&white, cosine);
        let cosine = white.normal_ws.dot(wi);
        assert_eq!(white.eval(wo, wi), Vec3::splat(0.5 * (cosine * FRAC_1_PI)));
        assert_eq!(white.pdf(wo, wi), cosine * FRAC_1_PI);
    }
    assert_eq!(white.eval(wo, -white.normal_ws), Vec3::ZERO);
    assert!(white.is_lambert() && !bsdf(0.5, 0.04, 1.0, 0.1).is_lambert());
    // Each sample carries the albedo: no noise.
    let moments = albedo(&white, wo, 1000);
    assert!((moments.mean() - 0.5).abs() < 1e-6 && moments.variance() < 1e-12);
}

/// A white furnace: never brighter than 1, and a white base under any coat stays white. 1 % either way is allowed for
/// the table's interpolation (2 % within 6 degrees of grazing), on top of 3.3 standard errors of noise.
#[test]
fn furnace_never_gains() {
    let mut brightest = 0.0_f64;
    for (f0, f90) in [(0.04, 1.0), (0.2, 1.0), (0.0, 1.0), (0.04, 0.5), (1.0, 1.0)] {
        for alpha in [MIN_ALPHA, 0.01, 0.1, 0.3, 0.6, 1.0] {
            for cosine in [0.02, 0.1, 0.3, 0.6, 1.0] {
                // A white metal has no diffuse lobe; everything else is white below.
                let material = bsdf(if f0 == 1.0 { 0.0 } else { 1.0 }, f0, f90, alpha);
                let moments = albedo(&material, leaning(&material, cosine), 4000);
                let least = moments.mean() - 3.3 * moments.standard_error();
                brightest = brightest.max(least);
                let tolerance = if cosine < 0.11 { 0.02 } else { 0.01 };
                assert!(
                    least < 1.0 + tolerance,
                    "f0 {f0} f90 {f90} alpha {alpha} cos {cosine}: {}",
                    moments.mean()
                );
                // Single scattering loses light where rough; a white base gives back what does not come that way.
                let kept = if f0 == 1.0 { 0.3 } else { 1.0 - tolerance };
                let most = moments.mean() + 3.3 * moments.standard_error();
                assert!(
                    most > kept,
                    "f0 {f0} f90 {f90} alpha {alpha} cos {cosine}: {}",
                    moments.mean()
                );
            }
        }
    }
    assert!(brightest > 0.9, "the furnace is not lit: {brightest}");
}

/// Directions fall where the density says, which integrates to 1 less what falls below the horizon. Fails once in
/// 1,000 seeds.
#[test]
fn samples_follow_the_density() {
    let cases = [
        (bsdf(0.5, 0.04, 1.0, 0.05), 0.7),
        (bsdf(0.5, 0.04, 1.0, 0.5), 0.2),
        (bsdf(0.0, 0.9, 1.0, 0.3), 0.5),
        (bsdf(0.2, 0.5, 1.0, 1.0), 0.9),
        (lambert(0.8), 0.5),
    ];
    let weights = Random::new(5, 0, 0);
    let guide = HemisphereGuide::new(&std::array::from_fn(|part| weights.f32(part as u32).powi(3)), 0.2);
    assert!(guide.is_some());
    let cases = [None, guide.as_ref()]
        .into_iter()
        .flat_map(|guide| cases.iter().map(move |case| (guide, case)));
    for (case, (guide, (material, cosine))) in cases.enumerate() {
        let wo = leaning(material, *cosine);
        let pdf = |wi_ws| material.eval_pdf_guided(wo, wi_ws, guide).1;
        let frame = Frame::new(material.normal_ws);
        let (rows, columns, sub) = (20_usize, 32_usize, 16_usize);
        let draws = 1 << 16;
        let mut expected = vec![0.0; rows * columns];
        // Bins of equal z^2, so that Lambert fills them evenly.
        for i in 0..rows * sub {
            for j in 0..columns * sub {
                let z_sq = (i as f64 + 0.5) / (rows * sub) as f64;
                let phi = TAU * (j as f64 + 0.5) / (columns * sub) as f64;
                let (z, r) = (z_sq.sqrt(), (1.0 - z_sq).sqrt());
                let wi = frame.to_world(Vec3::new((r * phi.cos()) as f32, (r * phi.sin()) as f32, z as f32));
                // d(solid angle) = dz dphi = d(z^2) dphi / (2 z).
                let measure = TAU / (2.0 * z) / (rows * sub * columns * sub) as f64;
                expected[i / sub * columns + j / sub] += f64::from(pdf(wi)) * measure * f64::from(draws);
            }
        }
        let random = Random::new(2, case as u32, 0);
        let mut counts = vec![0_u64; rows * columns];
        let mut lost = 0_u64;
        let mut unlike = 0;
        for i in 0..draws {
            match material.sample_guided(wo, random.f32(3 * i), random.vec2(3 * i + 1), guide) {
                None => lost += 1,
                Some(sample) => {
                    let pdf = pdf(sample.wi_ws);
                    unlike += u32::from((pdf / sample.pdf_solid_angle - 1.0).abs() >= 2e-3);
                    let local = frame.to_local(sample.wi_ws);
                    let phi = f64::from(local.y.atan2(local.x)).rem_euclid(TAU) / TAU;
                    let row = ((f64::from(local.z * local.z) * rows as f64) as usize).min(rows - 1);
                    counts[row * columns + ((phi * columns as f64) as usize).min(columns - 1)] += 1;
                }
            }
        }
        // At the edge of a part of the guide rounding decides on which side a direction is.
        assert!(unlike <= if guide.is_some() { 2 } else { 0 }, "case {case}: {unlike}");
        // What is lost below the horizon, and only that, is missing from the density.
        counts.push(lost);
        expected.push((f64::from(draws) - expected.iter().sum::<f64>()).max(0.0));
        let (statistic, dof) = pooled_chi_square(&counts, &expected, 10.0);
        let p = chi_square_p(statistic, dof);
        assert!(p > 1e-3 / 10.0, "case {case}: p {p}, lost {lost}");
    }
}

/// The same albedo by cosine-weighted directions as by the BSDF's own. Fails once in 1,000 seeds.
#[test]
fn own_directions_change_nothing_but_noise() {
    for (case, material) in [bsdf(0.6, 0.04, 1.0, 0.3), bsdf(0.0, 0.8, 1.0, 0.6)]
        .into_iter()
        .enumerate()
    {
        let wo = leaning(&material, 0.4);
        let frame = Frame::new(material.normal_ws);
        let random = Random::new(3, case as u32, 0);
        let mut plain = Moments::default();
        for i in 0..1 << 17 {
            let local = cosine_hemisphere(random.vec2(2 * i));
            let value = material.eval(wo, frame.to_world(local)).x;
            plain.push(f64::from(value / (local.z * FRAC_1_PI)));
        }
        let own = albedo(&material, wo, 1 << 16);
        let error = plain.standard_error().hypot(own.standard_error());
        let p = normal_p_two_sided((plain.mean() - own.mean()) / error);
        assert!(p > 1e-3 / 2.0, "case {case}: {} and {}", plain.mean(), own.mean());
    }
}

proptest! {
    #[test]
    fn is_reciprocal(
        a in prop::array::uniform2(0.01_f32..0.99), b in prop::array::uniform2(0.01_f32..0.99),
        diffuse in 0.0_f32..1.0, f0 in 0.0_f32..1.0, alpha in 0.05_f32..1.0,
    ) {
        let material = bsdf(diffuse, f0, 1.0, alpha);
        let frame = Frame::new(material.normal_ws);
        let (wo, wi) = (frame.to_world(cosine_hemisphere(a.into())), frame.to_world(cosine_hemisphere(b.into())));
        let (cos_o, cos_i) = (material.normal_ws.dot(wo), material.normal_ws.dot(wi));
        let (there, back) = (material.eval(wo, wi).x / cos_i, material.eval(wi, wo).x / cos_o);
        prop_assert!((there - back).abs() <= 1e-3 * there.max(1e-3), "{there} {back}");
    }

    #[test]
    fn stays_finite(
        cosine in prop_oneof![Just(1e-6_f32), Just(1.0), 0.0_f32..1.0], u_lobe in 0.0_f32..1.0,
        u in prop::array::uniform2(prop_oneof![Just(0.0_f32), Just(1.0 - f32::EPSILON / 2.0), 0.0_f32..1.0]),
        diffuse in 0.0_f32..1.0, f0 in prop_oneof![Just(0.0_f32), Just(1.0), 0.0_f32..1.0], f90 in prop_oneof![Just(0.0_f32), Just(1.0)],
        alpha in prop_oneof![Just(MIN_ALPHA), Just(1.0), MIN_ALPHA..1.0],
    ) {
        let material = bsdf(diffuse, f0, f90, alpha);
        let wo = leaning(&material, cosine);
        if let Some(sample) = material.sample(wo, u_lobe, u.into()) {
            prop_assert!(sample.value.is_finite() && sample.value.min_element() >= 0.0);
            prop_assert!(sample.pdf_solid_angle > 0.0 && sample.pdf_solid_angle.is_finite());
            prop_assert!((sample.wi_ws.length() - 1.0).abs() < 1e-4);
            prop_assert!(material.normal_ws.dot(sample.wi_ws) > -1e-6);
        }
    }
}

#[test]
fn the_table_begins_at_the_least_alpha() {
    assert!((albedo::LEAST.powi(2) / MIN_ALPHA - 1.0).abs() < 1e-6);
}
