//! Every sampler against `exact`, which sums over all lights and uses no cache: direct light and four bounces, on every
//! family of generated scenes. Learning samplers learn from nothing within each repetition, so that the frames in which
//! they change are part of what is compared.

use light_cache::SamplerKind;
use render::Method;
use tests::compare::{Case, Plan, assert_same, sampled};
use tests::scenes::{square_lamp, still_life, still_life_camera};

const WIDTH: u32 = 32;
const HEIGHT: u32 = 24;

/// Seeds of the reference lie apart from those of the samplers.
const REFERENCE_SEED: u64 = 1 << 32;

fn check_scene(name: &str, scene: &scene::Scene, camera: &scene::Camera) {
    for bounces in [0, 4] {
        let plan = |method| Plan::new(method, WIDTH, HEIGHT).bounces(bounces);
        let reference = plan(Method::Exact).effort(4, 32).seed(REFERENCE_SEED);
        let reference = Case::new(scene, camera, reference).measure();
        assert!(reference.estimate.mean.mean() > 0.0, "{name}: the view is black");
        let research = (bounces == 0).then_some(Method::Oracle);
        for method in SamplerKind::ALL.map(sampled).into_iter().chain(research) {
            let what = format!("{name}, {bounces} bounces, {}", method.name());
            let case = Case::new(scene, camera, plan(method).effort(16, 32));
            assert_same(&what, &case, &reference);
        }
        // Samples where the error is: in three blocks, the last of them cut short.
        for method in [sampled(SamplerKind::Tree), sampled(SamplerKind::Adaptive)] {
            let what = format!("{name}, {bounces} bounces, {}, adaptive pixels", method.name());
            let mut plan = plan(method).effort(20, 16);
            plan.settings.adaptive_pixels = true;
            assert_same(&what, &Case::new(scene, camera, plan), &reference);
        }
    }
}

fn check_demo(name: &str) {
    let scene = scene::load(&format!("demo:{name}")).expect("the scene is known");
    check_scene(name, &scene, &scene.parts.cameras[0]);
}

#[test]
fn every_family_is_tested() {
    let tested = [
        "rooms",
        "points",
        "sun-outside",
        "plaza",
        "city",
        "keyhole",
        "spheres",
        "one-light",
    ];
    for name in scene::generate::names() {
        assert!(tested.contains(&name), "no unbiasedness test for demo:{name}");
    }
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
fn city() {
    check_demo("city:64");
}

#[test]
fn keyhole() {
    check_demo("keyhole:64");
}

#[test]
fn spheres() {
    check_demo("spheres:64");
}

#[test]
fn one_light() {
    check_demo("one-light");
}

#[test]
fn lights_of_every_kind() {
    check_scene(
        "still life",
        &still_life(1.0, square_lamp(1.0)).build().expect("the scene is valid"),
        &still_life_camera(1.0),
    );
}
