//! Images that the passes hand to each other, and to pictures to come.

use super::layout::{GuidePixel, KnownPixel, Seen};
use crate::RenderError;
use crate::gpu::buffers::written;
use crate::gpu::device::Gpu;
use std::sync::atomic::Ordering;

/// A storage buffer that is made anew only if it is too small.
#[derive(Debug, Default)]
pub(super) struct Grown(Option<wgpu::Buffer>);

impl Grown {
    /// With room for so many records at least. What was in it may be gone.
    ///
    /// # Errors
    /// [`RenderError::Gpu`] if that is more than the device takes.
    pub(super) fn room<T>(&mut self, gpu: &Gpu, label: &str, records: u64) -> Result<wgpu::Buffer, RenderError> {
        let size = records * size_of::<T>() as u64;
        match &self.0 {
            Some(buffer) if buffer.size() >= size => Ok(buffer.clone()),
            _ => {
                // Never both at a time.
                self.0 = None;
                Ok(self.0.insert(written(gpu, label, size)?).clone())
            }
        }
    }
}

/// What later pictures want to know of one.
#[derive(Debug, Default)]
pub(super) struct Kept {
    guides: Grown,
    known: Grown,
    shown: Grown,
}

/// The buffers of [`Kept`].
#[derive(Clone, Debug)]
pub(super) struct KeptBuffers {
    pub(super) guides: wgpu::Buffer,
    pub(super) known: wgpu::Buffer,
    /// Radiance, and the samples that it rests on.
    pub(super) shown: wgpu::Buffer,
}

impl Kept {
    /// Of a picture of so many pixels.
    ///
    /// # Errors
    /// Those of [`Grown::room`].
    pub(super) fn room(&mut self, gpu: &Gpu, pixels: u64) -> Result<KeptBuffers, RenderError> {
        Ok(KeptBuffers {
            guides: self.guides.room::<GuidePixel>(gpu, "surfaces shown", pixels)?,
            known: self.known.room::<KnownPixel>(gpu, "light known", pixels)?,
            shown: self.shown.room::<[f32; 4]>(gpu, "picture shown", pixels)?,
        })
    }
}

/// A picture that was shown.
#[derive(Debug)]
pub(super) struct Past {
    pub(super) seen: Seen,
    /// Samples per pixel.
    pub(super) spp: u64,
    pub(super) kept: Kept,
    pub(super) buffers: KeptBuffers,
}

/// A buffer that the processor reads, made anew only if it is too small.
#[derive(Debug, Default)]
pub(super) struct Readback(Option<wgpu::Buffer>);

impl Readback {
    /// Copies the first `size` bytes of `buffer` once the rest of `encoder` is done, and hands them to `look`; `None` if the device is lost.
    pub(super) fn finish<T>(
        &mut self,
        gpu: &Gpu,
        mut encoder: wgpu::CommandEncoder,
        buffer: &wgpu::Buffer,
        size: u64,
        look: impl FnOnce(&[u8]) -> T,
    ) -> Option<T> {
        let copy = match self.0.take().filter(|copy| copy.size() >= size) {
            Some(copy) => copy,
            None => gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("picture read back"),
                size,
                usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                mapped_at_creation: false,
            }),
        };
        encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, size);
        gpu.queue.submit([encoder.finish()]);
        copy.map_async(wgpu::MapMode::Read, ..size, |_| {});
        if !gpu.wait() {
            return None;
        }
        let bytes = copy.get_mapped_range(..size).ok()?;
        gpu.read.fetch_add(size, Ordering::Relaxed);
        let result = look(&bytes);
        drop(bytes);
        copy.unmap();
        self.0 = Some(copy);
        Some(result)
    }
}
