//! What choosing a light costs: `cargo bench -p light-cache --bench sample -- [LIGHTS...]`.
//!
//! Per sampler and number of lights: nanoseconds for preparing a point and drawing, and for preparing and one query, single
//! thread; seconds of building; mebibytes. Points lie in a flat town of lamps, in the order of image rows.

use glam::Vec3;
use light_cache::{LightSampler, SamplerKind, Settings, ShadingPoint, Visitor, build};
use sampling::Random;
use scene::{Light, LightKind, PrimitiveId, Scene, SceneParts};
use std::hint::black_box;
use std::time::Instant;

const POINTS: u32 = 1 << 12;
const ROUNDS: u32 = 40;

/// Small ceiling panels and point lights over a square, about one per square metre.
fn town(count: u32) -> Scene {
    let side = (count as f32).sqrt();
    let lights = (0..count).map(|i| {
        let random = Random::new(1, i, 0);
        let position = Vec3::new(random.f32(0) * side, 2.5 + random.f32(1), random.f32(2) * side);
        let strength = 10.0_f32.powf(2.0 * random.f32(3));
        let kind = if i % 2 == 0 {
            LightKind::Triangle
        } else {
            LightKind::Point
        };
        Light {
            kind,
            double_sided: false,
            textured: false,
            position_ws: position,
            edge1_ws: Vec3::X * 0.3,
            edge2_ws: Vec3::Z * 0.3,
            normal_ws: if kind == LightKind::Triangle {
                Vec3::NEG_Y
            } else {
                Vec3::ZERO
            },
            intensity: Vec3::splat(strength),
            area: if kind == LightKind::Triangle { 0.045 } else { 0.0 },
            range: f32::INFINITY,
            cos_inner: 1.0,
            cos_outer: -1.0,
            power: strength,
            primitive: PrimitiveId::NONE,
        }
    });
    let lights = lights.collect();
    let mut scene = Scene::new(SceneParts::default()).expect("an empty scene is valid");
    scene.lights = lights;
    scene.center_ws = Vec3::new(0.5 * side, 0.0, 0.5 * side);
    scene.radius = side;
    scene
}

/// Points on the ground seen from a corner of the town, row by row.
fn ground(side: f32) -> Vec<ShadingPoint> {
    let width = 128;
    let at = |i: u32| {
        let (x, z) = (
            (i % width) as f32 / width as f32,
            (i / width) as f32 / (POINTS / width) as f32,
        );
        ShadingPoint {
            position_ws: Vec3::new(x * side, 0.0, z * z * side),
            normal_ws: Vec3::Y,
            primary: true,
        }
    };
    (0..POINTS).map(at).collect()
}

struct Timing<'s> {
    scene: &'s Scene,
    points: &'s [ShadingPoint],
}

impl Visitor for Timing<'_> {
    type Output = String;

    fn visit<S: LightSampler + 'static>(self, sampler: S) -> String {
        let Self { scene, points } = self;
        let numbers: Vec<u32> = (0..POINTS).map(|i| Random::new(3, i, 0).u32(0)).collect();
        // The fastest round: others may use the machine.
        let mut sampling = f64::INFINITY;
        let mut querying = f64::INFINITY;
        for _ in 0..ROUNDS {
            let start = Instant::now();
            for (point, &u) in points.iter().zip(&numbers) {
                black_box(sampler.sample(&sampler.local(scene, point), u));
            }
            sampling = sampling.min(start.elapsed().as_secs_f64());
            let start = Instant::now();
            for (point, &u) in points.iter().zip(&numbers) {
                let light = ((u64::from(u) * scene.lights.len() as u64) >> 32) as u32;
                black_box(sampler.pmf(&sampler.local(scene, point), light));
            }
            querying = querying.min(start.elapsed().as_secs_f64());
        }
        let stats = sampler.stats();
        let each = 1e9 / f64::from(POINTS);
        format!(
            "{:8.1} {:8.1} {:9.3} {:9.1}",
            sampling * each,
            querying * each,
            stats.build_s,
            stats.bytes as f64 / (1 << 20) as f64
        )
    }
}

fn main() {
    let asked: Vec<u32> = std::env::args().skip(1).filter_map(|arg| arg.parse().ok()).collect();
    let counts = if asked.is_empty() {
        vec![2_000, 16_000, 1_000_000]
    } else {
        asked
    };
    println!(
        "{:>8} {:13} {:>8} {:>8} {:>9} {:>9}",
        "lights", "sampler", "draw_ns", "query_ns", "build_s", "MiB"
    );
    for count in counts {
        let scene = town(count);
        let points = ground((count as f32).sqrt());
        for kind in SamplerKind::ALL {
            let timing = Timing {
                scene: &scene,
                points: &points,
            };
            println!(
                "{count:8} {:13} {}",
                kind.name(),
                build(&scene, &Settings::default(), kind, timing)
            );
        }
    }
}
