//! Image files: EXR (linear float32, layers, metadata), PNG (tone-mapped, for people).

use crate::{Image, RenderError};
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Blocks, Compression, Encoding, FlatSamples, Layer, LayerAttributes,
    LineOrder, ReadChannels, ReadLayers, SmallVec, Text, WritableImage,
};
use glam::Vec3;
use image::ImageEncoder;
use scene::luminance;
use std::io::{BufReader, Cursor, Seek};
use std::path::Path;

pub(crate) mod display;

/// One channel of an EXR file: dotted name ("R", "albedo.R", "depth.Z") and `width * height` values.
#[derive(Clone, Debug)]
pub struct Channel {
    /// Name with layer prefix.
    pub name: String,
    /// Values, row 0 first.
    pub values: Vec<f32>,
}

impl Channel {
    /// The three channels of an image: `layer.R`, `layer.G`, `layer.B`, or `R`, `G`, `B` if `layer` is empty.
    pub fn rgb(layer: &str, image: &Image) -> [Self; 3] {
        let dot = if layer.is_empty() { "" } else { "." };
        [(0, "R"), (1, "G"), (2, "B")].map(|(c, suffix)| Self {
            name: format!("{layer}{dot}{suffix}"),
            values: image.pixels.iter().map(|p| p[c]).collect(),
        })
    }
}

/// Writes a float32 scanline EXR (ZIP) with `channels` and text attributes `metadata`, see [`scene::file::write`].
/// Characters that EXR text cannot hold (beyond Latin-1) become '?'.
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
    let pixels = width as usize * height as usize;
    if let Some(odd) = channels.iter().find(|c| c.values.len() != pixels) {
        let reason = format!(
            "channel '{}' has {} values for {pixels} pixels",
            odd.name,
            odd.values.len()
        );
        return Err(write_error(path, reason));
    }
    if pixels == 0 || channels.is_empty() {
        return Err(write_error(path, "no pixels"));
    }
    let list = channels
        .iter()
        .map(|c| AnyChannel::new(text(&c.name), FlatSamples::F32(c.values.clone())));
    let mut attributes = LayerAttributes {
        software_name: Some(text(concat!("manylight ", env!("CARGO_PKG_VERSION")))),
        ..LayerAttributes::default()
    };
    for (name, value) in metadata {
        attributes.other.insert(text(name), AttributeValue::Text(text(value)));
    }
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let layer = Layer::new(
        (width as usize, height as usize),
        attributes,
        encoding,
        AnyChannels::sort(list.collect::<SmallVec<[_; 4]>>()),
    );
    // The writer seeks back to its offset table, which pipes do not allow: the file is made in memory.
    let mut bytes = Cursor::new(Vec::new());
    let image = exr::image::Image::from_layer(layer);
    image
        .write()
        .non_parallel()
        .to_buffered(&mut bytes)
        .map_err(|e| write_error(path, e.to_string()))?;
    write_file(path, &bytes.into_inner())
}

/// Reads the R, G, B channels of an EXR (or Y alone as grey), half or float; everything else in the file is ignored.
///
/// # Errors
/// [`RenderError::Read`].
pub fn read_exr(path: &Path) -> Result<Image, RenderError> {
    let error = |reason: String| RenderError::Read {
        path: path.into(),
        reason,
    };
    let file = std::fs::File::open(path).map_err(|e| error(e.to_string()))?;
    let len = file.metadata().map_err(|e| error(e.to_string()))?.len();
    let mut file = BufReader::new(file);
    let head = exr::meta::MetaData::read_from_buffered(&mut file, false)
        .map_err(|e| error(format!("not a readable EXR: {e}")))?;
    let claimed = head.headers.iter().map(unpacked_bytes).sum::<u128>();
    if claimed > most_bytes(len) {
        return Err(error(format!(
            "claims {claimed} bytes of samples in a file of {len}; it is damaged: copy or render it again"
        )));
    }
    file.rewind().map_err(|e| error(e.to_string()))?;
    let parts = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(file)
        .map_err(|e| error(format!("not a readable EXR: {e}")))?;
    for part in &parts.layer_data {
        let channel = |name: &str| part.channel_data.list.iter().find(|c| c.name.eq(name));
        let found = match (channel("R"), channel("G"), channel("B"), channel("Y")) {
            (Some(r), Some(g), Some(b), _) => [r, g, b],
            (_, _, _, Some(y)) => [y, y, y],
            _ => continue,
        };
        let [r, g, b] = found.map(|c| c.sample_data.values_as_f32());
        let size = |n: usize| u32::try_from(n).map_err(|_| error("larger than 2^32 pixels across".into()));
        return Ok(Image {
            width: size(part.size.width())?,
            height: size(part.size.height())?,
            pixels: r.zip(g).zip(b).map(|((r, g), b)| [r, g, b]).collect(),
        });
    }
    let names: Vec<String> = parts
        .layer_data
        .iter()
        .flat_map(|p| &p.channel_data.list)
        .map(|c| c.name.to_string())
        .collect();
    let names = names.join(", ");
    Err(error(format!(
        "no channels R, G, B and no Y; it has: {names}; export the beauty pass as RGB"
    )))
}

/// Bytes that the samples of a part take in memory, as its header says. The reader allocates them before it looks for them in the file.
fn unpacked_bytes(part: &exr::meta::header::Header) -> u128 {
    let pixels = part.layer_size.width() as u128 * part.layer_size.height() as u128;
    pixels * part.channels.bytes_per_pixel as u128
}

/// More bytes of samples than this do not fit into a file of `len` bytes: deflate packs 1032 into one at most, and other methods not much
/// more of anything but small images of one colour.
fn most_bytes(len: u64) -> u128 {
    const SMALL: u128 = 1 << 26;
    const MOST_PACKED: u128 = 4096;
    SMALL + MOST_PACKED * u128::from(len)
}

/// Writes an sRGB PNG of `image` x 2^`exposure` through the display tone curve, see [`scene::file::write`].
///
/// # Errors
/// [`RenderError::Write`].
pub fn write_png(path: &Path, image: &Image, exposure: f32) -> Result<(), RenderError> {
    let scale = exposure.exp2();
    write_pixels(path, image, |pixel| display::tone_mapped(pixel * scale))
}

/// Writes an sRGB PNG of values in \[0, 1\] without a tone curve: for false colours, see [`scene::file::write`].
///
/// # Errors
/// [`RenderError::Write`].
pub fn write_png_as_is(path: &Path, image: &Image) -> Result<(), RenderError> {
    write_pixels(path, image, |pixel| pixel.to_array().map(display::srgb8))
}

/// The exposure, in stops, that brings an image to a pleasant level: for PNGs when none is asked for. 0 for a black image.
///
/// The geometric mean of the luminances becomes mid-grey (Reinhard et al. 2002, section 3.1). Differs: black pixels
/// (no geometry) do not count, and luminances are first cut to within 6 stops of their median, so that neither a few
/// lamps nor deep shadow decide.
pub fn auto_exposure(image: &Image) -> f32 {
    const KEY: f32 = 0.2;
    const STOPS_FROM_MEDIAN: f32 = 6.0;
    let stops = image.pixels.iter().map(|p| luminance(Vec3::from(*p)).log2());
    let mut stops: Vec<f32> = stops.filter(|s| s.is_finite()).collect();
    if stops.is_empty() {
        return 0.0;
    }
    let middle = stops.len() / 2;
    let median = *stops.select_nth_unstable_by(middle, f32::total_cmp).1;
    let cut = |s: &f32| f64::from(s.clamp(median - STOPS_FROM_MEDIAN, median + STOPS_FROM_MEDIAN));
    let mean = stops.iter().map(cut).sum::<f64>() / stops.len() as f64;
    KEY.log2() - mean as f32
}

fn write_pixels(path: &Path, image: &Image, encode: impl Fn(Vec3) -> [u8; 3]) -> Result<(), RenderError> {
    let pixels: Vec<u8> = image.pixels.iter().flat_map(|p| encode(Vec3::from(*p))).collect();
    let mut bytes = Vec::new();
    image::codecs::png::PngEncoder::new(&mut bytes)
        .write_image(&pixels, image.width, image.height, image::ExtendedColorType::Rgb8)
        .map_err(|e| write_error(path, e.to_string()))?;
    write_file(path, &bytes)
}

/// Writes a whole image file, see [`scene::file::write`].
fn write_file(path: &Path, bytes: &[u8]) -> Result<(), RenderError> {
    scene::file::write(path, |file| file.write_all(bytes)).map_err(|e| write_error(path, e.to_string()))
}

fn write_error(path: &Path, reason: impl Into<String>) -> RenderError {
    RenderError::Write {
        path: path.into(),
        reason: reason.into(),
    }
}

/// EXR text holds Latin-1 only.
fn text(from: &str) -> Text {
    let latin: String = from.chars().map(|c| if u32::from(c) < 256 { c } else { '?' }).collect();
    Text::new_or_none(&latin).unwrap_or_default()
}

#[cfg(test)]
mod tests;
