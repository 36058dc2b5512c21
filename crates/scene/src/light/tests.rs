use super::*;
use glam::DVec3;
use proptest::prelude::*;
use sampling::Moments;
use sampling::hemisphere::{uniform_cone, uniform_sphere};
use sampling::random::Random;
use sampling::statistics::{chi_square_p, normal_p_two_sided, pooled_chi_square};
use std::f32::consts::PI;

fn lamp(size: f32, double_sided: bool) -> Light {
    let corners = [
        Vec3::new(-0.6, 2.0, -0.4),
        Vec3::new(0.9, 2.0, -0.5),
        Vec3::new(0.1, 2.0, 1.1),
    ];
    let middle = Vec3::new(0.13, 2.0, 0.07);
    Light::triangle(
        corners.map(|c| middle + (c - middle) * size),
        Vec3::new(3.0, 2.0, 1.0),
        double_sided,
    )
    .unwrap()
}

/// The same winding for light from above: the lamp of `lamp` shines down.
fn points() -> impl Iterator<Item = Vec3> {
    // From a third of a metre below the light, beside it, to far away.
    [(0.1, 1.7, 0.1), (0.0, 0.0, 0.0), (2.0, 1.9, -3.0), (-30.0, -40.0, 11.0)]
        .into_iter()
        .map(Vec3::from)
}

/// Distance to the light's triangle along a ray, in f64.
fn meet(light: &Light, from: Vec3, wi: Vec3) -> Option<f32> {
    let (e1, e2, d) = (light.edge1_ws.as_dvec3(), light.edge2_ws.as_dvec3(), wi.as_dvec3());
    let to_first = light.position_ws.as_dvec3() - from.as_dvec3();
    let normal = e1.cross(e2);
    let t = normal.dot(to_first) / normal.dot(d);
    let at = d * t - to_first;
    let u = at.cross(e2).dot(normal) / normal.length_squared();
    let v = e1.cross(at).dot(normal) / normal.length_squared();
    (t > 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0).then_some(t as f32)
}

#[test]
fn the_lamp_shines_down() {
    assert!(lamp(1.0, false).normal_ws.y < -0.99);
}

/// The density integrates to 1 over directions, by an estimator that knows nothing of the sampler: uniform directions in a
/// cone around the light. Both ways of drawing are used. Fails once in 1,000 seeds.
#[test]
fn densities_integrate_to_one() {
    let cases: Vec<(Light, Vec3)> = [0.05, 1.0]
        .iter()
        .flat_map(|&size| points().map(move |p| (lamp(size, false), p)))
        .collect();
    for (case, (light, from)) in cases.iter().enumerate() {
        let axis = (light.center_ws() - *from).normalize();
        let corners = [
            light.position_ws,
            light.position_ws + light.edge1_ws,
            light.position_ws + light.edge2_ws,
        ];
        let versine = corners
            .map(|c| 1.0 - f64::from((c - *from).normalize().dot(axis)))
            .into_iter()
            .fold(0.0, f64::max);
        // A little wider, and no narrower than f32 resolves.
        let versine = (versine * 1.1 + 1e-6).min(2.0) as f32;
        let frame = sampling::hemisphere::Frame::new(axis);
        let random = Random::new(1, case as u32, 0);
        let mut moments = Moments::default();
        for i in 0..1 << 16 {
            let wi = frame.to_world(uniform_cone(random.vec2(2 * i), versine));
            let pdf = meet(light, *from, wi).map_or(0.0, |distance| light.pdf_solid_angle(*from, wi, distance));
            moments.push(f64::from(pdf) / f64::from(sampling::hemisphere::uniform_cone_pdf(versine)));
        }
        let z = (moments.mean() - 1.0) / moments.standard_error();
        let p = normal_p_two_sided(z);
        assert!(
            p > 1e-3 / cases.len() as f64,
            "case {case}: {} +- {}",
            moments.mean(),
            moments.standard_error()
        );
    }
}

/// Drawn points fall on parts of the triangle as often as the density says. Fails once in 1,000 seeds.
#[test]
fn frequencies_follow_the_density() {
    for (case, (size, from)) in [(1.0, Vec3::new(0.1, 1.2, 0.1)), (0.05, Vec3::new(3.0, 0.0, 0.0))]
        .into_iter()
        .enumerate()
    {
        let light = lamp(size, false);
        let n = 8_usize;
        let cell = |at: Vec2| {
            let (x, y) = ((at.x * n as f32) as usize, (at.y * n as f32) as usize);
            x.min(n - 1) * n + y.min(n - 1)
        };
        let mut counts = vec![0_u64; n * n];
        let mut expected = vec![0.0; n * n];
        let draws = 1 << 16;
        let random = Random::new(2, case as u32, 0);
        for i in 0..draws {
            let point = light.sample(from, random.vec2(2 * i)).unwrap();
            counts[cell(light.barycentrics(from, point.wi_ws, point.distance))] += 1;
        }
        // Density by area, integrated on a fine grid of barycentric coordinates.
        let fine = 400;
        for i in 0..fine {
            for j in 0..fine - i {
                let at = (Vec2::new(i as f32, j as f32) + 0.333) / fine as f32;
                let towards = light.position_ws + light.edge1_ws * at.x + light.edge2_ws * at.y - from;
                let (distance, wi) = (towards.length(), towards.normalize());
                let cosine = -light.normal_ws.dot(wi);
                // Whole pieces, and the half ones along the hypotenuse.
                let share = if i + j + 1 == fine { 0.5 } else { 1.0 };
                let area = 2.0 * light.area / (fine * fine) as f32 * share;
                expected[cell(at)] +=
                    f64::from(light.pdf_solid_angle(from, wi, distance) * cosine / distance.powi(2) * area);
            }
        }
        let total: f64 = expected.iter().sum();
        assert!((total - 1.0).abs() < 1e-2, "{total}");
        expected.iter_mut().for_each(|e| *e *= f64::from(draws) / total);
        let (statistic, dof) = pooled_chi_square(&counts, &expected, 200.0);
        let p = chi_square_p(statistic, dof);
        assert!(p > 1e-3 / 2.0, "size {size}: p {p}");
    }
}

proptest! {
    /// The density that comes with a sample is the one that `pdf_solid_angle` gives for it, and the sample is on the light.
    #[test]
    fn sample_and_density_agree(
        corners in prop::array::uniform9(-1.0_f32..1.0), from in prop::array::uniform3(-4.0_f32..4.0),
        u in prop::array::uniform2(0.0_f32..1.0), scale in -3_i32..4, double_sided: bool,
    ) {
        let scale = 10_f32.powi(scale);
        let [a, b, c] = [0, 3, 6].map(|i| Vec3::from_slice(&corners[i..]) * scale);
        let from = Vec3::from_array(from) * scale;
        let Some(light) = Light::triangle([a, b, c], Vec3::ONE, double_sided) else { return Ok(()) };
        let Some(point) = light.sample(from, Vec2::from_array(u)) else { return Ok(()) };
        prop_assert!((point.wi_ws.length() - 1.0).abs() < 1e-5);
        prop_assert!(double_sided || light.normal_ws.dot(from - a) > 0.0, "seen from behind");
        let cosine = light.normal_ws.dot(point.wi_ws).abs();
        if cosine > 1e-3 {
            let pdf = light.pdf_solid_angle(from, point.wi_ws, point.distance);
            // Drawn by area, the cosine is computed from a rounded direction on both sides.
            prop_assert!((pdf / point.pdf_solid_angle - 1.0).abs() < 1e-3, "{pdf} {}", point.pdf_solid_angle);
            let at = light.barycentrics(from, point.wi_ws, point.distance);
            let on_light = a + light.edge1_ws * at.x + light.edge2_ws * at.y;
            let aimed = from + point.wi_ws * point.distance;
            prop_assert!((on_light - aimed).length() < 1e-3 * scale, "{on_light} {aimed}");
        }
        // A weight of 0 may only be given where nothing can arrive.
        for normal in [Vec3::Y, point.wi_ws, uniform_sphere(Vec2::from_array(u))] {
            let weight = light.unshadowed_irradiance(from, normal);
            prop_assert!(weight.is_finite() && weight >= 0.0);
            prop_assert!(weight > 0.0 || normal.dot(point.wi_ws) < 1e-5, "{}", normal.dot(point.wi_ws));
        }
    }

    #[test]
    fn irradiance_has_the_right_unit(
        from in prop::array::uniform3(-4.0_f32..1.9), normal in prop::array::uniform2(0.0_f32..1.0), power in -10_i32..10,
    ) {
        // Powers of two scale without rounding.
        let (scale, from) = (2_f32.powi(power), Vec3::from_array(from));
        let normal = uniform_sphere(Vec2::from_array(normal));
        let light = lamp(1.0, false);
        let corners = [light.position_ws, light.position_ws + light.edge1_ws, light.position_ws + light.edge2_ws];
        let scaled = Light::triangle(corners.map(|c| c * scale), light.intensity, false).unwrap();
        let (a, b) = (light.unshadowed_irradiance(from, normal), scaled.unshadowed_irradiance(from * scale, normal));
        prop_assert!((a - b).abs() <= 1e-4 * a.max(1e-6), "{a} {b}");
        let point = Light::point(light.position_ws, Vec3::ONE, f32::INFINITY).unshadowed_irradiance(from, normal);
        let other = Light::point(light.position_ws * scale, Vec3::ONE, f32::INFINITY);
        let other = other.unshadowed_irradiance(from * scale, normal) * scale * scale;
        prop_assert!((point - other).abs() <= 1e-4 * point);
    }
}

/// Irradiance by many draws, in f64.
fn irradiance(light: &Light, at: Vec3, normal: Vec3) -> f64 {
    let random = Random::new(3, 0, 0);
    let mut moments = Moments::default();
    for i in 0..1 << 14 {
        let point = light.sample(at, random.vec2(2 * i));
        moments.push(point.map_or(0.0, |p| {
            f64::from(crate::luminance(p.radiance) * p.wi_ws.dot(normal).max(0.0) / p.pdf_solid_angle)
        }));
    }
    moments.mean()
}

#[test]
fn unshadowed_irradiance_is_near_the_truth() {
    for light in [lamp(1.0, false), lamp(0.05, true)] {
        for (from, normal) in [
            (Vec3::new(0.3, 0.0, 0.2), Vec3::Y),
            (Vec3::new(4.0, -3.0, 1.0), Vec3::new(-0.6, 0.8, 0.0)),
            (Vec3::new(0.0, 1.0, 0.0), Vec3::Y),
            // The light stands half above the horizon.
            (Vec3::new(0.13, 0.5, 0.07), Vec3::X),
        ] {
            let (guess, truth) = (
                f64::from(light.unshadowed_irradiance(from, normal)),
                irradiance(&light, from, normal),
            );
            assert!(
                guess > truth / 2.0 && guess < truth * 2.0,
                "{from} {normal}: {guess} for {truth}"
            );
        }
    }
    // Far away the centre says it all.
    let (light, from) = (lamp(1.0, false), Vec3::new(20.0, -40.0, 3.0));
    let (guess, truth) = (
        f64::from(light.unshadowed_irradiance(from, Vec3::Y)),
        irradiance(&light, from, Vec3::Y),
    );
    assert!((guess / truth - 1.0).abs() < 0.01, "{guess} {truth}");
}

#[test]
fn one_sided_triangles_are_dark_behind() {
    let (light, behind) = (lamp(1.0, false), Vec3::new(0.0, 3.0, 0.0));
    assert!(light.sample(behind, Vec2::splat(0.4)).is_none());
    assert_eq!(light.pdf_solid_angle(behind, -Vec3::Y, 1.0), 0.0);
    assert_eq!(light.unshadowed_irradiance(behind, -Vec3::Y), 0.0);
    let both = lamp(1.0, true);
    assert!(both.sample(behind, Vec2::splat(0.4)).is_some());
    assert!(both.pdf_solid_angle(behind, -Vec3::Y, 1.0) > 0.0);
    assert!(both.unshadowed_irradiance(behind, -Vec3::Y) > 0.0);
    assert!((both.power / light.power - 2.0).abs() < 1e-6);
}

/// What arrives is radiance x solid angle, near and far: against f64.
#[test]
fn mean_over_draws_gives_the_solid_angle() {
    let light = lamp(1.0, false);
    for from in points() {
        let [a, b, c] = [Vec3::ZERO, light.edge1_ws, light.edge2_ws].map(|e| (light.position_ws + e - from).as_dvec3());
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let edges: DVec3 = (b - a).cross(c - a);
        let exact = 2.0
            * a.dot(edges)
                .abs()
                .atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
        let random = Random::new(4, 0, 0);
        let mut moments = Moments::default();
        for i in 0..1 << 12 {
            moments.push(1.0 / f64::from(light.sample(from, random.vec2(2 * i)).unwrap().pdf_solid_angle));
        }
        let error = (moments.mean() - exact).abs();
        assert!(
            error < 4.0 * moments.standard_error() + 1e-5 * exact,
            "{from}: {} for {exact}",
            moments.mean()
        );
    }
}

#[test]
fn punctual_lights_follow_the_extension() {
    let at = Vec3::new(0.0, 3.0, 4.0);
    let point = Light::point(Vec3::ZERO, Vec3::splat(50.0), 10.0)
        .sample(at, Vec2::ZERO)
        .unwrap();
    assert!((point.distance - 5.0).abs() < 1e-5 && (point.wi_ws - -at / 5.0).length() < 1e-6);
    let expected = 50.0 / 25.0 * (1.0 - 0.5_f32.powi(4));
    assert!((point.radiance.x - expected).abs() < 1e-5 && point.pdf_solid_angle == 1.0);
    assert!(
        Light::point(Vec3::ZERO, Vec3::ONE, 4.9)
            .sample(at, Vec2::ZERO)
            .is_none(),
        "beyond its range"
    );
    assert!(
        Light::point(at, Vec3::ONE, 1.0).sample(at, Vec2::ZERO).is_none(),
        "at the light itself"
    );

    let spot = |degrees: f32| {
        let axis = Vec3::new(degrees.to_radians().sin(), 0.0, degrees.to_radians().cos());
        let light = Light::spot(Vec3::ZERO, axis, 0.9, 0.7, Vec3::ONE, f32::INFINITY);
        light.sample(Vec3::Z, Vec2::ZERO).map_or(0.0, |p| p.radiance.x)
    };
    assert!((spot(0.0) - 1.0).abs() < 1e-6 && (spot(25.0) - 1.0).abs() < 1e-6);
    let ramp = ((0.8 - 0.7) / 0.2_f32).powi(2);
    assert!((spot(0.8_f32.acos().to_degrees()) - ramp).abs() < 1e-5);
    assert_eq!(spot(46.0), 0.0);

    let sun = Light::directional(-Vec3::Y, Vec3::splat(7.0))
        .sample(at, Vec2::ZERO)
        .unwrap();
    assert!(sun.wi_ws == Vec3::Y && sun.distance == f32::INFINITY && sun.radiance.x == 7.0);
}

/// Power is what arrives on a sphere around the light. Fails once in 1,000 seeds.
#[test]
fn powers_are_what_leaves() {
    let random = Random::new(5, 0, 0);
    let lights = [
        lamp(0.3, false),
        lamp(0.3, true),
        Light::point(Vec3::ONE, Vec3::new(1.0, 2.0, 3.0), f32::INFINITY),
        Light::spot(Vec3::ONE, Vec3::X, 0.9, 0.6, Vec3::ONE, f32::INFINITY),
        Light::spot(Vec3::ONE, Vec3::X, 0.8, 0.8, Vec3::ONE, f32::INFINITY),
    ];
    for (case, light) in lights.iter().enumerate() {
        let radius = 50.0;
        let mut moments = Moments::default();
        for i in 0..1 << 16 {
            let outwards = uniform_sphere(random.vec2(4 * i));
            let at = light.center_ws() + outwards * radius;
            let arriving = light.sample(at, random.vec2(4 * i + 2)).map_or(0.0, |p| {
                crate::luminance(p.radiance) * p.wi_ws.dot(-outwards).max(0.0) / p.pdf_solid_angle
            });
            moments.push(f64::from(arriving * 4.0 * PI * radius * radius));
        }
        let z = (moments.mean() - f64::from(light.power)) / moments.standard_error().max(1e-5 * f64::from(light.power));
        assert!(
            normal_p_two_sided(z) > 1e-3 / lights.len() as f64,
            "case {case}: {} for {}",
            moments.mean(),
            light.power
        );
    }
}

#[test]
fn degenerate_triangles_are_no_lights() {
    let line = [Vec3::ZERO, Vec3::X, Vec3::X * 2.0];
    assert!(Light::triangle(line, Vec3::ONE, false).is_none());
    assert!(Light::triangle([Vec3::ONE; 3], Vec3::ONE, false).is_none());
    assert!(Light::triangle([Vec3::ZERO, Vec3::NAN, Vec3::X], Vec3::ONE, false).is_none());
    // A micrometre wide, a kilometre from the origin: f32 cross products of positions would vanish.
    let (a, step) = (Vec3::splat(1000.0), 1e-4);
    assert!(Light::triangle([a, a + Vec3::X * step, a + Vec3::Y * step], Vec3::ONE, false).is_some());
}

#[test]
fn records_stay_small() {
    assert!(size_of::<Light>() <= 112);
}
