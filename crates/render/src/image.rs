//! Image files: EXR (linear float32, layers, metadata), PNG (tone-mapped, for people).

use crate::{Image, RenderError};
use std::path::Path;

/// One channel of an EXR file: dotted name ("R", "albedo.R", "depth.Z") and `width * height` values.
#[derive(Clone, Debug)]
pub struct Channel {
    /// Name with layer prefix.
    pub name: String,
    /// Values, row 0 first.
    pub values: Vec<f32>,
}

/// Writes a float32 scanline EXR (ZIP) with `channels` and text attributes `metadata`; beside the target first, then renamed.
///
/// # Errors
/// [`RenderError::Write`].
pub fn write_exr(
    path: &Path,
    width: u32,
    height: u32,
    channels: &[Channel],
    metadata: &[(String, String)],
) -> Result<(), RenderError> {
    let _ = (path, width, height, channels, metadata);
    unimplemented!("owner: render")
}

/// Reads the R, G, B channels of an EXR (or Y alone as grey).
///
/// # Errors
/// [`RenderError::Read`].
pub fn read_exr(path: &Path) -> Result<Image, RenderError> {
    let _ = path;
    unimplemented!("owner: render")
}

/// Writes an sRGB PNG of `image` x 2^`exposure` through the display tone curve; beside the target first, then renamed.
///
/// # Errors
/// [`RenderError::Write`].
pub fn write_png(path: &Path, image: &Image, exposure: f32) -> Result<(), RenderError> {
    let _ = (path, image, exposure);
    unimplemented!("owner: render")
}

/// The exposure, in stops, that brings an image's mean to a pleasant level: for PNGs when none is asked for.
pub fn auto_exposure(image: &Image) -> f32 {
    let _ = image;
    unimplemented!("owner: render")
}
