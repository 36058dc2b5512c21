//! The scene on the device.

use super::buffers::{storage, uniform};
use super::device::Gpu;
use crate::RenderError;
use crate::error::GpuFault;
use ::scene::Scene;
use ::scene::packed::NONE;

/// Entries of the stack in `shaders/trace/bvh.wgsl`.
const STACK: usize = 160;

/// The scene's buffers, in the order of their bindings.
#[derive(Debug)]
pub(super) struct SceneBuffers {
    buffers: [wgpu::Buffer; 6],
    /// Values of the shaders' switches: what the scene lacks is not compiled.
    pub(super) switches: [(&'static str, bool); 3],
}

impl SceneBuffers {
    /// Uploads `scene`.
    ///
    /// # Errors
    /// [`RenderError::Gpu`] if it is too large for the device.
    pub(super) fn new(gpu: &Gpu, scene: &Scene) -> Result<Self, RenderError> {
        let too_large = |what: &str| GpuFault::OutOfMemory.error(format!("{what}; use --backend cpu"));
        let flat = scene.bvh().flat(&scene.parts);
        if let Some(fault) = scene.fault() {
            return Err(RenderError::Scene(fault.to_string()));
        }
        if flat.stack + flat.top_stack > STACK {
            return Err(too_large("the scene's tree is deeper than the GPU back end walks"));
        }
        let packed = scene
            .packed(&flat)
            .ok_or_else(|| too_large("the scene has more than 2^32 words"))?;
        debug_assert!(flat.fixed.is_none_or(|root| root != NONE));
        Ok(Self {
            buffers: [
                uniform(gpu, "scene", bytemuck::bytes_of(&packed.params)),
                storage(gpu, "scene: nodes", bytemuck::cast_slice(flat.nodes()))?,
                storage(gpu, "scene: triangles", bytemuck::cast_slice(flat.packs()))?,
                storage(gpu, "scene: lights", bytemuck::cast_slice(&packed.lights))?,
                storage(gpu, "scene: details", bytemuck::cast_slice(&packed.details))?,
                storage(gpu, "scene: textures", bytemuck::cast_slice(&packed.texels))?,
            ],
            switches: [
                ("HAS_INSTANCES", packed.has_instances),
                ("HAS_MASKS", packed.has_masks),
                ("HAS_DETAIL", packed.has_detail),
            ],
        })
    }

    /// The buffers with their bindings in group 1.
    pub(super) fn bindings(&self) -> Vec<(u32, &wgpu::Buffer)> {
        (0..).zip(&self.buffers).collect()
    }
}
