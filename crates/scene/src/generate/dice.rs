//! Arithmetic whose bits are the same on every machine: random choices, and the few transcendental functions that
//! generated geometry needs. The standard library's `sin` and `exp` may differ between platforms; +, -, *, / and square
//! roots may not.

use std::f64::consts::{FRAC_PI_2, LN_10};

/// A stream of random numbers that depends on nothing but its keys.
#[derive(Clone, Debug)]
pub(super) struct Dice {
    key: u32,
    count: u32,
}

impl Dice {
    /// The stream named by `keys`: (seed, what for, which one).
    pub(super) fn new(keys: &[u32]) -> Self {
        let key = keys
            .iter()
            .fold(0x9e37_79b9, |key, &k| mix(key ^ mix(k.wrapping_add(0x85eb_ca6b))));
        Self { key, count: 0 }
    }

    fn bits(&mut self) -> u32 {
        self.count = self.count.wrapping_add(1);
        mix(self.key ^ mix(self.count))
    }

    /// Uniform in \[0, 1).
    pub(super) fn unit(&mut self) -> f32 {
        (self.bits() >> 8) as f32 / (1u32 << 24) as f32
    }

    /// Uniform in \[low, high).
    pub(super) fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// Uniform in 0..n.
    pub(super) fn below(&mut self, n: usize) -> usize {
        ((u64::from(self.bits()) * n as u64) >> 32) as usize
    }

    /// True with this probability.
    pub(super) fn chance(&mut self, probability: f32) -> bool {
        self.unit() < probability
    }

    /// One of `items`, which is not empty.
    pub(super) fn pick<T: Copy>(&mut self, items: &[T]) -> T {
        items[self.below(items.len())]
    }
}

/// A bijection of 32-bit numbers with full avalanche (the multiply-xorshift form of Wellons' hash prospector).
fn mix(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x21f0_aaad);
    x ^= x >> 15;
    x = x.wrapping_mul(0xd35a_2d97);
    x ^ (x >> 15)
}

/// Sine and cosine of `turns` whole turns, by Taylor series on an eighth of a turn.
pub(super) fn sin_cos(turns: f32) -> (f32, f32) {
    let quarters = f64::from(turns) * 4.0;
    let nearest = quarters.round();
    let x = (quarters - nearest) * FRAC_PI_2;
    let sq = x * x;
    let sin = x * (1.0 - sq / 6.0 * (1.0 - sq / 20.0 * (1.0 - sq / 42.0 * (1.0 - sq / 72.0))));
    let cos = 1.0 - sq / 2.0 * (1.0 - sq / 12.0 * (1.0 - sq / 30.0 * (1.0 - sq / 56.0 * (1.0 - sq / 90.0))));
    let (sin, cos) = match (nearest as i64).rem_euclid(4) {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    };
    (sin as f32, cos as f32)
}

/// 10 to the power `x`, for |x| up to about 10.
pub(super) fn exp10(x: f32) -> f32 {
    // exp(y) = exp(y / 64)^64; the series on |y| < 0.4 is exact to f32.
    let y = f64::from(x) * LN_10 / 64.0;
    let mut power = 1.0 + y * (1.0 + y / 2.0 * (1.0 + y / 3.0 * (1.0 + y / 4.0 * (1.0 + y / 5.0 * (1.0 + y / 6.0)))));
    for _ in 0..6 {
        power *= power;
    }
    power as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_agree_with_the_standard_library() {
        for i in -400..400 {
            let turns = i as f32 / 173.0;
            let (sin, cos) = sin_cos(turns);
            let angle = f64::from(turns) * std::f64::consts::TAU;
            assert!((f64::from(sin) - angle.sin()).abs() < 1e-6);
            assert!((f64::from(cos) - angle.cos()).abs() < 1e-6);
            let x = i as f32 / 100.0;
            assert!((exp10(x) / 10f32.powf(x) - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn streams_are_uniform_and_differ_by_key() {
        let mut a = Dice::new(&[1, 2]);
        let mut b = Dice::new(&[2, 1]);
        let mean = (0..4096).map(|_| a.unit()).sum::<f32>() / 4096.0;
        assert!((mean - 0.5).abs() < 0.02);
        assert!((0..16).any(|_| a.unit() != b.unit()));
        assert!((0..1000).all(|_| b.below(7) < 7));
    }
}
