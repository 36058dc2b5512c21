//! The image as a file: formats, layers, and what it tells about itself.

use super::parts::Header;
use super::stats::Stats;
use crate::machine;
use anyhow::{Result, bail};
use clap::ValueEnum;
use glam::Vec3;
use render::image::{self, Channel};
use render::{Film, Settings};
use scene::Scene;
use std::path::Path;

/// Layers besides the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Aov {
    /// diffuse albedo plus specular reflectance (albedo.R .G .B)
    Albedo,
    /// shading normal, world space (normal.X .Y .Z)
    Normal,
    /// distance from the camera in metres (depth.Z)
    Depth,
    /// world position in metres (position.X .Y .Z)
    Position,
    /// index of the light chosen by the last sample, -1 for none (light.V)
    Light,
    /// variance of the pixel's mean luminance (variance.V)
    Variance,
    /// samples that the pixel has taken (samples.V)
    Samples,
}

/// The file formats of images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    /// Linear.
    Exr,
    /// Tone-mapped.
    Png,
    /// The state of the rendering.
    Part,
}

impl Format {
    /// By the ending of a file's name.
    ///
    /// # Errors
    /// Other endings.
    pub(crate) fn of(path: &Path) -> Result<Self> {
        match path
            .extension()
            .and_then(|e| e.to_str())
            .map(str::to_ascii_lowercase)
            .as_deref()
        {
            Some("exr") => Ok(Self::Exr),
            Some("png") => Ok(Self::Png),
            Some("part") => Ok(Self::Part),
            _ => bail!(
                "{}: unknown image format; give a file name that ends in .exr or .png",
                path.display()
            ),
        }
    }
}

/// A rendering that is to be written.
pub(super) struct Made<'m> {
    pub(super) film: &'m Film,
    pub(super) scene: &'m Scene,
    pub(super) stats: &'m Stats,
    pub(super) settings: &'m Settings,
}

/// Writes the film's image: a PNG at that exposure, or an EXR with the layers asked for.
pub(super) fn write(path: &Path, format: Format, aovs: &[Aov], exposure: f32, made: &Made<'_>) -> Result<()> {
    let image = made.film.image();
    if format == Format::Png {
        image::write_png(path, &image, exposure)?;
        return Ok(());
    }
    let mut channels = Channel::rgb("", &image).to_vec();
    layers(aovs, made.film, made.scene, &mut channels);
    let metadata = metadata(made.stats, made.settings)?;
    image::write_exr(path, image.width, image.height, &channels, &metadata)?;
    Ok(())
}

/// The layers asked for, as channels.
fn layers(wanted: &[Aov], film: &Film, scene: &Scene, channels: &mut Vec<Channel>) {
    let one = |name: &str, values: Vec<f32>| Channel {
        name: name.into(),
        values,
    };
    let vector = |layer: &str, image: &render::Image| {
        [("X", 0), ("Y", 1), ("Z", 2)].map(|(axis, c)| Channel {
            name: format!("{layer}.{axis}"),
            values: image.pixels.iter().map(|pixel| pixel[c]).collect(),
        })
    };
    if wanted.contains(&Aov::Variance) {
        channels.push(one("variance.V", film.variance()));
    }
    if wanted.contains(&Aov::Samples) {
        channels.push(one(
            "samples.V",
            film.samples().iter().map(|&count| count as f32).collect(),
        ));
    }
    let Some(mut aovs) = film.aovs() else { return };
    if wanted.contains(&Aov::Albedo) {
        channels.extend(Channel::rgb("albedo", &aovs.albedo));
    }
    if wanted.contains(&Aov::Normal) {
        channels.extend(vector("normal", &aovs.normal));
    }
    if wanted.contains(&Aov::Position) {
        let seen = aovs.position.pixels.iter_mut().zip(&aovs.depth);
        for (position, _) in seen.filter(|(_, depth)| depth.is_finite()) {
            *position = scene.parts.in_file(Vec3::from(*position)).as_vec3().to_array();
        }
        channels.extend(vector("position", &aovs.position));
    }
    if wanted.contains(&Aov::Depth) {
        channels.push(one("depth.Z", aovs.depth));
    }
    if wanted.contains(&Aov::Light) {
        channels.push(one("light.V", aovs.light));
    }
}

/// What an EXR tells about itself: one attribute per figure, and all settings as JSON.
fn metadata(stats: &Stats, settings: &Settings) -> Result<Vec<(String, String)>> {
    let entry = |name: &str, value: String| (format!("manylight.{name}"), value);
    Ok(vec![
        entry("version", machine::VERSION.into()),
        entry("scene", stats.scene.clone()),
        entry("camera", stats.camera.clone()),
        entry("sampler", stats.sampler.into()),
        entry("spp", stats.spp.to_string()),
        entry("seed", stats.seed.to_string()),
        entry("render_s", stats.render_s.to_string()),
        entry("research", stats.research.unwrap_or("no").into()),
        entry("biased", stats.biased.clone().unwrap_or_else(|| "no".into())),
        entry("settings", serde_json::to_string(settings)?),
    ])
}

/// What an EXR that was joined from parts tells about itself.
///
/// # Errors
/// None that can be expected.
pub(crate) fn metadata_of(header: &Header, spp: u64) -> Result<Vec<(String, String)>> {
    let entry = |name: &str, value: String| (format!("manylight.{name}"), value);
    Ok(vec![
        entry("version", machine::VERSION.into()),
        entry("scene", header.scene.clone()),
        entry("camera", header.camera.clone()),
        entry("sampler", header.settings.method.name().into()),
        entry("spp", spp.to_string()),
        entry("settings", serde_json::to_string(&header.settings)?),
    ])
}
