//! The two inner loops of ray tracing, one node and one pack of triangles at a time, once per instruction set.

#[cfg(target_arch = "x86_64")]
pub(super) mod avx2;
pub(super) mod portable;

use super::node::{Node, WIDTH};
use super::pack::Pack;
use glam::Vec3;

/// Which vector instructions the queries use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// Whatever the compiler makes of loops over eight numbers; any processor.
    Portable,
    /// AVX2 and fused multiply-add: Intel from 2013, AMD from 2015.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// AVX-512 F, VL, DQ and BW at 256 bits: Intel servers from 2017, AMD from 2022. The source is that of AVX2; the
    /// compiler finds broadcasting operands, mask registers and twice the registers. (Near and far planes in the halves
    /// of one 512-bit register measured a tenth slower.)
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Kernel {
    /// Those that this processor has, the fastest last.
    pub fn available() -> Vec<Self> {
        #[allow(unused_mut, reason = "only x86-64 has more")]
        let mut kernels = vec![Self::Portable];
        #[cfg(target_arch = "x86_64")]
        {
            // All that the kernels are compiled with (`compile!` in the parent module).
            if is_x86_feature_detected!("avx2")
                && is_x86_feature_detected!("fma")
                && is_x86_feature_detected!("bmi1")
                && is_x86_feature_detected!("bmi2")
                && is_x86_feature_detected!("lzcnt")
            {
                kernels.push(Self::Avx2);
                if is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512vl")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512bw")
                {
                    kernels.push(Self::Avx512);
                }
            }
        }
        kernels
    }

    /// Short name, for tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Portable => "portable",
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => "avx512",
        }
    }
}

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
    /// Reciprocal of a component of a direction; finite.
    #[inline(always)]
    pub(super) fn inverse(component: f32) -> f32 {
        /// Smallest component; smaller ones would make infinite reciprocals, and those NaN.
        const SMALLEST: f32 = 1e-20;
        1.0 / component.abs().max(SMALLEST).copysign(component)
    }

    /// [`LocalRay::inverse_far`] from [`LocalRay::inverse`].
    #[inline(always)]
    pub(super) fn enlarged(inverse: f32) -> f32 {
        inverse * (1.0 + 4.0 * f32::EPSILON)
    }

    /// `direction` of any length but zero.
    #[inline(always)]
    pub(super) fn new(origin: Vec3, direction: Vec3) -> Self {
        /// By largest axis, and whether the direction goes down it: the three axes in an order that keeps the winding.
        static AXES: [[[usize; 3]; 2]; 3] = [[[1, 2, 0], [2, 1, 0]], [[2, 0, 1], [0, 2, 1]], [[0, 1, 2], [1, 0, 2]]];
        // Indices and tables instead of branches: nothing predicts the largest axis of a shadow ray.
        let size = direction.abs();
        let largest_of_rest = if size.y > size.z { 1 } else { 2 };
        let largest = if size.x > size.y.max(size.z) {
            0
        } else {
            largest_of_rest
        };
        let direction = direction.to_array();
        let axes = AXES[largest][(direction[largest].to_bits() >> 31) as usize];
        let inverse = direction.map(Self::inverse);
        let shear_z = 1.0 / direction[largest];
        Self {
            origin: origin.to_array(),
            inverse,
            inverse_far: inverse.map(Self::enlarged),
            // 8 from the sign bit.
            near: inverse.map(|d| (d.to_bits() >> 31 << 3) as usize),
            axes,
            shear: [direction[axes[0]] * shear_z, direction[axes[1]] * shear_z, shear_z],
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
/// into a function for which the compiler knows that. `node.slabs` and `ray.near` must be as [`LocalRay::new`] and
/// [`Node::new`] make them.
#[allow(
    unsafe_code,
    reason = "vector instructions are unsafe to use where the processor lacks them"
)]
pub(super) trait Instructions {
    /// A ray in registers.
    type Ray: Copy;

    /// Fills the registers.
    unsafe fn ray(ray: &LocalRay) -> Self::Ray;

    /// Which boxes the ray meets in \[0, `t_max`\], as a mask; `near` is where it enters those.
    unsafe fn boxes(ray: &Self::Ray, node: &Node, t_max: f32, near: &mut [f32; WIDTH]) -> u32;

    /// Which triangles the ray meets in (0, `t_max`), as a mask; `hits` is meaningful for those.
    unsafe fn triangles(ray: &Self::Ray, pack: &Pack, t_max: f32, hits: &mut PackHits) -> u32;

    /// The planes of a node's boxes, from the origin of rays that share it and their directions' signs.
    type Planes;

    /// Computes them for rays like `ray`.
    unsafe fn planes(node: &Node, ray: &LocalRay) -> Self::Planes;

    /// As [`Instructions::boxes`] for one of these rays; `near` is lowered for the boxes that it meets.
    unsafe fn boxes_at(
        planes: &Self::Planes,
        inverse: [f32; 3],
        inverse_far: [f32; 3],
        t_max: f32,
        near: &mut [f32; WIDTH],
    ) -> u32;

    /// The corners of a pack, from the origin of rays that share it and their directions' largest axis.
    type Corners;

    /// Computes them for rays like `ray`.
    unsafe fn corners(pack: &Pack, ray: &LocalRay) -> Self::Corners;

    /// As [`Instructions::triangles`] for one of these rays.
    unsafe fn triangles_at(corners: &Self::Corners, shear: [f32; 3], t_max: f32, hits: &mut PackHits) -> u32;

    /// Which of eight rays that end at `t_max` reach the distance `near`, as a mask.
    unsafe fn reach(near: f32, t_max: &[f32; WIDTH]) -> u32;
}
