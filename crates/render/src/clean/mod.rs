//! A rendering as it is shown: its noise is taken away by what earlier pictures knew ([`history`]) and by what lies
//! around each pixel ([`filter`]), as in Schied et al., "Spatiotemporal Variance-Guided Filtering" (SVGF, 2017). Then edges, at
//! which every sample falls on one side or the other, are smoothed over time ([`resolve`]).
//!
//! For the eyes only: nothing that is saved or measured goes through it, except where `bench` measures what is shown.

mod filter;
mod frame;
mod history;
mod projection;
mod resolve;
mod row;

pub use projection::Projection;

pub(crate) use filter::STEPS;

use crate::Film;
use frame::Frame;
use glam::Vec3;
use history::History;
use resolve::Resolver;
use scene::Camera;
use std::time::Instant;

/// Takes the noise away from picture after picture.
#[derive(Debug, Default)]
pub struct Cleaner {
    history: History,
    resolver: Resolver,
}

/// A picture without most of its noise.
#[derive(Clone, Debug)]
pub struct Cleaned {
    /// Radiance, row 0 at the top.
    pub pixels: Vec<Vec3>,
    /// Milliseconds of taking over what earlier pictures knew.
    pub history_ms: f64,
    /// Milliseconds of filtering.
    pub filter_ms: f64,
}

impl Cleaner {
    /// The film's image, seen through `camera`, without most of its noise; as it is where the film has no auxiliary images.
    pub fn clean(&mut self, film: &Film, camera: &Camera) -> Cleaned {
        let start = Instant::now();
        let Some(mut frame) = Frame::new(film, camera) else {
            return Cleaned {
                pixels: film.image().pixels.into_iter().map(Vec3::from).collect(),
                history_ms: 0.0,
                filter_ms: 0.0,
            };
        };
        self.history.accumulate(&mut frame, camera);
        let accumulated = Instant::now();
        filter::filter(&mut frame);
        let pixels = self.resolver.resolve(&frame, camera);
        Cleaned {
            pixels,
            history_ms: (accumulated - start).as_secs_f64() * 1e3,
            filter_ms: accumulated.elapsed().as_secs_f64() * 1e3,
        }
    }

    /// Forgets what earlier pictures knew: another scene.
    pub fn forget(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests;
