//! The two queries, in terms of [`walk`].

use super::kernel::{Instructions, LocalRay, PackHits};
use super::pack::{INDEX, MASKED, ONE_SIDED};
use super::traverse::walk;
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

#[allow(unsafe_code, reason = "calls the kernels")]
impl Query<'_> {
    /// See [`Bvh::nearest`].
    ///
    /// # Safety
    /// That of [`Instructions`].
    #[inline(always)]
    pub(super) unsafe fn nearest<I: Instructions>(&self) -> Option<Hit> {
        let mut best = Hit {
            t: self.ray.t_max,
            u: 0.0,
            v: 0.0,
            id: PrimitiveId::NONE,
        };
        if let Some(root) = self.bvh.fixed {
            let local = LocalRay::new(self.ray.origin_ws, self.ray.direction_ws);
            // SAFETY: as the caller promises.
            unsafe { self.nearest_in::<I>(root, 0, &local, &mut best) };
        }
        if let Some(root) = self.bvh.top {
            let world = LocalRay::new(self.ray.origin_ws, self.ray.direction_ws);
            let mut visit = |leaf: u32, _| {
                let placed = &self.bvh.placed[leaf as usize];
                let local = self.local(placed.instance);
                // SAFETY: as the caller promises.
                unsafe { self.nearest_in::<I>(placed.root, placed.instance, &local, &mut best) };
                best.t
            };
            // SAFETY: as the caller promises; `top` was made by `collapse`.
            unsafe { walk::<I>(&self.bvh.nodes, root, &I::ray(&world), self.ray.t_max, &mut visit) };
        }
        (best.id != PrimitiveId::NONE).then_some(best)
    }

    /// See [`Bvh::occluded`].
    ///
    /// # Safety
    /// That of [`Instructions`].
    #[inline(always)]
    pub(super) unsafe fn occluded<I: Instructions>(&self) -> bool {
        let mut found = false;
        if let Some(root) = self.bvh.fixed {
            let local = LocalRay::new(self.ray.origin_ws, self.ray.direction_ws);
            // SAFETY: as the caller promises.
            found = unsafe { self.occluded_in::<I>(root, 0, &local) };
        }
        if let (Some(root), false) = (self.bvh.top, found) {
            let world = LocalRay::new(self.ray.origin_ws, self.ray.direction_ws);
            let mut visit = |leaf: u32, t_max| {
                let placed = &self.bvh.placed[leaf as usize];
                let local = self.local(placed.instance);
                // SAFETY: as the caller promises.
                found = unsafe { self.occluded_in::<I>(placed.root, placed.instance, &local) };
                if found { -1.0 } else { t_max }
            };
            // SAFETY: as the caller promises; `top` was made by `collapse`.
            unsafe { walk::<I>(&self.bvh.nodes, root, &I::ray(&world), self.ray.t_max, &mut visit) };
        }
        found
    }

    /// Lowers `best` to the nearest hit in the mesh of one instance.
    #[inline(always)]
    unsafe fn nearest_in<I: Instructions>(&self, root: u32, instance: u32, local: &LocalRay, best: &mut Hit) {
        let skip = self.skip_in(instance);
        let t_max = best.t;
        let mut hits = PackHits::default();
        // SAFETY: as the caller promises.
        let ray = unsafe { I::ray(local) };
        let visit = |leaf: u32, _| {
            let pack = &self.bvh.packs[leaf as usize];
            // SAFETY: as the caller promises.
            let mut mask = unsafe { I::triangles(&ray, pack, best.t, &mut hits) };
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize;
                mask &= mask - 1;
                if hits.t[lane] < best.t && self.counts(pack.tag[lane], lane, &hits, instance, skip) {
                    *best = Hit {
                        t: hits.t[lane],
                        u: hits.u[lane],
                        v: hits.v[lane],
                        id: PrimitiveId {
                            instance,
                            triangle: pack.tag[lane] & INDEX,
                        },
                    };
                }
            }
            best.t
        };
        // SAFETY: as the caller promises; `root` was made by `collapse`.
        unsafe { walk::<I>(&self.bvh.nodes, root, &ray, t_max, visit) };
    }

    /// Whether anything is hit in the mesh of one instance.
    #[inline(always)]
    unsafe fn occluded_in<I: Instructions>(&self, root: u32, instance: u32, local: &LocalRay) -> bool {
        let skip = self.skip_in(instance);
        let mut hits = PackHits::default();
        let mut found = false;
        // SAFETY: as the caller promises.
        let ray = unsafe { I::ray(local) };
        let visit = |leaf: u32, t_max| {
            let pack = &self.bvh.packs[leaf as usize];
            // SAFETY: as the caller promises.
            let mut mask = unsafe { I::triangles(&ray, pack, t_max, &mut hits) };
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize;
                mask &= mask - 1;
                if self.counts(pack.tag[lane], lane, &hits, instance, skip) {
                    found = true;
                    return -1.0;
                }
            }
            t_max
        };
        // SAFETY: as the caller promises; `root` was made by `collapse`.
        unsafe { walk::<I>(&self.bvh.nodes, root, &ray, self.ray.t_max, visit) };
        found
    }

    /// Whether a triangle that was hit is there: neither skipped, nor seen from a side that it lacks, nor cut out by its
    /// texture.
    #[inline(always)]
    fn counts(&self, tag: u32, lane: usize, hits: &PackHits, instance: u32, skip: [u32; 2]) -> bool {
        let triangle = tag & INDEX;
        if triangle == skip[0] || triangle == skip[1] {
            return false;
        }
        // In the space of the mesh, where a mirroring instance changes nothing: glTF 2.0 section 3.7.4 turns the
        // winding round for those.
        if tag & ONE_SIDED != 0 && hits.back >> lane & 1 != 0 {
            return false;
        }
        tag & MASKED == 0 || alpha::visible(self.parts, instance, triangle, hits.u[lane], hits.v[lane])
    }

    /// The triangles of `instance` to skip.
    #[inline(always)]
    fn skip_in(&self, instance: u32) -> [u32; 2] {
        self.skip
            .map(|id| if id.instance == instance { id.triangle } else { u32::MAX })
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
