//! The same picture by other means: on the GPU, and by the program as it was built otherwise.

use super::bench::{Bench, NEVER};
use super::scenes::{square_lamp, still_life};
use crate::{message, session};
use anyhow::{Context, Result, ensure};
use light_cache::SamplerKind;
use render::gpu::Gpu;
use render::{FrameLoop, Image, ImageError, Method, Settings};
use scene::Scene;
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
        message::note(
            "SKIPPED: the GPU is compared with the CPU at more effort only: software drivers compile its programs for minutes",
        );
    }
    match bench.other_program().map(Path::to_path_buf) {
        Some(program) => other(bench, &program),
        None => {
            message::note("SKIPPED: no other build to compare with; give one with --other-build");
            Ok(())
        }
    }
}

/// All samplers that the GPU has, against the CPU.
fn gpu(bench: &mut Bench) -> Result<()> {
    let gpu = match Gpu::open() {
        Ok(gpu) => gpu,
        Err(error) => {
            message::warn(format!("SKIPPED: the GPU is not compared with the CPU: {error}"));
            return Ok(());
        }
    };
    let (parts, camera) = still_life(square_lamp);
    let scene = Scene::new(parts)?;
    for kind in [
        SamplerKind::Uniform,
        SamplerKind::Power,
        SamplerKind::Tree,
        SamplerKind::Table,
        SamplerKind::Adaptive,
    ] {
        let settings = Settings {
            width: 48,
            height: 36,
            method: Method::Sampled(kind),
            max_bounces: 1,
            light: light_cache::Settings {
                // The GPU does not guide.
                guided_bounces: false,
                ..Default::default()
            },
            ..Settings::default()
        };
        let of_cpu = picture(render::renderer(&scene, &camera, &settings)?.as_mut());
        let of_gpu = picture(render::gpu::renderer(&gpu, &scene, &camera, &settings)?.as_mut());
        let error = ImageError::between(&of_gpu, &of_cpu).map_or(f64::NAN, |error| error.relmse);
        bench.check(
            format!("GPU against CPU ({})", gpu.info().name),
            kind.name(),
            ROUNDING,
            error,
        );
    }
    Ok(())
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
