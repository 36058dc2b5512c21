//! The same picture by other means: on the GPU, and by the program as it was built otherwise.

use super::bench::{Bench, NEVER};
use super::scenes::{square_lamp, still_life, transformed, transformed_camera};
use crate::session;
use anyhow::{Context, Result, ensure};
use glam::{DVec3, Vec3};
use render::gpu::Gpu;
use render::{FrameLoop, Image, ImageError, Method, Settings};
use scene::{Camera, Scene};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Rounding, for it is the same random numbers; one light in a thousand pixels that rounding has changed would be beyond it.
const ROUNDING: (&str, f64) = ("relMSE", 1e-6);
/// Long enough to learn and to draw from what was learned.
const FRAMES: u32 = 6;

/// Checks the family.
pub(super) fn check(bench: &mut Bench) -> Result<()> {
    if bench.pick(false, true, true) {
        gpu(bench)?;
    } else {
        bench.note(
            "SKIPPED: the GPU is compared with the CPU at more effort only: software drivers compile its programs for minutes",
        );
    }
    match bench.other_program().map(Path::to_path_buf) {
        Some(program) => other(bench, &program),
        None => {
            bench.note("SKIPPED: no other build to compare with; give one with --other-build");
            Ok(())
        }
    }
}

/// All samplers that the GPU has, against the CPU.
fn gpu(bench: &mut Bench) -> Result<()> {
    let gpu = match Gpu::open() {
        Ok(gpu) => gpu,
        Err(error) => {
            bench.note(format_args!("SKIPPED: the GPU is not compared with the CPU: {error}"));
            return Ok(());
        }
    };
    let states = states(bench.pick(false, false, true))?;
    bench.note(format_args!("GPU: {}", gpu.info()));
    for kind in render::gpu::SAMPLERS {
        bench.now(format_args!("GPU against CPU, {}", kind.name()))?;
        let settings = Settings {
            width: 48,
            height: 36,
            method: Method::Sampled(kind),
            max_bounces: 1,
            ..Settings::default()
        };
        let (_, first, camera) = &states[0];
        let mut on_cpu = render::renderer(first, camera, &settings)?;
        let mut on_gpu = render::gpu::renderer(&gpu, first, camera, &settings)?;
        for (name, scene, camera) in &states {
            let [of_cpu, of_gpu] = [&mut on_cpu, &mut on_gpu].map(|frames| -> Result<Image> {
                frames.set_scene(scene.into())?;
                frames.set_camera(camera);
                frames.restart();
                Ok(picture(frames.as_mut()))
            });
            let (of_cpu, of_gpu) = (of_cpu?, of_gpu?);
            let hazard = format!("GPU against CPU, {name}");
            let broken = of_gpu.pixels.as_flattened().iter().filter(|x| !x.is_finite()).count();
            let broken = broken as u64 + on_gpu.stats().nonfinite_samples;
            bench.check(&hazard, kind.name(), NEVER, broken as f64);
            bench.check(&hazard, kind.name(), ROUNDING, difference(&of_gpu, &of_cpu));
        }
    }
    Ok(())
}

/// One scene, lit in other ways; and `placed` otherwise, for which software drivers compile the shaders anew.
fn states(placed: bool) -> Result<Vec<(&'static str, Scene, Camera)>> {
    let (parts, camera) = still_life(square_lamp);
    let scene = Scene::new(parts.clone())?;
    let mut states = vec![("as it is", scene.clone(), camera.clone())];
    for (name, of_one, of_others) in [
        ("all light times 2^90", 2_f32.powi(90), 2_f32.powi(90)),
        ("all light times 2^-90", 2_f32.powi(-90), 2_f32.powi(-90)),
        ("one light 1e20 times as strong", 1e20, 1.0),
        ("all lights put out", 0.0, 0.0),
    ] {
        let factors = (0..scene.lights.len() as u32).map(|light| (light, if light == 0 { of_one } else { of_others }));
        let factors: Vec<(u32, Vec3)> = factors.map(|(light, factor)| (light, Vec3::splat(factor))).collect();
        states.push((name, scene.relit(&factors), camera.clone()));
    }
    if !placed {
        return Ok(states);
    }
    for (name, scale, offset) in [
        ("times 1e-4", 1e-4, DVec3::ZERO),
        ("times 1e5", 1e5, DVec3::ZERO),
        ("1e5 m from the origin", 1.0, DVec3::new(1e5, 0.0, 1e5)),
    ] {
        let placed = Scene::new(transformed(parts.clone(), scale, offset))?;
        states.push((name, placed, transformed_camera(&camera, scale, offset)));
    }
    Ok(states)
}

/// relMSE of two images of any magnitude; none between two black ones.
fn difference(image: &Image, reference: &Image) -> f64 {
    let of_both = [image, reference];
    let largest = of_both
        .iter()
        .flat_map(|image| image.pixels.as_flattened())
        .fold(0.0, |a: f32, b| a.max(b.abs()));
    if largest == 0.0 {
        return 0.0;
    }
    let [image, reference] = of_both.map(|image| Image {
        pixels: image.pixels.iter().map(|pixel| pixel.map(|x| x / largest)).collect(),
        ..*image
    });
    ImageError::between(&image, &reference).map_or(f64::NAN, |error| error.relmse)
}

fn picture<'s>(frames: &mut dyn FrameLoop<'s>) -> Image {
    (0..FRAMES).for_each(|_| frames.render_frame());
    frames.film().image()
}

/// All samplers of another build of the program, such as one with assertions and without optimisation.
fn other(bench: &mut Bench, program: &Path) -> Result<()> {
    const SCENE: &str = "demo:rooms:64";
    const SIZE: (u32, u32) = (40, 30);
    let folder = std::env::temp_dir().join(format!("manylight-builds-{}", std::process::id()));
    std::fs::create_dir_all(&folder).context("no temporary folder")?;
    let loaded = session::load(SCENE)?;
    let camera = session::camera(&loaded.scene, None)?;
    for method in Method::all() {
        let settings = Settings {
            width: SIZE.0,
            height: SIZE.1,
            method,
            max_bounces: 1,
            ..Settings::default()
        };
        bench.now(format_args!("another build, {}", method.name()))?;
        let ours = picture(render::renderer(&loaded.scene, camera, &settings)?.as_mut());
        let theirs = render_by(
            program,
            method,
            SCENE,
            SIZE,
            folder.join(format!("{}.exr", method.name())),
        )?;
        let differing = ours
            .pixels
            .iter()
            .zip(&theirs.pixels)
            .filter(|(a, b)| a.map(f32::to_bits) != b.map(f32::to_bits));
        bench.check(
            "another build, pixels that differ",
            method.name(),
            NEVER,
            differing.count() as f64,
        );
    }
    std::fs::remove_dir_all(&folder).context("the temporary folder cannot be removed")
}

fn render_by(
    program: &Path,
    method: Method,
    scene: &str,
    (width, height): (u32, u32),
    image: PathBuf,
) -> Result<Image> {
    let arguments = [
        ("--sampler", method.name().to_owned()),
        ("--width", width.to_string()),
        ("--height", height.to_string()),
        ("--spp", FRAMES.to_string()),
        ("--max-bounces", "1".to_owned()),
    ];
    let mut command = Command::new(program);
    command.args(["render", scene, "--quiet", "-o"]).arg(&image);
    for (name, value) in &arguments {
        command.args([name, value.as_str()]);
    }
    let shown = program.display();
    let output = command.output().with_context(|| format!("{shown}: cannot be run"))?;
    let text = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{shown}: {text}");
    Ok(render::image::read_exr(&image)?)
}
