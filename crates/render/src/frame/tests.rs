//! The integrators on scenes small enough to know the answer, and against each other.

use super::*;
use crate::{Image, Mis, PixelFilter, metric};
use glam::Vec3;
use light_cache::SamplerKind;
use sampling::PixelSampler;
use scene::{Instance, LightSource, Material, Mesh, SceneParts};

/// A closed box [-1, 1]^3 seen from inside, all six sides of material 0; `lamp` adds a square of material 1 under its ceiling.
fn box_scene(wall: Material, lamp: Option<Material>, points: &[(Vec3, Vec3)]) -> Scene {
    let mut mesh = Mesh::default();
    let mut quad = |corners: [Vec3; 4], material: u32| {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners);
        for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
            mesh.indices.push([first + a, first + b, first + c]);
            mesh.materials.push(material);
            mesh.origins.push(0);
        }
    };
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let corner = |u: f32, v: f32| {
                let mut p = [0.0; 3];
                p[axis] = side;
                // Counter-clockwise as seen from the centre.
                p[(axis + 1) % 3] = if side < 0.0 { u } else { v };
                p[(axis + 2) % 3] = if side < 0.0 { v } else { u };
                Vec3::from(p)
            };
            quad(
                [
                    corner(-1.0, -1.0),
                    corner(1.0, -1.0),
                    corner(1.0, 1.0),
                    corner(-1.0, 1.0),
                ],
                0,
            );
        }
    }
    if lamp.is_some() {
        let at = |x, z| Vec3::new(x, 0.9, z);
        quad([at(-0.3, -0.3), at(0.3, -0.3), at(0.3, 0.3), at(-0.3, 0.3)], 1);
    }
    let point = |&(position_ws, intensity): &(Vec3, Vec3)| {
        let light = scene::assemble::point(position_ws, intensity);
        (light, LightSource::default())
    };
    let parts = SceneParts {
        name: "box".into(),
        meshes: vec![mesh.into()],
        instances: vec![Instance {
            mesh: 0,
            origin: 0,
            world_from_local: glam::Affine3A::IDENTITY,
            local_from_world: glam::Affine3A::IDENTITY,
            world_normal_from_local: glam::Mat3A::IDENTITY,
            identity: true,
        }],
        materials: [Some(wall), lamp].into_iter().flatten().collect(),
        origins: vec![("box".into(), "box".into())],
        punctual: points.iter().map(point).collect(),
        cameras: vec![camera()],
        ..SceneParts::default()
    };
    Scene::new(parts).expect("a valid scene")
}

fn camera() -> Camera {
    Camera::look_at(
        "test",
        Vec3::new(0.0, 0.0, 0.8),
        Vec3::new(0.1, -0.5, -1.0),
        Vec3::Y,
        1.0,
    )
}

fn lambert(albedo: f32) -> Material {
    Material::lambert("wall", Vec3::splat(albedo))
}

/// A floor that mirrors lamps softly: alpha 0.04.
fn glossy() -> Material {
    Material {
        roughness: 0.2,
        dielectric_f0: Vec3::splat(0.3),
        dielectric_f90: 1.0,
        ..lambert(0.4)
    }
}

fn lamp() -> Option<Material> {
    Some(Material::emitter("lamp", Vec3::new(6.0, 5.0, 4.0)))
}

fn settings(method: Method, size: u32, max_bounces: u32) -> Settings {
    Settings {
        width: size,
        height: size,
        method,
        max_bounces,
        ..Settings::default()
    }
}

const UNIFORM: Method = Method::Sampled(SamplerKind::Uniform);

fn rendered<'s>(scene: &'s Scene, settings: &Settings, frames: u32) -> Box<dyn FrameLoop<'s> + 's> {
    let mut frame_loop = renderer(scene, &camera(), settings).expect("valid settings");
    for _ in 0..frames {
        frame_loop.render_frame();
    }
    assert_eq!(frame_loop.stats().nonfinite_samples, 0);
    frame_loop
}

/// Mean over pixels and RGB.
fn mean(image: &Image) -> f64 {
    let sum: f64 = image.pixels.iter().flatten().map(|v| f64::from(*v)).sum();
    sum / (3 * image.pixels.len()) as f64
}

/// Standard error of the image's mean luminance.
fn standard_error(film: &Film) -> f64 {
    let variance = film.variance();
    variance.iter().map(|v| f64::from(*v)).sum::<f64>().sqrt() / variance.len() as f64
}

#[test]
fn a_frame_that_is_stopped_does_not_count_and_the_next_one_does() {
    let scene = box_scene(lambert(0.5), lamp(), &[]);
    let mut frame_loop = renderer(&scene, &camera(), &settings(UNIFORM, 16, 0)).expect("valid settings");
    assert!(!frame_loop.render_frame_unless(&AtomicBool::new(true)));
    assert_eq!(frame_loop.film().spp(), 0);
    assert!(frame_loop.film().image().pixels.iter().all(|pixel| *pixel == [0.0; 3]));
    assert!(frame_loop.render_frame_unless(&AtomicBool::new(false)));
    assert_eq!(frame_loop.film().spp(), 1);
}

#[test]
fn another_size_starts_the_image_anew_with_the_same_view() {
    let scene = box_scene(lambert(0.5), lamp(), &[]);
    let mut frame_loop = renderer(&scene, &camera(), &settings(UNIFORM, 16, 0)).expect("valid settings");
    frame_loop.render_frame();
    frame_loop.set_film(32, 24, true).expect("a valid size");
    assert_eq!(
        (
            frame_loop.film().width(),
            frame_loop.film().height(),
            frame_loop.film().spp()
        ),
        (32, 24, 0)
    );
    frame_loop.render_frame();
    assert!(frame_loop.film().aovs().is_some());
    let message = frame_loop.set_film(0, 24, false).expect_err("no pixels").to_string();
    assert!(message.contains("0 x 24"), "{message}");
}

#[test]
fn probabilities_of_all_lights_at_a_point_add_up_to_one() {
    let scene = box_scene(lambert(0.5), lamp(), &[]);
    let point = ShadingPoint {
        position_ws: scene.center_ws,
        normal_ws: Vec3::Y,
        primary: true,
    };
    for method in [UNIFORM, Method::Sampled(SamplerKind::Adaptive)] {
        let mut frame_loop = renderer(&scene, &camera(), &settings(method, 16, 0)).expect("valid settings");
        frame_loop.render_frame();
        let sum: f64 = frame_loop.light_probabilities(&[point, point]).iter().sum();
        assert!((sum - 1.0).abs() < 1e-5, "{sum}");
    }
    let exact = renderer(&scene, &camera(), &settings(Method::Exact, 16, 0)).expect("valid settings");
    assert!(exact.light_probabilities(&[point]).is_empty());
}

#[test]
fn a_furnace_is_as_bright_as_its_geometric_series() {
    let wall = Material {
        emission: Vec3::ONE,
        ..lambert(0.5)
    };
    let scene = box_scene(wall, None, &[]);
    // Emission, and one more reflection with every bounce: 1 + 1/2 + ... = 2 - 2^-(bounces + 1).
    for method in [UNIFORM, Method::Sampled(SamplerKind::TreeVisible), Method::Exact] {
        for bounces in [0, 3] {
            let frames = if method == Method::Exact { 16 } else { 128 };
            let frame_loop = rendered(&scene, &settings(method, 16, bounces), frames);
            let film = frame_loop.film();
            let (found, expected) = (mean(&film.image()), 2.0 - 0.5_f64.powi(bounces as i32 + 1));
            let error = standard_error(film);
            assert!(
                (found - expected).abs() < 4.0 * error + 1e-4,
                "{method:?} {bounces}: {found} +- {error}"
            );
        }
    }
}

#[test]
fn a_point_light_on_lambert_follows_the_inverse_square() {
    let (at, intensity, albedo) = (Vec3::new(0.2, 0.5, 0.1), Vec3::new(3.0, 2.0, 1.0), 0.6);
    let scene = box_scene(lambert(albedo), None, &[(at, intensity)]);
    let mut settings = settings(UNIFORM, 32, 0);
    settings.aovs = true;
    let frame_loop = rendered(&scene, &settings, 64);
    let (image, aovs) = (frame_loop.film().image(), frame_loop.film().aovs().expect("asked for"));
    for i in 0..32 * 32 {
        let [p, n] = [&aovs.position, &aovs.normal].map(|a| Vec3::from(a.pixels[i]));
        // Pixels on an edge of the box average several sides.
        if n.abs().max_element() < 0.9999 {
            continue;
        }
        let to_light = at - p;
        let cosine = n.dot(to_light.normalize()).max(0.0);
        let expected = intensity * (albedo / std::f32::consts::PI * cosine / to_light.length_squared());
        let found = Vec3::from(image.pixels[i]);
        assert!(
            (found - expected).abs().max_element() < 0.02 * expected.max_element() + 1e-4,
            "{i}: {found} {expected}"
        );
        assert_eq!(aovs.light[i], 0.0);
        assert!((aovs.albedo.pixels[i][0] - albedo).abs() < 1e-5);
        assert!((aovs.depth[i] - p.distance(Vec3::new(0.0, 0.0, 0.8))).abs() < 1e-2);
    }
}

#[test]
fn samplers_agree_with_exact_pixel_by_pixel() {
    let lights = [
        (Vec3::new(-0.6, 0.3, -0.2), Vec3::splat(0.5)),
        (Vec3::new(0.5, -0.5, 0.3), Vec3::new(0.1, 0.3, 0.9)),
    ];
    // Per-pixel z-scores beyond 4 are one in 16,000 if normal; path samples have heavier tails, hence 0.5 %.
    for (name, wall) in [("lambert", lambert(0.7)), ("glossy", glossy())] {
        let scene = box_scene(wall, lamp(), &lights);
        for bounces in [0, 2] {
            let exact = rendered(&scene, &settings(Method::Exact, 24, bounces), 128);
            let mut of_sampler = settings(UNIFORM, 24, bounces);
            of_sampler.seed = 1;
            let sampled = rendered(&scene, &of_sampler, 256);
            let (a, b) = (sampled.film(), exact.film());
            let z = metric::z_scores(&a.image(), &a.variance(), &b.image(), &b.variance()).expect("same size");
            let outliers = z.iter().filter(|z| z.abs() > 4.0).count();
            assert!(
                outliers * 200 <= z.len(),
                "{name}, {bounces} bounces: {outliers} of {} pixels",
                z.len()
            );
            let error = standard_error(a).hypot(standard_error(b));
            let difference = mean(&a.image()) - mean(&b.image());
            assert!(
                difference.abs() < 4.0 * error,
                "{name}, {bounces} bounces: {difference} +- {error}"
            );
        }
    }
}

#[test]
fn light_hit_by_reflection_and_light_chosen_share_without_loss() {
    // At the last vertex of a glossy path both strategies run; without bounces a rougher wall uses light sampling alone.
    // Halving alpha's threshold neighbourhood must not make the mean jump.
    let brightness = |roughness: f32| {
        let wall = Material { roughness, ..glossy() };
        let scene = box_scene(wall, lamp(), &[]);
        let frame_loop = rendered(&scene, &settings(UNIFORM, 16, 0), 512);
        (mean(&frame_loop.film().image()), standard_error(frame_loop.film()))
    };
    let ((a, error_a), (b, error_b)) = (brightness(0.7070), brightness(0.7072));
    assert!(
        (a - b).abs() < 4.0 * error_a.hypot(error_b) + 1e-3 * a,
        "{a} +- {error_a}, {b} +- {error_b}"
    );
}

/// Whatever shares direct light and spreads samples, the mean is the same: four standard errors allow one failure in 15,000 for each of nine.
#[test]
fn every_way_to_share_and_to_spread_agrees() {
    let scene = box_scene(glossy(), lamp(), &[]);
    let brightness = |mis: Mis, pixel_sampler: PixelSampler| {
        let settings = Settings {
            mis,
            pixel_sampler,
            ..settings(UNIFORM, 16, 2)
        };
        let frame_loop = rendered(&scene, &settings, 512);
        (mean(&frame_loop.film().image()), standard_error(frame_loop.film()))
    };
    let others = Mis::ALL
        .map(|mis| (mis, PixelSampler::default()))
        .into_iter()
        .chain(PixelSampler::ALL.map(|sampler| (Mis::default(), sampler)));
    let (a, error_a) = brightness(Mis::default(), PixelSampler::Random);
    for (mis, sampler) in others {
        let (b, error_b) = brightness(mis, sampler);
        assert!(
            (a - b).abs() < 4.0 * error_a.hypot(error_b),
            "{mis:?}, {sampler:?}: {a} +- {error_a}, {b} +- {error_b}"
        );
    }
}

#[test]
fn the_same_seed_gives_the_same_image_on_any_number_of_threads() {
    let scene = box_scene(glossy(), lamp(), &[(Vec3::ZERO, Vec3::ONE)]);
    for kind in SamplerKind::ALL {
        let run = |threads: usize, seed: u64| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .expect("threads");
            let mut settings = settings(Method::Sampled(kind), 40, 2);
            settings.seed = seed;
            pool.install(|| {
                let frame_loop = rendered(&scene, &settings, 4);
                let stats = frame_loop.stats();
                (
                    frame_loop.film().image(),
                    frame_loop.film().variance(),
                    stats.rays_nearest,
                    stats.rays_occluded,
                )
            })
        };
        let one = run(1, 7);
        assert!(one == run(3, 7), "{kind:?}");
        assert!(one.0 != run(1, 8).0, "{kind:?}: seeds differ");
    }
}

#[test]
fn rays_are_counted() {
    // Every eye ray hits a wall, and every light lies above every wall: one shadow ray each, no other.
    let scene = box_scene(
        lambert(0.5),
        None,
        &[(Vec3::ZERO, Vec3::ONE), (Vec3::splat(0.1), Vec3::ONE)],
    );
    let samples = 16 * 16 * 4;
    let stats = rendered(&scene, &settings(UNIFORM, 16, 0), 4).stats();
    assert_eq!(
        (stats.rays_nearest, stats.rays_occluded, stats.frames),
        (samples, samples, 4)
    );
    let stats = rendered(&scene, &settings(Method::Exact, 16, 0), 4).stats();
    assert_eq!((stats.rays_nearest, stats.rays_occluded), (samples, 2 * samples));
}

#[test]
fn a_scene_without_lights_is_black_and_traces_eye_rays_only() {
    let scene = box_scene(glossy(), None, &[]);
    for method in Method::all() {
        let frame_loop = rendered(&scene, &settings(method, 16, 3), 2);
        assert_eq!(frame_loop.film().image().pixels, vec![[0.0; 3]; 256], "{method:?}");
        let stats = frame_loop.stats();
        assert_eq!((stats.rays_nearest, stats.rays_occluded), (512, 0), "{method:?}");
        assert!(
            stats.skipped.iter().any(|s| s.contains("no lights")),
            "{:?}",
            stats.skipped
        );
    }
}

#[test]
fn filters_keep_the_brightness_of_a_smooth_image() {
    let scene = box_scene(lambert(0.5), None, &[(Vec3::new(0.0, 0.2, 0.5), Vec3::ONE)]);
    let brightness = |pixel_filter: PixelFilter| {
        let mut settings = settings(UNIFORM, 32, 0);
        settings.pixel_filter = pixel_filter;
        mean(&rendered(&scene, &settings, 64).film().image())
    };
    let expected = brightness(PixelFilter::Box);
    for filter in [PixelFilter::Gaussian, PixelFilter::BlackmanHarris] {
        let found = brightness(filter);
        assert!(
            (found / expected - 1.0).abs() < 0.01,
            "{filter:?}: {found} against {expected}"
        );
    }
}

#[test]
fn records_are_kept_for_samplers_that_do_not_learn() {
    let scene = box_scene(lambert(0.5), lamp(), &[(Vec3::ZERO, Vec3::ONE)]);
    let mut settings = settings(UNIFORM, 16, 0);
    let plain = rendered(&scene, &settings, 4);
    settings.record_lights = true;
    let recording = rendered(&scene, &settings, 4);
    assert_eq!(recording.film().image(), plain.film().image());
    let records = recording.light_records();
    assert_eq!(records.len(), 3);
    assert_eq!(records.iter().map(|r| r.samples).sum::<u64>(), 16 * 16 * 4);
    assert!((records.iter().map(|r| r.probability).sum::<f64>() - 1.0).abs() < 1e-6);
    assert!(records.iter().all(|r| r.max_contribution > 0.0));
    // The lights' shares of the image make up all of it but the emission that is seen directly.
    let shares: f64 = records.iter().map(|r| r.mean_contribution).sum();
    assert!(
        shares > 0.0 && shares <= mean(&recording.film().image()) * 1.5,
        "{shares}"
    );
}

#[test]
fn oracle_agrees_with_exact_and_beats_every_sampler() {
    let lights: Vec<(Vec3, Vec3)> = (0..24)
        .map(|i| {
            let angle = i as f32;
            let at = Vec3::new(0.8 * angle.cos(), 0.4 * (3.0 * angle).sin(), 0.8 * angle.sin());
            (at, Vec3::splat(0.1 + 0.02 * angle))
        })
        .collect();
    let mut relative = Vec::new();
    for wall in [lambert(0.7), glossy()] {
        let scene = box_scene(wall, lamp(), &lights);
        let exact = rendered(&scene, &settings(Method::Exact, 24, 0), 256);
        let oracle = rendered(&scene, &settings(Method::Oracle, 24, 0), 256);
        let (a, b) = (oracle.film(), exact.film());
        let z = metric::z_scores(&a.image(), &a.variance(), &b.image(), &b.variance()).expect("same size");
        assert!(z.iter().filter(|z| z.abs() > 4.0).count() * 200 <= z.len());
        let error = standard_error(a).hypot(standard_error(b));
        let difference = mean(&a.image()) - mean(&b.image());
        assert!(difference.abs() < 4.0 * error, "{difference} +- {error}");
        let stats = oracle.stats();
        assert!(stats.prepare_s > stats.light_build_s && stats.sampler.is_some_and(|s| s.bytes > 0));
        for kind in [SamplerKind::Uniform, SamplerKind::Power, SamplerKind::Tree] {
            let sampled = rendered(&scene, &settings(Method::Sampled(kind), 24, 0), 256);
            relative.push(standard_error(a) / standard_error(sampled.film()));
        }
    }
    assert!(relative.iter().all(|r| *r < 0.9), "{relative:?}");
}

#[test]
fn camera_and_scene_may_change() {
    let bright = Material::emitter("lamp", Vec3::splat(6.0));
    let dim = Material::emitter("lamp", Vec3::splat(0.006));
    let points = [(Vec3::ZERO, Vec3::splat(0.01))];
    let (before, after) = (
        box_scene(lambert(0.5), Some(dim), &points),
        box_scene(lambert(0.5), Some(bright), &points),
    );
    let elsewhere = Camera::look_at("b", Vec3::new(0.3, 0.2, 0.5), Vec3::new(0.0, -1.0, 0.0), Vec3::Z, 1.2);
    let expected = {
        let mut exact = renderer(&after, &elsewhere, &settings(Method::Exact, 16, 0)).expect("valid settings");
        (0..256).for_each(|_| exact.render_frame());
        (mean(&exact.film().image()), standard_error(exact.film()))
    };
    // Methods whose structures follow the scene's change.
    for method in [UNIFORM, Method::Exact, Method::Oracle] {
        let mut frame_loop = rendered(&before, &settings(method, 16, 0), 4);
        frame_loop.set_camera(&elsewhere);
        assert_eq!(frame_loop.film().spp(), 0);
        frame_loop.render_frame();
        frame_loop.set_scene((&after).into()).expect("as many lights");
        (0..512).for_each(|_| frame_loop.render_frame());
        assert_eq!(frame_loop.stats().frames, 512);
        let (found, error) = (mean(&frame_loop.film().image()), standard_error(frame_loop.film()));
        let bound = 4.0 * error.hypot(expected.1) + 1e-4 * expected.0;
        assert!(
            (found - expected.0).abs() < bound,
            "{method:?}: {found} {expected:?} +- {error}"
        );
        let first = frame_loop.film().image();
        frame_loop.restart();
        frame_loop.render_frame();
        assert_ne!(frame_loop.film().image(), first);
    }
    let other = box_scene(lambert(0.5), None, &points);
    let mut frame_loop = rendered(&before, &settings(UNIFORM, 16, 0), 1);
    let message = frame_loop
        .set_scene((&other).into())
        .expect_err("fewer lights")
        .to_string();
    assert!(message.contains("3 lights") && message.contains('1'), "{message}");
}

#[test]
fn the_cost_of_choosing_is_measured() {
    let scene = box_scene(lambert(0.5), lamp(), &[(Vec3::ZERO, Vec3::ONE)]);
    for (kind, bounces, least) in [(SamplerKind::Tree, 0, 200), (SamplerKind::Uniform, 2, 400)] {
        let frame_loop = rendered(&scene, &settings(Method::Sampled(kind), 16, bounces), 1);
        let choosing = frame_loop.choosing().expect("it chooses");
        assert!(
            choosing.ns_per_choice > 0.0 && choosing.per_frame >= least,
            "{choosing:?}"
        );
        assert!((choosing.share(1.0, 2) - choosing.share(2.0, 1)).abs() < 1e-12);
    }
    assert!(
        rendered(&scene, &settings(Method::Exact, 16, 0), 1)
            .choosing()
            .is_none()
    );
}

#[test]
fn settings_out_of_range_start_nothing() {
    let scene = box_scene(lambert(0.5), None, &[]);
    assert!(renderer(&scene, &camera(), &settings(UNIFORM, 0, 0)).is_err());
}
