// A picture for the eyes, and the one before it. Rust: crates/render/src/gpu/clean/layout.rs

// From where a picture is seen, and its size.
// twin: crates/render/src/clean/projection.rs Projection
struct Seen {
    // Columns of the transform from world space to the camera's.
    x_axis: vec3<f32>,
    // Half of the picture's width and height at unit distance.
    half_width: f32,
    y_axis: vec3<f32>,
    half_height: f32,
    z_axis: vec3<f32>,
    // Pixels; 0: there is no such picture.
    width: u32,
    translation: vec3<f32>,
    height: u32,
}

struct CleanParams {
    now: Seen,
    before: Seen,
    // Samples per pixel.
    spp: f32,
    // Height of a pixel at unit distance.
    pixel_size: f32,
    // Variance of a mean over what its samples' squares exceed its own square by; 0 for one sample.
    variance_scale: f32,
    pad: f32,
}

// The surface that a pixel shows.
// twin: crates/render/src/clean/frame.rs Guide
struct Guide {
    // World space.
    normal: vec3<f32>,
    // Edge of the pixel there, metres, seen head-on; 0 where there is no surface that reflects.
    footprint: f32,
    // World space, metres; of lamps too.
    position: vec3<f32>,
    // Metres from the camera; FAR where there is nothing.
    depth: f32,
}

// How the light on a surface becomes a picture: light * reflected + added.
struct Tint {
    reflected: vec3<f32>,
    pad0: f32,
    added: vec3<f32>,
    pad1: f32,
}

// What is known about the light on a pixel's surface.
// twin: crates/render/src/clean/history.rs Known
struct Known {
    irradiance: vec3<f32>,
    // Mean of the luminance's square over the samples.
    luminance_sq: f32,
    // Samples that it rests on; 0: nothing is known.
    samples: f32,
    // Sum of the squares of the samples' shares: the variance of the mean over that of a sample.
    spread: f32,
    pad0: f32,
    pad1: f32,
}

@group(3) @binding(0) var<uniform> clean: CleanParams;

// Whether a pixel is one of the picture's.
fn is_inside(at: vec2<u32>) -> bool {
    return at.x < clean.now.width && at.y < clean.now.height;
}

fn pixel_at(at: vec2<u32>) -> u32 {
    return at.y * clean.now.width + at.x;
}
