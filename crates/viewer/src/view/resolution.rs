//! How many pixels to render while the picture moves, so that a frame takes the time chosen for it.

/// Least share of the window's width and height. Lower values keep the pace on slower machines; higher values stay legible.
const COARSEST: f32 = 1.0 / 16.0;
/// The size changes only if it is off by more than this factor: flicker between two sizes is worse than either.
const SLACK: f32 = 1.2;
/// Weight of the newest frame in the mean cost of a pixel. Higher values follow faster; lower values shrug off hitches.
const NEWEST: f64 = 0.3;
/// Sizes are multiples of this many pixels, in which rays are traced together.
const STEP: u32 = 8;

/// Keeps the frame time while the picture moves.
#[derive(Clone, Debug)]
pub(super) struct Resolution {
    /// Milliseconds that a frame should take.
    budget_ms: f64,
    /// Milliseconds that a pixel has cost lately; `None` before the first frame.
    cost_ms: Option<f64>,
    /// Share of the window's width and height.
    scale: f32,
}

impl Resolution {
    /// Begins coarse, so that the first picture is there at once.
    pub(super) fn new(budget_ms: f64) -> Self {
        Self {
            budget_ms,
            cost_ms: None,
            scale: 0.125,
        }
    }

    /// Another frame time to keep.
    pub(super) fn set_budget(&mut self, budget_ms: f64) {
        self.budget_ms = budget_ms;
    }

    /// A frame of so many pixels has taken `frame_ms`.
    pub(super) fn measured(&mut self, pixels: u64, frame_ms: f64) {
        if pixels == 0 || !frame_ms.is_finite() || frame_ms <= 0.0 {
            return;
        }
        let cost = frame_ms / pixels as f64;
        self.cost_ms = Some(self.cost_ms.map_or(cost, |mean| mean + NEWEST * (cost - mean)));
    }

    /// What was measured no longer holds: another scene, another sampler.
    pub(super) fn forget(&mut self) {
        *self = Self::new(self.budget_ms);
    }

    /// The size in which a moving picture of a window of `window` pixels should be rendered now.
    pub(super) fn moving_size(&mut self, window: (u32, u32)) -> (u32, u32) {
        let pixels = f64::from(window.0) * f64::from(window.1);
        if let Some(cost_ms) = self.cost_ms {
            let affordable = (self.budget_ms / cost_ms / pixels.max(1.0)).sqrt() as f32;
            let wanted = affordable.clamp(COARSEST, 1.0);
            // The whole window is wanted even if it is only a little more.
            if wanted > self.scale * SLACK || wanted < self.scale / SLACK || wanted == 1.0 {
                self.scale = wanted;
            }
        }
        let side = |full: u32| {
            let scaled = (full as f32 * self.scale).round() as u32;
            (scaled.next_multiple_of(STEP)).clamp(1, full.max(1))
        };
        (side(window.0), side(window.1))
    }

    /// How many frames of `pixels` pixels fit into the frame time; at least one.
    pub(super) fn frames_in_budget(&self, pixels: u64) -> u32 {
        let cost = self.cost_ms.map_or(f64::INFINITY, |cost| cost * pixels as f64);
        (self.budget_ms / cost).clamp(1.0, 64.0) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDOW: (u32, u32) = (1280, 720);

    /// Renders `frames` frames on a machine of `pixels_per_ms`; the time that the last one took, and its size.
    fn settle(resolution: &mut Resolution, pixels_per_ms: f64, frames: usize) -> (f64, (u32, u32)) {
        let mut last = (0.0, (0, 0));
        for _ in 0..frames {
            let size = resolution.moving_size(WINDOW);
            let pixels = u64::from(size.0) * u64::from(size.1);
            let frame_ms = pixels as f64 / pixels_per_ms;
            resolution.measured(pixels, frame_ms);
            last = (frame_ms, size);
        }
        last
    }

    #[test]
    fn the_frame_time_is_kept_on_slow_and_fast_machines() {
        for pixels_per_ms in [500.0, 2_000.0, 8_000.0] {
            let (frame_ms, size) = settle(&mut Resolution::new(30.0), pixels_per_ms, 20);
            assert!(
                (15.0..=45.0).contains(&frame_ms),
                "{pixels_per_ms}: {frame_ms} ms at {size:?}"
            );
        }
    }

    #[test]
    fn a_fast_machine_renders_every_pixel_and_several_samples() {
        let mut resolution = Resolution::new(30.0);
        let (_, size) = settle(&mut resolution, 1e6, 20);
        assert_eq!(size, WINDOW);
        let frames = resolution.frames_in_budget(u64::from(WINDOW.0) * u64::from(WINDOW.1));
        assert!((20..=40).contains(&frames), "{frames}");
    }

    #[test]
    fn a_machine_that_slows_down_is_followed_and_noise_is_not() {
        let mut resolution = Resolution::new(30.0);
        let (_, fast) = settle(&mut resolution, 8_000.0, 20);
        let (frame_ms, slow) = settle(&mut resolution, 1_000.0, 20);
        assert!(slow.0 < fast.0 && frame_ms < 45.0, "{fast:?} {slow:?} {frame_ms}");
        for factor in [0.95, 1.05, 1.0, 0.97, 1.04] {
            assert_eq!(settle(&mut resolution, 1_000.0 * factor, 3).1, slow);
        }
    }

    #[test]
    fn odd_windows_and_measurements_make_valid_sizes() {
        let mut resolution = Resolution::new(30.0);
        for window in [(0, 0), (1, 1), (3, 5000), (7, 7)] {
            let (width, height) = resolution.moving_size(window);
            assert!(width >= 1 && height >= 1 && width <= window.0.max(1) && height <= window.1.max(1));
        }
        resolution.measured(0, 10.0);
        resolution.measured(100, f64::NAN);
        resolution.measured(100, 0.0);
        assert!(resolution.cost_ms.is_none());
        settle(&mut resolution, 1e-3, 5);
        let (width, height) = resolution.moving_size(WINDOW);
        assert_eq!((width, height), (80, 48), "the coarsest, however slow");
    }
}
