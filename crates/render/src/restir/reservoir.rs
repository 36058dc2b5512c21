//! One light sample that stands for many.

/// A light, and the numbers that choose the point on it: see [`scene::Scene::sample_light`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LightSample {
    pub(super) light: u32,
    pub(super) point: [u32; 2],
}

/// A sample that was kept of several.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reservoir {
    pub(super) sample: LightSample,
    /// Luminance of what the sample brings to the surface of its pixel, visibility included.
    pub(super) target: f32,
    /// Stands in for one over the sample's density ("unbiased contribution weight", Lin et al. 2022): its product with any function
    /// that is zero where the target is has the integral of that function as its mean. 0: no sample.
    pub(super) weight: f32,
    /// Frames' worth of candidates that it counts as. Does not depend on which lights were drawn.
    pub(super) confidence: f32,
}

impl Reservoir {
    /// Without a sample.
    pub(super) const EMPTY: Self = Self {
        sample: LightSample {
            light: u32::MAX,
            point: [0; 2],
        },
        target: 0.0,
        weight: 0.0,
        confidence: 0.0,
    };

    /// Its light, if it has a sample.
    pub(super) fn light(&self) -> Option<u32> {
        (self.weight > 0.0).then_some(self.sample.light)
    }
}

/// Keeps one of the samples that it is offered, in proportion to their weights (Bitterli et al. 2020, algorithm 2).
#[derive(Default)]
pub(super) struct Selection {
    /// Sum of the weights.
    total: f64,
    kept: Option<(LightSample, f32)>,
}

impl Selection {
    /// Offers a sample with its target; `u` is in (0, 1). What is not finite is left out.
    #[inline]
    pub(super) fn offer(&mut self, sample: LightSample, target: f32, weight: f64, u: f64) {
        if weight > 0.0 && weight < f64::INFINITY {
            self.total += weight;
            if u * self.total < weight {
                self.kept = Some((sample, target));
            }
        }
    }

    /// The one that was kept.
    pub(super) fn finish(self, confidence: f32) -> Reservoir {
        let empty = Reservoir {
            confidence,
            ..Reservoir::EMPTY
        };
        let Some((sample, target)) = self.kept else {
            return empty;
        };
        let weight = (self.total / f64::from(target)) as f32;
        if weight == f32::INFINITY {
            return empty;
        }
        Reservoir {
            sample,
            target,
            weight,
            ..empty
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sampling::{Random, unit_f64};

    /// The mean of (1 if light i was kept) x target x weight is the weight that light i was offered with: within 5 standard errors, which
    /// chance exceeds once in 300,000 lights.
    #[test]
    fn what_is_kept_stands_for_all() {
        let offered: [(f32, f64); 6] = [
            (1.0, 0.5),
            (0.01, 2.0),
            (30.0, 0.0),
            (5.0, 1e-3),
            (2.0, f64::INFINITY),
            (7.0, 4.0),
        ];
        const ROUNDS: u32 = 100_000;
        let mut sums = [0.0; 6];
        for round in 0..ROUNDS {
            let random = Random::new(5, 0, round);
            let mut selection = Selection::default();
            for (light, (target, weight)) in (0..).zip(offered) {
                let sample = LightSample { light, point: [0; 2] };
                selection.offer(sample, target, weight, unit_f64(random.u32(light)));
            }
            let kept = selection.finish(3.0);
            assert_eq!(kept.confidence, 3.0);
            sums[kept.sample.light as usize] += f64::from(kept.target * kept.weight);
        }
        let total = 6.501;
        for ((_, weight), sum) in offered.into_iter().zip(sums) {
            let expected = if weight.is_finite() { weight } else { 0.0 };
            let share = expected / total;
            let error = total * (share * (1.0 - share) / f64::from(ROUNDS)).sqrt();
            assert!(
                (sum / f64::from(ROUNDS) - expected).abs() <= 5.0 * error + 1e-6 * expected,
                "{sum} {expected}"
            );
        }
    }

    #[test]
    fn nothing_is_kept_of_nothing() {
        let none = Selection::default().finish(1.0);
        assert_eq!((none.light(), none.weight, none.confidence), (None, 0.0, 1.0));
        let mut overflowing = Selection::default();
        overflowing.offer(Reservoir::EMPTY.sample, 1e-30, 1e30, 0.5);
        assert_eq!(overflowing.finish(1.0).light(), None);
    }
}
