//! The passes that make pictures for the eyes, compiled.

use crate::RenderError;
use crate::gpu::device::Gpu;
use crate::gpu::path_pass::group;
use crate::gpu::shader;
use light_cache::Scheme;

/// A compiled pass: one of `shaders/pass`, all of whose bindings are in group 3.
#[derive(Debug)]
pub(in crate::gpu) struct Compute(wgpu::ComputePipeline);

impl Compute {
    /// Compiles the pass of that name.
    ///
    /// # Errors
    /// [`RenderError::Gpu`] if the device is lost.
    pub(in crate::gpu) fn new(gpu: &Gpu, name: &str) -> Result<Self, RenderError> {
        // Whatever the sampler: these passes draw no lights.
        let text = shader::pass(name, Scheme::Uniform, false)?;
        gpu.compile(name, &text, &[]).map(Self)
    }

    /// Encodes it: `buffers` in the order of their bindings, `groups` of threads.
    pub(in crate::gpu) fn encode(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        buffers: &[&wgpu::Buffer],
        groups: [u32; 2],
    ) {
        let bindings: Vec<_> = (0..).zip(buffers.iter().copied()).collect();
        pass.set_pipeline(&self.0);
        pass.set_bind_group(3, &group(gpu, &self.0, 3, &bindings), &[]);
        pass.dispatch_workgroups(groups[0], groups[1], 1);
    }
}

/// All that take noise away.
#[derive(Debug)]
pub(super) struct Passes {
    pub(super) split: Compute,
    pub(super) recall: Compute,
    pub(super) vary: Compute,
    pub(super) atrous: Compute,
    pub(super) assemble: Compute,
    pub(super) typical: Compute,
    pub(super) resolve: Compute,
}

impl Passes {
    /// Compiles them.
    ///
    /// # Errors
    /// [`RenderError::Gpu`] if the device is lost.
    pub(super) fn new(gpu: &Gpu) -> Result<Self, RenderError> {
        let pass = |name| Compute::new(gpu, name);
        let passes = Self {
            split: pass("split")?,
            recall: pass("recall")?,
            vary: pass("vary")?,
            atrous: pass("atrous")?,
            assemble: pass("assemble")?,
            typical: pass("typical")?,
            resolve: pass("resolve")?,
        };
        gpu.keep_pipelines();
        Ok(passes)
    }
}
