//! Scenes made by hand, in metres.

use glam::Vec3;
use scene::Camera;

pub use scene::assemble::{Builder, directional, point, spot, square_lamp, still_life, still_life_camera};

/// A narrow camera at `eye` whose image, seen from `distance` away, is `size` wide at `target`: a light meter.
pub fn meter(eye: Vec3, target: Vec3, size: f32) -> Camera {
    let up = if (eye - target).normalize().y.abs() > 0.9 {
        Vec3::Z
    } else {
        Vec3::Y
    };
    Camera::look_at(
        "meter",
        eye,
        target,
        up,
        2.0 * (0.5 * size / eye.distance(target)).atan(),
    )
}

/// A ground of `material` at y = 0, facing up, 20 m wide.
pub fn ground(builder: &mut Builder, material: u32) {
    builder.quad(Vec3::new(-10.0, 0.0, -10.0), Vec3::Z * 20.0, Vec3::X * 20.0, material);
}
