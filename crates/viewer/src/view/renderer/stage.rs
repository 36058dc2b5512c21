//! What is rendered, and how it begins.

use super::{Report, Worker};
use glam::Vec3;
use light_cache::SamplerKind;
use render::{FrameLoop, Method, RenderError, Settings};
use scene::{Camera, Scene};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// What is rendered.
pub(super) struct Stage {
    /// As it was loaded.
    pub(super) base: Arc<Scene>,
    /// As it is now.
    pub(super) scene: Arc<Scene>,
    pub(super) camera: Camera,
    pub(super) frames: Box<dyn FrameLoop<'static>>,
    /// When the picture last became worthless.
    pub(super) changed: Instant,
    /// The first input that no picture shows yet.
    pub(super) input: Option<Instant>,
    pub(super) published: Option<Instant>,
    pub(super) importance_told: Option<Instant>,
    /// Rays traced until the last picture.
    pub(super) rays: u64,
    /// Bytes read back from the device until then, for whatever.
    pub(super) bytes_read: u64,
    /// What the last frames took.
    pub(super) seconds: f64,
    /// What it took to make the last picture of what was rendered.
    pub(super) showing: Duration,
    /// Seconds of learning until the last frames, and in them.
    pub(super) learned: [f64; 2],
    /// A part of the scene could not be read, and that was told.
    pub(super) incomplete: bool,
}

impl Worker {
    /// Starts to render `scene`, having learned nothing.
    pub(super) fn enter(&mut self, base: Arc<Scene>, scene: Arc<Scene>, camera: Camera) -> anyhow::Result<()> {
        self.stage = None;
        self.resolution.forget();
        let (width, height) = self.resolution.moving_size(self.window);
        let settings = Settings {
            width,
            height,
            aovs: self.needs_aovs(),
            ..self.settings.clone()
        };
        let frames = self.device.start(&scene, &camera, &settings, &self.tell)?;
        self.stage = Some(Stage {
            base,
            scene,
            camera,
            frames,
            changed: Instant::now(),
            input: None,
            published: None,
            importance_told: None,
            rays: 0,
            bytes_read: self.device.bytes_read(),
            seconds: 0.0,
            showing: Duration::ZERO,
            learned: [0.0; 2],
            incomplete: false,
        });
        Ok(())
    }

    /// [`Worker::enter`] with what is there.
    pub(super) fn begin_anew(&mut self) -> anyhow::Result<()> {
        match self.stage.take() {
            Some(Stage {
                base, scene, camera, ..
            }) => self.enter(base, scene, camera),
            None => Ok(()),
        }
    }

    /// [`Worker::enter`] with what is there, on the processor: the device has failed.
    pub(super) fn go_on_without_device(&mut self, why: &RenderError) {
        self.device.give_up(&why.to_string(), &self.tell);
        if let Err(error) = self.begin_anew() {
            (self.tell)(Report::Trouble(format!("{error:#}")));
        }
    }

    /// The picture has become worthless.
    pub(super) fn touch(&mut self) {
        if let Some(stage) = &mut self.stage {
            stage.frames.restart();
            stage.changed = Instant::now();
        }
    }

    /// Goes on under other light. What was learned stays, where the sampler can use it.
    pub(super) fn relight(&mut self, factors: &[(u32, Vec3)]) -> anyhow::Result<()> {
        let Some(stage) = &mut self.stage else { return Ok(()) };
        stage.scene = if factors.is_empty() {
            stage.base.clone()
        } else {
            Arc::new(stage.base.relit(factors))
        };
        // What these know of the lights is fixed when they are built, and they lose nothing when they are built again.
        let built_anew = matches!(
            self.settings.method,
            Method::Sampled(SamplerKind::Uniform | SamplerKind::Power | SamplerKind::Tree)
        );
        if built_anew {
            return self.begin_anew();
        }
        stage.frames.set_scene(stage.scene.clone().into())?;
        stage.changed = Instant::now();
        Ok(())
    }
}
