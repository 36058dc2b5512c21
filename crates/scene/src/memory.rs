//! What is made when a ray first needs it, how much of it there is, and what of it is dropped when it is more than a budget allows.
//!
//! Rays only ever add: they make what is missing under a lock ([`OnDemand::get_or_make`]) and leave a mark on what they use. Dropping needs the
//! scene for oneself ([`Scene::make_room`]), so it cannot happen while a ray is on its way, and what is dropped is made again from the same
//! scene: no image depends on it.

use crate::alone::alone;
use crate::shading::TriangleRecord;
use crate::{Mesh, Scene, StoredMesh};
use serde::Serialize;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, OnceLock};

/// Share of the budget that is left in use when room is made. Higher values drop less; lower values interrupt rays less often.
const KEPT_SHARE: f64 = 0.75;

/// The account of what was made on demand in a scene. Copies of the scene share it.
#[derive(Debug)]
pub struct Memory {
    budget: AtomicU64,
    resident: AtomicU64,
    peak: AtomicU64,
    made: AtomicU64,
    made_again: AtomicU64,
    dropped: AtomicU64,
    sweeps: AtomicU64,
}

/// What was made on demand so far, and what of it is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct MemoryUse {
    /// Bytes that it may have before some of it is dropped; `None` if there is no bound.
    pub budget_bytes: Option<u64>,
    /// Bytes of what is there: trees and shading records of instanced meshes, meshes and textures that came from a file when they were needed.
    pub resident_bytes: u64,
    /// Most bytes there ever were. More than the budget by what is made by tiles that had begun.
    pub peak_bytes: u64,
    /// How often something was made: a tree, the shading records of a mesh, a mesh that was read, a texture that was decoded.
    pub made: u64,
    /// How often something was dropped.
    pub dropped: u64,
    /// How often something was made that had been dropped; part of `made`.
    pub made_again: u64,
}

/// Bytes of what a scene keeps whatever the budget.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct KeptBytes {
    /// Meshes that were read when the scene was loaded, emissive ones among them.
    pub meshes: u64,
    /// The tree over what is placed once, and the tree over all instances.
    pub trees: u64,
    /// Shading records of what is placed once, materials, placements.
    pub shading: u64,
    /// Textures that have no file to be decoded from again.
    pub textures: u64,
    /// Lights and the instances of meshes.
    pub lights_and_instances: u64,
}

impl Default for Memory {
    fn default() -> Self {
        let zero = AtomicU64::default;
        Self {
            budget: AtomicU64::new(u64::MAX),
            resident: zero(),
            peak: zero(),
            made: zero(),
            made_again: zero(),
            dropped: zero(),
            sweeps: zero(),
        }
    }
}

impl Memory {
    fn add(&self, bytes: usize, again: bool) {
        let resident = self.resident.fetch_add(bytes as u64, Relaxed) + bytes as u64;
        self.peak.fetch_max(resident, Relaxed);
        self.made.fetch_add(1, Relaxed);
        self.made_again.fetch_add(u64::from(again), Relaxed);
    }

    /// Something is not to be dropped any more.
    pub(crate) fn forget(&self, bytes: usize) {
        self.resident.fetch_sub(bytes as u64, Relaxed);
    }

    /// Whether more is there than the budget allows.
    #[inline]
    pub fn is_full(&self) -> bool {
        self.resident.load(Relaxed) > self.budget.load(Relaxed)
    }

    /// What was made and what is there.
    pub fn used(&self) -> MemoryUse {
        let budget = self.budget.load(Relaxed);
        MemoryUse {
            budget_bytes: (budget != u64::MAX).then_some(budget),
            resident_bytes: self.resident.load(Relaxed),
            peak_bytes: self.peak.load(Relaxed),
            made: self.made.load(Relaxed),
            dropped: self.dropped.load(Relaxed),
            made_again: self.made_again.load(Relaxed),
        }
    }
}

/// Knows its size.
pub(crate) trait Weigh {
    /// Bytes that it holds on the heap.
    fn bytes(&self) -> usize;
}

impl Weigh for Mesh {
    fn bytes(&self) -> usize {
        size_of_val(&*self.positions)
            + size_of_val(&*self.indices)
            + size_of_val(&*self.normals)
            + size_of_val(&*self.uvs)
            + size_of_val(&*self.uvs1)
            + size_of_val(&*self.tangents)
            + size_of_val(&*self.colors)
            + size_of_val(&*self.materials)
            + size_of_val(&*self.origins)
    }
}

impl Weigh for Vec<TriangleRecord> {
    fn bytes(&self) -> usize {
        size_of_val(self.as_slice())
    }
}

impl Weigh for Vec<[u8; 4]> {
    fn bytes(&self) -> usize {
        size_of_val(self.as_slice())
    }
}

/// Something that is made by its first use, and again by the first use after it was dropped.
#[derive(Debug)]
pub(crate) struct OnDemand<T> {
    value: OnceLock<T>,
    /// Whether anybody used it since the last sweep.
    used: AtomicBool,
    /// The sweep that last found it used.
    last_used: u64,
    /// Whether it was there before.
    was_dropped: bool,
}

impl<T: Clone> Clone for OnDemand<T> {
    fn clone(&self) -> Self {
        Self::of(self.value.clone())
    }
}

impl<T> Default for OnDemand<T> {
    fn default() -> Self {
        Self::of(OnceLock::new())
    }
}

impl<T> From<T> for OnDemand<T> {
    fn from(value: T) -> Self {
        Self::of(value.into())
    }
}

impl<T> OnDemand<T> {
    fn of(value: OnceLock<T>) -> Self {
        Self {
            value,
            used: AtomicBool::new(false),
            last_used: 0,
            was_dropped: false,
        }
    }

    /// The value, if it is there: it counts as used.
    #[inline]
    pub(crate) fn get(&self) -> Option<&T> {
        let value = self.value.get()?;
        // Read first: a line that nobody writes to stays in the caches of all processors.
        if !self.used.load(Relaxed) {
            self.used.store(true, Relaxed);
        }
        Some(value)
    }

    /// The value to be changed, if it is there.
    pub(crate) fn get_mut(&mut self) -> Option<&mut T> {
        self.value.get_mut()
    }

    /// The value, if it is there, without counting as a use.
    pub(crate) fn peek(&self) -> Option<&T> {
        self.value.get()
    }
}

impl<T: Weigh + Send> OnDemand<T> {
    /// The value; made by `make` if it is not there, and entered into `memory`.
    #[inline]
    pub(crate) fn get_or_make(&self, memory: &Memory, make: impl FnOnce() -> T + Send) -> &T {
        match self.get() {
            Some(value) => value,
            None => self.make(memory, make),
        }
    }

    #[cold]
    #[inline(never)]
    fn make(&self, memory: &Memory, make: impl FnOnce() -> T + Send) -> &T {
        let value = self.value.get_or_init(|| {
            let value = alone(make);
            memory.add(value.bytes(), self.was_dropped);
            value
        });
        self.used.store(true, Relaxed);
        value
    }
}

/// An [`OnDemand`] of any type, as far as dropping it is concerned.
pub(crate) trait Droppable {
    /// Bytes of the value, `None` if there is none. Enters whether it was used since the last sweep, and that the next sweep is `sweep`.
    fn weigh(&mut self, sweep: u64) -> Option<usize>;

    /// The sweep that last found it used.
    fn last_used(&self) -> u64;

    /// Drops the value.
    fn clear(&mut self);
}

impl<T: Weigh> Droppable for OnDemand<T> {
    fn weigh(&mut self, sweep: u64) -> Option<usize> {
        if std::mem::take(self.used.get_mut()) {
            self.last_used = sweep;
        }
        self.value.get().map(Weigh::bytes)
    }

    fn last_used(&self) -> u64 {
        self.last_used
    }

    fn clear(&mut self) {
        self.was_dropped |= self.value.take().is_some();
    }
}

impl Scene {
    /// From now on [`Scene::make_room`] drops what is above `bytes`.
    pub fn set_memory_budget(&self, bytes: u64) {
        self.parts.memory.budget.store(bytes, Relaxed);
    }

    /// The account of what was made on demand.
    pub fn memory(&self) -> &Memory {
        &self.parts.memory
    }

    /// If more than the budget was made on demand, drops what was not used for longest until three quarters of the budget are left; of what was
    /// used at the same time, what is cheapest to make again: shading records, textures, meshes, trees. Time of use is counted in calls.
    pub fn make_room(&mut self) {
        let memory = self.parts.memory.clone();
        let budget = memory.budget.load(Relaxed);
        if budget == u64::MAX {
            return;
        }
        let sweep = memory.sweeps.fetch_add(1, Relaxed) + 1;
        // What is shared with another scene stays.
        let trees = Arc::get_mut(&mut self.bvh).into_iter().flat_map(|bvh| bvh.droppable());
        let meshes = self.parts.meshes.iter_mut().filter_map(StoredMesh::droppable);
        let textures = self.parts.textures.iter_mut();
        let textures = textures.filter_map(|texture| texture.texels.droppable());
        let all = self.shading.droppable().chain(textures).chain(meshes).chain(trees);
        let mut there: Vec<(&mut dyn Droppable, usize)> = all
            .filter_map(|one| one.weigh(sweep).map(|bytes| (one, bytes)))
            .collect();
        let mut resident: usize = there.iter().map(|(_, bytes)| bytes).sum();
        if resident as u64 > budget {
            there.sort_by_key(|(one, _)| one.last_used());
            let mut dropped = 0;
            for (one, bytes) in there {
                if resident as f64 <= KEPT_SHARE * budget as f64 {
                    break;
                }
                one.clear();
                resident -= bytes;
                dropped += 1;
            }
            memory.dropped.fetch_add(dropped, Relaxed);
        }
        memory.resident.store(resident as u64, Relaxed);
    }

    /// What no budget makes this scene drop.
    pub fn kept_bytes(&self) -> KeptBytes {
        let parts = &self.parts;
        let meshes = parts.meshes.iter().filter_map(StoredMesh::kept).map(Weigh::bytes);
        let textures = parts.textures.iter().filter_map(|texture| texture.texels.kept());
        KeptBytes {
            meshes: meshes.sum::<usize>() as u64,
            trees: self.bvh.kept_bytes() as u64,
            shading: self.shading.kept_bytes() as u64,
            textures: textures.map(Weigh::bytes).sum::<usize>() as u64,
            lights_and_instances: (size_of_val(&*self.lights) + size_of_val(&*parts.instances)) as u64,
        }
    }
}
