//! What a whole frame costs, against tracing the same rays in a bare loop over the same BVH.
//!
//! `cargo bench -p render --bench frame -- [SPP] [SCENE...]`: by default 64 samples per pixel of 256 x 192 pixels with
//! `uniform`, one eye ray and one shadow ray each, on one thread and on two. Frame and bare loop are timed in
//! turns and the fastest of five counts. Times of the clock and, in brackets, of the processors (summed over threads,
//! Linux only): on a machine that does other work too, only the latter can be compared.
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
    // Both live to the end, since the time of a thread that has ended is no longer counted.
    let start_pool = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        (threads, pool.expect("threads can be started"))
    };
    let pools = [1, 2].map(start_pool);
    println!("scene\tlights\tthreads\tframes_s\tbare_s\tratio\tMsamples/s\tns/sample\tspeedup\tbare_speedup");
    for name in if names.is_empty() { defaults } else { names } {
        match scene::load(&name) {
            Ok(scene) => measure(&name, &scene, &settings, frames, &pools),
            Err(error) => eprintln!("{error}"),
        }
    }
}

/// Prints the rows of one scene.
fn measure(name: &str, scene: &Scene, settings: &Settings, frames: u32, pools: &[(usize, rayon::ThreadPool)]) {
    let camera = &scene.parts.cameras[0];
    // A few frames' rays, traced again and again: 64 frames' would fill memory and be read from there.
    let recorded = frames.min(4);
    let rays: Vec<TracedRays> = (0..recorded)
        .map(|f| uniform_rays(scene, camera, settings, f))
        .collect();
    let mut one_thread = None;
    for (threads, pool) in pools {
        let (mut whole, mut bare) = (Time::LONGEST, Time::LONGEST);
        for _ in 0..ROUNDS {
            whole = whole.min(pool.install(|| time_of_frames(scene, camera, settings, frames)));
            let scale = f64::from(frames) / f64::from(recorded);
            bare = bare.min(pool.install(|| time_of_rays(scene, &rays)).times(scale));
        }
        let samples = f64::from(settings.width * settings.height) * f64::from(frames);
        let (whole_one, bare_one) = *one_thread.get_or_insert((whole, bare));
        println!(
            "{name}\t{}\t{threads}\t{:.3} ({:.3})\t{:.3} ({:.3})\t{:.2} ({:.2})\t{:.2}\t{:.0} ({:.0})\t{:.2}\t{:.2}",
            scene.lights.len(),
            whole.clock_s,
            whole.processor_s,
            bare.clock_s,
            bare.processor_s,
            whole.clock_s / bare.clock_s,
            whole.processor_s / bare.processor_s,
            samples / whole.clock_s * 1e-6,
            whole.clock_s * 1e9 / samples,
            whole.processor_s * 1e9 / samples,
            whole_one.clock_s / whole.clock_s,
            bare_one.clock_s / bare.clock_s,
        );
    }
}

/// Seconds passed, and seconds that processors worked for this process.
#[derive(Clone, Copy)]
struct Time {
    clock_s: f64,
    processor_s: f64,
}

impl Time {
    const LONGEST: Self = Self {
        clock_s: f64::INFINITY,
        processor_s: f64::INFINITY,
    };

    fn of(work: impl FnOnce()) -> Self {
        let (start, processor) = (Instant::now(), processor_s());
        work();
        Self {
            clock_s: start.elapsed().as_secs_f64(),
            processor_s: processor_s() - processor,
        }
    }

    fn min(self, other: Self) -> Self {
        Self {
            clock_s: self.clock_s.min(other.clock_s),
            processor_s: self.processor_s.min(other.processor_s),
        }
    }

    fn times(self, scale: f64) -> Self {
        Self {
            clock_s: scale * self.clock_s,
            processor_s: scale * self.processor_s,
        }
    }
}

/// Seconds all threads of this process have run, as Linux counts them; NaN elsewhere.
fn processor_s() -> f64 {
    let Ok(threads) = std::fs::read_dir("/proc/self/task") else {
        return f64::NAN;
    };
    let nanoseconds = threads.flatten().filter_map(|thread| {
        let counts = std::fs::read_to_string(thread.path().join("schedstat")).ok()?;
        counts.split(' ').next()?.parse::<f64>().ok()
    });
    nanoseconds.sum::<f64>() * 1e-9
}

fn time_of_frames(scene: &Scene, camera: &Camera, settings: &Settings, frames: u32) -> Time {
    let mut frame_loop = renderer(scene, camera, settings).expect("the settings are valid");
    let time = Time::of(|| (0..frames).for_each(|_| frame_loop.render_frame()));
    black_box(frame_loop.film().spp());
    time
}

fn time_of_rays(scene: &Scene, frames: &[TracedRays]) -> Time {
    const CHUNK: usize = 256;
    Time::of(|| {
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
    })
}
