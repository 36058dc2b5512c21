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
    /// Its parts, independent of each other and equally good: at least one.
    parts: Vec<Image>,
    /// What is known about it.
    pub(super) facts: Facts,
}

/// What is known about a reference.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Facts {
    /// Where it comes from.
    pub(super) origin: String,
    /// Samples per pixel, those of all parts together; `None` if unknown.
    pub(super) spp: Option<u64>,
    /// How errors are measured against it, for people.
    pub(super) estimator: &'static str,
}

/// How [`ImageError::against_parts`] measures with so many parts.
fn estimator(parts: usize) -> &'static str {
    match parts {
        1 => "plain: noise of the reference counts as error",
        2 => {
            "cross product of two independent parts, relative to their mean: noise of the reference adds an offset where it is large"
        }
        _ => {
            "cross products of two of the independent parts, relative to the others: noise of the reference adds no offset"
        }
    }
}

/// In how many parts references come. Where paths bounce all pixels are noisy, and what makes errors relative must be independent of the rest, or noise counts
/// as error. In direct light `exact` is noisy at the borders of lamps only, where a third part that misses the lamp would weigh the error of a pixel too much by far:
/// there the mean of two does better.
fn part_count(settings: &Settings) -> usize {
    if settings.max_bounces > 0 { 3 } else { 2 }
}

/// Seeds of the parts. References draw other random numbers than any run: an error shared by both would not be seen.
const SEEDS: [u64; 3] = [0x9E37_79B9_7F4A_7C15, 0xD1B5_4A32_D192_ED03, 0x8CB9_2BA7_2F3D_8DD7];

/// The user's cache folder for references, or one below `output` where there is none.
pub(super) fn default_cache(output: &Path) -> PathBuf {
    crate::output::cache_folder().map_or_else(|| output.join("references"), |folder| folder.join("references"))
}

impl Reference {
    /// Reads one that the user has: one image, or several that are independent of each other.
    ///
    /// # Errors
    /// If one cannot be read, or has another size than the runs; if two are the same.
    pub(super) fn read(paths: &[PathBuf], settings: &Settings) -> Result<Self> {
        let parts = paths.iter().map(|path| read_one(path, settings));
        let parts = parts.collect::<Result<Vec<Image>>>()?;
        for (k, part) in parts.iter().enumerate() {
            if let Some(j) = parts[..k].iter().position(|other| other.pixels == part.pixels) {
                bail!(
                    "--reference: {} and {} are the same image: give independent ones, rendered with other seeds, or one",
                    paths[j].display(),
                    paths[k].display()
                );
            }
        }
        let names: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
        let facts = Facts {
            origin: names.join(", "),
            spp: None,
            estimator: estimator(parts.len()),
        };
        Ok(Self { parts, facts })
    }

    /// Takes it from the cache, or renders it with `spp` samples per pixel (rounded up to as many in each part),
    /// each part with a seed of its own, and puts it there; `None` if interrupted.
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
        let count = part_count(settings);
        let each = spp.div_ceil(count as u64);
        let mut parts = Vec::with_capacity(count);
        for (number, &seed) in (1..).zip(&SEEDS[..count]) {
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
                parts.push(kept);
                continue;
            }
            let mut frames = session::start(scene, camera, &settings)?;
            let budget = Budget {
                frames: Some(each),
                seconds: None,
                target_error: None,
            };
            let what = format!(
                "reference of {}, part {number} of {count}, kept for next time",
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
            parts.push(image);
        }
        let facts = Facts {
            origin: format!(
                "exact, {} x {each} samples per pixel, manylight {}",
                parts.len(),
                machine::VERSION
            ),
            spp: Some(parts.len() as u64 * each),
            estimator: estimator(parts.len()),
        };
        Ok(Some(Self { parts, facts }))
    }

    /// The best picture that there is: the mean of the parts.
    pub(super) fn whole(&self) -> Image {
        let share = 1.0 / self.parts.len() as f32;
        let mut mean = self.parts[0].clone();
        for (i, pixel) in mean.pixels.iter_mut().enumerate() {
            *pixel = std::array::from_fn(|c| share * self.parts.iter().map(|part| part.pixels[i][c]).sum::<f32>());
        }
        mean
    }

    /// The error of `image`; `None` if it has another size.
    pub(super) fn error(&self, image: &Image) -> Option<ImageError> {
        ImageError::against_parts(image, &self.parts)
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
