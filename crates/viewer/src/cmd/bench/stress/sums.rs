//! Accumulation of very many samples.

use super::bench::{Bench, NEVER};
use anyhow::Result;
use glam::{DVec3, Vec3};
use render::Film;
use sampling::{PairSum, Random};

/// Checks the family.
pub(super) fn check(bench: &mut Bench) -> Result<()> {
    let frames = bench.pick(1 << 16, 1 << 24, 1 << 26);
    let noisy = |frame: u32| {
        let bits = Random::new(11, frame, 0).u32(0);
        if bits.is_multiple_of(1000) {
            1000.3
        } else {
            (bits >> 8) as f32 * 1e-11
        }
    };
    for (hazard, value, weighted) in [
        ("ones", (|_| 1.0) as fn(u32) -> f32, false),
        ("a tenth", |_| 0.1, false),
        ("sparse noise", noisy, false),
        ("sparse noise, weights that grow", noisy, true),
        (
            "1e30 and 1e-30 by turns",
            |frame| if frame % 2 == 0 { 1e30 } else { 1e-30 },
            false,
        ),
        ("1e-30", |_| 1e-30, false),
    ] {
        let hazard = format!("{frames} frames of {hazard}");
        bench.now(&hazard)?;
        film(bench, &hazard, frames, value, weighted);
    }
    left_out(bench);
    bench.now("pairs of f32")?;
    pairs(bench, frames, noisy);
    Ok(())
}

/// A sum that loses nothing: Kahan's, in `f64`.
#[derive(Clone, Copy, Default)]
struct Exact {
    sum: f64,
    lost: f64,
}

impl Exact {
    fn add(&mut self, x: f64) {
        let term = x - self.lost;
        let new = self.sum + term;
        self.lost = (new - self.sum) - term;
        self.sum = new;
    }
}

/// One pixel against exact sums: its mean, and the variance of its mean.
fn film(bench: &mut Bench, hazard: &str, frames: u32, value: fn(u32) -> f32, weighted: bool) {
    let mut film = Film::new(1, 1, false);
    // Luminance in the green channel only; relative to the first sample, so that squares stay in range.
    let unit = f64::from(value(0).max(value(1)));
    let (mut weights, mut squared_weights) = (Exact::default(), Exact::default());
    let (mut sum, mut squares) = (Exact::default(), Exact::default());
    let mut left_out = 0;
    for frame in 0..frames {
        // As samplers that learn weigh later frames.
        let weight = if weighted {
            (1.0 + (frame.max(4) / 4) as f32).log2().exp2().sqrt()
        } else {
            1.0
        };
        left_out += film.add_frame(weight, |_, _| Vec3::Y * value(frame));
        let (w, x) = (f64::from(weight), f64::from(value(frame)) / unit);
        weights.add(w);
        squared_weights.add(w * w);
        sum.add(w * x);
        squares.add(w * x * x);
    }
    let mean = sum.sum / weights.sum;
    let share = squared_weights.sum / (weights.sum * weights.sum);
    let variance = (squares.sum / weights.sum - mean * mean).max(0.0) * share / (1.0 - share);
    let found = f64::from(film.image().pixels[0][1]) / unit;
    bench.check(
        hazard,
        "film, mean",
        ("relative error", 1e-6),
        (found / mean - 1.0).abs(),
    );
    bench.check(hazard, "film, samples left out", NEVER, left_out as f64);
    let luminance = 0.7152 * unit;
    let found = film.variance()[0];
    bench.check(
        hazard,
        "film, variances below 0",
        NEVER,
        f64::from(u8::from(found.is_nan() || found < 0.0)),
    );
    // What is beyond single precision is told as its largest or smallest number.
    let expected = (variance * luminance * luminance).min(f64::from(f32::MAX));
    let resolution = 1e-14 * mean * mean * luminance * luminance + f64::from(f32::MIN_POSITIVE);
    let error = (f64::from(found) - expected).abs() / (expected + resolution);
    bench.check(hazard, "film, variance", ("relative error", 1e-3), error);
}

/// Samples that are not finite are counted and do not change the image, in whichever channel and at whatever weight.
fn left_out(bench: &mut Bench) {
    let hazard = "samples that are not finite";
    let good = |frame: u32| Vec3::new(1.0, 2.0, 3.0) * Random::new(14, frame, 0).f32(0);
    let bad = |frame: u32| {
        let value = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY][frame as usize % 3];
        good(frame).with_x(value).to_array()
    };
    let (mut clean, mut mixed) = (Film::new(1, 1, false), Film::new(1, 1, false));
    let mut counted = 0;
    for frame in 0..999 {
        let weight = 1.0 + (frame % 4) as f32;
        clean.add_frame(weight, |_, _| good(frame));
        mixed.add_frame(weight, |_, _| good(frame));
        let mut odd = bad(frame);
        odd.rotate_left(frame as usize / 3 % 3);
        counted += mixed.add_frame(weight, |_, _| Vec3::from_array(odd));
    }
    let [clean, mixed] = [clean, mixed].map(|film| DVec3::from(film.image().pixels[0].map(f64::from)));
    bench.check(hazard, "film, samples miscounted", NEVER, counted.abs_diff(999) as f64);
    let error = (mixed / clean - 1.0).abs().max_element();
    // No number is the largest error of all, which a maximum would pass over.
    let error = if mixed.is_finite() { error } else { f64::NAN };
    bench.check(hazard, "film, mean", ("relative error", 1e-6), error);
}

/// The compensated pair of `f32`, as back ends without double precision use it.
fn pairs(bench: &mut Bench, frames: u32, value: fn(u32) -> f32) {
    let mut pair = PairSum::default();
    let mut exact = Exact::default();
    for frame in 0..frames {
        pair.add(value(frame));
        exact.add(f64::from(value(frame)));
    }
    let hazard = format!("{frames} terms of sparse noise");
    bench.check(
        hazard,
        "pair of f32",
        ("relative error", 1e-6),
        (pair.value() / exact.sum - 1.0).abs(),
    );
}
