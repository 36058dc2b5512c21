//! glTF metallic-roughness materials and their BSDF.
//!
//! A Lambert lobe and a GGX lobe with Schlick's Fresnel, layered as appendix B of the glTF 2.0 specification has it.

use crate::texture::TextureRef;
use glam::{Vec2, Vec3};

/// A material as loaded: factors, and the textures that modulate them.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name in the file; may be empty.
    pub name: String,
    /// Linear RGB albedo factor, each in \[0, 1\].
    pub base_color: Vec3,
    /// 0 dielectric .. 1 metal.
    pub metallic: f32,
    /// Perceptual roughness in \[0, 1\]; alpha of GGX is its square.
    pub roughness: f32,
    /// Normal-incidence reflectance of the dielectric, from `ior` and `KHR_materials_specular`; 0 = pure Lambert.
    pub dielectric_f0: Vec3,
    /// Grazing reflectance of the dielectric (`specularFactor`).
    pub dielectric_f90: f32,
    /// Emitted radiance, linear RGB: `emissiveFactor` x `emissiveStrength`. Finite, at least 0.
    pub emission: Vec3,
    /// Surface is invisible where alpha is below this (glTF alphaMode MASK); `None` = opaque.
    pub alpha_cutoff: Option<f32>,
    /// Alpha factor of the base colour.
    pub alpha: f32,
    /// Seen, and emitting, from both sides. Otherwise rays pass through its back as if it were not there (glTF 2.0
    /// section 3.9.6, back-face culling).
    pub double_sided: bool,
    /// Base colour (RGB) and alpha, sRGB.
    pub base_color_texture: Option<TextureRef>,
    /// G = roughness, B = metallic, linear.
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Tangent-space normals, linear.
    pub normal_texture: Option<TextureRef>,
    /// Scale of the x and y of the normal map.
    pub normal_scale: f32,
    /// Multiplies `emission`, sRGB.
    pub emissive_texture: Option<TextureRef>,
}

impl Material {
    /// A Lambert surface, double-sided.
    pub fn lambert(name: &str, base_color: Vec3) -> Self {
        Self {
            name: name.into(),
            base_color,
            metallic: 0.0,
            roughness: 1.0,
            dielectric_f0: Vec3::ZERO,
            dielectric_f90: 0.0,
            emission: Vec3::ZERO,
            alpha_cutoff: None,
            alpha: 1.0,
            double_sided: true,
            base_color_texture: None,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            emissive_texture: None,
        }
    }

    /// A black one-sided emitter of the given radiance.
    pub fn emitter(name: &str, radiance: Vec3) -> Self {
        Self {
            emission: radiance,
            double_sided: false,
            ..Self::lambert(name, Vec3::ZERO)
        }
    }

    /// Whether light can leave it.
    pub fn emits(&self) -> bool {
        self.emission.max_element() > 0.0
    }
}

/// A material at one surface point: numbers only. Directions are unit, world space, and point away from the surface;
/// `normal_ws` is the shading normal on the side of `wo`.
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
    /// GGX alpha; meaningless where `f0` and `f90` are 0.
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
}

impl Bsdf {
    /// Whether there is a Lambert lobe only, so that drawing from the BSDF cannot help to find lights.
    pub fn is_lambert(&self) -> bool {
        self.f90 == 0.0 && self.f0 == Vec3::ZERO
    }

    /// BSDF x |cos|, RGB; 0 if `wi` lies below the shading normal.
    pub fn eval(&self, wo_ws: Vec3, wi_ws: Vec3) -> Vec3 {
        let _ = (wo_ws, wi_ws);
        unimplemented!("owner: scene loader")
    }

    /// Density of [`Bsdf::sample`], solid angle.
    pub fn pdf(&self, wo_ws: Vec3, wi_ws: Vec3) -> f32 {
        let _ = (wo_ws, wi_ws);
        unimplemented!("owner: scene loader")
    }

    /// Draws a direction. `u_lobe` in \[0, 1) chooses the lobe, `u` the direction. `None`: absorbed.
    pub fn sample(&self, wo_ws: Vec3, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        let _ = (wo_ws, u_lobe, u);
        unimplemented!("owner: scene loader")
    }
}
