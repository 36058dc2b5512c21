//! Records that frames share with `shaders/record`.

pub use crate::control::PixelControl;
use crate::film::AovRecord;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use light_cache::{Bounce, Observation, ShadingPoint};

/// What changes from frame to frame: `FrameParams` in `shaders/record/frame.wgsl`.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs, reason = "told in the shader, and in the settings of the same names")]
pub struct FrameParams {
    pub origin_ws: [f32; 3],
    pub width: u32,
    pub corner_ws: [f32; 3],
    pub height: u32,
    pub step_x_ws: [f32; 3],
    pub frame: u32,
    pub step_y_ws: [f32; 3],
    pub weight: f32,
    pub seed: [u32; 2],
    pub max_bounces: u32,
    pub light_samples: u32,
    pub clear: u32,
    pub candidates: u32,
    pub slots: u32,
    pub controls: u32,
}

impl FrameParams {
    /// [`FrameParams::controls`]: nothing is known yet.
    pub(crate) const CONTROLS_NEW: u32 = 1;
    /// [`FrameParams::controls`]: the sampler has just learned.
    pub(crate) const CONTROLS_LEARN: u32 = 2;
}

/// Sums of one pixel: `FilmPixel` in `shaders/record/film.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs, reason = "told in the shader")]
pub struct FilmPixel {
    pub hi: [f32; 4],
    pub lo: [f32; 4],
    pub weight_hi: f32,
    pub weight_lo: f32,
    pub count: u32,
    pub nonfinite: u32,
    pub rays_nearest: u32,
    pub rays_occluded: u32,
    pub pad0: u32,
    pub pad1: u32,
    pub control: PixelControl,
}

impl FilmPixel {
    /// R, G, B and luminance squared.
    pub(crate) fn sums(&self) -> [f64; 4] {
        std::array::from_fn(|channel| f64::from(self.hi[channel]) + f64::from(self.lo[channel]))
    }

    /// Sum of the weights.
    pub(crate) fn weight(&self) -> f64 {
        f64::from(self.weight_hi) + f64::from(self.weight_lo)
    }
}

/// Auxiliary sums of one pixel: `AovPixel` in `shaders/record/aov.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs, reason = "told in the shader")]
pub struct AovPixel {
    pub hi: [f32; 12],
    pub lo: [f32; 12],
    pub depth_hi: f32,
    pub depth_lo: f32,
    pub hits: u32,
    pub light: u32,
}

impl AovPixel {
    /// The same as the CPU keeps it, of `count` samples.
    pub(crate) fn get(&self, count: u32) -> AovRecord {
        let mut sums = [f64::from(self.depth_hi) + f64::from(self.depth_lo); 13];
        for (sum, (hi, lo)) in sums.iter_mut().zip(self.hi.iter().zip(&self.lo)) {
            *sum = f64::from(*hi) + f64::from(*lo);
        }
        AovRecord {
            sums,
            count,
            hits: self.hits,
            light: if self.light == u32::MAX { -1 } else { self.light.into() },
        }
    }
}

/// What a vertex found out about a light: `Observation` in `shaders/record/film.wgsl`.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs, reason = "told in the shader, and in `light_cache::Observation`")]
pub struct PackedObservation {
    pub position_ws: [f32; 3],
    pub light: u32,
    pub normal_ws: [f32; 3],
    pub flags: u32,
    pub unshadowed: f32,
    pub irradiance: f32,
    pub pmf: f32,
    pub bounce_radiance: f32,
}

impl PackedObservation {
    const PRIMARY: u32 = 1;
    const VISIBLE: u32 = 2;
    const FOR_MANY: u32 = 4;
    const BOUNCE: u32 = 8;
    /// The first of the bits that tell the part of the hemisphere.
    const PART: u32 = 8;

    /// `None` for a slot that was not used. `weight`: for how many it stands if it stands for many.
    pub(crate) fn get(&self, weight: u32) -> Option<Observation> {
        let is = |flag: u32| self.flags & flag != 0;
        let bounce = Bounce {
            part: (self.flags >> Self::PART) as u16,
            radiance: self.bounce_radiance,
        };
        (self.light != u32::MAX).then(|| Observation {
            point: ShadingPoint {
                position_ws: Vec3::from(self.position_ws),
                normal_ws: Vec3::from(self.normal_ws),
                primary: is(Self::PRIMARY),
            },
            light: self.light,
            unshadowed: self.unshadowed,
            irradiance: self.irradiance,
            pmf: self.pmf,
            visible: is(Self::VISIBLE),
            weight: if is(Self::FOR_MANY) { weight } else { 1 },
            bounce: is(Self::BOUNCE).then_some(bounce),
        })
    }
}

/// How a frame's observations are thinned: `LessonParams` in `shaders/record/lesson.wgsl`.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs, reason = "told in the shader, and in `light_cache::Thinning`")]
pub struct LessonParams {
    pub frame: u32,
    pub stride: u32,
    pub pad0: u32,
    pub pad1: u32,
}

/// How many observations there are: `LessonCounters` in `shaders/record/lesson.wgsl`.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs, reason = "told in the shader")]
pub struct LessonCounters {
    pub observed: u32,
    pub kept: u32,
    pub runs: u32,
    pub pad: u32,
}

/// Observations of one tile: `Run` in `shaders/record/lesson.wgsl`.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs, reason = "told in the shader")]
pub struct Run {
    pub frame: u32,
    pub tile: u32,
    pub first: u32,
    pub count: u32,
    pub weight: u32,
}
