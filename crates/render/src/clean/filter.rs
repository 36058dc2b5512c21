//! The picture smoothed where it is noisy.
//!
//! The spatial part of SVGF (Schied et al. 2017, sections 4.2 and 4.4): an edge-avoiding a-trous wavelet (Dammertz et al. 2010) over
//! what falls on the surfaces, guided by normal, depth and the variance of the pixel. Differs: variances are those of the mean that is
//! filtered, not of a sample of it, so that a picture that is nearly done is hardly touched; depths are compared as
//! distances from the pixel's plane; 3 x 3 taps, not 5 x 5, which is three times as fast; and the filtered picture is not fed back
//! into the history, which stays as exact as what was sampled.

use super::frame::{Frame, Guide, luminance_of};
use glam::Vec4;
use rayon::prelude::*;

/// Distances between taps, pass by pass. More passes remove coarser noise; fewer keep more of the small shadows.
pub(crate) const STEPS: [usize; 4] = [1, 2, 4, 8];
/// How many standard errors pixels may differ and still be mixed. Higher values are smoother; lower values keep more noise.
const TOLERANCE: f32 = 2.0;
/// Factor on 1 - cosine between normals: about an exponent on the cosine.
const NORMAL_TOLERANCE: f32 = 32.0;
/// With fewer neighbours on the same surface than this the variance is that of all neighbours.
const LEAST_ALIKE: f32 = 4.0;
/// Neighbours to each side from which the variance is estimated where samples are too few.
const REACH: usize = 2;

/// Takes most of the noise out of the light.
pub(super) fn filter(frame: &mut Frame) {
    estimate_variance(frame);
    for step in STEPS {
        frame.light = pass(frame, step);
    }
}

/// The pixels around one, it included: their indices, and how far they are to the side and up or down.
fn around(frame: &Frame, i: usize) -> impl Iterator<Item = (usize, usize, usize)> {
    let (width, height) = (frame.width as usize, frame.height as usize);
    let (x, y) = (i % width, i / width);
    let rows = y.saturating_sub(REACH)..(y + REACH + 1).min(height);
    let columns = x.saturating_sub(REACH)..(x + REACH + 1).min(width);
    rows.flat_map(move |v| {
        columns
            .clone()
            .map(move |u| (v * width + u, u.abs_diff(x), v.abs_diff(y)))
    })
}

/// Where the samples of a pixel do not tell their variance, that between the pixels around it takes its place.
fn estimate_variance(frame: &mut Frame) {
    let variance = |i: usize| {
        let here = &frame.guides[i];
        if frame.light[i].w > 0.0 || !here.is_surface() {
            return frame.light[i].w;
        }
        // Of those on the same surface, and of all: weights, values, squares.
        let mut sums = [[0.0_f32; 3]; 2];
        for (j, dx, dy) in around(frame, i) {
            if !frame.guides[j].is_surface() {
                continue;
            }
            let y = luminance_of(frame.light[j]);
            let alike = falloff(unlikeness(here, &frame.guides[j], 1.0 / dx.max(dy).max(1) as f32));
            for (sums, weight) in sums.iter_mut().zip([alike, 1.0]) {
                *sums = [sums[0] + weight, sums[1] + weight * y, sums[2] + weight * y * y];
            }
        }
        let [count, sum, sum_sq] = if sums[0][0] < LEAST_ALIKE { sums[1] } else { sums[0] };
        let mean = sum / count;
        (sum_sq / count - mean * mean).max(0.0)
    };
    let variances: Vec<f32> = (0..frame.light.len()).into_par_iter().map(variance).collect();
    frame
        .light
        .iter_mut()
        .zip(variances)
        .for_each(|(light, variance)| light.w = variance);
}

/// One pass over all pixels, whose taps are `step` pixels apart.
fn pass(frame: &Frame, step: usize) -> Vec<Vec4> {
    let (width, height) = (frame.width as usize, frame.height as usize);
    let mut filtered = vec![Vec4::ZERO; frame.light.len()];
    filtered.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        // Rows and columns beyond the picture are left out.
        let rows = [y.checked_sub(step), Some(y), Some(y + step).filter(|v| *v < height)];
        for (x, filtered) in row.iter_mut().enumerate() {
            let columns = [x.checked_sub(step), Some(x), Some(x + step).filter(|u| *u < width)];
            *filtered = mixed(frame, y * width + x, &rows, &columns, step as f32);
        }
    });
    filtered
}

/// Pixel `i` mixed with those of its surface in these rows and columns, of which it is in the middle.
#[inline]
fn mixed(frame: &Frame, i: usize, rows: &[Option<usize>; 3], columns: &[Option<usize>; 3], step: f32) -> Vec4 {
    /// Of rows and of columns.
    const KERNEL: [f32; 3] = [0.25, 0.5, 0.25];
    let (here, guide) = (frame.light[i], &frame.guides[i]);
    if !guide.is_surface() {
        return here;
    }
    let per_tolerated = 1.0 / (TOLERANCE * here.w.sqrt() + 1e-6);
    let per_distance = 1.0 / step;
    let y = luminance_of(here);
    let (mut sum, mut weights) = (Vec4::ZERO, 0.0);
    for (v, of_row) in rows.iter().zip(KERNEL) {
        let Some(v) = v else { continue };
        for (u, of_column) in columns.iter().zip(KERNEL) {
            let Some(u) = u else { continue };
            let j = v * frame.width as usize + u;
            let (light, other) = (frame.light[j], &frame.guides[j]);
            let unlike = (luminance_of(light) - y).abs() * per_tolerated + unlikeness(guide, other, per_distance);
            let is_surface = f32::from(u8::from(other.is_surface()));
            let weight = is_surface * of_row * of_column * falloff(unlike);
            // The last one is the variance.
            sum += light * Vec4::new(weight, weight, weight, weight * weight);
            weights += weight;
        }
    }
    let scale = 1.0 / weights;
    sum * Vec4::new(scale, scale, scale, scale * scale)
}

/// Minus the logarithm of how surely two pixels show the same surface, given one over the pixels between them; 0 for a pixel
/// with itself.
#[inline]
fn unlikeness(a: &Guide, b: &Guide, per_distance: f32) -> f32 {
    let turned = (1.0 - a.normal.dot(b.normal)) * NORMAL_TOLERANCE;
    turned.max(0.0) + a.off_plane(b.position) * per_distance
}

/// About exp(-x), and 0 from 8 on.
#[inline]
fn falloff(x: f32) -> f32 {
    let base = (1.0 - 0.125 * x).max(0.0);
    let squared = base * base;
    let fourth = squared * squared;
    fourth * fourth
}
