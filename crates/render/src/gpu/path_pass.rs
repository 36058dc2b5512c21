//! The path pass: the shader specialised to scene, sampler and settings, and what it reads.

use super::buffers::{storage, uniform};
use super::device::Gpu;
use super::layout::FrameParams;
use super::scene::SceneBuffers;
use super::{refusal, shader};
use crate::{Method, RenderError, Settings};
use ::scene::Scene;
use light_cache::{LightSampler, Packed, Scheme};

/// Side of a workgroup of `path.wgsl`.
const GROUP: u32 = 8;

/// The pass, ready to be encoded.
pub(super) struct PathPass {
    scheme: Scheme,
    /// Values of the shader's switches that sampler and settings decide.
    switches: Vec<(&'static str, f64)>,
    /// [`FrameParams`].
    pub(super) params: wgpu::Buffer,
    sobol: wgpu::Buffer,
    scene: SceneBuffers,
    cache: wgpu::Buffer,
    bound: Bound,
}

/// A pipeline with what it reads: groups belong to the pipeline that they were made for.
struct Bound {
    /// Whether it makes auxiliary images.
    aovs: bool,
    pipeline: wgpu::ComputePipeline,
    frame_group: wgpu::BindGroup,
    scene_group: wgpu::BindGroup,
    cache_group: wgpu::BindGroup,
}

impl PathPass {
    /// Uploads scene and sampler and compiles the shader, for what `settings` ask for first.
    ///
    /// # Errors
    /// A scene that does not fit; those of [`PathPass::set_aovs`].
    pub(super) fn new<S: LightSampler>(
        gpu: &Gpu,
        scene: &Scene,
        sampler: &S,
        packed: &Packed,
        settings: &Settings,
    ) -> Result<Self, RenderError> {
        let resamples = matches!(settings.method, Method::Sampled(_)) && settings.candidates > 1;
        let guided = settings.max_bounces > 0 && sampler.guides();
        let heuristic = settings.mis.heuristic().map_or(4, |heuristic| heuristic as u32);
        let switches = vec![
            ("LEARNS", f64::from(u8::from(S::LEARNS))),
            ("CONTROLLED", f64::from(u8::from(sampler.is_controlled()))),
            ("RESAMPLES", f64::from(u8::from(resamples))),
            ("GUIDED", f64::from(u8::from(guided))),
            ("HEURISTIC", f64::from(heuristic)),
        ];
        let scene = SceneBuffers::new(gpu, scene)?;
        let params = uniform(gpu, "frame", bytemuck::bytes_of(&FrameParams::default()));
        let sobol = uniform(
            gpu,
            "sobol rows",
            bytemuck::cast_slice(sampling::sobol::reversed_rows()),
        );
        let cache = storage(gpu, "light sampler", bytemuck::cast_slice(&packed.words))?;
        let reads = Reads {
            params: &params,
            sobol: &sobol,
            scene: &scene,
            cache: &cache,
        };
        let bound = Bound::new(gpu, packed.scheme, &switches, &reads, settings.aovs)?;
        Ok(Self {
            scheme: packed.scheme,
            switches,
            params,
            sobol,
            scene,
            cache,
            bound,
        })
    }

    /// From now on with auxiliary images, or without. What was not needed before is compiled.
    ///
    /// # Errors
    /// [`RenderError::Setting`] if the device binds too few buffers for them; [`RenderError::Gpu`] if it is lost.
    pub(super) fn set_aovs(&mut self, gpu: &Gpu, aovs: bool) -> Result<(), RenderError> {
        if self.bound.aovs != aovs {
            self.bind(gpu, aovs)?;
        }
        Ok(())
    }

    /// From now on with this scene.
    ///
    /// # Errors
    /// As [`PathPass::new`].
    pub(super) fn set_scene(&mut self, gpu: &Gpu, scene: &Scene) -> Result<(), RenderError> {
        self.scene = SceneBuffers::new(gpu, scene)?;
        self.bind(gpu, self.bound.aovs)
    }

    /// From now on with what the sampler has learned.
    ///
    /// # Errors
    /// [`RenderError::Gpu`] if it does not fit.
    pub(super) fn set_sampler(&mut self, gpu: &Gpu, packed: &Packed) -> Result<(), RenderError> {
        let bytes: &[u8] = bytemuck::cast_slice(&packed.words);
        if bytes.len() as u64 <= self.cache.size() {
            gpu.queue.write_buffer(&self.cache, 0, bytes);
        } else {
            self.cache = storage(gpu, "light sampler", bytes)?;
            self.bound.cache_group = group(gpu, &self.bound.pipeline, 2, &[(0, &self.cache)]);
        }
        Ok(())
    }

    fn bind(&mut self, gpu: &Gpu, aovs: bool) -> Result<(), RenderError> {
        let reads = Reads {
            params: &self.params,
            sobol: &self.sobol,
            scene: &self.scene,
            cache: &self.cache,
        };
        self.bound = Bound::new(gpu, self.scheme, &self.switches, &reads, aovs)?;
        Ok(())
    }

    /// The group of what the pass writes: film, observations, and auxiliary sums where it makes them.
    pub(super) fn target_group(
        &self,
        gpu: &Gpu,
        film: &wgpu::Buffer,
        observations: &wgpu::Buffer,
        aovs: Option<&wgpu::Buffer>,
    ) -> wgpu::BindGroup {
        let mut buffers = vec![(0, film), (1, observations)];
        buffers.extend(aovs.map(|aovs| (2, aovs)));
        group(gpu, &self.bound.pipeline, 3, &buffers)
    }

    /// Encodes a frame of `width` x `height` pixels.
    pub(super) fn encode(&self, pass: &mut wgpu::ComputePass<'_>, target: &wgpu::BindGroup, width: u32, height: u32) {
        let Bound {
            pipeline,
            frame_group,
            scene_group,
            cache_group,
            ..
        } = &self.bound;
        pass.set_pipeline(pipeline);
        for (index, group) in (0..).zip([frame_group, scene_group, cache_group, target]) {
            pass.set_bind_group(index, group, &[]);
        }
        pass.dispatch_workgroups(width.div_ceil(GROUP), height.div_ceil(GROUP), 1);
    }
}

/// What the pass reads.
struct Reads<'r> {
    params: &'r wgpu::Buffer,
    sobol: &'r wgpu::Buffer,
    scene: &'r SceneBuffers,
    cache: &'r wgpu::Buffer,
}

impl Bound {
    fn new(
        gpu: &Gpu,
        scheme: Scheme,
        switches: &[(&'static str, f64)],
        reads: &Reads<'_>,
        aovs: bool,
    ) -> Result<Self, RenderError> {
        if aovs && !gpu.binds_aovs() {
            return Err(refusal(format!(
                "auxiliary images on {}, which binds too few buffers at a time",
                gpu.info()
            )));
        }
        let text = shader::pass("path", scheme, aovs)?;
        let mut constants = switches.to_vec();
        let of_scene = reads.scene.switches.iter();
        constants.extend(of_scene.map(|&(name, on)| (name, f64::from(u8::from(on)))));
        let pipeline = gpu.compile("path", &text, &constants)?;
        gpu.keep_pipelines();
        Ok(Self {
            aovs,
            frame_group: group(gpu, &pipeline, 0, &[(0, reads.params), (1, reads.sobol)]),
            scene_group: group(gpu, &pipeline, 1, &reads.scene.bindings()),
            cache_group: group(gpu, &pipeline, 2, &[(0, reads.cache)]),
            pipeline,
        })
    }
}

/// The bind group `index` of `pipeline`: buffers by their bindings.
pub(super) fn group(
    gpu: &Gpu,
    pipeline: &wgpu::ComputePipeline,
    index: u32,
    buffers: &[(u32, &wgpu::Buffer)],
) -> wgpu::BindGroup {
    let entries: Vec<_> = buffers
        .iter()
        .map(|&(binding, buffer)| wgpu::BindGroupEntry {
            binding,
            resource: buffer.as_entire_binding(),
        })
        .collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(index),
        entries: &entries,
    })
}
