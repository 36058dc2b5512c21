//! The picture on the GPU: uploaded, brought through the tone curve in its own size, stretched over the window.

use super::views::Shown;

/// What the renderer's texels are stored as.
const UPLOADED: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;
/// The picture after the tone curve, encoded for the display.
const TONED: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// Pipelines, and the picture that is shown.
#[derive(Debug)]
pub(super) struct PicturePass {
    tone_map: wgpu::RenderPipeline,
    enlarge: wgpu::RenderPipeline,
    sampler: wgpu::Sampler,
    params: wgpu::Buffer,
    written: Option<Params>,
    picture: Option<Textures>,
}

/// Uniforms of `tone_map.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Params {
    /// Factor on radiance.
    exposure: f32,
    tone_mapped: bool,
}

impl Params {
    fn to_bytes(self) -> [u8; 8] {
        let [a, b] = [self.exposure.to_bits(), u32::from(self.tone_mapped)].map(u32::to_le_bytes);
        [a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]]
    }
}

/// The textures of a picture of one size.
#[derive(Debug)]
struct Textures {
    uploaded: wgpu::Texture,
    toned: wgpu::TextureView,
    read_uploaded: wgpu::BindGroup,
    read_toned: wgpu::BindGroup,
    tone_mapped: bool,
    /// The toned texture is not up to date.
    stale: bool,
}

impl PicturePass {
    /// Compiles the pipelines; `target` is the format of the window.
    pub(super) fn new(device: &wgpu::Device, target: wgpu::TextureFormat) -> Self {
        let tone_map = wgpu::include_wgsl!("../../../../shaders/tone_map.wgsl");
        let enlarge = wgpu::include_wgsl!("../../../../shaders/enlarge.wgsl");
        Self {
            tone_map: pipeline(device, "tone_map", tone_map, TONED),
            enlarge: pipeline(device, "enlarge", enlarge, target),
            sampler: device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("enlarge"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                ..Default::default()
            }),
            params: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("tone_map"),
                // A uniform buffer is at least 16 bytes where WebGL rules.
                size: 16,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            written: None,
            picture: None,
        }
    }

    /// Takes another picture; one larger than the device's textures is left out, and false returned.
    pub(super) fn upload(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        size: (u32, u32),
        shown: &Shown,
    ) -> bool {
        if size.0.max(size.1) > device.limits().max_texture_dimension_2d {
            return false;
        }
        let extent = wgpu::Extent3d {
            width: size.0,
            height: size.1,
            depth_or_array_layers: 1,
        };
        if self
            .picture
            .as_ref()
            .is_none_or(|picture| picture.uploaded.size() != extent)
        {
            self.picture = Some(self.textures(device, extent));
        }
        let Some(picture) = &mut self.picture else { return false };
        let bytes: Vec<u8> = shown
            .texels
            .iter()
            .flatten()
            .flat_map(|value| value.to_le_bytes())
            .collect();
        queue.write_texture(
            picture.uploaded.as_image_copy(),
            &bytes,
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(size.0 * 16),
                rows_per_image: None,
            },
            extent,
        );
        picture.tone_mapped = shown.tone_mapped;
        picture.stale = true;
        true
    }

    fn textures(&self, device: &wgpu::Device, size: wgpu::Extent3d) -> Textures {
        let texture = |label, format, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size,
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: usage | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            })
        };
        let uploaded = texture("picture", UPLOADED, wgpu::TextureUsages::COPY_DST);
        let toned = texture("toned picture", TONED, wgpu::TextureUsages::RENDER_ATTACHMENT);
        let toned = toned.create_view(&Default::default());
        let bind = |label, pipeline: &wgpu::RenderPipeline, view, second| {
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(label),
                layout: &pipeline.get_bind_group_layout(0),
                entries: &[
                    wgpu::BindGroupEntry {
                        binding: 0,
                        resource: wgpu::BindingResource::TextureView(view),
                    },
                    wgpu::BindGroupEntry {
                        binding: 1,
                        resource: second,
                    },
                ],
            })
        };
        let view = uploaded.create_view(&Default::default());
        Textures {
            read_uploaded: bind("tone_map", &self.tone_map, &view, self.params.as_entire_binding()),
            read_toned: bind(
                "enlarge",
                &self.enlarge,
                &toned,
                wgpu::BindingResource::Sampler(&self.sampler),
            ),
            uploaded,
            toned,
            tone_mapped: true,
            stale: true,
        }
    }

    /// Brings the picture through the tone curve at `exposure` stops, if anything has changed since the last time.
    pub(super) fn prepare(&mut self, queue: &wgpu::Queue, encoder: &mut wgpu::CommandEncoder, exposure: f32) {
        let Some(picture) = &mut self.picture else { return };
        let params = Params {
            exposure: exposure.exp2(),
            tone_mapped: picture.tone_mapped,
        };
        if !picture.stale && self.written == Some(params) {
            return;
        }
        queue.write_buffer(&self.params, 0, &params.to_bytes());
        self.written = Some(params);
        picture.stale = false;
        let mut pass = begin_pass(encoder, "tone_map", &picture.toned);
        pass.set_pipeline(&self.tone_map);
        pass.set_bind_group(0, &picture.read_uploaded, &[]);
        pass.draw(0..3, 0..1);
    }

    /// Draws the picture over the whole target of `pass`; nothing before the first picture.
    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        if let Some(picture) = &self.picture {
            pass.set_pipeline(&self.enlarge);
            pass.set_bind_group(0, &picture.read_toned, &[]);
            pass.draw(0..3, 0..1);
        }
    }
}

/// A pass that clears `view` and draws to it.
pub(super) fn begin_pass<'e>(
    encoder: &'e mut wgpu::CommandEncoder,
    label: &str,
    view: &wgpu::TextureView,
) -> wgpu::RenderPass<'e> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color {
                    r: 0.06,
                    g: 0.065,
                    b: 0.075,
                    a: 1.0,
                }),
                store: wgpu::StoreOp::Store,
            },
        })],
        ..Default::default()
    })
}

fn pipeline(
    device: &wgpu::Device,
    label: &str,
    source: wgpu::ShaderModuleDescriptor<'_>,
    target: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(source);
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(label),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("whole_target"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("main"),
            compilation_options: Default::default(),
            targets: &[Some(target.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
