//! The window's surface: picture and panels are drawn over each other, and can be read back.

use super::picture_pass::{PicturePass, begin_pass};
use super::renderer::Picture;
use crate::exit::Refusal;
use crate::output;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use winit::event_loop::ActiveEventLoop;
use winit::window::Window;

/// What to do if there is no adapter.
const NO_ADAPTER: &str = "the window needs a GPU driver that does Vulkan or OpenGL ES 3; none was found. Install one (on Debian, \
    mesa-vulkan-drivers works without a GPU), or use `manylight render`, which needs none";

/// A window that can be drawn to.
pub(super) struct Display {
    window: Arc<Window>,
    instance: wgpu::Instance,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    device: wgpu::Device,
    queue: wgpu::Queue,
    adapter: String,
    lost: Arc<AtomicBool>,
    picture: PicturePass,
    panels: egui_wgpu::Renderer,
    /// Drawn so far.
    frames: u64,
}

/// The panels of a frame, ready to be drawn.
pub(super) struct Panels {
    pub(super) shapes: Vec<egui::ClippedPrimitive>,
    pub(super) textures: egui::TexturesDelta,
    pub(super) pixels_per_point: f32,
}

/// What is in the window, 8 bits per channel.
#[derive(Clone, Debug)]
pub(super) struct Capture {
    pub(super) width: u32,
    pub(super) height: u32,
    /// RGB, row 0 at the top.
    pub(super) pixels: Vec<u8>,
}

impl Capture {
    /// Writes it as a PNG.
    ///
    /// # Errors
    /// Those of the file system.
    pub(super) fn write(&self, path: &Path) -> anyhow::Result<()> {
        output::write_with(path, |file| {
            let encoder = PngEncoder::new(file);
            Ok(encoder.write_image(&self.pixels, self.width, self.height, ExtendedColorType::Rgb8)?)
        })
    }
}

impl Display {
    /// Prepares `window` for drawing.
    ///
    /// # Errors
    /// [`Refusal::NoGpu`], with the remedy.
    pub(super) fn new(event_loop: &ActiveEventLoop, window: Arc<Window>) -> anyhow::Result<Self> {
        let refuse = |what: String| Refusal::NoGpu(format!("{what}; {NO_ADAPTER}"));
        let display = Box::new(event_loop.owned_display_handle());
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_with_display_handle_from_env(display));
        let surface = instance
            .create_surface(window.clone())
            .map_err(|error| refuse(format!("the window cannot be drawn to ({error})")))?;
        let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions {
            compatible_surface: Some(&surface),
            ..Default::default()
        }))
        .map_err(|error| refuse(format!("no adapter ({error})")))?;
        let limits = wgpu::Limits::downlevel_defaults().using_resolution(adapter.limits());
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("window"),
            required_limits: limits,
            ..Default::default()
        }))
        .map_err(|error| refuse(format!("the adapter gives no device ({error})")))?;
        let lost = Arc::new(AtomicBool::new(false));
        let (by_callback, by_error) = (lost.clone(), lost.clone());
        device.set_device_lost_callback(move |_, _| by_callback.store(true, Ordering::Relaxed));
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            crate::message::warn(format!("GPU: {error}"));
            if matches!(error, wgpu::Error::OutOfMemory { .. }) {
                by_error.store(true, Ordering::Relaxed);
            }
        }));

        let size = window.inner_size();
        let mut config = surface
            .get_default_config(&adapter, size.width.max(1), size.height.max(1))
            .ok_or_else(|| refuse("the adapter cannot draw to the window".into()))?;
        // Picture and panels are encoded for the display already: a format that encodes again would wash them out.
        let formats = surface.get_capabilities(&adapter).formats;
        let plain = [wgpu::TextureFormat::Bgra8Unorm, wgpu::TextureFormat::Rgba8Unorm];
        if let Some(format) = plain.into_iter().find(|format| formats.contains(format)) {
            config.format = format;
        }
        config.present_mode = wgpu::PresentMode::AutoVsync;
        // One frame in flight: what is shown is as new as can be.
        config.desired_maximum_frame_latency = 1;
        surface.configure(&device, &config);

        let info = adapter.get_info();
        Ok(Self {
            picture: PicturePass::new(&device, config.format),
            panels: egui_wgpu::Renderer::new(&device, config.format, egui_wgpu::RendererOptions::default()),
            adapter: format!("{} ({})", info.name, info.backend),
            window,
            instance,
            surface,
            config,
            device,
            queue,
            lost,
            frames: 0,
        })
    }

    /// The adapter's name and interface.
    pub(super) fn adapter(&self) -> &str {
        &self.adapter
    }

    /// Largest side of a texture.
    pub(super) fn max_texture_side(&self) -> usize {
        self.device.limits().max_texture_dimension_2d as usize
    }

    /// Whether the device is lost or out of memory: nothing can be drawn any more.
    pub(super) fn is_lost(&self) -> bool {
        self.lost.load(Ordering::Relaxed)
    }

    /// Frames that it has drawn.
    pub(super) fn frames(&self) -> u64 {
        self.frames
    }

    /// Gives up the device, as a driver that fails does: for tests.
    pub(super) fn lose(&self) {
        self.device.destroy();
    }

    /// The window has another size; 0 is taken as minimised.
    pub(super) fn resize(&mut self, width: u32, height: u32) {
        let most = self.device.limits().max_texture_dimension_2d;
        if width > 0 && height > 0 && (self.config.width, self.config.height) != (width, height) {
            (self.config.width, self.config.height) = (width.min(most), height.min(most));
            self.surface.configure(&self.device, &self.config);
        }
    }

    /// Shows another picture from the next frame on.
    pub(super) fn show(&mut self, picture: &Picture) -> bool {
        let size = (picture.width, picture.height);
        self.picture.upload(&self.device, &self.queue, size, &picture.shown)
    }

    /// Draws the frame, top to bottom, and reads it back if asked for. A surface that is not ready is tried again at the next frame.
    pub(super) fn draw(&mut self, panels: &Panels, exposure: f32, capture: bool) -> Option<Capture> {
        // Tells whether the device is still there: what the panels need cannot be had from one that is not.
        let polled = self.device.poll(wgpu::PollType::Poll);
        if polled.is_err() || self.is_lost() {
            self.lost.store(true, Ordering::Relaxed);
            return None;
        }
        for (id, delta) in panels
            .textures
            .set
            .iter()
            .flat_map(|(id, deltas)| deltas.iter().map(move |delta| (id, delta)))
        {
            self.panels.update_texture(&self.device, &self.queue, *id, delta);
        }
        let screen = egui_wgpu::ScreenDescriptor {
            size_in_pixels: [self.config.width, self.config.height],
            pixels_per_point: panels.pixels_per_point,
        };
        let mut encoder = self
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let more = self
            .panels
            .update_buffers(&self.device, &self.queue, &mut encoder, &panels.shapes, &screen);
        self.picture.prepare(&self.queue, &mut encoder, exposure);

        let copy = capture.then(|| self.offscreen());
        if let Some(copy) = &copy {
            let view = copy.create_view(&Default::default());
            self.compose(&mut encoder, &view, panels, &screen);
        }
        let surface = self.next_texture();
        if let Some(surface) = &surface {
            let view = surface.texture.create_view(&Default::default());
            self.compose(&mut encoder, &view, panels, &screen);
        }
        self.queue.submit(more.into_iter().chain([encoder.finish()]));
        if let Some(surface) = surface {
            self.window.pre_present_notify();
            self.queue.present(surface);
        }
        for id in &panels.textures.free {
            self.panels.free_texture(id);
        }
        self.frames += 1;
        copy.and_then(|copy| self.read(&copy))
    }

    /// Picture, then panels.
    fn compose(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        view: &wgpu::TextureView,
        panels: &Panels,
        screen: &egui_wgpu::ScreenDescriptor,
    ) {
        let mut pass = begin_pass(encoder, "window", view).forget_lifetime();
        self.picture.draw(&mut pass);
        self.panels.render(&mut pass, &panels.shapes, screen);
    }

    /// The surface's next texture; `None` if it has none now.
    fn next_texture(&mut self) -> Option<wgpu::SurfaceTexture> {
        use wgpu::CurrentSurfaceTexture as Now;
        match self.surface.get_current_texture() {
            Now::Success(texture) => Some(texture),
            Now::Suboptimal(texture) => {
                // Usable; the right one comes with the event of the new size.
                Some(texture)
            }
            Now::Outdated => {
                self.surface.configure(&self.device, &self.config);
                None
            }
            Now::Lost => {
                match self.instance.create_surface(self.window.clone()) {
                    Ok(surface) => {
                        self.surface = surface;
                        self.surface.configure(&self.device, &self.config);
                    }
                    Err(_) => self.lost.store(true, Ordering::Relaxed),
                }
                None
            }
            _ => None,
        }
    }

    fn offscreen(&self) -> wgpu::Texture {
        self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("capture"),
            size: wgpu::Extent3d {
                width: self.config.width,
                height: self.config.height,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: self.config.format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        })
    }

    /// The texture's pixels; `None` if the device does not give them.
    fn read(&self, texture: &wgpu::Texture) -> Option<Capture> {
        let (width, height) = (texture.width(), texture.height());
        let row_bytes = (width * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("capture"),
            size: u64::from(row_bytes) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row_bytes),
                    rows_per_image: None,
                },
            },
            texture.size(),
        );
        self.queue.submit([encoder.finish()]);
        let (sender, mapped) = mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            let _ = sender.send(result);
        });
        self.device.poll(wgpu::PollType::wait_indefinitely()).ok()?;
        mapped.recv().ok()?.ok()?;
        let bytes = buffer.get_mapped_range(..).ok()?;
        let swapped = self.config.format == wgpu::TextureFormat::Bgra8Unorm;
        let mut pixels = Vec::with_capacity((width * height * 3) as usize);
        for row in bytes.chunks(row_bytes as usize) {
            for texel in row[..width as usize * 4].chunks(4) {
                let [a, g, b] = [texel[0], texel[1], texel[2]];
                pixels.extend(if swapped { [b, g, a] } else { [a, g, b] });
            }
        }
        Some(Capture { width, height, pixels })
    }
}
