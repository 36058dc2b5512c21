//! Auxiliary images of the GPU back end against those of the CPU.

use crate::gpu::gpu;
use light_cache::SamplerKind;
use render::film::Aovs;
use render::gpu::Gpu;
use render::{FrameLoop, Method, Settings};
use scene::Scene;
use std::path::Path;
use std::sync::Arc;

const SIZE: (u32, u32) = (48, 36);
const FRAMES: u32 = 12;

fn start<'s>(scene: &'s Scene, settings: &Settings, gpu: Option<&Arc<Gpu>>) -> Box<dyn FrameLoop<'s> + 's> {
    let camera = &scene.parts.cameras[0];
    match gpu {
        Some(gpu) => render::gpu::renderer(gpu, scene, camera, settings).expect("it fits"),
        None => render::renderer(scene, camera, settings).expect("valid settings"),
    }
}

/// What a film has after some frames.
struct Layers {
    aovs: Aovs,
    luminance: Vec<f32>,
    variance: Vec<f32>,
}

fn layers(frames: &mut dyn FrameLoop<'_>) -> Layers {
    (0..FRAMES).for_each(|_| frames.render_frame());
    assert!(frames.error().is_none());
    let film = frames.film();
    let pixels = film.image().pixels.into_iter();
    Layers {
        aovs: film.aovs().expect("asked for"),
        luminance: pixels.map(|pixel| scene::luminance(pixel.into())).collect(),
        variance: film.variance(),
    }
}

/// Pixels of which any value is not near the other's.
fn different(a: &[f32], b: &[f32], channels: usize, scale: f32) -> usize {
    assert_eq!(a.len(), b.len());
    let differs = |(a, b): (&f32, &f32)| {
        let near = 1e-3 * a.abs().max(b.abs()) + 1e-4 * scale;
        a != b && (!near.is_finite() || (a - b).abs() > near)
    };
    let pixels = a.chunks(channels).zip(b.chunks(channels));
    pixels.filter(|(a, b)| a.iter().zip(*b).any(differs)).count()
}

/// Asserts that no more pixels differ than rounding explains: of a thousand samples one may meet something else, and draw another light.
fn assert_alike(what: &str, scene: &Scene, on_cpu: &Layers, on_gpu: &Layers) {
    let (a, b) = (&on_cpu.aovs, &on_gpu.aovs);
    let pixels = a.depth.len();
    let most = pixels * FRAMES as usize / 1000;
    let layers = [
        ("albedo", &a.albedo, &b.albedo, 1.0),
        ("normal", &a.normal, &b.normal, 1.0),
        ("position", &a.position, &b.position, scene.radius),
        ("emitted", &a.emitted, &b.emitted, 1.0),
    ];
    for (layer, a, b, scale) in layers {
        let count = different(a.pixels.as_flattened(), b.pixels.as_flattened(), 3, scale);
        assert!(count <= most, "{what} {layer}: {count} of {pixels} pixels differ");
    }
    let depth = different(&a.depth, &b.depth, 1, scene.radius);
    assert!(depth <= most, "{what} depth: {depth} of {pixels} pixels differ");
    // Of one sample each: lights have no mean.
    let lights = a.light.iter().zip(&b.light).filter(|(a, b)| a != b).count();
    assert!(
        lights * 100 <= pixels,
        "{what} light: {lights} of {pixels} pixels differ"
    );
    // A difference of squares: where it is small, rounding of the squares is what is left.
    let variances = on_cpu.variance.iter().zip(&on_gpu.variance).zip(&on_cpu.luminance);
    let variance = variances.filter(|((a, b), y)| (*a - *b).abs() > 1e-3 * a.max(**b) + 1e-6 * *y * *y);
    let variance = variance.count();
    assert!(
        variance <= most,
        "{what} variance: {variance} of {pixels} pixels differ"
    );
    assert!(
        a.albedo.pixels.iter().any(|pixel| pixel[0] != pixel[1]),
        "{what} has colours"
    );
    assert!(a.light.iter().any(|&light| light > 0.0), "{what} has lights");
}

#[test]
fn auxiliary_images_are_those_of_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let hall = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/modern_hall.glb");
    let hall = hall.to_str().expect("a plain path");
    for (what, kind, light_samples) in [
        ("demo:rooms:256", SamplerKind::Adaptive, 1),
        (hall, SamplerKind::Uniform, 2),
    ] {
        let scene = scene::load(what).expect("it is there");
        let settings = Settings {
            width: SIZE.0,
            height: SIZE.1,
            method: Method::Sampled(kind),
            light_samples,
            aovs: true,
            ..Settings::default()
        };
        let cpu = layers(start(&scene, &settings, None).as_mut());
        let mut on_gpu = start(&scene, &settings, Some(gpu));
        assert_alike(what, &scene, &cpu, &layers(on_gpu.as_mut()));
    }
}

/// Layers come and go, sizes change while a lesson is under way, and what was learned stays.
#[test]
fn layers_and_sizes_change_between_frames() {
    let Some(gpu) = gpu() else { return };
    let scene = scene::load("demo:rooms:256").expect("it is generated");
    let settings = Settings {
        width: SIZE.0,
        height: SIZE.1,
        ..Settings::default()
    };
    let mut changed = [None, Some(gpu)].map(|gpu| start(&scene, &settings, gpu));
    let sizes = [
        (1, 1, true),
        (36, 48, true),
        (2, 1, false),
        (48, 36, false),
        (SIZE.0, SIZE.1, true),
    ];
    for (width, height, aovs) in sizes {
        for frames in &mut changed {
            (0..3).for_each(|_| frames.render_frame());
            frames.set_film(width, height, aovs).expect("a valid size");
            assert_eq!(frames.film().spp(), 0);
            frames.render_frame();
            assert_eq!(frames.film().aovs().is_some(), aovs);
        }
    }
    let [cpu, gpu] = &mut changed;
    assert_alike("rooms, changed", &scene, &layers(cpu.as_mut()), &layers(gpu.as_mut()));
    let [on_cpu, on_gpu] = [cpu, gpu].map(|frames| {
        let samples: u64 = frames.cells().iter().map(|entry| entry.samples).sum();
        samples as f64
    });
    assert!(
        (on_gpu / on_cpu - 1.0).abs() < 0.01,
        "{on_gpu} observations, {on_cpu} on the CPU"
    );
}
