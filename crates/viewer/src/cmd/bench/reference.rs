//! References: rendered by `exact`, kept on disk.

use crate::interrupt::Watch;
use crate::machine;
use crate::session::{self, Budget};
use anyhow::{Context, Result, bail};
use render::image::{self, Channel};
use render::{Image, ImageError, Method, Settings};
use scene::{Camera, Scene};
use serde::Serialize;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// What is measured against.
#[derive(Clone, Debug)]
pub(super) struct Reference {
    /// Both halves, or the whole where there are none.
    images: Vec<Image>,
    /// What is known about it.
    pub(super) facts: Facts,
}

/// What is known about a reference.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Facts {
    /// Where it comes from.
    pub(super) origin: String,
    /// Samples per pixel, those of both halves together; `None` if unknown.
    pub(super) spp: Option<u64>,
    /// How errors are measured against it, for people.
    pub(super) estimator: &'static str,
}

/// [`ImageError::against_halves`].
const BY_HALVES: &str = "cross product of two independent halves: noise of the reference adds no offset";

/// [`ImageError::between`].
const PLAIN: &str = "plain: noise of the reference counts as error";

/// Seeds of the halves. References draw other random numbers than any run: an error shared by both would not be seen.
const SEEDS: [u64; 2] = [0x9E37_79B9_7F4A_7C15, 0xD1B5_4A32_D192_ED03];

/// The user's cache folder for references, or one below `output` where there is none.
pub(super) fn default_cache(output: &Path) -> PathBuf {
    crate::output::cache_folder().map_or_else(|| output.join("references"), |folder| folder.join("references"))
}

impl Reference {
    /// Reads one that the user has: one image, or two that are independent of each other.
    ///
    /// # Errors
    /// If one cannot be read, or has another size than the runs; if there are more than two.
    pub(super) fn read(paths: &[PathBuf], settings: &Settings) -> Result<Self> {
        let images = paths.iter().map(|path| read_one(path, settings));
        let images = images.collect::<Result<Vec<Image>>>()?;
        let estimator = match images.as_slice() {
            [_] => PLAIN,
            [a, b] if a.pixels == b.pixels => {
                bail!("--reference: the two images are the same: give independent ones, or one")
            }
            [_, _] => BY_HALVES,
            _ => bail!("--reference is one image or two, {} are given", images.len()),
        };
        let names: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
        let facts = Facts {
            origin: names.join(" and "),
            spp: None,
            estimator,
        };
        Ok(Self { images, facts })
    }

    /// Takes it from the cache, or renders it with `spp` samples per pixel (rounded up to an even number), half of them
    /// in each of two images with different seeds, and puts it there; `None` if interrupted.
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
        let each = spp.div_ceil(2);
        let mut images = Vec::with_capacity(SEEDS.len());
        for (half, seed) in (1..).zip(SEEDS) {
            let settings = Settings {
                method: Method::Exact,
                seed,
                width: settings.width,
                height: settings.height,
                max_bounces: settings.max_bounces,
                pixel_filter: settings.pixel_filter,
                ..Settings::default()
            };
            let path = cache.join(key(scene, camera, &settings, each)? + ".exr");
            if let Ok(kept) = image::read_exr(&path) {
                images.push(kept);
                continue;
            }
            let mut frames = session::start(scene, camera, &settings)?;
            let budget = Budget {
                frames: Some(each),
                seconds: None,
                target_error: None,
            };
            let what = format!(
                "reference of {}, half {half} of 2, kept for next time",
                scene.parts.name
            );
            session::render_frames(frames.as_mut(), budget, watch, &what, |_| {})?;
            if watch.stopped() {
                return Ok(None);
            }
            let image = frames.film().image();
            std::fs::create_dir_all(cache)
                .with_context(|| format!("{}: cannot make the cache folder", cache.display()))?;
            image::write_exr(&path, image.width, image.height, &Channel::rgb("", &image), &[])?;
            images.push(image);
        }
        let facts = Facts {
            origin: format!("exact, 2 x {each} samples per pixel, manylight {}", machine::VERSION),
            spp: Some(2 * each),
            estimator: BY_HALVES,
        };
        Ok(Some(Self { images, facts }))
    }

    /// The best picture that there is: the mean of both halves, or the whole.
    pub(super) fn whole(&self) -> Image {
        let mut mean = self.images[0].clone();
        if let Some(other) = self.images.get(1) {
            let pairs = mean.pixels.iter_mut().zip(&other.pixels);
            pairs.for_each(|(a, b)| *a = std::array::from_fn(|c| 0.5 * (a[c] + b[c])));
        }
        mean
    }

    /// The error of `image`; `None` if it has another size.
    pub(super) fn error(&self, image: &Image) -> Option<ImageError> {
        match self.images.as_slice() {
            [a, b] => ImageError::against_halves(image, a, b),
            [whole] => ImageError::between(image, whole),
            _ => None,
        }
    }
}

/// An image of the size of the runs.
fn read_one(path: &Path, settings: &Settings) -> Result<Image> {
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
    Ok(image)
}

/// Names a reference by all that its pixels depend on: the scene's content, the camera, the settings, the version.
///
/// What only says how to get there is not part of it: all ways have one reference.
fn key(scene: &Scene, camera: &Camera, settings: &Settings, spp: u64) -> Result<String> {
    let mut hash = Fnv(0xCBF2_9CE4_8422_2325);
    let parts = &scene.parts;
    let told = write!(
        hash,
        "{} {spp} {camera:?} {} {} {} {:?} {}",
        machine::VERSION,
        settings.width,
        settings.height,
        settings.max_bounces,
        settings.pixel_filter,
        settings.seed
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
