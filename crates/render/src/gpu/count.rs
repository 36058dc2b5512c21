//! What a film's pixels have counted, without reading the film back.

use super::buffers::{read, written};
use super::clean::Compute;
use super::device::Gpu;
use super::layout::FilmPixel;
use crate::RenderError;
use crate::path::Counters;
use bytemuck::{Pod, Zeroable};

/// Pixels that a workgroup of `shaders/pass/count.wgsl` counts.
const COUNTED: u64 = 64 * 32;

/// What pixels have counted: `Count` in `shaders/record/count.wgsl`.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs, reason = "told in the shader")]
pub struct Count {
    pub rays_nearest: [u32; 2],
    pub rays_occluded: [u32; 2],
    pub nonfinite: [u32; 2],
}

impl Count {
    fn get(&self) -> Counters {
        let word = |[low, high]: [u32; 2]| u64::from(high) << 32 | u64::from(low);
        Counters {
            rays_nearest: word(self.rays_nearest),
            rays_occluded: word(self.rays_occluded),
            nonfinite: word(self.nonfinite),
        }
    }
}

/// The pass that counts.
#[derive(Debug)]
pub(super) struct CountPass(Compute);

impl CountPass {
    pub(super) fn new(gpu: &Gpu) -> Result<Self, RenderError> {
        Compute::new(gpu, "count").map(Self)
    }

    /// What the pixels of `film` have counted; `None` if the device is lost.
    pub(super) fn run(&self, gpu: &Gpu, film: &wgpu::Buffer) -> Option<Counters> {
        let groups = (film.size() / size_of::<FilmPixel>() as u64).div_ceil(COUNTED);
        let counts = written(gpu, "counts", groups * size_of::<Count>() as u64).ok()?;
        let mut encoder = gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("count") });
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            let groups = u32::try_from(groups).ok()?;
            self.0.encode(gpu, &mut pass, &[film, &counts], [groups, 1]);
        }
        gpu.queue.submit([encoder.finish()]);
        read(gpu, &counts, |bytes| {
            let counts = bytes.chunks_exact(size_of::<Count>());
            let sum = |sum: Counters, bytes: &[u8]| sum + bytemuck::pod_read_unaligned::<Count>(bytes).get();
            counts.fold(Counters::default(), sum)
        })
    }
}
