//! Integer arithmetic of a descent: the random number is a position in an interval, and every choice cuts the interval.
//!
//! A descent that rescales one `f32` runs out of bits after 24 levels and reports a product of ratios that is not what
//! was drawn. Here the width of the interval that is left *is* the probability, so what is drawn and what is reported
//! agree by construction, and a larger `u` never leads to an earlier light.

/// Width of the whole interval, which stands for probability 1.
pub(crate) const UNIT: u64 = 1 << 63;

/// One unit of a 32-bit random number, in units of [`UNIT`].
pub(crate) const PER_U32: u64 = UNIT >> 32;

/// The probability that a width stands for.
#[inline]
pub(crate) fn probability(width: u64) -> f32 {
    width as f32 * (1.0 / UNIT as f32)
}

/// Where `u` lies in the unit interval. `salt` fills the bits below the 32 of `u`, so that choices rarer than 2^-32
/// happen as often as they should.
#[inline]
pub(crate) fn position(u: u32, salt: u32) -> u64 {
    (u64::from(u) << 31) | u64::from(sampling::hash::hash2(u, salt) >> 1)
}

/// The part of `width` that goes to the first of two choices of the given weights: at least 0, finite. A choice of positive
/// weight gets a part of at least 1 as long as `width` >= 2; two zeros count as equal.
#[inline]
pub(crate) fn split(width: u64, first: f32, second: f32) -> u64 {
    split_among(width, first, second, [1, 1])
}

/// [`split`] where the choices lead on to `counts` lights each: one of positive weight gets a part of at least its count as long as `width`
/// is at least the sum of both, so that after any number of lopsided choices every light still has a part.
#[inline]
pub(crate) fn split_among(width: u64, first: f32, second: f32, counts: [u32; 2]) -> u64 {
    let smaller = first.min(second);
    if smaller <= 0.0 {
        return if first > 0.0 {
            width
        } else if second > 0.0 {
            0
        } else {
            width / 2
        };
    }
    // The smaller ratio keeps its full f32 precision; the larger takes what is left.
    // At most 2^31; by way of i64, which costs fewer instructions.
    let ratio = (smaller / (first + second) * 4_294_967_296.0) as i64 as u64;
    let part = ((u128::from(width) * u128::from(ratio)) >> 32) as u64;
    let [least, least_other] = if first <= second {
        counts
    } else {
        [counts[1], counts[0]]
    };
    let part = part.max(least.into()).min(width.saturating_sub(least_other.into()));
    if first <= second { part } else { width - part }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_positive_and_near_the_ratio() {
        for (a, b) in [(1.0, 1.0), (1e-30, 1.0), (1.0, 1e-30), (3.0, 1.0), (1e20, 1e-20)] {
            let part = split(UNIT, a, b);
            assert!(part > 0 && part < UNIT);
            let expected = f64::from(a) / (f64::from(a) + f64::from(b));
            let got = part as f64 / UNIT as f64;
            assert!((got - expected).abs() < 1e-6, "{a} {b}: {got} {expected}");
        }
    }

    #[test]
    fn lopsided_choices_leave_a_part_for_every_light() {
        // Sixteen lights, each 1e-30 of the one before: a chain of choices between one light and all that are left.
        let mut width = 16;
        for left in (1..16).rev() {
            let part = split_among(width, 1.0, 1e-30, [1, left]);
            assert_eq!((part, width - part), (1, u64::from(left)));
            width -= part;
        }
        assert_eq!(split_among(UNIT, 1e-30, 1.0, [1000, 1]), 1000);
    }

    #[test]
    fn zero_weight_gets_nothing_and_two_zeros_share() {
        assert_eq!(split(1000, 0.0, 2.0), 0);
        assert_eq!(split(1000, 2.0, 0.0), 1000);
        assert_eq!(split(1000, 0.0, 0.0), 500);
    }

    #[test]
    fn a_width_of_two_still_serves_both() {
        assert_eq!(split(2, 1e-30, 1.0), 1);
        assert_eq!(split(2, 1.0, 1e-30), 1);
    }
}
