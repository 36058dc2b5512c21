//! What a whole frame costs, against tracing the same rays in a bare loop over the same BVH.
//!
//! `cargo bench -p render --bench frame -- [SPP] [SCENE...]`: by default 64 samples per pixel of 256 x 192 pixels with
//! `uniform`, one eye ray and one shadow ray each, on one thread and on two. Frame and bare loop are timed in
//! turns and the fastest of five counts, so that other work on the machine disturbs the ratio little.
//! Goals: frame / bare at most 1.6; two threads at least 1.8 times one.

use rayon::prelude::*;
use render::rays::{TracedRays, uniform_rays};
use render::{Method, Settings, renderer};
use scene::{Camera, Scene};
use std::hint::black_box;
use std::time::Instant;

const ROUNDS: usize = 5;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let (numbers, names): (Vec<_>, Vec<_>) = arguments.into_iter().partition(|a| a.parse::<u32>().is_ok());
    let frames = numbers.first().and_then(|n| n.parse().ok()).unwrap_or(64);
    let defaults = ["demo:rooms", "demo:one-light", "demo:points"]
        .map(String::from)
        .to_vec();
    let settings = Settings {
        width: 256,
        height: 192,
        method: Method::Sampled(light_cache::SamplerKind::Uniform),
        ..Settings::default()
    };
    println!("scene\tlights\tthreads\tframes_s\tbare_s\tratio\tMsamples/s\tns/sample/thread\tspeedup\tbare_speedup");
    for name in if names.is_empty() { defaults } else { names } {
        match scene::load(&name) {
            Ok(scene) => measure(&name, &scene, &settings, frames),
            Err(error) => eprintln!("{error}"),
        }
    }
}

/// Prints the rows of one scene.
fn measure(name: &str, scene: &Scene, settings: &Settings, frames: u32) {
    let camera = &scene.parts.cameras[0];
    // A few frames' rays, traced again and again: 64 frames' would fill memory and be read from there.
    let recorded = frames.min(4);
    let rays: Vec<TracedRays> = (0..recorded)
        .map(|f| uniform_rays(scene, camera, settings, f))
        .collect();
    let mut one_thread = None;
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads can be started");
        let (mut whole, mut bare) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..ROUNDS {
            whole = whole.min(pool.install(|| seconds_of_frames(scene, camera, settings, frames)));
            let scale = f64::from(frames) / f64::from(recorded);
            bare = bare.min(scale * pool.install(|| seconds_of_rays(scene, &rays)));
        }
        let samples = f64::from(settings.width * settings.height) * f64::from(frames);
        let (whole_one, bare_one) = *one_thread.get_or_insert((whole, bare));
        println!(
            "{name}\t{}\t{threads}\t{whole:.3}\t{bare:.3}\t{:.2}\t{:.2}\t{:.0}\t{:.2}\t{:.2}",
            scene.lights.len(),
            whole / bare,
            samples / whole * 1e-6,
            whole * 1e9 * threads as f64 / samples,
            whole_one / whole,
            bare_one / bare,
        );
    }
}

fn seconds_of_frames(scene: &Scene, camera: &Camera, settings: &Settings, frames: u32) -> f64 {
    let mut frame_loop = renderer(scene, camera, settings).expect("the settings are valid");
    let start = Instant::now();
    for _ in 0..frames {
        frame_loop.render_frame();
    }
    let seconds = start.elapsed().as_secs_f64();
    black_box(frame_loop.film().spp());
    seconds
}

fn seconds_of_rays(scene: &Scene, frames: &[TracedRays]) -> f64 {
    const CHUNK: usize = 256;
    let start = Instant::now();
    for rays in frames {
        let hits = rays.nearest.par_chunks(CHUNK).map(|rays| {
            let hit = |(ray, from): &&(_, _)| scene.nearest(ray, *from).is_some();
            rays.iter().filter(hit).count()
        });
        let shadows = rays.occluded.par_chunks(CHUNK).map(|rays| {
            let hit = |(ray, from, to): &&(_, _, _)| scene.occluded(ray, *from, *to);
            rays.iter().filter(hit).count()
        });
        black_box(hits.sum::<usize>() + shadows.sum::<usize>());
    }
    start.elapsed().as_secs_f64()
}
