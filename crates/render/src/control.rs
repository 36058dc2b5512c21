//! How much of the control variate each pixel takes.
//!
//! To what a path finds, f, any multiple b of a control variate c may be added: its mean is zero, so the mean of f + b c is that of f. The
//! variance is least at b = -Cov(f, c) / Var(c) (Owen 2013, "Monte Carlo theory, methods and examples", section 8.9). Where what is expected of
//! the lights is right, b is 1. In a shadow that is finer than what was learned every light is expected and none arrives: f is 0, the
//! control is nothing but noise, and b should be 0. (64 lights in `demo:points`, 64 frames: a third of the error that b = 1 leaves, nearly all of
//! which was in the darkest 4 % of the pixels.)
//!
//! Worked out from the samples that it is applied to, b would bias their mean. It is worked out when the sampler learns, from what was seen until
//! then, for a new sequence of random numbers, which are independent of those.

use crate::Film;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use rayon::prelude::*;
use scene::luminance;
use serde::{Deserialize, Serialize};

/// b before anything is known. Higher values have less noise at once where lights are seen as expected; lower values where they are not.
const FIRST_SHARE: f32 = 0.5;
/// What b is drawn to while little is known: right in most pixels.
const LIKELY_SHARE: f32 = 1.0;
/// How much of what was seen is still believed after a lesson. Higher values are steadier; lower values follow what is drawn now.
const MEMORY: f32 = 0.5;
/// Samples up to which nothing is forgotten.
const FORGETTING_FROM: f32 = 4.0;

/// What a path has brought back.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathSample {
    /// Without the control variate.
    pub(crate) radiance: Vec3,
    /// A control variate, of mean zero.
    pub(crate) control: Vec3,
}

/// The share of the control variate that a pixel takes, and what was seen of both, by luminance. The GPU keeps the same record:
/// `PixelControl` in `shaders/record/film.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Pod, Zeroable)]
#[repr(C)]
pub struct PixelControl {
    /// In \[0, 1\].
    pub share: f32,
    /// Samples seen; fewer after each lesson.
    pub count: f32,
    /// Mean of what was found without the control, scaled.
    pub mean_found: f32,
    /// Mean of the control, scaled.
    pub mean_control: f32,
    /// Sum of the squared deviations from [`PixelControl::mean_found`].
    pub found_sq: f32,
    /// Sum of the squared deviations from [`PixelControl::mean_control`].
    pub control_sq: f32,
    /// Sum of the products of both deviations.
    pub mixed: f32,
    /// What luminances are multiplied by before they are squared: a power of two, about one over the first control; 0 before there was one.
    pub scale: f32,
}

impl PixelControl {
    /// What exceeds this, scaled, teaches nothing, so that squares are finite.
    const LARGEST: f32 = 1e15;

    // twin: shaders/lib/control.wgsl new_control
    const NEW: Self = Self {
        share: FIRST_SHARE,
        count: 0.0,
        mean_found: 0.0,
        mean_control: 0.0,
        found_sq: 0.0,
        control_sq: 0.0,
        mixed: 0.0,
        scale: 0.0,
    };

    /// The sample with its share of the control; takes note of both. A sample without control, or that is not finite, teaches nothing.
    // twin: shaders/lib/control.wgsl note_control
    #[inline]
    pub(crate) fn add(&mut self, sample: &PathSample) -> Vec3 {
        let control = luminance(sample.control);
        if control == 0.0 || !control.is_finite() {
            return sample.radiance + sample.control * self.share;
        }
        if self.scale == 0.0 {
            self.scale = inverse_power_of_two(control);
        }
        let (found, control) = (luminance(sample.radiance) * self.scale, control * self.scale);
        if found.abs() < Self::LARGEST && control.abs() < Self::LARGEST {
            // Welford's update of means, variances and covariance.
            self.count += 1.0;
            let (off_found, off_control) = (found - self.mean_found, control - self.mean_control);
            self.mean_found += off_found / self.count;
            self.mean_control += off_control / self.count;
            let control_after = control - self.mean_control;
            self.found_sq += off_found * (found - self.mean_found);
            self.control_sq += off_control * control_after;
            self.mixed += off_found * control_after;
        }
        sample.radiance + sample.control * self.share
    }

    /// Works out the share for the samples to come: regression, drawn to the likely value by as much as the samples leave open.
    // twin: shaders/lib/control.wgsl learn_control
    fn learn(&mut self) {
        if self.count >= 2.0 && self.control_sq > 0.0 {
            let residual_sq = (self.found_sq - self.mixed * self.mixed / self.control_sq).max(0.0);
            // Two samples leave no residual, whatever they are: some of the whole variance stands for what they did not show.
            let noise = residual_sq / (self.count - 2.0).max(1.0) + self.found_sq / (self.count * self.count);
            let share = (noise * LIKELY_SHARE - self.mixed) / (noise + self.control_sq);
            self.share = share.clamp(0.0, 1.0);
        }
        if self.count >= FORGETTING_FROM {
            self.count *= MEMORY;
            self.found_sq *= MEMORY;
            self.control_sq *= MEMORY;
            self.mixed *= MEMORY;
        }
    }

    /// Whether it could be the outcome of frames: what was read from a file may be anything.
    fn is_sound(&self) -> bool {
        let means = [self.mean_found, self.mean_control, self.mixed];
        let squares = [self.count, self.found_sq, self.control_sq, self.scale];
        (0.0..=1.0).contains(&self.share)
            && means.iter().all(|mean| mean.is_finite())
            && squares.iter().all(|square| square.is_finite() && *square >= 0.0)
    }
}

/// One over the largest power of two that is not above `|x|`, within what `f32` holds; 0 for what is not finite.
// twin: shaders/lib/control.wgsl inverse_power_of_two
#[inline]
fn inverse_power_of_two(x: f32) -> f32 {
    const EXPONENT: u32 = 0x7f80_0000;
    // The sum of the biased exponents of both is 254.
    f32::from_bits((254_u32 << 23).saturating_sub(x.to_bits() & EXPONENT))
}

/// That of all pixels of a film, tile by tile; empty where there is no control variate.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Controls {
    tiles: Vec<Vec<PixelControl>>,
}

impl Controls {
    /// Of the pixels of `film`, of which nothing is known yet.
    pub(crate) fn new(film: &Film) -> Self {
        let of_tile = |area| vec![PixelControl::NEW; area];
        Self {
            tiles: film.tile_areas().map(of_tile).collect(),
        }
    }

    /// Without a control variate.
    pub(crate) fn none(film: &Film) -> Self {
        Self {
            tiles: vec![Vec::new(); film.tile_count()],
        }
    }

    /// By tile, in the film's order; no pixels where there is no control variate.
    pub(crate) fn tiles_mut(&mut self) -> &mut [Vec<PixelControl>] {
        &mut self.tiles
    }

    /// The sampler has learned: from now on other lights are drawn.
    pub(crate) fn learn(&mut self) {
        self.tiles.par_iter_mut().flatten().for_each(PixelControl::learn);
    }

    /// Whether it is of a film like that of `other`, and frames could have made it.
    pub(crate) fn is_sound_like(&self, other: &Self) -> bool {
        self.tiles.iter().map(Vec::len).eq(other.tiles.iter().map(Vec::len))
            && self.tiles.iter().flatten().all(PixelControl::is_sound)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sampling::Random;

    /// A pixel that has seen `count` samples with what `of` makes of a random number in \[-1, 1), and learned after each of the first and
    /// after every 8.
    fn learned(count: u32, of: impl Fn(f32, f32) -> (f32, f32)) -> PixelControl {
        let mut pixel = PixelControl::NEW;
        for sample in 0..count {
            let random = Random::new(3, 0, sample);
            let (found, control) = of(2.0 * random.f32(0) - 1.0, 2.0 * random.f32(1) - 1.0);
            pixel.add(&PathSample {
                radiance: Vec3::splat(found),
                control: Vec3::splat(control),
            });
            if sample < 4 || sample % 8 == 7 {
                pixel.learn();
            }
        }
        pixel
    }

    #[test]
    fn takes_what_helps() {
        let right = learned(64, |u, _| (3.0 - u, u));
        assert!(right.share > 0.999, "{right:?}");
        let half = learned(64, |u, v| (3.0 - 0.5 * u + 0.001 * v, u));
        assert!((half.share - 0.5).abs() < 0.01, "{half:?}");
    }

    #[test]
    fn leaves_what_harms() {
        let dark = learned(3, |u, _| (0.0, u));
        assert_eq!(dark.share, 0.0, "{dark:?}");
        let against = learned(64, |u, _| (3.0 + u, u));
        assert_eq!(against.share, 0.0, "{against:?}");
        // Independent of each other, and the control much larger.
        let foreign = learned(512, |u, v| (1.0 + 0.01 * u, v));
        assert!(foreign.share < 0.01, "{foreign:?}");
    }

    #[test]
    fn powers_of_two() {
        for (x, inverse) in [
            (1.0, 1.0),
            (-1.5, 1.0),
            (2.0, 0.5),
            (0.3, 4.0),
            (1e38, 2.0_f32.powi(-126)),
            (f32::INFINITY, 0.0),
        ] {
            assert_eq!(inverse_power_of_two(x), inverse, "{x}");
        }
        assert!(inverse_power_of_two(1e-45).is_finite());
    }

    #[test]
    fn brightness_changes_nothing() {
        let of = |scale: f32| learned(64, |u, v| (scale * (3.0 - 0.5 * u + 0.1 * v), scale * u)).share;
        for exponent in [-100, -20, 20, 100] {
            assert_eq!(of(1.0), of(2.0_f32.powi(exponent)));
        }
    }

    #[test]
    fn without_a_control_nothing_is_learned() {
        let pixel = learned(64, |u, _| (u, 0.0));
        assert_eq!(pixel.share, FIRST_SHARE);
    }

    #[test]
    fn whatever_it_meets_it_stays_sound() {
        for of in [f32::NAN, f32::INFINITY, f32::MAX, 1e14, 1e-30, 0.0, -1.0] {
            for control in [f32::NAN, f32::NEG_INFINITY, f32::MAX, -1e14, 1e-30, 0.0, 1.0] {
                let pixel = learned(40, |u, v| (of * u, control * v));
                assert!(pixel.is_sound(), "{of} {control}: {pixel:?}");
            }
        }
    }

    #[test]
    fn what_no_frame_makes_is_not_taken_over() {
        let film = Film::new(20, 7, false);
        let whole = Controls::new(&film);
        assert!(whole.is_sound_like(&Controls::new(&film)));
        assert!(!whole.is_sound_like(&Controls::none(&film)));
        assert!(!whole.is_sound_like(&Controls::new(&Film::new(20, 8, false))));
        for odd in [f32::NAN, f32::INFINITY, -1.0] {
            let mut spoiled = whole.clone();
            spoiled.tiles[1][3].found_sq = odd;
            assert!(!spoiled.is_sound_like(&whole), "{odd}");
        }
    }
}
