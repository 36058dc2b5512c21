//! References: rendered by `exact`, kept on disk.

use crate::interrupt::Watch;
use crate::session::{self, Budget};
use crate::{machine, message, output, table};
use anyhow::{Context, Result, bail};
use render::image::{self, Channel};
use render::{Image, ImageError, Method, Settings};
use scene::{Camera, Scene};
use serde::{Deserialize, Serialize};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// An image to measure against.
#[derive(Clone, Debug)]
pub(super) struct Reference {
    /// The image.
    pub(super) image: Image,
    /// What is known about it.
    pub(super) facts: Facts,
}

/// What is known about a reference; kept beside it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Facts {
    /// Where it comes from.
    pub(super) origin: String,
    /// Samples per pixel; 0 if unknown.
    pub(super) spp: u64,
    /// Its own expected relMSE, in the units of [`render::ImageError::relmse`]; `None` if unknown. This
    /// much is part of every error measured against it.
    pub(super) own_relmse: Option<f64>,
}

/// References draw other random numbers than any run: an error shared by both would not be seen.
const SEED: u64 = 0x9E37_79B9_7F4A_7C15;

/// The user's cache folder for references, or one below `output` where there is none.
pub(super) fn default_cache(output: &Path) -> PathBuf {
    let variable = |name| {
        std::env::var_os(name)
            .filter(|value| !value.is_empty())
            .map(PathBuf::from)
    };
    let base = variable("XDG_CACHE_HOME").or_else(|| Some(variable("HOME")?.join(".cache")));
    base.map_or_else(
        || output.join("references"),
        |base| base.join("manylight").join("references"),
    )
}

impl Reference {
    /// Reads one that the user has.
    ///
    /// # Errors
    /// If it cannot be read, or has another size than the runs.
    pub(super) fn read(path: &Path, settings: &Settings) -> Result<Self> {
        let image = image::read_exr(path)?;
        if (image.width, image.height) != (settings.width, settings.height) {
            bail!(
                "{}: the reference is {} x {}, the runs are {} x {}; give --width and --height",
                path.display(),
                image.width,
                image.height,
                settings.width,
                settings.height
            );
        }
        let origin = path.display().to_string();
        let facts = Facts {
            origin,
            spp: 0,
            own_relmse: None,
        };
        Ok(Self { image, facts })
    }

    /// Takes it from the cache, or renders it with `spp` samples per pixel and puts it there; `None` if interrupted.
    ///
    /// # Errors
    /// Settings out of range, a cache that cannot be written.
    pub(super) fn get(
        scene: &Scene,
        camera: &Camera,
        settings: &Settings,
        spp: u64,
        cache: &Path,
        watch: &Watch,
    ) -> Result<Option<Self>> {
        let settings = Settings {
            method: Method::Exact,
            seed: SEED,
            light: light_cache::Settings::default(),
            ..settings.clone()
        };
        let key = key(scene, camera, &settings, spp)?;
        let (image_path, facts_path) = (cache.join(format!("{key}.exr")), cache.join(format!("{key}.json")));
        if let Some(found) = from_cache(&image_path, &facts_path) {
            return Ok(Some(found));
        }
        let mut frames = session::start(scene, camera, &settings)?;
        let budget = Budget {
            frames: Some(spp),
            seconds: None,
        };
        let what = format!("reference of {}, kept for next time", scene.parts.name);
        let mut half = None;
        session::render_frames(frames.as_mut(), budget, watch, &what, |state| {
            if state.film().spp() == spp / 2 {
                half = Some(state.film().image());
            }
        });
        if watch.stopped() {
            return Ok(None);
        }
        let image = frames.film().image();
        let facts = Facts {
            origin: format!("exact, {spp} samples per pixel, manylight {}", machine::VERSION),
            spp,
            own_relmse: half.and_then(|half| own_relmse(&image, &half, spp)),
        };
        std::fs::create_dir_all(cache).with_context(|| format!("{}: cannot make the cache folder", cache.display()))?;
        // The image first: without its facts a cached image does not count.
        image::write_exr(&image_path, image.width, image.height, &Channel::rgb("", &image), &[])?;
        output::write(&facts_path, &serde_json::to_vec_pretty(&facts)?)?;
        Ok(Some(Self { image, facts }))
    }

    /// Warns where the reference's own noise is a good part of the least error that was measured against it.
    pub(super) fn warn_if_noisy(&self, scene: &str, least_relmse: f64) {
        const NEGLIGIBLE: f64 = 0.1;
        if let Some(own) = self.facts.own_relmse
            && own > NEGLIGIBLE * least_relmse
        {
            message::warn(format!(
                "{scene}: the reference's own relMSE of about {} is not negligible beside the least error of {}; \
                 raise --reference-spp (now {})",
                table::number(own),
                table::number(least_relmse),
                self.facts.spp
            ));
        }
    }
}

fn from_cache(image: &Path, facts: &Path) -> Option<Reference> {
    let facts = serde_json::from_slice(&std::fs::read(facts).ok()?).ok()?;
    let image = image::read_exr(image).ok()?;
    Some(Reference { image, facts })
}

/// What relMSE a perfect image would show against `image`, by how far its first half and the rest are apart: these are
/// independent, and each has twice the variance of the whole. Unlike the pixels' variances this sees rare events, such
/// as a small lamp at the border of a pixel, that one half has missed.
fn own_relmse(image: &Image, half: &Image, spp: u64) -> Option<f64> {
    let first = (spp / 2) as f32 / spp as f32;
    let rest = |(whole, half): (&[f32; 3], &[f32; 3])| {
        // Never below 0, whatever rounding does.
        std::array::from_fn(|c| ((whole[c] - first * half[c]) / (1.0 - first)).max(0.0))
    };
    let other = Image {
        pixels: image.pixels.iter().zip(&half.pixels).map(rest).collect(),
        width: image.width,
        height: image.height,
    };
    Some(ImageError::between(half, &other)?.relmse / 4.0)
}

/// Names a reference by all that its pixels depend on: the scene's content, the camera, the settings, the version.
fn key(scene: &Scene, camera: &Camera, settings: &Settings, spp: u64) -> Result<String> {
    let mut hash = Fnv(0xCBF2_9CE4_8422_2325);
    let parts = &scene.parts;
    let told = write!(
        hash,
        "{} {spp} {camera:?} {}",
        machine::VERSION,
        serde_json::to_string(settings)?
    )
    .and_then(|()| {
        write!(hash, "{:?} {:?}", parts.materials, parts.instances)?;
        for mesh in &parts.meshes {
            write!(hash, "{:?} {:?} {:?}", mesh.positions, mesh.indices, mesh.materials)?;
            write!(hash, "{:?} {:?} {:?}", mesh.normals, mesh.uvs, mesh.uvs1)?;
        }
        for texture in &parts.textures {
            texture.texels.iter().flatten().for_each(|byte| hash.byte(*byte));
            write!(hash, "{:?} {} {}", texture.wrap, texture.srgb, texture.nearest)?;
        }
        write!(hash, "{:?}", scene.lights)
    });
    told.context("cannot name the reference")?;
    Ok(format!("{}-{:016x}", safe_name(&parts.name), hash.0))
}

/// A name without characters that file systems dislike.
pub(super) fn safe_name(name: &str) -> String {
    let safe = |c: char| {
        if c.is_ascii_alphanumeric() || "-_.".contains(c) {
            c
        } else {
            '-'
        }
    };
    name.chars().map(safe).collect()
}

/// FNV-1a, 64 bits (Fowler, Noll and Vo): the same on every machine and in every version of the standard library.
struct Fnv(u64);

impl Fnv {
    fn byte(&mut self, byte: u8) {
        self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x100_0000_01B3);
    }
}

impl Write for Fnv {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        text.bytes().for_each(|byte| self.byte(byte));
        Ok(())
    }
}
