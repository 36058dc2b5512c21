//! Closed rooms: no ray gets out, no light gets in, and no surface hides what it faces.

use super::bench::{Bench, NEVER, Shot};
use super::scenes::{inside, methods, transformed};
use anyhow::Result;
use glam::{Affine3A, DVec3, Quat, Vec3};
use rayon::prelude::*;
use sampling::Random;
use sampling::hemisphere::{Frame, cosine_hemisphere, uniform_sphere};
use scene::assemble::{Builder, point};
use scene::{Material, PrimitiveId, Ray, Scene, SceneParts, Surface};

/// Rays that one task traces.
const BATCH: u32 = 10_000;

/// Checks the family.
pub(super) fn check(bench: &mut Bench) -> Result<()> {
    let rays = bench.pick(100_000, 1_000_000, 100_000_000 / 12_u32);
    let far = DVec3::new(1e5, -1e5, 1e5);
    let places = [
        ("", 1.0, DVec3::ZERO),
        (", times 1e-4", 1e-4, DVec3::ZERO),
        (", times 1e5", 1e5, DVec3::ZERO),
        (", 1e5 m away", 1.0, far),
    ];
    for (name, parts) in [
        ("box", cuboid(false)),
        ("turned box", cuboid(true)),
        ("ball of 5,120 triangles", ball(4)),
    ] {
        for (place, scale, offset) in places {
            let hazard = format!("closed {name}{place}, {rays} rays");
            bench.now(&hazard)?;
            let scene = Scene::new(transformed(parts.clone(), scale, offset))?;
            let counted = count(&scene, rays);
            bench.check(&hazard, "rays that get out", NEVER, counted.escaped as f64);
            bench.check(&hazard, "sight lines that are blocked", NEVER, counted.blocked as f64);
            bench.check(&hazard, "outside points that are seen", NEVER, counted.leaked as f64);
        }
    }
    lit_from_outside(bench)
}

/// What went wrong.
#[derive(Clone, Copy, Debug, Default)]
struct Counted {
    /// Rays from the inside that met nothing.
    escaped: u64,
    /// Shadow rays between two points inside a convex room that met something.
    blocked: u64,
    /// Shadow rays from inside to a point outside that met nothing.
    leaked: u64,
}

/// Walks about in `scene`, which is closed and convex: from surface to surface, `rays` steps.
fn count(scene: &Scene, rays: u32) -> Counted {
    let batches = (0..rays.div_ceil(BATCH)).into_par_iter();
    let counted = batches.map(|batch| {
        let mut counted = Counted::default();
        let mut step = Random::new(17, batch, 0);
        let mut ray = Ray {
            origin_ws: scene.center_ws,
            direction_ws: uniform_sphere(step.vec2(0)),
            t_max: f32::INFINITY,
        };
        let mut from: Option<Surface> = None;
        for number in 1..=BATCH {
            step = Random::new(17, batch, number);
            let id = from.map_or(PrimitiveId::NONE, |surface| surface.id);
            let Some(hit) = scene.nearest(&ray, id) else {
                counted.escaped += 1;
                (ray.origin_ws, from) = (scene.center_ws, None);
                ray.direction_ws = uniform_sphere(step.vec2(0));
                continue;
            };
            let surface = scene.surface(&ray, &hit);
            if let Some(before) = from.filter(|before| before.id != surface.id) {
                counted.blocked += u64::from(!sees(scene, &surface, before.position_ws, before.id));
            }
            let outside = scene.center_ws + uniform_sphere(step.vec2(2)) * 8.0 * scene.radius;
            counted.leaked += u64::from(sees(scene, &surface, outside, PrimitiveId::NONE));
            let local = cosine_hemisphere(step.vec2(0));
            let direction = Frame::new(surface.geometric_normal_ws).to_world(local);
            ray = scene.ray_from(&surface, direction, f32::INFINITY);
            from = Some(surface);
        }
        counted
    });
    counted.reduce(Counted::default, |a, b| Counted {
        escaped: a.escaped + b.escaped,
        blocked: a.blocked + b.blocked,
        leaked: a.leaked + b.leaked,
    })
}

/// Whether a shadow ray from `surface` reaches `target`, which lies on triangle `to`.
fn sees(scene: &Scene, surface: &Surface, target: Vec3, to: PrimitiveId) -> bool {
    let towards = target - surface.position_ws;
    let distance = towards.length();
    let direction = towards / distance;
    if direction.dot(surface.geometric_normal_ws) <= 0.0 {
        return to != PrimitiveId::NONE;
    }
    let ray = scene.shadow_ray(surface, direction, distance);
    !scene.occluded(&ray, surface.id, to)
}

/// A box without lights among strong lights outside: black for every method, with bounces.
fn lit_from_outside(bench: &mut Bench) -> Result<()> {
    let mut builder = Builder::default();
    let wall = builder.material(Material::lambert("wall", Vec3::splat(0.8)));
    let lamp = builder.material(Material::emitter("lamp", Vec3::splat(1e6)));
    let (low, high) = (Vec3::ZERO, Vec3::new(3.0, 2.0, 2.5));
    builder.room(low, high, wall);
    for corner in 0..8 {
        let outwards = Vec3::from_array([1, 2, 4].map(|bit| if corner & bit == 0 { -0.01 } else { 1.01 }));
        let at = low + (high - low) * outwards;
        builder.light(point(at, Vec3::splat(1e6)));
        // Touches the corner from outside, and faces it.
        builder.triangle([at, at + Vec3::X * 0.1, at + Vec3::Z * 0.1], lamp);
        builder.triangle([at, at + Vec3::Z * 0.1, at + Vec3::X * 0.1], lamp);
    }
    let scene = builder.build()?;
    let camera = inside(low, high);
    for (name, method) in methods() {
        let hazard = "closed box, strong lights against its outside";
        bench.now(format_args!("{hazard}, {name}"))?;
        let mut shot = Shot::new(&scene, &camera, method, (64, 48));
        // All methods as many: every shadow ray counts, and those of `exact` find what the others come upon by chance.
        (shot.frames, shot.repetitions) = (bench.pick(8, 64, 256), 1);
        shot.settings.max_bounces = 3;
        let estimate = shot.estimate()?;
        bench.check(hazard, name, ("luminance", 0.0), estimate.mean.mean());
        bench.check(hazard, name, NEVER, estimate.broken as f64);
    }
    Ok(())
}

/// A box, which may be turned so that no side is parallel to an axis.
fn cuboid(turned: bool) -> SceneParts {
    let mut builder = Builder::default();
    let wall = builder.material(Material::lambert("wall", Vec3::splat(0.8)));
    builder.room(Vec3::new(-1.5, -1.0, -1.25), Vec3::new(1.5, 1.0, 1.25), wall);
    let mut parts = builder.parts();
    if turned {
        let turn = Affine3A::from_quat(Quat::from_scaled_axis(Vec3::new(0.3, 0.7, -0.4)));
        parts.meshes[0]
            .positions
            .iter_mut()
            .for_each(|p| *p = turn.transform_point3(*p));
    }
    parts
}

/// An icosahedron whose triangles are cut in four `cuts` times, pulled on to a sphere. Convex: its corners lie on the sphere.
fn ball(cuts: u32) -> SceneParts {
    let golden = 0.5 * (1.0 + 5_f32.sqrt());
    let corner = |i: usize| {
        let sign = |bit: usize| if i & bit == 0 { 1.0 } else { -1.0 };
        let v = [sign(1), golden * sign(2), 0.0];
        Vec3::new(v[(3 - i / 4) % 3], v[(4 - i / 4) % 3], v[(5 - i / 4) % 3])
    };
    let corners: Vec<Vec3> = (0..12).map(corner).collect();
    let mut faces = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                let near = |i: usize, j: usize| corners[i].distance(corners[j]) < 2.1;
                if near(a, b) && near(b, c) && near(c, a) {
                    faces.push([corners[a], corners[b], corners[c]].map(Vec3::normalize));
                }
            }
        }
    }
    for _ in 0..cuts {
        faces = faces
            .into_iter()
            .flat_map(|[a, b, c]| {
                let [ab, bc, ca] = [a + b, b + c, c + a].map(Vec3::normalize);
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    let mut builder = Builder::default();
    let wall = builder.material(Material::lambert("wall", Vec3::splat(0.8)));
    for face in faces {
        builder.triangle(face.map(|p| p * 1.7), wall);
    }
    builder.parts()
}
