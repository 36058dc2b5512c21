//! Images: asked for by materials, then made textures of.

use super::encoded::Encoded;
use super::json::{self, Checked, Index, MagFilter, WrappingMode};
use super::source::Source;
use crate::stored::Texels;
use crate::texture::{Texture, Wrap};
use crate::{Memory, Report, SceneError};
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Most texels of all textures together: 2 GiB. A small file can claim huge images, and well-packed ones are huge.
pub(super) const MAX_TEXELS: u64 = 1 << 29;
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

    /// The textures that were asked for, none of them decoded. Uses of one image that differ are decoded each by itself; what they were to
    /// take is counted against [`MAX_TEXELS`] here.
    ///
    /// # Errors
    /// [`SceneError`] naming the first image that cannot be read or whose header is not sound.
    pub(super) fn textures(self, source: &Arc<Source>, memory: &Arc<Memory>) -> Result<Vec<Texture>, SceneError> {
        let mut encoded: BTreeMap<usize, Arc<Encoded>> = BTreeMap::new();
        let mut textures: Vec<(u32, Texture)> = Vec::new();
        let mut texels = 0;
        for (key, number) in self.numbers {
            let image = match encoded.entry(key.image) {
                Entry::Occupied(known) => known.into_mut(),
                Entry::Vacant(new) => new.insert(Encoded::new(source, key.image, label(source, key.image))?.into()),
            };
            texels += image.texels();
            if texels > MAX_TEXELS {
                return Err(source.invalid(
                    label(source, key.image),
                    format!("the images of the file have more than {MAX_TEXELS} texels"),
                    "use smaller images",
                ));
            }
            let count = image.texels() as usize;
            let (width, height, image) = (image.width, image.height, image.clone());
            let texture = Texture {
                name: name(source, key.image),
                width,
                height,
                texels: Texels::deferred(count, memory.clone(), move || image.decode()),
                srgb: key.srgb,
                wrap: key.wrap,
                nearest: key.nearest,
            };
            textures.push((number, texture));
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

fn name(source: &Source, index: usize) -> String {
    let image = &source.json.images[index];
    let uri = image.uri.as_deref().filter(|uri| !uri.starts_with("data:"));
    image.name.as_deref().or(uri).unwrap_or_default().into()
}

fn label(source: &Source, index: usize) -> String {
    format!("image {index} '{}'", name(source, index))
}
