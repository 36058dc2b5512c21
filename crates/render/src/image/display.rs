//! From linear radiance to what a screen shows.

use glam::{Mat3, Vec3};

/// Into the space in which AgX compresses: Rec. 709 primaries drawn inwards, so that bright saturated light runs to
/// white and not to a wrong hue.
const INSET: Mat3 = Mat3::from_cols_array(&[
    0.842_479_06,
    0.042_328_24,
    0.042_375_66,
    0.078_433_6,
    0.878_468_64,
    0.078_433_6,
    0.079_223_745,
    0.079_166_13,
    0.879_143,
]);

/// Undoes [`INSET`].
const OUTSET: Mat3 = Mat3::from_cols_array(&[
    1.196_879,
    -0.052_896_85,
    -0.052_971_635,
    -0.098_020_88,
    1.151_903_1,
    -0.098_043_45,
    -0.099_029_74,
    -0.098_961_18,
    1.151_073_7,
]);

/// The range of AgX in stops.
const MIN_STOPS: f32 = -12.473_93;
const MAX_STOPS: f32 = 4.026_069;

/// Sobotka's AgX (2022) by the polynomial of Wrensch, "Minimal AgX Implementation" (2023), with a moderate look on
/// top (power 1.15, saturation 1.2: between its base and its "punchy"). Values that are not finite or negative become 0.
pub(crate) fn tone_mapped(linear: Vec3) -> [u8; 3] {
    const LOOK_POWER: f32 = 1.15;
    const LOOK_SATURATION: f32 = 1.2;
    // `max` returns the other operand for NaN.
    let linear = linear
        .to_array()
        .map(|v| if v == f32::INFINITY { f32::MAX } else { v.max(0.0) });
    let inset = (INSET * Vec3::from(linear).min(Vec3::splat(1e30))).max(Vec3::splat(1e-10));
    let stops = inset.to_array().map(f32::log2);
    let curve = |s: f32| contrast(((s - MIN_STOPS) / (MAX_STOPS - MIN_STOPS)).clamp(0.0, 1.0));
    let shaped = Vec3::from(stops.map(curve)).max(Vec3::ZERO).powf(LOOK_POWER);
    let grey = Vec3::splat(scene::luminance(shaped));
    // What comes out is encoded for a display of gamma 2.2; sRGB's own curve follows.
    let display = (OUTSET * (grey + LOOK_SATURATION * (shaped - grey)))
        .clamp(Vec3::ZERO, Vec3::ONE)
        .powf(2.2);
    display.to_array().map(srgb8)
}

/// The sigmoid of AgX, fitted: maximum squared error 3.7e-6.
fn contrast(x: f32) -> f32 {
    let (x2, x4) = (x * x, x * x * x * x);
    15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.002_32
}

/// Encodes a linear value by IEC 61966-2-1, rounded to 8 bits; values outside \[0, 1\] are cut, NaN is 0.
pub(super) fn srgb8(linear: f32) -> u8 {
    let v = linear.clamp(0.0, 1.0);
    let encoded = if v <= 0.003_130_8 {
        12.92 * v
    } else {
        1.055 * v.powf(1.0 / 2.4) - 0.055
    };
    // A float to integer cast saturates and takes NaN to 0.
    (encoded * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_has_its_fixed_points() {
        assert_eq!([0.0, 1.0, -3.0, 7.0, f32::NAN].map(srgb8), [0, 255, 0, 255, 0]);
        // 18 % grey is 118 in sRGB (0.461 encoded), half is 188.
        assert_eq!([0.18, 0.5].map(srgb8), [118, 188]);
    }

    #[test]
    fn brighter_grey_is_never_darker_and_stays_grey() {
        let mut last = 0;
        for i in 0..200 {
            let [r, g, b] = tone_mapped(Vec3::splat((0.1 * (i as f32 - 120.0)).exp2()));
            assert!(r >= last, "step {i}: {r} after {last}");
            assert!(r.abs_diff(g) <= 1 && g.abs_diff(b) <= 1, "step {i}: {r} {g} {b}");
            last = r;
        }
        assert!(last > 250, "8 stops above 1 is white, not {last}");
        assert_eq!(tone_mapped(Vec3::ZERO), [0; 3]);
    }

    #[test]
    fn mid_grey_stays_near_mid_grey() {
        let [r, ..] = tone_mapped(Vec3::splat(0.18));
        assert!((85..=135).contains(&r), "{r}");
    }

    #[test]
    fn unfit_values_make_valid_pixels() {
        assert_eq!(tone_mapped(Vec3::splat(f32::NAN)), [0; 3]);
        assert!(tone_mapped(Vec3::splat(f32::INFINITY)).iter().all(|v| *v > 250));
        assert_eq!(tone_mapped(Vec3::splat(-1.0)), [0; 3]);
    }

    #[test]
    fn bright_colours_keep_their_order() {
        let [r, g, b] = tone_mapped(Vec3::new(4.0, 0.5, 0.1));
        assert!(r > g && g > b, "{r} {g} {b}");
    }
}
