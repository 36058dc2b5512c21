//! AVX-512: the near planes of all children in the lower half of a register, the far ones in the upper half.

use super::avx2::{ShearedRay, sheared, triangles};
use super::{Instructions, LocalRay, Node, Pack, PackHits, WIDTH};
use std::arch::x86_64::*;

/// See [`Instructions`].
pub(in super::super) struct Avx512;

/// A ray's constants.
#[derive(Clone, Copy)]
pub(in super::super) struct Ray {
    origin: [__m512; 3],
    /// Of the near planes; and, negated, of the far planes.
    inverse: [__m512; 3],
    near: [usize; 3],
    shape: ShearedRay,
}

/// The lanes of the far planes.
const FAR: __mmask16 = 0xff00;

#[allow(unsafe_code, reason = "vector instructions")]
impl Instructions for Avx512 {
    type Ray = Ray;

    #[inline]
    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma")]
    unsafe fn ray(ray: &LocalRay) -> Ray {
        // SAFETY: the caller knows that the processor has the instructions.
        unsafe {
            let inverse = |axis: usize| {
                _mm512_mask_blend_ps(
                    FAR,
                    _mm512_set1_ps(ray.inverse[axis]),
                    _mm512_set1_ps(-ray.inverse_far[axis]),
                )
            };
            Ray {
                origin: [
                    _mm512_set1_ps(ray.origin[0]),
                    _mm512_set1_ps(ray.origin[1]),
                    _mm512_set1_ps(ray.origin[2]),
                ],
                inverse: [inverse(0), inverse(1), inverse(2)],
                near: ray.near,
                shape: sheared(ray),
            }
        }
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma")]
    unsafe fn boxes(ray: &Ray, node: &Node, t_max: f32, near: &mut [f32; WIDTH]) -> u32 {
        // SAFETY: the caller knows that the processor has the instructions; offsets are 0 or 8 in rows of 24 bytes, of
        // which 16 are read.
        unsafe {
            let distance = |axis: usize| {
                let planes = node.slabs[axis].planes.as_ptr().add(ray.near[axis]);
                let steps = _mm512_cvtepi32_ps(_mm512_cvtepu8_epi32(_mm_loadu_si128(planes.cast())));
                let scale = _mm512_mul_ps(ray.inverse[axis], _mm512_set1_ps(node.slabs[axis].step));
                let offset = _mm512_sub_ps(ray.origin[axis], _mm512_set1_ps(node.slabs[axis].origin));
                _mm512_fmsub_ps(steps, scale, _mm512_mul_ps(offset, ray.inverse[axis]))
            };
            // The largest of the far planes' negated distances is the negated distance of leaving.
            let limits = _mm512_maskz_mov_ps(FAR, _mm512_set1_ps(-t_max));
            let both = _mm512_max_ps(
                _mm512_max_ps(distance(0), distance(1)),
                _mm512_max_ps(distance(2), limits),
            );
            let enter = _mm512_castps512_ps256(both);
            let leave = _mm512_extractf32x8_ps::<1>(both);
            _mm256_storeu_ps(near.as_mut_ptr(), enter);
            u32::from(_mm256_cmp_ps_mask::<_CMP_LE_OQ>(
                _mm256_add_ps(enter, leave),
                _mm256_setzero_ps(),
            ))
        }
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma")]
    unsafe fn triangles(ray: &Ray, pack: &Pack, t_max: f32, hits: &mut PackHits) -> u32 {
        // SAFETY: as for this function.
        unsafe { triangles(&ray.shape, pack, t_max, hits) }
    }
}
