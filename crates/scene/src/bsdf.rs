//! The BSDF: a Lambert lobe under a GGX lobe.

pub(crate) mod albedo;

use albedo::SpecularAlbedo;
use glam::{Vec2, Vec3};
use sampling::HemisphereGuide;
use sampling::hemisphere::{Frame, cosine_hemisphere};
use std::f32::consts::{FRAC_1_PI, PI};

/// Least GGX alpha: smoother surfaces are rendered as this smooth (a lobe of 0.06 degrees), so that values and densities stay finite.
pub const MIN_ALPHA: f32 = 1e-3;

/// Most that the diffuse lobe is enlarged by at a pair of angles to make up for others. Under a coat that reflects nearly everything the mean
/// of what passes is nearly nothing, and at grazing angles, where a little more passes, the quotient would be thousands. Higher values keep a
/// white base whiter under such coats; lower values bound the weights of samples.
const MOST_COUPLING: f32 = 2.0;

/// A material at one surface point: numbers only. Directions are unit, world space, and point away from the surface;
/// `normal_ws` is the shading normal on the side of `wo`.
///
/// The specular lobe is that of appendix B of the glTF 2.0 specification: GGX with height-correlated masking and Schlick's
/// Fresnel of the half vector; single scattering, so rough metals lose some energy. The diffuse lobe differs: the appendix
/// weighs it by 1 - F of the half vector, which at grazing angles sends out up to 1.6 times the light that comes in. Here it
/// gets exactly what the specular lobe leaves, (1 - E(n.l)) (1 - E(n.v)) / (1 - mean E) with E the specular lobe's directional
/// albedo (C. Kelemen and L. Szirmay-Kalos, "A Microfacet Based Coupled Specular-Matte BRDF Model with Importance
/// Sampling", Eurographics 2001, section 3): reciprocal, never gains, and a white base stays white.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf {
    /// Shading normal on the viewer's side.
    pub normal_ws: Vec3,
    /// Diffuse albedo.
    pub diffuse: Vec3,
    /// Specular reflectance at normal incidence.
    pub f0: Vec3,
    /// Specular reflectance at grazing incidence.
    pub f90: f32,
    /// GGX alpha, at least [`MIN_ALPHA`]; meaningless where `f0` and `f90` are 0.
    pub alpha: f32,
}

/// A direction drawn from a BSDF.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// Drawn direction.
    pub wi_ws: Vec3,
    /// BSDF x cosine, RGB.
    pub value: Vec3,
    /// Density with respect to solid angle.
    pub pdf_solid_angle: f32,
    /// What the density would be without a guide.
    pub pdf_unguided: f32,
}

impl Bsdf {
    /// Whether there is a Lambert lobe only, so that drawing from the BSDF cannot help to find lights.
    #[inline]
    pub fn is_lambert(&self) -> bool {
        self.f90 == 0.0 && self.f0 == Vec3::ZERO
    }

    /// BSDF x |cos|, RGB; 0 if `wi` or `wo` lies below the shading normal.
    #[inline]
    pub fn eval(&self, wo_ws: Vec3, wi_ws: Vec3) -> Vec3 {
        self.eval_pdf(wo_ws, wi_ws).0
    }

    /// Density of [`Bsdf::sample`], solid angle.
    #[inline]
    pub fn pdf(&self, wo_ws: Vec3, wi_ws: Vec3) -> f32 {
        self.eval_pdf(wo_ws, wi_ws).1
    }

    /// [`Bsdf::eval`] and [`Bsdf::pdf`] together, which share most of their work.
    #[inline]
    pub fn eval_pdf(&self, wo_ws: Vec3, wi_ws: Vec3) -> (Vec3, f32) {
        self.eval_pdf_guided(wo_ws, wi_ws, None)
    }

    /// The same if the diffuse lobe is drawn as `guide` says.
    #[inline]
    pub fn eval_pdf_guided(&self, wo_ws: Vec3, wi_ws: Vec3, guide: Option<&HemisphereGuide>) -> (Vec3, f32) {
        let cos_i = self.normal_ws.dot(wi_ws);
        if cos_i <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let lambert = cos_i * FRAC_1_PI;
        let factor = guide.map_or(1.0, |guide| guide.density(self.normal_ws, wi_ws));
        if self.is_lambert() {
            return (self.diffuse * lambert, lambert * factor);
        }
        let (value, pdf) = self.layered(wo_ws, wi_ws, cos_i);
        (value, pdf.specular + pdf.diffuse * factor)
    }

    /// Draws a direction. `u_lobe` in \[0, 1) chooses the lobe, `u` the direction. `None`: absorbed.
    #[inline]
    pub fn sample(&self, wo_ws: Vec3, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        self.sample_guided(wo_ws, u_lobe, u, None)
    }

    /// The same with the diffuse lobe drawn as `guide` says.
    #[inline]
    pub fn sample_guided(
        &self,
        wo_ws: Vec3,
        u_lobe: f32,
        u: Vec2,
        guide: Option<&HemisphereGuide>,
    ) -> Option<BsdfSample> {
        if !self.is_lambert() {
            return self.sample_layered(wo_ws, u_lobe, u, guide);
        }
        let (wi_ws, lambert, factor) = match guide {
            Some(guide) => {
                let (wi_ws, factor) = guide.sample(self.normal_ws, u);
                (wi_ws, self.normal_ws.dot(wi_ws) * FRAC_1_PI, factor)
            }
            None => {
                let local = cosine_hemisphere(u);
                (Frame::new(self.normal_ws).to_world(local), local.z * FRAC_1_PI, 1.0)
            }
        };
        // Rounding can put a guided direction on the horizon.
        (lambert > 0.0).then(|| BsdfSample {
            wi_ws,
            value: self.diffuse * lambert,
            pdf_solid_angle: lambert * factor,
            pdf_unguided: lambert,
        })
    }

    /// Schlick's approximation.
    #[inline]
    fn fresnel(&self, cosine: f32) -> Vec3 {
        let away = (1.0 - cosine).clamp(0.0, 1.0);
        let fifth = (away * away) * (away * away) * away;
        self.f0 + (Vec3::splat(self.f90) - self.f0) * fifth
    }

    /// By the largest channel, so that a tinted coat does not tint what is below.
    #[inline]
    fn specular_albedo(&self) -> SpecularAlbedo {
        SpecularAlbedo::new(self.f0.max_element(), self.f90, self.alpha)
    }

    /// Probability of the specular lobe: its share of the reflected light, where `specular` is its albedo. At least 0.1 and
    /// at most 0.9 while both lobes are there: the share holds for uniform light, and lights are not.
    #[inline]
    fn specular_probability(&self, specular: f32) -> f32 {
        let diffuse = self.diffuse.max_element() * (1.0 - specular);
        if diffuse <= 0.0 {
            return 1.0;
        }
        (specular / (specular + diffuse)).clamp(0.1, 0.9)
    }

    /// Value and density of both lobes; `cos_i` is above 0.
    fn layered(&self, wo_ws: Vec3, wi_ws: Vec3, cos_i: f32) -> (Vec3, LobePdfs) {
        let cos_o = self.normal_ws.dot(wo_ws);
        let half = wo_ws + wi_ws;
        let half_length_sq = half.length_squared();
        if cos_o <= 0.0 || half_length_sq <= 0.0 {
            return (Vec3::ZERO, LobePdfs::default());
        }
        let half = half / half_length_sq.sqrt();
        let alpha_sq = self.alpha * self.alpha;
        // The sine from the cross product: near the peak of a narrow lobe the cosine has no digits left.
        let (cos_h, sin_h_sq) = (self.normal_ws.dot(half), self.normal_ws.cross(half).length_squared());
        let t = sin_h_sq + cos_h * cos_h * alpha_sq;
        let d = alpha_sq / t / (PI * t);
        // Smith's masking as area seen from each direction: (1 + 2 Lambda) cos.
        let seen_o = (cos_o * cos_o + alpha_sq * (1.0 - cos_o * cos_o).max(0.0)).sqrt();
        let seen_i = (cos_i * cos_i + alpha_sq * (1.0 - cos_i * cos_i).max(0.0)).sqrt();
        let visibility = 0.5 / (cos_i * seen_o + cos_o * seen_i);
        let specular = self.fresnel(wo_ws.dot(half)) * (d * visibility * cos_i);
        let pdf_specular = d / (2.0 * (cos_o + seen_o));
        let lambert = cos_i * FRAC_1_PI;
        let albedo = self.specular_albedo();
        let albedo_o = albedo.at(cos_o);
        let probability = self.specular_probability(albedo_o);
        let pdf = LobePdfs {
            specular: probability * pdf_specular,
            diffuse: (1.0 - probability) * lambert,
        };
        let (passing_o, passing_i, mean) = (1.0 - albedo_o, 1.0 - albedo.at(cos_i), 1.0 - albedo.mean());
        // A mirror lets nothing pass: no share of nothing.
        let coupling = if mean > 1e-6 {
            ((passing_i * passing_o).max(0.0) / mean).min(MOST_COUPLING)
        } else {
            0.0
        };
        let diffuse = self.diffuse * (coupling * lambert);
        (specular + diffuse, pdf)
    }

    fn sample_layered(&self, wo_ws: Vec3, u_lobe: f32, u: Vec2, guide: Option<&HemisphereGuide>) -> Option<BsdfSample> {
        let frame = Frame::new(self.normal_ws);
        let cos_o = self.normal_ws.dot(wo_ws);
        let wi_ws = if u_lobe < self.specular_probability(self.specular_albedo().at(cos_o)) {
            let wo = frame.to_local(wo_ws);
            let half = sampling::ggx::sample_vndf(wo, self.alpha, u);
            frame.to_world(half * (2.0 * wo.dot(half)) - wo).normalize()
        } else if let Some(guide) = guide {
            guide.sample(self.normal_ws, u).0
        } else {
            frame.to_world(cosine_hemisphere(u))
        };
        let cos_i = self.normal_ws.dot(wi_ws);
        if cos_i <= 0.0 {
            return None;
        }
        let (value, pdf) = self.layered(wo_ws, wi_ws, cos_i);
        let factor = guide.map_or(1.0, |guide| guide.density(self.normal_ws, wi_ws));
        let pdf_solid_angle = pdf.specular + pdf.diffuse * factor;
        // False for NaN.
        let usable = pdf_solid_angle > 0.0 && pdf_solid_angle < f32::INFINITY && value.is_finite();
        usable.then_some(BsdfSample {
            wi_ws,
            value,
            pdf_solid_angle,
            pdf_unguided: pdf.specular + pdf.diffuse,
        })
    }
}

/// Densities with respect to solid angle, times the probability of the lobe.
#[derive(Clone, Copy, Default)]
struct LobePdfs {
    specular: f32,
    diffuse: f32,
}

#[cfg(test)]
mod tests;
