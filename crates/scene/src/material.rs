//! glTF metallic-roughness materials. At a surface point they become a [`crate::Bsdf`].

use crate::texture::TextureRef;
use glam::Vec3;

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
