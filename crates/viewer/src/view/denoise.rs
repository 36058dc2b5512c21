//! The picture with its noise taken away, for the eyes only: nothing that is saved or measured goes through it.
//!
//! The spatial part of Schied et al., "Spatiotemporal Variance-Guided Filtering" (2017), section 4: an edge-avoiding a-trous
//! wavelet (Dammertz et al. 2010) over what falls on the surfaces, their albedo divided out, guided by normal, depth and the
//! variance of the pixel. Differs: there is no history; before the second sample of a pixel the variance is that of its
//! neighbourhood; and three passes, not five, since pictures that move are small.

use glam::Vec3;
use rayon::prelude::*;
use render::Film;
use scene::luminance;

/// Distances between taps, pass by pass. More passes remove coarser noise; fewer keep more of the small shadows.
const STEPS: [i32; 3] = [1, 2, 4];
/// Taps to each side.
const REACH: i32 = 2;
/// B3 spline.
const KERNEL: [f32; 3] = [3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0];
/// How many standard errors pixels may differ and still be mixed. Higher values are smoother; lower values keep more noise.
const TOLERANCE: f32 = 4.0;
/// Factor on 1 - cosine between normals: about an exponent on the cosine.
const NORMAL_TOLERANCE: f32 = 32.0;
/// Share of the distance that neighbours may differ by, per pixel between them, in a picture of one row: pixels of coarse
/// pictures lie farther apart. At least [`LEAST_SLOPE`].
const DEPTH_SLOPE: f32 = 3.0;
const LEAST_SLOPE: f32 = 0.015;
/// With fewer neighbours on the same surface than this the variance is that of all neighbours.
const LEAST_ALIKE: f32 = 4.0;
/// What reflects less than this is shown as it is: lamps, and nothing at all.
const BLACK: f32 = 0.02;

/// What is known of a pixel.
#[derive(Clone, Copy)]
struct Guide {
    albedo: Vec3,
    normal: Vec3,
    depth: f32,
}

/// What falls on a pixel's surface, and the variance of its luminance.
#[derive(Clone, Copy)]
struct Light {
    irradiance: Vec3,
    variance: f32,
}

/// The film's image without most of its noise; as it is where the film has no auxiliary images.
pub(super) fn denoised(film: &Film) -> Vec<Vec3> {
    let image: Vec<Vec3> = film.image().pixels.into_iter().map(Vec3::from).collect();
    let Some(aovs) = film.aovs() else { return image };
    let (width, height) = (film.width() as i32, film.height() as i32);
    let guides: Vec<Guide> = (0..image.len())
        .map(|i| Guide {
            albedo: aovs.albedo.pixels[i].into(),
            normal: aovs.normal.pixels[i].into(),
            depth: aovs.depth[i],
        })
        .collect();
    let emitted: Vec<Vec3> = aovs.emitted.pixels.iter().map(|&pixel| pixel.into()).collect();
    let scale = |guide: &Guide| luminance(guide.albedo).max(BLACK);
    let variance = film.variance();
    let mut light: Vec<Light> = (0..image.len())
        .map(|i| Light {
            irradiance: (image[i] - emitted[i]) / guides[i].albedo.max(Vec3::splat(BLACK)),
            variance: variance[i] / (scale(&guides[i]) * scale(&guides[i])),
        })
        .collect();
    let picture = Picture {
        guides: &guides,
        width,
        height,
        slope: (DEPTH_SLOPE / height as f32).max(LEAST_SLOPE),
    };
    if film.spp() < 4 {
        estimate_variance(&picture, &mut light);
    }
    for step in STEPS {
        light = pass(&picture, &light, step);
    }
    let pixels = image.into_iter().zip(emitted).zip(guides.iter().zip(light));
    let shown = pixels.map(|((raw, emitted), (guide, light))| {
        if is_surface(guide) {
            emitted + light.irradiance * guide.albedo.max(Vec3::splat(BLACK))
        } else {
            raw
        }
    });
    shown.collect()
}

fn is_surface(guide: &Guide) -> bool {
    guide.depth.is_finite() && luminance(guide.albedo) >= BLACK
}

/// The variance between the pixels around each.
fn estimate_variance(picture: &Picture<'_>, light: &mut [Light]) {
    let before: Vec<f32> = light.iter().map(|light| luminance(light.irradiance)).collect();
    let taps = taps(1);
    light.par_iter_mut().enumerate().for_each(|(i, light)| {
        // Of those on the same surface, and of all: weights, values, squares.
        let mut sums = [[0.0_f32; 3]; 2];
        for (j, tap) in picture.around(i, &taps) {
            let y = before[j];
            let alike = (-picture.unlikeness(i, j, tap.distance)).exp();
            for (sums, weight) in sums.iter_mut().zip([alike, 1.0]) {
                *sums = [sums[0] + weight, sums[1] + weight * y, sums[2] + weight * y * y];
            }
        }
        let [count, sum, sum_sq] = if sums[0][0] < LEAST_ALIKE { sums[1] } else { sums[0] };
        let mean = sum / count;
        light.variance = (sum_sq / count - mean * mean).max(0.0);
    });
}

/// One pass over all pixels, whose taps are `step` pixels apart.
fn pass(picture: &Picture<'_>, light: &[Light], step: i32) -> Vec<Light> {
    let taps = taps(step);
    let pixel = |i: usize| {
        let here = light[i];
        if !is_surface(&picture.guides[i]) {
            return here;
        }
        let per_tolerated = 1.0 / (TOLERANCE * here.variance.sqrt() + 1e-6);
        let y = luminance(here.irradiance);
        let (mut irradiance, mut variance, mut weights) = (Vec3::ZERO, 0.0, 0.0);
        for (j, tap) in picture.around(i, &taps) {
            let apart = (luminance(light[j].irradiance) - y).abs() * per_tolerated;
            let weight = tap.weight * (-apart - picture.unlikeness(i, j, tap.distance)).exp();
            irradiance += light[j].irradiance * weight;
            variance += light[j].variance * weight * weight;
            weights += weight;
        }
        Light {
            irradiance: irradiance / weights,
            variance: variance / (weights * weights),
        }
    };
    (0..light.len()).into_par_iter().map(pixel).collect()
}

/// A pixel near by.
struct Tap {
    offset: (i32, i32),
    /// Of the kernel.
    weight: f32,
    /// In pixels.
    distance: f32,
}

fn taps(step: i32) -> Vec<Tap> {
    let offsets = (-REACH..=REACH).flat_map(|y| (-REACH..=REACH).map(move |x| (x, y)));
    let tap = |(x, y): (i32, i32)| Tap {
        offset: (x * step, y * step),
        weight: KERNEL[x.unsigned_abs() as usize] * KERNEL[y.unsigned_abs() as usize],
        distance: ((x * x + y * y) as f32).sqrt() * step as f32,
    };
    offsets.map(tap).collect()
}

/// What guides the filter.
struct Picture<'g> {
    guides: &'g [Guide],
    width: i32,
    height: i32,
    /// See [`DEPTH_SLOPE`].
    slope: f32,
}

impl Picture<'_> {
    /// The pixels around pixel `i`, it included.
    fn around<'t>(&self, i: usize, taps: &'t [Tap]) -> impl Iterator<Item = (usize, &'t Tap)> {
        let (width, height) = (self.width, self.height);
        let (x, y) = (i as i32 % width, i as i32 / width);
        taps.iter().filter_map(move |tap| {
            let (u, v) = (x + tap.offset.0, y + tap.offset.1);
            let inside = u >= 0 && v >= 0 && u < width && v < height;
            inside.then(|| ((v * width + u) as usize, tap))
        })
    }

    /// Minus the logarithm of how surely two pixels show the same surface; 0 for a pixel with itself.
    #[inline]
    fn unlikeness(&self, i: usize, j: usize, distance: f32) -> f32 {
        if distance == 0.0 {
            return 0.0;
        }
        let (a, b) = (&self.guides[i], &self.guides[j]);
        if !is_surface(b) {
            return f32::INFINITY;
        }
        let turned = (1.0 - a.normal.dot(b.normal)) * NORMAL_TOLERANCE;
        turned + (a.depth - b.depth).abs() / (a.depth * self.slope * distance + 1e-6)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use render::{FrameLoop, Method, Settings, renderer};
    use scene::{Scene, generate};

    fn rendering<'s>(scene: &'s Scene, method: Method, frames: u32) -> Box<dyn FrameLoop<'s> + 's> {
        let settings = Settings {
            width: 96,
            height: 64,
            aovs: true,
            method,
            ..Settings::default()
        };
        let mut frame_loop = renderer(scene, &scene.parts.cameras[0], &settings).expect("valid settings");
        (0..frames).for_each(|_| frame_loop.render_frame());
        frame_loop
    }

    /// Without the worst 2 % of the pixels: those at the edges of lamps, which one sample hits or misses.
    fn relative_error(pixels: &[Vec3], reference: &[[f32; 3]]) -> f64 {
        let errors = pixels.iter().zip(reference).map(|(pixel, expected)| {
            let (a, b) = (luminance(*pixel), luminance(Vec3::from(*expected)));
            f64::from((a - b) * (a - b) / (b * b + 0.01))
        });
        let mut errors: Vec<f64> = errors.collect();
        errors.sort_unstable_by(f64::total_cmp);
        errors.truncate(errors.len() * 98 / 100);
        errors.iter().sum::<f64>() / errors.len() as f64
    }

    #[test]
    fn a_noisy_picture_comes_much_nearer_to_the_reference_and_keeps_its_brightness() {
        let scene = Scene::new(generate::demo("rooms:64").expect("a known scene")).expect("valid");
        let reference = rendering(&scene, Method::Exact, 24).film().image();
        let noisy = rendering(&scene, Settings::default().method, 1);
        let raw: Vec<Vec3> = noisy.film().image().pixels.into_iter().map(Vec3::from).collect();
        let smooth = denoised(noisy.film());
        let [before, after] = [&raw, &smooth].map(|pixels| relative_error(pixels, &reference.pixels));
        assert!(after * 3.0 < before, "{before} before, {after} after");
        let mean = |pixels: &[Vec3]| pixels.iter().map(|p| f64::from(luminance(*p))).sum::<f64>();
        let ratio = mean(&smooth) / mean(&raw);
        assert!((0.8..1.2).contains(&ratio), "{ratio}");
        assert!(smooth.iter().all(|pixel| pixel.is_finite()));
    }

    #[test]
    fn a_finished_picture_hardly_changes() {
        let scene = Scene::new(generate::demo("rooms:64").expect("a known scene")).expect("valid");
        let finished = rendering(&scene, Method::Exact, 24);
        let change = relative_error(&denoised(finished.film()), &finished.film().image().pixels);
        assert!(change < 5e-3, "{change}");
    }
}
