//! Plain arrays: for any processor, and what the other kernels are compared with.

use super::{Instructions, LocalRay, Node, Pack, PackHits, WIDTH};

/// See [`Instructions`].
pub(in super::super) struct Portable;

type Lanes = [f32; WIDTH];

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

    /// Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection", JCGT 2013.
    ///
    /// Differs: no second try in double precision where an edge function is zero. Rounding never gives the difference
    /// of two rounded products a wrong sign, only zero, and zero counts as inside, so that a point on the common edge
    /// of two triangles belongs to both and nothing leaks. (Hence no fused multiply-add in the edge functions.)
    #[inline(always)]
    unsafe fn triangles(ray: &LocalRay, pack: &Pack, t_max: f32, hits: &mut PackHits) -> u32 {
        let [x_axis, y_axis, z_axis] = ray.axes;
        let [shear_x, shear_y, shear_z] = ray.shear;
        let mut x = [[0.0; WIDTH]; 3];
        let mut y = x;
        let mut z = x;
        for corner in 0..3 {
            let position = &pack.corners[corner];
            for lane in 0..WIDTH {
                z[corner][lane] = position[z_axis][lane] - ray.origin[z_axis];
                x[corner][lane] = (position[x_axis][lane] - ray.origin[x_axis]) - shear_x * z[corner][lane];
                y[corner][lane] = (position[y_axis][lane] - ray.origin[y_axis]) - shear_y * z[corner][lane];
            }
        }
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
}
