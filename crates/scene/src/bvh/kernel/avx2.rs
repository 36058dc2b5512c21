//! AVX2 with fused multiply-add: one register of eight lanes.

use super::{Instructions, LocalRay, Node, Pack, PackHits, WIDTH};
use std::arch::x86_64::*;

/// Eight lanes of AVX2; see [`Instructions`].
pub(in super::super) struct Avx2;

/// A ray's constants for the box test.
#[derive(Clone, Copy)]
pub(in super::super) struct Ray {
    origin: [__m256; 3],
    inverse: [__m256; 3],
    inverse_far: [__m256; 3],
    near: [usize; 3],
    shape: ShearedRay,
}

/// A ray's constants for the triangle test.
#[derive(Clone, Copy)]
pub(super) struct ShearedRay {
    origin: [__m256; 3],
    shear: [__m256; 3],
    axes: [usize; 3],
}

#[allow(unsafe_code, reason = "vector instructions")]
impl Instructions for Avx2 {
    type Ray = Ray;

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn ray(ray: &LocalRay) -> Ray {
        let all = |x: [f32; 3]| [_mm256_set1_ps(x[0]), _mm256_set1_ps(x[1]), _mm256_set1_ps(x[2])];
        Ray {
            origin: all(ray.origin),
            inverse: all(ray.inverse),
            inverse_far: all(ray.inverse_far),
            near: ray.near,
            shape: sheared(ray),
        }
    }

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn boxes(ray: &Ray, node: &Node, t_max: f32, near: &mut [f32; WIDTH]) -> u32 {
        // SAFETY: the caller knows that the processor has the instructions; offsets are 0 or 8 in rows of 24 bytes, of
        // which 16 are read.
        unsafe {
            let mut enter = _mm256_setzero_ps();
            let mut leave = _mm256_set1_ps(t_max);
            for axis in 0..3 {
                let planes = node.slabs[axis].planes.as_ptr().add(ray.near[axis]);
                let steps = |p: *const u8| _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(_mm_loadl_epi64(p.cast())));
                let step = _mm256_set1_ps(node.slabs[axis].step);
                let offset = _mm256_sub_ps(_mm256_set1_ps(node.slabs[axis].origin), ray.origin[axis]);
                let (inverse, inverse_far) = (ray.inverse[axis], ray.inverse_far[axis]);
                let t_near = _mm256_fmadd_ps(
                    steps(planes),
                    _mm256_mul_ps(step, inverse),
                    _mm256_mul_ps(offset, inverse),
                );
                let t_far = _mm256_fmadd_ps(
                    steps(planes.add(8)),
                    _mm256_mul_ps(step, inverse_far),
                    _mm256_mul_ps(offset, inverse_far),
                );
                enter = _mm256_max_ps(enter, t_near);
                leave = _mm256_min_ps(leave, t_far);
            }
            _mm256_storeu_ps(near.as_mut_ptr(), enter);
            _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(enter, leave)) as u32
        }
    }

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn triangles(ray: &Ray, pack: &Pack, t_max: f32, hits: &mut PackHits) -> u32 {
        // SAFETY: as for this function.
        unsafe { triangles(&ray.shape, pack, t_max, hits) }
    }
}

/// Fills registers for [`triangles`].
#[inline]
#[target_feature(enable = "avx2,fma")]
pub(super) fn sheared(ray: &LocalRay) -> ShearedRay {
    ShearedRay {
        origin: ray.axes.map(|axis| _mm256_set1_ps(ray.origin[axis])),
        shear: [
            _mm256_set1_ps(ray.shear[0]),
            _mm256_set1_ps(ray.shear[1]),
            _mm256_set1_ps(ray.shear[2]),
        ],
        axes: ray.axes,
    }
}

/// As [`super::portable::Portable`] does it.
#[allow(unsafe_code, reason = "vector instructions")]
#[inline]
#[target_feature(enable = "avx2,fma")]
pub(super) unsafe fn triangles(ray: &ShearedRay, pack: &Pack, t_max: f32, hits: &mut PackHits) -> u32 {
    // SAFETY: the caller knows that the processor has the instructions; axes are less than 3.
    unsafe {
        let corner = |corner: usize| {
            let load = |axis: usize| {
                let row = pack.corners[corner].get_unchecked(*ray.axes.get_unchecked(axis));
                _mm256_sub_ps(_mm256_load_ps(row.as_ptr()), ray.origin[axis])
            };
            let z = load(2);
            (
                _mm256_fnmadd_ps(ray.shear[0], z, load(0)),
                _mm256_fnmadd_ps(ray.shear[1], z, load(1)),
                z,
            )
        };
        let (x0, y0, z0) = corner(0);
        let (x1, y1, z1) = corner(1);
        let (x2, y2, z2) = corner(2);
        let edge = |xa, ya, xb, yb| _mm256_sub_ps(_mm256_mul_ps(xa, yb), _mm256_mul_ps(ya, xb));
        let w0 = edge(x2, y2, x1, y1);
        let w1 = edge(x0, y0, x2, y2);
        let w2 = edge(x1, y1, x0, y0);
        let zero = _mm256_setzero_ps();
        let least = _mm256_min_ps(_mm256_min_ps(w0, w1), w2);
        let most = _mm256_max_ps(_mm256_max_ps(w0, w1), w2);
        let front = _mm256_cmp_ps::<_CMP_GE_OQ>(least, zero);
        let back = _mm256_cmp_ps::<_CMP_LE_OQ>(most, zero);
        let inside = _mm256_or_ps(front, back);
        if _mm256_movemask_ps(inside) == 0 {
            return 0;
        }
        let det = _mm256_add_ps(_mm256_add_ps(w0, w1), w2);
        let inverse = _mm256_div_ps(_mm256_set1_ps(1.0), det);
        let u = _mm256_mul_ps(w1, inverse);
        let v = _mm256_mul_ps(w2, inverse);
        let depth = _mm256_mul_ps(_mm256_mul_ps(w0, inverse), z0);
        let depth = _mm256_fmadd_ps(v, z2, _mm256_fmadd_ps(u, z1, depth));
        let t = _mm256_mul_ps(depth, ray.shear[2]);
        let range = _mm256_and_ps(
            _mm256_cmp_ps::<_CMP_GT_OQ>(t, zero),
            _mm256_cmp_ps::<_CMP_LT_OQ>(t, _mm256_set1_ps(t_max)),
        );
        let real = _mm256_and_ps(range, _mm256_cmp_ps::<_CMP_NEQ_OQ>(det, zero));
        let mask = _mm256_movemask_ps(_mm256_and_ps(inside, real)) as u32;
        if mask != 0 {
            _mm256_store_ps(hits.t.as_mut_ptr(), t);
            _mm256_store_ps(hits.u.as_mut_ptr(), u);
            _mm256_store_ps(hits.v.as_mut_ptr(), v);
            hits.back = _mm256_movemask_ps(back) as u32;
        }
        mask
    }
}
