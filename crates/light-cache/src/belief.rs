//! What to believe of a light that was sampled and never seen.

/// Samples without a sight of a light after which it is as likely to be hidden altogether as to be seen at all.
const PATIENCE: f32 = 256.0;

/// Probability that a light can be seen at all, given that none of `samples` shadow rays arrived.
///
/// Falls with the square beyond [`PATIENCE`]: a light that reaches one pixel in a hundred must not be given up (the lights behind a
/// keyhole), and a strong hidden one that takes most of the samples must be given up within a frame.
#[inline]
pub(crate) fn chance_visible(samples: f32) -> f32 {
    let patience_used = samples / PATIENCE;
    1.0 / (1.0 + patience_used * patience_used)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rare_lights_are_kept_and_giants_given_up() {
        assert_eq!(chance_visible(0.0), 1.0);
        assert!(chance_visible(100.0) > 0.8);
        assert!(chance_visible(25_000.0) < 2e-4);
    }
}
