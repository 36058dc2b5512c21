//! Joining reservoirs: a pixel's own with those of other surfaces.

use super::Numbers;
use super::reservoir::{Reservoir, Selection};
use super::site::{Site, target};
use crate::path::TileLog;
use glam::Vec3;

/// What came of joining.
pub(super) struct Joined {
    /// The sample that was kept.
    pub(super) reservoir: Reservoir,
    /// An estimate of the direct light at the surface, by all samples.
    pub(super) radiance: Vec3,
}

/// Joins the reservoir `own` of `site` with those of `others`.
///
/// Pairwise weights (Bitterli 2022, "Correlations and Reuse for Fast and Accurate Physically Based Light Transport", section 9.1.3; Lin et al.
/// 2022): each of the others shares with the surface's own alone, for which both samples are
/// weighed at both surfaces, visibility included. The weights of a sample that the own surface can have make up 1.
pub(super) fn join(
    site: &Site<'_>,
    own: &Reservoir,
    others: &[(Site<'_>, Reservoir)],
    numbers: &mut Numbers,
    log: &mut TileLog<'_>,
) -> Joined {
    let brought = site.recall(own);
    let trust = f64::from(own.confidence);
    let others_trust: f64 = others.iter().map(|(_, other)| f64::from(other.confidence)).sum();
    let share = Shares {
        own: trust,
        others: others_trust,
    };
    let mut selection = Selection::default();
    let mut radiance = Vec3::ZERO;
    // What the weight of the own sample leaves for the others.
    let mut given_away = 0.0;
    for (there, other) in others {
        let part = f64::from(other.confidence) / others_trust;
        if own.weight > 0.0 {
            let seen_there = target(there.look(own.sample, log));
            given_away += part * share.of_other(seen_there, own.target);
        }
        if other.weight > 0.0 {
            let found = site.look(other.sample, log);
            let seen_here = target(found);
            let mis = part * share.of_other(other.target, seen_here);
            let weight = mis * f64::from(other.weight);
            selection.offer(other.sample, seen_here, weight * f64::from(seen_here), numbers.f64());
            radiance += found * weight as f32;
        }
    }
    if own.weight > 0.0 {
        let weight = (1.0 - given_away) * f64::from(own.weight);
        selection.offer(own.sample, own.target, weight * f64::from(own.target), numbers.f64());
        radiance += brought * weight as f32;
    }
    Joined {
        reservoir: selection.finish((trust + others_trust) as f32),
        radiance,
    }
}

/// How the own surface and one of the others share a sample; the confidence of all others stands behind that one.
#[derive(Clone, Copy)]
struct Shares {
    own: f64,
    others: f64,
}

impl Shares {
    /// The other's part of a sample with target `there` at the other surface and `here` at the own.
    #[inline]
    fn of_other(self, there: f32, here: f32) -> f64 {
        let (there, here) = (self.others * f64::from(there), self.own * f64::from(here));
        if there > 0.0 { there / (there + here) } else { 0.0 }
    }
}
