//! PNG and JPEG images as they are in the file: looked at when the scene is loaded, decoded when their texels are needed.

use super::json::{Index, View};
use super::source::{self, Seen, Source};
use crate::SceneError;
use image::{ImageFormat, ImageReader, Limits};
use std::borrow::Cow;
use std::io::Cursor;
use std::path::PathBuf;
use std::sync::Arc;

/// Largest width and height.
const MAX_SIZE: u32 = 16_384;
/// Most bytes of one decoder.
const MAX_BYTES: u64 = 2 * 8 * super::images::MAX_TEXELS;

/// An image whose header was found sound.
#[derive(Debug)]
pub(super) struct Encoded {
    /// For messages: the scene, and the image in it.
    scene: PathBuf,
    label: String,
    at: Place,
    pub(super) width: u32,
    pub(super) height: u32,
}

/// Where the bytes of an image are.
#[derive(Debug)]
enum Place {
    /// Here.
    Memory(Vec<u8>),
    /// In the binary chunk of a scene that has stayed on the disk.
    Chunk(Arc<Source>, Index<View>),
    /// In a file of their own.
    File(Seen),
}

impl Encoded {
    /// Image `index` of the file, called `label`; reads its header.
    ///
    /// # Errors
    /// [`SceneError`] for one that cannot be read, is neither PNG nor JPEG, or is larger than [`MAX_SIZE`].
    pub(super) fn new(source: &Arc<Source>, index: usize, label: String) -> Result<Self, SceneError> {
        let image = &source.json.images[index];
        let at = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => match source.beside(uri, &label)? {
                Some(file) => Place::File(file),
                None => Place::Memory(source.resolve(uri, &label)?),
            },
            (None, Some(view)) if source.is_on_disk(view, &label)? => Place::Chunk(source.clone(), view),
            (None, Some(view)) => Place::Memory(source.view(view, &label)?.into_owned()),
            (None, None) => {
                return Err(source.invalid(label, "has neither URI nor bufferView", "export the file again"));
            }
        };
        let mut encoded = Self {
            scene: source.path().into(),
            label,
            at,
            width: 0,
            height: 0,
        };
        let size = encoded.reader(&encoded.bytes()?)?.into_dimensions();
        (encoded.width, encoded.height) = size.map_err(|error| encoded.undecodable(&error))?;
        Ok(encoded)
    }

    /// Number of texels.
    pub(super) fn texels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// The texels, RGBA, as many as the header tells.
    ///
    /// # Errors
    /// [`SceneError`] for an image that cannot be read any more, or is damaged.
    pub(super) fn decode(&self) -> Result<Vec<[u8; 4]>, SceneError> {
        let image = self
            .reader(&self.bytes()?)?
            .decode()
            .map_err(|error| self.undecodable(&error))?
            .into_rgba8();
        if image.dimensions() != (self.width, self.height) {
            return Err(self.invalid("has another size than its header tells", "replace the image"));
        }
        Ok(image.as_raw().as_chunks().0.to_vec())
    }

    fn bytes(&self) -> Result<Cow<'_, [u8]>, SceneError> {
        match &self.at {
            Place::Memory(bytes) => Ok(bytes.as_slice().into()),
            Place::Chunk(source, view) => {
                source.check_unchanged()?;
                source.view(*view, &self.label)
            }
            Place::File(file) => Ok(file.read(&self.scene, &self.label)?.into()),
        }
    }

    /// A reader of the format that the first bytes tell; media types and file names are often wrong.
    fn reader<'a>(&self, bytes: &'a [u8]) -> Result<ImageReader<Cursor<&'a [u8]>>, SceneError> {
        let format = if bytes.starts_with(b"\x89PNG") {
            ImageFormat::Png
        } else if bytes.starts_with(b"\xff\xd8") {
            ImageFormat::Jpeg
        } else {
            return Err(self.invalid("is neither PNG nor JPEG", "convert the image to PNG or JPEG"));
        };
        let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
        let mut limits = Limits::default();
        limits.max_image_width = Some(MAX_SIZE);
        limits.max_image_height = Some(MAX_SIZE);
        // Sixteen bits and four channels a texel, and as much again for what the decoder keeps.
        limits.max_alloc = Some(MAX_BYTES);
        reader.limits(limits);
        Ok(reader)
    }

    fn undecodable(&self, error: &image::ImageError) -> SceneError {
        self.invalid(
            format!("cannot be decoded: {error}"),
            "replace the image or remove the texture",
        )
    }

    fn invalid(&self, problem: impl Into<String>, remedy: &str) -> SceneError {
        source::invalid(&self.scene, &self.label, problem, remedy)
    }
}
