//! FLIP: how different two pictures look to somebody who flips between them.
//!
//! LDR-FLIP of Andersson et al., "FLIP: A Difference Evaluator for Alternating Images" (2020), of pictures as they are shown:
//! through the display's tone curve, in 8 bits. Constants are the paper's.

use crate::Image;
use crate::image::display;
use glam::{Mat3, Vec3};
use rayon::prelude::*;
use std::f32::consts::{FRAC_1_SQRT_2, PI};

/// Pixels per degree of the viewer's eye: a screen of 0.7 m and 3,840 pixels, seen from 0.7 m.
const PIXELS_PER_DEGREE: f32 = 0.7 * (3840.0 / 0.7) * (PI / 180.0);
/// Exponent of colour differences.
const COLOR_EXPONENT: f32 = 0.7;
/// Colour differences up to this share of the largest one ...
const COMMON: f32 = 0.4;
/// ... are stretched over this share of the scale.
const COMMON_SHOWN: f32 = 0.95;
/// Width of the edges that the eye sees best, degrees.
const FEATURE_WIDTH: f32 = 0.082;
/// Exponent of differences of features.
const FEATURE_EXPONENT: f32 = 0.5;

/// Linear Rec. 709 to XYZ.
const XYZ_FROM_RGB: Mat3 = Mat3::from_cols_array(&[
    0.412_390_8,
    0.212_639,
    0.019_330_82,
    0.357_584_33,
    0.715_168_65,
    0.119_194_78,
    0.180_480_8,
    0.072_192_32,
    0.950_532_14,
]);

/// The mean FLIP difference of `image` and `reference`, each brightened by `exposure` stops and shown through the tone curve of
/// [`crate::image::write_png`]: 0 (alike) to 1. `None` if their sizes differ; 0 if they are empty.
pub fn flip(image: &Image, reference: &Image, exposure: f32) -> Option<f64> {
    if (image.width, image.height) != (reference.width, reference.height) {
        return None;
    }
    if image.pixels.is_empty() {
        return Some(0.0);
    }
    let scale = exposure.exp2();
    let shown = |image: &Image| Plane {
        width: image.width as usize,
        values: (image.pixels.par_iter())
            .map(|pixel| Vec3::from(display::tone_mapped(Vec3::from(*pixel) * scale).map(linear)))
            .collect(),
    };
    let differences = differences(&shown(reference), &shown(image));
    Some(differences.iter().map(|&d| f64::from(d)).sum::<f64>() / differences.len() as f64)
}

/// Undoes the encoding of sRGB.
fn linear(encoded: u8) -> f32 {
    let v = f32::from(encoded) / 255.0;
    if v <= 0.040_45 {
        v / 12.92
    } else {
        ((v + 0.055) / 1.055).powf(2.4)
    }
}

/// A picture of three channels, row 0 at the top.
struct Plane {
    width: usize,
    values: Vec<Vec3>,
}

impl Plane {
    fn map(&self, f: impl Fn(Vec3) -> Vec3 + Sync) -> Self {
        Self {
            width: self.width,
            values: self.values.par_iter().map(|&v| f(v)).collect(),
        }
    }

    /// Along rows by `across`, then along columns by `down`: one weight per channel. Borders are repeated.
    fn filtered(&self, across: &[Vec3], down: &[Vec3]) -> Self {
        let (width, height) = (self.width as isize, (self.values.len() / self.width) as isize);
        let line = |values: &[Vec3], kernel: &[Vec3], along_rows: bool| -> Vec<Vec3> {
            let reach = (kernel.len() / 2) as isize;
            let pixel = |i: usize| {
                let (x, y) = (i as isize % width, i as isize / width);
                let tap = |(k, weight): (isize, &Vec3)| {
                    let (u, v) = if along_rows { (x + k, y) } else { (x, y + k) };
                    let at = v.clamp(0, height - 1) * width + u.clamp(0, width - 1);
                    values[at as usize] * *weight
                };
                (-reach..=reach).zip(kernel).map(tap).sum()
            };
            (0..values.len()).into_par_iter().map(pixel).collect()
        };
        Self {
            width: self.width,
            values: line(&line(&self.values, across, true), down, false),
        }
    }
}

/// The difference at every pixel, 0..1, of two pictures of linear Rec. 709.
fn differences(reference: &Plane, test: &Plane) -> Vec<f32> {
    let [reference, test] = [reference, test].map(|plane| plane.map(|rgb| opponent(XYZ_FROM_RGB * rgb)));
    let colors = [&reference, &test].map(|plane| spatially_filtered(plane).map(as_perceived));
    let features = [&reference, &test].map(features);
    let largest = hyab(
        as_perceived(opponent(XYZ_FROM_RGB * Vec3::Y)),
        as_perceived(opponent(XYZ_FROM_RGB * Vec3::Z)),
    )
    .powf(COLOR_EXPONENT);
    let pixel = |i: usize| {
        let color = stretched(
            hyab(colors[0].values[i], colors[1].values[i]).powf(COLOR_EXPONENT),
            largest,
        );
        let [edges, points] = [0, 1].map(|kind| (features[0][i][kind] - features[1][i][kind]).abs());
        let feature = (FRAC_1_SQRT_2 * edges.max(points)).powf(FEATURE_EXPONENT);
        color.powf(1.0 - feature)
    };
    (0..reference.values.len()).into_par_iter().map(pixel).collect()
}

/// XYZ relative to the white of the screen.
fn relative_to_white(xyz: Vec3) -> Vec3 {
    xyz / (XYZ_FROM_RGB * Vec3::ONE)
}

/// YCxCz: linear opponent colours, in which the eye's filters work (section 4.1.1).
fn opponent(xyz: Vec3) -> Vec3 {
    let v = relative_to_white(xyz);
    Vec3::new(116.0 * v.y - 16.0, 500.0 * (v.x - v.y), 200.0 * (v.y - v.z))
}

/// Back from [`opponent`].
fn from_opponent(c: Vec3) -> Vec3 {
    let y = (c.x + 16.0) / 116.0;
    Vec3::new(y + c.y / 500.0, y, y - c.z / 200.0) * (XYZ_FROM_RGB * Vec3::ONE)
}

/// What the eye resolves: contrast sensitivity by channel, as sums of Gaussians (table 1).
fn spatially_filtered(plane: &Plane) -> Plane {
    /// Height and width of two Gaussians each for achromatic, red-green and blue-yellow.
    const GAUSSIANS: [[(f32, f32); 2]; 3] = [
        [(1.0, 0.0047), (0.0, 1e-5)],
        [(1.0, 0.0053), (0.0, 1e-5)],
        [(34.1, 0.04), (13.5, 0.025)],
    ];
    const WIDEST: f32 = 0.04;
    let reach = (3.0 * (WIDEST / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
    // A two-dimensional Gaussian is a product of two; their sum is not, so that both terms are filtered apart.
    let line = |(_, b): (f32, f32)| -> Vec<f32> {
        let at = |k: i32| k as f32 / PIXELS_PER_DEGREE;
        (-reach..=reach).map(|k| (-PI * PI * at(k) * at(k) / b).exp()).collect()
    };
    let mut sum: Option<Plane> = None;
    let total: [f32; 3] = GAUSSIANS.map(|terms| {
        terms
            .map(|g| g.0 * (PI / g.1).sqrt() * line(g).iter().sum::<f32>().powi(2))
            .iter()
            .sum()
    });
    for term in 0..2 {
        let lines = GAUSSIANS.map(|terms| line(terms[term]));
        let kernel: Vec<Vec3> = (0..lines[0].len())
            .map(|k| Vec3::new(lines[0][k], lines[1][k], lines[2][k]))
            .collect();
        let share: [f32; 3] =
            std::array::from_fn(|c| GAUSSIANS[c][term].0 * (PI / GAUSSIANS[c][term].1).sqrt() / total[c]);
        let scaled: Vec<Vec3> = kernel.iter().map(|k| *k * Vec3::from(share)).collect();
        let filtered = plane.filtered(&kernel, &scaled);
        sum = Some(match sum {
            None => filtered,
            Some(before) => Plane {
                width: plane.width,
                values: before
                    .values
                    .iter()
                    .zip(&filtered.values)
                    .map(|(a, b)| *a + *b)
                    .collect(),
            },
        });
    }
    sum.expect("there are two terms")
}

/// Opponent colours to L*a*b* with the chroma of dark colours reduced (Hunt effect; section 4.1.2).
fn as_perceived(c: Vec3) -> Vec3 {
    let rgb = (XYZ_FROM_RGB.inverse() * from_opponent(c)).clamp(Vec3::ZERO, Vec3::ONE);
    let f = relative_to_white(XYZ_FROM_RGB * rgb).to_array().map(|t| {
        const DELTA: f32 = 6.0 / 29.0;
        if t > DELTA * DELTA * DELTA {
            t.cbrt()
        } else {
            t / (3.0 * DELTA * DELTA) + 4.0 / 29.0
        }
    });
    let lightness = 116.0 * f[1] - 16.0;
    let chroma = 0.01 * lightness;
    Vec3::new(
        lightness,
        500.0 * (f[0] - f[1]) * chroma,
        200.0 * (f[1] - f[2]) * chroma,
    )
}

/// A distance that holds for large differences: city block in lightness, Euclidean in chroma (section 4.1.3).
fn hyab(a: Vec3, b: Vec3) -> f32 {
    let d = a - b;
    d.x.abs() + (d.y * d.y + d.z * d.z).sqrt()
}

/// Colour differences on the scale 0..1, most of it for the common ones (section 4.1.3).
fn stretched(difference: f32, largest: f32) -> f32 {
    let common = COMMON * largest;
    if difference < common {
        difference * COMMON_SHOWN / common
    } else {
        COMMON_SHOWN + (difference - common) / (largest - common) * (1.0 - COMMON_SHOWN)
    }
}

/// Strength of edges and of points at every pixel (section 4.2).
fn features(plane: &Plane) -> Vec<[f32; 2]> {
    let deviation = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
    let reach = (3.0 * deviation).ceil() as i32;
    let offsets: Vec<f32> = (-reach..=reach).map(|k| k as f32).collect();
    let gaussian: Vec<f32> = offsets
        .iter()
        .map(|x| (-x * x / (2.0 * deviation * deviation)).exp())
        .collect();
    let of = |shape: &dyn Fn(f32) -> f32| -> Vec<f32> {
        let line: Vec<f32> = offsets.iter().zip(&gaussian).map(|(x, g)| shape(*x) * g).collect();
        // Positive and negative weights sum to 1 each.
        let [up, down] = [1.0, -1.0].map(|sign| line.iter().map(|v| (v * sign).max(0.0)).sum::<f32>());
        line.iter()
            .map(|v| if *v > 0.0 { v / up } else { v / down.max(1e-30) })
            .collect()
    };
    let smooth = of(&|_| 1.0);
    let edge = of(&|x| -x);
    let point = of(&|x| x * x / (deviation * deviation) - 1.0);
    // Achromatic alone, 0..1; its edges and points in one pass of three channels.
    let light = plane.map(|c| Vec3::splat((c.x + 16.0) / 116.0));
    let kernel = |edges: &[f32], points: &[f32]| -> Vec<Vec3> {
        edges.iter().zip(points).map(|(e, p)| Vec3::new(*e, *p, 0.0)).collect()
    };
    let across = light.filtered(&kernel(&edge, &point), &kernel(&smooth, &smooth));
    let down = light.filtered(&kernel(&smooth, &smooth), &kernel(&edge, &point));
    let pairs = across.values.iter().zip(&down.values);
    pairs.map(|(a, d)| [a.x.hypot(d.x), a.y.hypot(d.y)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(pixel: impl Fn(u32, u32) -> [f32; 3]) -> Image {
        let (width, height) = (48, 40);
        Image {
            width,
            height,
            pixels: (0..width * height).map(|i| pixel(i % width, i / width)).collect(),
        }
    }

    fn between(test: [[f32; 3]; 2]) -> f32 {
        let plane = |rgb: [f32; 3]| Plane {
            width: 8,
            values: vec![rgb.into(); 64],
        };
        let [a, b] = test.map(plane);
        let differences = differences(&a, &b);
        assert!(differences.iter().all(|d| (d - differences[0]).abs() < 1e-4), "uniform");
        differences[0]
    }

    #[test]
    fn plain_colours_have_the_differences_of_the_paper() {
        assert_eq!(between([[0.3, 0.7, 0.1]; 2]), 0.0);
        // The largest difference there is: by it the scale is made.
        assert!((between([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]) - 1.0).abs() < 1e-3);
        let black_white = between([[0.0; 3], [1.0; 3]]);
        assert!((0.95..1.0).contains(&black_white), "{black_white}");
        let slight = between([[0.5; 3], [0.52; 3]]);
        assert!((0.0..0.2).contains(&slight), "{slight}");
    }

    #[test]
    fn more_noise_looks_more_different_and_the_order_does_not_matter() {
        let flat = image(|_, _| [0.3; 3]);
        let noisy = |size: f32| {
            image(move |x, y| {
                let bits = sampling::hash::mix(y * 48 + x);
                [0.3 + size * ((bits >> 16) as f32 / 65_536.0 - 0.5); 3]
            })
        };
        let of = |a: &Image, b: &Image| flip(a, b, 0.0).expect("one size");
        assert_eq!(of(&flat, &flat), 0.0);
        let [less, more] = [0.05, 0.4].map(|size| of(&noisy(size), &flat));
        assert!(0.0 < less && less < more && more < 1.0, "{less} {more}");
        assert!((of(&flat, &noisy(0.4)) - more).abs() < 1e-6);
    }

    #[test]
    fn pictures_of_different_sizes_are_not_compared() {
        let small = Image {
            width: 2,
            height: 2,
            pixels: vec![[0.0; 3]; 4],
        };
        assert!(flip(&image(|_, _| [0.0; 3]), &small, 0.0).is_none());
    }
}
