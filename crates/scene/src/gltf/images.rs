//! Images: asked for by materials, then decoded once each, in parallel.

use super::json::{self, Checked, Index, MagFilter, WrappingMode};
use super::source::Source;
use crate::texture::{Texture, Wrap};
use crate::{Report, SceneError};
use image::{ImageFormat, ImageReader, Limits};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::io::Cursor;

/// Largest width and height.
const MAX_SIZE: u32 = 16_384;
/// Most texels of all images together: 2 GiB. A small file can claim huge images, and well-packed ones are huge.
const MAX_TEXELS: u64 = 1 << 29;
/// What the records have for a texture without a source.
const NO_IMAGE: usize = u32::MAX as usize;

/// What makes two uses of an image one texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Use {
    image: usize,
    srgb: bool,
    wrap: [Wrap; 2],
    nearest: bool,
}

/// The textures that used materials ask for, numbered in the order of the first request.
#[derive(Debug, Default)]
pub(super) struct Images {
    numbers: BTreeMap<Use, u32>,
}

impl Images {
    /// The number that texture `index` of the file will have, read as colour (`srgb`) or data; `None`, with a warning,
    /// if the texture names no image.
    pub(super) fn request(
        &mut self,
        source: &Source,
        place: &str,
        index: Index<json::Texture>,
        srgb: bool,
        report: &mut Report,
    ) -> Result<Option<u32>, SceneError> {
        let (json, index) = (&source.json, index.value());
        let texture = json
            .textures
            .get(index)
            .ok_or_else(|| source.no_such(place, "texture", index, json.textures.len()))?;
        let what = format!("texture {index}");
        let image = texture.source.value();
        if image == NO_IMAGE {
            report.warn(format!("{place}: {what} names no PNG or JPEG image, left out"));
            return Ok(None);
        }
        if image >= json.images.len() {
            return Err(source.no_such(what, "image", image, json.images.len()));
        }
        let mut key = Use {
            image,
            srgb,
            wrap: [Wrap::Repeat; 2],
            nearest: false,
        };
        if let Some(number) = texture.sampler.map(|sampler| sampler.value()) {
            let sampler = json
                .samplers
                .get(number)
                .ok_or_else(|| source.no_such(what, "sampler", number, json.samplers.len()))?;
            let (Checked::Valid(s), Checked::Valid(t)) = (sampler.wrap_s, sampler.wrap_t) else {
                return Err(source.invalid(
                    format!("sampler {number}"),
                    "unknown wrapping mode",
                    "export the file again",
                ));
            };
            key.wrap = [s, t].map(wrap);
            key.nearest = sampler.mag_filter == Some(Checked::Valid(MagFilter::Nearest));
        }
        let next = self.numbers.len() as u32;
        Ok(Some(*self.numbers.entry(key).or_insert(next)))
    }

    /// How many different images were asked for.
    pub(super) fn distinct(&self) -> usize {
        let images: BTreeSet<usize> = self.numbers.keys().map(|key| key.image).collect();
        images.len()
    }

    /// Decodes what was asked for.
    ///
    /// # Errors
    /// [`SceneError`] naming the first image that cannot be read or decoded.
    pub(super) fn decode(self, source: &Source) -> Result<Vec<Texture>, SceneError> {
        let mut uses: BTreeMap<usize, Vec<(u32, Use)>> = BTreeMap::new();
        for (key, number) in self.numbers {
            uses.entry(key.image).or_default().push((number, key));
        }
        let files: Vec<(usize, Vec<u8>)> = uses
            .keys()
            .map(|&index| Ok((index, encoded(source, index)?)))
            .collect::<Result<_, SceneError>>()?;
        let mut texels = 0;
        for (index, bytes) in &files {
            let (width, height) = reader(source, *index, bytes)?
                .into_dimensions()
                .map_err(|error| undecodable(source, *index, &error))?;
            texels += u64::from(width) * u64::from(height);
            if texels > MAX_TEXELS {
                return Err(source.invalid(
                    label(source, *index),
                    format!("the images of the file have more than {MAX_TEXELS} texels"),
                    "use smaller images",
                ));
            }
        }
        let decoded: Vec<Texture> = files
            .par_iter()
            .map(|(index, bytes)| decode(source, *index, bytes))
            .collect::<Result<_, SceneError>>()?;
        let mut textures: Vec<(u32, Texture)> = Vec::new();
        for (texture, uses) in decoded.into_iter().zip(uses.into_values()) {
            let (last, others) = uses.split_last().expect("an image is listed because of a use");
            textures.extend(
                others
                    .iter()
                    .map(|(number, key)| (*number, finish(texture.clone(), key))),
            );
            textures.push((last.0, finish(texture, &last.1)));
        }
        textures.sort_by_key(|(number, _)| *number);
        Ok(textures.into_iter().map(|(_, texture)| texture).collect())
    }
}

fn wrap(mode: WrappingMode) -> Wrap {
    match mode {
        WrappingMode::Repeat => Wrap::Repeat,
        WrappingMode::MirroredRepeat => Wrap::Mirror,
        WrappingMode::ClampToEdge => Wrap::Clamp,
    }
}

fn finish(texture: Texture, key: &Use) -> Texture {
    Texture {
        srgb: key.srgb,
        wrap: key.wrap,
        nearest: key.nearest,
        ..texture
    }
}

fn name(source: &Source, index: usize) -> String {
    let image = &source.json.images[index];
    let uri = image.uri.as_deref().filter(|uri| !uri.starts_with("data:"));
    image.name.as_deref().or(uri).unwrap_or_default().into()
}

fn label(source: &Source, index: usize) -> String {
    format!("image {index} '{}'", name(source, index))
}

fn encoded(source: &Source, index: usize) -> Result<Vec<u8>, SceneError> {
    let image = &source.json.images[index];
    let label = label(source, index);
    match (&image.uri, image.buffer_view) {
        (Some(uri), _) => source.resolve(uri, &label),
        (None, Some(view)) => Ok(source.view(view, &label)?.into_owned()),
        (None, None) => Err(source.invalid(label, "has neither URI nor bufferView", "export the file again")),
    }
}

/// A reader of the format that the first bytes tell; media types and file names are often wrong.
fn reader<'a>(source: &Source, index: usize, bytes: &'a [u8]) -> Result<ImageReader<Cursor<&'a [u8]>>, SceneError> {
    let format = if bytes.starts_with(b"\x89PNG") {
        ImageFormat::Png
    } else if bytes.starts_with(b"\xff\xd8") {
        ImageFormat::Jpeg
    } else {
        return Err(source.invalid(
            label(source, index),
            "is neither PNG nor JPEG",
            "convert the image to PNG or JPEG",
        ));
    };
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIZE);
    limits.max_image_height = Some(MAX_SIZE);
    // Sixteen bits and four channels a texel, and as much again for what the decoder keeps.
    limits.max_alloc = Some(2 * 8 * MAX_TEXELS);
    reader.limits(limits);
    Ok(reader)
}

fn undecodable(source: &Source, index: usize, error: &image::ImageError) -> SceneError {
    source.invalid(
        label(source, index),
        format!("cannot be decoded: {error}"),
        "replace the image or remove the texture",
    )
}

fn decode(source: &Source, index: usize, bytes: &[u8]) -> Result<Texture, SceneError> {
    let image = reader(source, index, bytes)?
        .decode()
        .map_err(|error| undecodable(source, index, &error))?
        .into_rgba8();
    Ok(Texture {
        name: name(source, index),
        width: image.width(),
        height: image.height(),
        texels: image.as_raw().as_chunks().0.to_vec(),
        srgb: false,
        wrap: [Wrap::Repeat; 2],
        nearest: false,
    })
}
