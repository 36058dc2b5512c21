//! Progressive accumulation.

/// A finished image: linear RGB, Rec. 709 primaries, row 0 at the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// `width * height` pixels.
    pub pixels: Vec<[f32; 3]>,
}

/// Sums of samples per pixel (compensated), stored tile by tile so that tiles can be rendered in parallel.
#[derive(Clone, Debug)]
pub struct Film {
    width: u32,
    height: u32,
}

/// Auxiliary images, means over all samples (chosen light: of the last sample, unfiltered).
#[derive(Clone, Debug)]
pub struct Aovs {
    /// Diffuse albedo plus specular reflectance.
    pub albedo: Image,
    /// Shading normal, world space.
    pub normal: Image,
    /// World position, metres.
    pub position: Image,
    /// Distance from the camera, metres; infinite where nothing was hit.
    pub depth: Vec<f32>,
    /// Index of the light chosen at the first hit by the last sample; -1 for none.
    pub light: Vec<f32>,
}

impl Film {
    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The mean image so far; black before the first frame.
    pub fn image(&self) -> Image {
        unimplemented!("owner: render")
    }

    /// Per pixel the variance of the mean's luminance (sample variance / number of samples), row 0 first; 0 before the second frame.
    pub fn variance(&self) -> Vec<f32> {
        unimplemented!("owner: render")
    }

    /// Samples per pixel so far.
    pub fn spp(&self) -> u64 {
        unimplemented!("owner: render")
    }

    /// The auxiliary images, if they were asked for.
    pub fn aovs(&self) -> Option<Aovs> {
        unimplemented!("owner: render")
    }
}
