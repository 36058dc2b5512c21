//! Making buffers and reading them back.

use super::device::Gpu;
use crate::RenderError;
use std::sync::atomic::Ordering;
use wgpu::BufferUsages;

/// Least size of a buffer: bindings of nothing are not allowed.
const LEAST: u64 = 256;

/// A read-only storage buffer that holds `bytes`.
///
/// # Errors
/// [`RenderError::Gpu`] if it is larger than the device takes.
pub(super) fn storage(gpu: &Gpu, label: &str, bytes: &[u8]) -> Result<wgpu::Buffer, RenderError> {
    if let Some(error) = gpu.refuses(label, bytes.len() as u64) {
        return Err(error);
    }
    Ok(filled(gpu, label, bytes, BufferUsages::STORAGE))
}

/// A uniform buffer that holds `bytes`.
pub(super) fn uniform(gpu: &Gpu, label: &str, bytes: &[u8]) -> wgpu::Buffer {
    filled(gpu, label, bytes, BufferUsages::UNIFORM)
}

/// A buffer that holds `bytes`, a multiple of 4. Not mapped at creation: that panics if the device has just been lost.
fn filled(gpu: &Gpu, label: &str, bytes: &[u8], usage: BufferUsages) -> wgpu::Buffer {
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: (bytes.len() as u64).max(LEAST),
        usage: usage | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    gpu.queue.write_buffer(&buffer, 0, bytes);
    buffer
}

/// A storage buffer of zeros that the device writes.
///
/// # Errors
/// As [`storage`].
pub(super) fn written(gpu: &Gpu, label: &str, size: u64) -> Result<wgpu::Buffer, RenderError> {
    if let Some(error) = gpu.refuses(label, size) {
        return Err(error);
    }
    Ok(gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: size.max(LEAST),
        usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    }))
}

/// Copies a buffer to the CPU and hands its bytes to `look`, those included that make up the least size; `None` if the device is lost.
pub(super) fn read<T>(gpu: &Gpu, buffer: &wgpu::Buffer, look: impl FnOnce(&[u8]) -> T) -> Option<T> {
    read_start(gpu, buffer, buffer.size() as usize, look)
}

/// The same with the first `size` bytes alone, a multiple of 4.
pub(super) fn read_start<T>(gpu: &Gpu, buffer: &wgpu::Buffer, size: usize, look: impl FnOnce(&[u8]) -> T) -> Option<T> {
    if size == 0 {
        // Aligned as what is mapped is, for those who look at it as records.
        const NOTHING: &[u64] = &[];
        return Some(look(bytemuck::cast_slice(NOTHING)));
    }
    let copy = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("read back"),
        size: size as u64,
        usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = gpu
        .device
        .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, size as u64);
    gpu.queue.submit([encoder.finish()]);
    copy.map_async(wgpu::MapMode::Read, .., |_| {});
    if !gpu.wait() {
        return None;
    }
    let bytes = copy.get_mapped_range(..).ok()?;
    gpu.read.fetch_add(size as u64, Ordering::Relaxed);
    Some(look(&bytes))
}
