//! The two inner loops of ray tracing, one node and one pack of triangles at a time, once per instruction set.

pub(super) mod portable;

use super::node::{Node, WIDTH};
use super::pack::Pack;
use glam::Vec3;

/// A ray in the space of the geometry it is tested against, with everything that does not depend on the geometry.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalRay {
    /// Origin.
    pub(super) origin: [f32; 3],
    /// Reciprocal of the direction, finite.
    pub(super) inverse: [f32; 3],
    /// The same, enlarged by the rounding of the box test (Ize, "Robust BVH Ray Traversal", JCGT 2013).
    pub(super) inverse_far: [f32; 3],
    /// Where the (near, far) planes of an axis begin in a node: 0 going up, 8 going down.
    pub(super) near: [usize; 3],
    /// The axes, permuted so that the last is the direction's largest and the winding stays.
    pub(super) axes: [usize; 3],
    /// Shear that takes the direction to the last axis.
    pub(super) shear: [f32; 3],
}

impl LocalRay {
    /// `direction` of any length but zero.
    #[inline]
    pub(super) fn new(origin: Vec3, direction: Vec3) -> Self {
        /// Smallest component of a direction; smaller ones would make infinite reciprocals, and those NaN.
        const SMALLEST: f32 = 1e-20;
        let inverse = direction
            .to_array()
            .map(|d| 1.0 / if d.abs() < SMALLEST { SMALLEST.copysign(d) } else { d });
        let size = direction.abs();
        let z = if size.x > size.y {
            if size.x > size.z { 0 } else { 2 }
        } else if size.y > size.z {
            1
        } else {
            2
        };
        let next = [1, 2, 0, 1];
        let (x, y) = (next[z], next[z + 1]);
        let (x, y) = if direction[z] < 0.0 { (y, x) } else { (x, y) };
        let shear_z = 1.0 / direction[z];
        Self {
            origin: origin.to_array(),
            inverse,
            inverse_far: inverse.map(|d| d * (1.0 + 4.0 * f32::EPSILON)),
            near: inverse.map(|d| if d < 0.0 { 8 } else { 0 }),
            axes: [x, y, z],
            shear: [direction[x] * shear_z, direction[y] * shear_z, shear_z],
        }
    }
}

/// Triangles of a pack that a ray hits.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub(super) struct PackHits {
    /// Distance by lane; only lanes of the mask are meaningful.
    pub(super) t: [f32; WIDTH],
    /// Weight of the second corner.
    pub(super) u: [f32; WIDTH],
    /// Weight of the third corner.
    pub(super) v: [f32; WIDTH],
    /// Lanes whose triangle is seen from the back.
    pub(super) back: u32,
}

/// An instruction set.
///
/// # Safety
/// The functions may be called only where the processor has the instructions, and are fast only where they are inlined
/// into a function for which the compiler knows that. `node.planes` and `ray.near` must be as [`LocalRay::new`] and
/// [`Node::new`] make them.
#[allow(
    unsafe_code,
    reason = "vector instructions are unsafe to use where the processor lacks them"
)]
pub(super) trait Kernel {
    /// A ray in registers.
    type Ray: Copy;

    /// Fills the registers.
    unsafe fn ray(ray: &LocalRay) -> Self::Ray;

    /// Which boxes the ray meets in \[0, `t_max`\], as a mask; `near` is where it enters those.
    unsafe fn boxes(ray: &Self::Ray, node: &Node, t_max: f32, near: &mut [f32; WIDTH]) -> u32;

    /// Which triangles the ray meets in (0, `t_max`), as a mask; `hits` is meaningful for those.
    unsafe fn triangles(ray: &Self::Ray, pack: &Pack, t_max: f32, hits: &mut PackHits) -> u32;
}
