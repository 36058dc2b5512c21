//! Scenes made by hand, in metres.

use glam::Vec3;
use scene::{Camera, Material};

pub use scene::assemble::{Builder, directional, point, spot};

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

/// A few lights of every kind around a box on the ground, all lengths multiplied by `scale`; radiance is kept, point
/// intensity grows with the square, so that the image stays the same.
pub fn still_life(scale: f32) -> Builder {
    still_life_with(scale, |builder, material| {
        builder.quad(
            Vec3::new(-1.0, 3.0, -1.0) * scale,
            Vec3::X * scale,
            Vec3::Z * scale,
            material,
        );
    })
}

/// [`still_life`] with the square lamp made by `lamp` (in the same place, facing down) from the material it is given.
pub fn still_life_with(scale: f32, lamp: impl FnOnce(&mut Builder, u32)) -> Builder {
    let mut builder = Builder::default();
    let grey = builder.material(Material::lambert("grey", Vec3::splat(0.6)));
    let red = builder.material(Material::lambert("red", Vec3::new(0.7, 0.2, 0.1)));
    let glossy = builder.material(Material {
        roughness: 0.4,
        dielectric_f0: Vec3::splat(0.04),
        dielectric_f90: 1.0,
        ..Material::lambert("glossy", Vec3::new(0.2, 0.3, 0.6))
    });
    let warm = builder.material(Material::emitter("warm", Vec3::new(5.0, 4.0, 3.0)));
    let strip = builder.material(Material::emitter("strip", Vec3::new(0.5, 1.0, 2.0)));
    let v = |x, y, z| Vec3::new(x, y, z) * scale;
    builder.quad(v(-4.0, 0.0, -4.0), v(0.0, 0.0, 8.0), v(8.0, 0.0, 0.0), grey);
    builder.quad(v(-4.0, 0.0, -2.0), v(8.0, 0.0, 0.0), v(0.0, 4.0, 0.0), glossy);
    // A block that throws shadows.
    builder.quad(v(0.0, 1.0, 0.0), v(0.0, 0.0, 1.0), v(1.0, 0.0, 0.0), red);
    builder.quad(v(0.0, 0.0, 1.0), v(1.0, 0.0, 0.0), v(0.0, 1.0, 0.0), red);
    builder.quad(v(0.0, 0.0, 0.0), v(0.0, 0.0, 1.0), v(0.0, 1.0, 0.0), red);
    builder.quad(v(2.0, 0.2, -1.8), v(1.5, 0.0, 0.0), v(0.0, 0.3, 0.0), strip);
    lamp(&mut builder, warm);
    let intensity = scale * scale;
    builder.light(point(v(2.0, 1.5, 1.0), Vec3::new(1.0, 0.8, 0.6) * intensity));
    builder.light(point(v(-2.5, 0.7, 0.5), Vec3::new(0.2, 0.3, 0.2) * intensity));
    builder.light(spot(
        v(0.5, 3.5, 2.0),
        Vec3::new(0.0, -0.8, -0.6),
        Vec3::splat(6.0 * intensity),
        0.2,
        0.5,
    ));
    builder.light(directional(Vec3::new(0.6, -0.64, -0.48), Vec3::new(0.1, 0.1, 0.2)));
    builder
}

/// The camera of [`still_life`].
pub fn still_life_camera(scale: f32) -> Camera {
    let eye = Vec3::new(1.0, 2.5, 6.0) * scale;
    Camera::look_at("still life", eye, Vec3::new(0.3, 0.8, 0.0) * scale, Vec3::Y, 0.8)
}
