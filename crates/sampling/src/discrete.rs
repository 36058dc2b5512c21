//! A discrete distribution in integers: what it reports is exactly what it draws.
//!
//! Each entry owns a whole number of the 2^32 values of a 32-bit random number; the numbers total exactly 2^32. So the
//! reported probability is no approximation of the drawn one: there is no last bin to fall off, no entry that rounding
//! made unreachable, and any dynamic range of weights is safe.

/// Number of values a 32-bit random number has, and the total of all masses.
pub const TOTAL: u64 = 1 << 32;

/// Above this many guide cells, finer ones would cost more memory traffic than they save steps.
const MAX_GUIDE_BITS: u32 = 20;

/// A drawn entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Draw {
    /// Which entry.
    pub index: u32,
    /// How many of the 2^32 random numbers draw it; at least 1, and 2^32 if there is no other.
    pub mass: u64,
}

impl Draw {
    /// The probability of the draw, rounded to `f32`.
    #[inline]
    pub fn pmf(&self) -> f32 {
        pmf_of(self.mass)
    }
}

/// Probability of a mass.
#[inline]
fn pmf_of(mass: u64) -> f32 {
    mass as f32 * (1.0 / 4_294_967_296.0)
}

/// An integer-exact discrete distribution over `0..len`.
///
/// Drawing inverts the cumulative masses with a guide table (Chen and Asau, "On Generating Random Variates from an
/// Empirical Distribution", 1974): expected constant time, and monotone in the random number, so that stratified
/// numbers draw stratified entries. An alias table would be as fast and destroy the strata.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Discrete {
    /// First value of each entry. An entry of mass 0 starts where the next one does.
    start: Vec<u32>,
    /// Entry of the first value of each guide cell.
    guide: Vec<u32>,
    /// 32 - log2 of the number of guide cells.
    guide_shift: u32,
    /// The last entry of mass above 0: it ends at 2^32, which no `u32` can say.
    last: u32,
    /// Mass that every entry has whatever its weight.
    floor: u64,
}

impl Discrete {
    /// The distribution proportional to `weights`, mixed with a share `floor_mass` (0 to 1) spread evenly.
    ///
    /// Weights that are negative, infinite or NaN count as 0. If none is above 0, all entries are alike. Every entry
    /// gets at least `max(1, floor_mass / len * 2^32)` of the 2^32 units if `floor_mass` is above 0; an entry of weight
    /// above 0 gets at least 1 in any case; an entry of weight 0 gets none if `floor_mass` is 0. `None` if there are no
    /// entries, or more than 2^31.
    pub fn new(weights: &[f64], floor_mass: f64) -> Option<Self> {
        let mut new = Self {
            start: Vec::new(),
            guide: Vec::new(),
            guide_shift: 0,
            last: 0,
            floor: 0,
        };
        new.set(weights, floor_mass).then_some(new)
    }

    /// Replaces the weights, without allocating if there are as many as before. Returns `false`, and leaves the
    /// distribution as it was, where [`Discrete::new`] returns `None`.
    pub fn set(&mut self, weights: &[f64], floor_mass: f64) -> bool {
        let count = weights.len() as u64;
        if count == 0 || count > 1 << 31 {
            return false;
        }
        let floor_mass = if floor_mass > 0.0 { floor_mass.min(1.0) } else { 0.0 };
        self.floor = if floor_mass > 0.0 {
            let even = (floor_mass * TOTAL as f64 / count as f64).ceil() as u64;
            even.clamp(1, TOTAL / count)
        } else {
            0
        };
        let largest = weights
            .iter()
            .copied()
            .fold(0.0, |max: f64, w| if w < f64::INFINITY { max.max(w) } else { max });
        if largest > 0.0 {
            self.fill(weights.iter().copied(), largest, floor_mass);
        } else {
            self.fill(weights.iter().map(|_| 1.0), 1.0, floor_mass);
        }
        self.build_guide();
        true
    }

    /// Places the entries. `largest` is the largest finite weight, above 0.
    fn fill(&mut self, weights: impl Iterator<Item = f64> + Clone, largest: f64, floor_mass: f64) {
        // Relative to the largest, no sum can overflow. 1 / subnormal would be infinite.
        let scale = largest.recip().min(f64::MAX);
        // Kept above 0, so that no entry is lost to underflow.
        let relative = move |w: f64| {
            if w > 0.0 && w < f64::INFINITY {
                (w * scale).max(f64::MIN_POSITIVE)
            } else {
                0.0
            }
        };
        let mut sum = 0.0;
        let (mut count, mut positive) = (0_u64, 0_u64);
        for weight in weights.clone() {
            let weight = relative(weight);
            sum += weight;
            count += 1;
            positive += u64::from(weight > 0.0);
        }
        // Reserved units first, the rest in proportion by differences of the running sum: the total is then exact and no
        // mass is off by more than one unit, with no entry to dump a remainder on.
        let reserve = if floor_mass > 0.0 { self.floor } else { 1 };
        let reserved = if floor_mass > 0.0 { self.floor * count } else { positive };
        let unreserved = TOTAL - reserved;
        let units_per_weight = unreserved as f64 / sum;
        let (mut running, mut base) = (0.0, 0_u64);
        self.start.clear();
        self.last = 0;
        for (index, weight) in weights.enumerate() {
            let weight = relative(weight);
            let gets_reserve = floor_mass > 0.0 || weight > 0.0;
            let start = base + ((running * units_per_weight) as u64).min(unreserved);
            // Only entries of mass 0 behind the last one can start at 2^32; they are never looked at.
            self.start.push(start.min(TOTAL - 1) as u32);
            if gets_reserve {
                self.last = index as u32;
                base += reserve;
                running += weight;
            }
        }
    }

    fn build_guide(&mut self) {
        let bits = (u32::BITS - (self.start.len() as u32 - 1).leading_zeros()).clamp(1, MAX_GUIDE_BITS);
        self.guide_shift = 32 - bits;
        self.guide.clear();
        let mut entry = 0;
        for cell in 0..1_u32 << bits {
            let first = cell << self.guide_shift;
            while entry < self.last && self.start[entry as usize + 1] <= first {
                entry += 1;
            }
            self.guide.push(entry);
        }
    }

    /// The entry that owns the value `u`. Monotone: a larger `u` never draws an earlier entry.
    #[inline]
    pub fn sample(&self, u: u32) -> Draw {
        let cell = (u >> self.guide_shift) as usize;
        let mut index = self.guide[cell];
        // On average over `u` at most one step per entry and guide cell; a crowded cell is bisected.
        let mut steps = 8;
        while index < self.last && self.start[index as usize + 1] <= u {
            index += 1;
            steps -= 1;
            if steps == 0 {
                index = self.bisect(index, cell, u);
                break;
            }
        }
        Draw {
            index,
            mass: self.mass(index),
        }
    }

    /// The last entry from `low` on that starts at or before `u`, a value of guide cell `cell`.
    #[cold]
    fn bisect(&self, low: u32, cell: usize, u: u32) -> u32 {
        let high = self
            .guide
            .get(cell + 1)
            .map_or(self.last, |&entry| entry.min(self.last));
        let candidates = &self.start[low as usize..=high as usize];
        low + candidates.partition_point(|&start| start <= u) as u32 - 1
    }

    /// How many of the 2^32 random numbers draw entry `index`; 0 out of range.
    #[inline]
    pub fn mass(&self, index: u32) -> u64 {
        if index > self.last {
            return 0;
        }
        let end = if index == self.last {
            TOTAL
        } else {
            u64::from(self.start[index as usize + 1])
        };
        end - u64::from(self.start[index as usize])
    }

    /// The probability of entry `index`, rounded to `f32`; 0 out of range.
    #[inline]
    pub fn pmf(&self, index: u32) -> f32 {
        pmf_of(self.mass(index))
    }

    /// The probability that every entry is guaranteed by the floor, whatever its weight.
    pub fn floor(&self) -> f64 {
        self.floor as f64 / TOTAL as f64
    }

    /// Whether it is one that weights can have made: one that was read from a file may not be.
    pub fn is_sound(&self) -> bool {
        let count = self.start.len() as u64;
        if !(1..=1 << 31).contains(&count)
            || self.start[0] != 0
            || !self.start.is_sorted()
            || u64::from(self.last) >= count
            || self.floor > TOTAL / count
        {
            return false;
        }
        let mut again = self.clone();
        again.build_guide();
        (again.guide_shift, &again.guide) == (self.guide_shift, &self.guide)
    }

    /// Appends it to `words`, for back ends that draw elsewhere; returns where. Five words: entries, last entry of mass above 0, bits by
    /// which a number is shifted to its guide cell, where the first values of the entries begin, where the guide begins.
    pub fn pack(&self, words: &mut Vec<u32>) -> u32 {
        let at = words.len() as u32;
        let starts = at + 5;
        let guide = starts + self.start.len() as u32;
        words.extend([self.start.len() as u32, self.last, self.guide_shift, starts, guide]);
        words.extend(&self.start);
        words.extend(&self.guide);
        at
    }

    /// Number of entries; never 0.
    #[allow(clippy::len_without_is_empty, reason = "an empty distribution cannot be made")]
    pub fn len(&self) -> usize {
        self.start.len()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        (self.start.capacity() + self.guide.capacity()) * size_of::<u32>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hash::mix;
    use crate::random::Random;
    use crate::statistics::{chi_square_p, pooled_chi_square};
    use proptest::prelude::*;

    fn total(distribution: &Discrete) -> u64 {
        (0..distribution.len() as u32).map(|i| distribution.mass(i)).sum()
    }

    /// Checks the first and last value of every entry, and that zero-mass entries own none.
    fn check_inverse(distribution: &Discrete) {
        let mut first = 0_u64;
        for index in 0..distribution.len() as u32 {
            let mass = distribution.mass(index);
            if mass > 0 {
                for u in [first, first + mass / 2, first + mass - 1] {
                    assert_eq!(distribution.sample(u as u32), Draw { index, mass });
                }
            }
            first += mass;
        }
        assert_eq!(first, TOTAL);
    }

    #[test]
    fn one_entry_has_the_whole_mass() {
        for weight in [0.0, 1.0, -1.0, f64::NAN, f64::INFINITY, 1e-320, f64::MAX] {
            for floor in [0.0, 0.005, 1.0] {
                let one = Discrete::new(&[weight], floor).unwrap();
                assert_eq!(one.mass(0), TOTAL);
                assert_eq!(one.pmf(0), 1.0);
                assert_eq!(one.sample(0).pmf(), 1.0);
                assert_eq!(one.sample(u32::MAX), Draw { index: 0, mass: TOTAL });
                assert_eq!(one.mass(1), 0);
            }
        }
        assert!(Discrete::new(&[], 0.1).is_none());
    }

    #[test]
    fn weights_that_are_no_weights_count_as_zero() {
        let weights = [1.0, f64::NAN, f64::INFINITY, -3.0, 0.0, 1.0, f64::NEG_INFINITY];
        let distribution = Discrete::new(&weights, 0.0).unwrap();
        assert_eq!(distribution.mass(0), TOTAL / 2);
        assert_eq!(distribution.mass(5), TOTAL / 2);
        check_inverse(&distribution);
        let none = Discrete::new(&weights[1..5], 0.0).unwrap();
        assert!((0..4).all(|i| none.mass(i) == TOTAL / 4), "no weight left: all alike");
    }

    #[test]
    fn extreme_sums_do_not_overflow() {
        let large = Discrete::new(&[f64::MAX; 8], 0.0).unwrap();
        assert!((0..8).all(|i| large.mass(i) == TOTAL / 8));
        let small = Discrete::new(&[f64::from_bits(1); 8], 0.0).unwrap();
        assert!((0..8).all(|i| small.mass(i) == TOTAL / 8));
    }

    #[test]
    fn a_million_entries_over_thirty_decades() {
        let n = 1_000_000_u32;
        let random = Random::new(1, 2, 3);
        let weights: Vec<f64> = (0..n)
            .map(|i| 10_f64.powf(30.0 * f64::from(random.f32(i)) - 15.0))
            .collect();
        let sum: f64 = weights.iter().sum();
        for floor in [0.0, 0.005] {
            let distribution = Discrete::new(&weights, floor).unwrap();
            check_inverse(&distribution);
            let least = if floor > 0.0 { 21 } else { 1 };
            for (i, w) in weights.iter().enumerate() {
                let mass = distribution.mass(i as u32);
                assert!(mass >= least);
                let share = w / sum * (1.0 - floor) * TOTAL as f64 + floor * TOTAL as f64 / f64::from(n);
                // Off by at most: one unit for the sum, one for the rounded floor, and what a million guaranteed
                // units take from the others (2.4e-4 of their mass).
                assert!((mass as f64 - share).abs() <= 3.0 + 3e-4 * share, "{mass} {share}");
            }
        }
    }

    /// p-value of `draws` random draws against the reported masses.
    fn draws_p(distribution: &Discrete, draws: u32, seed: u64) -> f64 {
        let random = Random::new(seed, 0, 0);
        let mut counts = vec![0_u64; distribution.len()];
        for i in 0..draws {
            counts[distribution.sample(random.u32(i)).index as usize] += 1;
        }
        let expected: Vec<f64> = (0..distribution.len() as u32)
            .map(|i| distribution.mass(i) as f64 / TOTAL as f64 * f64::from(draws))
            .collect();
        let (statistic, dof) = pooled_chi_square(&counts, &expected, 5.0);
        chi_square_p(statistic, dof)
    }

    /// Each p-value is below its limit once in 40,000 seeds.
    #[test]
    fn draws_follow_the_reported_masses() {
        let limit = 1e-4 / 4.0;
        let decades: Vec<f64> = (0..100_000).map(|i| 10_f64.powi(i % 31 - 15)).collect();
        let ramp: Vec<f64> = (0..1000).map(f64::from).collect();
        assert!(draws_p(&Discrete::new(&ramp, 0.0).unwrap(), 1 << 20, 1) > limit);
        assert!(draws_p(&Discrete::new(&ramp, 0.3).unwrap(), 1 << 20, 2) > limit);
        assert!(draws_p(&Discrete::new(&decades, 0.005).unwrap(), 1 << 20, 3) > limit);
        assert!(draws_p(&Discrete::new(&[0.0; 777], 0.0).unwrap(), 1 << 20, 4) > limit);
    }

    #[test]
    fn a_floor_of_one_is_uniform() {
        let distribution = Discrete::new(&[1e9, 0.0, 1.0, 5.0], 1.0).unwrap();
        assert!((0..4).all(|i| distribution.mass(i) == TOTAL / 4));
        assert_eq!(distribution.floor(), 0.25);
    }

    #[test]
    fn crowded_guide_cells_are_searched_right() {
        // One entry takes nearly everything; 100,000 share what is left, in a few guide cells.
        let mut weights = vec![1e-12; 100_001];
        weights[50_000] = 1.0;
        check_inverse(&Discrete::new(&weights, 0.0).unwrap());
        weights.reverse();
        weights[0] = 1e6;
        check_inverse(&Discrete::new(&weights, 0.0).unwrap());
        weights.iter_mut().skip(1000).for_each(|w| *w = 0.0);
        check_inverse(&Discrete::new(&weights, 0.0).unwrap());
    }

    #[test]
    fn strata_of_the_random_number_are_strata_of_the_entries() {
        let distribution = Discrete::new(&[1.0; 64], 0.0).unwrap();
        let mut seen = [false; 64];
        for k in 0..64_u32 {
            seen[distribution.sample(k << 26 | mix(k) >> 6).index as usize] = true;
        }
        assert!(seen.into_iter().all(|s| s));
    }

    proptest! {
        #[test]
        fn masses_total_and_invert(
            weights in prop::collection::vec(prop_oneof![Just(0.0), 0.0_f64..1.0, 1e-300_f64..1e-290, 1e290_f64..1e300, Just(f64::NAN)], 1..300),
            floor in prop_oneof![Just(0.0), 0.0_f64..1.0, Just(f64::NAN), Just(2.0)],
        ) {
            let distribution = Discrete::new(&weights, floor).unwrap();
            prop_assert_eq!(total(&distribution), TOTAL);
            check_inverse(&distribution);
            let any = weights.iter().any(|&w| w > 0.0);
            for (i, &w) in weights.iter().enumerate() {
                let mass = distribution.mass(i as u32);
                prop_assert!(mass as f64 >= (distribution.floor() * TOTAL as f64));
                prop_assert!(mass >= u64::from(w > 0.0));
                if any && floor == 0.0 && (w == 0.0 || w.is_nan()) {
                    prop_assert_eq!(mass, 0);
                }
            }
        }

        #[test]
        fn monotone(weights in prop::collection::vec(0.0_f64..1.0, 1..50), a: u32, b: u32) {
            let distribution = Discrete::new(&weights, 0.0).unwrap();
            prop_assert!(distribution.sample(a.min(b)).index <= distribution.sample(a.max(b)).index);
        }

        #[test]
        fn rebuilding_is_building(a in prop::collection::vec(0.0_f64..1.0, 1..50), b in prop::collection::vec(0.0_f64..1.0, 1..50)) {
            let mut distribution = Discrete::new(&a, 0.1).unwrap();
            prop_assert!(distribution.set(&b, 0.0));
            let fresh = Discrete::new(&b, 0.0).unwrap();
            prop_assert_eq!(distribution.len(), fresh.len());
            for i in 0..=b.len() as u32 {
                prop_assert_eq!(distribution.mass(i), fresh.mass(i));
            }
            prop_assert!(!distribution.set(&[], 0.0));
            prop_assert_eq!(distribution.mass(0), fresh.mass(0));
        }
    }
}
