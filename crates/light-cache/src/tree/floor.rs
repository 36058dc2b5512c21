//! The guaranteed minimum: the first random numbers belong to all lights alike.

use super::{PER_U32, UNIT};
use sampling::discrete::TOTAL;

/// An equal number of the 2^32 random numbers for every light, in one contiguous range at the low end, so that the
/// strata of the others stay whole.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Floor {
    /// Random numbers per light.
    units: u32,
    /// Random numbers in all.
    total: u32,
}

impl Floor {
    /// A share `mass` of all random numbers for `count` lights; at least one for each if `mass` is above 0.
    pub(crate) fn new(mass: f32, count: usize) -> Self {
        let count = (count as u64).max(1);
        let units = if mass > 0.0 {
            let even = f64::from(mass.min(1.0)) * TOTAL as f64 / count as f64;
            // Something is always left to the rest.
            (even.ceil() as u64).clamp(1, ((TOTAL - 1) / count).max(1))
        } else {
            0
        };
        Self {
            units: units as u32,
            total: (units * count) as u32,
        }
    }

    /// The light that `u` draws from the floor, if it does.
    #[inline]
    pub(crate) fn draw(&self, u: u32) -> Option<u32> {
        (u < self.total).then(|| u / self.units)
    }

    /// Width of the interval, out of [`UNIT`], that belongs to the rest: it begins after the floor.
    #[inline]
    pub(crate) fn rest(&self) -> u64 {
        UNIT - self.start_of_rest()
    }

    /// Where the rest begins.
    #[inline]
    pub(crate) fn start_of_rest(&self) -> u64 {
        u64::from(self.total) * PER_U32
    }

    /// A light's width in the floor.
    #[inline]
    pub(crate) fn width(&self) -> u64 {
        u64::from(self.units) * PER_U32
    }

    /// The probability that every light has.
    pub(crate) fn probability(&self) -> f64 {
        f64::from(self.units) / TOTAL as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_light_owns_the_same_numbers() {
        for count in [1, 3, 1000, 1_000_000] {
            let floor = Floor::new(0.005, count);
            assert!(floor.probability() * count as f64 >= f64::from(0.005_f32));
            assert_eq!(floor.draw(0), Some(0));
            assert_eq!(floor.draw(floor.total - 1), Some(count as u32 - 1));
            assert_eq!(floor.draw(floor.total), None);
            assert_eq!(floor.rest() + floor.width() * count as u64, UNIT);
        }
    }

    #[test]
    fn the_extremes_are_none_and_nearly_all() {
        assert_eq!(Floor::new(0.0, 5).draw(0), None);
        assert_eq!(Floor::new(0.0, 5).rest(), UNIT);
        assert!(Floor::new(1.0, 5).rest() > 0);
    }
}
