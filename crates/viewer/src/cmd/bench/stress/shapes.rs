//! Triangles of every size and shape as lights, and points that touch them.

use super::bench::{Bench, NEVER, STANDARD_ERRORS, Shot};
use super::scenes::methods;
use anyhow::Result;
use glam::{DVec3, Vec2, Vec3};
use render::Method;
use sampling::hemisphere::uniform_sphere;
use sampling::{Random, SphericalRectangle, SphericalTriangle};
use scene::assemble::Builder;
use scene::{Camera, Light, Material};
use std::f64::consts::{PI, TAU};

/// Checks the family.
pub(super) fn check(bench: &mut Bench) -> Result<()> {
    solid_angles(bench)?;
    points_and_densities(bench)?;
    tiny_lights(bench)?;
    no_lights(bench)?;
    touching(bench)?;
    on_a_light(bench)?;
    coincident(bench)
}

/// Solid angle of the triangle with these corners, in `f64`: Van Oosterom and Strackee (1983).
fn solid_angle([a, b, c]: [Vec3; 3]) -> f64 {
    let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
    let determinant = a.dot((b - a).cross(c - a)).abs();
    let [la, lb, lc] = [a, b, c].map(DVec3::length);
    2.0 * determinant.atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb)
}

/// A triangle of about `solid_angle` sr as seen from the origin, of any shape and slant.
fn seen_triangle(random: Random, solid_angle: f64) -> [Vec3; 3] {
    let distance = 10_f32.powf(6.0 * random.f32(10) - 3.0);
    let center = uniform_sphere(random.vec2(0)) * distance;
    let size = distance * solid_angle.sqrt() as f32;
    // Up to a thousand times as long as wide.
    let stretch = 10_f32.powf(3.0 * random.f32(11));
    let along = uniform_sphere(random.vec2(2));
    let across = uniform_sphere(random.vec2(4));
    [
        center,
        center + along * size * stretch.sqrt(),
        center + across * size / stretch.sqrt(),
    ]
}

/// By how much rounding the corners of a triangle can change its solid angle, relative to it: large for needles, for triangles seen edge-on,
/// and for those of which an edge passes close by; 1 for compact ones.
fn condition([a, b, c]: [Vec3; 3]) -> f64 {
    let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
    let (edge1, edge2) = (b - a, c - a);
    let flat = a.length() * edge1.length() * edge2.length() / a.dot(edge1.cross(edge2)).abs();
    let passing = |p: DVec3, q: DVec3| 2.0 / (1.0 + p.normalize().dot(q.normalize()));
    flat.max(passing(a, b)).max(passing(b, c)).max(passing(c, a))
}

/// Largest deviations of solid angles.
#[derive(Default)]
struct Deviations {
    /// Relative error of those that are well conditioned.
    compact: f64,
    /// Relative error of all others, in units of what rounding their corners does.
    others: f64,
}

impl Deviations {
    fn compare(&mut self, found: Option<f32>, expected: f64, condition: f64) {
        // Nearly a half space, or nearly nothing: not what is promised.
        if !(1e-9..=TAU - 0.1).contains(&expected) {
            return;
        }
        let error = (found.map_or(0.0, f64::from) / expected - 1.0).abs();
        if condition < 10.0 {
            self.compact = self.compact.max(error);
        } else {
            self.others = self.others.max(error / (condition * f64::from(f32::EPSILON)));
        }
    }
}

/// Solid angles in `f32` against `f64`.
fn solid_angles(bench: &mut Bench) -> Result<()> {
    let count = bench.pick(2_000, 100_000, 1_000_000);
    for exponent in [0, -2, -4, -6, -8] {
        let hazard = format!("solid angles about 1e{exponent} sr");
        bench.now(&hazard)?;
        let (mut triangles, mut rectangles) = (Deviations::default(), Deviations::default());
        for i in 0..count {
            let random = Random::new(1, i, (-exponent) as u32);
            let [a, b, c] = seen_triangle(random, 10_f64.powi(exponent));
            let found = SphericalTriangle::new(a, b, c).map(|triangle| triangle.solid_angle);
            triangles.compare(found, solid_angle([a, b, c]), condition([a, b, c]));
            let edge = b - a;
            let side = edge.any_orthogonal_vector().normalize() * edge.length() * 0.3;
            let halves = [[a, a + edge, a + edge + side], [a, a + edge + side, a + side]];
            let found = SphericalRectangle::new(a, edge, side).map(|rectangle| rectangle.solid_angle);
            let worse = condition(halves[0]).max(condition(halves[1]));
            rectangles.compare(found, halves.map(solid_angle).iter().sum(), worse);
        }
        for (subject, found) in [("spherical triangle", triangles), ("spherical rectangle", rectangles)] {
            bench.check(&hazard, subject, ("relative error, compact", 1e-5), found.compact);
            bench.check(&hazard, subject, ("roundings of the corners", 8.0), found.others);
        }
    }
    Ok(())
}

/// Points drawn on lights of every shape lie on them, their densities are finite and are those that hits are given.
fn points_and_densities(bench: &mut Bench) -> Result<()> {
    let count = bench.pick(2_000, 100_000, 1_000_000);
    for (hazard, exponents) in [
        ("lights of 0.1 to 10 sr", [-1.0, 1.0]),
        ("lights of 1e-8 to 0.1 sr", [-8.0, -1.0]),
        ("lights of 1e-20 to 1e-8 sr", [-20.0, -8.0]),
    ] {
        bench.now(hazard)?;
        let (mut drawn, mut off, mut broken, mut unlike) = (0_u32, 0_u32, 0_u32, 0_u32);
        for i in 0..count {
            let random = Random::new(2, i, 0);
            let exponent = exponents[0] + (exponents[1] - exponents[0]) * random.f32(12);
            let corners = seen_triangle(random, 10_f64.powf(f64::from(exponent)));
            let Some(light) = Light::triangle(corners, Vec3::ONE, true) else {
                continue;
            };
            let corner = |bits: u32| [0.0, 1.0 - f32::EPSILON / 2.0, random.f32(6), random.f32(7)][bits as usize % 4];
            let Some(point) = light.sample(Vec3::ZERO, Vec2::new(corner(i), corner(i / 4))) else {
                continue;
            };
            drawn += 1;
            let finite = point.wi_ws.is_finite() && point.distance.is_finite() && point.pdf_solid_angle.is_finite();
            broken += u32::from(!finite || point.pdf_solid_angle <= 0.0 || point.distance <= 0.0);
            let at = point.wi_ws.as_dvec3() * f64::from(point.distance);
            let extent = corners[0].distance(corners[1]).max(corners[0].distance(corners[2]));
            // A direction and a distance in single precision cannot name a point better: where the light is seen edge-on, 1e-6 rad reach far
            // along it. Of a triangle that spans nearly half of all directions, an edge spans nearly half a turn: the cosine of the angle along
            // it, by which its points are drawn, is nearly -1, and has no more than 1e-4 rad left.
            let vast = point.pdf_solid_angle < 1.0 / 6.0;
            let cosine = at.normalize().dot(normal(corners)).abs();
            let tolerance = 1e-3 * f64::from(extent) + if vast { 1e-4 } else { 1e-6 } * at.length() / cosine;
            off += u32::from(beyond(corners, at) > tolerance);
            let again = light.pdf_solid_angle(Vec3::ZERO, point.wi_ws, point.distance);
            unlike += u32::from((again / point.pdf_solid_angle - 1.0).abs() > 1e-3);
        }
        let undrawn = f64::from(drawn < count / 4);
        bench.check(hazard, "lights that cannot be drawn", NEVER, undrawn);
        bench.check(
            hazard,
            "points or densities that are not finite",
            NEVER,
            f64::from(broken),
        );
        bench.check(
            hazard,
            "densities of sample and pdf that differ",
            NEVER,
            f64::from(unlike),
        );
        bench.check(hazard, "points off the light", NEVER, f64::from(off));
    }
    Ok(())
}

/// How far `at`, on its plane or nearly so, lies outside of the triangle, metres; 0 inside.
fn beyond(corners: [Vec3; 3], at: DVec3) -> f64 {
    let normal = normal(corners);
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    let inside = |p: DVec3, q: DVec3| (q - p).cross(at - p).dot(normal) / p.distance(q);
    let least = inside(a, b).min(inside(b, c)).min(inside(c, a));
    (-least).max(0.0).max((at - a).dot(normal).abs())
}

fn normal(corners: [Vec3; 3]) -> DVec3 {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    (b - a).cross(c - a).normalize_or_zero()
}

/// A scene of one small light above a floor of albedo 1, and the radiance of the point below it.
struct Spot {
    builder: Builder,
    camera: Camera,
    radiance: f64,
}

/// Lights down to 1e-20 of the scene's area (half of that is where triangles stop being lights, see [`no_lights`]), and needles: as bright
/// as a point of their intensity.
fn tiny_lights(bench: &mut Bench) -> Result<()> {
    let height = 2.0;
    for (hazard, edges) in [
        ("light of 1e-6 of the scene's area", [1e-2, 1e-2]),
        ("light of 1e-12 of the scene's area", [1e-5, 1e-5]),
        ("light of 1e-18 of the scene's area", [1e-8, 1e-8]),
        ("light of 1e-20 of the scene's area", [1.42e-9, 1.42e-9]),
        ("needle of 1 to 1e6", [1e-1, 1e-7]),
        ("needle of 1 to 1e8", [1e-1, 1e-9]),
    ] {
        let area = 0.5 * edges[0] * edges[1];
        let spot = spot(height, edges, 1.0 / area);
        let scene = spot.builder.build()?;
        for (name, method) in methods() {
            bench.now(format_args!("{hazard}, {name}"))?;
            let estimate = Shot::new(&scene, &spot.camera, method, (8, 8))
                .effort(16, 16)
                .estimate()?;
            // The light's extent, and that of the spot that is seen, change the cosines a little.
            let deviation = estimate.deviation_beyond(spot.radiance, 2e-3);
            bench.check(hazard, name, STANDARD_ERRORS, deviation);
            bench.check(hazard, name, NEVER, estimate.broken as f64);
        }
    }
    Ok(())
}

/// Triangles that are too small for lights, or have no area at all, are named, and break nothing.
fn no_lights(bench: &mut Bench) -> Result<()> {
    for (hazard, edges) in [
        ("emitter of 1e-22 of the scene's area", [1e-10, 1e-10]),
        ("emitter of 1e-32 of the scene's area", [1e-15, 1e-15]),
        ("emitter without width", [1e-1, 0.0]),
        ("emitter without area", [0.0, 0.0]),
    ] {
        let spot = spot(2.0, edges, 1e20);
        let scene = spot.builder.build()?;
        let unsaid = !scene.parts.report.warnings.iter().any(|w| w.contains("without area"));
        bench.check(hazard, "warnings that are missing", NEVER, f64::from(u8::from(unsaid)));
        // The other one, which lights nothing that is seen.
        bench.check(
            hazard,
            "lights beyond one",
            NEVER,
            scene.lights.len().abs_diff(1) as f64,
        );
        for (name, method) in methods() {
            bench.now(format_args!("{hazard}, {name}"))?;
            let estimate = Shot::new(&scene, &spot.camera, method, (8, 8))
                .effort(4, 1)
                .estimate()?;
            bench.check(hazard, name, NEVER, estimate.broken as f64);
            bench.check(hazard, name, ("luminance", 0.0), estimate.mean.mean());
        }
    }
    Ok(())
}

fn spot(height: f64, edges: [f64; 2], radiance: f64) -> Spot {
    let mut builder = Builder::default();
    let floor = builder.material(Material::lambert("floor", Vec3::ONE));
    let lamp = builder.material(Material::emitter("lamp", Vec3::splat(radiance as f32)));
    builder.quad(Vec3::new(-5.0, 0.0, -5.0), Vec3::Z * 10.0, Vec3::X * 10.0, floor);
    // Near the origin's axis, where small edges have all their digits; another, black from here, so that there is a choice.
    let corner = Vec3::new(0.0, height as f32, 0.0);
    builder.triangle(
        [
            corner,
            corner + Vec3::X * edges[0] as f32,
            corner + Vec3::Z * edges[1] as f32,
        ],
        lamp,
    );
    let hidden = Vec3::new(3.0, -1.0, 3.0);
    builder.triangle([hidden, hidden + Vec3::X, hidden + Vec3::Z], lamp);
    let camera = Camera::look_at(
        "meter",
        Vec3::new(1.0, 0.5, 0.0),
        Vec3::new(0.01, 0.0, 0.0),
        Vec3::Y,
        1e-3,
    );
    let area = 0.5 * edges[0] * edges[1];
    Spot {
        builder,
        camera,
        radiance: radiance * area / (height * height) / PI,
    }
}

/// Irradiance at the origin, normal +y, of a convex polygon of unit radiance wholly above the horizon: J. H. Lambert, Photometria (1760).
fn polygon_irradiance(corners: &[DVec3]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    let edges = corners.iter().zip(next).map(|(a, b)| {
        let normal = a.cross(*b);
        let angle = normal.length().atan2(a.dot(*b));
        angle * normal.normalize_or_zero().y
    });
    0.5 * edges.sum::<f64>().abs()
}

/// A wall of light that stands on the floor, seen from closer and closer to where they touch, and at grazing angles.
fn touching(bench: &mut Bench) -> Result<()> {
    let mut builder = Builder::default();
    let floor = builder.material(Material::lambert("floor", Vec3::ONE));
    let lamp = builder.material(Material::emitter("lamp", Vec3::ONE));
    builder.quad(Vec3::new(-8.0, 0.0, -8.0), Vec3::Z * 16.0, Vec3::X * 16.0, floor);
    builder.quad(Vec3::new(0.0, 0.0, -1.0), Vec3::Y, Vec3::Z * 2.0, lamp);
    let scene = builder.build()?;
    for distance in [1.0, 1e-1, 1e-2, 1e-3, 1e-4, -1e-3] {
        let at = Vec3::new(distance, 0.0, 0.0);
        // Steep enough to pass the lamp, and narrow enough to see one point.
        let eye = at + Vec3::new(2.0 * distance, 4.0, 0.0);
        let camera = Camera::look_at("meter", eye, at, Vec3::X, (0.02 * distance.abs() / 4.0).max(1e-6));
        let relative = |x: f64, y: f64, z: f64| DVec3::new(x, y, z) - at.as_dvec3();
        let corners = [
            relative(0.0, 0.0, -1.0),
            relative(0.0, 1.0, -1.0),
            relative(0.0, 1.0, 1.0),
            relative(0.0, 0.0, 1.0),
        ];
        let behind = distance < 0.0;
        let expected = if behind { 0.0 } else { polygon_irradiance(&corners) / PI };
        for (name, method) in methods() {
            let hazard = match behind {
                true => "behind a light that stands on the floor".into(),
                false => format!("{distance} m from a light that stands on the floor"),
            };
            bench.now(format_args!("{hazard}, {name}"))?;
            let estimate = Shot::new(&scene, &camera, method, (8, 8))
                .effort(bench.pick(16, 64, 256), 16)
                .estimate()?;
            bench.check(&hazard, name, NEVER, estimate.broken as f64);
            if behind {
                bench.check(&hazard, name, ("luminance", 0.0), estimate.mean.mean());
            } else {
                bench.check(&hazard, name, STANDARD_ERRORS, estimate.deviation(expected));
            }
        }
    }
    Ok(())
}

/// A light that is looked at reflects the light of others and none of its own.
fn on_a_light(bench: &mut Bench) -> Result<()> {
    let mut builder = Builder::default();
    let lamp = builder.material(Material {
        emission: Vec3::splat(3.0),
        ..Material::lambert("lamp", Vec3::ONE)
    });
    builder.quad(Vec3::new(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, lamp);
    let scene = builder.build()?;
    for (hazard, eye) in [
        ("looking at a light", Vec3::new(0.3, 2.0, 0.1)),
        ("looking along a light", Vec3::new(3.0, 1e-4, 0.1)),
    ] {
        let camera = Camera::look_at("meter", eye, Vec3::new(0.3, 0.0, 0.1), Vec3::Z, 1e-5);
        for (name, method) in methods() {
            bench.now(format_args!("{hazard}, {name}"))?;
            let mut shot = Shot::new(&scene, &camera, method, (8, 8)).effort(16, 2);
            shot.settings.max_bounces = 2;
            let estimate = shot.estimate()?;
            bench.check(
                hazard,
                name,
                ("relative error", 1e-6),
                (estimate.mean.mean() / 3.0 - 1.0).abs(),
            );
        }
    }
    Ok(())
}

/// Lights and surfaces in the same place: whatever is seen, all methods see the same, and nothing is broken.
fn coincident(bench: &mut Bench) -> Result<()> {
    let mut builder = Builder::default();
    let floor = builder.material(Material::lambert("floor", Vec3::splat(0.5)));
    let lamp = builder.material(Material {
        double_sided: false,
        ..Material::emitter("lamp", Vec3::ONE)
    });
    for _ in 0..2 {
        builder.quad(Vec3::new(-5.0, 0.0, -5.0), Vec3::Z * 10.0, Vec3::X * 10.0, floor);
        builder.quad(Vec3::new(-1.0, 2.0, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0, lamp);
    }
    let scene = builder.build()?;
    let camera = Camera::look_at("above", Vec3::new(0.0, 1.5, 4.0), Vec3::ZERO, Vec3::Y, 0.5);
    let hazard = "everything twice in the same place";
    let effort = (bench.pick(16, 32, 128), 16);
    let shot = |method| Shot::new(&scene, &camera, method, (16, 12)).effort(effort.0, effort.1);
    let exact = shot(Method::Exact).seed(1000).estimate()?;
    for (name, method) in methods() {
        bench.now(format_args!("{hazard}, {name}"))?;
        let estimate = shot(method).estimate()?;
        bench.check(hazard, name, NEVER, estimate.broken as f64);
        bench.check(hazard, name, STANDARD_ERRORS, estimate.deviation_from(&exact));
    }
    Ok(())
}
