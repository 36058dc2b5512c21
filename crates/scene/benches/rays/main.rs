//! Rays per second of the ray queries: three scenes, coherent and incoherent nearest-hit rays and shadow rays, every
//! kernel that the processor has.
//!
//! `cargo bench -p scene --bench rays -- [--scenes box,rooms,bumps] [--rays N] [--rounds N] [--threads 1,2]
//! [--kernels avx512] [--export DIR]`. `--export` writes triangles and rays as little-endian f32, one file each, and
//! `rays.json` with the rates; `benchmarks/embree/compare.py` traces the same with Embree.

mod geometry;

use geometry::{Numbers, build_parts};
use glam::Vec3;
use scene::bvh::{Bvh, Kernel};
use scene::{PrimitiveId, Ray, SceneParts};
use std::hint::black_box;
use std::io::Write;
use std::path::Path;
use std::time::Instant;

/// What to run.
struct Options {
    scenes: Vec<String>,
    kernels: Vec<Kernel>,
    threads: Vec<usize>,
    rays: usize,
    rounds: usize,
    export: Option<String>,
}

impl Options {
    fn parse() -> Result<Self, String> {
        let list = |s: &str| s.split(',').map(str::to_owned).collect::<Vec<_>>();
        let mut options = Self {
            scenes: list("box,rooms,bumps"),
            kernels: Kernel::available(),
            threads: vec![1, 2],
            rays: 200_000,
            rounds: 5,
            export: None,
        };
        let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
        while let Some(flag) = arguments.next() {
            let value = arguments.next().ok_or_else(|| format!("{flag} wants a value"))?;
            let number = || value.parse::<usize>().map_err(|e| format!("{flag} {value}: {e}"));
            match flag.as_str() {
                "--scenes" => options.scenes = list(&value),
                "--kernels" => options.kernels.retain(|k| list(&value).contains(&k.name().to_owned())),
                "--threads" => options.threads = list(&value).iter().filter_map(|n| n.parse().ok()).collect(),
                "--rays" => options.rays = number()?,
                "--rounds" => options.rounds = number()?,
                "--export" => options.export = Some(value),
                _ => return Err(format!("unknown option {flag}")),
            }
        }
        Ok(options)
    }
}

/// A set of rays and how to trace them.
struct Workload {
    name: &'static str,
    any: bool,
    rays: Vec<Ray>,
}

impl Workload {
    /// Number of rays that hit something, so that nothing is optimised away.
    fn trace(&self, parts: &SceneParts, bvh: &Bvh, threads: usize) -> usize {
        let none = PrimitiveId::NONE;
        let hits = |rays: &[Ray]| {
            let hit = |ray: &&Ray| {
                if self.any {
                    bvh.occluded(parts, black_box(ray), none, none)
                } else {
                    black_box(bvh.nearest(parts, black_box(ray), none)).is_some()
                }
            };
            rays.iter().filter(hit).count()
        };
        let share = self.rays.len().div_ceil(threads);
        std::thread::scope(|scope| {
            let work: Vec<_> = self
                .rays
                .chunks(share)
                .skip(1)
                .map(|rays| scope.spawn(move || hits(rays)))
                .collect();
            hits(&self.rays[..share]) + work.into_iter().map(|w| w.join().expect("no panic")).sum::<usize>()
        })
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let options = Options::parse()?;
    let mut results = Vec::new();
    for name in &options.scenes {
        let parts = build_parts(name).ok_or_else(|| format!("no scene {name}: box, rooms, bumps"))?;
        let start = Instant::now();
        let mut bvh = Bvh::build(&parts);
        let triangles = parts.meshes[0].len();
        let megabytes = bvh.bytes() as f64 / 1e6;
        let build_s = start.elapsed().as_secs_f64();
        println!("{name}: {triangles} triangles, built in {build_s:.2} s, {megabytes:.1} MB");
        let workloads = workloads(&parts, &bvh, options.rays);
        if let Some(folder) = &options.export {
            export(Path::new(folder), name, &parts, &workloads)?;
        }
        let mut best = vec![0.0f64; workloads.len() * options.kernels.len() * options.threads.len()];
        let mut counts = vec![0; workloads.len()];
        for _ in 0..options.rounds {
            let mut slot = best.iter_mut();
            for (workload, count) in workloads.iter().zip(&mut counts) {
                for &kernel in &options.kernels {
                    bvh.set_kernel(kernel);
                    for &threads in &options.threads {
                        let start = Instant::now();
                        *count = workload.trace(&parts, &bvh, threads);
                        let rate = workload.rays.len() as f64 / start.elapsed().as_secs_f64() / 1e6;
                        let slot = slot.next().expect("one slot per measurement");
                        *slot = slot.max(rate);
                    }
                }
            }
        }
        let mut slot = best.iter();
        for (workload, count) in workloads.iter().zip(&counts) {
            let hit_share = *count as f64 / workload.rays.len() as f64;
            for kernel in &options.kernels {
                for threads in &options.threads {
                    let rate = slot.next().expect("one slot per measurement");
                    let (rays, kernel) = (workload.name, kernel.name());
                    println!("  {rays:<10} {kernel:<8} {threads} threads {rate:7.3} Mrays/s, {hit_share:.4} hit");
                    results.push(serde_json::json!({
                        "scene": name, "rays": rays, "kernel": kernel, "threads": threads, "mrays_per_s": rate,
                        "hit_share": hit_share, "triangles": triangles, "build_s": build_s, "megabytes": megabytes,
                    }));
                }
            }
        }
    }
    if let Some(folder) = &options.export {
        let file = std::fs::File::create(Path::new(folder).join("rays.json"))?;
        serde_json::to_writer_pretty(file, &results)?;
    }
    Ok(())
}

/// Camera rays; cosine-distributed rays from surface points; rays between surface points. The points are those that
/// random rays from the camera and its reflections see.
fn workloads(parts: &SceneParts, bvh: &Bvh, count: usize) -> Vec<Workload> {
    let mut numbers = Numbers(7);
    let eye = Vec3::new(0.31, 0.52, 0.13);
    let side = (count as f32).sqrt().ceil() as usize;
    let towards = |x: f32, y: f32| Vec3::new(x * 1.6 - 0.8 - 0.2, y * 1.6 - 0.8, 1.0).normalize();
    let ray = |origin_ws, direction_ws, t_max| Ray {
        origin_ws,
        direction_ws,
        t_max,
    };
    let coherent: Vec<_> = (0..count)
        .map(|i| {
            let (x, y) = ((i % side) as f32 / side as f32, (i / side) as f32 / side as f32);
            ray(eye, towards(x, y), f32::INFINITY)
        })
        .collect();
    let mut points: Vec<(Vec3, Vec3)> = Vec::with_capacity(2 * count);
    while points.len() < 2 * count {
        let mut from = (eye, numbers.direction());
        for _ in 0..4 {
            let path = ray(from.0, from.1, f32::INFINITY);
            let Some(hit) = bvh.nearest(parts, &path, PrimitiveId::NONE) else {
                break;
            };
            let [a, b, c] = parts.meshes[0].corners(hit.id.triangle as usize);
            let normal = (b - a).cross(c - a).normalize();
            let normal = if normal.dot(path.direction_ws) > 0.0 {
                -normal
            } else {
                normal
            };
            let point = path.origin_ws + path.direction_ws * hit.t + normal * 1e-4;
            points.push((point, normal));
            from = (point, (normal + numbers.direction() * 0.999).normalize());
        }
    }
    let mut pick = || points[(numbers.unit() * points.len() as f32) as usize];
    let starts: Vec<_> = (0..count).map(|_| pick()).collect();
    let ends: Vec<_> = (0..count).map(|_| pick()).collect();
    let incoherent = starts.iter().map(|&(point, normal)| {
        // A unit vector around the normal's tip has a cosine distribution.
        ray(point, (normal + numbers.direction() * 0.999).normalize(), f32::INFINITY)
    });
    let incoherent = incoherent.collect();
    let shadow = starts.iter().zip(&ends).map(|(a, b)| {
        let distance = a.0.distance(b.0).max(1e-6);
        ray(a.0, ((b.0 - a.0) / distance).normalize_or(Vec3::X), distance * 0.999)
    });
    let shadow = shadow.collect();
    vec![
        Workload {
            name: "coherent",
            any: false,
            rays: coherent,
        },
        Workload {
            name: "incoherent",
            any: false,
            rays: incoherent,
        },
        Workload {
            name: "shadow",
            any: true,
            rays: shadow,
        },
    ]
}

/// Nine numbers per triangle; seven per ray: origin, direction, largest distance.
fn export(folder: &Path, scene: &str, parts: &SceneParts, workloads: &[Workload]) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    let write = |name: String, numbers: &mut dyn Iterator<Item = f32>| {
        let mut file = std::io::BufWriter::new(std::fs::File::create(folder.join(name))?);
        for x in numbers {
            file.write_all(&x.to_le_bytes())?;
        }
        file.flush()
    };
    let mesh = &parts.meshes[0];
    let corners = (0..mesh.len()).flat_map(|i| mesh.corners(i)).flat_map(|p| p.to_array());
    write(format!("{scene}.triangles.f32"), &mut { corners })?;
    for workload in workloads {
        let numbers = workload.rays.iter().flat_map(|ray| {
            let (o, d) = (ray.origin_ws, ray.direction_ws);
            [o.x, o.y, o.z, d.x, d.y, d.z, ray.t_max]
        });
        write(format!("{scene}.{}.rays.f32", workload.name), &mut { numbers })?;
    }
    Ok(())
}
