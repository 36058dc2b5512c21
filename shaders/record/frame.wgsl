// What changes from frame to frame. Rust: crates/render/src/gpu/layout.rs

struct FrameParams {
    origin_ws: vec3<f32>,
    width: u32,
    corner_ws: vec3<f32>,
    height: u32,
    step_x_ws: vec3<f32>,
    // Sample number in the present sequence of random numbers.
    frame: u32,
    step_y_ws: vec3<f32>,
    // Weight of the frame in the image.
    weight: f32,
    seed: vec2<u32>,
    max_bounces: u32,
    light_samples: u32,
    // 1: the image starts anew.
    clear: u32,
    candidates: u32,
    // Observations that a pixel has room for.
    slots: u32,
    // What pixels know of the control variate: CONTROLS_NEW, or CONTROLS_LEARN since the sampler has just learned, or neither.
    controls: u32,
}

const CONTROLS_NEW: u32 = 1u;
const CONTROLS_LEARN: u32 = 2u;

@group(0) @binding(0) var<uniform> frame: FrameParams;
// The points of the Sobol' sequence by position, nibble and dimension.
@group(0) @binding(1) var<uniform> sobol_rows: array<vec4<u32>, 256>;
