//! Whole scenes made large or small, or moved far away: the picture and its error stay what they are.

use super::bench::{Bench, Estimate, NEVER, STANDARD_ERRORS, Shot};
use super::scenes::{square_lamp, still_life, transformed};
use anyhow::Result;
use glam::DVec3;
use light_cache::SamplerKind;
use render::Method;
use scene::{Scene, SceneParts};

/// By how much the variance of a picture may grow where its error may grow by 1.2.
const VARIANCE: (&str, f64) = ("times the variance", 1.44);

const METHODS: [Method; 5] = [
    Method::Sampled(SamplerKind::Uniform),
    Method::Sampled(SamplerKind::Octree),
    Method::Sampled(SamplerKind::Tree),
    Method::Sampled(SamplerKind::Table),
    Method::Sampled(SamplerKind::Adaptive),
];

/// Checks the family.
pub(super) fn check(bench: &mut Bench) -> Result<()> {
    let mut still = still_life(square_lamp);
    still.0.cameras = vec![still.1];
    let mut scenes = vec![("still life", still.0)];
    for name in bench.pick(
        &[][..],
        &["rooms:128", "spheres:32", "points:128"],
        &["rooms", "spheres", "points"],
    ) {
        scenes.push((name, scene::generate::demo(name)?));
    }
    let far = DVec3::new(1e5, 0.0, 1e5);
    let places = [
        ("times 1e-4", 1e-4, DVec3::ZERO),
        ("times 1e-3", 1e-3, DVec3::ZERO),
        ("times 1e3", 1e3, DVec3::ZERO),
        ("times 1e5", 1e5, DVec3::ZERO),
        ("1e5 m from the origin", 1.0, far),
    ];
    for (name, parts) in scenes {
        for method in METHODS {
            bench.now(format_args!("{name}, where it is, {}", method.name()))?;
            // Other random numbers for the means, which must agree by themselves; the same for the variances, which spikes dominate.
            let [original, alike] = [
                measured(bench, parts.clone(), method, 0)?,
                measured(bench, parts.clone(), method, 1000)?,
            ];
            for (place, scale, offset) in places {
                let hazard = format!("{name}, {place}");
                bench.now(format_args!("{hazard}, {}", method.name()))?;
                let there = measured(bench, transformed(parts.clone(), scale, offset), method, 1000)?;
                compare(bench, &hazard, method.name(), &there, [&original, &alike]);
            }
        }
    }
    Ok(())
}

fn measured(bench: &Bench, parts: SceneParts, method: Method, seed: u64) -> Result<Estimate> {
    let scene = Scene::new(parts)?;
    let mut shot = Shot::new(&scene, &scene.parts.cameras[0], method, (32, 24)).effort(16, bench.pick(12, 16, 64));
    shot.settings.max_bounces = 1;
    shot.seed(seed).estimate()
}

fn compare(bench: &mut Bench, hazard: &str, subject: &str, there: &Estimate, [original, alike]: [&Estimate; 2]) {
    bench.check(hazard, subject, NEVER, there.broken as f64);
    bench.check(hazard, subject, STANDARD_ERRORS, there.deviation_from(original));
    let ratio = there.relative_variance() / alike.relative_variance();
    bench.check(hazard, subject, VARIANCE, ratio);
}
