//! Running a few lines of WGSL on their own: what the functions of the shaders are compared with their twins by.

use super::buffers::{read, storage, uniform, written};
use super::device::Gpu;
use super::path_pass::group;
use super::shader::link;
use crate::RenderError;
use light_cache::Packed;

/// A kernel: an entry point `main` with 64 threads a group that reads words from `@group(3) @binding(0)` and writes words to
/// `@group(3) @binding(1)`.
#[derive(Clone, Copy, Debug)]
pub struct Kernel<'k> {
    /// Its text; imports are linked.
    pub text: &'k str,
    /// The sampler that `light_cache/sampler.wgsl` stands for, bound to group 2; `None` if the kernel does not import it.
    pub sampler: Option<&'k Packed>,
    /// Whether it uses the points of the Sobol' sequence.
    pub sobol: bool,
    /// Values of its switches that are not the default.
    pub switches: &'k [(&'k str, f64)],
}

impl Kernel<'_> {
    /// Runs `threads` threads on `input`; returns `output` words.
    ///
    /// # Errors
    /// [`RenderError::Gpu`] if the text is no valid shader or the device is lost.
    pub fn run(&self, gpu: &Gpu, input: &[u32], threads: u32, output: usize) -> Result<Vec<u32>, RenderError> {
        let scheme = self
            .sampler
            .map_or(light_cache::Scheme::Uniform, |packed| packed.scheme);
        let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("kernel"),
            source: wgpu::ShaderSource::Wgsl(link(self.text, scheme, false)?.into()),
        });
        let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("kernel"),
            layout: None,
            module: &module,
            entry_point: Some("main"),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: self.switches,
                ..Default::default()
            },
            cache: None,
        });
        let input = storage(gpu, "input", bytemuck::cast_slice(input))?;
        let results = written(gpu, "output", 4 * output as u64)?;
        let mut groups = vec![(3, group(gpu, &pipeline, 3, &[(0, &input), (1, &results)]))];
        if self.sobol {
            let rows = uniform(
                gpu,
                "sobol rows",
                bytemuck::cast_slice(sampling::sobol::reversed_rows()),
            );
            groups.push((0, group(gpu, &pipeline, 0, &[(1, &rows)])));
        }
        if let Some(packed) = self.sampler {
            let cache = storage(gpu, "light sampler", bytemuck::cast_slice(&packed.words))?;
            groups.push((2, group(gpu, &pipeline, 2, &[(0, &cache)])));
        }
        let mut encoder = gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&pipeline);
            for (index, group) in &groups {
                pass.set_bind_group(*index, group, &[]);
            }
            pass.dispatch_workgroups(threads.div_ceil(64), 1, 1);
        }
        gpu.queue.submit([encoder.finish()]);
        let words = read(gpu, &results, |bytes| bytemuck::cast_slice(bytes)[..output].to_vec());
        match (words, gpu.error()) {
            (Some(words), None) => Ok(words),
            (_, error) => Err(error.unwrap_or_else(|| gpu.gone())),
        }
    }
}
