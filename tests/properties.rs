//! What must hold for any scene.

use glam::Vec3;
use light_cache::{Choice, LightSampler, Observation, SamplerKind, ShadingPoint, Visitor};
use render::{Method, Settings};
use sampling::Random;
use sampling::statistics::{chi_square_p, pooled_chi_square};
use scene::surface::NO_LIGHT;
use scene::{Camera, Material, PrimitiveId, Ray, Scene, SceneParts};
use tests::compare::{Case, Plan, assert_same, disagreement, image, sampled};
use tests::scenes::{Builder, ground, meter, point, square_lamp, still_life, still_life_camera};

fn still_life_plan(seed: u64) -> Plan {
    Plan::new(sampled(SamplerKind::Tree), 24, 18)
        .bounces(1)
        .effort(32, 24)
        .seed(seed)
}

/// Asserts that `scene` seen by `camera` looks like the still life.
fn assert_looks_like_still_life(what: &str, scene: &Scene, camera: &Camera) {
    let (original, its_camera) = (
        still_life(1.0, square_lamp(1.0)).build().expect("the scene is valid"),
        still_life_camera(1.0),
    );
    let original = Case::new(&original, &its_camera, still_life_plan(0)).measure();
    assert_same(what, &Case::new(scene, camera, still_life_plan(1000)), &original);
}

/// The comparison that the tests here rely on is sharp: one of several lamps a tenth dimmer does not pass.
#[test]
fn a_dimmer_lamp_is_noticed() {
    let (original, camera) = (
        still_life(1.0, square_lamp(1.0)).build().expect("the scene is valid"),
        still_life_camera(1.0),
    );
    let mut parts = still_life(1.0, square_lamp(1.0)).parts();
    parts.punctual[0].0.intensity *= 0.9;
    let dimmer = Scene::new(parts).expect("the scene is valid");
    let [a, b] = [(&original, 0), (&dimmer, 1000)]
        .map(|(scene, seed)| Case::new(scene, &camera, still_life_plan(seed)).estimate());
    assert!(disagreement(&a, &b).is_some(), "{:?} passes as {:?}", b.mean, a.mean);
}

#[test]
fn the_order_of_lights_does_not_matter() {
    let mut parts = still_life(1.0, square_lamp(1.0)).parts();
    parts.punctual.reverse();
    let mesh = &mut parts.meshes[0];
    mesh.indices.reverse();
    mesh.materials.reverse();
    let permuted = Scene::new(parts).expect("the scene is valid");
    assert_looks_like_still_life("lights permuted", &permuted, &still_life_camera(1.0));
}

#[test]
fn a_lamp_cut_in_four_shines_alike() {
    let cut = still_life(1.0, |builder, material| {
        for (x, z) in [(0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5)] {
            builder.quad(Vec3::new(x - 1.0, 3.0, z - 1.0), Vec3::X * 0.5, Vec3::Z * 0.5, material);
        }
    });
    let cut = cut.build().expect("the scene is valid");
    assert_eq!(
        cut.lights.len(),
        still_life(1.0, square_lamp(1.0))
            .build()
            .expect("the scene is valid")
            .lights
            .len()
            + 6
    );
    assert_looks_like_still_life("lamp in four", &cut, &still_life_camera(1.0));
}

#[test]
fn the_unit_of_length_does_not_matter() {
    for scale in [1e-3, 1e4] {
        let scaled = still_life(scale, square_lamp(scale))
            .build()
            .expect("the scene is valid");
        assert_looks_like_still_life(&format!("scaled by {scale}"), &scaled, &still_life_camera(scale));
    }
}

#[test]
fn black_lights_are_no_lights() {
    let mut builder = Builder::default();
    let floor = builder.material(Material::lambert("floor", Vec3::ONE));
    let black = builder.material(Material::emitter("black", Vec3::ZERO));
    ground(&mut builder, floor);
    builder.quad(Vec3::Y, Vec3::X, Vec3::Z, black);
    builder.light(point(Vec3::Y, Vec3::ZERO));
    builder.light(point(Vec3::Y * 2.0, Vec3::ONE));
    let scene = builder.build().expect("the scene is valid");
    assert_eq!(scene.lights.len(), 1, "only the one that shines is left");
    assert!(scene.lights[0].intensity == Vec3::ONE);
}

#[test]
fn without_lights_all_is_black() {
    let camera = meter(Vec3::new(0.0, 1.0, 2.0), Vec3::ZERO, 1.0);
    let mut dark = Builder::default();
    let floor = dark.material(Material::lambert("floor", Vec3::ONE));
    ground(&mut dark, floor);
    let empty = Scene::new(SceneParts::default()).expect("nothing is a valid scene");
    for (name, scene) in [("empty", &empty), ("dark", &dark.build().expect("the scene is valid"))] {
        for method in Method::all() {
            let settings = Settings {
                width: 8,
                height: 8,
                method,
                max_bounces: 3,
                ..Settings::default()
            };
            let image = image(scene, &camera, &settings, 3);
            assert!(
                image.pixels.iter().flatten().all(|v| *v == 0.0),
                "{name}, {}",
                method.name()
            );
        }
    }
}

/// `sampler` in `scene` after a few frames of learning from truth: at each point every light's contribution, as
/// the integrators report it.
fn learn<S: LightSampler>(sampler: &mut S, scene: &Scene, points: &[ShadingPoint]) {
    for frame in 0..4 {
        let observations = points.iter().enumerate().filter_map(|(index, point)| {
            let random = Random::new(99, index as u32, frame);
            let local = sampler.local(scene, point);
            let choice = sampler.sample(&local, random.u32(0))?;
            let light = scene.sample_light(choice.light, point.position_ws, random.vec2(1))?;
            let cosine = point.normal_ws.dot(light.wi_ws).max(0.0);
            let ray = Ray {
                origin_ws: point.position_ws + point.normal_ws * 1e-4 * scene.radius,
                direction_ws: light.wi_ws,
                t_max: light.distance * 0.999,
            };
            let to = scene.lights[choice.light as usize].primitive;
            let irradiance = scene::luminance(light.radiance) * cosine / light.pdf_solid_angle;
            Some(Observation {
                point: *point,
                light: choice.light,
                unshadowed: irradiance,
                irradiance,
                pmf: choice.pmf,
                visible: !scene.occluded(&ray, PrimitiveId::NONE, to),
                weight: 1,
                bounce: None,
            })
        });
        let log: Vec<Observation> = observations.collect();
        let half = log.len() / 2;
        sampler.end_frame(scene, &[log[..half].to_vec(), log[half..].to_vec()]);
    }
}

/// Points that a camera sees, and a few that it does not.
fn visible_points(scene: &Scene, camera: &Camera, count: u32) -> Vec<ShadingPoint> {
    let rays = camera.rays(64, 64);
    (0..count)
        .filter_map(|i| {
            let random = Random::new(5, i, 0);
            let ray = Ray {
                origin_ws: rays.origin_ws,
                direction_ws: rays.direction_ws(random.vec2(0) * 64.0),
                t_max: f32::INFINITY,
            };
            let hit = scene.nearest(&ray, PrimitiveId::NONE)?;
            let surface = scene.surface(&ray, &hit);
            let position_ws = surface.position_ws;
            let normal_ws = surface.bsdf.normal_ws;
            (surface.light == NO_LIGHT).then_some(ShadingPoint {
                position_ws,
                normal_ws,
                primary: i % 4 != 0,
            })
        })
        .collect()
}

/// Checks a sampler, fresh and after learning.
struct Check<'s> {
    scene: &'s Scene,
    points: &'s [ShadingPoint],
    name: String,
}

impl Visitor for Check<'_> {
    type Output = ();

    fn visit<S: LightSampler + 'static>(self, mut sampler: S) {
        self.check(&sampler, "fresh");
        learn(&mut sampler, self.scene, self.points);
        self.check(&sampler, "learned");
    }
}

impl Check<'_> {
    /// Probabilities sum to 1, `sample` reports what `pmf` says, frequencies follow (p-values below 1e-6 per point: a right
    /// program fails once in 10,000 over all points, kinds and scenes), and no light that can contribute falls below
    /// the guaranteed minimum.
    fn check<S: LightSampler>(&self, sampler: &S, state: &str) {
        let name = &self.name;
        let lights = self.scene.lights.len();
        let least = sampler.stats().min_probability;
        for (index, point) in self.points.iter().enumerate().take(24) {
            let local = sampler.local(self.scene, point);
            let pmfs: Vec<f64> = (0..lights)
                .map(|light| f64::from(sampler.pmf(&local, light as u32)))
                .collect();
            let sum: f64 = pmfs.iter().sum();
            let some = sampler.sample(&local, 0).is_some();
            let expected = if some { 1.0 } else { 0.0 };
            assert!(
                (sum - expected).abs() < 2e-5,
                "{name}, {state}: probabilities sum to {sum}"
            );
            for (light, pmf) in self.scene.lights.iter().zip(&pmfs) {
                if light.unshadowed_irradiance(point.position_ws, point.normal_ws) > 0.0 {
                    assert!(
                        *pmf > 0.0 && *pmf >= least * 0.999_99,
                        "{name}, {state}: {pmf} is below the floor {least}"
                    );
                }
            }
            let draws = 20_000_u32;
            let random = Random::new(3, index as u32, 0);
            let mut counts = vec![0_u64; lights];
            for draw in 0..draws {
                if let Some(Choice { light, pmf, .. }) = sampler.sample(&local, random.u32(draw)) {
                    assert_eq!(
                        pmf,
                        sampler.pmf(&local, light),
                        "{name}, {state}: reported and drawn probability"
                    );
                    counts[light as usize] += 1;
                }
            }
            let expected: Vec<f64> = pmfs.iter().map(|p| p * f64::from(draws)).collect();
            let (statistic, dof) = pooled_chi_square(&counts, &expected, 5.0);
            let p = chi_square_p(statistic, dof);
            assert!(
                p > 1e-6,
                "{name}, {state}: frequencies do not follow the probabilities, p = {p}"
            );
        }
    }
}

fn check_probabilities(name: &str, scene: &Scene, camera: &Camera) {
    let points = visible_points(scene, camera, 2000);
    assert!(points.len() > 500, "{name}: the camera sees little");
    for kind in SamplerKind::ALL {
        let check = Check {
            scene,
            points: &points,
            name: format!("{name}, {}", kind.name()),
        };
        light_cache::build(scene, &light_cache::Settings::default(), kind, check);
    }
}

#[test]
fn probabilities_are_what_is_drawn() {
    for name in ["rooms:300", "sun-outside:40", "points:1000"] {
        let scene = scene::load(&format!("demo:{name}")).expect("the scene is known");
        check_probabilities(name, &scene, &scene.parts.cameras[0]);
    }
    check_probabilities(
        "still life",
        &still_life(1.0, square_lamp(1.0)).build().expect("the scene is valid"),
        &still_life_camera(1.0),
    );
}

/// Checks that the only light is certain.
struct OnlyLight<'s>(&'s Scene);

impl Visitor for OnlyLight<'_> {
    type Output = ();

    fn visit<S: LightSampler + 'static>(self, sampler: S) {
        let point = ShadingPoint {
            position_ws: Vec3::new(0.3, 0.0, 0.2),
            normal_ws: Vec3::Y,
            primary: true,
        };
        let local = sampler.local(self.0, &point);
        assert_eq!(sampler.pmf(&local, 0), 1.0);
        for u in [0, 12_345, u32::MAX] {
            assert_eq!(sampler.sample(&local, u), Some(Choice::new(0, 1.0)));
        }
    }
}

#[test]
fn the_only_light_is_certain() {
    let mut builder = Builder::default();
    let floor = builder.material(Material::lambert("floor", Vec3::ONE));
    ground(&mut builder, floor);
    builder.light(point(Vec3::Y * 2.0, Vec3::ONE));
    let scene = builder.build().expect("the scene is valid");
    for kind in SamplerKind::ALL {
        light_cache::build(&scene, &light_cache::Settings::default(), kind, OnlyLight(&scene));
    }
}

#[test]
fn threads_do_not_matter() {
    let scene = scene::load("demo:rooms:100").expect("the scene is known");
    for method in Method::all() {
        let settings = Settings {
            width: 50,
            height: 40,
            method,
            max_bounces: 2,
            seed: 11,
            ..Settings::default()
        };
        let [one, three] = [1, 3].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .expect("threads can be made");
            pool.install(|| image(&scene, &scene.parts.cameras[0], &settings, 4))
        });
        let same = one
            .pixels
            .iter()
            .zip(&three.pixels)
            .all(|(a, b)| a.map(f32::to_bits) == b.map(f32::to_bits));
        assert!(same, "{} depends on the number of threads", method.name());
    }
}

#[test]
fn seeds_matter() {
    let scene = scene::load("demo:rooms:100").expect("the scene is known");
    let picture = |seed| {
        let settings = Settings {
            width: 16,
            height: 12,
            seed,
            ..Settings::default()
        };
        image(&scene, &scene.parts.cameras[0], &settings, 1)
    };
    assert_eq!(picture(1), picture(1));
    assert_ne!(picture(1), picture(2));
}
