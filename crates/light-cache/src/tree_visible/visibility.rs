//! How much of each light reaches the image, learned from shadow rays.

use crate::Observation;
use crate::belief::chance_visible;
use crate::state::is_amount;
use crate::tree::{LEAF, Tree};
use scene::Light;

/// Pseudo-samples of the prior. Higher values believe neighbours longer; lower values believe few shadow rays.
const PRIOR_SAMPLES: f32 = 2.0;
/// Visible share of the whole scene before anything is known.
const ROOT_VISIBLE: f32 = 0.5;
/// What one light can tell about its neighbours, in samples: a light that takes all samples must not speak for all.
const MAX_SAMPLES_OF_LIGHT: f32 = 8.0;
/// What one group of lights can tell about the groups around it.
const MAX_SAMPLES_OF_GROUP: f32 = 64.0;
/// Samples of a light after which the older half is forgotten, so that changes are followed.
const MEMORY: f32 = 65_536.0;
/// A contribution above this many times the light's mean counts as that many.
const SPIKE: f32 = 4.0;
/// Least prior: evidence of a group is also evidence of the groups around it, and to count it at every level would make a dark corner
/// of the tree darker with every level. Higher values keep lights that are rarely visible; lower values spend less on
/// hidden ones.
const MIN_PRIOR: f32 = 0.001;
/// The same where the tree is only the prior of something that learns more: it must not give a light up.
const CAUTIOUS_MIN_PRIOR: f32 = 0.01;
/// A light adds its strength times its factor to this power to the groups it is in. The factor is the root of the visible share, best
/// where lights are told apart; for groups, whose choice below is imperfect, the share itself (2) is better where most
/// lights are hidden and worse where most are visible. Measured between: 1, 1.5, 2.
const GROUP_EXPONENT: f32 = 1.5;
/// No share is believed to be smaller: keeps sums over a tree within the range of `f32`.
const MIN_VISIBLE: f32 = 1e-9;

/// Share of the samples that goes to lights which have never been seen to arrive. Higher values find them sooner; lower values
/// spend less on lights that are hidden.
const LEAST_UNSEEN: f32 = 0.05;

/// Evidence about a light or a group: shadow rays, and how many arrived, each weighted by the energy at stake.
#[derive(Clone, Copy, Debug, Default, serde::Serialize, serde::Deserialize)]
struct Evidence {
    samples: f32,
    visible: f32,
}

impl Evidence {
    fn share(self, prior: f32) -> f32 {
        (self.visible + PRIOR_SAMPLES * prior) / (self.samples + PRIOR_SAMPLES)
    }

    fn at_most(self, samples: f32) -> Self {
        let scale = if self.samples > samples {
            samples / self.samples
        } else {
            1.0
        };
        Self {
            samples: self.samples * scale,
            visible: self.visible * scale,
        }
    }

    fn plus(self, other: Self) -> Self {
        Self {
            samples: self.samples + other.samples,
            visible: self.visible + other.visible,
        }
    }
}

/// What is known of one light.
#[derive(Clone, Copy, Debug, Default, serde::Serialize, serde::Deserialize)]
struct Seen {
    evidence: Evidence,
    /// Running mean of the unshadowed contribution, by which each observation is measured.
    mean: f32,
    /// Shadow rays in all.
    rays: u32,
    arrived: u32,
}

/// Visible shares of all lights and of all groups of a tree.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct Visibility {
    /// In tree order.
    seen: Vec<Seen>,
    /// Strengths without visibility, in tree order.
    strengths: Vec<f32>,
    /// Per node: evidence, then the believed share.
    groups: Vec<(Evidence, f32)>,
    min_prior: f32,
    /// See [`GROUP_EXPONENT`].
    group_exponent: f32,
}

impl Visibility {
    /// Nothing is known yet about the lights of `tree`. `cautious`: no light is given up soon.
    pub(super) fn new(tree: &Tree, cautious: bool) -> Self {
        let strengths = tree.leaves.iter().map(|leaf| leaf.weight);
        Self {
            seen: vec![Seen::default(); tree.len()],
            strengths: strengths.chain(tree.distant.iter().map(|light| light.weight)).collect(),
            groups: vec![(Evidence::default(), ROOT_VISIBLE); tree.nodes.len()],
            min_prior: if cautious { CAUTIOUS_MIN_PRIOR } else { MIN_PRIOR },
            group_exponent: if cautious { 1.0 } else { GROUP_EXPONENT },
        }
    }

    /// Takes note of a shadow ray towards the light at `place` in tree order.
    pub(super) fn observe(&mut self, place: u32, observation: &Observation) {
        let seen = &mut self.seen[place as usize];
        let times = observation.weight;
        seen.rays = seen.rays.saturating_add(times);
        if observation.visible {
            seen.arrived = seen.arrived.saturating_add(times);
        }
        if seen.evidence.samples > MEMORY {
            seen.evidence = seen.evidence.at_most(0.5 * MEMORY);
        }
        let energy = if seen.mean > 0.0 {
            (observation.unshadowed / seen.mean).min(SPIKE)
        } else {
            1.0
        };
        // The mean itself is robust too: spikes count as SPIKE times what it was.
        let rate = (times as f32 / seen.rays.min(1024) as f32).min(1.0);
        let clamped = if seen.mean > 0.0 {
            observation.unshadowed.min(SPIKE * seen.mean)
        } else {
            observation.unshadowed
        };
        seen.mean += (clamped - seen.mean) * rate;
        seen.evidence.samples += times as f32 * energy;
        if observation.visible {
            seen.evidence.visible += times as f32 * energy;
        }
    }

    /// Puts the lights that have been seen to arrive into a subtree of their own.
    pub(super) fn regroup(&mut self, tree: &mut Tree, lights: &[Light]) {
        let arrived: Vec<bool> = self.seen[..tree.leaves.len()]
            .iter()
            .map(|seen| seen.evidence.visible > 0.0)
            .collect();
        let regrouped = tree.regrouped(lights, &self.strengths, &arrived, LEAST_UNSEEN);
        let (seen, strengths) = (self.seen.clone(), self.strengths.clone());
        for (&old, &new) in tree.rank.iter().zip(&regrouped.rank) {
            self.seen[new as usize] = seen[old as usize];
            self.strengths[new as usize] = strengths[old as usize];
        }
        self.groups = vec![(Evidence::default(), ROOT_VISIBLE); regrouped.nodes.len()];
        *tree = regrouped;
    }

    /// Weighs the tree by what is known.
    pub(super) fn apply(&mut self, tree: &mut Tree) {
        // Bottom up: children come after their parents.
        for index in (0..tree.nodes.len()).rev() {
            let node = &tree.nodes[index];
            let evidence = if node.child == LEAF {
                let range = node.first as usize..(node.first + node.count) as usize;
                let lights = self.seen[range]
                    .iter()
                    .map(|seen| seen.evidence.at_most(MAX_SAMPLES_OF_LIGHT));
                lights.fold(Evidence::default(), Evidence::plus)
            } else {
                let child = |i: u32| self.groups[(node.child + i) as usize].0;
                child(0).plus(child(1))
            };
            self.groups[index].0 = evidence.at_most(MAX_SAMPLES_OF_GROUP);
        }
        // Top down: each group's share, with its parent's as the prior.
        let min_prior = self.min_prior;
        if let Some(root) = self.groups.first_mut() {
            root.1 = root.0.share(ROOT_VISIBLE);
        }
        for (index, node) in tree.nodes.iter().enumerate() {
            if node.child != LEAF {
                let prior = self.groups[index].1;
                for child in &mut self.groups[node.child as usize..][..2] {
                    child.1 = child.0.share(prior.max(min_prior));
                }
            }
        }
        let Self {
            seen,
            strengths,
            groups,
            group_exponent,
            ..
        } = self;
        // Bottom up again: the lights, then the sums.
        for index in (0..tree.nodes.len()).rev() {
            let node = tree.nodes[index];
            tree.nodes[index].weight = if node.child == LEAF {
                let prior = groups[index].1;
                (node.first as usize..(node.first + node.count) as usize)
                    .map(|place| {
                        let factor = light_factor(&seen[place], prior.max(min_prior));
                        tree.leaves[place].weight = strengths[place] * factor;
                        strengths[place] * factor.powf(*group_exponent)
                    })
                    .sum()
            } else {
                tree.nodes[node.child as usize].weight + tree.nodes[node.child as usize + 1].weight
            };
        }
        let near = tree.leaves.len();
        for (place, light) in (near..).zip(&mut tree.distant) {
            light.weight = strengths[place] * light_factor(&seen[place], ROOT_VISIBLE);
        }
    }

    /// Shadow rays towards a light, and the share that arrived (NaN if there were none).
    pub(super) fn seen(&self, place: u32) -> (u64, f64) {
        let seen = &self.seen[place as usize];
        (u64::from(seen.rays), f64::from(seen.arrived) / f64::from(seen.rays))
    }

    /// Whether it can be what another of the same lights, in whatever order, has become, if `tree` is the tree now.
    pub(super) fn is_sound_like(&self, other: &Self, tree: &Tree) -> bool {
        let sound = |evidence: &Evidence| is_amount(evidence.samples) && is_amount(evidence.visible);
        self.seen.len() == tree.len()
            && self.strengths.len() == tree.len()
            && self.groups.len() == tree.nodes.len()
            && self
                .seen
                .iter()
                .all(|seen| sound(&seen.evidence) && is_amount(seen.mean))
            && self.strengths.iter().copied().all(is_amount)
            && self
                .groups
                .iter()
                .all(|(evidence, share)| sound(evidence) && is_amount(*share))
            && (self.min_prior, self.group_exponent) == (other.min_prior, other.group_exponent)
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.seen[..]) + size_of_val(&self.strengths[..]) + size_of_val(&self.groups[..])
    }
}

/// By what a light's strength is multiplied: the root of its visible share, since a light that is visible with probability q has
/// q times the second moment (Rath et al. 2020).
fn light_factor(seen: &Seen, prior: f32) -> f32 {
    let share = seen.evidence.share(prior);
    let alive = if seen.evidence.visible > 0.0 {
        1.0
    } else {
        chance_visible(seen.evidence.samples)
    };
    (share * alive).max(MIN_VISIBLE).sqrt()
}
