//! Radiance over sixty decades, lights that are black, saturated or not to be believed.

use super::bench::{Bench, NEVER, STANDARD_ERRORS, Shot};
use super::scenes::{WITH_FLOOR, exact_and, furnaces, inside, methods, square_lamp, still_life};
use anyhow::Result;
use glam::Vec3;
use scene::assemble::{Builder, point};
use scene::{Camera, LightSource, Material, Scene, SceneParts, luminance};

/// What a point in a furnace shows over what its walls emit.
const FURNACE: f64 = 1.5;

/// Checks the family.
pub(super) fn check(bench: &mut Bench) -> Result<()> {
    one_magnitude(bench)?;
    sixty_decades(bench)?;
    powers_of_two(bench)?;
    one_giant(bench)?;
    lights_put_out(bench)?;
    saturated(bench)?;
    invalid(bench)
}

/// A scene all of whose lights are very weak or very strong: the closed form, for every sampler.
fn one_magnitude(bench: &mut Bench) -> Result<()> {
    for exponent in [-30, -20, 20, 30] {
        let radiance = 10_f64.powi(exponent);
        let (scene, cameras) = furnaces(&[Vec3::splat(radiance as f32)])?;
        for (name, method) in methods() {
            let hazard = format!("all radiance 1e{exponent}");
            bench.now(format_args!("{hazard}, {name}"))?;
            let shot = Shot::new(&scene, &cameras[0], method, (16, 12)).effort(16, 8);
            let estimate = shot.estimate()?;
            bench.check(&hazard, name, STANDARD_ERRORS, estimate.deviation(FURNACE * radiance));
            bench.check(&hazard, name, NEVER, estimate.broken as f64);
        }
    }
    Ok(())
}

/// Closed rooms side by side with radiances from 1e-30 to 1e30: each is as bright as if it were alone. The plain samplers without
/// a guaranteed probability would have to be run for 1e60 samples in the dark rooms.
fn sixty_decades(bench: &mut Bench) -> Result<()> {
    let exponents: &[i32] = bench.pick(&[-30, 0, 30], &[-30, -15, 0, 15, 30], &[-30, -20, -10, 0, 10, 20, 30]);
    let radiances: Vec<f64> = exponents.iter().map(|&exponent| 10_f64.powi(exponent)).collect();
    let emission: Vec<Vec3> = radiances.iter().map(|&radiance| Vec3::splat(radiance as f32)).collect();
    let (scene, cameras) = furnaces(&emission)?;
    for (name, method) in exact_and(&WITH_FLOOR) {
        for ((camera, &radiance), exponent) in cameras.iter().zip(&radiances).zip(exponents) {
            let hazard = format!("1e-30 to 1e30 in one scene, room of 1e{exponent}");
            bench.now(format_args!("{hazard}, {name}"))?;
            let shot =
                Shot::new(&scene, camera, method, (24, 16)).effort(bench.pick(16, 40, 160), bench.pick(8, 16, 16));
            let estimate = shot.estimate()?;
            bench.check(&hazard, name, STANDARD_ERRORS, estimate.deviation(FURNACE * radiance));
            bench.check(&hazard, name, NEVER, estimate.broken as f64);
        }
    }
    Ok(())
}

/// All light times a power of two: the same picture times that power, to the last bit but for what is rounded at the ends.
fn powers_of_two(bench: &mut Bench) -> Result<()> {
    let (parts, camera) = still_life(square_lamp);
    let scene = Scene::new(parts)?;
    let picture = |scene: &Scene, method| -> Result<Vec<f64>> {
        let estimate = Shot::new(scene, &camera, method, (32, 24)).effort(12, 1).estimate()?;
        Ok(estimate.pixels.iter().map(|pixel| pixel.mean()).collect())
    };
    for exponent in [-90, -40, 40, 90] {
        let factor = 2_f32.powi(exponent);
        let factors: Vec<(u32, Vec3)> = (0..scene.lights.len() as u32)
            .map(|i| (i, Vec3::splat(factor)))
            .collect();
        let scaled = scene.relit(&factors);
        for (name, method) in methods() {
            let hazard = format!("all light times 2^{exponent}");
            bench.now(format_args!("{hazard}, {name}"))?;
            let (plain, scaled) = (picture(&scene, method)?, picture(&scaled, method)?);
            let deviations = plain
                .iter()
                .zip(&scaled)
                .map(|(a, b)| (b / f64::from(factor) - a).abs() / a.max(1e-3));
            bench.check(
                hazard,
                name,
                ("relative difference", 1e-5),
                deviations.fold(0.0, f64::max),
            );
        }
    }
    Ok(())
}

/// A light 1e20 times as strong as the others, that does not reach the image.
fn one_giant(bench: &mut Bench) -> Result<()> {
    let (scene, cameras) = furnaces(&[Vec3::ONE, Vec3::splat(1e20)])?;
    for (name, method) in exact_and(&WITH_FLOOR) {
        let hazard = "hidden lights 1e20 times as strong";
        bench.now(format_args!("{hazard}, {name}"))?;
        let shot =
            Shot::new(&scene, &cameras[0], method, (24, 16)).effort(bench.pick(16, 40, 160), bench.pick(8, 16, 16));
        let estimate = shot.estimate()?;
        bench.check(hazard, name, STANDARD_ERRORS, estimate.deviation(FURNACE));
        bench.check(hazard, name, NEVER, estimate.broken as f64);
    }
    Ok(())
}

/// Lights that have been put out while somebody looks on stay in the list: the picture is black.
fn lights_put_out(bench: &mut Bench) -> Result<()> {
    let (parts, camera) = still_life(square_lamp);
    let scene = Scene::new(parts)?;
    for (hazard, factor) in [("all lights put out", 0.0), ("all lights dimmed to denormals", 1e-42)] {
        let all: Vec<(u32, Vec3)> = (0..scene.lights.len() as u32)
            .map(|i| (i, Vec3::splat(factor)))
            .collect();
        let dark = scene.relit(&all);
        for (name, method) in methods() {
            bench.now(format_args!("{hazard}, {name}"))?;
            let estimate = Shot::new(&dark, &camera, method, (24, 18)).effort(8, 2).estimate()?;
            bench.check(hazard, name, ("luminance", 1e-40), estimate.mean.mean());
            bench.check(hazard, name, NEVER, estimate.broken as f64);
        }
    }
    Ok(())
}

/// Light of one channel only: the others stay exactly black, roulette does not kill it, the mean is right.
fn saturated(bench: &mut Bench) -> Result<()> {
    for (channel, color) in [("red", Vec3::X), ("green", Vec3::Y), ("blue", Vec3::Z)] {
        let (scene, cameras) = furnaces(&[color * 100.0])?;
        for (name, method) in methods() {
            let hazard = format!("{channel} light only, six bounces");
            bench.now(format_args!("{hazard}, {name}"))?;
            let mut shot = Shot::new(&scene, &cameras[0], method, (16, 12)).effort(bench.pick(16, 24, 96), 8);
            shot.settings.max_bounces = 6;
            let estimate = shot.estimate()?;
            let expected = (0..8).map(|n| 0.5_f64.powi(n)).sum::<f64>() * f64::from(luminance(color * 100.0));
            bench.check(hazard, name, STANDARD_ERRORS, estimate.deviation(expected));
        }
    }
    Ok(())
}

/// Emission that is negative, infinite or no number is no light, is warned of by name, and lights nothing.
fn invalid(bench: &mut Bench) -> Result<()> {
    for value in [0.0, -1.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let (low, high) = (Vec3::ZERO, Vec3::new(3.0, 2.0, 2.5));
        let mut builder = Builder::default();
        let wall = builder.material(Material::lambert("wall", Vec3::splat(0.5)));
        builder.room(low, high, wall);
        let mut with_point = builder.parts();
        let source = LightSource {
            node: "odd lamp".into(),
            ..LightSource::default()
        };
        let light = point(Vec3::new(1.5, 1.0, 1.2), Vec3::splat(value));
        with_point.punctual.push((light, source));
        let lamp = builder.material(Material::emitter("odd lamp", Vec3::splat(value)));
        builder.quad(Vec3::new(1.0, 1.9, 1.0), Vec3::X, Vec3::Z, lamp);
        for (what, parts) in [("emission", builder.parts()), ("intensity", with_point)] {
            no_light(
                bench,
                &format!("{what} {value}"),
                parts,
                &inside(low, high),
                value != 0.0,
            )?;
        }
    }
    Ok(())
}

/// The scene is black, and if `due` it is said what of the name "odd lamp" was wrong.
fn no_light(bench: &mut Bench, hazard: &str, parts: SceneParts, camera: &Camera, due: bool) -> Result<()> {
    let scene = Scene::new(parts)?;
    let warnings = &scene.parts.report.warnings;
    let warned = warnings.iter().any(|warning| warning.contains("odd lamp"));
    bench.check(hazard, "lights that are left", NEVER, scene.lights.len() as f64);
    let missing = f64::from(u8::from(warned != due));
    bench.check(hazard, "warnings that are missing", NEVER, missing);
    for (name, method) in methods() {
        bench.now(format_args!("{hazard}, {name}"))?;
        let estimate = Shot::new(&scene, camera, method, (8, 6)).effort(4, 1).estimate()?;
        bench.check(hazard, name, NEVER, estimate.broken as f64);
        bench.check(hazard, name, ("luminance", 0.0), estimate.mean.mean());
    }
    Ok(())
}
