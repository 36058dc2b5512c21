//! Changes of a scene that change nothing in its picture; and threads.

use super::bench::{Bench, NEVER, STANDARD_ERRORS, Shot};
use super::scenes::{methods, square_lamp, still_life};
use anyhow::{Context, Result};
use glam::Vec3;
use render::renderer;
use scene::assemble::point;
use scene::{LightSource, Material, Scene, SceneParts};

/// Checks the family.
pub(super) fn check(bench: &mut Bench) -> Result<()> {
    threads(bench)?;
    let (parts, camera) = still_life(square_lamp);
    let scene = Scene::new(parts.clone())?;
    let cut = still_life(|builder, material| {
        for corner in [[0.0, 0.0], [0.5, 0.0], [0.0, 0.5], [0.5, 0.5]] {
            let at = Vec3::new(corner[0] - 1.0, 3.0, corner[1] - 1.0);
            builder.quad(at, Vec3::X * 0.5, Vec3::Z * 0.5, material);
        }
    });
    let changed = [
        ("lights and triangles in another order", permuted(parts.clone())),
        ("a light cut in four", cut.0),
        ("black lights added", with_black_lights(parts)),
    ];
    let effort = (16, bench.pick(16, 48, 192));
    for (name, method) in methods() {
        let shot = |scene: &Scene, seed| {
            let mut shot = Shot::new(scene, &camera, method, (24, 18))
                .effort(effort.0, effort.1)
                .seed(seed);
            shot.settings.max_bounces = 1;
            shot.estimate()
        };
        bench.now(format_args!("the same scene in other forms, {name}"))?;
        let original = shot(&scene, 0)?;
        for (hazard, parts) in &changed {
            let changed = Scene::new(parts.clone())?;
            let there = shot(&changed, 1000)?;
            bench.check(*hazard, name, STANDARD_ERRORS, there.deviation_from(&original));
            bench.check(*hazard, name, NEVER, there.broken as f64);
        }
    }
    Ok(())
}

fn permuted(mut parts: SceneParts) -> SceneParts {
    parts.punctual.reverse();
    for mesh in &mut parts.meshes {
        mesh.indices.reverse();
        mesh.materials.reverse();
    }
    parts
}

fn with_black_lights(mut parts: SceneParts) -> SceneParts {
    parts
        .punctual
        .push((point(Vec3::Y, Vec3::ZERO), LightSource::default()));
    parts.materials.push(Material::emitter("black", Vec3::ZERO));
    let black = parts.materials.len() as u32 - 1;
    let mesh = &mut parts.meshes[0];
    let first = mesh.positions.len() as u32;
    // Far behind the camera.
    mesh.positions
        .extend([Vec3::Z * 20.0, Vec3::new(1.0, 0.0, 20.0), Vec3::new(0.0, 1.0, 20.0)]);
    mesh.indices.push([first, first + 1, first + 2]);
    mesh.materials.push(black);
    mesh.origins.push(0);
    parts
}

/// Bits that differ between one thread and several.
fn threads(bench: &mut Bench) -> Result<()> {
    let what = bench.pick("demo:rooms:64", "demo:rooms:256", "demo:rooms");
    let scene = scene::load(what)?;
    for (name, method) in methods() {
        let mut shot = Shot::new(&scene, &scene.parts.cameras[0], method, (50, 38));
        shot.settings.max_bounces = 2;
        let picture = |threads: usize| -> Result<Vec<[f32; 3]>> {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .context("no threads")?;
            pool.install(|| {
                let mut rendering = renderer(shot.scene, shot.camera, &shot.settings)?;
                for _ in 0..9 {
                    rendering.render_frame();
                }
                Ok(rendering.film().image().pixels)
            })
        };
        bench.now(format_args!("threads, {name}"))?;
        let one = picture(1)?;
        for threads in [2, 5] {
            let several = picture(threads)?;
            let differ = one
                .iter()
                .zip(&several)
                .filter(|(a, b)| a.map(f32::to_bits) != b.map(f32::to_bits));
            bench.check(
                format!("{threads} threads against one, pixels that differ"),
                name,
                NEVER,
                differ.count() as f64,
            );
        }
    }
    Ok(())
}
