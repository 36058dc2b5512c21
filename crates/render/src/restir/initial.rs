//! A pixel's own candidates.

use super::Numbers;
use super::reservoir::{LightSample, Reservoir, Selection};
use super::site::{Site, target};
use crate::path::{TileLog, is_black};
use light_cache::LightSampler;

/// One of `count` lights from the tree, in proportion to what they would bring if nothing stood in the way (Bitterli et al. 2020, algorithm 3);
/// dropped if something does (their algorithm 5).
///
/// Differs: one candidate from each equal part of the tree's range.
pub(super) fn draw(site: &Site<'_>, count: u32, numbers: &mut Numbers, log: &mut TileLog<'_>) -> Reservoir {
    let none = Reservoir {
        confidence: 1.0,
        ..Reservoir::EMPTY
    };
    if is_black(&site.surface.bsdf) {
        return none;
    }
    let (scene, tree) = (site.view.scene, &site.view.direct.0);
    let vertex = site.vertex();
    let local = tree.local(scene, &vertex.point);
    let mut selection = Selection::default();
    for part in 0..count {
        let u = (u64::from(part) << 32 | u64::from(numbers.u32())) / u64::from(count);
        let point = [numbers.u32(), numbers.u32()];
        let pick = numbers.f64();
        let Some(choice) = tree.sample(&local, u as u32) else {
            continue;
        };
        let light = choice.light;
        let sample = LightSample { light, point };
        if let Some(connection) = site.connect(&vertex, sample, choice.pmf) {
            let target = target(connection.contribution(1.0));
            let density = f64::from(choice.pmf) * f64::from(count);
            selection.offer(sample, target, f64::from(target) / density, pick);
        }
    }
    let drawn = selection.finish(1.0);
    if drawn.weight > 0.0 && site.look(drawn.sample, log).max_element() > 0.0 {
        drawn
    } else {
        none
    }
}
