//! What a sample costs outside of tracing: nanoseconds for resolving a hit, drawing from a light, drawing from a BSDF; and the
//! seconds that preparing a million lights takes. `cargo bench -p scene --bench shading`.

use glam::{Affine3A, Quat, Vec2, Vec3, Vec3Swizzles};
use sampling::random::Random;
use scene::{Bsdf, Hit, Instance, Light, Material, Mesh, PrimitiveId, Ray, Scene, SceneParts};
use std::hint::black_box;
use std::time::Instant;

/// Prints nanoseconds per call: the least of several runs, which other work on the machine disturbs least.
fn time<T>(what: &str, calls: usize, mut call: impl FnMut(usize) -> T) {
    let mut best = f64::INFINITY;
    for _ in 0..7 {
        let start = Instant::now();
        for i in 0..calls {
            black_box(call(i));
        }
        best = best.min(start.elapsed().as_secs_f64());
    }
    println!("{what:<44} {:8.2} ns", best / calls as f64 * 1e9);
}

/// A bumpy field of `side` x `side` x 2 triangles.
fn field(side: u32, smooth: bool, emissive: bool) -> SceneParts {
    let random = Random::new(1, 0, 0);
    let mut mesh = Mesh::default();
    for i in 0..=side {
        for j in 0..=side {
            let height = random.f32(i * (side + 1) + j);
            mesh.positions.push(Vec3::new(i as f32, height, j as f32));
        }
    }
    for i in 0..side {
        for j in 0..side {
            let (a, b) = (i * (side + 1) + j, (i + 1) * (side + 1) + j);
            mesh.indices.extend([[a, a + 1, b], [b, a + 1, b + 1]]);
        }
    }
    if smooth {
        mesh.normals = vec![Vec3::new(0.1, 0.99, 0.0).normalize(); mesh.positions.len()];
    }
    let material = if emissive { 1 } else { 0 };
    mesh.materials = vec![material; mesh.indices.len()];
    SceneParts {
        name: "field".into(),
        meshes: vec![mesh.into()],
        instances: vec![Instance::identity(0, 0)],
        materials: vec![
            Material::lambert("grey", Vec3::splat(0.5)),
            Material::emitter("glow", Vec3::ONE),
        ],
        ..SceneParts::default()
    }
}

/// Rays and hits in random order.
fn hits(scene: &Scene, count: u32) -> Vec<(Ray, Hit)> {
    let random = Random::new(2, 0, 0);
    let triangles = scene.parts.meshes[0].len() as u32;
    let hit = |i: u32| {
        let triangle = random.u32(2 * i) % triangles;
        let [a, b, c] = scene.parts.meshes[0].corners(triangle as usize);
        let target = (a + b + c) / 3.0;
        let direction_ws = Vec3::new(0.3, -1.0, 0.2).normalize();
        let ray = Ray {
            origin_ws: target - direction_ws * 10.0,
            direction_ws,
            t_max: f32::INFINITY,
        };
        let id = PrimitiveId { instance: 0, triangle };
        (
            ray,
            Hit {
                t: 10.0,
                u: 1.0 / 3.0,
                v: 1.0 / 3.0,
                id,
            },
        )
    };
    (0..count).map(hit).collect()
}

fn surfaces() {
    for (side, size) in [(50, "5,000 triangles"), (1000, "2,000,000 triangles")] {
        for (what, smooth, emissive) in [
            ("flat", false, false),
            ("smooth", true, false),
            ("emissive", false, true),
        ] {
            let scene = Scene::new(field(side, smooth, emissive)).expect("the field is a valid scene");
            let hits = hits(&scene, 1 << 16);
            time(&format!("surface, {what}, {size}"), hits.len(), |i| {
                scene.surface(&hits[i].0, &hits[i].1)
            });
        }
    }
    let mut parts = field(50, false, false);
    parts.instances[0] = Instance::new(0, 0, Affine3A::from_quat(Quat::from_rotation_y(1.0))).expect("a rotation");
    let scene = Scene::new(parts).expect("the field is a valid scene");
    let hits = hits(&scene, 1 << 16);
    time("surface, flat, 5,000 triangles, instanced", hits.len(), |i| {
        scene.surface(&hits[i].0, &hits[i].1)
    });
}

fn lights() {
    let random = Random::new(3, 0, 0);
    let vec3 = |i: u32| Vec3::new(random.f32(i), random.f32(i + 1), random.f32(i + 2));
    for (what, size, distance) in [("far: by area", 0.1, 5.0), ("near: by solid angle", 1.0, 1.0)] {
        let triangle = |i: u32| {
            let at = vec3(9 * i) * 4.0;
            let corners = [at, at + Vec3::X * size, at + Vec3::Z * size];
            Light::triangle(corners, Vec3::ONE, false).expect("a triangle with an area")
        };
        let cases: Vec<(Light, Vec3, Vec2)> = (0..4096)
            .map(|i| {
                let light = triangle(i);
                let from = light.center_ws() - Vec3::Y * distance;
                (light, from, random.vec2(50_000 + 2 * i))
            })
            .collect();
        time(&format!("Light::sample, triangle {what}"), cases.len(), |i| {
            let (light, from, u) = &cases[i];
            light.sample(*from, *u)
        });
        time(&format!("Light::pdf_solid_angle, {what}"), cases.len(), |i| {
            let (light, from, _) = &cases[i];
            light.pdf_solid_angle(*from, Vec3::Y, distance)
        });
        time(&format!("unshadowed_irradiance, {what}"), cases.len(), |i| {
            let (light, from, _) = &cases[i];
            light.unshadowed_irradiance(*from, Vec3::Y)
        });
    }
    let points: Vec<Light> = (0..4096)
        .map(|i| Light::point(vec3(3 * i), Vec3::ONE, f32::INFINITY))
        .collect();
    time("Light::sample, point", points.len(), |i| {
        points[i].sample(Vec3::splat(2.0), Vec2::ZERO)
    });
}

fn bsdfs() {
    let random = Random::new(4, 0, 0);
    let glossy = Bsdf {
        normal_ws: Vec3::Y,
        diffuse: Vec3::splat(0.5),
        f0: Vec3::splat(0.04),
        f90: 1.0,
        alpha: 0.2,
    };
    let lambert = Bsdf {
        f0: Vec3::ZERO,
        f90: 0.0,
        ..glossy
    };
    let directions: Vec<(Vec3, Vec3, Vec2)> = (0..4096)
        .map(|i| {
            let up = |d: u32| (sampling::hemisphere::cosine_hemisphere(random.vec2(8 * i + d))).xzy();
            (up(0), up(2), random.vec2(8 * i + 4))
        })
        .collect();
    for (what, bsdf) in [("Lambert", lambert), ("layered", glossy)] {
        time(&format!("Bsdf::eval_pdf, {what}"), directions.len(), |i| {
            black_box(bsdf).eval_pdf(directions[i].0, directions[i].1)
        });
        time(&format!("Bsdf::sample, {what}"), directions.len(), |i| {
            black_box(bsdf).sample(directions[i].0, directions[i].2.x, directions[i].2)
        });
    }
}

/// Seconds before and without the BVH.
fn preparation() {
    let parts = field(708, false, true);
    let start = Instant::now();
    let scene = Scene::new(parts).expect("the field is a valid scene");
    let whole = start.elapsed().as_secs_f64();
    let without = whole - scene.build_s;
    println!(
        "Scene::new, {} lights: {without:.3} s, and {:.3} s for the BVH",
        scene.lights.len(),
        scene.build_s
    );
}

fn main() {
    surfaces();
    lights();
    bsdfs();
    preparation();
}
