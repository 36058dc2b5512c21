use super::*;
use glam::Vec3;
use sampling::hash::hash3;
use sampling::statistics::normal_p_two_sided;
use sampling::unit_f32;

/// Renders `frames` in which the samples of a pixel are `sample(x, y, u)`, `u` being uniform and independent.
fn rendered(size: u32, seed: u32, frames: u64, sample: impl Fn(u32, u32, f32) -> f32) -> Film {
    let mut film = Film::new(size, size, false).with_rates();
    let mut drawn = 0;
    for _ in 0..frames {
        film.begin_block();
        film.set_weight(1.0);
        for tile in film.tiles_mut() {
            let work = tile.work(tile.block_frame);
            for (pixels, samples) in work.groups() {
                for &pixel in pixels.iter().flat_map(|pixel| samples.clone().map(move |_| pixel)) {
                    let [x, y] = tile.place(pixel);
                    drawn += 1;
                    tile.add(
                        pixel.into(),
                        Vec3::splat(sample(x, y, unit_f32(hash3(seed, y << 16 | x, drawn)))),
                    );
                }
            }
        }
        film.advance();
    }
    film
}

/// Rare and bright, in every pixel alike: 5 samples in 100 are 19, the others are 1.05 / 19.
fn skewed(u: f32) -> f32 {
    if u < 0.05 { 19.0 } else { 1.0 / 19.0 }
}

/// At the end of a block and within one. A false alarm in 10,000 seeds; the same samples weighed all alike are 8 standard errors too dark, since
/// pixels that have met what is rare take more samples than those that have not.
#[test]
fn pixels_that_decide_by_themselves_are_unbiased() {
    let expected = 0.05 * 19.0 + 0.95 / 19.0;
    let mut alike = Moments::default();
    for (seed, frames) in [(1, 16), (2, 45)] {
        let film = rendered(320, seed, frames, |_, _, u| skewed(u));
        let mut pixels = Moments::default();
        film.image()
            .pixels
            .iter()
            .for_each(|pixel| pixels.push(pixel[0].into()));
        let z = (pixels.mean() - expected) / pixels.standard_error();
        assert!(
            normal_p_two_sided(z) > 5e-5,
            "{frames} frames: {} for {expected}, z = {z}",
            pixels.mean()
        );
        for tile in &film.tiles {
            for (pixel, earlier) in tile.pixels.iter().zip(&tile.earlier).filter(|_| frames == 16) {
                let first = earlier.sums[0] / film.earlier_weights[0] * 8.0;
                alike.push((first + pixel.sums[0]) / f64::from(earlier.count + pixel.count));
            }
        }
    }
    let z = (alike.mean() - expected) / alike.standard_error();
    assert!(z < -5.0, "the test cannot tell: z = {z}");
}

#[test]
fn samples_go_where_the_error_is() {
    // The left half varies sixteen times as much; the right half is twice as bright, and does not vary at all in its lower part.
    let film = rendered(64, 3, 128, |x, y, u| match (x < 32, y < 32) {
        (true, _) => 1.0 + 1.6 * (u - 0.5),
        (false, true) => 2.0 + 0.2 * (u - 0.5),
        (false, false) => 2.0,
    });
    let samples = film.samples();
    let mean = |xs: std::ops::Range<usize>, ys: std::ops::Range<usize>| {
        let count = (xs.len() * ys.len()) as f64;
        ys.map(|y| samples[64 * y..][xs.clone()].iter().sum::<u32>())
            .sum::<u32>() as f64
            / count
    };
    let [noisy, quiet, still] = [mean(0..30, 0..64), mean(34..64, 0..30), mean(34..64, 34..64)];
    assert!(noisy > 4.0 * quiet && quiet >= still, "{noisy} {quiet} {still}");
    let counts = film.sample_counts();
    // Two kinds of pixels and powers of two: seldom exactly one sample per frame.
    assert!((counts.mean / 128.0 - 1.0).abs() < 0.2, "{counts:?}");
    assert_eq!(counts.least, 8 + 120 / 8, "the least rate after the first block");
    assert!(
        counts.most > 128 && counts.skipped > 0.3 && counts.skipped < 0.5,
        "{counts:?}"
    );
    assert_eq!(film.converged(1e9), 1.0);
    let converged = film.converged(1e-4);
    assert!((0.4..0.6).contains(&converged), "the right half: {converged}");
}

/// The truth must lie in 95 % of the intervals; 30 of 40 or fewer do for one seed in 100,000.
#[test]
fn the_error_is_estimated_with_an_interval_that_holds_it() {
    let mut held = 0;
    for seed in 0..40 {
        let film = rendered(32, 100 + seed, 50, |x, _, u| 1.0 + (x % 8) as f32 * 0.1 * (u - 0.5));
        let error = film.estimated_error().expect("two blocks");
        let image = film.image();
        let truth = image.pixels.iter().map(|pixel| f64::from(pixel[0] - 1.0).powi(2));
        let truth = truth.sum::<f64>() / 1024.0 / (1.0 + EPSILON);
        // Of images like this one the relMSE varies itself: by a standard deviation of about sqrt(2 / 1024 pixels).
        let spread = 2.0 * truth * (2.0_f64 / 1024.0).sqrt();
        held += u32::from((error.low - spread..=error.high + spread).contains(&truth));
        assert!(error.low < error.relmse && error.relmse < error.high);
    }
    assert!(held > 30, "{held} of 40");
    assert_eq!(rendered(16, 1, 8, |_, _, u| u).estimated_error(), None, "one block");
    let error = rendered(1, 1, 50, |_, _, u| 1.0 + u)
        .estimated_error()
        .expect("two blocks");
    assert!(error.low == 0.0 && error.high > 10.0 * error.relmse && error.high.is_finite());
}

#[test]
fn what_does_not_vary_has_no_error_and_even_films_have_no_rates() {
    for value in [0.0, 3.0] {
        let film = rendered(20, 0, 40, |_, _, _| value);
        let error = film.estimated_error().expect("two blocks");
        assert_eq!([error.relmse, error.low, error.high], [0.0; 3]);
        assert_eq!(film.image().pixels[7], [value; 3]);
        assert_eq!(film.sample_counts().most, 40);
    }
    let mut even = Film::new(20, 20, false);
    for _ in 0..40 {
        assert!(!even.begin_block());
        even.add_frame(1.0, |_, _| Vec3::ONE);
    }
    assert_eq!(even.estimated_error(), None);
    assert_eq!((even.sample_counts().least, even.sample_counts().skipped), (40, 0.0));
}
