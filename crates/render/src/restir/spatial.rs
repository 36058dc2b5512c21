//! Neighbours that share their samples.

use super::layer::Layer;
use super::reservoir::Reservoir;
use super::site::Site;
use super::{Numbers, RestirSettings};
use std::f64::consts::TAU;

/// Puts neighbours of the pixel `at` that see surfaces like `site` into `found`: as many as were asked for at most, evenly spread over a disk.
pub(super) fn find<'f>(
    site: &Site<'f>,
    at: [u32; 2],
    fresh: &Layer,
    settings: &RestirSettings,
    numbers: &mut Numbers,
    found: &mut Vec<(Site<'f>, Reservoir)>,
) {
    found.clear();
    for _ in 0..settings.neighbors {
        let radius = f64::from(settings.radius) * numbers.f64().sqrt();
        let (sin, cos) = (TAU * numbers.f64()).sin_cos();
        let [x, y] = [(at[0], cos), (at[1], sin)].map(|(at, along)| i64::from(at) + (radius * along).round() as i64);
        if [x, y] == at.map(i64::from) {
            continue;
        }
        let Some(pixel) = fresh.get(x, y) else { continue };
        let Some(seen) = &pixel.seen else { continue };
        let there = Site::new(site.view, fresh.eye_ws(), seen);
        if site.is_beside(&there) {
            found.push((there, pixel.reservoir));
        }
    }
}
