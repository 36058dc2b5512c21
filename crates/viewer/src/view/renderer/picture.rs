//! Pictures of what was rendered, and what else people want to know about it.

use super::pace::REST;
use super::{Figures, Picture, Report, Stages, Worker};
use crate::machine;
use crate::view::views::{Shown, View};
use glam::{Vec2, Vec3};
use light_cache::ShadingPoint;
use rayon::prelude::*;
use render::image::{self, Channel};
use render::{Image, RenderError, Settings};
use scene::{PrimitiveId, Ray, Scene};
use std::path::Path;
use std::sync::PoisonError;
use std::time::{Duration, Instant};

/// From so many samples per pixel on the picture is shown as it is.
const CLEAN_SPP: u64 = 128;
/// Least time between two reports of what lights matter.
const BETWEEN_IMPORTANCES: Duration = Duration::from_millis(500);

impl Worker {
    /// Hands the picture over.
    pub(super) fn publish(&mut self) {
        let start = Instant::now();
        let (shown, made) = match self.shown() {
            Ok(Some(shown)) => shown,
            Ok(None) => return,
            Err(error) => {
                self.go_on_without_device(&error);
                return;
            }
        };
        let Some(stage) = &mut self.stage else { return };
        let (width, height) = stage.frames.size();
        let still = (width, height) == self.window && stage.changed.elapsed() >= REST;
        let learn_ms = stage.learned[1] * 1e3;
        let stats = stage.frames.stats();
        let rays = stats.rays_nearest + stats.rays_occluded;
        let sampler = stats.sampler.unwrap_or_default();
        let bytes_read = self.device.bytes_read();
        let picture = Picture {
            width,
            height,
            exposure: (self.view == View::Image).then(|| exposure_of(&shown.texels, width, height)),
            shown,
            figures: Figures {
                spp: stage.frames.spp(),
                still,
                on_gpu: self.device.renders(),
                size: (width, height),
                frame_ms: stage.seconds * 1e3,
                stages: Stages {
                    trace_ms: stage.seconds * 1e3 - learn_ms,
                    learn_ms,
                    ..made
                },
                bytes_read: bytes_read.saturating_sub(stage.bytes_read),
                rays_per_s: rays.saturating_sub(stage.rays) as f64
                    / stage.published.map_or(stage.seconds, |at| at.elapsed().as_secs_f64()),
                cells: sampler.cells,
                sampler_bytes: sampler.bytes,
                commands: self.received,
                input: stage.input.take(),
            },
        };
        (stage.rays, stage.bytes_read) = (rays, bytes_read);
        stage.published = Some(Instant::now());
        stage.showing = start.elapsed();
        *self.latest.lock().unwrap_or_else(PoisonError::into_inner) = Some(picture);
        (self.tell)(Report::Picture);
    }

    /// What was rendered, as it is to be shown, and what it took to make that of it. Where a device can make it, its film is not read back. `None`
    /// without a stage.
    ///
    /// # Errors
    /// [`RenderError::Gpu`] if the device is lost.
    fn shown(&mut self) -> Result<Option<(Shown, Stages)>, RenderError> {
        let Some(stage) = &self.stage else { return Ok(None) };
        let frames = stage.frames.as_ref();
        let is_image = self.view == View::Image;
        let clean = is_image && self.denoise && frames.spp() < CLEAN_SPP;
        if is_image && let Some(made) = self.device.picture(frames, &stage.camera, clean)? {
            let stages = Stages {
                read_ms: made.read_ms,
                history_ms: made.history_ms,
                denoise_ms: made.filter_ms,
                ..Stages::default()
            };
            return Ok(Some((Shown::radiance(made.texels), stages)));
        }
        let start = Instant::now();
        let film = frames.film();
        let mut stages = Stages {
            read_ms: start.elapsed().as_secs_f64() * 1e3,
            ..Stages::default()
        };
        let shown = if clean {
            let cleaned = self.cleaner.clean(film, &stage.camera);
            (stages.history_ms, stages.denoise_ms) = (cleaned.history_ms, cleaned.filter_ms);
            Shown::radiance(
                cleaned
                    .pixels
                    .par_iter()
                    .map(|pixel| pixel.extend(1.0).to_array())
                    .collect(),
            )
        } else {
            self.view.of(frames)
        };
        Ok(Some((shown, stages)))
    }

    /// Tells how probable each light is now, if anybody wants to know.
    pub(super) fn tell_importance(&mut self) {
        /// Rays through the picture, each way: more points are a better mean, fewer are sooner done.
        const GRID: u32 = 16;
        /// With very many lights fewer points are looked at.
        const MOST_QUERIES: usize = 4_000_000;
        let Some(stage) = &mut self.stage else { return };
        if !self.wants_importance
            || stage
                .importance_told
                .is_some_and(|at| at.elapsed() < BETWEEN_IMPORTANCES)
        {
            return;
        }
        let rays = stage.camera.rays(self.window.0, self.window.1);
        let window = Vec2::new(self.window.0 as f32, self.window.1 as f32);
        let centers = (0..GRID * GRID).map(|i| (Vec2::new((i % GRID) as f32, (i / GRID) as f32) + 0.5) / GRID as f32);
        let points = centers.filter_map(|share| {
            let ray = Ray {
                origin_ws: rays.origin_ws,
                direction_ws: rays.direction_ws(share * window),
                t_max: f32::INFINITY,
            };
            let hit = stage.scene.nearest(&ray, PrimitiveId::NONE)?;
            Some(shading_point(&stage.scene, &ray, &hit))
        });
        let points: Vec<ShadingPoint> = points.collect();
        let most = (MOST_QUERIES / stage.scene.lights.len().max(1)).max(1);
        let step = points.len().div_ceil(most).max(1);
        let points: Vec<ShadingPoint> = points.into_iter().step_by(step).collect();
        let importance = stage.frames.light_probabilities(&points);
        stage.importance_told = Some(Instant::now());
        (self.tell)(Report::Importance(importance));
    }

    /// Writes the picture as it is, linear, with what it is a picture of.
    ///
    /// # Errors
    /// If there is no picture yet; those of the file system.
    pub(super) fn save_exr(&self, path: &Path) -> anyhow::Result<()> {
        let Some(stage) = &self.stage else {
            anyhow::bail!("there is no picture yet")
        };
        let film = stage.frames.film();
        let mut channels = Channel::rgb("", &film.image()).to_vec();
        channels.push(Channel {
            name: "variance.V".into(),
            values: film.variance(),
        });
        let settings = Settings {
            width: film.width(),
            height: film.height(),
            ..self.settings.clone()
        };
        let pose = stage.camera.world_from_camera;
        let entry = |name: &str, value: String| (format!("manylight.{name}"), value);
        let metadata = [
            entry("version", machine::VERSION.into()),
            entry("scene", stage.scene.parts.name.clone()),
            entry("sampler", settings.method.name().into()),
            entry("spp", film.spp().to_string()),
            entry("world_from_camera", format!("{:?}", pose.to_cols_array())),
            entry("fov_y", stage.camera.fov_y.to_string()),
            entry("settings", serde_json::to_string(&settings)?),
        ];
        image::write_exr(path, film.width(), film.height(), &channels, &metadata)?;
        Ok(())
    }
}

/// The point that `hit` shades.
pub(in crate::view) fn shading_point(scene: &Scene, ray: &Ray, hit: &scene::Hit) -> ShadingPoint {
    let surface = scene.surface(ray, hit);
    ShadingPoint {
        position_ws: surface.position_ws,
        normal_ws: surface.bsdf.normal_ws,
        primary: true,
    }
}

/// The exposure that suits a picture: by the means of blocks, so that noise of single pixels does not count.
fn exposure_of(texels: &[[f32; 4]], width: u32, height: u32) -> f32 {
    const BLOCKS: u32 = 24;
    let (columns, rows) = (BLOCKS.min(width), BLOCKS.min(height));
    let block = |column: u32, row: u32| {
        let mut sum = Vec3::ZERO;
        let mut count = 0.0;
        for y in row * height / rows..(row + 1) * height / rows {
            for x in column * width / columns..(column + 1) * width / columns {
                let [r, g, b, _] = texels[(y * width + x) as usize];
                sum += Vec3::new(r, g, b);
                count += 1.0;
            }
        }
        (sum / count).to_array()
    };
    image::auto_exposure(&Image {
        width: columns,
        height: rows,
        pixels: (0..rows * columns).map(|i| block(i % columns, i / columns)).collect(),
    })
}
