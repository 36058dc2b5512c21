//! Records that pictures for the eyes share with `shaders/record/clean.wgsl`.

use crate::Projection;
use bytemuck::{Pod, Zeroable};

/// From where a picture is seen, and its size: `Seen` in the shader.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs, reason = "told in the shader")]
pub struct Seen {
    pub x_axis: [f32; 3],
    pub half_width: f32,
    pub y_axis: [f32; 3],
    pub half_height: f32,
    pub z_axis: [f32; 3],
    pub width: u32,
    pub translation: [f32; 3],
    pub height: u32,
}

impl Seen {
    pub(super) fn new(projection: &Projection, width: u32, height: u32) -> Self {
        let matrix = projection.camera_from_world;
        Self {
            x_axis: matrix.x_axis.to_array(),
            half_width: projection.half.x,
            y_axis: matrix.y_axis.to_array(),
            half_height: projection.half.y,
            z_axis: matrix.z_axis.to_array(),
            width,
            translation: matrix.translation.to_array(),
            height,
        }
    }
}

/// What changes from picture to picture: `CleanParams` in the shader.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs, reason = "told in the shader")]
pub struct CleanParams {
    pub now: Seen,
    pub before: Seen,
    pub spp: f32,
    pub pixel_size: f32,
    pub variance_scale: f32,
    pub pad: f32,
}

/// The surface that a pixel shows: `Guide` in the shader.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs, reason = "told in the shader")]
pub struct GuidePixel {
    pub normal: [f32; 3],
    pub footprint: f32,
    pub position: [f32; 3],
    pub depth: f32,
}

/// How light becomes a picture: `Tint` in the shader.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs, reason = "told in the shader")]
pub struct TintPixel {
    pub reflected: [f32; 3],
    pub pad0: f32,
    pub added: [f32; 3],
    pub pad1: f32,
}

/// What is known about the light on a pixel's surface: `Known` in the shader.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs, reason = "told in the shader")]
pub struct KnownPixel {
    pub irradiance: [f32; 3],
    pub luminance_sq: f32,
    pub samples: f32,
    pub spread: f32,
    pub pad0: f32,
    pub pad1: f32,
}
