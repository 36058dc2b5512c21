//! Scenes whose image is known in closed form: no other rendering is consulted.

use glam::{DVec3, Vec3};
use light_cache::SamplerKind;
use render::Method;
use scene::{Camera, Material, Scene};
use tests::compare::{Case, Plan, sampled};
use tests::scenes::{Builder, directional, ground, meter, point, spot};

/// Asserts that the mean luminance of the image is `expected` to within 4 standard errors (a right program fails once
/// in 15,000) plus the rounding of single precision.
fn assert_radiance(what: &str, scene: &Scene, camera: &Camera, plan: &Plan, expected: f64) {
    let measured = Case::new(scene, camera, plan.clone()).estimate().mean;
    let difference = (measured.mean() - expected).abs();
    let tolerance = 4.0 * measured.standard_error() + 2e-5 * expected;
    assert!(
        difference <= tolerance,
        "{what}: {} +- {}, expected {expected}",
        measured.mean(),
        measured.standard_error()
    );
    assert!(
        measured.standard_error() < 0.01 * expected.max(1e-3),
        "{what}: too noisy to tell"
    );
}

fn few_methods() -> impl Iterator<Item = Method> {
    [
        Method::Exact,
        sampled(SamplerKind::Uniform),
        sampled(SamplerKind::Tree),
        sampled(SamplerKind::Table),
    ]
    .into_iter()
}

/// A closed box that emits `radiance` and reflects `albedo` everywhere: after n bounces beyond the first surface every
/// point shows radiance x (1 + albedo + ... + albedo^(n + 1)), and 1 / (1 - albedo) times the radiance in the end.
#[test]
fn furnace() {
    let (radiance, albedo) = (1.0, 0.5_f64);
    let mut builder = Builder::default();
    let wall = builder.material(Material {
        emission: Vec3::splat(radiance as f32),
        ..Material::lambert("wall", Vec3::splat(albedo as f32))
    });
    builder.room(Vec3::new(-1.0, -1.0, -1.0), Vec3::new(2.0, 1.0, 1.5), wall);
    let scene = builder.build().expect("the scene is valid");
    assert_eq!(scene.lights.len(), 12, "each emissive triangle is a light");
    let camera = Camera::look_at(
        "inside",
        Vec3::new(0.2, 0.1, 0.4),
        Vec3::new(1.0, 0.3, -1.0),
        Vec3::Y,
        1.5,
    );
    for bounces in [0, 1, 2, 4, 24] {
        let expected = (0..=bounces + 1).map(|n| radiance * albedo.powi(n)).sum();
        for method in Method::all() {
            let plan = Plan::new(method, 12, 8).bounces(bounces as u32).effort(16, 12);
            assert_radiance(
                &format!("{} bounces, {}", bounces, method.name()),
                &scene,
                &camera,
                &plan,
                expected,
            );
        }
    }
    let limit: f64 = (0..=25).map(|n| albedo.powi(n)).sum();
    assert!(
        (limit - radiance / (1.0 - albedo)).abs() < 1e-7,
        "24 bounces are as good as all"
    );
}

/// A glossy white furnace cannot return more than it gets; a Lambert one returns all of it.
#[test]
fn nothing_reflects_more_than_it_receives() {
    for (name, f0, roughness) in [
        ("dielectric", 0.04, 0.3),
        ("rough", 0.04, 1.0),
        ("metal-like", 1.0, 0.5),
    ] {
        let mut builder = Builder::default();
        let shell = builder.material(Material {
            double_sided: true,
            ..Material::emitter("shell", Vec3::ONE)
        });
        let white = builder.material(Material {
            roughness,
            dielectric_f0: Vec3::splat(f0),
            dielectric_f90: 1.0,
            ..Material::lambert("white", Vec3::ONE)
        });
        builder.room(Vec3::splat(-3.0), Vec3::splat(3.0), shell);
        builder.quad(Vec3::new(-0.5, 0.0, -0.5), Vec3::Z, Vec3::X, white);
        let camera = meter(Vec3::new(0.0, 1.5, 1.0), Vec3::ZERO, 0.3);
        let plan = Plan::new(Method::Exact, 4, 4).effort(64, 16);
        let seen = Case::new(&builder.build().expect("the scene is valid"), &camera, plan)
            .estimate()
            .mean;
        assert!(
            seen.mean() <= 1.0 + 4.0 * seen.standard_error() + 1e-4,
            "{name} returns {}",
            seen.mean()
        );
        assert!(seen.mean() > 0.5, "{name} returns {}", seen.mean());
    }
}

/// Irradiance at the origin, normal `normal`, from a polygon of radiance 1 entirely above the horizon, counter-clockwise
/// seen from the origin: J. H. Lambert (1760), 1/2 sum of edge angles times the edge normals' cosines.
fn polygon_irradiance(vertices: &[DVec3], normal: DVec3) -> f64 {
    let pairs = vertices.iter().zip(vertices.iter().cycle().skip(1));
    let sum: f64 = pairs
        .map(|(a, b)| a.angle_between(*b) * a.cross(*b).normalize().dot(normal))
        .sum();
    (0.5 * sum).abs()
}

#[test]
fn square_lamp_has_its_form_factor() {
    let albedo = 0.8;
    for (corner, edge) in [
        (Vec3::new(-0.5, 1.0, -0.5), 1.0),
        (Vec3::new(0.3, 0.2, 0.1), 0.7),
        (Vec3::new(2.0, 3.0, 1.0), 0.05),
    ] {
        let mut builder = Builder::default();
        let floor = builder.material(Material::lambert("floor", Vec3::splat(albedo)));
        let lamp = builder.material(Material::emitter("lamp", Vec3::splat(7.0)));
        ground(&mut builder, floor);
        builder.quad(corner, Vec3::X * edge, Vec3::Z * edge, lamp);
        let vertices = [
            corner,
            corner + Vec3::X * edge,
            corner + (Vec3::X + Vec3::Z) * edge,
            corner + Vec3::Z * edge,
        ];
        let irradiance = 7.0 * polygon_irradiance(&vertices.map(|v| v.as_dvec3()), DVec3::Y);
        let expected = irradiance * f64::from(albedo) / std::f64::consts::PI;
        let scene = builder.build().expect("the scene is valid");
        // The point lies on the edge that the triangles of the ground share: neither may hide the lamp from the other, however close it is.
        let meters = [1e-4, 1e-5].map(|size| meter(Vec3::new(-3.0, 0.15, 0.5), Vec3::ZERO, size));
        for (camera, method) in meters
            .iter()
            .flat_map(|camera| few_methods().map(move |method| (camera, method)))
        {
            let plan = Plan::new(method, 2, 2).effort(256, 16);
            assert_radiance(
                &format!("lamp at {corner}, {}", method.name()),
                &scene,
                camera,
                &plan,
                expected,
            );
        }
    }
}

#[test]
fn a_lamp_shines_forward_only_unless_it_is_double_sided() {
    for double_sided in [false, true] {
        let mut builder = Builder::default();
        let floor = builder.material(Material::lambert("floor", Vec3::ONE));
        let lamp = builder.material(Material {
            double_sided,
            ..Material::emitter("lamp", Vec3::ONE)
        });
        ground(&mut builder, floor);
        // Its front looks up, away from the ground.
        builder.quad(Vec3::new(-0.5, 1.0, -0.5), Vec3::Z, Vec3::X, lamp);
        let vertices = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(x, z)| DVec3::new(x, 1.0, z));
        let lit = polygon_irradiance(&vertices, DVec3::Y) / std::f64::consts::PI;
        let camera = meter(Vec3::new(-3.0, 0.15, 0.5), Vec3::ZERO, 1e-4);
        for method in few_methods() {
            let plan = Plan::new(method, 2, 2).effort(256, 16);
            let expected = if double_sided { lit } else { 0.0 };
            assert_radiance(
                &format!("double-sided {double_sided}, {}", method.name()),
                &builder.build().expect("the scene is valid"),
                &camera,
                &plan,
                expected,
            );
        }
    }
}

/// Radiance of the ground at the origin under one punctual light.
fn assert_ground(what: &str, light: scene::Light, irradiance: f64) {
    let albedo = 0.6;
    let mut builder = Builder::default();
    let floor = builder.material(Material::lambert("floor", Vec3::splat(albedo)));
    ground(&mut builder, floor);
    builder.light(light);
    let camera = meter(Vec3::new(1.0, 2.0, 0.5), Vec3::ZERO, 1e-4);
    let expected = irradiance * f64::from(albedo) / std::f64::consts::PI;
    for method in few_methods() {
        let plan = Plan::new(method, 2, 2).effort(4, 4);
        assert_radiance(
            &format!("{what}, {}", method.name()),
            &builder.build().expect("the scene is valid"),
            &camera,
            &plan,
            expected,
        );
    }
}

#[test]
fn point_light_irradiance() {
    for position in [Vec3::new(0.0, 2.0, 0.0), Vec3::new(1.0, 0.5, -2.0)] {
        let distance = f64::from(position.length());
        let expected = 3.0 * f64::from(position.y) / distance.powi(3);
        assert_ground("point", point(position, Vec3::splat(3.0)), expected);
        assert_ground(
            "point out of range",
            scene::Light {
                range: 1.5,
                ..point(position, Vec3::splat(3.0))
            },
            0.0,
        );
    }
    assert_ground("below the ground", point(Vec3::new(0.0, -1.0, 0.0), Vec3::ONE), 0.0);
}

#[test]
fn spot_light_cone() {
    let (inner, outer) = (0.3_f32, 0.6_f32);
    for angle in [0.0_f32, 0.29, 0.35, 0.45, 0.55, 0.61] {
        let (sin, cos) = angle.sin_cos();
        let light = spot(Vec3::Y * 2.0, Vec3::new(sin, -cos, 0.0), Vec3::splat(5.0), inner, outer);
        // KHR_lights_punctual: the square of a linear fall-off in the cosine.
        let (inner, outer) = (f64::from(inner).cos(), f64::from(outer).cos());
        let falloff = ((f64::from(angle).cos() - outer) / (inner - outer))
            .clamp(0.0, 1.0)
            .powi(2);
        assert_ground(&format!("spot {angle} off its axis"), light, 5.0 / 4.0 * falloff);
    }
}

#[test]
fn directional_light_irradiance() {
    let down = Vec3::new(0.6, -0.8, 0.0);
    assert_ground("directional", directional(down, Vec3::splat(2.5)), 2.5 * 0.8);
    assert_ground("from below", directional(-down, Vec3::splat(2.5)), 0.0);
}

/// Emission is seen as it is, and one-sided emitters are not there from behind.
#[test]
fn emission_is_radiance() {
    let mut builder = Builder::default();
    let lamp = builder.material(Material::emitter("lamp", Vec3::splat(3.25)));
    builder.quad(Vec3::new(-1.0, -1.0, 0.0), Vec3::X * 2.0, Vec3::Y * 2.0, lamp);
    let scene = builder.build().expect("the scene is valid");
    for (z, expected) in [(2.0, 3.25), (-2.0, 0.0)] {
        let camera = meter(Vec3::new(0.1, 0.2, z), Vec3::ZERO, 0.5);
        for method in few_methods() {
            assert_radiance("lamp", &scene, &camera, &Plan::new(method, 4, 4).effort(2, 2), expected);
        }
    }
}
