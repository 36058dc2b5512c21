//! Lights, points and checks that the tests of all samplers share.

use crate::{Bounce, LightSampler, Observation, ShadingPoint};
use glam::Vec3;
use sampling::Random;
use sampling::guide::PARTS;
use sampling::hemisphere::uniform_sphere;
use sampling::statistics::{chi_square_p, pooled_chi_square};
use scene::{Light, LightKind, PrimitiveId, Scene, SceneParts};
use std::f32::consts::PI;

/// A triangle light at `position`, its corners offset by `size`, facing `normal`.
pub(crate) fn triangle(position: Vec3, normal: Vec3, size: f32, radiance: f32) -> Light {
    let edge1 = normal.any_orthonormal_vector() * size;
    let edge2 = normal.cross(edge1);
    let area = 0.5 * size * size;
    Light {
        kind: LightKind::Triangle,
        double_sided: false,
        textured: false,
        position_ws: position,
        edge1_ws: edge1,
        edge2_ws: edge2,
        normal_ws: normal,
        intensity: Vec3::splat(radiance),
        area,
        range: f32::INFINITY,
        cos_inner: 1.0,
        cos_outer: 0.0,
        power: PI * area * radiance,
        primitive: PrimitiveId::NONE,
    }
}

/// A point light.
pub(crate) fn point(position: Vec3, intensity: f32) -> Light {
    Light {
        kind: LightKind::Point,
        area: 0.0,
        edge1_ws: Vec3::ZERO,
        edge2_ws: Vec3::ZERO,
        normal_ws: Vec3::ZERO,
        power: 4.0 * PI * intensity,
        ..triangle(position, Vec3::Z, 1.0, intensity)
    }
}

/// A light at infinity that goes along `direction`.
pub(crate) fn directional(direction: Vec3, irradiance: f32) -> Light {
    Light {
        kind: LightKind::Directional,
        normal_ws: direction.normalize(),
        power: irradiance * PI * 100.0,
        ..point(Vec3::ZERO, irradiance)
    }
}

/// Lights of all kinds, directional ones first as in a scene, in a cube of side 10.
pub(crate) fn mixed_lights(count: usize, seed: u64) -> Vec<Light> {
    (0..count as u32)
        .map(|i| {
            let random = Random::new(seed, i, 0);
            let position = Vec3::new(random.f32(0), random.f32(1), random.f32(2)) * 10.0;
            let axis = uniform_sphere(random.vec2(3));
            // Three decades of strength.
            let strength = 10.0_f32.powf(3.0 * random.f32(5));
            match i {
                0 | 1 if count > 8 => directional(axis, strength * 0.1),
                _ => match i % 4 {
                    0 => point(position, strength),
                    1 => Light {
                        kind: LightKind::Spot,
                        normal_ws: axis,
                        cos_inner: 0.9,
                        cos_outer: 0.6,
                        range: if i % 8 == 1 { 6.0 } else { f32::INFINITY },
                        ..point(position, strength)
                    },
                    2 => Light {
                        double_sided: true,
                        ..triangle(position, axis, 0.3, strength)
                    },
                    _ => triangle(position, axis, 0.5, strength),
                },
            }
        })
        .collect()
}

/// Points in and around the cube of [`mixed_lights`].
pub(crate) fn points(count: u32, seed: u64) -> Vec<ShadingPoint> {
    (0..count)
        .map(|i| {
            let random = Random::new(seed, i, 1);
            ShadingPoint {
                position_ws: Vec3::new(random.f32(0), random.f32(1), random.f32(2)) * 14.0 - 2.0,
                normal_ws: uniform_sphere(random.vec2(3)),
                primary: i % 3 != 0,
            }
        })
        .collect()
}

/// A scene that has lights and nothing else.
pub(crate) fn scene_of(lights: Vec<Light>) -> Scene {
    let mut scene = Scene::new(SceneParts::default()).expect("an empty scene is valid");
    scene.lights = lights;
    scene.center_ws = Vec3::splat(5.0);
    scene.radius = 9.0;
    scene
}

/// What every sampler promises, at `points`: probabilities sum to 1, `sample` and `pmf` agree to the bit, larger random
/// numbers never lead back (`monotone`), every light that can contribute can be drawn, and frequencies fit.
pub(crate) fn check<S: LightSampler>(sampler: &S, scene: &Scene, points: &[ShadingPoint]) {
    let count = scene.lights.len();
    let min_probability = sampler.stats().min_probability;
    for (index, point) in (0u32..).zip(points) {
        let local = sampler.local(scene, point);
        let mut pmfs = vec![0.0; count];
        sampler.add_pmfs(&local, &mut pmfs);
        let total = pmfs.iter().sum::<f64>();
        let drawn = [0, 1, u32::MAX / 2, u32::MAX].map(|u| sampler.sample(&local, u));
        if drawn[0].is_none() {
            assert_eq!(total, 0.0, "nothing is drawn where everything has probability 0");
            assert!(drawn.iter().all(Option::is_none));
        } else {
            assert!((total - 1.0).abs() < 1e-5, "probabilities sum to {total}");
        }
        for (light, &pmf) in pmfs.iter().enumerate() {
            assert_eq!(pmf as f32, sampler.pmf(&local, light as u32), "add_pmfs and pmf agree");
            if scene.lights[light].unshadowed_irradiance(point.position_ws, point.normal_ws) > 0.0 {
                assert!(
                    pmf > 0.0,
                    "light {light} can contribute at {point:?} and is never drawn"
                );
                assert!(pmf >= min_probability * 0.999_999);
            }
        }
        let draws = 4096_u32;
        let mut observed = vec![0_u64; count];
        for draw in 0..draws {
            let random = Random::new(7, index, draw);
            let u = (draw << 20) | (random.u32(0) >> 12);
            if let Some(choice) = sampler.sample(&local, u) {
                assert_eq!(choice.pmf, sampler.pmf(&local, choice.light), "sample and pmf agree");
                assert!(choice.pmf > 0.0);
                observed[choice.light as usize] += 1;
            }
        }
        let us: Vec<u32> = (0..19).map(|draw| Random::new(8, index, draw).u32(0)).collect();
        let mut each = vec![None; us.len()];
        sampler.sample_each(&local, &us, &mut each);
        for (&u, choice) in us.iter().zip(&each) {
            assert_eq!(*choice, sampler.sample(&local, u), "sample_each and sample agree");
        }
        if total > 0.0 {
            let expected: Vec<f64> = pmfs.iter().map(|p| p * f64::from(draws)).collect();
            let (statistic, dof) = pooled_chi_square(&observed, &expected, 5.0);
            // Stratified numbers fit better than independent ones, so a false alarm is rarer than 1e-6 per point.
            assert!(
                dof == 0 || chi_square_p(statistic, dof) > 1e-6,
                "chi-square {statistic} of {dof}"
            );
        }
    }
}

/// With stratified random numbers every light comes up as often as its probability says: the sum of 1 / (pmf n) over its draws is near 1
/// (finds lights that are never drawn; after pbrt-v4's test of its light samplers).
pub(crate) fn check_each_light_is_drawn<S: LightSampler>(sampler: &S, scene: &Scene) {
    let points = points(64, 6);
    let locals = points.iter().map(|point| sampler.local(scene, point));
    let local = locals
        .into_iter()
        .find(|local| sampler.sample(local, 0).is_some())
        .expect("some point is lit");
    let draws = 1_u32 << 18;
    let mut sums = vec![0.0; scene.lights.len()];
    for draw in 0..draws {
        let choice = sampler
            .sample(&local, draw << 14 | 0x1fff)
            .expect("a lit point always has a light");
        sums[choice.light as usize] += 1.0 / (f64::from(choice.pmf) * f64::from(draws));
    }
    for (light, sum) in sums.iter().enumerate() {
        let pmf = f64::from(sampler.pmf(&local, light as u32));
        if pmf * f64::from(draws) > 64.0 {
            assert!((sum - 1.0).abs() < 0.05, "light {light} of probability {pmf}: {sum}");
        }
    }
}

/// The part of the hemisphere that light comes from in [`observe`].
pub(crate) const LIT_PART: u16 = 21;

fn bounce(index: u32) -> Bounce {
    let part = (index / 2 % PARTS as u32) as u16;
    Bounce {
        part,
        radiance: if part == LIT_PART { 10.0 } else { 0.5 },
    }
}

/// What a frame of 4,000 samples would report if the lights for which `visible` holds were visible from everywhere: logs
/// of several tiles, one of them empty.
pub(crate) fn observe<S: LightSampler>(
    sampler: &S,
    scene: &Scene,
    frame: u32,
    visible: impl Fn(u32) -> bool,
) -> Vec<Vec<Observation>> {
    let mut logs = vec![Vec::new(); 4];
    for (index, point) in (0_u32..).zip(points(4000, u64::from(frame) + 100)) {
        let u = Random::new(13, index, frame).u32(0);
        let Some(choice) = sampler.sample(&sampler.local(scene, &point), u) else {
            continue;
        };
        let light = &scene.lights[choice.light as usize];
        let unshadowed = light.unshadowed_irradiance(point.position_ws, point.normal_ws);
        if unshadowed > 0.0 {
            logs[index as usize * 3 / 4000].push(Observation {
                point,
                light: choice.light,
                unshadowed,
                irradiance: unshadowed,
                pmf: choice.pmf,
                visible: visible(choice.light),
                weight: 1,
                bounce: (index % 2 == 0).then(|| bounce(index)),
            });
        }
    }
    logs
}

/// What is saved of `learned` goes on as it would, and damaged bytes are refused or harmless: nothing made of them may panic, or report what is no
/// probability. `fresh`: of the same scene and settings.
pub(crate) fn check_saving<S: LightSampler>(learned: &mut S, fresh: impl Fn() -> S, scene: &Scene, rounds: u32) {
    let saved = learned.save().expect("it can be saved");
    let pmfs = |sampler: &S| -> Vec<f32> {
        let of = |point: &ShadingPoint| {
            let local = sampler.local(scene, point);
            (0..scene.lights.len() as u32)
                .map(|light| sampler.pmf(&local, light))
                .collect::<Vec<f32>>()
        };
        points(24, 5).iter().flat_map(of).collect()
    };
    let teach = |sampler: &mut S, frames: u32| {
        for frame in 50..50 + frames {
            let logs = observe(sampler, scene, frame, |light| light.is_multiple_of(3));
            sampler.end_frame(scene, &logs);
        }
    };
    let mut restored = fresh();
    assert!(restored.restore(&saved));
    assert_eq!(pmfs(learned), pmfs(&restored));
    for sampler in [&mut *learned, &mut restored] {
        teach(sampler, 9);
    }
    assert_eq!(pmfs(learned), pmfs(&restored));

    let mut taken = 0;
    for round in 0..rounds {
        let random = |dimension| Random::new(17, round, 0).u32(dimension) as usize;
        let mut forged = saved.clone();
        for change in 0..1 + random(0) % 4 {
            let at = random(2 * change as u32 + 1) % forged.len();
            forged[at] = random(2 * change as u32 + 2) as u8;
        }
        let mut sampler = fresh();
        if sampler.restore(&forged) {
            taken += 1;
            assert!(
                pmfs(&sampler).iter().all(|pmf| (0.0..=1.0).contains(pmf)),
                "round {round}"
            );
            teach(&mut sampler, 2);
            assert!(
                pmfs(&sampler).iter().all(|pmf| (0.0..=1.0).contains(pmf)),
                "round {round}"
            );
            let _ = (
                sampler.records(scene),
                sampler.cells(scene),
                sampler.pack(),
                sampler.stats(),
            );
        }
    }
    assert!(
        (1..rounds).contains(&taken),
        "{taken} of {rounds} damaged states were taken"
    );
}
