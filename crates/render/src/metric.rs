//! How far an image is from its reference.

use crate::Image;
use glam::Vec3;
use sampling::statistics::Moments;
use scene::luminance;

/// Share of the worst pixels that the trimmed error leaves out: fireflies, which plain relMSE is ruled by.
const TRIMMED_SHARE: f64 = 0.001;

/// Regulariser of relative errors, as a share of the reference's mean (squared): keeps dark pixels from ruling, and
/// does not depend on the scale of the scene.
pub(crate) const EPSILON: f64 = 0.01;

/// Errors on luminance over all pixels, as the field reports them.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct ImageError {
    /// Mean squared error.
    pub mse: f64,
    /// mean((x - r)^2 / (r^2 + 0.01 mean(r)^2)): all pixels weigh alike, and the scale of the scene does not matter.
    pub relmse: f64,
    /// The same without the worst 0.1 % of the pixels.
    pub relmse_trimmed: f64,
    /// Standard error of `relmse_trimmed`, as if the pixels were drawn from one population: how much it would vary
    /// from seed to seed, rather too large than too small where errors differ from place to place.
    pub relmse_trimmed_se: f64,
    /// Symmetric mean absolute percentage error, 2 |x - r| / (|x| + |r| + 0.01 mean(r)).
    pub smape: f64,
    /// mean(x) / mean(r); 1 if both are black.
    pub mean_ratio: f64,
}

impl ImageError {
    /// Compares `image` with `reference`; `None` if their sizes differ. A pixel that is not finite in either makes
    /// every error infinite: such an image has no error worth a number.
    ///
    /// Noise of the reference counts as error of the image; see [`Self::against_parts`].
    pub fn between(image: &Image, reference: &Image) -> Option<Self> {
        Self::against_parts(image, std::slice::from_ref(reference))
    }

    /// Compares `image` with a reference in equally good parts that are independent of each other, all of one size; `None` if they are not, or if there
    /// are none. One part is a plain reference, see [`Self::between`].
    ///
    /// (x - a)(x - b) of two parts takes the place of (x - r)^2, r being the mean of all. Its expectation is the squared error of x alone,
    /// because the errors of x, a and b are independent: a reference as noisy as the image adds noise to the figures,
    /// no offset. They may thus be below 0 where the image is far better than the reference. All pairs are averaged.
    ///
    /// What makes the error relative must be independent of both too: it is the mean of the other parts. With two parts there are no others; where r
    /// takes their place and is noisy, both factors are large and divided by too little wherever both parts happen to be too dark, and relative errors of good images come
    /// out far too large (rooms, 4 bounces, two parts of 4 samples: 0.039 for 0.009).
    ///
    /// `relmse_trimmed` leaves out the 0.1 % of the pixels that are largest in magnitude. SMAPE and the ratio of means are those against r.
    pub fn against_parts(image: &Image, parts: &[Image]) -> Option<Self> {
        let x = luminances(image);
        let same_size = |part: &Image| (image.width, image.height) == (part.width, part.height);
        if parts.is_empty() || !parts.iter().all(same_size) {
            return None;
        }
        let parts: Vec<Vec<f64>> = parts.iter().map(luminances).collect();
        Some(Self::of(&x, &parts))
    }

    /// The errors of luminances `x` against those of the parts, as many each.
    fn of(x: &[f64], parts: &[Vec<f64>]) -> Self {
        if x.is_empty() {
            return Self {
                mean_ratio: 1.0,
                ..Self::default()
            };
        }
        if x.iter().chain(parts.iter().flatten()).any(|v| !v.is_finite()) {
            return Self {
                mse: f64::INFINITY,
                relmse: f64::INFINITY,
                relmse_trimmed: f64::INFINITY,
                relmse_trimmed_se: f64::INFINITY,
                smape: f64::INFINITY,
                mean_ratio: f64::INFINITY,
            };
        }
        let n = x.len() as f64;
        let count = parts.len() as f64;
        let sums: Vec<f64> = (0..x.len()).map(|i| parts.iter().map(|part| part[i]).sum()).collect();
        let mean_x = x.iter().sum::<f64>() / n;
        let mean_r = sums.iter().sum::<f64>() / (n * count);
        let (mut squares, mut relative) = (0.0, vec![0.0; x.len()]);
        let pairs = pairs(parts.len());
        for &(j, k) in &pairs {
            let (a, b) = (&parts[j], &parts[k]);
            for (i, relative) in relative.iter_mut().enumerate() {
                let square = (x[i] - a[i]) * (x[i] - b[i]);
                let brightness = match parts.len() {
                    0..=2 => sums[i] / count,
                    _ => (sums[i] - a[i] - b[i]) / (count - 2.0),
                };
                squares += square;
                *relative += ratio(square, brightness * brightness + EPSILON * mean_r * mean_r, 0.0);
            }
        }
        relative.iter_mut().for_each(|error| *error /= pairs.len() as f64);
        let smape = x
            .iter()
            .zip(&sums)
            .map(|(x, sum)| (x, sum / count))
            .map(|(x, r)| ratio(2.0 * (x - r).abs(), x.abs() + r.abs() + EPSILON * mean_r.abs(), 0.0))
            .sum::<f64>();
        let relmse = relative.iter().sum::<f64>() / n;
        let kept = x.len() - (n * TRIMMED_SHARE) as usize;
        if kept < x.len() {
            relative.select_nth_unstable_by(kept, |a, b| a.abs().total_cmp(&b.abs()));
        }
        let mut trimmed = Moments::default();
        relative[..kept].iter().for_each(|&error| trimmed.push(error));
        Self {
            mse: squares / (n * pairs.len() as f64),
            relmse,
            relmse_trimmed: trimmed.mean(),
            relmse_trimmed_se: trimmed.standard_error(),
            smape: smape / n,
            mean_ratio: ratio(mean_x, mean_r, 1.0),
        }
    }
}

/// All pairs of different parts; of a single part that with itself.
fn pairs(parts: usize) -> Vec<(usize, usize)> {
    if parts == 1 {
        return vec![(0, 0)];
    }
    (0..parts).flat_map(|k| (0..k).map(move |j| (j, k))).collect()
}

/// `a / b`; `both_zero` where both are zero.
fn ratio(a: f64, b: f64, both_zero: f64) -> f64 {
    if a == 0.0 && b == 0.0 { both_zero } else { a / b }
}

/// Luminances of the pixels.
fn luminances(image: &Image) -> Vec<f64> {
    let of = |pixel: &[f32; 3]| f64::from(luminance(Vec3::from(*pixel)));
    image.pixels.iter().map(of).collect()
}

/// Those of two images of one size.
fn both_luminances(image: &Image, reference: &Image) -> Option<(Vec<f64>, Vec<f64>)> {
    let same = (image.width, image.height) == (reference.width, reference.height);
    same.then(|| (luminances(image), luminances(reference)))
}

/// Where and how `image` differs from `reference`, in false colours for [`crate::image::write_png_as_is`]: black where equal,
/// through blue to white where too dark, through red to yellow where too bright. The scale is the square root of
/// |x - r| / (|x| + |r| + 0.01 mean(r)), so that small differences show; magenta marks pixels that are not finite. `None` if the sizes differ.
pub fn false_color_difference(image: &Image, reference: &Image) -> Option<Image> {
    let (x, r) = both_luminances(image, reference)?;
    let finite = r.iter().filter(|r| r.is_finite());
    let mean_r = finite.clone().sum::<f64>() / finite.count().max(1) as f64;
    let color = |(x, r): (&f64, &f64)| {
        let size = ratio((x - r).abs(), x.abs() + r.abs() + EPSILON * mean_r.abs(), 0.0);
        if !size.is_finite() {
            return [1.0, 0.0, 1.0];
        }
        let size = size.min(1.0).sqrt() as f32;
        let (rise, light) = ((2.0 * size).min(1.0), (2.0 * size - 1.0).max(0.0));
        if x > r {
            [rise, light, 0.0]
        } else {
            [light, light, rise]
        }
    };
    Some(Image {
        width: image.width,
        height: image.height,
        pixels: x.iter().zip(&r).map(color).collect(),
    })
}

/// Per pixel, how many standard errors the luminances of two independent images lie apart, (x - y) / sqrt(vx + vy); 0 where both agree
/// without variance. `None` if sizes differ.
///
/// For unbiased images of enough samples these are standard normal.
pub fn z_scores(x: &Image, variance_x: &[f32], y: &Image, variance_y: &[f32]) -> Option<Vec<f64>> {
    let (lum_x, lum_y) = both_luminances(x, y)?;
    if [variance_x.len(), variance_y.len()] != [lum_x.len(); 2] {
        return None;
    }
    let variances = variance_x.iter().zip(variance_y);
    let pixels = lum_x.iter().zip(&lum_y).zip(variances);
    Some(
        pixels
            .map(|((x, y), (vx, vy))| ratio(x - y, (f64::from(*vx) + f64::from(*vy)).sqrt(), 0.0))
            .collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(values: &[f32]) -> Image {
        Image {
            width: values.len() as u32,
            height: 1,
            pixels: values.iter().map(|v| [*v; 3]).collect(),
        }
    }

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-6 * b.abs().max(1.0)
    }

    #[test]
    fn errors_of_a_known_pair() {
        // mean(r) = 2, so the regulariser is 0.04 for squares and 0.02 for SMAPE.
        let e = ImageError::between(&grey(&[1.0, 5.0]), &grey(&[1.0, 3.0])).expect("same size");
        assert!(close(e.mse, 2.0), "{e:?}");
        assert!(close(e.relmse, 0.5 * 4.0 / 9.04), "{e:?}");
        assert!(close(e.relmse_trimmed, e.relmse), "{e:?}");
        assert!(close(e.smape, 0.5 * 4.0 / 8.02), "{e:?}");
        assert!(close(e.mean_ratio, 1.5), "{e:?}");
    }

    /// Independent errors of a known variance around a known image; `sample` distinguishes the images.
    fn noisy(mean: &[f32], deviation: f32, sample: u32) -> Image {
        // The sum of three uniform numbers has variance 1/4.
        let noise = |pixel: u32| -> f32 {
            let unit = |k| sampling::random::unit_f32(sampling::hash::hash3(pixel, sample, k));
            2.0 * ((0..3).map(unit).sum::<f32>() - 1.5)
        };
        let pixels = mean.iter().zip(0..).map(|(m, pixel)| m + m * deviation * noise(pixel));
        grey(&pixels.collect::<Vec<_>>())
    }

    #[test]
    fn noise_of_a_reference_in_parts_is_no_error() {
        const PIXELS: usize = 2_000;
        const TRIALS: u32 = 200;
        const DEVIATION: f32 = 0.1;
        let mean: Vec<f32> = (0..PIXELS).map(|i| 1.0 + (i % 7) as f32).collect();
        let squares: f64 = mean.iter().map(|m| f64::from(m * DEVIATION).powi(2)).sum();
        let expected = squares / PIXELS as f64;
        let [mut parts, mut plain, mut claimed] = [Moments::default(), Moments::default(), Moments::default()];
        let (mut relative, mut perfect) = (Moments::default(), Moments::default());
        for trial in 0..TRIALS {
            let [x, a, b] = [0, 1, 2].map(|k| noisy(&mean, DEVIATION, 3 * trial + k));
            let error = ImageError::against_parts(&x, &[a.clone(), b.clone()]).expect("same size");
            parts.push(error.mse);
            relative.push(error.relmse_trimmed);
            claimed.push(error.relmse_trimmed_se);
            plain.push(ImageError::between(&x, &a).expect("same size").mse);
            let error = ImageError::against_parts(&grey(&mean), &[a, b]).expect("same size");
            perfect.push(error.mse);
        }
        // Three tests at |z| < 4.5: one false alarm in 49,000 sets of seeds.
        let z = |m: &Moments, expected: f64| (m.mean() - expected) / m.standard_error();
        assert!(z(&parts, expected).abs() < 4.5, "{} for {expected}", parts.mean());
        assert!(
            z(&plain, 2.0 * expected).abs() < 4.5,
            "{} counts the reference's noise",
            plain.mean()
        );
        assert!(z(&perfect, 0.0).abs() < 4.5, "{} for 0", perfect.mean());
        // 0.01 r^2 / (r^2 + 0.01 mean(r)^2), with r in the denominator noisy by 7 %, and the largest 0.1 % left out.
        assert!((relative.mean() / 0.0099 - 1.0).abs() < 0.05, "{}", relative.mean());
        let spread = relative.variance().sqrt();
        assert!(
            (claimed.mean() / spread - 1.0).abs() < 0.25,
            "{} for {spread}",
            claimed.mean()
        );
    }

    /// A reference as noisy as a few samples of a path tracer: its noise must not count as relative error either. Two tests at |z| < 4: one
    /// false alarm in 16,000 sets of seeds.
    #[test]
    fn noise_of_three_parts_is_no_relative_error() {
        const DEVIATION: f32 = 0.4;
        let mean: Vec<f32> = (0..2_000).map(|i| 1.0 + (i % 7) as f32).collect();
        let [mut perfect, mut two_parts, mut dim] = [Moments::default(), Moments::default(), Moments::default()];
        // An image that is too dark by 10 % everywhere has 0.01 times what a perfect one would have if it were black.
        let [dimmed, black] = [0.9, 0.0].map(|factor| grey(&mean.iter().map(|m| m * factor).collect::<Vec<_>>()));
        for trial in 0..200 {
            let parts = [0, 1, 2].map(|k| noisy(&mean, DEVIATION, 3 * trial + k));
            let of =
                |image: &Image, parts: &[Image]| ImageError::against_parts(image, parts).expect("same size").relmse;
            perfect.push(of(&grey(&mean), &parts));
            two_parts.push(of(&grey(&mean), &parts[..2]));
            dim.push(of(&dimmed, &parts) - 0.01 * of(&black, &parts));
        }
        let z = |m: &Moments| m.mean() / m.standard_error();
        assert!(z(&perfect).abs() < 4.0, "{} for 0", perfect.mean());
        assert!(z(&dim).abs() < 4.0, "{} for 0", dim.mean());
        // What it is there for: without a third part a perfect image seems to have an error.
        assert!(z(&two_parts) > 10.0, "{}", two_parts.mean());
    }

    #[test]
    fn equal_parts_are_a_plain_reference() {
        let (x, r) = (grey(&[1.0, 5.0, 0.0]), grey(&[1.0, 3.0, 0.5]));
        let parts = |count| ImageError::against_parts(&x, &vec![r.clone(); count]);
        assert_eq!(parts(2), ImageError::between(&x, &r));
        for (many, one) in [(3, 1), (4, 1)].map(|(m, n)| (parts(m).expect("same size"), parts(n).expect("same size"))) {
            assert!(close(many.relmse, one.relmse) && close(many.mse, one.mse) && close(many.smape, one.smape));
        }
        assert!(ImageError::against_parts(&x, &[r.clone(), grey(&[1.0])]).is_none());
        assert!(ImageError::against_parts(&x, &[]).is_none());
        let nan = ImageError::against_parts(&x, &[r, grey(&[f32::NAN; 3])]).expect("same size");
        assert_eq!(nan.relmse_trimmed, f64::INFINITY);
    }

    #[test]
    fn trimming_leaves_out_the_worst_thousandth() {
        let reference = vec![1.0; 2000];
        let mut image = reference.clone();
        image[7] = 1000.0;
        image[1999] = 500.0;
        let e = ImageError::between(&grey(&image), &grey(&reference)).expect("same size");
        assert!(e.relmse > 100.0 && e.relmse_trimmed < 1e-12, "{e:?}");
        image[3] = 100.0;
        let e = ImageError::between(&grey(&image), &grey(&reference)).expect("same size");
        assert!(e.relmse_trimmed > 1.0, "two of 2,000 are trimmed, not three: {e:?}");
    }

    #[test]
    fn relative_errors_ignore_the_scale_of_the_scene() {
        let (x, r) = ([0.5, 2.0, 0.0, 7.0], [1.0, 1.5, 0.1, 6.0]);
        let base = ImageError::between(&grey(&x), &grey(&r)).expect("same size");
        let scaled = |s: f32| ImageError::between(&grey(&x.map(|v| v * s)), &grey(&r.map(|v| v * s)));
        for s in [1e-6, 1e6] {
            let e = scaled(s).expect("same size");
            assert!((e.relmse / base.relmse - 1.0).abs() < 1e-5, "{e:?}");
            assert!((e.smape / base.smape - 1.0).abs() < 1e-5, "{e:?}");
        }
    }

    #[test]
    fn black_equal_empty_and_unfit_images() {
        let black = ImageError::between(&grey(&[0.0; 4]), &grey(&[0.0; 4])).expect("same size");
        assert_eq!(
            (black.mse, black.relmse, black.smape, black.mean_ratio),
            (0.0, 0.0, 0.0, 1.0)
        );
        assert!(ImageError::between(&grey(&[1.0]), &grey(&[1.0, 1.0])).is_none());
        let empty = ImageError::between(&grey(&[]), &grey(&[])).expect("same size");
        assert_eq!(empty.mean_ratio, 1.0);
        let nan = ImageError::between(&grey(&[f32::NAN]), &grey(&[1.0])).expect("same size");
        assert_eq!(nan.relmse, f64::INFINITY);
    }

    #[test]
    fn false_colours_tell_direction_and_size() {
        let difference = false_color_difference(&grey(&[1.0, 0.9, 1.1, 9.0, f32::NAN]), &grey(&[1.0; 5]));
        let p = difference.expect("same size").pixels;
        assert_eq!(p[0], [0.0; 3]);
        assert!(p[1][2] > 0.1 && p[1][0] == 0.0, "darker is blue: {:?}", p[1]);
        assert!(p[2][0] > 0.1 && p[2][2] == 0.0, "brighter is red: {:?}", p[2]);
        assert!(p[3][1] > p[2][1], "far brighter is yellow: {:?}", p[3]);
        assert_eq!(p[4], [1.0, 0.0, 1.0]);
    }

    #[test]
    fn z_scores_are_in_standard_errors() {
        let z = z_scores(
            &grey(&[3.0, 1.0, 2.0]),
            &[3.0, 0.0, 0.0],
            &grey(&[1.0, 1.0, 1.0]),
            &[1.0, 0.0, 0.0],
        );
        let z = z.expect("same size");
        assert!(close(z[0], 1.0) && z[1] == 0.0 && z[2] == f64::INFINITY, "{z:?}");
        assert!(z_scores(&grey(&[1.0]), &[], &grey(&[1.0]), &[0.0]).is_none());
    }
}
