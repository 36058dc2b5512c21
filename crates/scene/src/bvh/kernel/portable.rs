//! Plain arrays: for any processor, and what the other kernels are compared with.

use super::{Instructions, LocalRay, Node, Pack, PackHits, WIDTH};

/// See [`Instructions`].
pub(in super::super) struct Portable;

type Lanes = [f32; WIDTH];

/// Near and far planes of eight boxes by axis, from the rays' origin.
pub(in super::super) struct Planes {
    near: [Lanes; 3],
    far: [Lanes; 3],
}

/// By corner, axis: see [`corners`].
pub(in super::super) type Corners = [[Lanes; 3]; 3];

#[inline(always)]
fn each(f: impl Fn(usize) -> f32) -> Lanes {
    std::array::from_fn(f)
}

#[allow(unsafe_code, reason = "implements an unsafe trait; nothing here is unsafe")]
impl Instructions for Portable {
    type Ray = LocalRay;

    #[inline(always)]
    unsafe fn ray(ray: &LocalRay) -> LocalRay {
        *ray
    }

    #[inline(always)]
    unsafe fn boxes(ray: &LocalRay, node: &Node, t_max: f32, near: &mut Lanes) -> u32 {
        let mut enter = [0.0f32; WIDTH];
        let mut leave = [t_max; WIDTH];
        for axis in 0..3 {
            let offset = node.slabs[axis].origin - ray.origin[axis];
            let (scale_near, offset_near) = (node.slabs[axis].step * ray.inverse[axis], offset * ray.inverse[axis]);
            let (scale_far, offset_far) = (
                node.slabs[axis].step * ray.inverse_far[axis],
                offset * ray.inverse_far[axis],
            );
            let planes = &node.slabs[axis].planes[ray.near[axis]..ray.near[axis] + 16];
            for lane in 0..WIDTH {
                let t_near = f32::from(planes[lane]) * scale_near + offset_near;
                let t_far = f32::from(planes[lane + 8]) * scale_far + offset_far;
                enter[lane] = if t_near > enter[lane] { t_near } else { enter[lane] };
                leave[lane] = if t_far < leave[lane] { t_far } else { leave[lane] };
            }
        }
        *near = enter;
        (0..WIDTH).fold(0, |mask, lane| mask | u32::from(enter[lane] <= leave[lane]) << lane)
    }

    #[inline(always)]
    unsafe fn triangles(ray: &LocalRay, pack: &Pack, t_max: f32, hits: &mut PackHits) -> u32 {
        triangles(&corners(pack, ray), ray.shear, t_max, hits)
    }

    type Planes = Planes;

    #[inline(always)]
    unsafe fn planes(node: &Node, ray: &LocalRay) -> Planes {
        let row = |axis: usize, offset: usize| {
            let slabs = &node.slabs[axis];
            let origin = slabs.origin - ray.origin[axis];
            each(|lane| f32::from(slabs.planes[ray.near[axis] + offset + lane]) * slabs.step + origin)
        };
        Planes {
            near: [row(0, 0), row(1, 0), row(2, 0)],
            far: [row(0, 8), row(1, 8), row(2, 8)],
        }
    }

    #[inline(always)]
    unsafe fn boxes_at(planes: &Planes, inverse: [f32; 3], inverse_far: [f32; 3], t_max: f32, near: &mut Lanes) -> u32 {
        let mut mask = 0;
        for (lane, near) in near.iter_mut().enumerate() {
            let (mut enter, mut leave) = (0.0, t_max);
            for axis in 0..3 {
                let t_near = planes.near[axis][lane] * inverse[axis];
                let t_far = planes.far[axis][lane] * inverse_far[axis];
                enter = if t_near > enter { t_near } else { enter };
                leave = if t_far < leave { t_far } else { leave };
            }
            let meets = enter <= leave;
            *near = if meets && enter < *near { enter } else { *near };
            mask |= u32::from(meets) << lane;
        }
        mask
    }

    type Corners = Corners;

    #[inline(always)]
    unsafe fn corners(pack: &Pack, ray: &LocalRay) -> Corners {
        corners(pack, ray)
    }

    #[inline(always)]
    unsafe fn triangles_at(corners: &Corners, shear: [f32; 3], t_max: f32, hits: &mut PackHits) -> u32 {
        triangles(corners, shear, t_max, hits)
    }

    #[inline(always)]
    unsafe fn reach(near: f32, t_max: &Lanes) -> u32 {
        (0..WIDTH).fold(0, |mask, ray| mask | u32::from(near <= t_max[ray]) << ray)
    }
}

/// The corners of a pack relative to the ray's origin, their axes permuted.
#[inline(always)]
fn corners(pack: &Pack, ray: &LocalRay) -> Corners {
    let row = |corner: usize, axis: usize| {
        let axis = ray.axes[axis];
        each(|lane| pack.corners[corner][axis][lane] - ray.origin[axis])
    };
    [0, 1, 2].map(|corner| [row(corner, 0), row(corner, 1), row(corner, 2)])
}

/// Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection", JCGT 2013.
///
/// Differs: no second try in double precision where an edge function is zero. Rounding never gives the difference
/// of two rounded products a wrong sign, only zero, and zero counts as inside, so that a point on the common edge
/// of two triangles belongs to both and nothing leaks. (Hence no fused multiply-add in the edge functions.)
#[inline(always)]
fn triangles(corners: &Corners, shear: [f32; 3], t_max: f32, hits: &mut PackHits) -> u32 {
    let [shear_x, shear_y, shear_z] = shear;
    let x = corners.map(|[x, _, z]| each(|lane| x[lane] - shear_x * z[lane]));
    let y = corners.map(|[_, y, z]| each(|lane| y[lane] - shear_y * z[lane]));
    let z = corners.map(|[_, _, z]| z);
    let edge = |a: usize, b: usize| each(|lane| x[a][lane] * y[b][lane] - y[a][lane] * x[b][lane]);
    let (weight_0, weight_1, weight_2) = (edge(2, 1), edge(0, 2), edge(1, 0));
    let mut mask = 0;
    hits.back = 0;
    for lane in 0..WIDTH {
        let (w0, w1, w2) = (weight_0[lane], weight_1[lane], weight_2[lane]);
        let det = w0 + w1 + w2;
        let inverse = 1.0 / det;
        let inside = (w0 >= 0.0 && w1 >= 0.0 && w2 >= 0.0) || (w0 <= 0.0 && w1 <= 0.0 && w2 <= 0.0);
        let (u, v) = (w1 * inverse, w2 * inverse);
        let t = (w0 * inverse * z[0][lane] + u * z[1][lane] + v * z[2][lane]) * shear_z;
        (hits.t[lane], hits.u[lane], hits.v[lane]) = (t, u, v);
        mask |= u32::from(inside && det != 0.0 && t > 0.0 && t < t_max) << lane;
        hits.back |= u32::from(det < 0.0) << lane;
    }
    mask
}
