//! Pictures for the eyes: those that the device makes of its film against those that the CPU makes of the same film.

use crate::gpu::gpu;
use glam::{Mat3A, Quat, Vec3};
use light_cache::SamplerKind;
use render::gpu::{Cleaner as OnDevice, DevicePicture, Gpu};
use render::{Cleaner, FrameLoop, Method, RenderStats, Settings};
use scene::{Camera, Scene};
use std::sync::Arc;

const SIZE: (u32, u32) = (97, 66);
/// Values are alike if they differ by no more than this share of the larger one, or of the picture's mean: some hundred roundings in a row.
const ALIKE: f32 = 1e-3;
/// Share of a picture's pixels that may differ by more: where what differs by rounding alone decides about history, and a few neighbours that the filter
/// spreads it to.
const OTHERWISE: f32 = 0.01;

/// A device of these tests alone, if there is one: others read from theirs at the same time, and a driver that keeps few compiled shaders
/// would compile the path pass for every picture.
fn own_device() -> Option<Arc<Gpu>> {
    gpu().map(|_| Gpu::open().expect("as before"))
}

fn rooms() -> Scene {
    scene::load("demo:rooms:256").expect("it is generated")
}

fn settings() -> Settings {
    Settings {
        width: SIZE.0,
        height: SIZE.1,
        // It learns nothing, so that nothing is read for that.
        method: Method::Sampled(SamplerKind::Uniform),
        aovs: true,
        ..Settings::default()
    }
}

/// Asserts that a picture is that of the CPU but for rounding.
fn assert_alike(what: &str, found: &DevicePicture, expected: &[Vec3]) {
    assert_eq!(found.texels.len(), expected.len(), "{what}");
    let sum: Vec3 = expected.iter().copied().sum();
    let offset = (sum / expected.len() as f32).max_element();
    assert!(offset > 0.0, "{what} is black");
    let apart = |found: &[f32; 4], expected: &Vec3| {
        let channels = found.iter().zip(expected.to_array());
        let largest = channels.map(|(a, b)| (a - b).abs() / (a.abs().max(b.abs()) + offset));
        // NaN is alike to nothing.
        largest.fold(0.0, |most: f32, apart| if apart <= most { most } else { apart })
    };
    let mut apart: Vec<f32> = found.texels.iter().zip(expected).map(|(a, b)| apart(a, b)).collect();
    apart.sort_unstable_by(f32::total_cmp);
    let alike = apart.iter().filter(|apart| **apart <= ALIKE).count();
    let otherwise = 1.0 - alike as f32 / apart.len() as f32;
    eprintln!(
        "{what}: {:.2} % of the pixels differ by more than {ALIKE:e}; median {:e}, largest {:e}",
        100.0 * otherwise,
        apart[apart.len() / 2],
        apart[apart.len() - 1]
    );
    assert!(
        otherwise <= OTHERWISE,
        "{what}: {} of {} pixels differ",
        apart.len() - alike,
        apart.len()
    );
}

/// A rendering on the device, looked at through both.
struct Both<'s> {
    frames: Box<dyn FrameLoop<'s> + 's>,
    camera: Camera,
    device: OnDevice,
    cpu: Cleaner,
}

impl Both<'_> {
    /// Renders some frames and compares the pictures of them.
    fn show(&mut self, what: &str, frames: u32) {
        (0..frames).for_each(|_| self.frames.render_frame());
        let film = self.frames.device_film().expect("it is on the device");
        let found = self.device.clean(&film, &self.camera).expect("there is room");
        let expected = self.cpu.clean(self.frames.film(), &self.camera);
        assert_alike(what, &found, &expected.pixels);
    }

    fn go(&mut self, right: f32, turn: f32) {
        let pose = &mut self.camera.world_from_camera;
        pose.translation += pose.matrix3.x_axis * right;
        pose.matrix3 *= Mat3A::from_quat(Quat::from_rotation_y(turn));
        self.frames.set_camera(&self.camera);
    }

    fn resize(&mut self, width: u32, height: u32) {
        self.frames.set_film(width, height, true).expect("a valid size");
    }
}

#[test]
fn pictures_are_those_of_the_cpu() {
    let Some(gpu) = own_device() else { return };
    let scene = rooms();
    let camera = scene.parts.cameras[0].clone();
    let mut both = Both {
        frames: render::gpu::renderer(&gpu, &scene, &camera, &settings()).expect("it fits"),
        camera,
        device: OnDevice::default(),
        cpu: Cleaner::default(),
    };
    both.show("first", 1);
    both.show("refined", 1);
    both.show("refined again", 3);
    for step in 0..3 {
        both.go(0.03, 0.01);
        both.show(&format!("step {step}"), 1);
    }
    both.show("at rest", 2);
    both.frames.restart();
    both.show("begun anew", 1);
    // Coarse while moving, as the window has it, and in full again.
    both.resize(48, 40);
    both.show("coarser", 1);
    both.go(-0.05, 0.0);
    both.show("coarser, moved", 1);
    both.resize(SIZE.0, SIZE.1);
    both.show("full again", 1);
    both.show("full and refined", 70);
    both.go(0.0, 2.5);
    both.show("turned away", 1);
    both.go(0.02, 0.0);
    both.show("turned away, moved", 1);
    both.device.forget();
    both.cpu.forget();
    both.show("all forgotten", 1);
}

#[test]
fn only_the_picture_is_read_back_and_a_lost_device_makes_none() {
    let Some(gpu) = own_device() else { return };
    let scene = rooms();
    let camera = &scene.parts.cameras[0];
    let mut frames = render::gpu::renderer(&gpu, &scene, camera, &settings()).expect("it fits");
    let mut cleaner = OnDevice::default();
    let pixels = u64::from(SIZE.0) * u64::from(SIZE.1);
    assert!(frames.device_film().is_none(), "nothing was rendered");
    for clean in [true, false, true] {
        frames.render_frame();
        let before = gpu.bytes_read();
        let film = frames.device_film().expect("it is on the device");
        let made = if clean {
            cleaner.clean(&film, camera)
        } else {
            cleaner.image(&film)
        };
        made.expect("there is room");
        let read = gpu.bytes_read() - before;
        // The times of the stages may come with it.
        assert!((16 * pixels..=16 * pixels + 256).contains(&read), "{read} bytes");
        let counted = frames.stats();
        assert!(gpu.bytes_read() - before < 17 * pixels, "more than counts was read");
        assert_counted(frames.as_mut(), &counted);
    }
    // Another size: what was counted before stays, and the film is not read for that.
    frames.render_frame();
    let before = gpu.bytes_read();
    frames.set_film(32, 24, true).expect("a valid size");
    assert!(gpu.bytes_read() - before < pixels);
    let before_that = frames.stats().rays_nearest;
    frames.render_frame();
    let film = frames.device_film().expect("it is on the device");
    let image = cleaner.image(&film).expect("there is room");
    assert!(cleaner.clean(&film, camera).is_ok() && film.fault().is_none());
    let counted = frames.stats();
    assert!(counted.rays_nearest >= before_that + 32 * 24);
    assert_counted(frames.as_mut(), &counted);
    let expected: Vec<Vec3> = frames.film().image().pixels.into_iter().map(Vec3::from).collect();
    assert_alike("as it is", &image, &expected);

    let film = frames.device_film().expect("it is on the device");
    gpu.destroy();
    assert!(cleaner.clean(&film, camera).is_err());
    assert!(cleaner.image(&film).is_err());
    assert!(OnDevice::default().clean(&film, camera).is_err());
    assert!(film.fault().is_some());
}

/// Asserts that the film tells the same counts.
fn assert_counted(frames: &mut dyn FrameLoop<'_>, counted: &RenderStats) {
    assert_eq!(frames.film().spp(), counted.frames);
    let by_film = frames.stats();
    assert!(counted.rays_nearest > 0 && counted.rays_occluded > 0);
    assert_eq!(counted.rays_nearest, by_film.rays_nearest);
    assert_eq!(counted.rays_occluded, by_film.rays_occluded);
    assert_eq!(counted.nonfinite_samples, by_film.nonfinite_samples);
}
