//! What the bounces of a path find, for samplers that learn where to send later ones.

use glam::Vec3;
use light_cache::{Bounce, Observation};
use sampling::guide::part_of;
use scene::luminance;

/// Bounces of a path that are learned from; later ones bring little.
const MOST: usize = 8;

/// The bounces of one path, whose outcome is known when it is over.
#[derive(Default)]
pub(crate) struct Bounces {
    open: [Open; MOST],
    count: usize,
}

/// A bounce on its way.
#[derive(Clone, Copy, Default)]
struct Open {
    /// The observation that was made where it began: its place in the log.
    observation: u32,
    /// The direction.
    part: u16,
    /// Luminance of what the path had found before.
    before: f32,
    /// Luminance of what the path is worth from then on.
    throughput: f32,
}

impl Bounces {
    /// The path has left the point of that observation with `throughput` along `wi_ws`, having found `radiance` so far.
    #[inline]
    pub(crate) fn begin(&mut self, observation: usize, normal_ws: Vec3, wi_ws: Vec3, radiance: Vec3, throughput: Vec3) {
        if let Some(open) = self.open.get_mut(self.count) {
            *open = Open {
                observation: observation as u32,
                part: part_of(normal_ws, wi_ws) as u16,
                before: luminance(radiance),
                throughput: luminance(throughput),
            };
            self.count += 1;
        }
    }

    /// The path is over and has found `radiance` in all.
    #[inline]
    pub(crate) fn end(&self, radiance: Vec3, observations: &mut [Observation]) {
        let all = luminance(radiance);
        for open in &self.open[..self.count] {
            // Rounding can take away more than was found before.
            let found = (all - open.before).max(0.0) / open.throughput;
            if found.is_finite() {
                observations[open.observation as usize].bounce = Some(Bounce {
                    part: open.part,
                    radiance: found,
                });
            }
        }
    }
}
