//! The plain light tree as a sampler: no learning, no visibility.

use super::{Descent, Tree, UNIT, position, probability};
use crate::records;
use crate::{Choice, LightRecord, LightSampler, Observation, SamplerStats, ShadingPoint};
use scene::{Light, Scene};
use std::time::Instant;

/// Light tree with bounding cones (Conty Estevez and Kulla 2018), visibility unknown.
#[derive(Debug)]
pub struct TreeSampler {
    tree: Tree,
    build_s: f64,
}

/// The tree as seen from one shading point.
#[derive(Clone, Copy, Debug)]
pub struct Local<'t> {
    descent: Descent<'t>,
    salt: u32,
}

impl TreeSampler {
    /// Builds the tree over `lights`.
    pub fn new(lights: &[Light]) -> Self {
        let start = Instant::now();
        let tree = Tree::new(lights);
        Self {
            tree,
            build_s: start.elapsed().as_secs_f64(),
        }
    }
}

impl LightSampler for TreeSampler {
    type Local<'a> = Local<'a>;
    const LEARNS: bool = false;

    #[inline]
    fn local(&self, _scene: &Scene, point: &ShadingPoint) -> Local<'_> {
        Local {
            descent: Descent::new(&self.tree, point.into()),
            salt: point.salt(),
        }
    }

    #[inline]
    fn sample(&self, local: &Local<'_>, u: u32) -> Option<Choice> {
        if !local.descent.alive() {
            return None;
        }
        let (place, width) = local.descent.draw(position(u, local.salt), UNIT);
        Some(Choice {
            light: self.tree.light_at(place),
            pmf: probability(width),
        })
    }

    #[inline]
    fn pmf(&self, local: &Local<'_>, light: u32) -> f32 {
        if !local.descent.alive() {
            return 0.0;
        }
        probability(local.descent.width_of(self.tree.rank[light as usize], UNIT))
    }

    fn add_pmfs(&self, local: &Local<'_>, sum: &mut [f64]) {
        if local.descent.alive() {
            local.descent.add_probabilities(UNIT, sum);
        }
    }

    fn end_frame(&mut self, _scene: &Scene, _logs: &[Vec<Observation>]) {}

    fn stats(&self) -> SamplerStats {
        SamplerStats {
            bytes: self.tree.bytes(),
            build_s: self.build_s,
            ..SamplerStats::default()
        }
    }

    fn records(&self, scene: &Scene) -> Vec<LightRecord> {
        records::of_sampler(self, scene, &[])
    }
}
