use super::*;

/// A pixel that is 0 or 2 by turns has variance n / (n - 1) of a sample, and 1 / (n - 1) of the mean, which is 1.
#[test]
fn the_error_is_estimated_from_the_variances() {
    let film = filled(20, 9, 101, |frame, x, _| {
        Vec3::splat(if (frame + x) % 2 == 0 { 0.0 } else { 2.0 })
    });
    assert!(
        (film.estimated_relmse() - 0.01 / 1.01).abs() < 1e-3,
        "{}",
        film.estimated_relmse()
    );
    assert_eq!(filled(4, 4, 1, |_, _, _| Vec3::ONE).estimated_relmse(), f64::INFINITY);
    assert_eq!(filled(4, 4, 9, |_, _, _| Vec3::ZERO).estimated_relmse(), 0.0);
}

/// Adds `sample(frame, x, y)` to every pixel, `frames` times.
fn filled(width: u32, height: u32, frames: u32, sample: impl Fn(u32, u32, u32) -> Vec3) -> Film {
    let mut film = Film::new(width, height, false);
    for frame in 0..frames {
        film.add_frame(1.0, |x, y| sample(frame, x, y));
    }
    film
}

#[test]
fn every_pixel_lands_in_its_row_and_column() {
    let film = filled(37, 19, 1, |_, x, y| Vec3::new(x as f32, y as f32, 1.0));
    let image = film.image();
    assert_eq!((image.width, image.height, image.pixels.len()), (37, 19, 37 * 19));
    for (i, pixel) in image.pixels.iter().enumerate() {
        assert_eq!(*pixel, [(i % 37) as f32, (i / 37) as f32, 1.0]);
    }
}

#[test]
fn sums_stay_exact_where_plain_float_sums_stop_growing() {
    // 2^24 is where adding 1 to an f32 sum no longer changes it.
    let mut film = Film::new(1, 1, false);
    let tile = &mut film.tiles_mut()[0];
    tile.add(0, Vec3::splat(16_777_216.0));
    for _ in 0..10_000 {
        tile.add(0, Vec3::ONE);
    }
    let mean = f64::from(film.image().pixels[0][0]);
    let expected = (16_777_216.0 + 10_000.0) / 10_001.0;
    assert!((mean / expected - 1.0).abs() < 1e-7, "{mean} against {expected}");
}

#[test]
fn variance_is_that_of_the_mean_and_never_negative() {
    // Luminances 0, 1, 2, 3: sample variance 5/3, of the mean 5/12.
    let film = filled(3, 3, 4, |frame, _, _| Vec3::splat(frame as f32));
    for v in film.variance() {
        assert!((v - 5.0 / 12.0).abs() < 1e-6, "{v}");
    }
    let constant = filled(3, 3, 100, |_, x, _| Vec3::splat(0.1 + x as f32 / 3.0));
    for v in constant.variance() {
        assert!((0.0..1e-9).contains(&v), "{v}");
    }
    assert_eq!(filled(2, 2, 1, |_, _, _| Vec3::ONE).variance(), vec![0.0; 4]);
}

#[test]
fn weighted_frames_make_a_weighted_mean_and_its_variance() {
    let mut film = Film::new(1, 1, false);
    for (weight, value) in [(0.25, 8.0), (1.0, 1.0), (1.0, 3.0)] {
        film.set_weight(weight);
        film.tiles_mut()[0].add(0, Vec3::splat(value));
        film.advance();
    }
    let mean = 6.0 / 2.25;
    assert!((film.image().pixels[0][0] - mean).abs() < 1e-6);
    let spread = (0.25 * 64.0 + 1.0 + 9.0) / 2.25 - mean * mean;
    let share = (0.0625 + 2.0) / (2.25 * 2.25);
    assert!((film.variance()[0] - spread * share / (1.0 - share)).abs() < 1e-5);
    assert_eq!(film.spp(), 3);
}

#[test]
fn samples_that_are_not_finite_are_left_out() {
    let mut film = Film::new(1, 1, false);
    let tile = &mut film.tiles_mut()[0];
    assert!(tile.add(0, Vec3::splat(2.0)));
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert!(!tile.add(0, Vec3::new(1.0, bad, 1.0)));
    }
    assert!(tile.add(0, Vec3::splat(4.0)));
    assert_eq!(film.image().pixels, vec![[3.0; 3]]);
}

#[test]
fn every_finite_radiance_is_accumulated() {
    for radiance in [f32::MIN_POSITIVE, 1e-30, 1e30, f32::MAX] {
        let film = filled(1, 1, 100, |frame, _, _| {
            Vec3::splat(if frame % 2 == 0 { 0.0 } else { radiance })
        });
        let expected = f64::from(radiance) / 2.0;
        assert!(
            (f64::from(film.image().pixels[0][0]) / expected - 1.0).abs() < 1e-6,
            "{radiance}"
        );
        // Of samples that are 0 and `radiance` by turns, the variance of the mean is radiance^2 / 4 / 99.
        let relative = film.variances()[0] * 99.0 / (expected * expected);
        assert!((relative - 1.0).abs() < 1e-6, "{radiance}: {relative}");
        assert!(film.variance()[0].is_finite());
        assert!(film.estimated_relmse().is_finite());
    }
}

#[test]
fn an_empty_film_is_black() {
    let film = Film::new(20, 5, false);
    assert_eq!(film.image().pixels, vec![[0.0; 3]; 100]);
    assert_eq!(film.spp(), 0);
    assert!(film.aovs().is_none());
}

#[test]
fn auxiliary_images_average_hits_and_mark_misses() {
    let mut film = Film::new(2, 1, true);
    let hit = AovSample {
        albedo: Vec3::splat(0.5),
        normal_ws: Vec3::Z,
        position_ws: Vec3::new(1.0, 2.0, 3.0),
        emitted: Vec3::splat(6.0),
        depth: 4.0,
        light: 7,
    };
    let tile = &mut film.tiles_mut()[0];
    tile.add_aovs(0, &hit);
    tile.add_aovs(0, &AovSample::NONE);
    tile.add_aovs(1, &AovSample::NONE);
    let aovs = film.aovs().expect("asked for");
    assert_eq!(aovs.albedo.pixels[0], [0.25; 3]);
    assert_eq!(aovs.normal.pixels[0], [0.0, 0.0, 0.5]);
    assert_eq!(aovs.position.pixels[0], [1.0, 2.0, 3.0]);
    assert_eq!(aovs.emitted.pixels, vec![[3.0; 3], [0.0; 3]]);
    assert_eq!(aovs.depth, vec![4.0, f32::INFINITY]);
    assert_eq!(aovs.light, vec![-1.0, -1.0]);
}
