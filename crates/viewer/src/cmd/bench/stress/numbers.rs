//! Densities that are zero, infinite or subnormal, and random numbers at the ends of their range.

use super::bench::{Bench, NEVER};
use super::scenes::{square_lamp, still_life};
use anyhow::Result;
use glam::{Vec2, Vec3};
use light_cache::{LightSampler, SamplerKind, Settings, ShadingPoint, Visitor};
use sampling::hemisphere::{Frame, cosine_hemisphere, uniform_cone, uniform_disk, uniform_sphere};
use sampling::mis::Heuristic;
use sampling::triangle::uniform_triangle;
use sampling::{Random, SphericalRectangle, SphericalTriangle, ggx, unit_f32};
use scene::{Bsdf, Scene};

/// Densities at the limits of `f32`, and what is no density.
const DENSITIES: [f32; 16] = [
    0.0,
    -0.0,
    1e-45,
    1e-40,
    f32::MIN_POSITIVE,
    1e-30,
    1e-19,
    0.5,
    1.0,
    1e19,
    1e20,
    1e30,
    f32::MAX,
    f32::INFINITY,
    f32::NAN,
    -1.0,
];

/// Numbers of a generator that is set against us: the least, the largest, and those around one half.
const UNITS: [f32; 6] = [0.0, 5.960_464_5e-8, 0.499_999_97, 0.5, 0.75, 0.999_999_94];

/// Largest weight of a sample of the BSDF: a lobe is drawn with a probability of at least 0.1, and the diffuse one is enlarged at most twice.
const MOST_WEIGHT: f64 = 20.0;

/// Checks the family.
pub(super) fn check(bench: &mut Bench) -> Result<()> {
    bench.now("densities and random numbers at their limits")?;
    mis_weights(bench);
    units(bench);
    warps(bench);
    bsdfs(bench);
    let scene = Scene::new(still_life(square_lamp).0)?;
    lights(bench, &scene);
    for kind in SamplerKind::ALL {
        let faults = light_cache::build(&scene, &Settings::default(), kind, Choices(&scene));
        bench.check(
            "extreme random numbers",
            format!("choice, {}", kind.name()),
            NEVER,
            faults,
        );
    }
    Ok(())
}

/// Weights lie in [0, 1] and sum to 1 where anything is possible.
fn mis_weights(bench: &mut Bench) {
    for heuristic in Heuristic::ALL {
        let (mut outside, mut worst) = (0, 0.0_f64);
        for a in DENSITIES {
            for b in DENSITIES {
                let weights = [heuristic.of_two(a, b), heuristic.of_two(b, a)];
                outside += weights.iter().filter(|w| !(0.0..=1.0).contains(*w)).count();
                let expected = f64::from(u8::from(a > 0.0 || b > 0.0));
                worst = worst.max((weights.iter().map(|w| f64::from(*w)).sum::<f64>() - expected).abs());
            }
        }
        let hazard = "densities 0, subnormal, huge, infinite, NaN";
        bench.check(
            hazard,
            format!("{}, weights out of range", heuristic.name()),
            NEVER,
            outside as f64,
        );
        bench.check(hazard, heuristic.name(), ("sum less 1", 1e-6), worst);
    }
}

/// Numbers made from the last bits stay below 1.
fn units(bench: &mut Bench) {
    let bits = [0, 1, 255, 256, u32::MAX - 256, u32::MAX - 1, u32::MAX];
    let outside = bits
        .iter()
        .filter(|&&bits| !(0.0..1.0).contains(&unit_f32(bits)))
        .count();
    bench.check("extreme random numbers", "unit_f32", NEVER, outside as f64);
}

/// All pairs of extreme numbers, with a few ordinary ones between.
fn pairs() -> impl Iterator<Item = Vec2> {
    UNITS
        .into_iter()
        .flat_map(|x| UNITS.into_iter().map(move |y| Vec2::new(x, y)))
}

fn warps(bench: &mut Bench) {
    let hazard = "extreme random numbers";
    let is_unit = |v: Vec3| (v.length() - 1.0).abs() < 1e-5;
    let faults = |fault: &dyn Fn(Vec2) -> bool| pairs().filter(|&u| fault(u)).count() as f64;
    let triangle = faults(&|u| {
        let b = uniform_triangle(u);
        !(b.min_element() >= 0.0 && b.x + b.y <= 1.0)
    });
    bench.check(hazard, "uniform_triangle", NEVER, triangle);
    bench.check(
        hazard,
        "uniform_disk",
        NEVER,
        faults(&|u| !(0.0..=1.000_001).contains(&uniform_disk(u).length())),
    );
    bench.check(
        hazard,
        "uniform_sphere",
        NEVER,
        faults(&|u| !is_unit(uniform_sphere(u))),
    );
    for versine in [1e-12, 1e-6, 1.0, 2.0] {
        let fault = faults(&|u| !is_unit(uniform_cone(u, versine)));
        bench.check(hazard, format!("uniform_cone, versine {versine:e}"), NEVER, fault);
    }
    let hemisphere = faults(&|u| {
        let v = cosine_hemisphere(u);
        !(is_unit(v) && v.z >= 0.0)
    });
    bench.check(hazard, "cosine_hemisphere", NEVER, hemisphere);
    let count = bench.pick(1_000, 30_000, 300_000);
    let (mut spherical, mut rectangular, mut microfacets) = (0, 0, 0);
    for i in 0..count {
        let random = Random::new(12, i, 0);
        let scale = 10_f32.powf(12.0 * random.f32(20) - 6.0);
        let [a, b, c] =
            [0, 2, 4].map(|dimension| uniform_sphere(random.vec2(dimension)) * scale * random.f32(6 + dimension));
        let u = pairs().nth(i as usize % 36).unwrap_or_default();
        if let Some(triangle) = SphericalTriangle::new(a, b, c) {
            spherical += u32::from(!is_unit(triangle.sample(u)));
        }
        if let Some(rectangle) = SphericalRectangle::new(a, b, b.any_orthogonal_vector()) {
            rectangular += u32::from(!rectangle.sample(u).is_finite());
        }
        let alpha = 10_f32.powf(-3.0 * random.f32(12));
        let mut wo = uniform_sphere(random.vec2(13));
        wo.z = wo.z.abs().max(1e-6);
        let half = ggx::sample_vndf(wo.normalize(), alpha, u);
        let pdf = ggx::pdf_vndf(wo.normalize(), half, alpha);
        microfacets += u32::from(!(is_unit(half) && half.z >= 0.0 && pdf >= 0.0 && pdf.is_finite()));
    }
    bench.check(hazard, "spherical triangle", NEVER, f64::from(spherical));
    bench.check(hazard, "spherical rectangle", NEVER, f64::from(rectangular));
    bench.check(hazard, "GGX visible normals", NEVER, f64::from(microfacets));
}

/// Directions from BSDFs of any roughness at any angle, grazing ones too.
fn bsdfs(bench: &mut Bench) {
    let count = bench.pick(2_000, 200_000, 2_000_000);
    let (mut faults, mut largest) = (0, 0.0_f32);
    for i in 0..count {
        let random = Random::new(13, i, 0);
        let normal_ws = uniform_sphere(random.vec2(0));
        let bsdf = Bsdf {
            normal_ws,
            diffuse: Vec3::splat(random.f32(2)),
            f0: Vec3::splat(if i % 3 == 0 { 1.0 } else { 0.04 }),
            f90: 1.0,
            alpha: (10_f32.powf(-3.5 * random.f32(3))).max(scene::bsdf::MIN_ALPHA),
        };
        let cosine = 10_f32.powf(-7.0 * random.f32(4));
        let local = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
        let wo_ws = Frame::new(normal_ws).to_world(local);
        let u = pairs().nth(i as usize % 36).unwrap_or_default();
        let lobe = UNITS[i as usize / 36 % 6];
        if let Some(sample) = bsdf.sample(wo_ws, lobe, u) {
            let weight = sample.value / sample.pdf_solid_angle;
            let finite = sample.wi_ws.is_finite() && weight.is_finite() && weight.min_element() >= 0.0;
            faults += u32::from(!finite || sample.pdf_solid_angle <= 0.0);
            largest = largest.max(weight.max_element());
        }
    }
    bench.check("extreme random numbers", "BSDF", NEVER, f64::from(faults));
    bench.check(
        "extreme random numbers",
        "BSDF",
        ("times the radiance", MOST_WEIGHT),
        f64::from(largest),
    );
}

/// Points on lights as seen from anywhere, the lights' own corners and planes included.
fn lights(bench: &mut Bench, scene: &Scene) {
    let mut faults = 0;
    for light in &scene.lights {
        let corners = [
            Vec3::ZERO,
            light.edge1_ws,
            light.edge2_ws,
            light.edge1_ws * 2.0,
            Vec3::splat(1e-6),
            Vec3::splat(1e4),
        ];
        for offset in corners {
            let from = light.position_ws + offset;
            for u in pairs() {
                if let Some(point) = light.sample(from, u) {
                    let pdf = light.pdf_solid_angle(from, point.wi_ws, point.distance);
                    let finite =
                        point.wi_ws.is_finite() && point.radiance.is_finite() && point.pdf_solid_angle.is_finite();
                    let fault =
                        !finite || point.pdf_solid_angle <= 0.0 || point.distance.is_nan() || pdf.is_nan() || pdf < 0.0;
                    faults += u32::from(fault);
                }
            }
            let irradiance = light.unshadowed_irradiance(from, Vec3::Y);
            faults += u32::from(!(irradiance >= 0.0 && irradiance.is_finite()));
        }
    }
    bench.check("extreme random numbers", "points on lights", NEVER, f64::from(faults));
}

/// Lights chosen with extreme numbers at ordinary and extreme points: any light, with its probability.
struct Choices<'s>(&'s Scene);

impl Visitor for Choices<'_> {
    type Output = f64;

    fn visit<S: LightSampler + 'static>(self, sampler: S) -> f64 {
        let mut faults = 0;
        let lights = self.0.lights.iter().map(|light| light.position_ws);
        let places = lights.chain([Vec3::ZERO, Vec3::splat(1e4), Vec3::splat(-1e-6), Vec3::splat(1e-40)]);
        for position_ws in places {
            for normal_ws in [Vec3::Y, Vec3::NEG_Y, Vec3::X] {
                let point = ShadingPoint {
                    position_ws,
                    normal_ws,
                    primary: true,
                };
                let local = sampler.local(self.0, &point);
                for u in [0, 1, 255, 1 << 31, u32::MAX - 1, u32::MAX] {
                    faults += i32::from(sampler.sample(&local, u).is_some_and(|choice| {
                        let known = (choice.light as usize) < self.0.lights.len();
                        let possible = choice.pmf > 0.0 && choice.pmf <= 1.000_001;
                        !(known && possible && choice.pmf == sampler.pmf(&local, choice.light))
                    }));
                }
            }
        }
        f64::from(faults)
    }
}
