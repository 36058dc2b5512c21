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

/// Near and far planes of eight boxes by axis, from the rays' origin.
pub(in super::super) struct Planes {
    near: [__m256; 3],
    far: [__m256; 3],
}

/// By corner, axis: see [`corners`].
pub(in super::super) type Corners = [[__m256; 3]; 3];

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
        // SAFETY: axes are less than 3.
        let corners = unsafe { corners(pack, &ray.shape.origin, &ray.shape.axes) };
        triangles(&corners, &ray.shape.shear, t_max, hits)
    }

    type Planes = Planes;

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn planes(node: &Node, ray: &LocalRay) -> Planes {
        let row = |axis: usize, offset: usize| {
            let slabs = &node.slabs[axis];
            // SAFETY: as in `boxes`.
            let steps = unsafe { _mm_loadl_epi64(slabs.planes.as_ptr().add(ray.near[axis] + offset).cast()) };
            let steps = _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(steps));
            let origin = _mm256_set1_ps(slabs.origin - ray.origin[axis]);
            _mm256_fmadd_ps(steps, _mm256_set1_ps(slabs.step), origin)
        };
        Planes {
            near: [row(0, 0), row(1, 0), row(2, 0)],
            far: [row(0, 8), row(1, 8), row(2, 8)],
        }
    }

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn boxes_at(
        planes: &Planes,
        inverse: [f32; 3],
        inverse_far: [f32; 3],
        t_max: f32,
        near: &mut [f32; WIDTH],
    ) -> u32 {
        let at = |planes: &[__m256; 3], inverse: &[f32; 3], axis: usize| {
            _mm256_mul_ps(planes[axis], _mm256_set1_ps(inverse[axis]))
        };
        let mut enter = _mm256_setzero_ps();
        let mut leave = _mm256_set1_ps(t_max);
        for axis in 0..3 {
            enter = _mm256_max_ps(enter, at(&planes.near, &inverse, axis));
            leave = _mm256_min_ps(leave, at(&planes.far, &inverse_far, axis));
        }
        let meets = _mm256_cmp_ps::<_CMP_LE_OQ>(enter, leave);
        // SAFETY: `near` holds eight numbers.
        unsafe {
            let nearest = _mm256_loadu_ps(near.as_ptr());
            let lowered = _mm256_blendv_ps(nearest, _mm256_min_ps(nearest, enter), meets);
            _mm256_storeu_ps(near.as_mut_ptr(), lowered);
        }
        _mm256_movemask_ps(meets) as u32
    }

    type Corners = Corners;

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn corners(pack: &Pack, ray: &LocalRay) -> Corners {
        let origin = |axis: usize| _mm256_set1_ps(ray.origin[ray.axes[axis]]);
        // SAFETY: axes are less than 3.
        unsafe { corners(pack, &[origin(0), origin(1), origin(2)], &ray.axes) }
    }

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn triangles_at(corners: &Corners, shear: [f32; 3], t_max: f32, hits: &mut PackHits) -> u32 {
        let shear = [
            _mm256_set1_ps(shear[0]),
            _mm256_set1_ps(shear[1]),
            _mm256_set1_ps(shear[2]),
        ];
        triangles(corners, &shear, t_max, hits)
    }

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn reach(near: f32, t_max: &[f32; WIDTH]) -> u32 {
        // SAFETY: `t_max` holds eight numbers.
        let t_max = unsafe { _mm256_loadu_ps(t_max.as_ptr()) };
        _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(_mm256_set1_ps(near), t_max)) as u32
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

/// The corners of a pack relative to `origin`, their axes permuted.
///
/// # Safety
/// Axes must be less than 3.
#[allow(unsafe_code, reason = "vector instructions")]
#[inline]
#[target_feature(enable = "avx2,fma")]
unsafe fn corners(pack: &Pack, origin: &[__m256; 3], axes: &[usize; 3]) -> Corners {
    let row = |corner: usize, axis: usize| {
        // SAFETY: as the caller promises.
        let row = unsafe { _mm256_load_ps(pack.corners[corner].get_unchecked(axes[axis]).as_ptr()) };
        _mm256_sub_ps(row, origin[axis])
    };
    let corner = |corner: usize| [row(corner, 0), row(corner, 1), row(corner, 2)];
    [corner(0), corner(1), corner(2)]
}

/// As [`super::portable::Portable`] does it.
#[allow(unsafe_code, reason = "vector instructions")]
#[inline]
#[target_feature(enable = "avx2,fma")]
fn triangles(corners: &Corners, shear: &[__m256; 3], t_max: f32, hits: &mut PackHits) -> u32 {
    let corner = |corner: usize| {
        let [x, y, z] = corners[corner];
        (_mm256_fnmadd_ps(shear[0], z, x), _mm256_fnmadd_ps(shear[1], z, y), z)
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
    let t = _mm256_mul_ps(depth, shear[2]);
    let range = _mm256_and_ps(
        _mm256_cmp_ps::<_CMP_GT_OQ>(t, zero),
        _mm256_cmp_ps::<_CMP_LT_OQ>(t, _mm256_set1_ps(t_max)),
    );
    let real = _mm256_and_ps(range, _mm256_cmp_ps::<_CMP_NEQ_OQ>(det, zero));
    let mask = _mm256_movemask_ps(_mm256_and_ps(inside, real)) as u32;
    if mask != 0 {
        // SAFETY: rows of eight numbers, aligned.
        unsafe {
            _mm256_store_ps(hits.t.as_mut_ptr(), t);
            _mm256_store_ps(hits.u.as_mut_ptr(), u);
            _mm256_store_ps(hits.v.as_mut_ptr(), v);
        }
        hits.back = _mm256_movemask_ps(back) as u32;
    }
    mask
}
