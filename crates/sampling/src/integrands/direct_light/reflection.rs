//! How the receiver reflects.

use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// A diffuse part and a lobe around the mirror direction: `f_r cos(theta) = k_d cos(theta) / pi + k_s (e + 1) / (2 pi) cos^e(alpha)`, `alpha` being the angle to
/// the mirror direction. Each part integrates to its coefficient over its hemisphere.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reflection {
    pub(super) diffuse: f64,
    pub(super) glossy: f64,
    pub(super) exponent: f64,
    /// Unit.
    pub(super) mirror: DVec3,
}

impl Reflection {
    /// Shares the light evenly between both parts; the lobe is about 10 degrees wide and points 40 degrees off the normal.
    pub(super) fn glossy() -> Self {
        let (sin, cos) = 40_f64.to_radians().sin_cos();
        Self {
            diffuse: 0.5,
            glossy: 0.4,
            exponent: 50.0,
            mirror: DVec3::new(sin, 0.0, cos),
        }
    }

    /// BSDF times cosine for light from `wi`; 0 from below.
    pub(super) fn value(&self, wi: DVec3) -> f64 {
        if wi.z > 0.0 { self.lobes(wi) } else { 0.0 }
    }

    /// Density per steradian of [`Reflection::sample`]; directions from below count too.
    pub(super) fn pdf(&self, wi: DVec3) -> f64 {
        self.lobes(wi) / (self.diffuse + self.glossy)
    }

    fn lobes(&self, wi: DVec3) -> f64 {
        let lobe = wi.dot(self.mirror).max(0.0).powf(self.exponent) * (self.exponent + 1.0) / TAU;
        self.diffuse * wi.z.max(0.0) / PI + self.glossy * lobe
    }

    /// A direction with density [`Reflection::pdf`].
    pub(super) fn sample(&self, u: [f64; 2]) -> DVec3 {
        let threshold = self.diffuse / (self.diffuse + self.glossy);
        if u[0] < threshold {
            around(DVec3::Z, (1.0 - u[0] / threshold).sqrt(), u[1])
        } else {
            let rest = (u[0] - threshold) / (1.0 - threshold);
            around(self.mirror, (1.0 - rest).powf(1.0 / (self.exponent + 1.0)), u[1])
        }
    }
}

/// The direction at an angle of this cosine to `axis`, after `turn` of a full turn around it.
pub(super) fn around(axis: DVec3, cos: f64, turn: f64) -> DVec3 {
    let (a, b) = axis.any_orthonormal_pair();
    let radius = (1.0 - cos * cos).max(0.0).sqrt();
    let (y, x) = (TAU * turn).sin_cos();
    (a * x + b * y) * radius + axis * cos
}
