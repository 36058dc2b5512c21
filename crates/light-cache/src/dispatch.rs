//! From the name of a sampler to code made for it.

use crate::{
    AdaptiveSampler, LightSampler, OctreeSampler, PowerSampler, SamplerKind, Settings, TableSampler, TreeSampler,
    TreeVisibleSampler, UniformSampler,
};
use scene::Scene;

/// What is to be done with a sampler whatever its type: one copy of [`Visitor::visit`] is compiled per sampler, so that
/// no call in the inner loop is virtual.
pub trait Visitor {
    /// What comes out.
    type Output;

    /// Does it.
    fn visit<S: LightSampler + 'static>(self, sampler: S) -> Self::Output;
}

/// Builds the sampler of the given kind for `scene` and hands it to `visitor`. A scene with one light or none needs no
/// choice: the visitor gets a [`UniformSampler`], which says so in its [`crate::SamplerStats::skipped`], unless [`Settings::choose_among_one`].
pub fn build<V: Visitor>(scene: &Scene, settings: &Settings, kind: SamplerKind, visitor: V) -> V::Output {
    let lights = &scene.lights;
    if lights.is_empty() || lights.len() == 1 && !settings.choose_among_one {
        return visitor.visit(UniformSampler::new(lights));
    }
    match kind {
        SamplerKind::Uniform => visitor.visit(UniformSampler::new(lights)),
        SamplerKind::Power => visitor.visit(PowerSampler::new(lights, settings)),
        SamplerKind::Octree => visitor.visit(OctreeSampler::new(scene, settings)),
        SamplerKind::Tree => visitor.visit(TreeSampler::new(lights)),
        SamplerKind::TreeVisible => visitor.visit(TreeVisibleSampler::new(lights, settings)),
        SamplerKind::Adaptive => visitor.visit(AdaptiveSampler::new(scene, settings)),
        SamplerKind::Table => visitor.visit(TableSampler::new(lights, scene.radius, settings)),
    }
}
