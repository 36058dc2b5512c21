//! What to believe of a light that was sampled and never seen.

/// Probability that a light can be seen at all, given that none of `samples` shadow rays arrived: hidden and
/// visible are equally likely at first, and if it is visible, then all visible shares are alike, so that `samples` misses in
/// a row have probability 1 / (1 + samples). A quarter of that haste, since samples near each other repeat themselves.
#[inline]
pub(crate) fn chance_visible(samples: f32) -> f32 {
    1.0 / (1.0 + 0.25 * samples)
}
