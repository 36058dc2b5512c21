//! Ray queries: the nearest hit, and whether anything stands between two points.
//!
//! A binary tree (`bvh2`, built by the `obvhs` crate) is collapsed into nodes of eight quantised boxes (`node`) and
//! leaves of up to eight triangles (`pack`), so that a vector instruction tests all of one (`kernel`). Each mesh has
//! one tree in its own space. Mesh 0 lies in world space and is walked first; instances of other meshes, if there are
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

use crate::{Mesh, SceneParts};
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

/// The acceleration structure over all instances of a scene.
#[derive(Debug)]
pub struct Bvh {
    /// One that this processor has.
    kernel: Kernel,
    /// Nodes of all trees; the first one is empty.
    nodes: Vec<Node>,
    /// Triangles of all meshes; the first one is empty.
    packs: Vec<Pack>,
    /// Root of the tree of instance 0, if it places its mesh by the identity.
    fixed: Option<u32>,
    /// Root of the tree over `placed`.
    top: Option<u32>,
    /// All other instances.
    placed: Vec<Placed>,
}

/// An instance that is found through the top level.
#[derive(Clone, Copy, Debug)]
struct Placed {
    instance: u32,
    /// Root of its mesh's tree.
    root: u32,
}

impl Bvh {
    /// Builds it for the geometry of `parts` (already validated). Triangles without area are left out.
    pub fn build(parts: &SceneParts) -> Self {
        let mut bvh = Self {
            nodes: vec![Node::new(&[], node::LEAF)],
            packs: vec![Pack::EMPTY],
            fixed: None,
            top: None,
            placed: Vec::new(),
            kernel: Kernel::available().pop().unwrap_or(Kernel::Portable),
        };
        let trees: Vec<_> = parts.meshes.iter().map(|mesh| bvh.add_mesh(parts, mesh)).collect();
        let mut boxes = Vec::new();
        for (index, instance) in parts.instances.iter().enumerate() {
            let Some((root, bounds)) = trees[instance.mesh as usize] else {
                continue;
            };
            if index == 0 && instance.identity {
                bvh.fixed = Some(root);
            } else {
                bvh.placed.push(Placed {
                    instance: index as u32,
                    root,
                });
                boxes.push(bounds.transformed(&instance.world_from_local));
            }
        }
        if !boxes.is_empty() {
            bvh.placed.push(Placed { instance: 0, root: 0 });
            let tree = bvh2::build(&boxes);
            let empty = boxes.len() as u32;
            bvh.top = Some(collapse::collapse(&tree, 1, empty, &mut bvh.nodes, |instances| {
                instances[0]
            }));
        }
        bvh.nodes.shrink_to_fit();
        bvh.packs.shrink_to_fit();
        bvh
    }

    /// Adds the tree of a mesh; returns its root and its box, or `None` if there is nothing to hit.
    fn add_mesh(&mut self, parts: &SceneParts, mesh: &Mesh) -> Option<(u32, Bounds)> {
        let has_area = |triangle: &u32| {
            let [a, b, c] = mesh.corners(*triangle as usize).map(Vec3::as_dvec3);
            (b - a).cross(c - a).length_squared() > 0.0
        };
        let triangles: Vec<u32> = (0..mesh.len() as u32).filter(has_area).collect();
        if triangles.is_empty() {
            return None;
        }
        let boxes: Vec<Bounds> = triangles
            .iter()
            .map(|&triangle| Bounds::of_triangle(mesh.corners(triangle as usize)))
            .collect();
        let around = boxes.iter().fold(Bounds::EMPTY, |around, b| around.union(*b));
        let tree = bvh2::build(&boxes);
        drop(boxes);
        let packs = &mut self.packs;
        let root = collapse::collapse(&tree, node::WIDTH as u32, 0, &mut self.nodes, |boxes| {
            let triangles = boxes.iter().map(|&index| triangles[index as usize]);
            packs.push(Pack::new(mesh, &parts.materials, triangles));
            packs.len() as u32 - 1
        });
        Some((root, around))
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

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.nodes) + size_of_val(&*self.packs) + size_of_val(&*self.placed)
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
                let alike = match bvh.fixed {
                    // SAFETY: see above; `root` was made by `collapse`.
                    Some(root) => unsafe { packet::nearest::<$instructions>(bvh, parts, root, packet, &mut best) },
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
