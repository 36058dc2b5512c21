//! Where paths begin: from the pixel to the first hit, for several pixels at once.

use super::FrameView;
use crate::direct::LightNumbers;
use crate::settings::MAX_LIGHT_SAMPLES;
use glam::{Vec2, Vec3};
use sampling::unit_f32;
use scene::bvh::{PACKET, Packet};
use scene::{Hit, PrimitiveId, Ray};

/// Where the paths of pixels close to each other begin: everything up to the first hit is done for all of them at once.
pub(crate) struct Starts {
    pixels: [u32; PACKET],
    sample: u32,
    rays: Packet,
    hits: [Option<Hit>; PACKET],
    /// For each light sample by dimension: for the choice of a light, the point on it.
    light_numbers: [[[u32; PACKET]; 3]; MAX_LIGHT_SAMPLES as usize],
}

/// Where a path begins.
pub(crate) struct Start {
    pub(crate) pixel: u32,
    pub(crate) sample: u32,
    pub(crate) direction_ws: Vec3,
    pub(crate) hit: Option<Hit>,
    /// As many as there are light samples.
    pub(crate) light_numbers: [LightNumbers; MAX_LIGHT_SAMPLES as usize],
}

impl Starts {
    /// In the pixels at these columns and rows. Those beyond the image's edge are of no use, and harmless.
    #[allow(
        clippy::needless_range_loop,
        reason = "pixels are the inner index of what the outer loop fills"
    )]
    #[inline(always)]
    pub(crate) fn new<D>(view: &FrameView<'_, D>, at: &[[u32; 2]; PACKET], sample: u32) -> Self {
        let sampler = view.pixel_sampler;
        let in_pixel: [[u32; PACKET]; 2] = sampler.numbers(view.seed, at, view.image_width, sample, 0);
        let mut light_numbers = [[[0; PACKET]; 3]; MAX_LIGHT_SAMPLES as usize];
        for (index, numbers) in view.light_sample_indices(sample).zip(&mut light_numbers) {
            *numbers = sampler.numbers(view.seed, at, view.image_width, index, 2);
        }
        let mut rays = Packet {
            origin_ws: view.camera.origin_ws,
            directions_ws: [[0.0; PACKET]; 3],
        };
        let mut pixels = [0; PACKET];
        for i in 0..PACKET {
            let [x, y] = at[i];
            pixels[i] = y * view.image_width + x;
            let direction_ws = eye_direction_ws(view, x, y, [in_pixel[0][i], in_pixel[1][i]]).to_array();
            for axis in 0..3 {
                rays.directions_ws[axis][i] = direction_ws[axis];
            }
        }
        Self {
            pixels,
            sample,
            hits: view.scene.nearest_of_packet(&rays),
            rays,
            light_numbers,
        }
    }

    #[inline(always)]
    pub(crate) fn get(&self, i: usize) -> Start {
        Start {
            pixel: self.pixels[i],
            sample: self.sample,
            direction_ws: self.rays.direction_ws(i),
            hit: self.hits[i],
            light_numbers: self.light_numbers.map(|[choice, u, v]| LightNumbers {
                choice: choice[i],
                point: [u[i], v[i]],
            }),
        }
    }
}

impl Start {
    /// In one pixel, without its neighbours.
    pub(crate) fn new<D>(view: &FrameView<'_, D>, x: u32, y: u32) -> Self {
        let pixel = y * view.image_width + x;
        let sampler = view.pixel_sampler;
        let [[u], [v]] = sampler.numbers(view.seed, &[[x, y]], view.image_width, view.frame, 0);
        let mut light_numbers = [LightNumbers::default(); MAX_LIGHT_SAMPLES as usize];
        for (index, numbers) in view.light_sample_indices(view.frame).zip(&mut light_numbers) {
            let [[choice], [u], [v]] = sampler.numbers(view.seed, &[[x, y]], view.image_width, index, 2);
            *numbers = LightNumbers { choice, point: [u, v] };
        }
        let direction_ws = eye_direction_ws(view, x, y, [u, v]);
        let ray = Ray {
            origin_ws: view.camera.origin_ws,
            direction_ws,
            t_max: f32::INFINITY,
        };
        Self {
            pixel,
            sample: view.frame,
            direction_ws,
            hit: view.scene.nearest(&ray, PrimitiveId::NONE),
            light_numbers,
        }
    }
}

/// The direction of the eye ray through the pixel in column `x` and row `y`, `u` being 32 bits each.
#[inline(always)]
fn eye_direction_ws<D>(view: &FrameView<'_, D>, x: u32, y: u32, u: [u32; 2]) -> Vec3 {
    let corner = Vec2::new(x as f32, y as f32);
    let offset = view.filter.offset(Vec2::new(unit_f32(u[0]), unit_f32(u[1])));
    view.camera.direction_ws(corner + offset)
}
