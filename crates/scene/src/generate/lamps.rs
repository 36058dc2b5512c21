//! Lamps: closed housings with emissive rectangles, or point lights, below.
//!
//! A rectangle is two lights. Where an odd number is asked for, one rectangle is cut in three; a single light is one
//! triangle. So every number of lights can be had exactly.

use super::builder::{Builder, Paint};
use glam::Vec3;
use std::f32::consts::PI;

/// Distance from a housing down to its emissive rectangles, metres: they are seen from one side only, so images agree
/// between renderers whether the back of a one-sided emitter is black or invisible.
const PROUD: f32 = 0.002;
/// How far below its housing a point light hangs, metres.
const POINT_DROP: f32 = 0.06;

/// What a lamp is lit by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Source {
    /// Emissive rectangles.
    Panels,
    /// Point lights.
    Points,
}

/// A box that shines from its underside: middle of its lower face, half sizes and height of the box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lamp {
    pub(super) bottom_center: Vec3,
    pub(super) half: [f32; 2],
    pub(super) height: f32,
    pub(super) housing: Paint,
    /// Shines up from its upper face instead of down from the lower one.
    pub(super) up: bool,
}

/// Rows of at most equal numbers: how many rectangles in each row, for `count` of them on a face of the given shape.
fn rows(count: usize, half: [f32; 2]) -> Vec<usize> {
    let rows = ((count as f32 * half[1] / half[0]).sqrt().round() as usize).clamp(1, count);
    (0..rows).map(|i| count * (i + 1) / rows - count * i / rows).collect()
}

/// Cells (centre x, z and half sizes) that share the face of a lamp.
fn cells(count: usize, half: [f32; 2]) -> Vec<[f32; 4]> {
    let rows = rows(count, half);
    let hz = half[1] / rows.len() as f32;
    let mut cells = Vec::with_capacity(count);
    for (row, &n) in rows.iter().enumerate() {
        let hx = half[0] / n as f32;
        let z = -half[1] + hz * (2 * row + 1) as f32;
        cells.extend((0..n).map(|i| [-half[0] + hx * (2 * i + 1) as f32, z, hx, hz]));
    }
    cells
}

impl Lamp {
    /// Builds it with `lights` lights that together shine the flux `flux` (RGB, W) away from it.
    pub(super) fn build(&self, b: &mut Builder, source: Source, lights: usize, flux: Vec3, emitter: &str) {
        let c = self.bottom_center;
        let [hx, hz] = self.half;
        b.cuboid(
            [c.x - hx, c.y, c.z - hz],
            [c.x + hx, c.y + self.height, c.z + hz],
            self.housing,
        );
        if lights == 0 {
            return;
        }
        match source {
            Source::Panels => {
                let inner = [hx * 0.94, hz * 0.94];
                let face = if self.up {
                    c + Vec3::Y * (self.height + PROUD)
                } else {
                    c - Vec3::Y * PROUD
                };
                let radiance = flux / (PI * panel_area(lights, inner));
                let paint = b.emitter(emitter, round_radiance(radiance));
                panel(b, face, inner, self.up, lights, paint);
            }
            Source::Points => {
                // Half of what a point shines goes into the housing.
                let intensity = round_radiance(flux / (2.0 * PI * lights as f32));
                let rise = if self.up { self.height + POINT_DROP } else { -POINT_DROP };
                for [x, z, ..] in cells(lights, self.half) {
                    b.point_light(c + Vec3::new(x, rise, z), intensity);
                }
            }
        }
    }
}

/// Share of a cell's width that its rectangle fills.
fn fill(count: usize) -> f32 {
    if count == 1 { 1.0 } else { 0.86 }
}

/// Emitting area of a [`panel`].
fn panel_area(lights: usize, half: [f32; 2]) -> f32 {
    match lights {
        1 => 2.0 * half[0] * half[1],
        _ => 4.0 * half[0] * half[1] * fill(lights / 2) * fill(lights / 2),
    }
}

/// Exactly `lights` emissive triangles that look up or down, on a rectangle around `center`.
fn panel(b: &mut Builder, center: Vec3, half: [f32; 2], up: bool, lights: usize, paint: Paint) {
    // Mirrored, the corners below run the other way round.
    let side = if up { -1.0 } else { 1.0 };
    if lights == 1 {
        let [hx, hz] = half;
        let corner = |x: f32, z: f32| center + Vec3::new(side * x, 0.0, z);
        b.triangle([corner(-hx, -hz), corner(hx, -hz), corner(0.0, hz)], paint);
        return;
    }
    let count = lights / 2;
    let fill = fill(count);
    for (i, [x, z, hx, hz]) in cells(count, half).into_iter().enumerate() {
        let (hx, hz) = (hx * fill, hz * fill);
        let at = |dx: f32, dz: f32| center + Vec3::new(side * (x + dx), 0.0, z + dz);
        let corners = [at(-hx, -hz), at(hx, -hz), at(hx, hz), at(-hx, hz)];
        if i == 0 && lights % 2 == 1 {
            let [p, q, r, s] = corners;
            b.polygon(&[at(0.0, -hz), q, r, s, p], paint);
        } else {
            b.polygon(&corners, paint);
        }
    }
}

/// Rounded to five significant bits, so that a building has tens of lamp materials, not thousands.
fn round_radiance(radiance: Vec3) -> Vec3 {
    radiance
        .to_array()
        .map(|x| f32::from_bits(x.to_bits().wrapping_add(1 << 18) & !((1 << 19) - 1)))
        .into()
}

/// `lights` shared between `lamps` as evenly as whole numbers go: how many the lamp `i` gets.
pub(super) fn share(lights: usize, lamps: usize, i: usize) -> usize {
    lights * (i + 1) / lamps - lights * i / lamps
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lamp_has_exactly_the_lights_and_flux_asked_for() {
        for source in [Source::Panels, Source::Points] {
            for lights in [1, 2, 3, 4, 5, 7, 16, 31, 500] {
                let mut b = Builder::new("lamp");
                b.begin("lamp", "lamp");
                let housing = b.lambert("housing", [0.5; 3]);
                let lamp = Lamp {
                    bottom_center: Vec3::new(1.0, 2.0, 3.0),
                    half: [0.6, 0.2],
                    height: 0.1,
                    housing,
                    up: lights % 2 == 0,
                };
                lamp.build(&mut b, source, lights, Vec3::splat(10.0), "glow");
                assert_eq!(b.light_count(), lights);
                let power = if source == Source::Points { 20.0 } else { 10.0 };
                assert!((b.power() / power - 1.0).abs() < 0.07, "{lights}: {}", b.power());
            }
        }
    }

    #[test]
    fn shares_add_up() {
        assert_eq!((0..7).map(|i| share(100, 7, i)).sum::<usize>(), 100);
    }
}
