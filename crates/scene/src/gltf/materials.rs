//! Materials, and what they ask of meshes and textures.

use super::images::Images;
use super::json::{self, AlphaMode, Checked, Info, MaterialExtensions};
use super::source::Source;
use crate::texture::TextureRef;
use crate::{Material, Report, SceneError};
use glam::{Mat2, Vec2, Vec3};

/// The vertex streams a material needs.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Needs {
    /// Bit i: `TEXCOORD_i`.
    pub(super) uv_sets: u8,
    /// Tangents, for a normal map that lies on this set of texture coordinates.
    pub(super) tangents_for: Option<u8>,
}

/// Reads all materials, with textures for the `used` ones, and what each needs. The last entries are those of glTF's
/// default material.
///
/// # Errors
/// [`SceneError::Invalid`] for a texture, image or sampler that does not exist.
pub(super) fn read(
    source: &Source,
    used: &[bool],
    images: &mut Images,
    report: &mut Report,
) -> Result<(Vec<Material>, Vec<Needs>), SceneError> {
    let default = json::Material {
        name: Some("glTF default".into()),
        ..json::Material::default()
    };
    let materials = source.json.materials.iter().chain([&default]);
    materials
        .enumerate()
        .map(|(index, json)| {
            let name = json.name.clone().unwrap_or_else(|| format!("material {index}"));
            let mut reader = MaterialReader {
                source,
                place: format!("material {index} '{name}'"),
                json,
                used: used[index],
                images,
                report,
                needs: Needs::default(),
            };
            Ok((reader.read(name)?, reader.needs))
        })
        .collect()
}

struct MaterialReader<'a> {
    source: &'a Source,
    place: String,
    json: &'a json::Material,
    used: bool,
    images: &'a mut Images,
    report: &'a mut Report,
    needs: Needs,
}

impl<'a> MaterialReader<'a> {
    fn read(&mut self, name: String) -> Result<Material, SceneError> {
        let json = self.json;
        let pbr = &json.pbr_metallic_roughness;
        let unlit = self.is_unlit();
        if unlit && self.used {
            self.report
                .ignore("KHR_materials_unlit (shown as a lit, rough surface of its base colour)");
        }
        let [r, g, b, a] = pbr.base_color_factor.0;
        let base_color = Vec3::from(self.unit("baseColorFactor", [r, g, b]));
        let [metallic, roughness, alpha] = self.unit(
            "metallicFactor, roughnessFactor or alpha",
            [pbr.metallic_factor.0, pbr.roughness_factor.0, a],
        );
        let (dielectric_f0, dielectric_f90) = if unlit { (Vec3::ZERO, 0.0) } else { self.dielectric() };
        let emission = self.emission();
        let mut material = Material {
            base_color,
            metallic: if unlit { 0.0 } else { metallic },
            roughness: if unlit { 1.0 } else { roughness },
            dielectric_f0,
            dielectric_f90,
            emission,
            alpha_cutoff: self.alpha_cutoff()?,
            alpha,
            double_sided: json.double_sided,
            ..Material::lambert(&name, base_color)
        };
        if let Some(archived) = self.extension(|e| e.pbr_specular_glossiness.as_ref()) {
            self.specular_glossiness(archived, &mut material)?;
            return Ok(material);
        }
        if !self.used {
            return Ok(material);
        }
        material.base_color_texture = self.texture(pbr.base_color_texture.as_ref(), true)?;
        if !unlit {
            material.metallic_roughness_texture = self.texture(pbr.metallic_roughness_texture.as_ref(), false)?;
        }
        self.normal_and_emission(&mut material)?;
        Ok(material)
    }

    /// `KHR_materials_pbrSpecularGlossiness`, archived: a dielectric of any reflectance says the same, but for the texture.
    fn specular_glossiness(
        &mut self,
        json: &json::PbrSpecularGlossiness,
        material: &mut Material,
    ) -> Result<(), SceneError> {
        let specular = Vec3::from(self.unit("specularFactor", json.specular_factor.0));
        let [r, g, b, alpha] = self.unit("diffuseFactor", json.diffuse_factor.0);
        let [glossiness] = self.unit("glossinessFactor", [json.glossiness_factor.0]);
        material.base_color = Vec3::new(r, g, b);
        material.alpha = alpha;
        material.metallic = 0.0;
        material.roughness = 1.0 - glossiness;
        material.dielectric_f0 = specular;
        material.dielectric_f90 = 1.0;
        if self.used {
            if json.specular_glossiness_texture.is_some() {
                self.report
                    .ignore("specularGlossinessTexture of KHR_materials_pbrSpecularGlossiness");
            }
            material.base_color_texture = self.texture(json.diffuse_texture.as_ref(), true)?;
            self.normal_and_emission(material)?;
        }
        Ok(())
    }

    fn normal_and_emission(&mut self, material: &mut Material) -> Result<(), SceneError> {
        if !self.is_unlit() {
            self.normal_map(material)?;
        }
        if material.emits() {
            material.emissive_texture = self.texture(self.json.emissive_texture.as_ref(), true)?;
        }
        Ok(())
    }

    fn normal_map(&mut self, material: &mut Material) -> Result<(), SceneError> {
        let Some(json) = &self.json.normal_texture else {
            return Ok(());
        };
        let scale = json.scale;
        if !scale.is_finite() {
            self.report
                .warn(format!("{}: normal scale {scale}, normal map left out", self.place));
        } else if scale != 0.0 {
            material.normal_scale = scale;
            let map = json::normal_map(json).map_err(|error| self.invalid(format!("normalTexture: {error}")))?;
            material.normal_texture = self.texture(Some(&map), false)?;
            self.needs.tangents_for = material.normal_texture.map(|t| t.uv_set);
        }
        Ok(())
    }

    /// Reflectance of the dielectric at normal and grazing incidence (`KHR_materials_ior`, `KHR_materials_specular`).
    fn dielectric(&mut self) -> (Vec3, f32) {
        let ior = self.extension(|e| e.ior.as_ref()).map_or(1.5, |e| e.ior.0);
        let ior = if ior.is_finite() && (ior >= 1.0 || ior == 0.0) {
            ior
        } else {
            self.report.warn(format!("{}: ior {ior}, set to 1.5", self.place));
            1.5
        };
        let f0 = ((ior - 1.0) / (ior + 1.0)).powi(2);
        let Some(specular) = self.extension(|e| e.specular.as_ref()) else {
            return (Vec3::splat(f0), 1.0);
        };
        if self.used {
            for _ in specular.specular_texture.iter().chain(&specular.specular_color_texture) {
                self.report.ignore("textures of KHR_materials_specular");
            }
        }
        let [weight] = self.unit("specularFactor", [specular.specular_factor.0]);
        let color = Vec3::from(specular.specular_color_factor.0);
        let color = if color.is_finite() {
            color.max(Vec3::ZERO)
        } else {
            Vec3::ONE
        };
        ((f0 * color).min(Vec3::ONE) * weight, weight)
    }

    fn emission(&mut self) -> Vec3 {
        let strength = self
            .extension(|e| e.emissive_strength.as_ref())
            .map_or(1.0, |e| e.emissive_strength.0);
        let emission = Vec3::from(self.json.emissive_factor.0) * strength;
        let clean = emission
            .to_array()
            .map(|c| if c.is_finite() && c > 0.0 { c } else { 0.0 });
        if clean != emission.to_array() {
            self.report.warn(format!(
                "{}: emission ({}, {}, {}) is negative or not finite, set to ({}, {}, {})",
                self.place, emission.x, emission.y, emission.z, clean[0], clean[1], clean[2]
            ));
        }
        clean.into()
    }

    fn alpha_cutoff(&mut self) -> Result<Option<f32>, SceneError> {
        Ok(match self.json.alpha_mode {
            Checked::Invalid => return Err(self.invalid("unknown alphaMode")),
            Checked::Valid(AlphaMode::Opaque) => None,
            Checked::Valid(AlphaMode::Mask) => {
                let cutoff = self.json.alpha_cutoff.unwrap_or_default().0;
                Some(if cutoff.is_finite() { cutoff } else { 0.5 })
            }
            Checked::Valid(AlphaMode::Blend) => {
                if self.used {
                    self.report
                        .ignore("alphaMode BLEND (surfaces of alpha below 0.5 are left out, others are opaque)");
                }
                Some(0.5)
            }
        })
    }

    fn extension<T>(&self, pick: impl Fn(&'a MaterialExtensions) -> Option<&'a T>) -> Option<&'a T> {
        self.json.extensions.as_ref().and_then(pick)
    }

    fn is_unlit(&self) -> bool {
        self.extension(|e| e.unlit.as_ref()).is_some()
    }

    fn invalid(&self, problem: impl Into<String>) -> SceneError {
        self.source.invalid(&self.place, problem, "export the file again")
    }

    /// Brings factors into \[0, 1\].
    fn unit<const N: usize>(&mut self, what: &str, values: [f32; N]) -> [f32; N] {
        let clean = values.map(|v| if v > 0.0 { v.min(1.0) } else { 0.0 });
        if clean != values {
            self.report
                .warn(format!("{}: {what} outside 0 to 1, clamped", self.place));
        }
        clean
    }

    fn texture(&mut self, json: Option<&Info>, srgb: bool) -> Result<Option<TextureRef>, SceneError> {
        let Some(json) = json else { return Ok(None) };
        let transform = json.extensions.as_ref().and_then(|e| e.texture_transform.as_ref());
        let set = transform.and_then(|t| t.tex_coord).unwrap_or(json.tex_coord);
        if set > 1 {
            self.report.ignore("textures on TEXCOORD_2 and above");
            return Ok(None);
        }
        let Some(texture) = self
            .images
            .request(self.source, &self.place, json.index, srgb, self.report)?
        else {
            return Ok(None);
        };
        let (columns, offset) = self.transform(transform);
        self.needs.uv_sets |= 1 << set;
        Ok(Some(TextureRef {
            texture,
            uv_set: set as u8,
            columns,
            offset,
        }))
    }

    /// `KHR_texture_transform`: translation x rotation x scale, the rotation counter-clockwise as seen on the image, whose v
    /// runs downwards.
    fn transform(&mut self, json: Option<&json::TextureTransform>) -> (Mat2, Vec2) {
        let Some(json) = json else {
            return (Mat2::IDENTITY, Vec2::ZERO);
        };
        let (sin, cos) = json.rotation.0.sin_cos();
        let columns = Mat2::from_cols(
            Vec2::new(cos, -sin) * json.scale.0[0],
            Vec2::new(sin, cos) * json.scale.0[1],
        );
        let offset = Vec2::from(json.offset.0);
        if columns.is_finite() && offset.is_finite() {
            return (columns, offset);
        }
        self.report
            .warn(format!("{}: texture transform is not finite, left out", self.place));
        (Mat2::IDENTITY, Vec2::ZERO)
    }
}
