//! What renders for the window: a device if one is asked for, or else the processor, which takes over where the device cannot.

use super::messages::Report;
use crate::cli::Backend;
use crate::session::{self, BackEnd};
use anyhow::Result;
use render::gpu::{Cleaner, DevicePicture};
use render::{FrameLoop, RenderError, Settings};
use scene::{Camera, Scene};
use std::sync::Arc;
use std::time::Duration;

/// Told before shaders are compiled.
pub(super) const COMPILING: &str = "the GPU's shaders are compiled; at first this may take a while";
/// A device that is taken away goes after so long: in the middle of a frame.
const LOST_AFTER: Duration = Duration::from_millis(30);

/// What renders.
pub(super) struct Device {
    wanted: Backend,
    /// Opened when it is first used.
    open: Option<BackEnd>,
    /// Whether the GPU renders what is shown now.
    renders: bool,
    /// What earlier pictures of the GPU knew, for the eyes.
    cleaner: Cleaner,
}

impl Device {
    pub(super) fn new(wanted: Backend) -> Self {
        Self {
            wanted,
            open: None,
            renders: false,
            cleaner: Cleaner::default(),
        }
    }

    /// Whether the GPU renders what is shown now.
    pub(super) fn renders(&self) -> bool {
        self.renders
    }

    /// Starts a rendering, on the processor if the device cannot; says so then.
    ///
    /// # Errors
    /// Those of [`session::start`].
    pub(super) fn start(
        &mut self,
        scene: &Arc<Scene>,
        camera: &Camera,
        settings: &Settings,
        tell: &dyn Fn(Report),
    ) -> Result<Box<dyn FrameLoop<'static>>> {
        self.renders = false;
        if self.wanted == Backend::Gpu {
            // This alone is rendered elsewhere: with other settings the device can go on.
            if let Err(error) = render::gpu::check(settings) {
                tell(Report::Trouble(format!("{error}: this is rendered on the CPU")));
            } else {
                tell(Report::Trouble(COMPILING.into()));
                match self.start_on_device(scene, camera, settings) {
                    Ok(frames) => {
                        self.renders = true;
                        return Ok(frames);
                    }
                    Err(error) => self.give_up(&format!("{error:#}"), tell),
                }
            }
        }
        session::start(scene.clone(), camera, settings)
    }

    fn start_on_device(
        &mut self,
        scene: &Arc<Scene>,
        camera: &Camera,
        settings: &Settings,
    ) -> Result<Box<dyn FrameLoop<'static>>> {
        let back_end = match &self.open {
            Some(open) => open.clone(),
            None => self.open.insert(BackEnd::open(self.wanted)?).clone(),
        };
        back_end.start(scene.clone(), camera, settings)
    }

    /// The picture of what `frames` have rendered, made by the device that holds it, without most of its noise if it is to be `clean`; `None` if it is not
    /// on a device, or if a picture finds no room there.
    ///
    /// # Errors
    /// [`RenderError::Gpu`] if the device is lost.
    pub(super) fn picture(
        &mut self,
        frames: &dyn FrameLoop<'_>,
        camera: &Camera,
        clean: bool,
    ) -> Result<Option<DevicePicture>, RenderError> {
        let Some(film) = frames.device_film() else {
            return Ok(None);
        };
        let made = if clean {
            self.cleaner.clean(&film, camera)
        } else {
            self.cleaner.image(&film)
        };
        match (made, film.fault()) {
            (_, Some(fault)) => Err(fault),
            (made, None) => Ok(made.ok()),
        }
    }

    /// Forgets what earlier pictures knew: another scene.
    pub(super) fn forget(&mut self) {
        self.cleaner.forget();
    }

    /// Bytes that were read back from the device since it was opened; 0 if there is none.
    pub(super) fn bytes_read(&self) -> u64 {
        match &self.open {
            Some(BackEnd::Gpu(gpu)) => gpu.bytes_read(),
            _ => 0,
        }
    }

    /// Takes the device away in a moment, whatever it does then, as a driver that fails: for tests.
    pub(super) fn lose(&self) {
        if let Some(BackEnd::Gpu(gpu)) = &self.open {
            let gpu = gpu.clone();
            std::thread::spawn(move || {
                std::thread::sleep(LOST_AFTER);
                gpu.destroy();
            });
        }
    }

    /// The device does not work: the processor goes on, until somebody chooses the device again.
    pub(super) fn give_up(&mut self, why: &str, tell: &dyn Fn(Report)) {
        *self = Self::new(Backend::Cpu);
        tell(Report::Trouble(format!(
            "{why}; the CPU goes on (the settings have the choice)"
        )));
        tell(Report::Device(Backend::Cpu));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sampling::PixelSampler;
    use std::cell::RefCell;

    /// Without a GPU in sight: what it lacks is known beforehand.
    #[test]
    fn what_the_device_cannot_do_is_done_on_the_cpu_and_said() {
        let scene = Arc::new(scene::load("demo:one-light").expect("it is generated"));
        let settings = Settings {
            width: 4,
            height: 4,
            pixel_sampler: PixelSampler::Halton,
            ..Settings::default()
        };
        let told = RefCell::new(Vec::new());
        let tell = |report| told.borrow_mut().push(report);
        let mut device = Device::new(Backend::Gpu);
        let camera = scene.parts.cameras[0].clone();
        let mut frames = device.start(&scene, &camera, &settings, &tell).expect("the CPU can");
        assert!(frames.render_frame_unless(&std::sync::atomic::AtomicBool::new(false)));
        assert!(!device.renders());
        device.give_up("it is gone", &tell);
        assert_eq!(device.wanted, Backend::Cpu);
        let told = told.into_inner();
        assert!(
            matches!(&told[..], [Report::Trouble(first), Report::Trouble(second), Report::Device(Backend::Cpu)]
                if first.contains("halton") && second.contains("it is gone")),
            "{told:?}"
        );
    }
}
