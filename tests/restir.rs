//! `restir` against `exact`: each single frame has the right mean, whatever has been kept of the frames before it.

use glam::{Affine3A, Vec3};
use render::{Image, Method, Settings, renderer};
use scene::{Camera, Scene};
use tests::compare::{Case, Plan, assert_same};
use tests::scenes::{square_lamp, still_life, still_life_camera};

const WIDTH: u32 = 24;
const HEIGHT: u32 = 18;

/// Seeds of the reference lie apart from those of `restir`.
const REFERENCE_SEED: u64 = 1 << 32;

/// `camera`, `steps` small steps and turns before it stood where it stands.
fn on_the_way(camera: &Camera, steps: u32, scene: &Scene) -> Camera {
    let step = Affine3A::from_rotation_y(0.04 * steps as f32)
        * Affine3A::from_translation(Vec3::new(0.003, 0.001, 0.006) * scene.radius * steps as f32);
    Camera {
        world_from_camera: camera.world_from_camera * step,
        ..camera.clone()
    }
}

/// One frame alone, after four others: two of a camera that moves, two of one that rests. Few candidates and a small disk, as suits a
/// small picture, and history that outweighs what is new.
fn check_frame(name: &str, scene: &Scene, camera: &Camera, bounces: u32) {
    let plan = |method| Plan::new(method, WIDTH, HEIGHT).bounces(bounces);
    let reference = plan(Method::Exact).effort(4, 32).seed(REFERENCE_SEED);
    let reference = Case::new(scene, camera, reference).measure();
    assert!(reference.estimate.mean.mean() > 0.0, "{name}: the view is black");
    let before = [3, 1, 0, 0].map(|steps| on_the_way(camera, steps, scene));
    let mut plan = plan(Method::Restir).effort(1, 160).after(before.into());
    plan.settings.restir.candidates = 6;
    plan.settings.restir.neighbors = 4;
    plan.settings.restir.radius = 5.0;
    let what = format!("{name}, {bounces} bounces, a frame of restir");
    assert_same(&what, &Case::new(scene, camera, plan), &reference);
}

fn check_demo(name: &str) {
    let scene = scene::load(&format!("demo:{name}")).expect("the scene is known");
    check_frame(name, &scene, &scene.parts.cameras[0], 0);
}

#[test]
fn rooms() {
    check_demo("rooms:64");
}

#[test]
fn points() {
    check_demo("points:64");
}

#[test]
fn sun_outside() {
    check_demo("sun-outside:64");
}

#[test]
fn plaza() {
    check_demo("plaza:64");
}

#[test]
fn keyhole() {
    check_demo("keyhole:64");
}

#[test]
fn spheres() {
    check_demo("spheres:64");
}

/// With bounces, drawing from the BSDF finds lights on every surface.
#[test]
fn lights_of_every_kind() {
    let scene = still_life(1.0, square_lamp(1.0)).build().expect("the scene is valid");
    for bounces in [0, 2] {
        check_frame("still life", &scene, &still_life_camera(1.0), bounces);
    }
}

/// Mean of all channels.
fn brightness(image: &Image) -> f64 {
    let sum: f64 = image.pixels.iter().flatten().map(|v| f64::from(*v)).sum();
    sum / image.pixels.len() as f64
}

/// All lamps go out but the last one: what the lit frames have kept is worth nothing, and every frame has the right mean at once. The mean of
/// 200 renderings is within 4 standard errors of that of `exact`, which chance exceeds once in 15,000 runs of the test.
#[test]
fn nothing_is_kept_when_lamps_are_switched() {
    let lit = scene::load("demo:points:16").expect("the scene is known");
    let off: Vec<(u32, Vec3)> = (0..lit.lights.len() as u32 - 1)
        .map(|light| (light, Vec3::splat(1e-3)))
        .collect();
    let dim = lit.relit(&off);
    let camera = &lit.parts.cameras[0];
    let settings = |method, seed| Settings {
        width: WIDTH,
        height: HEIGHT,
        method,
        seed,
        ..Settings::default()
    };
    let mut expected = renderer(&dim, camera, &settings(Method::Exact, REFERENCE_SEED)).expect("valid settings");
    (0..64).for_each(|_| expected.render_frame());
    let expected = brightness(&expected.film().image());
    let mut found = sampling::Moments::default();
    for seed in 0..200 {
        let mut frames = renderer(&lit, camera, &settings(Method::Restir, seed)).expect("valid settings");
        (0..2).for_each(|_| frames.render_frame());
        frames.set_scene((&dim).into()).expect("as many lights");
        frames.render_frame();
        assert_eq!(frames.film().spp(), 1);
        found.push(brightness(&frames.film().image()));
    }
    let bound = 4.0 * found.standard_error() + 1e-3 * expected;
    assert!(
        (found.mean() - expected).abs() < bound,
        "{} {expected} +- {bound}",
        found.mean()
    );
}
