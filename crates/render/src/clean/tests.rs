use super::*;
use crate::{FrameLoop, Method, Settings, renderer};
use scene::{Scene, generate, luminance};

fn rendering<'s>(scene: &'s Scene, camera: &Camera, method: Method, frames: u32) -> Box<dyn FrameLoop<'s> + 's> {
    let settings = Settings {
        width: 96,
        height: 64,
        aovs: true,
        method,
        ..Settings::default()
    };
    let mut frame_loop = renderer(scene, camera, &settings).expect("valid settings");
    (0..frames).for_each(|_| frame_loop.render_frame());
    frame_loop
}

fn rooms() -> Scene {
    Scene::new(generate::demo("rooms:64").expect("a known scene")).expect("valid")
}

fn raw(film: &Film) -> Vec<Vec3> {
    film.image().pixels.into_iter().map(Vec3::from).collect()
}

/// Without the worst 2 % of the pixels: those at the edges of lamps, which one sample hits or misses.
fn relative_error(pixels: &[Vec3], reference: &[Vec3]) -> f64 {
    let errors = pixels.iter().zip(reference).map(|(pixel, expected)| {
        let (a, b) = (luminance(*pixel), luminance(*expected));
        f64::from((a - b) * (a - b) / (b * b + 0.01))
    });
    let mut errors: Vec<f64> = errors.collect();
    errors.sort_unstable_by(f64::total_cmp);
    errors.truncate(errors.len() * 98 / 100);
    errors.iter().sum::<f64>() / errors.len() as f64
}

#[test]
fn a_noisy_picture_comes_much_nearer_to_the_reference_and_keeps_its_brightness() {
    let scene = rooms();
    let camera = &scene.parts.cameras[0];
    let reference = raw(rendering(&scene, camera, Method::Exact, 24).film());
    let noisy = rendering(&scene, camera, Settings::default().method, 1);
    let raw = raw(noisy.film());
    let smooth = Cleaner::default().clean(noisy.film(), camera).pixels;
    let [before, after] = [&raw, &smooth].map(|pixels| relative_error(pixels, &reference));
    assert!(after * 2.0 < before, "{before} before, {after} after");
    let mean = |pixels: &[Vec3]| pixels.iter().map(|p| f64::from(luminance(*p))).sum::<f64>();
    let ratio = mean(&smooth) / mean(&raw);
    assert!((0.8..1.2).contains(&ratio), "{ratio}");
    assert!(smooth.iter().all(|pixel| pixel.is_finite()));
}

#[test]
fn a_finished_picture_hardly_changes() {
    let scene = rooms();
    let camera = &scene.parts.cameras[0];
    let finished = rendering(&scene, camera, Method::Exact, 24);
    let cleaned = Cleaner::default().clean(finished.film(), camera).pixels;
    let change = relative_error(&cleaned, &raw(finished.film()));
    assert!(change < 5e-3, "{change}");
}

#[test]
fn history_makes_a_moving_picture_better_than_a_single_frame() {
    let scene = rooms();
    let mut camera = scene.parts.cameras[0].clone();
    let mut frames = rendering(&scene, &camera, Settings::default().method, 0);
    let mut cleaner = Cleaner::default();
    let mut last = Vec::new();
    for _ in 0..16 {
        let right = camera.world_from_camera.matrix3.x_axis;
        camera.world_from_camera.translation += right * 0.02;
        frames.set_camera(&camera);
        frames.render_frame();
        last = cleaner.clean(frames.film(), &camera).pixels;
    }
    let reference = raw(rendering(&scene, &camera, Method::Exact, 24).film());
    let alone = Cleaner::default().clean(frames.film(), &camera).pixels;
    let [alone, together] = [&alone, &last].map(|pixels| relative_error(pixels, &reference));
    assert!(together * 1.5 < alone, "{alone} alone, {together} with history");
}

#[test]
fn light_that_is_switched_off_is_gone_after_a_few_frames() {
    let scene = rooms();
    let camera = &scene.parts.cameras[0];
    let dark: Vec<(u32, Vec3)> = (0..scene.lights.len() as u32)
        .map(|light| (light, Vec3::splat(0.1)))
        .collect();
    let dark = scene.relit(&dark);
    let mut frames = rendering(&scene, camera, Settings::default().method, 0);
    let mut cleaner = Cleaner::default();
    let mut shown = |frames: &mut Box<dyn FrameLoop<'_> + '_>, count: u32| {
        let mut last = Vec::new();
        for _ in 0..count {
            frames.restart();
            frames.render_frame();
            last = cleaner.clean(frames.film(), camera).pixels;
        }
        last.iter().map(|pixel| f64::from(luminance(*pixel))).sum::<f64>()
    };
    let bright = shown(&mut frames, 24);
    frames.set_scene((&dark).into()).expect("the same lights");
    let after = shown(&mut frames, 4) / bright;
    assert!((0.08..0.2).contains(&after), "{after} of the light is left");
}
