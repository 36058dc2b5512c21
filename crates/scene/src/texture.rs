//! Images on surfaces.

use crate::stored::Texels;
use glam::{IVec2, Vec2, Vec4};
use std::sync::LazyLock;

/// How texture coordinates outside \[0, 1) are read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Wrap {
    /// Repeat the image.
    #[default]
    Repeat,
    /// Repeat it, mirrored every other time.
    Mirror,
    /// Stay on the border texel.
    Clamp,
}

/// A texture: 8-bit RGBA texels as in the file, with how to read them. One in a file is decoded when it is first sampled.
#[derive(Clone, Debug)]
pub struct Texture {
    /// Name of the image in the file, for messages.
    pub name: String,
    /// Size in texels, both at least 1.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// `width * height` texels, top row first, RGBA.
    pub texels: Texels,
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

/// Linear value of each sRGB code (IEC 61966-2-1).
static LINEAR_FROM_SRGB: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|code| {
        let c = code as f32 / 255.0;
        if c <= 0.04045 {
            c / 12.92
        } else {
            ((c + 0.055) / 1.055).powf(2.4)
        }
    })
});

/// Linear value of each sRGB code, as bits.
pub(crate) fn linear_from_srgb() -> impl Iterator<Item = u32> {
    LINEAR_FROM_SRGB.iter().map(|value| value.to_bits())
}

impl Texture {
    /// Linear RGBA at `uv` (v runs downwards, as in glTF), filtered and wrapped. Coordinates that are not finite count as
    /// zero.
    pub fn sample(&self, uv: Vec2) -> Vec4 {
        let (x0, x1, fx) = self.wrap[0].texels(uv.x, self.width, self.nearest);
        let (y0, y1, fy) = self.wrap[1].texels(uv.y, self.height, self.nearest);
        if self.srgb {
            let table: &[f32; 256] = &LINEAR_FROM_SRGB;
            let decode = |[r, g, b, a]: [u8; 4]| {
                Vec4::new(
                    table[usize::from(r)],
                    table[usize::from(g)],
                    table[usize::from(b)],
                    f32::from(a) / 255.0,
                )
            };
            self.filter([x0, x1], [y0, y1], Vec2::new(fx, fy), decode)
        } else {
            let decode = |[r, g, b, a]: [u8; 4]| Vec4::new(f32::from(r), f32::from(g), f32::from(b), f32::from(a));
            self.filter([x0, x1], [y0, y1], Vec2::new(fx, fy), decode) / 255.0
        }
    }

    #[inline]
    fn filter(&self, x: [usize; 2], y: [usize; 2], f: Vec2, decode: impl Fn([u8; 4]) -> Vec4) -> Vec4 {
        let texels: &[[u8; 4]] = &self.texels;
        let texel = |x: usize, y: usize| decode(texels[y * self.width as usize + x]);
        if self.nearest {
            return texel(x[0], y[0]);
        }
        let top = texel(x[0], y[0]).lerp(texel(x[1], y[0]), f.x);
        let bottom = texel(x[0], y[1]).lerp(texel(x[1], y[1]), f.x);
        top.lerp(bottom, f.y)
    }
}

impl Wrap {
    /// The two texels around coordinate `u` on an axis of `size` texels, and the weight of the second.
    #[inline]
    fn texels(self, u: f32, size: u32, nearest: bool) -> (usize, usize, f32) {
        let u = if u.is_finite() { u } else { 0.0 };
        let unit = match self {
            Self::Repeat => u - u.floor(),
            Self::Mirror => {
                let pair = u - 2.0 * (0.5 * u).floor();
                if pair > 1.0 { 2.0 - pair } else { pair }
            }
            Self::Clamp => u.clamp(0.0, 1.0),
        };
        let last = size as i32 - 1;
        let x = unit * size as f32 - if nearest { 0.0 } else { 0.5 };
        let floor = x.floor();
        let pair = IVec2::new(floor as i32, floor as i32 + 1);
        let inside = match self {
            // Texel -1 is the last one and texel `size` the first.
            Self::Repeat => IVec2::new(
                if pair.x < 0 { last } else { pair.x.min(last) },
                if pair.y > last { 0 } else { pair.y },
            ),
            Self::Mirror | Self::Clamp => pair.clamp(IVec2::ZERO, IVec2::splat(last)),
        };
        (inside.x as usize, inside.y as usize, x - floor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gradient(wrap: Wrap, nearest: bool) -> Texture {
        let texels: Vec<_> = (0..4).map(|x| [x * 80, 0, 255 - x * 80, 255]).collect();
        Texture {
            name: String::new(),
            width: 4,
            height: 1,
            texels: texels.into(),
            srgb: false,
            wrap: [wrap; 2],
            nearest,
        }
    }

    fn red(texture: &Texture, u: f32) -> f32 {
        texture.sample(Vec2::new(u, 0.3)).x * 255.0
    }

    #[test]
    fn texel_centres_and_the_way_between() {
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            let texture = gradient(wrap, false);
            for x in 0..4 {
                assert!((red(&texture, (x as f32 + 0.5) / 4.0) - 80.0 * x as f32).abs() < 1e-3);
            }
            assert!((red(&texture, 0.5) - 120.0).abs() < 1e-3);
        }
    }

    #[test]
    fn wrapping() {
        // Texel centres left and right of the image.
        let at = |wrap, u| red(&gradient(wrap, true), u).round();
        assert_eq!([-0.125, 1.125, 2.375].map(|u| at(Wrap::Repeat, u)), [240.0, 0.0, 80.0]);
        assert_eq!([-0.125, 1.125, 2.375].map(|u| at(Wrap::Mirror, u)), [0.0, 240.0, 80.0]);
        assert_eq!([-0.375, 1.125, 9.0].map(|u| at(Wrap::Clamp, u)), [0.0, 240.0, 240.0]);
        assert!(
            (red(&gradient(Wrap::Repeat, false), 0.0) - 120.0).abs() < 1e-3,
            "across the seam"
        );
        assert!(red(&gradient(Wrap::Mirror, false), 0.0).abs() < 1e-3);
    }

    #[test]
    fn odd_coordinates_stay_inside() {
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for nearest in [false, true] {
                for u in [f32::NAN, f32::INFINITY, -1e30, 1e30, -1e-30, 1.0 - 1e-7, -0.0, f32::MAX] {
                    let value = red(&gradient(wrap, nearest), u);
                    assert!((0.0..=240.001).contains(&value), "{wrap:?} {u}: {value}");
                }
            }
        }
    }

    #[test]
    fn srgb_is_decoded_and_alpha_is_not() {
        let texture = Texture {
            texels: vec![[188, 0, 255, 128]; 4].into(),
            srgb: true,
            ..gradient(Wrap::Repeat, false)
        };
        let value = texture.sample(Vec2::ZERO);
        assert!(
            value.abs_diff_eq(Vec4::new(0.5029, 0.0, 1.0, 128.0 / 255.0), 1e-4),
            "{value}"
        );
    }
}
