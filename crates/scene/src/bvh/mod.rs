//! Ray queries: the nearest hit, and whether anything stands between two points.
//!
//! A binary tree (`bvh2`, built by the `obvhs` crate) is collapsed into nodes of eight quantised boxes (`node`) and
//! leaves of up to eight triangles (`pack`), so that a vector instruction tests all of one (`kernel`). Each mesh has
//! one tree in its own space (`tree`), built when a ray first comes near. Mesh 0 lies in world space and is walked first; instances of other meshes, if there are
//! any, are found through one more tree over their boxes.

mod alpha;
mod bounds;
mod bvh2;
mod collapse;
mod flat;
mod kernel;
mod node;
mod pack;
mod packet;
mod query;
mod traverse;
mod tree;

use crate::SceneParts;
use crate::memory::{Droppable, OnDemand, Weigh};
use bounds::Bounds;
pub use flat::FlatBvh;
use glam::Vec3;
pub use kernel::Kernel;
#[cfg(target_arch = "x86_64")]
use kernel::avx2::Avx2;
use kernel::portable::Portable;
use node::Node;
use pack::Pack;
pub use packet::{PACKET, Packet};
use query::Query;
use rayon::prelude::*;
use tree::Tree;

/// A ray. `direction` is of unit length; hits count in (0, `t_max`).
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// World-space origin.
    pub origin_ws: Vec3,
    /// World-space unit direction.
    pub direction_ws: Vec3,
    /// Largest distance that counts, metres; may be infinite.
    pub t_max: f32,
}

/// A triangle of an instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub struct PrimitiveId {
    /// Index into [`crate::SceneParts::instances`].
    pub instance: u32,
    /// Triangle of the instance's mesh.
    pub triangle: u32,
}

impl PrimitiveId {
    /// No triangle: nothing is skipped.
    pub const NONE: Self = Self {
        instance: u32::MAX,
        triangle: u32::MAX,
    };
}

/// A ray's meeting with a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Distance along the ray.
    pub t: f32,
    /// Barycentric weight of the second corner.
    pub u: f32,
    /// Barycentric weight of the third corner.
    pub v: f32,
    /// Which triangle.
    pub id: PrimitiveId,
}

/// The acceleration structure over all instances of a scene. What is placed once has its tree from the beginning; the trees of other meshes are
/// built when the first ray enters the box around one of their instances.
#[derive(Debug)]
pub struct Bvh {
    /// One that this processor has.
    kernel: Kernel,
    /// The mesh of instance 0, if it is placed by the identity.
    fixed: Option<Fixed>,
    /// The tree over `placed`.
    top: Option<Top>,
    /// All other instances, by leaf of the top tree.
    placed: Vec<u32>,
    /// By mesh. A tree depends on its mesh only, whichever ray needed it first.
    trees: Vec<OnDemand<Tree>>,
}

/// Geometry in world space.
#[derive(Debug)]
struct Fixed {
    mesh: usize,
    tree: Tree,
}

/// The tree over the boxes of instances.
#[derive(Debug)]
struct Top {
    nodes: Vec<Node>,
    root: u32,
}

impl Bvh {
    /// Builds what every ray needs of it for the geometry of `parts` (already validated). Triangles without area are left out.
    pub fn build(parts: &SceneParts) -> Self {
        let mut bvh = Self {
            kernel: Kernel::available().pop().unwrap_or(Kernel::Portable),
            fixed: None,
            top: None,
            placed: Vec::new(),
            trees: parts.meshes.iter().map(|_| OnDemand::default()).collect(),
        };
        let bounds: Vec<Bounds> = parts.meshes.par_iter().map(Bounds::of_mesh).collect();
        let mut boxes = Vec::new();
        for (index, instance) in parts.instances.iter().enumerate() {
            let mesh = instance.mesh as usize;
            if bounds[mesh].is_empty() {
                continue;
            }
            if index == 0 && parts.is_fixed(instance) {
                let tree = Tree::build(&parts.meshes[mesh], &parts.materials);
                bvh.fixed = Some(Fixed { mesh, tree });
            } else {
                bvh.placed.push(index as u32);
                boxes.push(bounds[mesh].transformed(&instance.world_from_local));
            }
        }
        if !boxes.is_empty() {
            let tree = bvh2::build(&boxes);
            let mut nodes = Vec::new();
            let root = collapse::collapse(&tree, 1, boxes.len() as u32, &mut nodes, |instances| instances[0]);
            nodes.shrink_to_fit();
            bvh.top = Some(Top { nodes, root });
        }
        bvh
    }

    /// The tree of a mesh, built now if no ray came near it before.
    #[inline]
    fn tree(&self, parts: &SceneParts, mesh: u32) -> &Tree {
        match self.trees[mesh as usize].get() {
            Some(tree) => tree,
            None => self.first_use(parts, mesh),
        }
    }

    #[cold]
    #[inline(never)]
    fn first_use(&self, parts: &SceneParts, mesh: u32) -> &Tree {
        match &self.fixed {
            Some(fixed) if fixed.mesh == mesh as usize => &fixed.tree,
            _ => self.trees[mesh as usize].get_or_make(&parts.memory, || {
                Tree::build(&parts.meshes[mesh as usize], &parts.materials)
            }),
        }
    }

    /// Builds all trees that were not needed so far.
    pub fn build_all(&self, parts: &SceneParts) {
        let mut meshes: Vec<u32> = parts.instances.iter().map(|instance| instance.mesh).collect();
        meshes.sort_unstable();
        meshes.dedup();
        meshes.into_par_iter().for_each(|mesh| {
            self.tree(parts, mesh);
        });
    }

    /// Number of meshes whose trees are built.
    pub fn built(&self) -> usize {
        let built = self.trees.iter().filter(|tree| tree.peek().is_some()).count();
        built + usize::from(self.fixed.is_some())
    }

    /// The nearest hit, or `None`. `from` is skipped (the triangle the ray starts on).
    #[allow(unsafe_code, reason = "vector instructions")]
    pub fn nearest(&self, parts: &SceneParts, ray: &Ray, from: PrimitiveId) -> Option<Hit> {
        let query = Query {
            bvh: self,
            parts,
            ray,
            skip: [from, from],
        };
        // SAFETY: `kernel` is one that this processor has.
        unsafe {
            match self.kernel {
                Kernel::Portable => portable::nearest(&query),
                #[cfg(target_arch = "x86_64")]
                Kernel::Avx2 => avx2::nearest(&query),
                #[cfg(target_arch = "x86_64")]
                Kernel::Avx512 => avx512::nearest(&query),
            }
        }
    }

    /// The nearest hit of each ray of `packet`. Nothing is skipped.
    #[allow(unsafe_code, reason = "vector instructions")]
    pub fn nearest_of_packet(&self, parts: &SceneParts, packet: &Packet) -> [Option<Hit>; PACKET] {
        // SAFETY: `kernel` is one that this processor has.
        unsafe {
            match self.kernel {
                Kernel::Portable => portable::nearest_of_packet(self, parts, packet),
                #[cfg(target_arch = "x86_64")]
                Kernel::Avx2 => avx2::nearest_of_packet(self, parts, packet),
                #[cfg(target_arch = "x86_64")]
                Kernel::Avx512 => avx512::nearest_of_packet(self, parts, packet),
            }
        }
    }

    /// Whether anything but `from` and `to` is hit.
    #[allow(unsafe_code, reason = "vector instructions")]
    pub fn occluded(&self, parts: &SceneParts, ray: &Ray, from: PrimitiveId, to: PrimitiveId) -> bool {
        let query = Query {
            bvh: self,
            parts,
            ray,
            skip: [from, to],
        };
        // SAFETY: `kernel` is one that this processor has.
        unsafe {
            match self.kernel {
                Kernel::Portable => portable::occluded(&query),
                #[cfg(target_arch = "x86_64")]
                Kernel::Avx2 => avx2::occluded(&query),
                #[cfg(target_arch = "x86_64")]
                Kernel::Avx512 => avx512::occluded(&query),
            }
        }
    }

    /// The vector instructions in use: ones that this processor has.
    #[inline]
    pub fn kernel(&self) -> Kernel {
        self.kernel
    }

    /// Uses `kernel` from now on, if this processor has it: for tests and measurements, [`Bvh::build`] takes the
    /// fastest.
    pub fn set_kernel(&mut self, kernel: Kernel) {
        if Kernel::available().contains(&kernel) {
            self.kernel = kernel;
        }
    }

    /// Bytes held by what is built.
    pub fn bytes(&self) -> usize {
        let trees: usize = self.trees.iter().filter_map(OnDemand::peek).map(Weigh::bytes).sum();
        self.kept_bytes() + trees
    }

    /// Bytes of what stays: the tree of what is placed once, and the tree over instances.
    pub(crate) fn kept_bytes(&self) -> usize {
        let fixed = self.fixed.as_ref().map_or(0, |fixed| fixed.tree.bytes());
        let top = self.top.as_ref().map_or(0, |top| size_of_val(&*top.nodes));
        fixed + top + size_of_val(&*self.placed)
    }

    /// For dropping the other trees.
    pub(crate) fn droppable(&mut self) -> impl Iterator<Item = &mut dyn Droppable> {
        self.trees.iter_mut().map(|tree| tree as &mut dyn Droppable)
    }
}

/// Compiles both queries for an instruction set. Instances are rare enough to be kept out of the way.
macro_rules! compile {
    ($module:ident, $instructions:ty $(, $features:literal)?) => {
        #[allow(unsafe_code, reason = "vector instructions")]
        mod $module {
            #[allow(clippy::wildcard_imports, reason = "the inside of a macro")]
            use super::*;

            #[inline(never)]
            $(#[target_feature(enable = $features)])?
            unsafe fn nearest_placed(query: &Query<'_>, best: &mut Hit) {
                // SAFETY: the caller knows that the processor has the instructions, here and below.
                unsafe { query.nearest_placed::<$instructions>(best) }
            }

            #[inline(never)]
            $(#[target_feature(enable = $features)])?
            unsafe fn occluded_placed(query: &Query<'_>) -> bool {
                // SAFETY: see above.
                unsafe { query.occluded_placed::<$instructions>() }
            }

            $(#[target_feature(enable = $features)])?
            pub(super) unsafe fn nearest(query: &Query<'_>) -> Option<Hit> {
                let mut best = Hit {
                    t: query.ray.t_max,
                    u: 0.0,
                    v: 0.0,
                    id: PrimitiveId::NONE,
                };
                // SAFETY: see above.
                unsafe { query.nearest_fixed::<$instructions>(&mut best) };
                if query.bvh.top.is_some() {
                    // SAFETY: see above.
                    unsafe { nearest_placed(query, &mut best) };
                }
                (best.id != PrimitiveId::NONE).then_some(best)
            }

            $(#[target_feature(enable = $features)])?
            pub(super) unsafe fn nearest_of_packet(
                bvh: &Bvh,
                parts: &SceneParts,
                packet: &Packet,
            ) -> [Option<Hit>; PACKET] {
                let mut best = [Hit {
                    t: f32::INFINITY,
                    u: 0.0,
                    v: 0.0,
                    id: PrimitiveId::NONE,
                }; PACKET];
                let alike = match &bvh.fixed {
                    // SAFETY: see above; the tree was made by `collapse`.
                    Some(fixed) => unsafe { packet::nearest::<$instructions>(&fixed.tree, parts, packet, &mut best) },
                    None => true,
                };
                let mut hits = [None; PACKET];
                for i in 0..PACKET {
                    let ray = Ray {
                        origin_ws: packet.origin_ws,
                        direction_ws: packet.direction_ws(i),
                        t_max: f32::INFINITY,
                    };
                    let query = Query {
                        bvh,
                        parts,
                        ray: &ray,
                        skip: [PrimitiveId::NONE; 2],
                    };
                    // SAFETY: see above.
                    unsafe {
                        if !alike {
                            hits[i] = nearest(&query);
                            continue;
                        }
                        if bvh.top.is_some() {
                            nearest_placed(&query, &mut best[i]);
                        }
                    }
                    hits[i] = (best[i].id != PrimitiveId::NONE).then_some(best[i]);
                }
                hits
            }

            $(#[target_feature(enable = $features)])?
            pub(super) unsafe fn occluded(query: &Query<'_>) -> bool {
                // SAFETY: see above.
                unsafe { query.occluded_fixed::<$instructions>() || query.bvh.top.is_some() && occluded_placed(query) }
            }
        }
    };
}

compile!(portable, Portable);
#[cfg(target_arch = "x86_64")]
compile!(avx2, Avx2, "avx2,fma,bmi1,bmi2,lzcnt");
#[cfg(target_arch = "x86_64")]
compile!(
    avx512,
    Avx2,
    "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt"
);

#[cfg(test)]
mod tests;
