//! Edges smoothed over time: the last step, on the picture as a whole.
//!
//! Temporal antialiasing as in Karis, "High-Quality Temporal Supersampling" (2014): each pixel is averaged with what was shown
//! where the nearest surface around it was before. Light and surfaces are smooth already; what is left are edges of things and
//! lamps, which one sample hits or misses. What was shown is first drawn towards the mean of the pixels around (Salvi, "An
//! Excursion in Temporal Supersampling", 2016), since nothing else tells whether it still holds, and averages are of compressed
//! radiance, so that no lamp outshines its edge for long.

use super::frame::Frame;
use super::projection::Projection;
use super::row::{Past, Row, kept};
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use scene::{Camera, luminance};

/// Standard deviations of the pixels around by which history may differ from their mean. Higher values smooth more; lower
/// values ghost less.
const CLIP: f32 = 1.0;

/// A pixel's radiance, and the samples that it rests on.
type Shown = (Vec3, f32);

/// What was shown in earlier pictures.
#[derive(Debug, Default)]
pub(super) struct Resolver(Row<Shown>);

impl Resolver {
    /// The frame's picture, averaged with those before.
    pub(super) fn resolve(&mut self, frame: &Frame, camera: &Camera) -> Vec<Vec3> {
        let pixels = frame.assembled();
        let projection = Projection::new(camera, frame.width as f32 / frame.height as f32);
        let spp = frame.spp as f32;
        let scale = 1.0 / typical_luminance(&pixels);
        let resolved: Vec<Shown> = match self.0.begin(frame, &projection) {
            None => pixels.par_iter().map(|&pixel| (pixel, spp)).collect(),
            Some(past) => {
                let compressed: Vec<Vec3> = pixels.par_iter().map(|&pixel| compress(pixel * scale)).collect();
                let size = Vec2::new(frame.width as f32, frame.height as f32);
                let pixel = |i: usize| {
                    let center = Vec2::new((i as u32 % frame.width) as f32, (i as u32 / frame.width) as f32) + 0.5;
                    let (mean, deviation, nearest) = neighbourhood(frame, &compressed, i);
                    let moved =
                        nearest.and_then(|point| Some(past.projection.share(point)? - projection.share(point)?));
                    let known = moved.and_then(|moved| past.at(center / size + moved));
                    let Some((shown, samples)) = known else {
                        return (pixels[i], spp);
                    };
                    let kept = kept(samples, spp);
                    let shown = drawn_towards(compress(shown * scale), mean, deviation * CLIP);
                    let mixed = shown.lerp(compressed[i], spp / (spp + kept));
                    (expand(mixed) / scale, spp + kept)
                };
                (0..pixels.len()).into_par_iter().map(pixel).collect()
            }
        };
        let shown = resolved.iter().map(|(pixel, _)| *pixel).collect();
        self.0.keep(frame, projection, resolved);
        shown
    }
}

impl Past<Shown> {
    /// What was shown at this share of width and height; `None` outside.
    fn at(&self, share: Vec2) -> Option<Shown> {
        let (width, height) = (self.width as usize, self.height as usize);
        let inside = share.cmpge(Vec2::ZERO).all() && share.cmple(Vec2::ONE).all();
        if !inside {
            return None;
        }
        let at = share * Vec2::new(width as f32, height as f32) - 0.5;
        let corner = at.floor();
        let f = at - corner;
        let weights = [catmull_rom(f.x), catmull_rom(f.y)];
        let (mut sum, mut least, mut most) = (Vec3::ZERO, Vec3::INFINITY, Vec3::ZERO);
        for (dy, of_row) in weights[1].iter().enumerate() {
            let v = (corner.y as isize + dy as isize - 1).clamp(0, height as isize - 1) as usize;
            for (dx, of_column) in weights[0].iter().enumerate() {
                let u = (corner.x as isize + dx as isize - 1).clamp(0, width as isize - 1) as usize;
                let (pixel, _) = self.pixels[v * width + u];
                sum += pixel * (of_row * of_column);
                if (1..3).contains(&dx) && (1..3).contains(&dy) {
                    (least, most) = (least.min(pixel), most.max(pixel));
                }
            }
        }
        let nearest = (at + 0.5).min(Vec2::new(width as f32, height as f32) - 1.0);
        let samples = self.pixels[nearest.y as usize * width + nearest.x as usize].1;
        // The cubic overshoots at edges.
        Some((sum.clamp(least, most), samples))
    }
}

/// Weights of four neighbours for a place at share `f` between the middle two: sharper than linear, so that a picture that is
/// looked up again and again stays sharp.
fn catmull_rom(f: f32) -> [f32; 4] {
    [
        f * (-0.5 + f * (1.0 - 0.5 * f)),
        1.0 + f * f * (-2.5 + 1.5 * f),
        f * (0.5 + f * (2.0 - 1.5 * f)),
        f * f * (-0.5 + 0.5 * f),
    ]
}

/// Of the three by three pixels around: mean and standard deviation, and the point nearest to the camera, whose edge it is.
fn neighbourhood(frame: &Frame, compressed: &[Vec3], i: usize) -> (Vec3, Vec3, Option<Vec3>) {
    let (width, height) = (frame.width as usize, frame.height as usize);
    let (x, y) = (i % width, i / width);
    let (mut count, mut sum, mut sum_sq) = (0.0, Vec3::ZERO, Vec3::ZERO);
    let (mut depth, mut nearest) = (f32::INFINITY, None);
    for v in y.saturating_sub(1)..(y + 2).min(height) {
        for u in x.saturating_sub(1)..(x + 2).min(width) {
            let j = v * width + u;
            count += 1.0;
            sum += compressed[j];
            sum_sq += compressed[j] * compressed[j];
            if frame.depth[j] < depth {
                (depth, nearest) = (frame.depth[j], Some(frame.guides[j].position));
            }
        }
    }
    let mean = sum / count;
    let variance = (sum_sq / count - mean * mean).max(Vec3::ZERO);
    (mean, variance.map(f32::sqrt), nearest)
}

/// The point on the way from `color` to `mean` that first lies in the box of half size `reach` around it.
fn drawn_towards(color: Vec3, mean: Vec3, reach: Vec3) -> Vec3 {
    let away = color - mean;
    let excess = (away.abs() / reach.max(Vec3::splat(1e-6))).max_element();
    if excess > 1.0 { mean + away / excess } else { color }
}

/// Radiance to 0..1 (Karis 2014): what is bright counts less.
fn compress(color: Vec3) -> Vec3 {
    color / (1.0 + luminance(color))
}

/// Undoes [`compress`].
fn expand(color: Vec3) -> Vec3 {
    color / (1.0 - luminance(color)).max(1e-4)
}

/// The geometric mean of what is not black; 1 if all is.
fn typical_luminance(pixels: &[Vec3]) -> f32 {
    let logarithms = pixels.par_iter().map(|pixel| luminance(*pixel));
    let (sum, count) = (logarithms.filter(|y| *y > 0.0).map(|y| (f64::from(y.ln()), 1.0)))
        .reduce(|| (0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
    if count > 0.0 { (sum / count).exp() as f32 } else { 1.0 }
}
