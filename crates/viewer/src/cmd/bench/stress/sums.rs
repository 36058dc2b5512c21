//! Accumulation of very many samples.

use super::bench::{Bench, NEVER};
use anyhow::Result;
use glam::Vec3;
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
        if bench.stopped() {
            return Ok(());
        }
        film(bench, &format!("{frames} frames of {hazard}"), frames, value, weighted);
    }
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
