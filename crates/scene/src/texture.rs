//! Images on surfaces.

use glam::{Vec2, Vec4};

/// How texture coordinates outside \[0, 1) are read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// Repeat the image.
    #[default]
    Repeat,
    /// Repeat it, mirrored every other time.
    Mirror,
    /// Stay on the border texel.
    Clamp,
}

/// A texture: 8-bit RGBA texels as in the file, with how to read them.
#[derive(Clone, Debug)]
pub struct Texture {
    /// Name of the image in the file, for messages.
    pub name: String,
    /// Size in texels, both at least 1.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// `width * height` texels, top row first, RGBA.
    pub texels: Vec<[u8; 4]>,
    /// Whether RGB is sRGB-encoded (colour) or linear (data such as normals).
    pub srgb: bool,
    /// Wrapping along u and v.
    pub wrap: [Wrap; 2],
    /// Nearest texel instead of bilinear interpolation.
    pub nearest: bool,
}

/// A texture as a material refers to it: which one, which coordinates, transformed how (`KHR_texture_transform`).
#[derive(Clone, Copy, Debug)]
pub struct TextureRef {
    /// Index into [`crate::SceneParts::textures`].
    pub texture: u32,
    /// Which set of texture coordinates: 0 or 1.
    pub uv_set: u8,
    /// `uv' = columns * uv + offset`; identity unless transformed.
    pub columns: glam::Mat2,
    /// See `columns`.
    pub offset: Vec2,
}

impl Texture {
    /// Linear RGBA at `uv` (v runs downwards, as in glTF), filtered and wrapped.
    pub fn sample(&self, uv: Vec2) -> Vec4 {
        let _ = uv;
        unimplemented!("owner: scene loader")
    }
}
