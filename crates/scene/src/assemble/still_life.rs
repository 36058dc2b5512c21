//! A small scene with a little of everything.

use super::{Builder, directional, point, spot};
use crate::{Camera, Material};
use glam::Vec3;

/// A table with things on it under lamps of all kinds, all lengths times `scale`; radiance is kept, point intensity grows with the square, so that the
/// image stays the same. `lamp` makes a square one facing down, a metre wide at 3 m, from its material, as [`square_lamp`] does.
///
/// All lengths are sums of a few powers of two, so that scaling and moving them round little.
pub fn still_life(scale: f32, lamp: impl FnOnce(&mut Builder, u32)) -> Builder {
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
    builder.quad(v(2.0, 0.25, -1.75), v(1.5, 0.0, 0.0), v(0.0, 0.25, 0.0), strip);
    lamp(&mut builder, warm);
    let intensity = scale * scale;
    builder.light(point(v(2.0, 1.5, 1.0), Vec3::new(1.0, 0.8, 0.6) * intensity));
    builder.light(point(v(-2.5, 0.75, 0.5), Vec3::new(0.2, 0.3, 0.2) * intensity));
    let downwards = Vec3::new(0.0, -0.8, -0.6);
    let shine = Vec3::splat(6.0 * intensity);
    builder.light(spot(v(0.5, 3.5, 2.0), downwards, shine, 0.2, 0.5));
    builder.light(directional(Vec3::new(0.6, -0.64, -0.48), Vec3::new(0.1, 0.1, 0.2)));
    builder
}

/// The lamp of a [`still_life`] of this scale in one piece.
pub fn square_lamp(scale: f32) -> impl FnOnce(&mut Builder, u32) {
    move |builder, material| {
        builder.quad(
            Vec3::new(-1.0, 3.0, -1.0) * scale,
            Vec3::X * scale,
            Vec3::Z * scale,
            material,
        );
    }
}

/// The camera of a [`still_life`] of this scale.
pub fn still_life_camera(scale: f32) -> Camera {
    let [eye, target] = [Vec3::new(1.0, 2.5, 6.0), Vec3::new(0.25, 0.75, 0.0)].map(|at| at * scale);
    Camera::look_at("still life", eye, target, Vec3::Y, 0.8)
}
