//! The two queries, in terms of [`walk`].
//!
//! Everything here is inlined into the functions that `compile!` makes, where the compiler knows the instruction set.

use super::kernel::{Instructions, LocalRay, PackHits};
use super::pack::{INDEX, MASKED, ONE_SIDED};
use super::traverse::{Visitor, walk};
use super::tree::Tree;
use super::{Bvh, Hit, PrimitiveId, Ray, alpha};
use crate::SceneParts;

/// A query on its way through the scene.
pub(super) struct Query<'a> {
    pub(super) bvh: &'a Bvh,
    pub(super) parts: &'a SceneParts,
    pub(super) ray: &'a Ray,
    /// Triangles that are not there for this ray.
    pub(super) skip: [PrimitiveId; 2],
}

/// The triangles of one instance, for a query.
struct InInstance<'a, I: Instructions> {
    query: &'a Query<'a>,
    tree: &'a Tree,
    ray: &'a I::Ray,
    instance: u32,
    skip: [u32; 2],
    hits: PackHits,
}

/// Looks for the nearest hit.
struct Nearest<'a, I: Instructions> {
    geometry: InInstance<'a, I>,
    best: &'a mut Hit,
}

/// Looks for any hit.
struct Any<'a, I: Instructions> {
    geometry: InInstance<'a, I>,
    found: bool,
}

/// Looks for the nearest hit in the instances it meets.
struct NearestPlaced<'a> {
    query: &'a Query<'a>,
    best: &'a mut Hit,
}

/// Looks for any hit in the instances it meets.
struct AnyPlaced<'a> {
    query: &'a Query<'a>,
    found: bool,
}

#[allow(unsafe_code, reason = "calls the kernels")]
impl<'a> Query<'a> {
    /// [`Bvh::nearest`] among the geometry that is placed once; `best` is lowered.
    ///
    /// # Safety
    /// That of [`Instructions`], here as in all functions below.
    #[inline(always)]
    pub(super) unsafe fn nearest_fixed<I: Instructions>(&self, best: &mut Hit) {
        if let Some(fixed) = &self.bvh.fixed {
            let local = LocalRay::new(self.ray.origin_ws, self.ray.direction_ws);
            // SAFETY: as the caller promises.
            unsafe { self.nearest_in::<I>(&fixed.tree, 0, &local, best) };
        }
    }

    /// [`Bvh::nearest`] among instanced geometry; `best` is lowered.
    #[inline(always)]
    pub(super) unsafe fn nearest_placed<I: Instructions>(&self, best: &mut Hit) {
        if let Some(top) = &self.bvh.top {
            let world = LocalRay::new(self.ray.origin_ws, self.ray.direction_ws);
            let t_max = best.t;
            let mut visitor = NearestPlaced { query: self, best };
            // SAFETY: as the caller promises; `top` was made by `collapse`.
            unsafe { walk::<I, true>(&top.nodes, top.root, &I::ray(&world), t_max, &mut visitor) };
        }
    }

    /// [`Bvh::occluded`] by the geometry that is placed once.
    #[inline(always)]
    pub(super) unsafe fn occluded_fixed<I: Instructions>(&self) -> bool {
        // Not a closure given to `Option`: only what is inlined is compiled for the instruction set.
        let Some(fixed) = &self.bvh.fixed else { return false };
        let local = LocalRay::new(self.ray.origin_ws, self.ray.direction_ws);
        // SAFETY: as the caller promises.
        unsafe { self.occluded_in::<I>(&fixed.tree, 0, &local) }
    }

    /// [`Bvh::occluded`] by instanced geometry.
    #[inline(always)]
    pub(super) unsafe fn occluded_placed<I: Instructions>(&self) -> bool {
        let Some(top) = &self.bvh.top else { return false };
        let world = LocalRay::new(self.ray.origin_ws, self.ray.direction_ws);
        let mut visitor = AnyPlaced {
            query: self,
            found: false,
        };
        // Nearest first here too: what a near instance blocks needs no trees of farther ones.
        // SAFETY: as the caller promises; `top` was made by `collapse`.
        unsafe { walk::<I, true>(&top.nodes, top.root, &I::ray(&world), self.ray.t_max, &mut visitor) };
        visitor.found
    }

    #[inline(always)]
    unsafe fn nearest_in<I: Instructions>(&self, tree: &Tree, instance: u32, local: &LocalRay, best: &mut Hit) {
        let t_max = best.t;
        // SAFETY: as the caller promises; trees are made by `collapse`.
        unsafe {
            let ray = I::ray(local);
            let geometry = self.in_instance::<I>(tree, instance, &ray);
            walk::<I, true>(&tree.nodes, tree.root, &ray, t_max, &mut Nearest { geometry, best });
        }
    }

    #[inline(always)]
    unsafe fn occluded_in<I: Instructions>(&self, tree: &Tree, instance: u32, local: &LocalRay) -> bool {
        // SAFETY: as the caller promises; trees are made by `collapse`.
        unsafe {
            let ray = I::ray(local);
            let geometry = self.in_instance::<I>(tree, instance, &ray);
            let mut visitor = Any { geometry, found: false };
            walk::<I, false>(&tree.nodes, tree.root, &ray, self.ray.t_max, &mut visitor);
            visitor.found
        }
    }

    #[inline(always)]
    fn in_instance<'q, I: Instructions>(&'q self, tree: &'q Tree, instance: u32, ray: &'q I::Ray) -> InInstance<'q, I> {
        InInstance {
            query: self,
            tree,
            ray,
            instance,
            skip: self
                .skip
                .map(|id| if id.instance == instance { id.triangle } else { u32::MAX }),
            hits: PackHits::default(),
        }
    }

    /// Instance and tree of a leaf of the top tree; `None` for the leaf that stands for no instance.
    #[inline(always)]
    fn placed(&self, leaf: u32) -> Option<(u32, &'a Tree)> {
        let &instance = self.bvh.placed.get(leaf as usize)?;
        let mesh = self.parts.instances[instance as usize].mesh;
        Some((instance, self.bvh.tree(self.parts, mesh)))
    }

    /// The ray in the space of an instance's mesh; distances stay the same.
    #[inline(always)]
    fn local(&self, instance: u32) -> LocalRay {
        let local_from_world = &self.parts.instances[instance as usize].local_from_world;
        LocalRay::new(
            local_from_world.transform_point3(self.ray.origin_ws),
            local_from_world.transform_vector3(self.ray.direction_ws),
        )
    }
}

#[allow(unsafe_code, reason = "calls the kernels")]
impl<I: Instructions> InInstance<'_, I> {
    /// The first lane of a leaf whose hit passes `accept(t)` and whose triangle counts, and its tag.
    #[inline(always)]
    unsafe fn test(&mut self, leaf: u32, t_max: f32, mut hit: impl FnMut(&PackHits, usize, u32) -> bool) {
        // SAFETY: leaves of a mesh's tree are indices of packs; the rest as the caller promises.
        let (pack, mut mask) = unsafe {
            let pack = self.tree.packs.get_unchecked(leaf as usize);
            (pack, I::triangles(self.ray, pack, t_max, &mut self.hits))
        };
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize & 7;
            mask &= mask - 1;
            let tag = pack.tag[lane];
            if counts(self.query.parts, self.instance, self.skip, &self.hits, tag, lane)
                && hit(&self.hits, lane, tag & INDEX)
            {
                return;
            }
        }
    }
}

/// Whether a triangle that was hit is there: neither skipped, nor seen from a side that it lacks, nor cut out by its
/// texture.
#[inline(always)]
pub(super) fn counts(
    parts: &SceneParts,
    instance: u32,
    skip: [u32; 2],
    hits: &PackHits,
    tag: u32,
    lane: usize,
) -> bool {
    let triangle = tag & INDEX;
    if triangle == skip[0] || triangle == skip[1] {
        return false;
    }
    // In the space of the mesh, where a mirroring instance changes nothing: glTF 2.0 section 3.7.4 turns the
    // winding round for those.
    if tag & ONE_SIDED != 0 && hits.back >> lane & 1 != 0 {
        return false;
    }
    tag & MASKED == 0 || alpha::visible(parts, instance, triangle, hits.u[lane], hits.v[lane])
}

#[allow(unsafe_code, reason = "calls the kernels")]
impl<I: Instructions> Visitor<I> for Nearest<'_, I> {
    #[inline(always)]
    unsafe fn leaf(&mut self, leaf: u32, t_max: f32) -> f32 {
        let instance = self.geometry.instance;
        let mut t_max = t_max;
        // SAFETY: as the caller promises.
        unsafe {
            self.geometry.test(leaf, t_max, |hits, lane, triangle| {
                if hits.t[lane] < t_max {
                    let id = PrimitiveId { instance, triangle };
                    t_max = hits.t[lane];
                    *self.best = Hit {
                        t: t_max,
                        u: hits.u[lane],
                        v: hits.v[lane],
                        id,
                    };
                }
                false
            });
        }
        t_max
    }
}

#[allow(unsafe_code, reason = "calls the kernels")]
impl<I: Instructions> Visitor<I> for Any<'_, I> {
    #[inline(always)]
    unsafe fn leaf(&mut self, leaf: u32, t_max: f32) -> f32 {
        let mut found = false;
        // SAFETY: as the caller promises.
        unsafe {
            self.geometry.test(leaf, t_max, |_, _, _| {
                found = true;
                true
            });
        }
        self.found = found;
        if found { -1.0 } else { t_max }
    }
}

#[allow(unsafe_code, reason = "calls the kernels")]
impl<I: Instructions> Visitor<I> for NearestPlaced<'_> {
    #[inline(always)]
    unsafe fn leaf(&mut self, leaf: u32, _t_max: f32) -> f32 {
        if let Some((instance, tree)) = self.query.placed(leaf) {
            let local = self.query.local(instance);
            // SAFETY: as the caller promises.
            unsafe { self.query.nearest_in::<I>(tree, instance, &local, self.best) };
        }
        self.best.t
    }
}

#[allow(unsafe_code, reason = "calls the kernels")]
impl<I: Instructions> Visitor<I> for AnyPlaced<'_> {
    #[inline(always)]
    unsafe fn leaf(&mut self, leaf: u32, t_max: f32) -> f32 {
        let Some((instance, tree)) = self.query.placed(leaf) else {
            return t_max;
        };
        let local = self.query.local(instance);
        // SAFETY: as the caller promises.
        self.found = unsafe { self.query.occluded_in::<I>(tree, instance, &local) };
        if self.found { -1.0 } else { t_max }
    }
}
